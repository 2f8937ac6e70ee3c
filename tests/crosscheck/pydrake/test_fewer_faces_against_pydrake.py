"""Polyhedra simplified to fewer faces: as few as pydrake's on the whole, and as much of the volume."""

import importlib

import numpy as np
import pytest

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")
pytest.importorskip("clarabel")


def simplified(name, ratio):
    """Numbers of faces and parts of the volume that are left, of five polyhedra."""
    o, rng, out = importlib.import_module(f"{name}.geometry.optimization"), np.random.default_rng(3), []
    for n, m in ((2, 8), (2, 12), (2, 16), (3, 10), (3, 14)):
        A = rng.normal(size=(m, n))
        A /= np.linalg.norm(A, axis=1)[:, None]
        b = np.append(rng.uniform(0.8, 1.2, m), 2 * np.ones(2 * n))
        h = o.HPolyhedron(np.vstack((A, np.eye(n), -np.eye(n))), b)
        s = h.SimplifyByIncrementalFaceTranslation(min_volume_ratio=ratio, do_affine_transformation=False)
        out.append((len(s.b()), o.VPolytope(s).CalcVolume() / o.VPolytope(h).CalcVolume()))
    return np.array(out)


@pytest.mark.parametrize("ratio", [0.1, 0.5])
def test_faces_are_as_few_as_pydrakes(ratio):
    ours, theirs = simplified("sheldrake", ratio), simplified("pydrake", ratio)
    assert ours[:, 0].sum() <= 1.1 * theirs[:, 0].sum()
    assert min(ours[:, 1].min(), theirs[:, 1].min()) >= ratio


def test_a_planted_fault_is_caught():
    assert simplified("sheldrake", 0.5)[:, 0].sum() > 1.1 * simplified("pydrake", 0.1)[:, 0].sum()
