"""Witness functions that are kernels: the same steps and events as by Python."""

import math

import numpy as np
import pytest

from sheldrake.common._overloads import Mismatch
from sheldrake.common.kernel import Vector, kernel
from sheldrake.examples import CompassGait, RimlessWheel
from sheldrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from sheldrake.systems.framework import (
    DiagramBuilder,
    EventStatus,
    LeafSystem,
    PublishEvent,
    UnrestrictedUpdateEvent,
    WitnessFunctionDirection,
)
from sheldrake.systems.framework._vector import plain

BEGINNINGS = {RimlessWheel: [0.0, 1.0], CompassGait: [0.0, 0.0, 0.4, -2.0]}
DIRECTIONS = [d for d in WitnessFunctionDirection.__members__.values() if d is not WitnessFunctionDirection.kNone]


@kernel(top=True)
def first_coordinate(xc: Vector, w: Vector) -> None:
    """The first continuous state variable."""
    w[0] = xc[0]


@kernel(top=True)
def second_coordinate(xc: Vector, w: Vector) -> None:
    """The second continuous state variable."""
    w[0] = xc[1]


@kernel(top=True)
def first_input(u: Vector, w: Vector) -> None:
    """What no witness function may read."""
    w[0] = u[0]


class Oscillator(LeafSystem):
    """x'' = -x, and who crosses zero when."""

    def __init__(self, direction, fails_at=math.inf):
        super().__init__()
        self.DeclareContinuousState(1, 1, 0)
        self.seen, self.fails_at = [], fails_at
        for name, calc in (("x", first_coordinate), ("v", second_coordinate)):
            self._declare_witness(
                name, direction, calc, PublishEvent(lambda context, event, n=name: self.tell(context, n))
            )

    def DoCalcTimeDerivatives(self, context, derivatives):
        if context.get_time() > self.fails_at and self.seen:
            raise ZeroDivisionError("too late")
        q, v = context.get_continuous_state_vector().CopyToVector()
        derivatives.SetFromVector([v, -q])

    def tell(self, context, name):
        self.seen.append((name, context.get_time()))


def by_python(cls):
    """The same system, whose active witness functions Python chooses."""
    return type(
        cls.__name__,
        (cls,),
        {"DoGetWitnessFunctions": lambda self, context: [*cls.DoGetWitnessFunctions(self, context)]},
    )


def motion(system, x0, T, native=True, accuracy=1e-4, config=None):
    """State after every step, how many steps and evaluations there were."""
    simulator = Simulator(system)
    simulator._native = native
    if config is not None:
        ApplySimulatorConfig(config, simulator)
    context = simulator.get_mutable_context()
    context.SetContinuousState(x0)
    if accuracy is not None:
        context.SetAccuracy(accuracy)
    found = []
    simulator.set_monitor(lambda c: found.append([c.get_time(), *c.get_continuous_state_vector().CopyToVector()]))
    simulator.AdvanceTo(T)
    return np.array(found), simulator._run.unrestricteds, simulator.get_integrator().get_num_derivative_evaluations()


@pytest.mark.parametrize("cls", BEGINNINGS)
def test_walkers_take_the_steps_that_python_finds(cls):
    expected = motion(by_python(cls)(), BEGINNINGS[cls], 3.0)
    assert expected[1] > 3
    for system, native in ((cls(), True), (cls(), False), (by_python(cls)(), False)):
        found = motion(system, BEGINNINGS[cls], 3.0, native)
        assert np.array_equal(found[0], expected[0]) and found[1:] == expected[1:]


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("fixed, accuracy", [(False, 1e-4), (True, 1e-4), (True, None)])
@pytest.mark.parametrize("native", [True, False])
def test_two_functions_trigger_in_their_directions(direction, fixed, accuracy, native):
    config = SimulatorConfig(use_error_control=not fixed, max_step_size=0.1)
    by_kernel, expected = Oscillator(direction), by_python(Oscillator)(direction)
    found = [motion(s, [1.0, 0.5], 10.0, native, accuracy, config) for s in (by_kernel, expected)]
    assert by_kernel.seen == expected.seen and len(by_kernel.seen) >= 3
    assert np.array_equal(found[0][0], found[1][0])
    phase = math.atan2(0.5, 1.0)  # x = r cos(t - phase)
    for name, t in by_kernel.seen:
        angle = t - phase - (math.pi / 2 if name == "x" else 0.0)
        assert abs(angle - round(angle / math.pi) * math.pi) < (1e-3 if accuracy else 0.1)


