"""Implicit integrators, for stiff systems: Newton's method with matrices that are used as long as they serve."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.systems.analysis._integrator import IntegratorBase
from sheldrake.systems.analysis._kernel_steps import Arguments, callees, prepare, set_step
from sheldrake.systems.analysis._rates import Rates
from sheldrake.systems.analysis._schemes import SCHEMES
from sheldrake.systems.framework._kernels.implicit import (
    EULER,
    RADAU,
    VELOCITIES,
    Counts,
    Newton,
    NewtonNumbers,
    NewtonVectors,
    NewtonWords,
    implicit_step,
)
from sheldrake.systems.framework._kernels.integrate import PYTHON

if TYPE_CHECKING:
    from sheldrake.systems.analysis._span import Span
    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._engine.layout import Layout
    from sheldrake.systems.framework._system import System

KAPPA = 0.05  # by how much Newton's method is more exact than the step: Hairer and Wanner (1996), IV.8, below (8.11)
COUNTED = [field.name for field in Counts.FIELDS]
TITLES = (
    "Derivative Evaluations",
    "Jacobian Computations",
    "Derivative Evaluations for Jacobians",
    "Iteration Matrix Factorizations",
    "Newton-Raphson Iterations",
)


@checked
class ImplicitIntegrator(IntegratorBase):
    """What implicit integrators share: memory of Newton's method, which a kernel of the event loop uses; statistics."""

    _first_step, _scheme = 1.0, PYTHON
    _equation = EULER
    _layout: Layout | None = None
    _newton: Newton
    _nodes = np.array([1.0])
    _A = np.array([[1.0]])

    def __init__(self, system: System, context: Context | None = None):
        self._counts = np.zeros((2, Counts.SIZE), np.int64)
        self._set_up(system, context)

    def Initialize(self) -> None:
        super().Initialize()
        assert self._context is not None
        layout = self._context._store.layout
        if self._layout is not layout:
            self._layout, self._newton = layout, self._make_newton(layout)
        newton = self._newton
        newton.kappa, newton.has_jacobian, newton.is_dense = KAPPA, 0, self._dense is not None
        newton.has_factors[:] = 0

    def StartDenseIntegration(self) -> None:
        super().StartDenseIntegration()
        if self._layout is not None:
            self._newton.is_dense = 1

    def _make_newton(self, layout: Layout) -> Newton:
        """Memory of Newton's method, which knows no matrices yet."""
        of_q, of_v, of_z = layout.parts(0)
        q, y = _indices(of_q), _indices([*of_v, *of_z])
        n, stages = len(q) + len(y), len(self._A)
        unknown = y if self._equation == VELOCITIES else np.arange(n)
        m = stages * len(unknown)
        newton = Newton(
            np.zeros(NewtonWords.SIZE, np.int64),
            np.zeros(NewtonNumbers.SIZE),
            self._counts,
            np.zeros((NewtonVectors.SIZE, stages * n)),
            jacobian=np.zeros((len(unknown), len(unknown))),
            matrix=np.zeros((m + 1, m)),
            trapezoid=np.zeros((n + 1, n)),
            q=q,
            unknown=unknown,
        )
        newton.equation, newton.stages = self._equation, stages
        newton.nodes[:stages] = self._nodes
        newton.A[:stages, :stages] = self._A
        return newton

    def _join(self, span: Span) -> None:
        newton, rates = self._newton, Rates(span.store)
        num_q, num_v = len(rates.q), len(rates.v)

        def find_rates() -> None:
            newton.rate[:num_q] = rates.qdot_there(newton.rate[:num_v])

        def find_change() -> None:
            rates.keep_to_velocities(newton.rate)

        newton.mapped = not rates.is_identity
        prepare([implicit_step])
        own_table, *_ = callees(span, [], [find_rates, find_change, self._refuse])
        set_step(span, implicit_step, Arguments(span, {"run": span.run, "newton": newton, "own_table": own_table}, {}))

    def _refuse(self) -> None:
        """Says that no step is short enough.

        Raises:
            RuntimeError: always.
        """
        h = 2.0 * self._numbers.h_try
        raise RuntimeError(f"{type(self).__name__}: the step fails even when it is {h:g} s long.")

    def _memory(self) -> list[Any]:
        return [*super()._memory(), *(M if is_known else None for M, is_known in self._matrices())]

    def _matrices(self) -> list[tuple[np.ndarray, bool]]:
        """Matrices in use, and whether they are known."""
        newton = self._newton
        found = [(newton.jacobian, newton.has_jacobian), (newton.matrix, newton.has_factors[0])]
        return [*found, (newton.trapezoid, newton.has_factors[1])]

    def _remember(self, memory: list[Any]) -> None:
        super()._remember(memory)
        newton = self._newton
        for (mine, _), theirs in zip(self._matrices(), memory[1:], strict=True):
            if theirs is not None:
                mine[:] = _checked(np.array(theirs, float), mine)
        newton.has_jacobian, *newton.has_factors[:] = (int(M is not None) for M in memory[1:])

    def ResetStatistics(self) -> None:
        super().ResetStatistics()
        self._counts[:] = 0

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
            if i:  # the total of derivative evaluations is above
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


def _indices(parts: list[tuple[int, int]]) -> np.ndarray:
    return np.concatenate([np.zeros(0, np.int64), *(np.arange(a, b) for a, b in parts)])


def _checked(theirs: np.ndarray, mine: np.ndarray) -> np.ndarray:
    """A matrix that was saved: it must look like mine, and pivots must be rows."""
    if theirs.shape != mine.shape:
        raise ValueError(f"a matrix has the shape {theirs.shape}, not {mine.shape}")
    rows, n = mine.shape
    if rows > n and not np.isin(theirs[n], np.arange(n)).all():
        raise ValueError("the pivots of a matrix are no rows of it")
    return theirs


class ImplicitEulerIntegrator(ImplicitIntegrator):
    """x1 = x0 + h f(t1, x1), in two steps of half the length; one of the whole length gives the error estimate."""

    _name, _order = "implicit_euler", 2.0
    _default_accuracy, _loosest_accuracy = 0.1, 0.5


class Radau1Integrator(ImplicitIntegrator):
    """Radau IIA with one stage: the implicit Euler step, first order; its error is estimated by the trapezoid rule."""

    _name, _order, _equation = "radau1", 2.0, RADAU
    _default_accuracy, _loosest_accuracy = 0.1, 0.5


class Radau3Integrator(ImplicitIntegrator):
    """Radau IIA with two stages, third order (Hairer and Wanner, 1996, IV.5); its error is estimated likewise."""

    _name, _order, _equation = "radau3", 3.0, RADAU
    _loosest_accuracy = 0.01
    _nodes = np.array([1 / 3, 1.0])
    _A = np.array([[5 / 12, -1 / 12], [3 / 4, 1 / 4]])


class VelocityImplicitEulerIntegrator(ImplicitIntegrator):
    """The implicit Euler step of mechanisms, qdot = N(q) v, by a system of equations in velocities alone.

    Iterations k solve y = y0 + h f_y(t1, q0 + h N(q_k) v, y) for velocities and other variables y = (v, z), with N one
    iteration behind. There are half as many unknowns as for `ImplicitEulerIntegrator`.
    """

    _name, _order, _equation = "velocity_implicit_euler", 2.0, VELOCITIES
    _default_accuracy, _loosest_accuracy = 0.1, 0.5


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
