"""Updates that do the same while nothing changes are not called again until something does."""

from typing import NamedTuple

import numpy as np
import pytest
from tests.scenes.scene import drop, library

import sheldrake
from sheldrake.common.kernel import IntVector, Vector, Vectors, kernel
from sheldrake.systems.analysis import Simulator
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


class Counted(LeafSystem):
    """An update each second that counts its calls."""

    def __init__(self, step=sink_to, repeats=True):
        super().__init__()
        self.DeclareVectorInputPort("floor", 1)
        state = self.DeclareDiscreteState([3.0])
        self._declare_scratch(Calls(np.zeros(1, np.int64)))
        stages = Stages(lambda system, root: [step], lambda stages: repeats)
        self.DeclarePeriodicDiscreteUpdateEvent(1.0, 0.0, stages)
        self.DeclareStateOutputPort("x", state)

    def calls(self, context):
        return int(context._store.scratch(self.GetMyContextFromRoot(context)._node).count[0])


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
