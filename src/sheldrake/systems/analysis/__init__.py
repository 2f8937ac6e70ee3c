"""Simulators and integrators."""

from sheldrake.systems.analysis._integrator import (
    ExplicitEulerIntegrator,
    GetIntegrationSchemes,
    IntegratorBase,
    ResetIntegratorFromFlags,
    RungeKutta2Integrator,
    RungeKutta3Integrator,
)
from sheldrake.systems.analysis._simulator import InitializeParams, Simulator
from sheldrake.systems.analysis._status import SimulatorStatus

__all__ = [
    "ExplicitEulerIntegrator",
    "GetIntegrationSchemes",
    "InitializeParams",
    "IntegratorBase",
    "ResetIntegratorFromFlags",
    "RungeKutta2Integrator",
    "RungeKutta3Integrator",
    "Simulator",
    "SimulatorStatus",
]
