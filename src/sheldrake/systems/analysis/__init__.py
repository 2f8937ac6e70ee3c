"""Simulators and integrators."""

from sheldrake.systems.analysis._config import (
    ApplySimulatorConfig,
    ExtractSimulatorConfig,
    PrintSimulatorStatistics,
    SimulatorConfig,
)
from sheldrake.systems.analysis._integrator import (
    BogackiShampine3Integrator,
    ExplicitEulerIntegrator,
    GetIntegrationSchemes,
    IntegratorBase,
    ResetIntegratorFromFlags,
    RungeKutta2Integrator,
    RungeKutta3Integrator,
    RungeKutta5Integrator,
)
from sheldrake.systems.analysis._simulator import InitializeParams, Simulator
from sheldrake.systems.analysis._status import SimulatorStatus
from sheldrake.systems.framework._templates import SystemTemplate

IntegratorBase_ = SystemTemplate("IntegratorBase_", IntegratorBase, scope=__name__)
RungeKutta2Integrator_ = SystemTemplate("RungeKutta2Integrator_", RungeKutta2Integrator, scope=__name__)
RungeKutta3Integrator_ = SystemTemplate("RungeKutta3Integrator_", RungeKutta3Integrator, scope=__name__)
Simulator_ = SystemTemplate("Simulator_", Simulator, scope=__name__)

__all__ = [
    "ApplySimulatorConfig",
    "BogackiShampine3Integrator",
    "ExplicitEulerIntegrator",
    "ExtractSimulatorConfig",
    "GetIntegrationSchemes",
    "InitializeParams",
    "IntegratorBase",
    "IntegratorBase_",
    "PrintSimulatorStatistics",
    "ResetIntegratorFromFlags",
    "RungeKutta2Integrator",
    "RungeKutta2Integrator_",
    "RungeKutta3Integrator",
    "RungeKutta3Integrator_",
    "RungeKutta5Integrator",
    "Simulator",
    "SimulatorConfig",
    "SimulatorStatus",
    "Simulator_",
]
