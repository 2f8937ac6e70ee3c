"""A solve that fails says when, among which bodies, and what to try; the state stays what it was."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.geometry import HalfSpace, Sphere
from sheldrake.math import RigidTransform
from sheldrake.multibody.contact_solvers import _arrays
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.multibody.plant._step import tuning
from sheldrake.multibody.tree import RevoluteJoint, SpatialInertia
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder


def test_the_iteration_limit_names_time_and_bodies(monkeypatch):
    make = _arrays.make_solver_model

    def impatient(*args, **kwargs):
        model = make(*args, **kwargs)
        model.max_iterations = 0
        return model

    monkeypatch.setattr(_arrays, "make_solver_model", impatient)
    monkeypatch.setattr(tuning, "_MADE", {})
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    for i, name in enumerate(("lone", "left", "right")):
        ball = plant.AddRigidBody(name, SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        plant.RegisterCollisionGeometry(ball, RigidTransform(), Sphere(0.1), "ball", CoulombFriction(0.5, 0.5))
        plant.SetDefaultFloatingBaseBodyPose(ball, RigidTransform([0.15 * i if i else -5.0, 0.0, 0.0]))
    plant.Finalize()
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    before = plant.GetPositions(plant.GetMyContextFromRoot(simulator.get_context())).copy()
    with pytest.raises(RuntimeError, match=r"at time 0.*not converged.*Try.*among: 'left', 'right'\."):
        simulator.AdvanceTo(0.1)
    after = plant.GetPositions(plant.GetMyContextFromRoot(simulator.get_context()))
    np.testing.assert_array_equal(after, before)


def test_contacts_of_continuous_plants_are_known_without_masses():
    forces = []
    for inertia in (SpatialInertia.Zero(), SpatialInertia.SolidSphereWithMass(1.0, 0.1)):
        builder = DiagramBuilder()
        plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
        base, ball = plant.AddRigidBody("base", inertia), plant.AddRigidBody("ball", inertia)
        plant.AddJoint(RevoluteJoint("joint", base.body_frame(), ball.body_frame(), [0, 0, 1]))
        for body, shape in ((plant.world_body(), HalfSpace()), (ball, Sphere(0.1))):
            plant.RegisterCollisionGeometry(body, RigidTransform(), shape, "c", CoulombFriction(1.0, 1.0))
        plant.Finalize()
        diagram = builder.Build()
        context = plant.GetMyContextFromRoot(diagram.CreateDefaultContext())
        plant.SetFreeBodyPose(context, base, RigidTransform([0.0, 0.0, 0.099]))
        results = plant.get_contact_results_output_port().Eval(context)
        forces.append(results.point_pair_contact_info(0).contact_force())
        if inertia.get_mass() == 0.0:
            for _ in range(2):  # what is kept for the contacts is not taken for accelerations
                with pytest.raises(RuntimeError, match="without mass"):
                    plant.get_generalized_acceleration_output_port().Eval(context)
    np.testing.assert_array_equal(*forces)
    assert forces[0].any()
