"""Steps are a pure function of the state: what is remembered of contacts changes no bit."""

import numpy as np
import pytest

from sheldrake.all import (
    AddMultibodyPlantSceneGraph,
    Capsule,
    Convex,
    CoulombFriction,
    DiagramBuilder,
    HalfSpace,
    RigidTransform,
    Simulator,
    SpatialInertia,
    Sphere,
)
from sheldrake.systems.framework._engine.scratch import size_of

DT = 1e-3


def heap(rng, count=5):
    """Hulls and capsules that fall into one another, and the plant."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, DT)
    friction = CoulombFriction(0.5, 0.5)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", friction)
    for k in range(count):
        body = plant.AddRigidBody(f"body{k}", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        shape = Capsule(0.05, 0.2) if k == 2 else Convex((0.08 * rng.normal(size=(20, 3))).T, "hull")
        plant.RegisterCollisionGeometry(body, RigidTransform(), shape, f"shape{k}", friction)
        X_WB = RigidTransform([*rng.uniform(-0.05, 0.05, 2), 0.25 + 0.12 * k])
        plant.SetDefaultFloatingBaseBodyPose(body, X_WB)
    plant.Finalize()
    return builder.Build(), plant


def memory_of(plant, simulator):
    context = plant.GetMyContextFromRoot(simulator.get_context())
    table = context._store.scratch(context._node).table
    return table.remembered, table.slot


def test_steps_are_the_same_bits_however_often_memory_is_lost():
    rng = np.random.default_rng(3)
    diagram, plant = heap(rng)
    kept, mixed = Simulator(diagram), Simulator(diagram)
    remembered = 0
    for step in range(1, 400):
        for simulator in (kept, mixed):
            simulator.AdvanceTo(step * DT)
        if rng.random() < 0.1:
            for memory in memory_of(plant, mixed):
                memory[:] = 0
        remembered += np.count_nonzero(memory_of(plant, kept)[0])
        states = [s.get_context().get_discrete_state_vector().CopyToVector() for s in (kept, mixed)]
        assert states[0].tobytes() == states[1].tobytes()
    assert remembered > 400


@pytest.mark.parametrize("dt", [DT, 0.0], ids=["discrete", "continuous"])
def test_contexts_have_scratch_for_contacts_only_where_something_can_touch(dt):
    """That of searches is as large as that of a thousand bodies."""

    def words(shapes):
        builder = DiagramBuilder()
        plant, _ = AddMultibodyPlantSceneGraph(builder, dt)
        plant.AddRigidBody("falls", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        for name, X in shapes.items():
            body = plant.world_body() if name == "ground" else plant.GetBodyByName("falls")
            plant.RegisterCollisionGeometry(body, X, Sphere(0.1), name, CoulombFriction(0.5, 0.5))
        plant.Finalize()
        simulator = Simulator(builder.Build())
        simulator.AdvanceTo(0.1)
        context = plant.GetMyContextFromRoot(simulator.get_context())
        z = plant.GetPositions(context)[-1]
        assert abs(z + 0.05) < 0.01  # it falls all the same
        return size_of(context._store.scratch(context._node))

    nothing, one = words({}), words({"falls": RigidTransform()})
    both = words({"falls": RigidTransform(), "ground": RigidTransform([9.0, 0.0, 0.0])})
    assert nothing < 500
    assert nothing < one < nothing + 50  # where it is
    assert both > one + 5000
