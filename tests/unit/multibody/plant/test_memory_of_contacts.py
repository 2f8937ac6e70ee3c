"""Steps are a pure function of the state: what is remembered of contacts changes no bit."""

import numpy as np

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
)

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
