"""Random forests of bodies: joints have the same places as in Drake."""

import importlib

import numpy as np
import pytest

from sheldrake.multibody.tree import _forest

pytestmark = pytest.mark.peer


def places(package: str, seed: int) -> list:
    """Where each joint's velocities are, or the error, for a plant of random joints, some of them turned around."""
    lib, rng = importlib.import_module(f"{package}.all"), np.random.default_rng(seed)
    plant, n = lib.MultibodyPlant(0.0), rng.integers(4, 12)
    M = lib.SpatialInertia.SolidSphereWithMass(1.0, 0.1)
    bodies = [plant.AddRigidBody(f"l{i}", M) for i in range(n)]
    order, joints = rng.permutation(n), []
    for i in range(1, n):
        kind, inboard, outboard = rng.random(), bodies[order[rng.integers(0, i)]], bodies[order[i]]
        if kind < 0.35:
            continue
        pair = (plant.world_body() if kind < 0.42 else inboard, outboard)
        turned = rng.random() < 0.2 and kind > 0.42
        joints.append((*(pair[::-1] if turned else pair), rng.random() < 0.3))
    for k in rng.permutation(len(joints)):
        parent, child, welded = joints[k]
        P, C = parent.body_frame(), child.body_frame()
        weld = lib.WeldJoint(f"j{k}", P, C, lib.RigidTransform())
        plant.AddJoint(weld if welded else lib.RevoluteJoint(f"j{k}", P, C, [0, 0, 1]))
    try:
        plant.Finalize()
    except RuntimeError:
        return ["RuntimeError"]
    found = [plant.get_joint(i) for i in plant.GetJointIndices()]
    return [(j.name(), j.parent_body().name(), j.velocity_start()) for j in found if j.num_velocities()]


def test_joints_have_the_same_places():
    pytest.importorskip("pydrake")
    for seed in range(100):
        assert places("sheldrake", seed) == places("pydrake", seed), seed


def test_another_order_of_trees_is_seen(monkeypatch):
    pytest.importorskip("pydrake")
    monkeypatch.setattr(_forest, "sorted", lambda values, key: list(values), raising=False)
    assert any(places("sheldrake", seed) != places("pydrake", seed) for seed in range(20))
