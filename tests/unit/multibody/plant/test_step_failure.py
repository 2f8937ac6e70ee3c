"""A solve that fails says when, among which bodies, and what to try; the state stays what it was."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.geometry import Sphere
from sheldrake.math import RigidTransform
from sheldrake.multibody.contact_solvers import _arrays
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.multibody.tree import SpatialInertia
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder


def test_the_iteration_limit_names_time_and_bodies(monkeypatch):
    make = _arrays.make_solver_model

    def impatient(*args, **kwargs):
        model = make(*args, **kwargs)
        model.max_iterations = 0
        return model

    monkeypatch.setattr(_arrays, "make_solver_model", impatient)
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    for i, name in enumerate(("lone", "left", "right")):
        ball = plant.AddRigidBody(name, SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        plant.RegisterCollisionGeometry(ball, RigidTransform(), Sphere(0.1), "ball", CoulombFriction(0.5, 0.5))
        plant.SetDefaultFreeBodyPose(ball, RigidTransform([0.15 * i if i else -5.0, 0.0, 0.0]))
    plant.Finalize()
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    before = plant.GetPositions(plant.GetMyContextFromRoot(simulator.get_context())).copy()
    with pytest.raises(RuntimeError, match=r"at time 0.*not converged.*Try.*among: 'left', 'right'\."):
        simulator.AdvanceTo(0.1)
    after = plant.GetPositions(plant.GetMyContextFromRoot(simulator.get_context()))
    np.testing.assert_array_equal(after, before)
