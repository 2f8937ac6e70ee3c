"""The CENIC integrator (Kurtz and Castro 2025, "CENIC: Convex Error-controlled Numerical Integration for Contact")."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.multibody.cenic._convex_step import ConvexStep
from sheldrake.multibody.contact_solvers import IcfSolverParameters
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.systems.analysis._integrator import IntegratorBase
from sheldrake.systems.framework import Diagram
from sheldrake.systems.framework._kernels.integrate import PYTHON

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._system import System


class CenicIntegrator(IntegratorBase):
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

    _name, _order, _scheme = "cenic", 2.0, PYTHON
    _default_accuracy, _loosest_accuracy = 1e-3, np.inf

    def __init__(self, system: System, context: Context | None = None):
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
        self._set_up(system, context)
        self._plant, self._parameters = plant, IcfSolverParameters()
        self._convex: ConvexStep | None = None

    def SetSolverParameters(self, parameters: IcfSolverParameters) -> None:
        """Limits and tolerances of the convex solver.

        Raises:
            TypeError: they are none.
        """
        if not isinstance(parameters, IcfSolverParameters):
            raise TypeError(f"SetSolverParameters(): expected IcfSolverParameters, not {parameters!r}.")
        self._parameters = copy.copy(parameters)
        if self._convex is not None:
            self._convex.use(self._parameters)

    def get_solver_parameters(self) -> IcfSolverParameters:
        """Limits and tolerances of the convex solver."""
        return self._parameters

    def Initialize(self) -> None:
        """Gets ready to step; the accuracy is 1e-3 unless set."""
        super().Initialize()
        if np.isnan(self._accuracy):
            self._accuracy = self._default_accuracy

    def _join(self, span: Any) -> None:
        self._convex = ConvexStep(self._plant, self._plant.GetMyContextFromRoot(self._context), span)
        self._convex.use(self._parameters)
