"""A simulator's settings as data, and its statistics as text."""

from __future__ import annotations

import json
from typing import Any

from sheldrake.common._checked import checked
from sheldrake.common._options import Options
from sheldrake.common._overloads import expect
from sheldrake.systems.analysis._schemes import ResetIntegratorFromFlags
from sheldrake.systems.analysis._simulator import Simulator
from sheldrake.systems.framework._vector import plain


class SimulatorConfig(Options):
    """Settings of a simulator.

    Args:
        integration_scheme: One of `GetIntegrationSchemes()`.
        max_step_size: Longest step [s].
        accuracy: What error control aims at.
        use_error_control: Whether errors are controlled.
        start_time: Time of the context [s].
        target_realtime_rate: Simulation seconds in a second; 0: as fast as it goes.
        publish_every_time_step: Whether to force a publish after every step.
    """

    integration_scheme: str = "runge_kutta3"
    max_step_size: float = 0.1
    accuracy: float = 1e-4
    use_error_control: bool = True
    start_time: float = 0.0
    target_realtime_rate: float = 0.0
    publish_every_time_step: bool = False


def ApplySimulatorConfig(config: Any, simulator: Simulator) -> None:
    """Gives a simulator these settings; `Initialize` follows."""
    if isinstance(config, Simulator):  # the order of before 2022
        config, simulator = simulator, config
    expect("ApplySimulatorConfig", config, SimulatorConfig)
    expect("ApplySimulatorConfig", simulator, Simulator)
    integrator = ResetIntegratorFromFlags(simulator, config.integration_scheme, config.max_step_size)
    if integrator._supports_error_estimation:
        integrator.set_fixed_step_mode(not config.use_error_control)
        integrator.set_target_accuracy(config.accuracy)
    simulator.get_mutable_context().SetTime(config.start_time)
    simulator.set_target_realtime_rate(config.target_realtime_rate)
    simulator._force_publish_every_step(config.publish_every_time_step)
    simulator._publish_at_initialization = config.publish_every_time_step


@checked
def ExtractSimulatorConfig(simulator: Simulator) -> SimulatorConfig:
    """The settings of a simulator."""
    integrator = simulator.get_integrator()
    accuracy = integrator.get_accuracy_in_use() if integrator._supports_error_estimation else 0.0
    return SimulatorConfig(
        integration_scheme=integrator._name,
        max_step_size=integrator.get_maximum_step_size(),
        accuracy=accuracy,
        use_error_control=not integrator.get_fixed_step_mode(),
        start_time=float(plain(simulator.get_context().get_time())),
        target_realtime_rate=simulator.get_target_realtime_rate(),
        publish_every_time_step=simulator.get_publish_every_time_step(),
    )


@checked
def PrintSimulatorStatistics(simulator: Simulator, /) -> None:
    """Prints what a simulator counted."""
    integrator = simulator.get_integrator()
    print("General stats regarding discrete updates:")
    print(f"Number of time steps taken (simulator stats) = {simulator.get_num_steps_taken()}")
    print(f"Simulator publishes every time step: {str(simulator.get_publish_every_time_step()).lower()}")
    print(f"Number of publishes = {simulator.get_num_publishes()}")
    print(f"Number of discrete updates = {simulator.get_num_discrete_updates()}")
    print(f'Number of "unrestricted" updates = {simulator.get_num_unrestricted_updates()}')
    if not integrator.get_num_steps_taken():
        print("\nNote: the integrator took zero steps: the simulator has not run, or there is no continuous state.")
        return
    control = "fixed steps" if integrator.get_fixed_step_mode() else "error control"
    print(f"\nStats for integrator {type(integrator).__name__} with {control}:")
    print(f"Number of time steps taken (integrator stats) = {integrator.get_num_steps_taken()}")
    if not integrator.get_fixed_step_mode():
        print(f"Initial time step taken = {integrator.get_actual_initial_step_size_taken():10g} s")
        print(f"Largest time step taken = {integrator.get_largest_step_size_taken():10g} s")
        print(f"Smallest adapted step size = {integrator.get_smallest_adapted_step_size_taken():10g} s")
        print(
            f"Number of steps shrunk due to error control = {integrator.get_num_step_shrinkages_from_error_control()}"
        )
    print(f"Number of derivative evaluations = {integrator.get_num_derivative_evaluations()}")
    shrunk = integrator.get_num_step_shrinkages_from_substep_failures()
    print(f"Number of steps shrunk due to convergence-based failure = {shrunk}")
    print(f"Number of convergence-based step failures (should match) = {integrator.get_num_substep_failures()}")
    integrator._print_more_statistics()
    print("\nJSON Statistics:")
    print(json.dumps(dict(integrator.GetStatisticsSummary()), indent=2, sort_keys=True))
