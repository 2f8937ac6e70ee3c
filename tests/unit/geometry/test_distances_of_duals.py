"""Distances of geometries whose poses have derivatives: by machine code as by the Python sources."""

import itertools

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd, ExtractGradient, ExtractValue, InitializeAutoDiff
from sheldrake.geometry import Box, Capsule, Ellipsoid, HalfSpace, Sphere
from sheldrake.geometry._query import scene as scenes
from sheldrake.math import RigidTransform
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.multibody.tree import SpatialInertia
from sheldrake.systems.framework import DiagramBuilder

FLOATING = (Sphere(0.1), Box(0.1, 0.2, 0.3), Capsule(0.1, 0.3), Ellipsoid(0.1, 0.2, 0.15))


@pytest.fixture(scope="module")
def scene():
    """Shapes that float over the ground: the plant of AutoDiffXd, its context, and the geometries."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    friction, ids = CoulombFriction(0.5, 0.5), []
    for k, shape in enumerate(FLOATING):
        body = plant.AddRigidBody(f"body{k}", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        ids.append(plant.RegisterCollisionGeometry(body, RigidTransform([0.01, 0.0, 0.0]), shape, "shape", friction))
    ids.append(plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", friction))
    plant.Finalize()
    duals = builder.Build().ToAutoDiffXd()
    context = duals.CreateDefaultContext()
    plant = duals.GetSubsystemByName("plant")
    return plant, plant.GetMyMutableContextFromRoot(context), ids


def positions(rng):
    q = rng.normal(size=(len(FLOATING), 7))
    q[:, :4] /= np.linalg.norm(q[:, :4], axis=1, keepdims=True)
    q[:, 4:] *= 0.3
    return q.ravel()


def distances(scene, q, monkeypatch, quick):
    plant, context, ids = scene
    monkeypatch.setattr(scenes._DualDistances, "can", staticmethod(lambda calls: quick))
    plant.SetPositions(context, q)
    query, out = plant.get_geometry_query_input_port().Eval(context), []
    for pair in itertools.combinations(ids, 2):
        found = query.ComputeSignedDistancePairClosestPoints(*pair)
        assert (found.id_A, found.id_B) == pair
        out.append(np.concatenate(([found.distance], found.p_ACa, found.p_BCb, found.nhat_BA_W)))
    query._scene()._idle_dual_distances.clear()
    return np.array(out)


@pytest.mark.parametrize("seed", range(3))
def test_machine_code_is_the_python_source(scene, monkeypatch, seed):
    q = InitializeAutoDiff(positions(np.random.default_rng(seed))).ravel()
    by_python, by_code = (distances(scene, q, monkeypatch, quick) for quick in (False, True))
    np.testing.assert_allclose(ExtractValue(by_code), ExtractValue(by_python), atol=1e-14)
    for a, b in zip(by_code, by_python):
        np.testing.assert_allclose(ExtractGradient(a), ExtractGradient(b), rtol=1e-7, atol=1e-7)


def test_duals_stay_duals_where_there_are_no_derivatives(scene, monkeypatch):
    q = np.array([AutoDiffXd(x) for x in positions(np.random.default_rng(4))], dtype=object)
    by_python, by_code = (distances(scene, q, monkeypatch, quick) for quick in (False, True))
    np.testing.assert_allclose(ExtractValue(by_code), ExtractValue(by_python), atol=1e-14)
    assert all(type(x) is AutoDiffXd and x.derivatives().size == 0 for x in by_code.ravel())


def test_one_derivative_of_one_body(scene, monkeypatch):
    q = positions(np.random.default_rng(5)).astype(object)
    q[4] = AutoDiffXd(q[4], [1.0])
    by_python, by_code = (distances(scene, q, monkeypatch, quick) for quick in (False, True))
    for a, b in zip(by_code, by_python):
        slope = ExtractGradient(b)
        np.testing.assert_allclose(ExtractGradient(a), slope if slope.size else np.zeros((10, 1)), atol=1e-7)