@pytest.mark.parametrize("native", [True, False])
def test_an_error_on_the_way_to_a_change_of_sign_stops_the_span(native):
    system = Oscillator(WitnessFunctionDirection.kCrossesZero, fails_at=2.5)
    with pytest.raises(ZeroDivisionError, match="too late"):
        motion(system, [1.0, 0.5], 10.0, native)
    assert len(system.seen) >= 1


def test_later_simulations_of_a_simulator_are_those_of_python():
    found = []
    for cls in (RimlessWheel, by_python(RimlessWheel)):
        simulator = Simulator(cls())
        context = simulator.get_mutable_context()
        context.SetContinuousState([0.0, 1.0])
        context.SetAccuracy(1e-4)
        start, ends = context.Clone(), []
        for accuracy in (1e-4, 1e-4, 1e-2):
            context.SetTimeStateAndParametersFrom(start)
            context.SetAccuracy(accuracy)
            simulator.Initialize()
            simulator.AdvanceTo(3.0)
            ends.append((*context.get_continuous_state_vector().CopyToVector(), context.get_discrete_state(0)[0]))
        found.append(ends)
    assert found[0] == found[1]
    np.testing.assert_allclose(found[0][0], found[0][1], atol=1e-4)  # the first step differs: it is known how long
    assert found[0][1] != found[0][2]


def test_beside_functions_in_python_they_are_looked_at_by_python():
    class Watcher(LeafSystem):
        def __init__(self):
            super().__init__()
            self.seen = []
            rises = WitnessFunctionDirection.kNegativeThenNonNegative
            event = UnrestrictedUpdateEvent(self.hit)
            self.witness = self.MakeWitnessFunction("time", rises, lambda context: context.get_time() - 1.25, event)

        def DoGetWitnessFunctions(self, context):
            return [self.witness]

        def hit(self, context, event, state):
            self.seen.append(context.get_time())

    builder = DiagramBuilder()
    oscillator = builder.AddSystem(Oscillator(WitnessFunctionDirection.kCrossesZero))
    watcher = builder.AddSystem(Watcher())
    motion(builder.Build(), [1.0, 0.5], 3.0)
    assert watcher.seen == pytest.approx([1.25], abs=1e-5)
    assert [name for name, _ in oscillator.seen] == ["v", "x"]


def test_a_publish_on_a_change_of_sign_may_end_the_run():
    class Ends(Oscillator):
        def tell(self, context, name):
            super().tell(context, name)
            return EventStatus.ReachedTermination(self, "enough")

    system = Ends(WitnessFunctionDirection.kCrossesZero)
    simulator = Simulator(system)
    simulator.get_mutable_context().SetContinuousState([1.0, 0.5])
    status = simulator.AdvanceTo(10.0)
    assert status.message() == "enough" and status.return_time() == system.seen[0][1] and len(system.seen) == 1


def test_values_of_kernels_are_those_of_functions():
    wheel = RimlessWheel()
    context = wheel.CreateDefaultContext()
    context.SetContinuousState([0.1, 0.0])
    backward, forward = wheel.GetWitnessFunctions(context)
    assert forward._calc(context) == pytest.approx(0.08 + math.pi / 8 - 0.1, rel=1e-15)
    assert backward._calc(context) == pytest.approx(0.1 - 0.08 + math.pi / 8, rel=1e-15)
    assert [w.description() for w in (backward, forward)] == ["step backward", "step forward"]


def test_copies_watch_for_themselves():
    wheel = RimlessWheel()
    for copy in (wheel.Clone(), wheel.ToAutoDiffXd()):
        context = copy.CreateDefaultContext()
        found = copy.GetWitnessFunctions(context)
        assert [w._system for w in found] == [copy, copy]
        assert plain(found[1]._calc(context)) == pytest.approx(0.08 + math.pi / 8, rel=1e-15)
    simulator = Simulator(wheel.ToAutoDiffXd())
    ApplySimulatorConfig(SimulatorConfig(use_error_control=False, max_step_size=0.01), simulator)
    simulator.get_mutable_context().SetContinuousState([0.0, 1.0])
    simulator.get_mutable_context().SetAccuracy(1e-4)
    simulator.AdvanceTo(1.0)
    assert simulator.get_context().get_discrete_state(0)[0] != 0.0


def test_a_kernel_that_reads_inputs_is_no_witness_function():
    with pytest.raises(Mismatch, match=r"first_input.*reads some of xc, xd, p"):
        RimlessWheel().MakeWitnessFunction("u", WitnessFunctionDirection.kCrossesZero, first_input)
