"""What callbacks call while a simulator steps: memory stays where it is, and nothing is lost."""

import os
import subprocess
import sys

import numpy as np
import pytest

from sheldrake.common.value import Value
from sheldrake.systems.analysis import RungeKutta2Integrator, Simulator
from sheldrake.systems.framework import (
    DiagramBuilder,
    LeafSystem,
    LoadContext,
    PublishEvent,
    SaveContext,
    ValueProducer,
    WitnessFunctionDirection,
)
from sheldrake.systems.primitives import ConstantVectorSource, Integrator, LogVectorOutput

PERIOD, END = 1 / 64, 0.5
PLACES = ("periodic", "per_step", "discrete", "unrestricted", "output", "derivatives", "witness", "event", "monitor")


class Caller(LeafSystem):
    """Calls `act(place)` in all kinds of callbacks; y = u, and xdot = 1."""

    def __init__(self, act):
        super().__init__()
        self.act = act
        self.DeclareVectorInputPort("u", 1)
        self.DeclareContinuousState(1)
        self.DeclareDiscreteState(1)
        self.DeclareVectorOutputPort("y", 1, self.output)
        self.DeclarePeriodicPublishEvent(PERIOD, 0.0, lambda context: act("periodic"))
        self.DeclarePerStepPublishEvent(lambda context: act("per_step"))
        self.DeclarePeriodicDiscreteUpdateEvent(PERIOD, 0.0, lambda context, xd: act("discrete"))
        self.DeclarePeriodicUnrestrictedUpdateEvent(PERIOD, 0.0, lambda context, x: act("unrestricted"))
        self.DeclareForcedPublishEvent(lambda context: None)
        event = PublishEvent(system_callback=lambda system, context, event: act("event"))
        crossing = WitnessFunctionDirection.kPositiveThenNonPositive
        self.witness = self.MakeWitnessFunction("sine", crossing, self.watch, event)

    def watch(self, context):
        self.act("witness")
        return np.sin(40 * context.get_time() + 1)

    def DoGetWitnessFunctions(self, context):
        return [self.witness]

    def output(self, context, y):
        self.act("output")
        y.SetFromVector(self.get_input_port().Eval(context))

    def DoCalcTimeDerivatives(self, context, derivatives):
        self.act("derivatives")
        derivatives.SetFromVector([1.0])


class Scene:
    """source -> caller -> integrator -> logs, and a simulator that calls `call(scene)` in one kind of callback.

    Args:
        place: The kind of callback.
        call: What it calls.
        native: As machine code, or interpreted.
        first: From when on [s].
        always: Each time, or once.
    """

    def __init__(self, place, call, native, first=0.25, always=False):
        self.place, self.call, self.first, self.always, self.calls = place, call, first, always, 0
        builder = DiagramBuilder()
        self.source = builder.AddSystem(ConstantVectorSource([1.0]))
        self.caller = builder.AddSystem(Caller(self.act))
        self.integrator = builder.AddSystem(Integrator(1))
        builder.Connect(self.source.get_output_port(), self.caller.get_input_port())
        builder.Connect(self.caller.get_output_port(), self.integrator.get_input_port())
        self.log = LogVectorOutput(self.integrator.get_output_port(), builder)
        self.own_log = LogVectorOutput(self.source.get_output_port(), builder, 10.0)
        self.diagram = builder.Build()
        self.simulator = Simulator(self.diagram)
        self.simulator._native = native
        self.simulator.reset_integrator(RungeKutta2Integrator(self.diagram, PERIOD))
        self.context = self.simulator.get_mutable_context()
        self.simulator.set_monitor(lambda context: self.act("monitor"))

    def act(self, place):
        if place != self.place or self.context.get_time() < self.first or (self.calls and not self.always):
            return
        self.calls += 1
        self.call(self)

    def run(self):
        """Times and values of the log, the last state, and time."""
        self.simulator.AdvanceTo(END)
        assert self.calls
        log = self.log.FindLog(self.context)
        state = self.context.get_continuous_state_vector().CopyToVector()
        return [log.sample_times().tolist(), log.data().tolist(), state.tolist(), self.context.get_time()]


def fill(scene):
    log = scene.own_log.FindMutableLog(scene.context)
    for k in range(100):
        log.AddData(scene.context.get_time(), [k])


def publish_often(scene):
    for _ in range(20):
        scene.diagram.ForcedPublish(scene.context)


