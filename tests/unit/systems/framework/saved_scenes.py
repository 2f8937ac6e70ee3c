"""Scenes whose runs are saved half-way: events of all kinds, plants, integrators with a memory of their own.

python saved_scenes.py DIRECTORY     loads NAME.npz of every scene there, runs to the end, writes what came to NAME.npy
"""

import pathlib
import sys

import numpy as np

from sheldrake.common.value import Value
from sheldrake.geometry import HalfSpace, Sphere
from sheldrake.math import RigidTransform
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction, MultibodyPlant
from sheldrake.multibody.tree import RevoluteJoint, SpatialInertia, UnitInertia
from sheldrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from sheldrake.systems.framework import (
    DiagramBuilder,
    LeafSystem,
    LoadContext,
    UnrestrictedUpdateEvent,
    WitnessFunctionDirection,
)

HALF, END = 0.7531, 1.5


class Eventful(LeafSystem):
    """Discrete updates of two periods, unrestricted ones of an abstract state, a witness, an update in every step."""

    def __init__(self):
        super().__init__()
        self.story = self.DeclareAbstractState(Value[object]({"count": 0, "times": []}))
        self.DeclareContinuousState(1, 1, 0)
        for _ in range(2):
            self.DeclareDiscreteState(2)
        self.DeclarePeriodicDiscreteUpdateEvent(0.01, 0.0, self.fast)
        self.DeclarePeriodicDiscreteUpdateEvent(0.1, 0.05, self.slow)
        self.DeclarePeriodicUnrestrictedUpdateEvent(0.07, 0.0, self.tell)
        self.DeclarePerStepDiscreteUpdateEvent(self.count)
        direction = WitnessFunctionDirection.kCrossesZero
        event = UnrestrictedUpdateEvent(system_callback=lambda system, context, event, state: self.turn(context, state))
        self.turning = self.MakeWitnessFunction("turn", direction, self.position, event)

    def position(self, context):
        return context.get_continuous_state_vector()[0]

    def DoGetWitnessFunctions(self, context):
        return [self.turning]

    def DoCalcTimeDerivatives(self, context, derivatives):
        q, v = context.get_continuous_state_vector().CopyToVector()
        pull = context.get_discrete_state(0)[0]
        derivatives.get_mutable_vector().SetFromVector([v, -30.0 * np.sin(q) + 0.01 * pull])

    def fast(self, context, state):
        a = state.get_mutable_vector(0).get_mutable_value()
        a += [np.cos(context.get_time() + a[1]), 0.1 * context.get_continuous_state_vector()[0]]

    def slow(self, context, state):
        state.get_mutable_vector(1).get_mutable_value()[0] += context.get_discrete_state(0)[0]

    def count(self, context, state):
        state.get_mutable_vector(1).get_mutable_value()[1] += 1.0

    def note(self, state, what):
        story = dict(state.get_mutable_abstract_state(int(self.story)).get_value())
        story["count"], story["times"] = story["count"] + 1, [*story["times"], what]
        state.get_mutable_abstract_state(int(self.story)).set_value(story)

    def tell(self, context, state):
        self.note(state, float(context.get_discrete_state(1)[0]))

    def turn(self, context, state):
        self.note(state, float(context.get_time()))


def eventful():
    system = Eventful()
    context = system.CreateDefaultContext()
    context.SetContinuousState([0.5, 0.0])
    return system, context, "runge_kutta3", 1e-4


def ball(time_step):
    """A ball that rolls and bounces."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step)
    body = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    friction = CoulombFriction(0.7, 0.5)
    plant.RegisterCollisionGeometry(body, RigidTransform(), Sphere(0.1), "ball", friction)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", friction)
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    mine = plant.GetMyMutableContextFromRoot(context)
    plant.SetFreeBodyPose(mine, body, RigidTransform([0.0, 0.0, 0.3]))
    plant.SetVelocities(mine, [0.0, 9.0, 1.0, 2.0, 0.0, 0.0])
    return diagram, context


def arm(scheme):
    plant = MultibodyPlant(0.0)
    parent = plant.world_body()
    for k, axis in enumerate(np.eye(3)):
        body = plant.AddRigidBody(f"b{k}", SpatialInertia(1.0, [0.1, 0.2, 0.1], UnitInertia(0.3, 0.4, 0.5)))
        offset = RigidTransform([0.3, 0.0, 0.1])
        plant.AddJoint(RevoluteJoint(f"j{k}", plant.AddFrame(_fixed(parent, offset, k)), body.body_frame(), axis, 2.0))
        parent = body
    plant.Finalize()
    context = plant.CreateDefaultContext()
    context.SetContinuousState([0.3, 0.2, 0.1, 1.0, -2.0, 3.0])
    return plant, context, scheme, 1e-5


def _fixed(body, pose, k):
    from sheldrake.multibody.tree import FixedOffsetFrame

    return FixedOffsetFrame(f"f{k}", body.body_frame(), pose)


SCENES = {
    "eventful": eventful,
    "ball in steps": lambda: (*ball(1e-3), "runge_kutta3", 1e-4),
    "ball in continuous time": lambda: (*ball(0.0), "runge_kutta3", 1e-4),
    "ball by cenic": lambda: (*ball(0.0), "cenic", 1e-3),
    "runge_kutta5": lambda: arm("runge_kutta5"),
    "implicit_euler": lambda: arm("implicit_euler"),
    "velocity_implicit_euler": lambda: arm("velocity_implicit_euler"),
    "radau1": lambda: arm("radau1"),
    "radau3": lambda: arm("radau3"),
}


def simulator_of(system, context, scheme, accuracy):
    simulator = Simulator(system, context)
    integrator = ResetIntegratorFromFlags(simulator, scheme, 0.05)
    integrator.set_target_accuracy(accuracy)
    return simulator


def outcome(context):
    """All of the state as numbers."""
    found = [context.get_continuous_state_vector().CopyToVector(), [context.get_time()]]
    state = context.get_discrete_state()
    found += [state.get_vector(k).CopyToVector() for k in range(state.num_groups())]
    if context.num_abstract_states() == 1 and isinstance(context.get_abstract_state(0).get_value(), dict):
        story = context.get_abstract_state(0).get_value()
        found += [[float(story["count"])], story["times"]]
    return np.concatenate(found)


if __name__ == "__main__":
    for path in sorted(pathlib.Path(sys.argv[1]).glob("*.npz")):
        system, _, scheme, accuracy = SCENES[path.stem]()
        context = LoadContext(system, path)
        simulator_of(system, context, scheme, accuracy).AdvanceTo(END)
        np.save(path.with_suffix(".npy"), outcome(context))
