"""Poses of AutoDiffXd: values, derivatives and how many each number has, where some have none, as pydrake's."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import pytest

from sheldrake.common import _dual_ways

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")
OFTEN = 205
"""Calls after which short ways are there."""


def things(lib: Any) -> dict[str, Any]:
    AD, rng = lib.AutoDiffXd, np.random.default_rng(0)

    def duals(*values: float) -> np.ndarray:
        return lib.InitializeAutoDiff(np.array(values), rng.normal(size=(len(values), 3))).ravel()

    Pose, Rotation, Velocity = lib.RigidTransform_[AD], lib.RotationMatrix_[AD], lib.SpatialVelocity_[AD]
    p, constants = duals(1.0, 2.0, 3.0), np.array([AD(1.0), AD(2.0), AD(3.0)])
    some = np.array([p[0], AD(2.0), p[2]])
    about_z = Rotation.MakeZRotation(duals(0.3)[0])
    return {
        "X": Pose(about_z, duals(1.0, -2.0, 3.0)),
        "Y": Pose(Rotation.MakeXRotation(duals(0.2)[0]), some),
        "C": lib.RigidTransform(lib.RollPitchYaw(0.1, 0.2, 0.3), [1.0, 2.0, 3.0]).cast[AD](),
        "T": Pose(p),
        "Z": about_z,
        "V": Velocity(constants, p),
        "W": Velocity(p, constants),
        "p": p,
        "some": some,
        "points": np.stack([p, some, constants], axis=1),
        "four": np.array([*p, AD(1.0)]),
        "floats": np.array([0.3, -0.2, 0.7]),
    }


CALLS = {
    "X Y": lambda t: t["X"] @ t["Y"],
    "Y X": lambda t: t["Y"] @ t["X"],
    "X C": lambda t: t["X"] @ t["C"],
    "C X": lambda t: t["C"] @ t["X"],
    "C C": lambda t: t["C"] @ t["C"],
    "T X": lambda t: t["T"] @ t["X"],
    "T T": lambda t: t["T"] @ t["T"],
    "inverse of X": lambda t: t["X"].inverse(),
    "inverse of Y": lambda t: t["Y"].inverse(),
    "inverse of T": lambda t: t["T"].inverse(),
    "between X and Y": lambda t: t["X"].InvertAndCompose(t["Y"]),
    "between C and T": lambda t: t["C"].InvertAndCompose(t["T"]),
    "a point": lambda t: t["X"].multiply(t["p"]),
    "a point of floats": lambda t: t["Y"].multiply(t["floats"]),
    "a constant pose": lambda t: t["C"].multiply(t["some"]),
    "points": lambda t: t["X"].multiply(t["points"]),
    "points of a constant pose": lambda t: t["C"].multiply(t["points"]),
    "four numbers": lambda t: t["X"].multiply(t["four"]),
    "a vector": lambda t: t["Z"].multiply(t["some"]),
    "vectors": lambda t: t["Z"].multiply(t["points"]),
    "quaternion": lambda t: t["Z"].ToQuaternion().wxyz(),
    "quaternion of a constant": lambda t: t["C"].rotation().ToQuaternion().wxyz(),
    "roll, pitch, yaw": lambda t: t["Z"].ToRollPitchYaw().vector(),
    "sum": lambda t: (t["V"] + t["W"]).get_coeffs(),
    "shifted": lambda t: t["V"].Shift(t["some"]).get_coeffs(),
    "composed": lambda t: t["V"].ComposeWithMovingFrameVelocity(t["some"], t["W"]).get_coeffs(),
    "matrix": lambda t: t["X"].GetAsMatrix34(),
}


def numbers(value: Any) -> list[tuple[float, np.ndarray]]:
    """Values and derivatives of what a call gives."""
    value = value.GetAsMatrix34() if hasattr(value, "GetAsMatrix34") else value
    return [(x.value(), x.derivatives()) for x in np.asarray(value).ravel().tolist()]


@pytest.mark.parametrize("times", [1, OFTEN], ids=["at first", "later"])
@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_numbers_and_derivatives_are_pydrakes(call, times, monkeypatch):
    monkeypatch.setattr(_dual_ways, "_TIMES", 0)
    given = things(importlib.import_module("sheldrake.all"))
    for _ in range(2 * times - 1):  # first for floats, then for duals
        found = call(given)
    expected = numbers(call(things(importlib.import_module("pydrake.all"))))
    assert len(numbers(found)) == len(expected)
    for (x, dx), (y, dy) in zip(numbers(found), expected):
        assert x == pytest.approx(y, rel=1e-13, abs=1e-14)
        assert dx.shape == dy.shape
        np.testing.assert_allclose(dx, dy, rtol=1e-12, atol=1e-13)
