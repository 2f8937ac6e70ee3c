"""Updates that do the same while nothing changes are not called again until something does."""

from typing import NamedTuple

import numpy as np
import pytest
from tests.scenes.scene import drop, library

import sheldrake
from sheldrake.common.kernel import IntVector, Vector, Vectors, kernel
from sheldrake.systems.analysis import BatchSimulator, Simulator
from sheldrake.systems.framework import DiagramBuilder, EventStatus, LeafSystem
from sheldrake.systems.framework._declarations import Stages
from sheldrake.systems.primitives import ConstantVectorSource, LogVectorOutput, Sine


class Calls(NamedTuple):
    count: IntVector


@kernel(top=True)
def sink_to(xd: Vector, u: Vectors, work: Calls, x_next: Vector) -> None:
    """Down by one, but not below the input."""
    work.count[0] += 1
    x_next[0] = max(xd[0] - 1.0, u[0][0])


@kernel(top=True)
def change_sign(xd: Vector, u: Vectors, work: Calls, x_next: Vector) -> None:
    work.count[0] += 1
    x_next[0] = -xd[0]


@kernel(top=True)
def rise(xd: Vector, x_next: Vector) -> None:
    x_next[0] = xd[0] + 10.0


class Counted(LeafSystem):
    """An update, each second if not told otherwise, that counts its calls."""

    def __init__(self, step=sink_to, repeats=True, period=1.0, offset=0.0):
        super().__init__()
        self.DeclareVectorInputPort("floor", 1)
        state = self.DeclareDiscreteState([3.0])
        self._declare_scratch(Calls(np.zeros(1, np.int64)))
        stages = Stages(lambda system, root: [step], lambda stages: repeats)
        self.DeclarePeriodicDiscreteUpdateEvent(period, offset, stages)
        self.DeclareStateOutputPort("x", state)

    def calls(self, context):
        return int(context._store.scratch(self.GetMyContextFromRoot(context)._node).count[0])


class Rising(LeafSystem):
    """A number that rises each 20 s."""

    def __init__(self, offset):
        super().__init__()
        state = self.DeclareDiscreteState([0.0])
        self.DeclarePeriodicDiscreteUpdateEvent(20.0, offset, rise)
        self.DeclareStateOutputPort("x", state)


class Scene:
    def __init__(self, native, counted=None, source=None, write=None):
        builder = DiagramBuilder()
        self.source = builder.AddSystem(source or ConstantVectorSource([0.0]))
        self.counted = builder.AddSystem(counted or Counted())
        builder.Connect(self.source.get_output_port(0), self.counted.get_input_port())
        self.sink = LogVectorOutput(self.counted.get_output_port(), builder)
        if write:
            builder.AddSystem(LeafSystem()).DeclarePeriodicPublishEvent(10.0, 10.0, lambda _: write(self))
        self.simulator = Simulator(builder.Build())
        self.simulator._native = native
        self.context = self.simulator.get_mutable_context()
        self.state = self.counted.GetMyMutableContextFromRoot(self.context).get_mutable_discrete_state_vector()

    def set_floor(self, value):
        context = self.source.GetMyMutableContextFromRoot(self.context)
        self.source.get_mutable_source_value(context).SetFromVector([value])

    def calls(self):
        return self.counted.calls(self.context)

    def values(self):
        return self.sink.FindLog(self.context).data()[0]


@pytest.fixture(params=[False, True], ids=["interpreted", "native"])
def native(request):
    return request.param


def test_what_changes_nothing_is_counted_but_not_called_again(native):
    scene = Scene(native)
    scene.simulator.AdvanceTo(100.0)
    assert scene.calls() == 4
    assert scene.simulator.get_num_discrete_updates() == 100
    assert scene.values().tolist() == [3.0, 2.0, 1.0, *[0.0] * 98]


