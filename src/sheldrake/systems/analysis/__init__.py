"""Simulators and integrators."""

from sheldrake.common._names import show_as_own
from sheldrake.systems.analysis._batch import BatchEvalTimeDerivatives, BatchEvalUniquePeriodicDiscreteUpdate
from sheldrake.systems.analysis._batch_simulator import BatchSimulator, WorldFailure, WorldsFailed
from sheldrake.systems.analysis._config import (
    ApplySimulatorConfig,
    ExtractSimulatorConfig,
    PrintSimulatorStatistics,
    SimulatorConfig,
)
from sheldrake.systems.analysis._discrete_time import DiscreteTimeApproximation
from sheldrake.systems.analysis._explicit import (
    BogackiShampine3Integrator,
    ExplicitEulerIntegrator,
    RungeKutta2Integrator,
    RungeKutta3Integrator,
    RungeKutta5Integrator,
)
from sheldrake.systems.analysis._implicit import (
    ImplicitEulerIntegrator,
    Radau1Integrator,
    Radau3Integrator,
    VelocityImplicitEulerIntegrator,
)
from sheldrake.systems.analysis._integrator import IntegratorBase
from sheldrake.systems.analysis._many_worlds import SimulateWorlds, WorldsProgress
from sheldrake.systems.analysis._monte_carlo import MonteCarloSimulation, RandomSimulation, RandomSimulationResult
from sheldrake.systems.analysis._python_steps import SemiExplicitEulerIntegrator
from sheldrake.systems.analysis._region_of_attraction import RegionOfAttraction, RegionOfAttractionOptions
from sheldrake.systems.analysis._schemes import GetIntegrationSchemes, ResetIntegratorFromFlags
from sheldrake.systems.analysis._simulator import InitializeParams, Simulator
from sheldrake.systems.analysis._status import SimulatorStatus
from sheldrake.systems.framework._templates import SystemTemplate

IntegratorBase_ = SystemTemplate("IntegratorBase_", IntegratorBase, scope=__name__)
RungeKutta2Integrator_ = SystemTemplate("RungeKutta2Integrator_", RungeKutta2Integrator, scope=__name__)
RungeKutta3Integrator_ = SystemTemplate("RungeKutta3Integrator_", RungeKutta3Integrator, scope=__name__)
Simulator_ = SystemTemplate("Simulator_", Simulator, scope=__name__)

__all__ = [
    "ApplySimulatorConfig",
    "BatchEvalTimeDerivatives",
    "BatchEvalUniquePeriodicDiscreteUpdate",
    "BatchSimulator",
    "BogackiShampine3Integrator",
    "DiscreteTimeApproximation",
    "ExplicitEulerIntegrator",
    "ExtractSimulatorConfig",
    "GetIntegrationSchemes",
    "ImplicitEulerIntegrator",
    "InitializeParams",
    "IntegratorBase",
    "IntegratorBase_",
    "MonteCarloSimulation",
    "PrintSimulatorStatistics",
    "Radau1Integrator",
    "Radau3Integrator",
    "RandomSimulation",
    "RandomSimulationResult",
    "RegionOfAttraction",
    "RegionOfAttractionOptions",
    "ResetIntegratorFromFlags",
    "RungeKutta2Integrator",
    "RungeKutta2Integrator_",
    "RungeKutta3Integrator",
    "RungeKutta3Integrator_",
    "RungeKutta5Integrator",
    "SemiExplicitEulerIntegrator",
    "SimulateWorlds",
    "Simulator",
    "SimulatorConfig",
    "SimulatorStatus",
    "Simulator_",
    "VelocityImplicitEulerIntegrator",
    "WorldFailure",
    "WorldsFailed",
    "WorldsProgress",
]

show_as_own(globals())
