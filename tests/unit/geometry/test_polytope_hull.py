"""Gift wrapping against Qhull: the same corners and volume, coplanar points in one polygon."""

import itertools

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from sheldrake.geometry._meshes.polytope_hull import MOST_FACES, wrap

CUBE = np.array(list(itertools.product((0.0, 1.0), repeat=3)))
ANGLES = np.arange(40) * 2 * np.pi / 40
CAN = np.array([[np.cos(a), np.sin(a), z] for a in ANGLES for z in (-1.0, 1.0)])


def volume(points, loops):
    points = points - points.mean(axis=0)
    fans = ((loop[0], loop[k], loop[k + 1]) for loop in loops for k in range(1, len(loop) - 1))
    return sum(points[a] @ np.cross(points[b], points[c]) for a, b, c in fans) / 6


def rotation(rng):
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.diag(r))


def cloud(kind, rng):
    if kind == "cube with points in its faces":
        on_faces = rng.uniform(size=(60, 3))
        on_faces[np.arange(60), rng.integers(0, 3, 60)] = rng.integers(0, 2, 60)
        return np.vstack([CUBE, on_faces, rng.uniform(size=(30, 3))])
    if kind == "can":
        return CAN
    if kind == "round":
        return rng.normal(size=(30, 3))
    if kind == "lattice":
        return np.unique(rng.integers(0, 4, (40, 3)), axis=0).astype(float)
    return CUBE * [1.0, 1.0, 1e-3]


@pytest.mark.parametrize("kind", ["cube with points in its faces", "can", "round", "lattice", "plate"])
def test_same_hull_as_qhull_at_any_scale_and_place(kind):
    rng = np.random.default_rng(7)
    for _ in range(20):
        points = cloud(kind, rng) @ rotation(rng).T * 10 ** rng.uniform(-3, 3)
        points = points + rng.normal(size=3) * np.ptp(points, axis=0).max()
        loops = wrap(points, 1e-9 * np.ptp(points, axis=0).max())
        expected = ConvexHull(points)
        assert loops is not None
        assert volume(points, loops) == pytest.approx(expected.volume, rel=1e-6)
        corners = {v for loop in loops for v in loop}
        assert corners <= set(expected.vertices.tolist())  # Qhull also keeps points in the middle of a face's edge
        edges = [e for loop in loops for e in zip(loop, loop[1:] + loop[:1])]
        assert len(edges) == len(set(edges)) and {(b, a) for a, b in edges} == set(edges)


def test_faces_are_whole_polygons():
    assert sorted(map(len, wrap(CUBE, 1e-9))) == [4] * 6
    assert sorted(map(len, wrap(CAN, 1e-9))) == [4] * 40 + [40] * 2


def test_too_many_faces_are_left_to_qhull():
    ball = np.random.default_rng(1).normal(size=(200, 3))
    ball /= np.linalg.norm(ball, axis=1)[:, None]
    assert len(ConvexHull(ball).simplices) > MOST_FACES
    assert wrap(ball, 1e-9) is None


def test_round_clouds_are_refused_before_any_face_is_made(monkeypatch):
    rng = np.random.default_rng(8)
    ball = rng.normal(size=(5000, 3))
    ball /= np.linalg.norm(ball, axis=1)[:, None]
    polytope = np.vstack([ball[:60], 0.4 * ball])  # 60 corners, 116 faces; all other points lie inside
    assert len(wrap(polytope, 1e-9)) == 116
    monkeypatch.setattr("sheldrake.geometry._meshes.polytope_hull._Wrapping", None)
    assert wrap(ball, 1e-9) is None
