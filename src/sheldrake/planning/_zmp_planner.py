"""Motions of a walker's center of mass for wanted zero-moment points.

R. Tedrake, S. Kuindersma, R. Deits and K. Miura, "A closed-form solution for real-time ZMP gait generation and feedback
stabilization", Humanoids 2015. States are relative to the last wanted point: x = (c - y_f, cdot), u = cddot.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch
from sheldrake.trajectories import ExponentialPlusPiecewisePolynomial, PiecewisePolynomial
from sheldrake.trajectories._exponential import MatrixExponential

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.trajectories import Trajectory


@checked
class ZmpPlanner:
    """Plans the motion of a center of mass at constant height so that the zero-moment point follows a trajectory."""

    def __init__(self) -> None:
        self._planned = False

    def has_planned(self) -> bool:
        """Tells whether `Plan` was called."""
        return self._planned

    def Plan(
        self,
        zmp_d: PiecewisePolynomial,
        x0: ArrayLike,
        height: float,
        gravity: float = 9.81,
        Qy: ArrayLike = ((1.0, 0.0), (0.0, 1.0)),
        R: ArrayLike = ((0.1, 0.0), (0.0, 0.1)),
    ) -> None:
        """Plans the motion.

        Args:
            zmp_d: Wanted zero-moment point (x, y) [m].
            x0: Position and velocity of the center of mass at the start [m, m/s], shape (4,).
            height: Of the center of mass above the ground [m].
            gravity: Its acceleration [m/s^2].
            Qy: Weight of deviations of the zero-moment point.
            R: Weight of accelerations.

        Raises:
            TypeError: x0 has another size.
            RuntimeError: the trajectory has another size, or the height or the gravity is not positive.
        """
        from sheldrake.systems.controllers import LinearQuadraticRegulator

        if zmp_d.rows() != 2 or zmp_d.cols() != 1 or height <= 0.0 or gravity <= 0.0:
            raise RuntimeError(
                f"Plan(): expected a trajectory of two rows, positive height and gravity; got {zmp_d.rows()} rows, "
                f"{height} and {gravity}."
            )
        start = _state("Plan", x0)
        zero, one = np.zeros((2, 2)), np.eye(2)
        self._A, self._B = np.block([[zero, one], [zero, zero]]), np.vstack((zero, one))
        self._C, self._D = np.hstack((one, zero)), -height / gravity * one
        self._Qy, self._R = np.array(Qy, dtype=float).reshape(2, 2), np.array(R, dtype=float).reshape(2, 2)
        A, B, C, D, Q = self._A, self._B, self._C, self._D, self._Qy
        R1 = self._R + D.T @ Q @ D
        gain, self._S = LinearQuadraticRegulator(A, B, C.T @ Q @ C, R1, C.T @ Q @ D)
        self._K = -gain
        self._zmp_d = zmp_d
        self._end = zmp_d.value(zmp_d.end_time())[:, 0]
        self._to_u0 = np.linalg.solve(R1, np.hstack((-0.5 * B.T, D.T @ Q)))
        closed = A + B @ self._K
        # Of the value function's linear part alone, and of the state with it: z' = M z + N (y_d - y_f).
        M2, N2 = -closed.T, 2.0 * (C + D @ self._K).T @ Q
        M = np.block([[closed, B @ self._to_u0[:, :4]], [np.zeros((4, 4)), M2]])
        N = np.vstack((B @ self._to_u0[:, 4:], N2))
        wanted = self._pieces(zmp_d)
        times = np.array(zmp_d.get_segment_times())
        alpha2 = self._backward(M2, N2, wanted, times)
        alpha, poly = self._forward(M, N, wanted, times, alpha2, start)
        vx = PiecewisePolynomial([_columns(p[:, 4:]) for p in poly], times)
        com = PiecewisePolynomial([_columns(p[:, :2] + _at_zero(p, self._end)) for p in poly], times)
        rows = np.eye(2, 8)
        self._Vx = ExponentialPlusPiecewisePolynomial(np.eye(4, 8, 4), M, alpha, vx)
        self._com, self._comd, self._comdd = (
            ExponentialPlusPiecewisePolynomial(rows @ np.linalg.matrix_power(M, k), M, alpha, com.derivative(k))
            for k in range(3)
        )
        self._gains = np.hstack((self._K, self._to_u0))  # of x, Vx and the wanted point: of the best acceleration
        self._known_at_rest = np.concatenate((self._end, np.zeros(6), self._end))
        self._planned = True

    def _pieces(self, zmp_d: PiecewisePolynomial) -> list[np.ndarray]:
        """Coefficients of y_d - y_f by powers of time since the start of each segment, shape (powers, 2) each."""
        out = []
        for i in range(zmp_d.get_number_of_segments()):
            matrix = zmp_d.getPolynomialMatrix(i)
            rows = [np.asarray(matrix[k][0].GetCoefficients(), dtype=float).ravel() for k in range(2)]
            c = np.zeros((max(r.size for r in rows), 2))
            for k, r in enumerate(rows):
                c[: r.size, k] = r
            c[0] -= self._end
            out.append(c)
        return out

    def _backward(self, M: np.ndarray, N: np.ndarray, wanted: list, times: np.ndarray) -> np.ndarray:
        """Coefficients of the exponentials of the value function's linear part, which is zero at the end."""
        alpha, after, exp = np.zeros((4, len(wanted))), np.zeros(4), MatrixExponential(M)
        for j in range(len(wanted) - 1, -1, -1):
            h, poly = times[j + 1] - times[j], _particular(M, N, wanted[j])
            alpha[:, j] = exp.applied(-h, after - _value(poly, h))
            after = alpha[:, j] + poly[0]
        return alpha

    def _forward(
        self, M: np.ndarray, N: np.ndarray, wanted: list, times: np.ndarray, alpha2: np.ndarray, x0: np.ndarray
    ) -> tuple[np.ndarray, list[np.ndarray]]:
        """Coefficients of the exponentials of (state, linear part), and polynomials, of all segments."""
        alpha, polys, exp = np.zeros((8, len(wanted))), [], MatrixExponential(M)
        x = x0 - np.append(self._end, [0.0, 0.0])
        for j, c in enumerate(wanted):
            poly = _particular(M, N, c)
            alpha[:, j] = np.concatenate((x - poly[0, :4], alpha2[:, j]))
            h = times[j + 1] - times[j]
            x = (exp.applied(h, alpha[:, j]) + _value(poly, h))[:4]
            polys.append(poly)
        return alpha, polys

    def _require_plan(self) -> None:
        if not self._planned:
            raise RuntimeError("ZmpPlanner: Plan() has to be called first.")

    def _known(self, name: str) -> Any:
        self._require_plan()
        return getattr(self, name)

    def ComputeOptimalCoMdd(self, time: float, x: ArrayLike) -> np.ndarray:
        """Returns the best acceleration of the center of mass [m/s^2] from a state, shape (2,).

        Args:
            time: The time [s].
            x: Position and velocity of the center of mass [m, m/s], shape (4,).

        Raises:
            TypeError: x has another size.
            RuntimeError: there is no plan.
        """
        self._require_plan()
        wanted = self._zmp_d.value(time)
        known = np.concatenate((_state("ComputeOptimalCoMdd", x), self._Vx.value(time)[:, 0], wanted[:, 0]))
        return self._gains @ (known - self._known_at_rest)

    def comdd_to_cop(self, x: ArrayLike, u: ArrayLike) -> np.ndarray:
        """Returns the center of pressure [m] for a state and an acceleration, shape (2,)."""
        self._require_plan()
        return self._C @ np.ravel(x) + self._D @ np.ravel(u)

    def get_A(self) -> np.ndarray:
        """Returns A of the dynamics x' = A x + B u."""
        return self._known("_A").copy()

    def get_B(self) -> np.ndarray:
        """Returns B of the dynamics x' = A x + B u."""
        return self._known("_B").copy()

    def get_C(self) -> np.ndarray:
        """Returns C of the center of pressure y = C x + D u."""
        return self._known("_C").copy()

    def get_D(self) -> np.ndarray:
        """Returns D of the center of pressure y = C x + D u."""
        return self._known("_D").copy()

    def get_Qy(self) -> np.ndarray:
        """Returns the weight of deviations of the zero-moment point."""
        return self._known("_Qy").copy()

    def get_R(self) -> np.ndarray:
        """Returns the weight of accelerations."""
        return self._known("_R").copy()

    def get_Vxx(self) -> np.ndarray:
        """Returns the quadratic part of the value function, shape (4, 4)."""
        return self._known("_S").copy()

    def _trajectory(self, name: str, time: float | None) -> Any:
        trajectory = self._known(name)
        return trajectory if time is None else trajectory.value(time)[:, 0]

    def get_Vx(self, time: float | None = None) -> Any:
        """Returns the linear part of the value function, at a time if one is given."""
        return self._trajectory("_Vx", time)

    def get_desired_zmp(self, time: float | None = None) -> PiecewisePolynomial:
        """Returns the wanted zero-moment point [m], at a time if one is given."""
        return self._trajectory("_zmp_d", time)

    def get_final_desired_zmp(self) -> np.ndarray:
        """Returns the last wanted zero-moment point [m]."""
        return self._known("_end").copy()

    def get_nominal_com(self, time: float | None = None) -> Trajectory:
        """Returns the planned position of the center of mass [m], at a time if one is given."""
        return self._trajectory("_com", time)

    def get_nominal_comd(self, time: float | None = None) -> Trajectory:
        """Returns the planned velocity of the center of mass [m/s], at a time if one is given."""
        return self._trajectory("_comd", time)

    def get_nominal_comdd(self, time: float | None = None) -> Trajectory:
        """Returns the planned acceleration of the center of mass [m/s^2], at a time if one is given."""
        return self._trajectory("_comdd", time)


