"""One contact solve against one step of Drake, from random states with several contacts."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("pydrake")

from drake_problem import DrakeProblem, approximation, one_step

from sheldrake.multibody.contact_solvers._kernels.problem import ContactLaw

pytestmark = pytest.mark.peer

NAMES = ("lagged", "similar", "sap", "tamsi")


def two_bodies(name, dt=1e-3, own_materials=True, vs=1e-4, near_rigid=1.0):
    """A plate on four small balls, a box on top, a half space below."""
    from pydrake.geometry import Box, HalfSpace, ProximityProperties, Sphere
    from pydrake.math import RigidTransform
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
    from pydrake.multibody.tree import RotationalInertia, SpatialInertia
    from pydrake.systems.framework import DiagramBuilder

    def properties(mu, k=None, d=None, tau=None):
        p = ProximityProperties()
        p.AddProperty("material", "coulomb_friction", CoulombFriction(*mu))
        if own_materials and k is not None:
            p.AddProperty("material", "point_contact_stiffness", k)
            p.AddProperty("material", "hunt_crossley_dissipation", d)
            p.AddProperty("material", "relaxation_time", tau)
        return p

    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, dt)
    plant.set_discrete_contact_approximation(approximation(name))
    ground = properties((0.9, 0.8), 2e5, 3.0, 0.05)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", ground)
    instance = plant.AddModelInstance("m")
    inertia = RotationalInertia(0.01, 0.02, 0.015, 0.001, -0.002, 0.0005)
    plate = plant.AddRigidBody("A", instance, SpatialInertia.MakeFromCentralInertia(1.3, [0.02, -0.03, 0.01], inertia))
    for i, (x, y) in enumerate([(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)]):
        ball = properties((0.6, 0.5), 5e4, 7.0, 0.02)
        plant.RegisterCollisionGeometry(plate, RigidTransform([x, y, -0.05]), Sphere(0.01), f"ball{i}", ball)
    box = plant.AddRigidBody("B", instance, SpatialInertia.SolidBoxWithMass(0.4, 0.2, 0.1, 0.1))
    shape = Box(0.2, 0.1, 0.1)
    plant.RegisterCollisionGeometry(box, RigidTransform(), shape, "box", properties((0.6, 0.5)))
    for i, (x, y) in enumerate([(-0.09, 0.04), (0.09, 0.04), (0.0, -0.04)]):
        # balls under the box that touch a flat part of the plate
        ball = properties((0.7, 0.6), 3e4, 5.0, 0.03)
        plant.RegisterCollisionGeometry(box, RigidTransform([x, y, -0.05]), Sphere(0.01), f"foot{i}", ball)
    plant.RegisterCollisionGeometry(plate, RigidTransform(), Box(0.25, 0.25, 0.02), "top", properties((0.4, 0.3)))
    plant.set_stiction_tolerance(vs)
    plant.set_sap_near_rigid_threshold(near_rigid)
    plant.Finalize()
    return plant, scene_graph, builder.Build()


def random_state(plant, diagram, rng, trial):
    from pydrake.math import RigidTransform, RollPitchYaw

    context = diagram.CreateDefaultContext()
    own = plant.GetMyMutableContextFromRoot(context)
    lower = RigidTransform(RollPitchYaw(rng.normal(0, 0.004, 3)), [0, 0, 0.0595 + rng.normal(0, 2e-4)])
    plant.SetFreeBodyPose(own, plant.GetBodyByName("A"), lower)
    upper = RigidTransform(RollPitchYaw(rng.normal(0, 0.004, 3)), [0, 0, 0.0695 + 0.0597 + rng.normal(0, 2e-4)])
    if trial % 4 == 3:  # apart, or touching with a corner
        upper = RigidTransform(RollPitchYaw(rng.normal(0, 0.3, 3)), [0.4 * (trial % 8 == 7), 0.0, 0.16])
    plant.SetFreeBodyPose(own, plant.GetBodyByName("B"), upper)
    plant.SetVelocities(own, rng.normal(0, [0.2, 1e-2, 1.0][trial % 3], 12))
    return context, own


@pytest.mark.parametrize("own_materials", [True, False])
@pytest.mark.parametrize("name", NAMES)
def test_one_step_of_two_bodies(name, own_materials):
    rng = np.random.default_rng(3)
    plant, scene_graph, diagram = two_bodies(name, own_materials=own_materials)
    counts = set()
    iterations = 0
    for trial in range(40):
        context, own = random_state(plant, diagram, rng, trial)
        problem = DrakeProblem(plant, own, name)
        counts.add(problem.add_contacts(scene_graph, context))
        ours = problem.next_state()
        iterations += problem.work.problem.iterations
        np.testing.assert_allclose(ours, one_step(diagram, plant, context), rtol=0, atol=1e-9)
    assert max(counts) >= 5
    assert iterations > 40


@pytest.mark.parametrize("name", NAMES)
def test_a_wrong_friction_coefficient_is_seen(name):
    rng = np.random.default_rng(3)
    plant, scene_graph, diagram = two_bodies(name)
    context, own = random_state(plant, diagram, rng, 0)
    problem = DrakeProblem(plant, own, name)
    problem.add_contacts(scene_graph, context)
    problem.work.contacts.law[:, ContactLaw.friction] *= 1.001
    assert np.abs(problem.next_state() - one_step(diagram, plant, context)).max() > 1e-7


def test_options_of_the_plant_reach_the_solver():
    rng = np.random.default_rng(5)
    for name, vs, near_rigid, dt in (("lagged", 1e-2, 1.0, 5e-3), ("sap", 1e-4, 3.0, 5e-3), ("tamsi", 1e-2, 1.0, 2e-3)):
        plant, scene_graph, diagram = two_bodies(name, dt=dt, vs=vs, near_rigid=near_rigid)
        for trial in range(8):
            context, own = random_state(plant, diagram, rng, trial)
            problem = DrakeProblem(plant, own, name, vs=vs, near_rigid=near_rigid)
            problem.add_contacts(scene_graph, context)
            ours = problem.next_state()
            np.testing.assert_allclose(ours, one_step(diagram, plant, context), rtol=0, atol=1e-9)


def test_python_twin_and_native_agree():
    rng = np.random.default_rng(7)
    for name in NAMES:
        plant, scene_graph, diagram = two_bodies(name)
        context, own = random_state(plant, diagram, rng, 0)
        states = []
        for native in (False, True):
            problem = DrakeProblem(plant, own, name)
            problem.add_contacts(scene_graph, context)
            states.append(problem.next_state(native))
        np.testing.assert_allclose(states[0], states[1], rtol=0, atol=1e-11)
