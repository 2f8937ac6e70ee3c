"""Explicit integrators: Euler, Runge and Kutta."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.systems.analysis._integrator import IntegratorBase
from sheldrake.systems.framework._kernels.integrate import EULER, RK2, TABLEAU

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context, System


class RungeKutta3Integrator(IntegratorBase):
    """Explicit, third order, with error control by an embedded second-order result."""

    @checked
    def __init__(self, system: System, context: Context | None = None):
        self._set_up(system, context)


@checked
class RungeKutta2Integrator(IntegratorBase):
    """Explicit trapezoid (Heun), second order, steps of the maximum size."""

    _scheme, _order, _supports_error_estimation, _name = RK2, 2.0, False, "runge_kutta2"

    def __init__(self, system: System, max_step_size: float, context: Context | None = None):
        self._set_up(system, context)
        self.set_maximum_step_size(max_step_size)


@checked
class ExplicitEulerIntegrator(IntegratorBase):
    """Explicit Euler, first order, steps of the maximum size."""

    _scheme, _order, _supports_error_estimation, _name = EULER, 1.0, False, "explicit_euler"

    def __init__(self, system: System, max_step_size: float, context: Context | None = None):
        self._set_up(system, context)
        self.set_maximum_step_size(max_step_size)


@checked
class _TableauIntegrator(IntegratorBase):
    """Explicit, with error control, by a Butcher tableau: nodes, coefficients, weights, and weights of lower order."""

    _scheme = TABLEAU
    _nodes: tuple = ()
    _coefficients: tuple = ()
    _weights: tuple = ()
    _lower: tuple = ()

    def __init__(self, system: System, context: Context | None = None):
        self._set_up(system, context)
        numbers = self._numbers
        numbers.stages = stages = len(self._nodes)
        numbers.nodes[:stages] = self._nodes
        for s, row in enumerate(self._coefficients):
            numbers.rows[s, : len(row)] = row
        numbers.weights[:stages] = self._weights
        numbers.errors[:stages] = np.subtract(self._weights, self._lower)


class BogackiShampine3Integrator(_TableauIntegrator):
    """Third order with an embedded second-order result (Bogacki and Shampine, 1989)."""

    _name = "bogacki_shampine3"
    _nodes = (0.0, 1 / 2, 3 / 4, 1.0)
    _coefficients = ((), (1 / 2,), (0.0, 3 / 4), (2 / 9, 1 / 3, 4 / 9))
    _weights = (2 / 9, 1 / 3, 4 / 9, 0.0)
    _lower = (7 / 24, 1 / 4, 1 / 3, 1 / 8)


class RungeKutta5Integrator(_TableauIntegrator):
    """Fifth order with an embedded fourth-order result (Dormand and Prince, 1980)."""

    _name, _order = "runge_kutta5", 5.0
    _default_accuracy, _loosest_accuracy = 1e-5, 1e-3
    _nodes = (0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0)
    _coefficients = (
        (),
        (1 / 5,),
        (3 / 40, 9 / 40),
        (44 / 45, -56 / 15, 32 / 9),
        (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
        (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
        (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
    )
    _weights = (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84, 0.0)
    _lower = (5179 / 57600, 0.0, 7571 / 16695, 393 / 640, -92097 / 339200, 187 / 2100, 1 / 40)
