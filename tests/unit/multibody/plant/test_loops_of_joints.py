"""Loops of bodies and joints, cut by Finalize(); the cuts and numbers of positions expected are those of Drake 1.58."""

import numpy as np
import pytest

from sheldrake.geometry import Sphere
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    CoulombFriction,
    DiscreteContactApproximation,
    MultibodyPlant,
)
from sheldrake.multibody.tree import BodyIndex, FixedOffsetFrame, PlanarJoint, RevoluteJoint
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder

INERTIA = SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.2, 0.3)


def joined(plant, edges):
    """Bodies b1, b2, ... in the plant; each edge (u, v) is a revolute joint from body u to body v, 0 is the world."""
    bodies = [plant.world_body(), *(plant.AddRigidBody(f"b{i}", INERTIA) for i in range(1, 1 + max(map(max, edges))))]
    for k, (u, v) in enumerate(edges):
        F = plant.AddFrame(FixedOffsetFrame(f"p{k}", bodies[u], RigidTransform([0.1 * k, 0, 0])))
        M = plant.AddFrame(FixedOffsetFrame(f"c{k}", bodies[v], RigidTransform([0, 0.1 * k, 0])))
        plant.AddJoint(RevoluteJoint(f"j{k}", F, M, [0, 1, 0]))
    return bodies


@pytest.mark.parametrize(
    ("edges", "divided", "starts"),
    [
        ([(0, 1), (1, 2), (2, 3), (0, 3)], ["b2$1"], [0, 1, 3, 2]),
        ([(0, 1), (1, 2), (2, 3), (3, 0)], ["b2$1"], [0, 1, 3, 2]),
        ([(0, 1), (1, 2), (2, 3), (3, 4), (0, 4)], ["b3$1"], [0, 1, 2, 4, 3]),
        ([(0, 1), (1, 2), (0, 3), (3, 2)], ["b2$1"], [0, 1, 2, 3]),
        ([(0, 1), (0, 2), (2, 1)], ["b1$1"], [0, 1, 2]),
        ([(0, 1), (0, 2), (1, 2)], ["b2$1"], [0, 2, 1]),
        ([(0, 1), (1, 2), (1, 3), (2, 4), (3, 4)], ["b4$1"], [0, 1, 3, 2, 4]),
        ([(1, 2), (2, 3), (1, 3)], ["b3$1"], [7, 8, 9]),
        ([(0, 1), (1, 2), (2, 3), (0, 3), (1, 4), (3, 4)], ["b2$1", "b4$1"], [0, 1, 4, 3, 2, 5]),
        ([(0, 1), (1, 2)], [], [0, 1]),
    ],
)
def test_loops_are_cut_where_drake_cuts_them(edges, divided, starts):
    plant = MultibodyPlant(0.001)
    plant.SetEnableLoopTopology(True)
    whole = len(joined(plant, edges))
    plant.Finalize()
    parts = [plant.get_body(BodyIndex(i)) for i in range(whole, plant.num_bodies())]
    assert [b.name() for b in parts] == divided and all(b.is_ephemeral() for b in parts)
    assert plant.num_loop_constraints() == len(divided) == plant.num_constraints()
    assert [plant.GetJointByName(f"j{k}").position_start() for k in range(len(edges))] == starts
    context = plant.CreateDefaultContext()
    assert plant.CalcTotalMass(context) == pytest.approx(whole - 1.0)
    for k in range(len(edges)):  # each end of a joint is where it was on its body
        M = plant.GetJointByName(f"j{k}").frame_on_child()
        assert M.GetFixedPoseInBodyFrame().translation() == pytest.approx([0, 0.1 * k, 0])


def test_loops_are_refused_unless_wanted():
    plant = MultibodyPlant(0.001)
    joined(plant, [(0, 1), (0, 2), (1, 2)])
    assert not plant.GetEnableLoopTopology() and plant.num_loop_constraints() == 0
    with pytest.raises(RuntimeError, match=r"form a loop, closed by joint 'j1'.*SetEnableLoopTopology\(True\)"):
        plant.Finalize()
    plant.SetEnableLoopTopology(True)
    plant.Finalize()
    with pytest.raises(RuntimeError, match="post-finalize"):
        plant.SetEnableLoopTopology(False)


