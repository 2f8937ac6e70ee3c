"""Integration schemes by name."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from sheldrake.common._checked import checked
from sheldrake.systems.analysis._explicit import (
    BogackiShampine3Integrator,
    ExplicitEulerIntegrator,
    RungeKutta2Integrator,
    RungeKutta3Integrator,
    RungeKutta5Integrator,
)
from sheldrake.systems.analysis._integrator import IntegratorBase

if TYPE_CHECKING:
    from sheldrake.systems.analysis import Simulator

SCHEMES = {
    "bogacki_shampine3": BogackiShampine3Integrator,
    "explicit_euler": ExplicitEulerIntegrator,
    "runge_kutta2": RungeKutta2Integrator,
    "runge_kutta3": RungeKutta3Integrator,
    "runge_kutta5": RungeKutta5Integrator,
}


_FROM_ABOVE = {"cenic": ("sheldrake.multibody.cenic", "CenicIntegrator")}
"""Schemes of modules on floors above this one, which are loaded when they are asked for."""


def GetIntegrationSchemes() -> list[str]:
    """Names of the integration schemes, for `ResetIntegratorFromFlags` and `SimulatorConfig`."""
    return sorted([*SCHEMES, *_FROM_ABOVE])


@checked
def ResetIntegratorFromFlags(simulator: Simulator, scheme: str, max_step_size: float) -> IntegratorBase:
    """Gives a simulator the integrator of this name, with this maximum step size [s].

    Raises:
        RuntimeError: there is no such scheme.
    """
    if scheme not in GetIntegrationSchemes():
        raise RuntimeError(f"Unknown integration scheme: {scheme} (valid: {', '.join(GetIntegrationSchemes())})")
    system = simulator.get_system()
    cls: type[Any] | None = SCHEMES.get(scheme)
    if cls is None:
        module, name = _FROM_ABOVE[scheme]
        cls = getattr(importlib.import_module(module), name)
    if cls._supports_error_estimation:
        integrator = cls(system)
        integrator.set_maximum_step_size(max_step_size)
    else:
        integrator = cls(system, max_step_size)
    return simulator.reset_integrator(integrator)
