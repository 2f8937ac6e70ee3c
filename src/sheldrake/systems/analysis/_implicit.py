"""Implicit integrators, for stiff systems: Newton's method with matrices that are used as long as they serve."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.systems.analysis._python_steps import PythonIntegrator
from sheldrake.systems.analysis._schemes import SCHEMES

if TYPE_CHECKING:
    from sheldrake.systems.analysis._span import Span

NEWTON_STEPS = 10
KAPPA = 0.05  # by how much Newton's method is more exact than the step: Hairer and Wanner (1996), IV.8, below (8.11)
FORWARD = float(np.sqrt(np.finfo(float).eps))  # difference for derivatives, of values of about 1

# What is counted, once for the result and once for the estimate of its error.
COUNTED = (
    "derivative_evaluations",
    "jacobian_evaluations",
    "derivative_evaluations_for_jacobian",
    "iteration_matrix_factorizations",
    "newton_raphson_iterations",
)
TITLES = (
    "Derivative Evaluations",
    "Jacobian Computations",
    "Derivative Evaluations for Jacobians",
    "Iteration Matrix Factorizations",
    "Newton-Raphson Iterations",
)
EVALUATIONS, JACOBIANS, JACOBIAN_EVALUATIONS, FACTORIZATIONS, ITERATIONS = range(5)
RESULT, ESTIMATE = 0, 1


class Newton:
    """The matrices of one kind of step, which stay in use until Newton's method fails with them.

    Args:
        form: The matrix for a Jacobian and a length of step [s].
    """

    def __init__(self, form: Callable[[np.ndarray, float], np.ndarray]):
        self.form = form
        self.inverse: np.ndarray | None = None


class ImplicitIntegrator(PythonIntegrator):
    """What implicit integrators share: Jacobians, Newton's method, statistics."""

    _first_step = 1.0

    def Initialize(self) -> None:
        super().Initialize()
        self._forget()

    def _forget(self) -> None:
        """Drops all matrices."""
        self._jacobian: np.ndarray | None = None
        self._fresh = False  # whether the Jacobian is of the very state from which the step begins

    def _newtons(self) -> list[Newton]:
        """Matrices in use."""
        return [value for value in vars(self).values() if isinstance(value, Newton)]

    def _memory(self) -> list[Any]:
        return [*super()._memory(), self._jacobian, *(newton.inverse for newton in self._newtons())]

    def _remember(self, memory: list[Any]) -> None:
        super()._remember(memory)
        self._jacobian, *inverses = (None if m is None else np.array(m, float) for m in memory[1:])
        if any(m is not None and (m.ndim != 2 or m.shape[0] != m.shape[1]) for m in (self._jacobian, *inverses)):
            raise ValueError("its matrices are not square")
        for newton, inverse in zip(self._newtons(), inverses, strict=True):
            newton.inverse = inverse

    def ResetStatistics(self) -> None:
        super().ResetStatistics()
        self._counts = np.zeros((2, len(COUNTED)), np.int64)
        self._purpose = RESULT

    def GetStatisticsSummary(self) -> list[tuple[str, int | float]]:
        """All statistics by name; those of implicit steps in total, for results, and for estimates of errors."""
        found = super().GetStatisticsSummary()
        found += [
            (
                "integrator_num_step_shrinkages_from_substep_failures",
                self.get_num_step_shrinkages_from_substep_failures(),
            ),
            ("integrator_num_substep_failures", self.get_num_substep_failures()),
        ]
        for i, name in enumerate(COUNTED):
            result, estimate = (int(n) for n in self._counts[:, i])
            if i != EVALUATIONS:  # their total is above
                found.append((f"integrator_num_{name}", result + estimate))
            found.append((f"integrator_num_integrator_{name}", result))
            found.append((f"integrator_num_error_estimator_{name}", estimate))
        return found

    def _print_more_statistics(self) -> None:
        if self.get_fixed_step_mode():
            print("Note: steps are fixed, but their errors are estimated all the same, and that effort is counted too.")
        print("Implicit Integrator Statistics (integrator, error estimator, total):")
        for i, title in enumerate(TITLES):
            result, estimate = self._counts[:, i]
            print(f"Number of {title} = {result}, {estimate}, {result + estimate}")

    def _count(self, what: int, n: int = 1) -> None:
        self._counts[self._purpose, what] += n

    def _derivatives(self, span: Span, t: float, x: np.ndarray) -> np.ndarray:
        self._count(EVALUATIONS)
        return super()._derivatives(span, t, x)

    def _step(self, span: Span, t: float, x: np.ndarray, h: float) -> tuple[np.ndarray, float] | None:
        self._rates = self._rates_in(span.store)
        if h < self.get_working_minimum_step_size():
            return self._explicit_step(span, t, x, h)
        with np.errstate(over="ignore", invalid="ignore"):  # iterations may diverge
            found = self._implicit_step(span, t, x, h)
        self._purpose = RESULT
        if found is None:
            return None
        self._fresh = False
        end, estimate = found
        return end, self._rates.change_norm(end - estimate)

    def _explicit_step(self, span: Span, t: float, x: np.ndarray, h: float) -> tuple[np.ndarray, float]:
        """Two explicit Euler steps, for a sliver of time before an event; one gives the error."""
        f = self._derivatives(span, t, x)
        middle = x + 0.5 * h * f
        end = middle + 0.5 * h * self._derivatives(span, t + 0.5 * h, middle)
        return end, self._rates.change_norm(end - x - h * f)

    def _implicit_step(self, span: Span, t: float, x: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray] | None:
        """State after h [s] and the same by a step of another kind; None if Newton's method does not converge."""
        raise NotImplementedError

    def _calc_jacobian(self, f: Callable[[np.ndarray], np.ndarray], x: np.ndarray) -> np.ndarray:
        """df/dx by forward differences, shape (n, n)."""
        before = self._counts[self._purpose, EVALUATIONS]
        f0, J, moved = f(x), np.empty((len(x), len(x))), x.copy()
        for i in range(len(x)):
            moved[i] = x[i] + FORWARD * max(1.0, abs(x[i]))
            J[:, i] = (f(moved) - f0) / (moved[i] - x[i])
            moved[i] = x[i]
        self._count(JACOBIANS)
        self._count(JACOBIAN_EVALUATIONS, self._counts[self._purpose, EVALUATIONS] - before)
        return J

    def _freshen(self, newton: Newton, h: float, jacobian: Callable[[], np.ndarray], trial: int) -> bool:
        """Makes the matrix for a trial: the old one, then one for this h, then one with a new Jacobian.

        Returns:
            Whether there is something new to try.
        """
        J = self._jacobian
        if J is None or not np.isfinite(J).all() or trial == 3:
            if J is not None and trial == 3 and self._fresh:
                return False
            J = self._jacobian = jacobian()
            self._fresh = True
        elif newton.inverse is not None and trial == 1:
            return True
        self._count(FACTORIZATIONS)
        try:
            newton.inverse = np.linalg.inv(newton.form(J, h))
        except np.linalg.LinAlgError:
            newton.inverse = None
        return True

    def _newton_norm(self, dx: np.ndarray) -> float:
        """How large a change of Newton's method is."""
        return self._rates.change_norm(dx)

    def _solve(
        self, newton: Newton, h: float, guess: np.ndarray, jacobian: Callable[[], np.ndarray], increment: Any
    ) -> np.ndarray | None:
        """What `increment` leaves unchanged, by Newton's method from `guess`; None if no matrix serves.

        Args:
            jacobian: Gives the Jacobian at the beginning of the step.
            increment: Gives, for an iterate z and an inverse matrix, the next z, its state x and the change of x.
        """
        for trial in (1, 2, 3):
            if not self._freshen(newton, h, jacobian, trial):
                return None
            if newton.inverse is None:
                continue
            z, last = guess, np.inf
            for i in range(NEWTON_STEPS):
                self._count(ITERATIONS)
                z, x, dx = increment(z, newton.inverse)
                size = self._newton_norm(dx)
                if (np.abs(dx) <= 10 * np.finfo(float).eps * np.maximum(1.0, np.abs(x))).all():
                    return z
                if i > 1:
                    theta = size / last
                    if not theta < 1.0:
                        break
                    if theta / (1.0 - theta) * size < KAPPA * self.get_accuracy_in_use():  # (8.10) of IV.8
                        return z
                last = size
        return None