def test_what_reads_a_constant_in_python_rests_too(native):
    class Constant(LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareVectorOutputPort(
                "y", 1, lambda context, y: y.SetFromVector([1.0]), prerequisites_of_calc={self.nothing_ticket()}
            )

    scene = Scene(native, source=Constant())
    scene.simulator.AdvanceTo(100.0)
    assert scene.calls() == 3 and scene.values()[-1] == 1.0


def test_what_is_written_between_two_advances_is_seen(native):
    scene = Scene(native)
    scene.simulator.AdvanceTo(50.0)
    scene.set_floor(-2.0)
    scene.simulator.AdvanceTo(100.0)
    assert scene.values()[-1] == -2.0
    scene.state.SetFromVector([7.0])
    scene.simulator.AdvanceTo(150.0)
    assert scene.values()[100:104].tolist() == [-2.0, 6.0, 5.0, 4.0]


def test_what_python_publishes_write_is_seen(native):
    """Also what is written through a view of the state that was taken long ago."""
    scene = Scene(native, write=lambda scene: scene.set_floor(-scene.context.get_time()))
    scene.simulator.AdvanceTo(100.0)
    assert scene.values()[-1] == -90.0  # what is written at 100 has no update yet
    view = scene.state.get_mutable_value()

    def lift(scene):
        view[0] = 5.0

    scene = Scene(native, write=lift)
    view = scene.state.get_mutable_value()
    scene.simulator.AdvanceTo(15.0)
    assert scene.values()[9:].tolist() == [0.0, 0.0, 4.0, 3.0, 2.0, 1.0, 0.0]


@pytest.mark.parametrize("reason", ["time", "monitor", "does not say so"])
def test_other_updates_are_called_each_time(native, reason):
    source = Sine(0.0, 1.0, 0.0, 1) if reason == "time" else None
    scene = Scene(native, Counted(repeats=reason != "does not say so"), source)
    if reason == "monitor":
        scene.simulator.set_monitor(lambda context: EventStatus.DidNothing())
    scene.simulator.AdvanceTo(100.0)
    assert scene.calls() == 100
    assert scene.values()[-1] == 0.0


def chain(source, native, watched, **slow):
    """A counted update each second that follows a source, another that follows it, and a log of the latter.

    A monitor has every step computed.
    """
    builder = DiagramBuilder()
    source = builder.AddSystem(source)
    first, second = builder.AddSystem(Counted()), builder.AddSystem(Counted(**slow))
    builder.Connect(source.get_output_port(), first.get_input_port())
    builder.Connect(first.GetOutputPort("x"), second.get_input_port())
    sink = LogVectorOutput(second.GetOutputPort("x"), builder)
    simulator = Simulator(builder.Build())
    simulator._native = native
    if watched:
        simulator.set_monitor(lambda context: EventStatus.DidNothing())
    simulator.AdvanceTo(100.0)
    context = simulator.get_context()
    calls = first.calls(context), second.calls(context)
    return calls, sink.FindLog(context).data().tobytes(), simulator.get_num_discrete_updates()


CLOCKS = [dict(period=1.0), dict(period=4.0), dict(period=4.0, offset=0.5), dict(period=0.25), dict(period=0.7)]


@pytest.mark.parametrize("slow", CLOCKS, ids=str)
def test_updates_of_several_clocks_rest_together(native, slow):
    calls, log, updates = chain(ConstantVectorSource([0.0]), native, False, **slow)
    all_calls, all_log, all_updates = chain(ConstantVectorSource([0.0]), native, True, **slow)
    assert log == all_log and updates == all_updates and all_calls[0] == 100
    assert sum(calls) <= sum(all_calls) // 5  # the faster one is called too until the slower one rests


@pytest.mark.parametrize("offset", [0.0, 0.3])
@pytest.mark.parametrize("slow", CLOCKS, ids=str)
def test_updates_wake_those_that_read_what_they_change(native, slow, offset):
    calls, log, updates = chain(Rising(offset), native, False, **slow)
    all_calls, all_log, all_updates = chain(Rising(offset), native, True, **slow)
    assert log == all_log and updates == all_updates
    assert np.frombuffer(log)[-1] >= 40.0  # it has risen with the source
    assert calls[0] < all_calls[0]


@pytest.mark.parametrize("status", [EventStatus.Succeeded, EventStatus.DidNothing])
def test_updates_in_python_wake_all_others(native, status):
    """They may write anything, also through views that were taken long ago; so this one does, and changes nothing."""
    builder = DiagramBuilder()
    counted, source = builder.AddSystem(Counted()), builder.AddSystem(ConstantVectorSource([0.0]))
    builder.Connect(source.get_output_port(), counted.get_input_port())
    python = builder.AddSystem(LeafSystem())
    python.DeclareDiscreteState([0.0])
    python.DeclarePeriodicDiscreteUpdateEvent(10.0, 9.5, lambda context, state: lift())
    sink = LogVectorOutput(counted.GetOutputPort("x"), builder)
    simulator = Simulator(builder.Build())
    simulator._native = native
    context = counted.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    view = context.get_mutable_discrete_state_vector().get_mutable_value()

    def lift():
        view[0] = 5.0
        return status()

    simulator.AdvanceTo(25.0)
    log = sink.FindLog(simulator.get_context())
    at = dict(zip(log.sample_times().tolist(), log.data()[0].tolist()))
    assert [at[t] for t in (9.0, 11.0, 12.0, 15.0, 16.0, 19.0, 21.0)] == [0.0, 4.0, 3.0, 0.0, 0.0, 0.0, 4.0]


def test_zeros_of_both_signs_are_no_rest(native):
    scene = Scene(native, Counted(change_sign))
    scene.state.SetFromVector([0.0])
    scene.simulator.AdvanceTo(9.0)
    assert np.signbit(scene.values()).tolist() == [False, True] * 5


def test_a_block_at_rest_has_the_bits_of_all_steps():
    """A monitor has every step computed."""
    ours, found = library("sheldrake"), []
    block = sheldrake.model_path("two_hole_block/two_hole_block.urdf")
    for watched in (False, True):
        simulator, sink, plant, model = drop(ours, block)
        if watched:
            simulator.set_monitor(lambda context: EventStatus.DidNothing())
        simulator.AdvanceTo(0.5)
        context = plant.GetMyContextFromRoot(simulator.get_context())
        body = plant.GetBodyByName("body", model)
        push = ours.SpatialVelocity([0.0, 0.0, 0.0], [0.3, 0.1, 0.0])
        results = plant.get_contact_results_output_port().Eval(context)
        contacts = [results.point_pair_contact_info(k) for k in range(results.num_point_pair_contacts())]
        forces = [info.contact_force().tolist() for info in contacts]
        plant.SetFreeBodySpatialVelocity(plant.GetMyMutableContextFromRoot(simulator.get_mutable_context()), body, push)
        simulator.AdvanceTo(1.0)
        counts = simulator.get_num_unrestricted_updates(), simulator.get_num_publishes()
        found.append((sink.FindLog(simulator.get_context()).data().tobytes(), forces, counts))
    assert found[0] == found[1]
    data = np.frombuffer(found[0][0]).reshape(13, -1)
    assert np.array_equal(data[:, 490], data[:, 500]) and not np.array_equal(data[:3, 500], data[:3, 1000])


@pytest.mark.parametrize("count", [12, 210], ids=["near pairs are listed", "pairs are sought in cells"])
def test_many_bodies_at_rest_have_the_bits_of_all_steps(count):
    """Stacks of two; a monitor has every step computed."""
    ours, found = library("sheldrake"), []
    shapes = [ours.Box(0.1, 0.1, 0.1), ours.Sphere(0.05), ours.Cylinder(0.05, 0.1)][: 3 if count > 200 else 1]
    for watched in (False, True):
        builder = ours.DiagramBuilder()
        plant, _ = ours.AddMultibodyPlantSceneGraph(builder, 1e-3)
        friction = ours.CoulombFriction(0.5, 0.5)
        plant.RegisterCollisionGeometry(plant.world_body(), ours.RigidTransform(), ours.HalfSpace(), "ground", friction)
        bodies = [
            plant.AddRigidBody(f"body{k}", ours.SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 0.1))
            for k in range(count)
        ]
        for k, body in enumerate(bodies):
            shape = shapes[k // 2 % len(shapes)]
            plant.RegisterCollisionGeometry(body, ours.RigidTransform(), shape, f"shape{k}", friction)
        plant.Finalize()
        sink = ours.LogVectorOutput(plant.get_state_output_port(), builder, 0.01)
        simulator = ours.Simulator(builder.Build())
        context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        for k, body in enumerate(bodies):
            p = [0.15 * (k // 2 % 15), 0.15 * (k // 30), 0.05 + 0.1 * (k % 2)]
            plant.SetFreeBodyPose(context, body, ours.RigidTransform(p))
        if watched:
            simulator.set_monitor(lambda context: EventStatus.DidNothing())
        simulator.AdvanceTo(0.2)
        assert (simulator._span.run.resting != 0) != watched
        push = ours.SpatialVelocity([0.0, 0.0, 0.0], [0.5, 0.0, 0.0])
        plant.SetFreeBodySpatialVelocity(context, bodies[1], push)
        simulator.AdvanceTo(0.3)
        found.append(sink.FindLog(simulator.get_context()).data())
    np.testing.assert_array_equal(*(data.view(np.int64) for data in found))
    data = found[0]
    assert np.array_equal(data[:, 15], data[:, 20]) and not np.array_equal(data[:, 20], data[:, 21])


class TestWorlds:
    """Worlds of a batch leave out what a simulator does, also where several go together."""

    @pytest.fixture(params=[(1, 1), (3, 1), (4, 2), (9, 3), (67, 8)], ids=str)
    def batch(self, request):
        count, threads = request.param
        scene = Scene(True)
        batch = BatchSimulator(scene.simulator.get_system(), count, num_threads=threads)
        return scene, batch

    def calls(self, scene, batch):
        return [scene.counted.calls(batch.context(w)) for w in range(batch.num_worlds())]

    def values(self, scene, batch, w):
        return scene.sink.FindLog(batch.context(w)).data()[0]

    def test_what_changes_nothing_is_not_called(self, batch):
        scene, batch = batch
        batch.AdvanceTo(100.0)
        assert self.calls(scene, batch) == [4] * batch.num_worlds()
        assert self.values(scene, batch, 0).tolist() == [3.0, 2.0, 1.0, *[0.0] * 98]

    def test_what_is_written_between_two_advances_is_seen(self, batch):
        """Into arrays that were taken before, which tells nobody; and in one world alone."""
        scene, batch = batch
        states, floors = batch.states(), batch.parameters(scene.source)
        last = batch.num_worlds() - 1
        batch.AdvanceTo(50.0)
        states[last] = 7.0
        batch.AdvanceTo(60.0)
        floors[last] = -2.0
        batch.AdvanceTo(70.0)
        assert self.values(scene, batch, last)[50:62].tolist() == [0.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0, *[0.0] * 4, -1.0]
        assert last == 0 or not np.any(self.values(scene, batch, 0)[4:])

    def test_short_advances_call_nothing_where_nothing_was_written(self, batch):
        """Nor do outputs that are asked for meanwhile, or inputs that are written again as they are."""
        _, batch = batch
        system, count = Counted(), batch.num_worlds()
        batch = BatchSimulator(system, count, num_threads=batch.num_threads())
        floors, contexts = batch.inputs(system.get_input_port()), [batch.context(w) for w in range(count)]
        batch.AdvanceSteps(10)
        before = [system.calls(context) for context in contexts]
        for n in (1, 2, 3):
            batch.AdvanceSteps(n)
            batch.inputs(system.get_input_port())[:] = floors.copy()
            assert not np.any(batch.EvalOutputs(system.GetOutputPort("x")))
            batch.Record(system.GetOutputPort("x"), 2, np.zeros((count, 2, 1)))
        assert [system.calls(context) for context in contexts] == before or not batch.is_native()
        assert batch.times.tolist() == [22.0] * count

    @pytest.mark.parametrize("value", [-1.0, -0.0, 5e-324, np.nan])
    @pytest.mark.parametrize("what", ["state", "input", "input, and asks for outputs", "input by its context"])
    def test_a_bit_that_is_written_between_short_advances_is_seen(self, batch, what, value):
        _, batch = batch
        system, count = Counted(), batch.num_worlds()
        batch = BatchSimulator(system, count, num_threads=batch.num_threads(), raise_failures=False)
        port, states = system.get_input_port(), batch.states()
        floors, contexts = batch.inputs(port), [batch.context(w) for w in range(count)]
        for n in (10, 1, 1):
            batch.AdvanceSteps(n)
        written = states if what == "state" else floors
        if what.endswith("context"):
            port.FixValue(contexts[-1], [value])
        else:
            written[-1] = value
        if what.endswith("outputs"):
            batch.EvalOutputs(system.GetOutputPort("x"))
        x, floor = (value, 0.0) if what == "state" else (0.0, value)
        expected = np.zeros((count, 1))
        for _ in range(3):
            batch.AdvanceSteps(1)
            x = expected[-1] = floor if floor > x - 1.0 else x - 1.0
            np.testing.assert_array_equal(states.view(np.int64), expected.view(np.int64))

    def test_what_is_written_and_taken_back_while_outputs_are_computed_is_no_rest(self, batch):
        scene, batch = batch
        if not batch.is_native():
            pytest.skip("worlds without machine code have a Simulator each")
        states, port = batch.states(), scene.counted.GetOutputPort("x")
        batch.AdvanceSteps(10)
        rest = states.copy()
        states[:] = 5.0
        assert (batch.EvalOutputs(port) == 5.0).all()
        states[:] = rest
        assert (batch.EvalOutputs(port) == rest).all()
        batch.AdvanceSteps(1)
        assert (batch.EvalOutputs(port) == rest).all() and (states == rest).all()

    def test_worlds_set_back_begin_anew(self, batch):
        _, batch = batch
        for _ in range(2):
            for n in (10, 1, 1):
                batch.AdvanceSteps(n)
            batch.Reset()
            assert (batch.states() == 3.0).all()
        batch.AdvanceSteps(2)
        assert (batch.states() == 1.0).all()

    def test_inputs_of_samples_are_seen(self, batch):
        _, batch = batch
        system, count = Counted(), batch.num_worlds()
        batch = BatchSimulator(system, count, num_threads=batch.num_threads())
        floors = np.zeros((count, 50, 1))
        floors[:, 20:30], floors[0, 30:], floors[:, 45:] = 8.0, -1.0, np.nan
        floors[-1, 10:15] = -0.0
        found = batch.Record(system.GetOutputPort("x"), 50, floors)
        expected = np.full((count, 1), 3.0)
        for k in range(50):
            expected = np.where(floors[:, k] > expected - 1.0, floors[:, k], expected - 1.0)  # as max does
            np.testing.assert_array_equal(found[:, k].view(np.int64), expected.view(np.int64))
        assert system.calls(batch.context(0)) <= 30 or not batch.is_native()  # else each sample is an AdvanceTo


def contacts_of(plant, context):
    """Where contacts are and their forces."""
    results = plant.get_contact_results_output_port().Eval(plant.GetMyContextFromRoot(context))
    found = [results.point_pair_contact_info(k) for k in range(results.num_point_pair_contacts())]
    return [(info.contact_point().tolist(), info.contact_force().tolist()) for info in found]


@pytest.mark.parametrize("threads", [2, 8])
def test_blocks_that_come_to_rest_have_the_bits_of_simulators(threads):
    """In fours and alone, together and each at its own time; then all are put elsewhere, to rest there."""
    simulator, sink, plant, _ = drop(library("sheldrake"), sheldrake.model_path("two_hole_block/two_hole_block.urdf"))
    diagram, count = simulator.get_system(), 9
    batch = BatchSimulator(diagram, count, simulator.get_context(), num_threads=threads)
    batch.states(plant)[:, 6] += 0.02 * np.maximum(np.arange(count) - 3, 0)  # the first four are alike
    alone = []
    for w in range(count):
        alone.append(Simulator(diagram, batch.context(w).Clone()))
        alone[w].set_monitor(lambda context: EventStatus.DidNothing())
    for parts, aside in [((1, 299, 700), 1.0), ((1, 3, *[4] * 100), 2.0), ((100,), 0.0)]:
        for n in parts:
            batch.AdvanceSteps(n)
        for w, simulator in enumerate(alone):
            simulator.AdvanceTo(batch.times[w])
            ours, theirs = batch.context(w), simulator.get_mutable_context()
            assert sink.FindLog(ours).data().tobytes() == sink.FindLog(theirs).data().tobytes()
            assert contacts_of(plant, ours) == contacts_of(plant, theirs) and len(contacts_of(plant, ours)) >= 3
            theirs = plant.GetMyMutableContextFromRoot(theirs)
            plant.SetPositions(theirs, plant.GetPositions(theirs) + aside * np.eye(7)[4])
        batch.states(plant)[:, 4] += aside
    before = batch.states(plant).copy()
    batch.AdvanceSteps(1)
    assert np.array_equal(before.view(np.int64), batch.states(plant).view(np.int64))