def test_what_cannot_be_cut_leaves_the_plant_as_it_was():
    plant = MultibodyPlant(0.001)
    plant.set_discrete_contact_approximation(DiscreteContactApproximation.kTamsi)
    plant.SetEnableLoopTopology(True)
    bodies = joined(plant, [(0, 1), (0, 2), (1, 2)])
    with pytest.raises(RuntimeError, match=r"Finalize\(\).*takes no constraints"):
        plant.Finalize()
    assert plant.num_bodies() == 3 and bodies[2].default_mass() == 1.0
    plant.set_discrete_contact_approximation(DiscreteContactApproximation.kLagged)
    plant.AddJoint(PlanarJoint("flat", plant.AddRigidBody("b3", INERTIA).body_frame(), bodies[1].body_frame()))
    with pytest.raises(RuntimeError, match="have to be reversed"):
        plant.Finalize()
    assert plant.num_bodies() == 4 and bodies[2].default_mass() == 1.0 and plant.num_constraints() == 0


def test_a_parallelogram_swings_as_a_pendulum():
    """Cranks of length L and a coupler, each of mass m: (2 (I + m L²/4) + m L²) q'' = -2 m g L sin q."""
    L, m, dt, q0 = 0.5, 1.0, 1e-4, 0.7
    plant = MultibodyPlant(dt)
    plant.SetEnableLoopTopology(True)
    rod = SpatialInertia.SolidBoxWithMass(m, 0.02, 0.02, L)
    A, B, C = (plant.AddRigidBody(name, rod) for name in "ABC")
    world = plant.world_body()

    def hinge(name, parent, p, child, c):
        F = plant.AddFrame(FixedOffsetFrame(f"{name}F", parent, RigidTransform(p)))
        M = plant.AddFrame(FixedOffsetFrame(f"{name}M", child, RigidTransform(c)))
        return plant.AddJoint(RevoluteJoint(name, F, M, [0, 1, 0]))

    left = hinge("left", world, [0, 0, 0], A, [0, 0, L / 2])
    right = hinge("right", world, [1, 0, 0], B, [0, 0, L / 2])
    a = hinge("a", A, [0, 0, -L / 2], C, [-0.5, 0, 0])
    b = hinge("b", C, [0.5, 0, 0], B, [0, 0, -L / 2])
    plant.Finalize()
    simulator = Simulator(plant)
    context = simulator.get_mutable_context()
    for joint, q in ((left, q0), (right, q0), (a, -q0), (b, q0)):
        joint.set_angle(context, q)
    simulator.AdvanceTo(0.1)
    I_pivot = rod.get_unit_inertia().get_moments()[1] * m + m * L**2 / 4
    stiffness, inertia = 2 * m * 9.81 * L, 2 * I_pivot + m * L**2
    q, v = q0, 0.0
    for _ in range(1000):
        v -= dt * stiffness / inertia * np.sin(q)
        q += dt * v
    assert left.get_angle(context) == pytest.approx(q, abs=1e-6)
    assert right.get_angle(context) == pytest.approx(q, abs=1e-6)
    assert left.get_angular_rate(context) == pytest.approx(v, rel=1e-4)


def test_neighbours_of_a_divided_body_do_not_touch_it():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.001)
    plant.SetEnableLoopTopology(True)
    bodies = joined(plant, [(0, 1), (1, 2), (2, 3), (0, 3)])
    for body in bodies[1:]:
        plant.RegisterCollisionGeometry(body, RigidTransform(), Sphere(0.5), "ball", CoulombFriction(1.0, 1.0))
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    query = plant.get_geometry_query_input_port().Eval(plant.GetMyContextFromRoot(context))
    touching = [
        {query.inspector().GetName(query.inspector().GetFrameId(i)) for i in (pair.id_A, pair.id_B)}
        for pair in query.ComputePointPairPenetration()
    ]
    assert len(touching) == 1 and {name.rpartition("::")[2] for name in touching[0]} == {"b1", "b3"}
