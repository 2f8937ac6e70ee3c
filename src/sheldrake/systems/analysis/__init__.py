"""Simulators and integrators."""

from sheldrake.systems.analysis._config import (
    ApplySimulatorConfig,
    ExtractSimulatorConfig,
    PrintSimulatorStatistics,
    SimulatorConfig,
)
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
    "ApplySimulatorConfig",
    "ExplicitEulerIntegrator",
    "ExtractSimulatorConfig",
    "GetIntegrationSchemes",
    "InitializeParams",
    "IntegratorBase",
    "PrintSimulatorStatistics",
    "ResetIntegratorFromFlags",
    "RungeKutta2Integrator",
    "RungeKutta3Integrator",
    "Simulator",
    "SimulatorConfig",
    "SimulatorStatus",
]
