"""The CENIC integrator (Kurtz and Castro 2025, "CENIC: Convex Error-controlled Numerical Integration for Contact")."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

from sheldrake.multibody.contact_solvers import IcfSolverParameters
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.plant._convex_step import ConvexStep
from sheldrake.systems.analysis._python_steps import PythonIntegrator
from sheldrake.systems.framework import Diagram

KAPPA = 1e-3
"""Tolerance of the solver over accuracy."""


class CenicIntegrator(PythonIntegrator):
    """Integrates a continuous plant by convex problems, as discrete plants are stepped, but controls the error.

    A step is made once whole and once in two halves; the positions' difference is the estimate of the error, and the
    halves are kept. Contact may be stiff and steps long; joint limits, constraints and PD gains work as in a discrete
    plant; static friction counts. Forces that other systems give are linearized, anew in each half, so that stiff
    controllers need no short steps; other systems' continuous states take explicit Euler steps.

    With `set_fixed_step_mode(True)` steps are those of a discrete plant with the approximation kLagged, except that
    quaternions are normalized.

    Args:
        system: A Diagram with a MultibodyPlant of `time_step = 0` named "plant", and its SceneGraph.
        context: Its context.

    Raises:
        RuntimeError: it is no Diagram, has no such plant, or the plant is discrete.
    """

    _name, _order = "cenic", 2.0
    _default_accuracy, _loosest_accuracy = 1e-3, np.inf

    def __init__(self, system: Any, context: Any = None):
        if not isinstance(system, Diagram):
            raise RuntimeError(f"CenicIntegrator must be given a Diagram, not a {type(system).__name__}")
        plant = system.GetSubsystemByName("plant")
        if not isinstance(plant, MultibodyPlant):
            raise RuntimeError(f"CenicIntegrator: subsystem 'plant' is a {type(plant).__name__}, not a MultibodyPlant.")
        if plant.is_discrete():
            raise RuntimeError(
                "CenicIntegrator must be given a continuous time plant (time_step = 0.0), not a discrete time plant "
                f"(time_step = {plant.time_step()})"
            )
        super().__init__(system, context)
        self._plant, self._parameters = plant, IcfSolverParameters()
        self._others = [s for s in system.GetSystems() if s is not plant and s.num_continuous_states() > 0]
        self._convex: ConvexStep | None = None
        self._places: dict[Any, slice] = {}

    def SetSolverParameters(self, parameters: IcfSolverParameters) -> None:
        """Limits and tolerances of the convex solver.

        Raises:
            TypeError: they are none.
        """
        if not isinstance(parameters, IcfSolverParameters):
            raise TypeError(f"SetSolverParameters(): expected IcfSolverParameters, not {parameters!r}.")
        self._parameters = copy.copy(parameters)

    def get_solver_parameters(self) -> IcfSolverParameters:
        """Limits and tolerances of the convex solver."""
        return self._parameters

    def Initialize(self) -> None:
        """Gets ready to step; the accuracy is 1e-3 unless set."""
        super().Initialize()
        if np.isnan(self._accuracy):
            self._accuracy = self._default_accuracy

    def _step(self, span: Any, t: float, x: np.ndarray, h: float) -> tuple[np.ndarray, float]:
        """x after a step of h [s], and the norm of its error."""
        whole = self._convex_step(t, x, h)
        if self.get_fixed_step_mode():
            return whole, 0.0
        half = self._convex_step(t, x, 0.5 * h)
        end = self._convex_step(t + 0.5 * h, half, 0.5 * h)
        begin = self._place_in_state(self._plant).start
        positions = slice(begin, begin + self._plant.num_positions())
        return end, float(np.max(np.abs(end[positions] - whole[positions]), initial=0.0))

    def _convex_step(self, t: float, x: np.ndarray, h: float) -> np.ndarray:
        """One step from (t, x), without an estimate."""
        root, system = self._context, self._system
        root.SetTime(t)
        root.SetContinuousState(x)
        context = self._plant.GetMyContextFromRoot(root)
        if self._convex is None or not self._convex.fits(context):
            self._convex = ConvexStep(self._plant, context)
        tolerance = self._parameters.min_tolerance
        if not self.get_fixed_step_mode():
            tolerance = max(tolerance, KAPPA * self.get_accuracy_in_use())
        self._convex.use(self._parameters.max_iterations, tolerance)
        end = x.copy()
        end[self._place_in_state(self._plant)] = self._convex(h)
        for other in self._others:
            rates = other.EvalTimeDerivatives(system.GetSubsystemContext(other, root)).CopyToVector()
            end[self._place_in_state(other)] += h * rates
        return end

    def _place_in_state(self, subsystem: Any) -> slice:
        """Where a subsystem's continuous state is in the whole one."""
        if not self._places:
            begin = 0
            for s in self._system.GetSystems():
                size = s.GetMyContextFromRoot(self._context).num_continuous_states()
                self._places[s] = slice(begin, begin + size)
                begin += size
        return self._places[subsystem]