def _euler_matrix(J: np.ndarray, h: float) -> np.ndarray:
    return np.eye(len(J)) - h * J


def _trapezoid_matrix(J: np.ndarray, h: float) -> np.ndarray:
    return np.eye(len(J)) - 0.5 * h * J


class HalvesIntegrator(ImplicitIntegrator):
    """Two Euler steps of half the length; one of the whole length gives the error estimate."""

    _default_accuracy, _loosest_accuracy, _order = 0.1, 0.5, 2.0

    def _forget(self) -> None:
        super()._forget()
        self._newton = Newton(_euler_matrix)

    def _implicit_step(self, span: Span, t: float, x: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray] | None:
        self._purpose = ESTIMATE
        whole = self._euler(span, t, x, h, x)
        if whole is None:
            return None
        self._purpose = RESULT
        middle = self._euler(span, t, x, 0.5 * h, 0.5 * (x + whole))
        if middle is None:
            return None
        self._fresh = False
        end = self._euler(span, t + 0.5 * h, middle, 0.5 * h, whole)
        self._fresh = False
        return None if end is None else (end, whole)

    def _euler(self, span: Span, t: float, x: np.ndarray, h: float, guess: np.ndarray) -> np.ndarray | None:
        """One implicit Euler step, or None."""
        raise NotImplementedError


