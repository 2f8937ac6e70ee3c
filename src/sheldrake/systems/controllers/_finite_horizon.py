"""Linear quadratic regulators along a trajectory, over a finite time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, SupportsIndex

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._options import Options
from sheldrake.systems.analysis import SimulatorConfig
from sheldrake.systems.controllers._kernels.regulators import regulate
from sheldrake.systems.controllers._lqr import symmetric_matrix
from sheldrake.systems.controllers._riccati_flow import hamiltonian, maps_of
from sheldrake.systems.framework import InputPortSelection, LeafSystem, OutputPortSelection, System
from sheldrake.systems.framework._engine.linear_rows import ByComplexSteps, rows_of_motion
from sheldrake.systems.primitives import AffineSystem
from sheldrake.systems.primitives._linearization import motion_and_slopes
from sheldrake.systems.primitives._trajectory_systems import pieces_of
from sheldrake.trajectories import PiecewisePolynomial, Trajectory
from sheldrake.trajectories._pieces import as_piecewise_polynomial, is_piecewise

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike

    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._vector import BasicVector

_FEWEST, _MOST = 48, 10000
"""How many pairs of steps the solution is made of at least, and how many come to those before at most."""
_ACCURACY = 1e-6
"""Relative one of S, sx and s0."""


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
        use_square_root_method: Accepted; the solution here is positive semidefinite without it.
        simulator_config: Its `accuracy` is the largest relative error, unless that is coarser than 1e-6.
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
        self.Q, self.R = symmetric_matrix(call, "Q", Q, n), symmetric_matrix(call, "R", R, m)
        if np.linalg.eigvalsh(self.R).min() <= 0.0:
            raise RuntimeError(f"{call}(): R must be positive definite")
        self.Qf = np.zeros((n, n)) if options.Qf is None else symmetric_matrix(call, "Qf", options.Qf, n)
        self.N = np.zeros((n, m)) if options.N is None else np.array(options.N, dtype=float).reshape(n, m)
        self.n, self.m, self.call, self.t0, self.tf = n, m, call, t0, tf
        self._at(t0, t0)  # all inputs have values
        rows = rows_of_motion(system, self.context, n, int(self.port.get_index()), None, 0.0)
        kernels, arguments = (None, ()) if rows is None else (rows[0], rows[1:])
        self._motion: Callable[..., Any] | None = None
        self._of_points: Callable[..., Any] | None = None
        is_autonomous = isinstance(system, AffineSystem)
        if isinstance(kernels, ByComplexSteps):
            self._motion = motion = kernels.function(*arguments)
            is_autonomous = is_autonomous or not kernels.asks_for_time() or self._is_same_at_all_times(motion)
            if is_autonomous:
                self._of_points = kernels.function_of_points(*arguments)
        self._constant = is_autonomous and options.x0 is None and options.u0 is None

    def _is_same_at_all_times(self, motion: Callable[..., Any]) -> bool:
        """Whether the motion is the same at all times that are looked at, as many as the first solution has steps."""
        point = np.concatenate((self.x0.value(self.t0)[:, 0], self.u0.value(self.t0)[:, 0]))
        found = [motion(t, point, True) for t in np.linspace(self.t0, self.tf, 2 * _FEWEST + 1)]
        return all(one is not None and np.array_equal(np.column_stack(one), np.column_stack(found[0])) for one in found)

    def _at(self, t: float, nominal: float) -> tuple[np.ndarray, np.ndarray]:
        """x' and its slopes by x and u at time t, and x0 and u0 of the time `nominal`."""
        self.context.SetTime(t)
        self.context.SetContinuousState(self.x0.value(nominal)[:, 0])
        self.port.FixValue(self.context, self.u0.value(nominal)[:, 0])
        index = self.port.get_index()
        return motion_and_slopes(self.system, self.context, index, OutputPortSelection.kNoOutput)[:2]

    def linearization(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """x' at x0, u0, shape (times, n), and its slopes by x and u."""
        found: Any = None
        if self._constant:
            found = [part[None] for part in self._at(self.t0, self.t0)]
        elif self._motion is not None:
            points = np.vstack((self.x0.vector_values(times), self.u0.vector_values(times))).T
            if self._of_points is not None:
                found = self._of_points(points, True)
            else:
                each = [self._motion(t, point, True) for t, point in zip(times, points)]
                found = None if any(one is None for one in each) else tuple(map(np.array, zip(*each)))
        return found or tuple(map(np.array, zip(*(self._at(t, t) for t in times))))

    def equation(self, times: np.ndarray) -> tuple[np.ndarray, ...]:
        """A, B, Q and N, one of each for each time, for the state (x - x0, 1): what is affine in x is linear in it."""
        n, m, k = self.n, self.m, times.size
        motion, slopes = self.linearization(times)
        A, Q = np.zeros((2, k, n + 1, n + 1))
        B, N = np.zeros((2, k, n + 1, m))
        A[:, :n, :n], B[:, :n], A[:, :n, n] = slopes[:, :, :n], slopes[:, :, n:], motion - _velocities(self.x0, times).T
        e, d = _difference(self.xd, self.x0, times), _difference(self.ud, self.u0, times)
        Q[:, :n, :n], N[:, :n], N[:, n] = self.Q, self.N, -e @ self.N - d @ self.R
        Q[:, :n, n] = Q[:, n, :n] = -e @ self.Q - d @ self.N.T
        Q[:, n, n] = -np.sum(e * Q[:, :n, n], axis=1) - np.sum(d * N[:, n], axis=1)
        return A, B, Q, N

    def final(self) -> np.ndarray:
        """S, sx and s0 at the end, as one matrix."""
        e = _difference(self.xd, self.x0, np.array([self.tf]))[0]
        offset = np.hstack((np.eye(self.n), -e[:, None]))
        return offset.T @ self.Qf @ offset

    def stretches(self) -> np.ndarray:
        """Starts of pairs of steps, between jumps that a trajectory may have at its breaks; and the end."""
        trajectories = (self.x0, self.u0, self.xd, self.ud)
        known = {b for each in trajectories if hasattr(each, "get_segment_times") for b in each.get_segment_times()}
        breaks = np.array([self.t0, *sorted(b for b in known if self.t0 < b < self.tf), self.tf])
        return _divided(breaks, np.ceil(np.diff(breaks) * (_FEWEST / (self.tf - self.t0))).astype(int))


def _divided(times: np.ndarray, parts: np.ndarray) -> np.ndarray:
    """The times with what is between divided into so many parts."""
    first = np.repeat(np.cumsum(parts) - parts, parts)
    share = (np.arange(first.size) - first) / np.repeat(parts, parts)
    return np.append(np.repeat(times[:-1], parts) + share * np.repeat(np.diff(times), parts), times[-1])


def _difference(desired: Trajectory, nominal: Trajectory, times: np.ndarray) -> np.ndarray:
    if desired is nominal:
        return np.zeros((times.size, nominal.rows()))
    return (desired.vector_values(times) - nominal.vector_values(times)).T


def _velocities(trajectory: Trajectory, times: np.ndarray) -> np.ndarray:
    if isinstance(trajectory, PiecewisePolynomial):
        return trajectory.derivative().vector_values(times)
    if not trajectory.has_derivative():
        return np.zeros((trajectory.rows(), times.size))
    return np.stack([trajectory.EvalDerivative(t)[:, 0] for t in times], axis=1)


class _Solution(NamedTuple):
    """Times, and at the start and the end of each step between them the solution and the gains, with slopes."""

    times: np.ndarray
    S: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
    K: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
    errors: np.ndarray
    """Relative ones of pairs of steps."""

    def trajectory(self, samples: tuple[np.ndarray, ...], rows: slice, columns: slice) -> PiecewisePolynomial:
        """Cubics through a part of the samples."""
        h = np.diff(self.times)[:, None, None]
        y0, y1, m0, m1 = (part[:, rows, columns] for part in samples)
        d = (y1 - y0) / h
        c = np.stack((y0, m0, (3.0 * d - 2.0 * m0 - m1) / h, (m0 + m1 - 2.0 * d) / (h * h)), axis=-1)
        return PiecewisePolynomial._of(list(c), self.times.tolist())


def _solve(problem: _Problem, pairs: np.ndarray) -> _Solution:
    """The solution with steps in pairs; one step for each pair tells its errors."""
    times = _divided(pairs, np.full(pairs.size - 1, 2))
    a, b = times[:-1], times[1:]
    # A step ends before a jump at its end.
    at = np.concatenate((a, 0.5 * (a + b), np.nextafter(b, a)))
    A, B, Q, N = problem.equation(at)
    R_inverse = np.linalg.inv(problem.R)
    gain = R_inverse @ np.swapaxes(N, -1, -2)
    A1, Q1 = A - B @ gain, Q - N @ gain  # completing the square in u takes N away
    G = B @ R_inverse @ np.swapaxes(B, -1, -2)
    H = hamiltonian(A1, G, Q1).reshape(3, a.size, 2 * A.shape[-1], -1)
    final, h = problem.final(), b - a
    S = np.concatenate((maps_of(H[0], H[1], H[2], h).back_from(final), final[None]))

    def ends(parts: np.ndarray) -> np.ndarray:
        return parts.reshape(3, a.size, *parts.shape[1:])[::2]

    S_ends = np.stack((S[:-1], S[1:]))
    SA = S_ends @ ends(A1)
    S_dot = -(ends(Q1) + SA + np.swapaxes(SA, -1, -2) - S_ends @ ends(G) @ S_ends)
    # Of cubics between the times of pairs: 16 times that of those between all where steps are short, less elsewhere.
    middle = 0.5 * (S[:-1:2] + S[2::2]) + np.diff(pairs)[:, None, None] / 8.0 * (S_dot[0, ::2] - S_dot[1, 1::2])
    scale = _scale(np.abs(S).max(axis=0))
    errors = (np.abs(S[1::2] - middle) / scale).max(axis=(1, 2)) / 8.0
    if not (H == H[0, 0]).all():  # or else the steps are exact
        single = maps_of(H[0, ::2], H[0, 1::2], H[2, 1::2], np.diff(pairs))(S[2::2])
        errors = np.maximum(
            errors, (np.abs(S[:-1:2] - single) / scale).max(axis=(1, 2)) / 15.0 * errors.size
        )  # they add up
    K = R_inverse @ np.swapaxes(ends(N) + S_ends @ ends(B), -1, -2)
    N_dot, B_dot = _slopes_at_ends(N, h), _slopes_at_ends(B, h)
    K_dot = R_inverse @ np.swapaxes(N_dot + S_ends @ B_dot + S_dot @ ends(B), -1, -2)
    return _Solution(times, (*S_ends, *S_dot), (*K, *K_dot), errors)


def _scale(largest: np.ndarray) -> np.ndarray:
    """What errors of S, sx and s0 are relative to, from the largest of each number: sx is below (S s0)^1/2."""
    S = max(1e-300, largest[:-1, :-1].max())
    root = np.sqrt(np.append(np.full(len(largest) - 1, S), max(1e-8 * S, largest[-1, -1])))
    return np.outer(root, root)


def _slopes_at_ends(parts: np.ndarray, h: np.ndarray) -> np.ndarray:
    """Slopes at start and end of parabolas through three samples, shape (2, steps, ...)."""
    start, middle, end = parts.reshape(3, h.size, *parts.shape[1:])
    return np.stack((4.0 * middle - 3.0 * start - end, 3.0 * end - 4.0 * middle + start)) / h[:, None, None]


@checked
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
    options = options or FiniteHorizonLinearQuadraticRegulatorOptions()
    problem = _Problem(system, context, float(t0), float(tf), Q, R, options)
    accuracy = min(_ACCURACY, float(options.simulator_config.accuracy))
    pairs = problem.stretches()
    solution = _solve(problem, pairs)
    while not solution.errors.max() <= accuracy:
        # Errors are of fourth order in the steps.
        parts = np.ceil(np.clip(1.1 * np.nan_to_num(solution.errors / accuracy) ** 0.25, 1.0, 16.0)).astype(int)
        if not 0 < parts.sum() - parts.size < _MOST:
            raise RuntimeError(
                f"{problem.call}(): the Riccati equation could not be solved: with {2 * parts.size} steps its "
                f"relative error is {solution.errors.max():.1e}, to be {accuracy:.1e}."
            )
        pairs = _divided(pairs, parts)
        solution = _solve(problem, pairs)
    n, S, K = problem.n, solution.S, solution.K
    each, first, last = slice(None), slice(n), slice(n, None)
    return FiniteHorizonLinearQuadraticRegulatorResult(
        problem.x0,
        problem.u0,
        solution.trajectory(K, each, first),
        solution.trajectory(S, first, first),
        solution.trajectory(K, each, last),
        solution.trajectory(S, first, last),
        solution.trajectory(S, last, last),
    )


class _Regulator(LeafSystem):
    """u = u0 - K (x - x0) - k0."""

    def __init__(self, result: FiniteHorizonLinearQuadraticRegulatorResult):
        super().__init__()
        self._result = result
        self.DeclareVectorInputPort("plant_state", result.x0.rows())
        self.DeclareVectorOutputPort("command", result.u0.rows(), self._calc_command)
        self._trajectories = {"x0_model": result.x0, "u0_model": result.u0, "K_model": result.K, "k0_model": result.k0}
        if all(map(is_piecewise, self._trajectories.values())):
            self._declare_scratch(result.x0.rows())
            self._compute_natively(0, regulate)

    def _kernel_models(self, root: Any) -> dict:
        return {name: pieces_of([as_piecewise_polynomial(t)]) for name, t in self._trajectories.items()}

    def _calc_command(self, context: Context, output: BasicVector) -> None:
        t, r = context.get_time(), self._result
        deviation = np.array(self.get_input_port(0).Eval(context)) - r.x0.value(t)[:, 0]
        output.SetFromVector(r.u0.value(t)[:, 0] - r.K.value(t) @ deviation - r.k0.value(t)[:, 0])


@checked
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