def add_entry(scene):
    producer = ValueProducer(lambda: Value[object](None), lambda context, value: value.set_value(3))
    entry = scene.caller.DeclareCacheEntry(f"late {scene.calls}", producer)
    assert entry.Eval(scene.caller.GetMyContextFromRoot(scene.context)) == 3


def copy_into_itself(scene):
    scene.context.SetTimeStateAndParametersFrom(scene.context.Clone())


def step_a_copy(scene):
    other = Simulator(scene.diagram, scene.context.Clone())
    place, scene.place = scene.place, None
    other.AdvanceTo(scene.context.get_time() + 0.1)
    scene.place = place


def read_and_forget(scene):
    for port in (scene.source.get_output_port(), scene.caller.get_output_port()):
        scene.place, place = None, scene.place
        port.Eval(port.get_system().GetMyContextFromRoot(scene.context))
        scene.place = place
    scene.context.SetAllCacheEntriesOutOfDate()


HARMLESS = {
    "AddData": fill,
    "Reserve": lambda s: s.log.FindMutableLog(s.context).Reserve(5000 + 1000 * s.calls),
    "Reserve of all": lambda s: [k.FindMutableLog(s.context).Reserve(700 * s.calls) for k in (s.log, s.own_log)],
    "a cache entry": add_entry,
    "Clone": lambda s: s.context.Clone(),
    "SetTimeStateAndParametersFrom": copy_into_itself,
    "another simulator on a copy": step_a_copy,
    "another simulator": lambda s: Simulator(s.diagram, s.context),
    "Eval": read_and_forget,
    "ToAutoDiffXd": lambda s: s.source.ToAutoDiffXd().CreateDefaultContext(),
    "CreateDefaultContext": lambda s: s.diagram.CreateDefaultContext(),
    "set_monitor": lambda s: s.simulator.set_monitor(s.simulator.get_monitor()),
}
REFUSED = {
    "reset_context": lambda s: s.simulator.reset_context(s.diagram.CreateDefaultContext()),
    "release_context": lambda s: s.simulator.release_context(),
    "reset_integrator": lambda s: s.simulator.reset_integrator(RungeKutta2Integrator(s.diagram, PERIOD)),
    "Initialize": lambda s: s.simulator.Initialize(),
    "AdvanceTo": lambda s: s.simulator.AdvanceTo(END),
    "AdvancePendingEvents": lambda s: s.simulator.AdvancePendingEvents(),
    "AdvanceTo of another": lambda s: Simulator(s.diagram, s.context).AdvanceTo(END),
}
native = pytest.mark.parametrize("native", [True, False], ids=["native", "interpreted"])
from_each_place = pytest.mark.parametrize("place", PLACES)


@native
@from_each_place
@pytest.mark.parametrize("call", HARMLESS)
def test_the_run_is_the_same_whatever_callbacks_call(native, place, call):
    plain = Scene(place, lambda scene: None, native, 0.0, always=True).run()
    assert Scene(place, HARMLESS[call], native, 0.0, always=True).run() == plain


@native
@from_each_place
@pytest.mark.parametrize("call", REFUSED)
def test_what_would_take_the_memory_away_is_refused_by_name(native, place, call):
    scene = Scene(place, REFUSED[call], native)
    with pytest.raises(RuntimeError, match=rf"Simulator.{call.split()[0]}\(\): .* one of its callbacks"):
        scene.run()
    scene.place = None
    scene.simulator.AdvanceTo(END)  # and all is as it was before
    assert scene.context.get_time() == END


@native
@from_each_place
def test_samples_added_in_a_run_are_there_at_once_and_in_order(native, place):
    def add(scene):
        log, number = scene.log.FindMutableLog(scene.context), scene.calls
        log.AddData(-1.0, [number])
        assert log.data()[0, -1] == number
        found = log.data()[0, log.sample_times() == -1.0]
        assert found.tolist() == list(range(1, number + 1))

    scene = Scene(place, lambda s: [add(s) for _ in range(s.__dict__.setdefault("n", 1))], native, 0.0, always=True)
    scene.run()
    times = scene.log.FindLog(scene.context).sample_times()
    assert np.all(np.diff(times[times >= 0]) > 0)


@native
def test_hundreds_of_forced_publishes_a_step(native):
    plain = Scene("monitor", lambda scene: None, native, 0.0, always=True)
    times = np.array(plain.run()[0])
    scene = Scene("monitor", lambda s: [s.diagram.ForcedPublish(s.context) for _ in range(500)], native, 0.0, True)
    found, counts = np.unique(scene.run()[0], return_counts=True)
    assert np.array_equal(found, times)
    assert set(counts) == {501}


