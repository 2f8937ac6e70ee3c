"""Where faces of two meshes lie in one plane, a contact surface is what it is a little beside: no face counts twice."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from tests.crosscheck.pydrake.hydro_scenes import Pair, library

SHAPES = {
    "box": ("Box", (1.0, 2.0, 3.0)),
    "flat cylinder": ("Cylinder", (1.0, 1.0)),
    "long cylinder": ("Cylinder", (0.7, 2.0)),
    "capsule": ("Capsule", (1.0, 2.0)),
}
STIFF = {"soft": 0.6}, {"rigid": 0.6}, {"soft": 0.7, "modulus": 3e6}


def force(pair, X, Y):
    """What the surface's pressure adds up to [N]."""
    total = np.zeros(3)
    for surface in pair.surfaces(tuple(X), tuple(Y)):
        for f in range(surface.num_faces()):
            pressure = surface.poly_e_MN().EvaluateCartesian(f, surface.centroid(f))
            total += pressure * surface.area(f) * surface.face_normal(f)
    return np.linalg.norm(total)


@pytest.mark.parametrize("one, other", [(0, 1), (1, 0), (0, 2)], ids=["on rigid", "rigid on", "compliant"])
@pytest.mark.parametrize("names", list(itertools.combinations_with_replacement(SHAPES, 2)), ids="-".join)
def test_aligned_shapes_push_as_hard_as_those_beside_them(names, one, other):
    rng = np.random.default_rng(1)
    pair = Pair(library("sheldrake"), (*SHAPES[names[0]], STIFF[one]), (*SHAPES[names[1]], STIFF[other]))
    for _ in range(5):
        X = np.concatenate([rng.integers(-2, 3, 3) * np.pi / 2, np.round(rng.uniform(-0.8, 0.8, 3), 1)])
        Y = np.concatenate([np.zeros(3), np.round(rng.uniform(-0.8, 0.8, 3), 1)])
        shifts = itertools.product((-1e-7, 1e-7), repeat=3)
        beside = [force(pair, X + np.array([0.0, 0.0, 0.0, *d]), Y) for d in shifts]
        assert force(pair, X, Y) <= max(beside) * (1.0 + 1e-5) + 1.0  # of 1e6 Pa
