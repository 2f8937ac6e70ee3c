"""Contact in words: the numbers of statics, and the text that says them."""

import numpy as np
import pytest

from sheldrake.geometry import Box, HalfSpace
from sheldrake.math import RigidTransform
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.multibody.tree import SpatialInertia
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder

MASS, MU, G = 2.0, 0.5, 9.81


def box_on_ground(push, seconds, height=0.05):
    """A box that is pushed sideways through gravity [m/s²]; plant and context after some time."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    body = plant.AddRigidBody("box", SpatialInertia.SolidBoxWithMass(MASS, 0.2, 0.2, 0.1))
    friction = CoulombFriction(MU, MU)
    plant.RegisterCollisionGeometry(body, RigidTransform(), Box(0.2, 0.2, 0.1), "crate", friction)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", friction)
    plant.mutable_gravity_field().set_gravity_vector([push, 0.0, -G])
    plant.SetDefaultFloatingBaseBodyPose(body, RigidTransform([0.0, 0.0, height]))
    plant.Finalize()
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(seconds)
    return plant, plant.GetMyContextFromRoot(simulator.get_context())


def test_a_box_that_stays():
    plant, context = box_on_ground(0.3 * MU * G, 0.5)
    (summary,) = plant.explain_contact(context)
    assert summary.normal_force == pytest.approx(MASS * G, rel=1e-6)
    assert summary.friction_force == pytest.approx(0.3 * MU * MASS * G, rel=1e-3)
    assert summary.friction_limit == pytest.approx(MU * MASS * G, rel=1e-6)
    assert summary.points == 4 and summary.state == "sticking" and 0.0 < summary.depth < 1e-3
    assert {summary.A, summary.B} == {"DefaultModelInstance::box/crate", "world/ground"}


def test_a_box_that_slides():
    plant, context = box_on_ground(2.0 * MU * G, 0.5)
    (summary,) = plant.explain_contact(context)
    assert summary.state == "sliding"
    assert summary.slip_speed == pytest.approx(MU * G * 0.5, rel=0.02)
    assert summary.friction_force == pytest.approx(summary.friction_limit, rel=1e-3)


def test_text():
    plant, context = box_on_ground(0.0, 0.2)
    text = str(plant.explain_contact(context))
    assert text == repr(plant.explain_contact(context)) and len(text.splitlines()) == 2
    for word in ("t = 0.2 s", "box/crate", "world/ground", "4 points", "mm deep", "19.62 N", "sticking"):
        assert word in text
    plant, context = box_on_ground(0.0, 0.01, height=1.0)
    assert str(plant.explain_contact(context)) == "t = 0.01 s: nothing touches."


def test_a_contact_surface():
    from sheldrake.geometry import (
        AddCompliantHydroelasticProperties,
        AddContactMaterial,
        AddRigidHydroelasticProperties,
        ProximityProperties,
        Sphere,
    )

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    ball = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(MASS, 0.1))
    soft, hard = ProximityProperties(), ProximityProperties()
    for properties in (soft, hard):
        AddContactMaterial(1.0, None, CoulombFriction(MU, MU), properties)
    AddCompliantHydroelasticProperties(0.03, 1e6, soft)
    AddRigidHydroelasticProperties(hard)
    plant.RegisterCollisionGeometry(ball, RigidTransform(), Sphere(0.1), "rubber", soft)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", hard)
    plant.SetDefaultFloatingBaseBodyPose(ball, RigidTransform([0.0, 0.0, 0.099]))
    plant.Finalize()
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(1.0)
    (summary,) = plant.explain_contact(plant.GetMyContextFromRoot(simulator.get_context()))
    assert summary.normal_force == pytest.approx(MASS * G, rel=1e-3)
    assert np.isnan(summary.depth) and "a surface" in str(summary) and summary.state == "sticking"