@native
@pytest.mark.parametrize("place", ["periodic", "per_step", "monitor", "discrete", "unrestricted", "event"])
def test_a_connected_input_that_a_callback_fixes_has_the_new_value_from_then_on(native, place):
    t = []

    def fix(scene):
        context = scene.caller.GetMyContextFromRoot(scene.context)
        fixed = scene.caller.get_input_port().FixValue(context, [3.0])
        assert scene.caller.get_input_port().Eval(context) == [3.0]
        assert fixed.GetMutableData().get_value().value() == [3.0]
        t.append(scene.context.get_time())

    scene = Scene(place, fix, native)
    times, _, _, end = scene.run()
    x = scene.integrator.GetMyContextFromRoot(scene.context).get_continuous_state_vector().CopyToVector()
    assert end == END
    assert times[-1] == END
    assert np.isclose(x[0], t[0] + 3.0 * (END - t[0]), rtol=1e-14)


@native
@from_each_place
def test_fixing_again_and_again_ends_in_time(native, place):
    def fix(scene):
        context = scene.caller.GetMyContextFromRoot(scene.context)
        fixed = scene.caller.get_input_port().FixValue(context, [scene.calls])
        fixed.GetMutableData().get_mutable_value().SetFromVector([2.0])

    scene = Scene(place, fix, native, 0.0, always=True)
    scene.run()
    context = scene.caller.GetMyContextFromRoot(scene.context)
    scene.place = None
    assert scene.caller.get_input_port().Eval(context) == [2.0]


@from_each_place
def test_a_fixed_input_gives_the_same_run_native_and_interpreted(place):
    def fix(scene):
        scene.caller.get_input_port().FixValue(scene.caller.GetMyContextFromRoot(scene.context), [3.0])

    assert Scene(place, fix, True).run() == Scene(place, fix, False).run()


def runs_of_all_places():
    """What comes out when inputs are fixed and logs grow in the middle of steps."""

    def act(scene):
        fill(scene)
        context = scene.caller.GetMyContextFromRoot(scene.context)
        scene.caller.get_input_port().FixValue(context, [scene.calls])

    return [Scene(place, act, True, 0.1, always=True).run() for place in PLACES]


def test_all_is_the_same_without_machine_code():
    code = f"from {__name__} import runs_of_all_places; print(runs_of_all_places())"
    environment = {**os.environ, "SHELDRAKE_JIT": "0", "PYTHONPATH": os.pathsep.join(p or "." for p in sys.path)}
    found = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert found.stdout.strip() == str(runs_of_all_places())


@native
def test_a_copy_made_in_a_callback_has_what_waits(native, tmp_path):
    copies = []

    def save(scene):
        context = scene.caller.GetMyContextFromRoot(scene.context)
        scene.caller.get_input_port().FixValue(context, [3.0])
        fill(scene), fill(scene), fill(scene)
        SaveContext(scene.context, tmp_path / "saved.npz")
        copies.append(scene.context.Clone())

    scene = Scene("periodic", save, native)
    scene.run()
    copies.append(LoadContext(scene.diagram, tmp_path / "saved.npz"))
    scene.place = None
    for copy in copies:
        assert scene.caller.get_input_port().Eval(scene.caller.GetMyContextFromRoot(copy)) == [3.0]
        assert scene.own_log.FindLog(copy).num_samples() == 301


def test_a_context_keeps_what_it_was_told_when_its_memory_moves():
    scene = Scene("periodic", None, True)
    scene.context.DisableCaching()
    scene.caller.get_input_port().FixValue(scene.caller.GetMyContextFromRoot(scene.context), [3.0])
    assert scene.context._store.uncached
    with pytest.raises(RuntimeError, match="size"):
        scene.integrator.get_input_port().FixValue(scene.integrator.GetMyContextFromRoot(scene.context), [1.0, 2.0])
    assert scene.integrator.get_input_port().Eval(scene.integrator.GetMyContextFromRoot(scene.context)) == [3.0]


@native
def test_a_callback_may_take_the_monitor_away(native):
    scene = Scene("monitor", lambda s: s.simulator.clear_monitor(), native)
    scene.run()
    assert scene.calls == 1
    assert scene.simulator.get_monitor() is None
