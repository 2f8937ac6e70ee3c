"""Linear quadratic regulators along a trajectory, over a finite time."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, SupportsIndex

import numpy as np

from sheldrake.common._options import Options
from sheldrake.systems.analysis import SimulatorConfig
from sheldrake.systems.controllers._lqr import _square
from sheldrake.systems.framework import InputPortSelection, LeafSystem, OutputPortSelection, System
from sheldrake.systems.primitives import FirstOrderTaylorApproximation
from sheldrake.trajectories import PiecewisePolynomial, Trajectory

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._vector import BasicVector

_SAMPLES = 201
"""At how many times the solution is sampled for the trajectories returned."""


class FiniteHorizonLinearQuadraticRegulatorOptions(Options):
    """Options of `FiniteHorizonLinearQuadraticRegulator`.

    Attributes:
        Qf: Cost of the final state, shape `(n, n)`; zero if None.
        N: Cost of products of state and input, shape `(n, m)`; zero if None.
        x0: The state about which the system is linearized, a trajectory; that of the context if None.
        u0: The input about which the system is linearized, a trajectory; that of the context if None.
        xd: The desired state, a trajectory; x0 if None.
        ud: The desired input, a trajectory; u0 if None.
        input_port_index: Which input is controlled.
        use_square_root_method: Accepted; the equation is solved in its ordinary form with tight tolerances.
        simulator_config: Its `accuracy` is the largest relative error, unless that is coarser than 1e-8.
    """

    Qf: np.ndarray | None = None
    N: np.ndarray | None = None
    x0: Trajectory | None = None
    u0: Trajectory | None = None
    xd: Trajectory | None = None
    ud: Trajectory | None = None
    input_port_index: InputPortSelection | SupportsIndex = InputPortSelection.kUseFirstInputIfItExists
    use_square_root_method: bool = False
    simulator_config: SimulatorConfig = SimulatorConfig()

    def __repr__(self) -> str:
        return (
            f"FiniteHorizonLinearQuadraticRegulatorOptions(Qf={self.Qf!r}, N={self.N!r}, "
            f"input_port_index={self.input_port_index!s}, use_square_root_method={self.use_square_root_method!r}, "
            f"simulator_config={self.simulator_config!r})"
        )


class FiniteHorizonLinearQuadraticRegulatorResult(NamedTuple):
    """u = u0 - K (x - x0) - k0, at the cost (x - x0)'S(x - x0) + 2 (x - x0)'sx + s0; all are trajectories."""

    x0: Trajectory
    u0: Trajectory
    K: Trajectory
    S: Trajectory
    k0: Trajectory
    sx: Trajectory
    s0: Trajectory


class _Problem:
    """The Riccati equation of one call, backwards in time (Anderson and Moore 1990, section 2.3)."""

    def __init__(
        self,
        system: System,
        context: Context,
        t0: float,
        tf: float,
        Q: ArrayLike,
        R: ArrayLike,
        options: FiniteHorizonLinearQuadraticRegulatorOptions,
    ):
        call = "FiniteHorizonLinearQuadraticRegulator"
        system.ValidateContext(context)
        if not tf > t0:
            raise RuntimeError(f"{call}(): tf must be after t0; they are {tf} and {t0} s.")
        if not context.has_only_continuous_state():
            raise RuntimeError(f"{call}(): the system must have continuous state and no other.")
        index = options.input_port_index
        self.port = system.get_input_port(0 if isinstance(index, InputPortSelection) else int(index))
        self.system, self.context = system, context.Clone()
        n, m = context.num_continuous_states(), self.port.size()
        x = np.array(context.get_continuous_state_vector().CopyToVector(), dtype=float)
        self.x0 = PiecewisePolynomial(x.reshape(-1, 1)) if options.x0 is None else options.x0
        if options.u0 is not None:
            self.u0 = options.u0
        elif self.port.HasValue(context):
            self.u0 = PiecewisePolynomial(np.array(self.port.Eval(context), dtype=float).reshape(-1, 1))
        else:
            raise RuntimeError(f"{call}(): give options.u0, or fix the input {self.port.get_name()!r} in the context.")
        self.xd, self.ud = options.xd or self.x0, options.ud or self.u0
        self.Q, self.R = _square(call, "Q", Q, n), _square(call, "R", R, m)
        if np.linalg.eigvalsh(self.R).min() <= 0.0:
            raise RuntimeError(f"{call}(): R must be positive definite")
        self.R_inverse = np.linalg.inv(self.R)
        self.Qf = np.zeros((n, n)) if options.Qf is None else _square(call, "Qf", options.Qf, n)
        self.N = np.zeros((n, m)) if options.N is None else np.array(options.N, dtype=float).reshape(n, m)
        self.n, self.call = n, call
        self._constant: tuple | None = None
        self.varies = options.x0 is not None or options.u0 is not None

    def linearization(self, t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A, B and c: deviations from x0, u0 obey x' = A x + B u + c."""
        if self._constant is not None:
            return self._constant
        x0, u0 = self.x0.value(t)[:, 0], self.u0.value(t)[:, 0]
        self.context.SetTime(t)
        self.context.SetContinuousState(x0)
        self.port.FixValue(self.context, u0)
        index = self.port.get_index()
        affine = FirstOrderTaylorApproximation(self.system, self.context, index, OutputPortSelection.kNoOutput)
        x0_dot = self.x0.EvalDerivative(t)[:, 0] if self.x0.has_derivative() else np.zeros(self.n)
        A, B = affine.A(), affine.B()
        out = A, B, affine.f0() + A @ x0 + B @ u0 - x0_dot
        if not self.varies:
            self._constant = out
        return out

    def final(self, tf: float) -> np.ndarray:
        """S, sx and s0 at the end, flat."""
        e = self.xd.value(tf)[:, 0] - self.x0.value(tf)[:, 0]
        return np.concatenate([self.Qf.ravel(), -self.Qf @ e, [e @ self.Qf @ e]])

    def split(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """S, sx and s0 from the flat vector."""
        n = self.n
        S = y[: n * n].reshape(n, n)
        return (S + S.T) / 2.0, y[n * n : n * n + n], float(y[-1])

    def gains(self, t: float, S: np.ndarray, sx: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """K and k0."""
        _, B, _ = self.linearization(t)
        return self.R_inverse @ (self.N + S @ B).T, self.R_inverse @ (self.input_error(t) + B.T @ sx)

    def input_error(self, t: float) -> np.ndarray:
        """Gradient of the cost by the input, at x0 and u0; half of it."""
        return -self.R @ self._deviation(self.ud, self.u0, t) - self.N.T @ self._deviation(self.xd, self.x0, t)

    @staticmethod
    def _deviation(desired: Trajectory, nominal: Trajectory, t: float) -> np.ndarray:
        return desired.value(t)[:, 0] - nominal.value(t)[:, 0]

    def rates(self, t: float, y: np.ndarray) -> np.ndarray:
        """Time derivatives of S, sx and s0, flat."""
        S, sx, _ = self.split(y)
        A, B, c = self.linearization(t)
        e, d = self._deviation(self.xd, self.x0, t), self._deviation(self.ud, self.u0, t)
        NSB, r = self.N + S @ B, self.input_error(t) + B.T @ sx
        S_dot = -(self.Q - NSB @ self.R_inverse @ NSB.T + S @ A + A.T @ S)
        sx_dot = -(-self.Q @ e - self.N @ d - NSB @ self.R_inverse @ r + A.T @ sx + S @ c)
        cost = e @ self.Q @ e + d @ self.R @ d + 2.0 * e @ self.N @ d
        s0_dot = -(cost - r @ self.R_inverse @ r + 2.0 * sx @ c)
        return np.concatenate([S_dot.ravel(), sx_dot, [s0_dot]])


def FiniteHorizonLinearQuadraticRegulator(
    system: System,
    context: Context,
    t0: float,
    tf: float,
    Q: ArrayLike,
    R: ArrayLike,
    options: FiniteHorizonLinearQuadraticRegulatorOptions | None = None,
) -> FiniteHorizonLinearQuadraticRegulatorResult:
    """Returns the regulator that minimizes ∫ (x-xd)'Q(x-xd) + (u-ud)'R(u-ud) + 2(x-xd)'N(u-ud) from t0 to tf.

    The system is linearized about x0(t) and u0(t). See the options and the result for what the letters mean.

    Args:
        system: With continuous state only; converts to AutoDiffXd.
        context: Its parameters, and the state and input to linearize about unless `options` gives trajectories.
        t0: Start [s].
        tf: End [s].
        Q: Shape `(n, n)`, symmetric.
        R: Shape `(m, m)`, symmetric and positive definite.
        options: Everything else.

    Raises:
        RuntimeError: sizes do not fit, R is not positive definite, the state is not continuous, or no input is given.
    """
    from scipy.integrate import solve_ivp

    options = options or FiniteHorizonLinearQuadraticRegulatorOptions()
    problem = _Problem(system, context, float(t0), float(tf), Q, R, options)
    times = np.linspace(float(t0), float(tf), _SAMPLES)
    accuracy = min(1e-8, float(options.simulator_config.accuracy))
    solution = solve_ivp(
        problem.rates,
        (tf, t0),
        problem.final(tf),
        method="DOP853",
        t_eval=times[::-1],
        rtol=accuracy,
        atol=1e-3 * accuracy,
    )
    if not solution.success:
        raise RuntimeError(f"{problem.call}(): the Riccati equation could not be solved: {solution.message}")
    parts = [problem.split(y) for y in solution.y.T[::-1]]
    rates = [problem.split(problem.rates(t, y)) for t, y in zip(times, solution.y.T[::-1])]
    gains = [problem.gains(t, S, sx) for t, (S, sx, _) in zip(times, parts)]

    def hermite(i: int, shape: tuple[int, int]) -> Trajectory:
        values, slopes = ([np.reshape(p[i], shape) for p in sequence] for sequence in (parts, rates))
        return PiecewisePolynomial.CubicHermite(times, values, slopes)

    def smooth(i: int, cols: int) -> Trajectory:
        values = [np.reshape(g[i], (-1, cols)) for g in gains]
        return PiecewisePolynomial.CubicWithContinuousSecondDerivatives(times, values)

    n = problem.n
    return FiniteHorizonLinearQuadraticRegulatorResult(
        problem.x0, problem.u0, smooth(0, n), hermite(0, (n, n)), smooth(1, 1), hermite(1, (n, 1)), hermite(2, (1, 1))
    )


class _Regulator(LeafSystem):
    """u = u0 - K (x - x0) - k0."""

    def __init__(self, result: FiniteHorizonLinearQuadraticRegulatorResult):
        super().__init__()
        self._result = result
        self.DeclareVectorInputPort("plant_state", result.x0.rows())
        self.DeclareVectorOutputPort("command", result.u0.rows(), self._calc_command)

    def _calc_command(self, context: Context, output: BasicVector) -> None:
        t, r = context.get_time(), self._result
        deviation = np.array(self.get_input_port(0).Eval(context)) - r.x0.value(t)[:, 0]
        output.SetFromVector(r.u0.value(t)[:, 0] - r.K.value(t) @ deviation - r.k0.value(t)[:, 0])


def MakeFiniteHorizonLinearQuadraticRegulator(
    system: System,
    context: Context,
    t0: float,
    tf: float,
    Q: ArrayLike,
    R: ArrayLike,
    options: FiniteHorizonLinearQuadraticRegulatorOptions | None = None,
) -> System:
    """Returns the regulator of `FiniteHorizonLinearQuadraticRegulator` as a system from plant_state to command."""
    return _Regulator(FiniteHorizonLinearQuadraticRegulator(system, context, t0, tf, Q, R, options))
