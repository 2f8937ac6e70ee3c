"""What the step leaves for output ports."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from free_bodies import FreeBodies, box_inertia

from sheldrake import geometry as g
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialVelocity
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction, PointPairContactInfo
from sheldrake.multibody.plant._kernels.contact_report import PointContact
from sheldrake.multibody.plant._step.results import (
    accelerations,
    contact_room,
    contacts_in,
    generalized_contact_forces,
)
from sheldrake.multibody.tree import BodyIndex, SpatialInertia
from sheldrake.systems.framework import DiagramBuilder


def step_contacts(scene):
    """Contacts of the last step, geometries and bodies by row."""
    return contacts_in(contact_room(scene.work, scene.geometry.material[:, 0], scene.dt), range(9), range(9))


CUBE = (g.Box(0.1, 0.1, 0.1), 2.0, [0.01, 0.0, 0.0], box_inertia(2.0, [0.1, 0.1, 0.1]))


def test_nothing_before_the_first_step():
    scene = FreeBodies([CUBE])
    assert len(step_contacts(scene).pair) == 0
    np.testing.assert_array_equal(generalized_contact_forces(scene.work, scene.dt), np.zeros(6))
    np.testing.assert_array_equal(accelerations(scene.work, scene.dt), np.zeros(6))


def test_forces_and_momentum_balance():
    """Impulse of the reported forces = change of momentum, linear and about the world's origin."""
    for approximation in ("lagged", "similar", "sap", "tamsi"):
        scene = FreeBodies([CUBE], approximation=approximation)
        mass = CUBE[1]
        scene.q[0] = [0.9, 0.1, 0.2, 0.3, 0.4, 0.5, 0.0]
        scene.q[0, :4] /= np.linalg.norm(scene.q[0, :4])
        scene.q[0, 6] = 0.0795
        contacts = step_contacts(scene)
        while len(contacts.pair) == 0:
            scene.step()
            contacts = step_contacts(scene)
        force_on_cube = -contacts.f_Bc_W if contacts.pair[0, 2] == 1 else contacts.f_Bc_W
        tau = generalized_contact_forces(scene.work, scene.dt)
        np.testing.assert_allclose(tau[3:], force_on_cube.sum(axis=0), rtol=1e-12, atol=1e-12)
        arm = contacts.p_WC - np.array(scene.work.tree[1].p_WB)
        np.testing.assert_allclose(tau[:3], np.cross(arm, force_on_cube).sum(axis=0), rtol=1e-12, atol=1e-12)
        # M vdot + bias = J^T f for a body to the solver's tolerance
        R_WB = np.reshape(scene.work.tree[1].R_WB, (3, 3))
        c, w, vdot = R_WB @ CUBE[2], scene.work.step.v[:3], accelerations(scene.work, scene.dt)
        a_com = vdot[3:] + np.cross(vdot[:3], c) + np.cross(w, np.cross(w, c))
        weight = np.array([0.0, 0.0, -9.81 * mass])
        # kTamsi stops on changes of velocity below 1e-6 m/s: 1e-6 / dt * mass
        tolerance = 2e-3 if approximation == "tamsi" else 1e-5
        np.testing.assert_allclose(mass * a_com, weight + tau[3:], rtol=0, atol=tolerance)
        assert force_on_cube[:, 2].sum() > 0.0


def test_speeds_are_those_of_the_contact_point():
    scene = FreeBodies([CUBE])
    scene.q[0, 6] = 0.0499
    scene.v[0, 3:] = [0.3, 0.4, 0.0]
    scene.step()
    contacts = step_contacts(scene)
    v = scene.work.step.v_next  # of the solution, at the positions of the step's start
    speed = v[3:6] + np.cross(v[:3], contacts.p_WC - np.array(scene.work.tree[1].p_WB))
    slip, separation = contacts.how[:, PointContact.slip_speed], contacts.how[:, PointContact.separation_speed]
    np.testing.assert_allclose(slip, np.hypot(speed[:, 0], speed[:, 1]), rtol=1e-12)
    np.testing.assert_allclose(separation, speed[:, 2], atol=1e-13)


def test_a_contact_made_by_hand_says_what_it_was_given():
    pair = g.PenetrationAsPointPair()
    pair.p_WCa, pair.depth = np.array([1.0, 2.0, 3.0]), 0.5
    info = PointPairContactInfo(BodyIndex(3), BodyIndex(5), [4.0, 5.0, 6.0], np.array([7.0, 8.0, 9.0]), -0.1, 0.2, pair)
    for one in (info, copy.copy(info), copy.deepcopy(info)):
        assert (one.bodyA_index(), one.bodyB_index()) == (BodyIndex(3), BodyIndex(5))
        assert one.contact_force().tolist() == [4.0, 5.0, 6.0]
        assert one.contact_point().tolist() == [7.0, 8.0, 9.0]
        assert (one.separation_speed(), one.slip_speed()) == (-0.1, 0.2)
        assert one.point_pair() is pair
    info.contact_force()[0] = 1.0
    assert info.contact_force()[0] == 4.0


@pytest.mark.parametrize("time_step", [0.0, 1e-5])
@pytest.mark.parametrize("speed", [-0.01, 0.01])
def test_separation_is_positive_when_bodies_part(time_step, speed):
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step)
    ball = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    for body, shape in ((ball, g.Sphere(0.1)), (plant.world_body(), g.HalfSpace())):
        plant.RegisterCollisionGeometry(body, RigidTransform(), shape, body.name(), CoulombFriction(0.5, 0.5))
    plant.SetUseSampledOutputPorts(False)
    plant.Finalize()
    context = builder.Build().CreateDefaultContext()
    own = plant.GetMyContextFromRoot(context)
    plant.SetFreeBodyPose(own, ball, RigidTransform([0.0, 0.0, 0.0999]))
    plant.SetFreeBodySpatialVelocity(own, ball, SpatialVelocity([0.0, 0.0, 0.0], [0.0, 0.0, speed]))
    info = plant.get_contact_results_output_port().Eval(own).point_pair_contact_info(0)
    assert info.separation_speed() == pytest.approx(speed, abs=0.003)  # 150 N for 10 us change it by 0.0015