class ImplicitEulerIntegrator(HalvesIntegrator):
    """x1 = x0 + h f(t1, x1), in two steps of half the length; one of the whole length gives the error estimate."""

    _name = "implicit_euler"

    def _euler(self, span: Span, t: float, x: np.ndarray, h: float, guess: np.ndarray) -> np.ndarray | None:
        def increment(z: np.ndarray, inverse: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            dx = inverse @ (x + h * self._derivatives(span, t + h, z) - z)
            return z + dx, z + dx, dx

        return self._solve(
            self._newton, h, guess, lambda: self._calc_jacobian(lambda z: self._derivatives(span, t, z), x), increment
        )


class _RadauIntegrator(ImplicitIntegrator):
    """A Radau step, whose error is estimated by the implicit trapezoid."""

    _nodes = np.array([1.0])
    _A = np.array([[1.0]])

    def _forget(self) -> None:
        super()._forget()
        self._newton = Newton(lambda J, h: np.eye(len(self._A) * len(J)) - h * np.kron(self._A, J))
        self._trapezoid = Newton(_trapezoid_matrix)

    def _implicit_step(self, span: Span, t: float, x: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray] | None:
        f0, n, shape = self._derivatives(span, t, x), len(x), (len(self._A), len(x))

        def jacobian() -> np.ndarray:
            return self._calc_jacobian(lambda z: self._derivatives(span, t, z), x)

        def radau(z: np.ndarray, inverse: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            f = np.array([self._derivatives(span, t + c * h, x + s) for c, s in zip(self._nodes, z.reshape(shape))])
            dz = inverse @ ((h * self._A @ f).ravel() - z)
            return z + dz, x + z[-n:] + dz[-n:], dz[-n:]

        def trapezoid(z: np.ndarray, inverse: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            dx = inverse @ (x + 0.5 * h * (f0 + self._derivatives(span, t + h, z)) - z)
            return z + dx, z + dx, dx

        stages = self._solve(self._newton, h, np.zeros(len(self._A) * n), jacobian, radau)
        if stages is None:
            return None
        end = x + stages[-n:]
        self._purpose = ESTIMATE
        estimate = self._solve(self._trapezoid, h, end, jacobian, trapezoid)
        return None if estimate is None else (end, estimate)


class Radau1Integrator(_RadauIntegrator):
    """Radau IIA with one stage: the implicit Euler step, first order."""

    _name, _order = "radau1", 2.0
    _default_accuracy, _loosest_accuracy = 0.1, 0.5


class Radau3Integrator(_RadauIntegrator):
    """Radau IIA with two stages, third order (Hairer and Wanner, 1996, IV.5)."""

    _name, _order = "radau3", 3.0
    _loosest_accuracy = 0.01
    _nodes = np.array([1 / 3, 1.0])
    _A = np.array([[5 / 12, -1 / 12], [3 / 4, 1 / 4]])


class VelocityImplicitEulerIntegrator(HalvesIntegrator):
    """The implicit Euler step of mechanisms, qdot = N(q) v, by a system of equations in velocities alone.

    Iterations k solve y = y0 + h f_y(t1, q0 + h N(q_k) v, y) for velocities and other variables y = (v, z), with N one
    iteration behind. There are half as many unknowns as for `ImplicitEulerIntegrator`.
    """

    _name = "velocity_implicit_euler"

    def _newton_norm(self, dx: np.ndarray) -> float:
        return float(np.linalg.norm(dx))

    def _euler(self, span: Span, t: float, x: np.ndarray, h: float, guess: np.ndarray) -> np.ndarray | None:
        rates = self._rates
        q0, y0, num_v = x[rates.q], x[rates.y], len(rates.v)

        def positions(q: np.ndarray, y: np.ndarray) -> np.ndarray:
            return q0 + h * rates.qdot(q, y[:num_v])

        def f_y(t: float, q: np.ndarray, y: np.ndarray) -> np.ndarray:
            moved = np.empty(len(x))
            moved[rates.q], moved[rates.y] = positions(q, y), y
            return self._derivatives(span, t, moved)[rates.y]

        def increment(z: np.ndarray, inverse: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            q, y = z[rates.q], z[rates.y]
            following = np.empty(len(x))
            following[rates.y] = y + inverse @ (y0 + h * f_y(t + h, q, y) - y)
            following[rates.q] = positions(q, following[rates.y])
            return following, following, following - z

        self._fresh = False  # this Jacobian belongs to a length of step
        return self._solve(self._newton, h, guess, lambda: self._calc_jacobian(lambda y: f_y(t, q0, y), y0), increment)


SCHEMES.update(
    {
        cls._name: cls
        for cls in (
            ImplicitEulerIntegrator,
            Radau1Integrator,
            Radau3Integrator,
            VelocityImplicitEulerIntegrator,
        )
    }
)
