"""Geometry that is changed in a context is what the plant of that context touches from then on."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.geometry import (
    Box,
    CollisionFilterDeclaration,
    GeometryInstance,
    GeometrySet,
    HalfSpace,
    ProximityProperties,
    Role,
    Sphere,
)
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder, EventStatus

R, SETTLED = 0.1, 0.5  # [m], [s]


class Scene:
    """A ball at rest on a half space."""

    def __init__(self, dt=1e-3, extra=False):
        builder = DiagramBuilder()
        self.plant, self.scene_graph = AddMultibodyPlantSceneGraph(builder, dt)
        friction = CoulombFriction(0.5, 0.5)
        self.ball = self.plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(1.0, R))
        world = self.plant.world_body()
        self.ground = self.plant.RegisterCollisionGeometry(world, RigidTransform(), HalfSpace(), "ground", friction)
        self.sphere = self.plant.RegisterCollisionGeometry(self.ball, RigidTransform(), Sphere(R), "ball", friction)
        self.plant.Finalize()
        self.diagram = builder.Build()
        self.simulator = Simulator(self.diagram)
        self.root = self.simulator.get_mutable_context()
        self.place(self.root, R - 1e-5)
        self.source = self.plant.get_source_id()

    def place(self, root, z):
        context = self.plant.GetMyMutableContextFromRoot(root)
        self.plant.SetFreeBodyPose(context, self.ball, RigidTransform([0, 0, z]))

    @property
    def of_scene_graph(self):
        return self.scene_graph.GetMyMutableContextFromRoot(self.root)

    def height(self, root=None):
        context = self.plant.GetMyContextFromRoot(root or self.root)
        return self.plant.EvalBodyPoseInWorld(context, self.ball).translation()[2]

    def contacts(self):
        context = self.plant.GetMyContextFromRoot(self.root)
        return self.plant.get_contact_results_output_port().Eval(context).num_point_pair_contacts()


REMOVALS = {
    "the ground": lambda s: s.scene_graph.RemoveGeometry(s.of_scene_graph, s.source, s.ground),
    "the role": lambda s: s.scene_graph.RemoveRole(s.of_scene_graph, s.source, s.sphere, Role.kProximity),
    "a filter": lambda s: s.scene_graph.collision_filter_manager(s.of_scene_graph).Apply(
        CollisionFilterDeclaration().ExcludeBetween(GeometrySet(s.ground), GeometrySet(s.sphere))
    ),
}


@pytest.mark.parametrize("dt", [1e-3, 0.0])
@pytest.mark.parametrize("remove", REMOVALS.values(), ids=REMOVALS.keys())
def test_what_is_removed_holds_no_more(remove, dt):
    s = Scene(dt)
    s.simulator.AdvanceTo(SETTLED)
    assert s.height() == pytest.approx(R, abs=1e-4) and s.contacts() == 1
    untouched = s.root.Clone()
    remove(s)
    s.simulator.AdvanceTo(SETTLED + 0.2)
    assert s.height() == pytest.approx(R - 0.5 * 9.81 * 0.2**2, abs=2e-3)
    assert s.contacts() == 0
    other = Simulator(s.diagram, untouched)
    other.AdvanceTo(SETTLED + 0.2)
    assert s.height(untouched) == pytest.approx(R, abs=1e-4)


def test_what_is_added_or_gets_another_shape_is_touched():
    s = Scene()
    s.simulator.AdvanceTo(SETTLED)
    box = GeometryInstance(RigidTransform([0.0, 0.0, 0.05]), Box(1, 1, 0.1), "table")
    box.set_proximity_properties(ProximityProperties())
    s.scene_graph.RegisterGeometry(s.of_scene_graph, s.source, s.scene_graph.world_frame_id(), box)
    s.place(s.root, 0.1 + R + 0.01)
    s.simulator.AdvanceTo(2 * SETTLED)
    assert s.height() == pytest.approx(0.1 + R, abs=1e-4) and s.contacts() == 1
    s.scene_graph.ChangeShape(s.of_scene_graph, s.source, s.sphere, Sphere(R / 2))
    s.simulator.AdvanceTo(4 * SETTLED)
    assert s.height() == pytest.approx(0.1 + R / 2, abs=1e-4)


def test_defaults_and_copies_of_contexts_bring_their_geometry():
    s = Scene()
    REMOVALS["the ground"](s)
    fresh = s.diagram.CreateDefaultContext()
    fresh.SetTimeStateAndParametersFrom(s.root)
    copied = Simulator(s.diagram, fresh)
    copied.AdvanceTo(0.2)
    assert s.height(fresh) < 0.0
    s.diagram.SetDefaultContext(fresh)
    s.place(fresh, R)
    copied.Initialize()
    copied.AdvanceTo(0.2)
    assert s.height(fresh) == pytest.approx(R, abs=1e-4)


@pytest.mark.parametrize("native", [True, False])
def test_a_change_within_a_run_counts_from_the_next_step_on(native):
    s = Scene()
    s.simulator._native = native
    removed = []

    def monitor(root):
        if root.get_time() >= 0.1 - 1e-9 and not removed:
            removed.append(root.get_time())
            REMOVALS["the ground"](s)
        return EventStatus.DidNothing()

    s.simulator.set_monitor(monitor)
    s.simulator.AdvanceTo(0.3)
    assert s.height() == pytest.approx(R - 0.5 * 9.81 * 0.2**2, abs=3e-3)
    twin = Scene()
    twin.simulator.AdvanceTo(removed[0])
    REMOVALS["the ground"](twin)
    twin.simulator.AdvanceTo(0.3)
    np.testing.assert_array_equal(s.height(), twin.height())


def test_a_single_step_sees_the_change_too():
    s = Scene()
    held = s.root.Clone()
    REMOVALS["the ground"](s)
    for root, free in ((s.root, True), (held, False)):
        state = root.Clone().get_mutable_state()
        s.diagram.CalcForcedUnrestrictedUpdate(root, state)
        v_z = state.get_discrete_state().value(0)[-1]
        assert (v_z == pytest.approx(-9.81e-3, rel=1e-9)) == free
