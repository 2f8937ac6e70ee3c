"""A context is for one thread at a time; logs may be read by others meanwhile."""

import threading

import numpy as np
import pytest

from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import RevoluteJoint, SpatialInertia
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder, LeafSystem
from sheldrake.systems.primitives import ConstantVectorSource, Integrator, LogVectorOutput, Sine

native = pytest.mark.parametrize("native", [True, False], ids=["native", "interpreted"])


class Turn(LeafSystem):
    """Lets another thread have its turn in the middle of a step."""

    def __init__(self):
        super().__init__()
        self.mine, self.theirs = threading.Event(), threading.Event()
        self.at = np.inf
        self.DeclarePeriodicPublishEvent(0.1, 0.0, self.wait)

    def wait(self, context):
        if context.get_time() >= self.at:
            self.at = np.inf
            self.theirs.set()
            self.mine.wait(10)


def scene(native):
    builder = DiagramBuilder()
    source = builder.AddSystem(Sine(1.0, 2.0, 0.0, 3))
    integrator = builder.AddSystem(Integrator(3))
    builder.Connect(source.get_output_port(0), integrator.get_input_port())
    log = LogVectorOutput(integrator.get_output_port(), builder, 0.001)
    turn = builder.AddSystem(Turn())
    simulator = Simulator(builder.Build())
    simulator._native = native
    return simulator, integrator, log, turn


CALLS = {
    "AdvanceTo": lambda simulator, integrator: simulator.AdvanceTo(2.0),
    "Initialize": lambda simulator, integrator: simulator.Initialize(),
    "AdvanceTo of another": lambda simulator, integrator: Simulator(
        simulator.get_system(), simulator.get_context()
    ).AdvanceTo(2.0),
    "Clone": lambda simulator, integrator: simulator.get_context().Clone(),
    "SetTime": lambda simulator, integrator: simulator.get_mutable_context().SetTime(0.0),
    "SetContinuousState": lambda simulator, integrator: simulator.get_mutable_context().SetContinuousState(np.ones(3)),
    "ForcedPublish": lambda simulator, integrator: simulator.get_system().ForcedPublish(simulator.get_context()),
    "EvalTimeDerivatives": lambda simulator, integrator: simulator.get_system().EvalTimeDerivatives(
        simulator.get_context()
    ),
    "FixValue": lambda simulator, integrator: integrator.get_input_port().FixValue(
        integrator.GetMyContextFromRoot(simulator.get_context()), np.ones(3)
    ),
}


@native
@pytest.mark.parametrize("call", CALLS)
def test_a_second_thread_is_refused_and_the_first_goes_on(native, call):
    simulator, integrator, _, turn = scene(native)
    simulator.Initialize()
    turn.at, errors = 0.3, []

    def other():
        turn.theirs.wait(10)
        try:
            CALLS[call](simulator, integrator)
        except RuntimeError as error:
            errors.append(str(error))
        finally:
            turn.mine.set()

    thread = threading.Thread(target=other)
    thread.start()
    simulator.AdvanceTo(1.0)
    thread.join()
    assert len(errors) == 1
    assert "another thread is using this Context" in errors[0]
    plain, *_ = scene(native)
    plain.AdvanceTo(1.0)
    found = simulator.get_context().get_continuous_state_vector().CopyToVector()
    assert np.array_equal(found, plain.get_context().get_continuous_state_vector().CopyToVector())
    assert simulator.get_context().get_time() == 1.0


PLANT_CALLS = {
    "SetPositions": lambda plant, context, joint: plant.SetPositions(context, [5.0]),
    "SetVelocities": lambda plant, context, joint: plant.SetVelocities(context, [5.0]),
    "SetPositionsAndVelocities": lambda plant, context, joint: plant.SetPositionsAndVelocities(context, [5.0, 5.0]),
    "SetPositions of one": lambda plant, context, joint: plant.SetPositions(context, joint.model_instance(), [5.0]),
    "set_angle": lambda plant, context, joint: joint.set_angle(context, 5.0),
    "set_angular_rate": lambda plant, context, joint: joint.set_angular_rate(context, 5.0),
    "SetDiscreteState": lambda plant, context, joint: context.SetDiscreteState([5.0, 5.0]),
}


def swinging():
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.01))
    body = plant.AddRigidBody("b", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    joint = plant.AddJoint(RevoluteJoint("j", plant.world_frame(), body.body_frame(), [0, 1, 0]))
    plant.Finalize()
    turn = builder.AddSystem(Turn())
    return Simulator(builder.Build()), plant, joint, turn


def end_of_swinging(disturb=None):
    """State after a second, and what another thread was told that called something in the middle."""
    simulator, plant, joint, turn = swinging()
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetPositions(context, [0.3])
    simulator.Initialize()
    errors = []

    def other():
        turn.theirs.wait(10)
        try:
            disturb(plant, context, joint)
        except RuntimeError as error:
            errors.append(str(error))
        finally:
            turn.mine.set()

    if disturb is not None:
        turn.at = 0.3
        thread = threading.Thread(target=other)
        thread.start()
    simulator.AdvanceTo(1.0)
    if disturb is not None:
        thread.join()
    return plant.GetPositionsAndVelocities(context).tolist(), errors


@pytest.mark.parametrize("call", PLANT_CALLS)
def test_a_second_thread_may_not_move_a_plant_that_steps(call):
    end, errors = end_of_swinging(PLANT_CALLS[call])
    assert len(errors) == 1
    assert "another thread is using this Context" in errors[0]
    assert end == end_of_swinging()[0]


@native
def test_two_threads_that_advance_one_context(native):
    simulator, *_ = scene(native)
    simulator.Initialize()
    errors, done = [], []

    def advance(end):
        for _ in range(200):
            try:
                done.append(simulator.AdvanceTo(simulator.get_context().get_time() + end))
            except RuntimeError as error:
                errors.append(str(error))

    threads = [threading.Thread(target=advance, args=(0.01 * (k + 1),)) for k in range(4)]
    [t.start() for t in threads]
    [t.join() for t in threads]
    assert len(errors) + len(done) == 800
    assert all("another thread is using this Context" in e or "lies before the current time" in e for e in errors)
    assert done


@native
def test_a_log_that_another_thread_fills_has_whole_samples_in_order(native):
    builder = DiagramBuilder()
    source = builder.AddSystem(ConstantVectorSource([1.0]))
    integrator = builder.AddSystem(Integrator(1))
    builder.Connect(source.get_output_port(), integrator.get_input_port())
    logs = [LogVectorOutput(integrator.get_output_port(), builder, 0.001 * (k + 1)) for k in range(3)]
    simulator = Simulator(builder.Build())
    simulator._native = native
    context = simulator.get_context()
    simulator.Initialize()
    end, stop, faults, looks = (200.0 if native else 4.0), threading.Event(), [], []

    def read(log):
        before = 0
        while not stop.is_set():
            record = log.FindLog(context)._record().copy()
            looks.append(len(record))
            if len(record) < before or not np.all(np.diff(record[:, 0]) > 0) or np.abs(np.diff(record)).max() > 1e-6:
                faults.append(record)
            before = len(record)

    threads = [threading.Thread(target=read, args=(log,)) for log in logs]
    [t.start() for t in threads]
    simulator.AdvanceTo(end)
    stop.set()
    [t.join() for t in threads]
    assert not faults
    assert len(set(looks)) > 3
    assert logs[0].FindLog(context).num_samples() >= end / 0.001
