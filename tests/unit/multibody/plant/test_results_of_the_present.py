"""Ports that speak of the present state: they owe nothing to what was asked before, and bind their kernels once."""

import numpy as np
import pytest

from sheldrake.common.kernel import Kernel, jit_enabled
from sheldrake.geometry import Box, CollisionFilterDeclaration, GeometrySet, Sphere
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.multibody.tree import ModelInstanceIndex, RevoluteJoint
from sheldrake.systems.framework import DiagramBuilder

PORTS = (
    "contact_results", "net_actuation", "generalized_acceleration", "body_spatial_accelerations", "reaction_forces",
    "DefaultModelInstance_generalized_contact_forces",
)  # fmt: skip


@pytest.fixture(params=[0.0, 0.001])
def scene(request):
    """An arm of one actuated joint and a ball on a box."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, request.param)
    if request.param:
        plant.SetUseSampledOutputPorts(False)
    ball = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    link = plant.AddRigidBody("link", SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 0.5))
    joint = RevoluteJoint("joint", plant.world_frame(), link.body_frame(), [0, 1, 0])
    plant.AddJoint(joint)
    plant.AddJointActuator("motor", joint)
    friction = CoulombFriction(0.5, 0.5)
    plant.RegisterCollisionGeometry(ball, RigidTransform(), Sphere(0.1), "ball", friction)
    pose = RigidTransform([0.0, 0.0, -0.1])
    plant.RegisterCollisionGeometry(plant.world_body(), pose, Box(9.0, 9.0, 0.2), "ground", friction)
    plant.Finalize()
    return builder.Build(), plant, scene_graph


def new_context(scene):
    diagram, plant, _ = scene
    context = plant.GetMyMutableContextFromRoot(diagram.CreateDefaultContext())
    plant.get_actuation_input_port().FixValue(context, [0.0])
    return context


def write(plant, context, rng):
    """A state in which the ball may or may not touch, and an effort."""
    q, v = plant.GetPositions(context), rng.normal(size=plant.num_velocities())
    q[:] = rng.normal(size=len(q))
    ball = plant.GetBodyByName("ball")
    plant.SetPositions(context, q)
    plant.SetFreeBodyPose(context, ball, RigidTransform([0.1, 0.2, rng.choice([0.098, 0.5])]))
    plant.SetVelocities(context, v)
    plant.get_actuation_input_port().FixValue(context, rng.normal(size=1))


def numbers(plant, context):
    """All that the ports say, as numbers."""
    found = []
    for name in PORTS:
        value = plant.GetOutputPort(name).Eval(context)
        if name == "contact_results":
            infos = [value.point_pair_contact_info(k) for k in range(value.num_point_pair_contacts())]
            value = [[*info.contact_point(), *info.contact_force(), info.slip_speed()] for info in infos]
        elif not isinstance(value, np.ndarray):
            value = [part.get_coeffs() for part in value]
        found.append(np.ravel(np.array(value, float)))
    return np.concatenate(found)


def test_results_do_not_depend_on_what_was_asked_before(scene):
    _, plant, _ = scene
    used, sizes = new_context(scene), set()
    for seed in range(12):
        write(plant, used, np.random.default_rng(seed))
        fresh = new_context(scene)
        write(plant, fresh, np.random.default_rng(seed))
        found = numbers(plant, used)
        sizes.add(len(found))
        np.testing.assert_array_equal(found, numbers(plant, fresh))
    assert len(sizes) == 2  # with and without a contact


def test_results_that_are_kept_stay_as_they_are(scene):
    _, plant, _ = scene
    context, ball = new_context(scene), plant.GetBodyByName("ball")

    def said_of(info):
        pair = info.point_pair()
        vectors = (info.contact_point(), info.contact_force(), pair.p_WCa, pair.p_WCb, pair.nhat_BA_W)
        return np.concatenate([*vectors, [pair.depth, info.slip_speed()]])

    plant.SetFreeBodyPose(context, ball, RigidTransform([0.1, 0.2, 0.098]))
    info = plant.GetOutputPort("contact_results").Eval(context).point_pair_contact_info(0)
    vdot = plant.GetOutputPort("generalized_acceleration").Eval(context)
    before = said_of(info).copy(), vdot.copy()
    plant.SetFreeBodyPose(context, ball, RigidTransform([0.5, -0.2, 0.09]))
    again = plant.GetOutputPort("contact_results").Eval(context).point_pair_contact_info(0)
    plant.GetOutputPort("generalized_acceleration").Eval(context)
    assert not np.array_equal(said_of(again), before[0])
    np.testing.assert_array_equal(said_of(info), before[0])
    np.testing.assert_array_equal(vdot, before[1])


def test_geometry_that_changes_in_a_context_is_seen(scene):
    _, plant, scene_graph = scene
    context = new_context(scene)
    plant.SetFreeBodyPose(context, plant.GetBodyByName("ball"), RigidTransform([0.1, 0.2, 0.098]))
    assert plant.GetOutputPort("contact_results").Eval(context).num_point_pair_contacts() == 1
    root = context._store.context(0)
    graph_context = scene_graph.GetMyMutableContextFromRoot(root)
    ids = scene_graph.model_inspector().GetAllGeometryIds()
    declaration = CollisionFilterDeclaration().ExcludeWithin(GeometrySet(list(ids)))
    scene_graph.collision_filter_manager(graph_context).Apply(declaration)
    assert plant.GetOutputPort("contact_results").Eval(context).num_point_pair_contacts() == 0
    vdot = plant.GetOutputPort("generalized_acceleration").Eval(context)
    ball = plant.GetVelocitiesFromArray(ModelInstanceIndex(1), vdot)
    assert -9.81 in np.round(ball, 9)  # it falls


@pytest.mark.skipif(not jit_enabled(), reason="kernels run as Python with SHELDRAKE_JIT=0")
def test_kernels_are_bound_once_and_none_runs_as_python(scene, monkeypatch):
    _, plant, _ = scene
    context = new_context(scene)
    write(plant, context, np.random.default_rng(0))
    plant.SetFreeBodyPose(context, plant.GetBodyByName("ball"), RigidTransform([0.1, 0.2, 0.098]))
    numbers(plant, context)

    def refuse(self, *args, **kwargs):
        raise AssertionError(f"{self!r} is bound or interpreted again")

    monkeypatch.setattr(Kernel, "bind", refuse)
    monkeypatch.setattr(Kernel, "__call__", refuse)
    for seed in range(3):
        write(plant, context, np.random.default_rng(seed))
        numbers(plant, context)