def _state(call: str, x: ArrayLike) -> np.ndarray:
    state = np.asarray(x, dtype=float).ravel()
    if state.shape != (4,):
        raise Mismatch(
            f"ZmpPlanner.{call}(): incompatible function arguments: the state has shape {np.shape(x)}, not (4,)"
        )
    return state


def _particular(M: np.ndarray, N: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Coefficients p of a polynomial z with z' = M z + N y for y with coefficients c: M p_i = (i+1) p_(i+1) - N c_i."""
    p = np.zeros((len(c) + 1, len(M)))
    for i in range(len(c) - 1, -1, -1):
        p[i] = np.linalg.solve(M, (i + 1) * p[i + 1] - N @ c[i])
    return p[:-1]


def _value(p: np.ndarray, h: float) -> np.ndarray:
    return np.power(h, np.arange(len(p))) @ p


def _at_zero(p: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """An offset as the constant part of coefficients."""
    out = np.zeros((len(p), offset.size))
    out[0] = offset
    return out


def _columns(p: np.ndarray) -> np.ndarray:
    """A column of polynomials from coefficients, a column each."""
    from sheldrake.polynomial import Polynomial

    out = np.empty((p.shape[1], 1), dtype=object)
    for i, c in enumerate(p.T):
        out[i, 0] = Polynomial(c)
    return out
