"""What no physical number is: refused where it is given; and the campaign that looks for more notices what is taken."""

import math

import pytest
from tools.torture import numbers

from sheldrake.geometry import AddCompliantHydroelasticProperties, ProximityProperties
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import PlanarJoint, RevoluteJoint, RevoluteSpring, RpyFloatingJoint, UniversalJoint


@pytest.fixture
def world():
    return MultibodyPlant(0.0).world_frame()


def test_default_positions_are_finite(world):
    for joint, call, value in (
        (RevoluteJoint("j", world, world, [0, 0, 1]), "set_default_angle", math.nan),
        (PlanarJoint("j", world, world), "set_default_translation", [0.0, math.inf]),
        (PlanarJoint("j", world, world), "set_default_rotation", math.nan),
        (UniversalJoint("j", world, world), "set_default_angles", [0.0, math.nan]),
        (RpyFloatingJoint("j", world, world), "set_default_translation", [0.0, 0.0, math.nan]),
        (RpyFloatingJoint("j", world, world), "set_default_angles", [math.inf, 0.0, 0.0]),
    ):
        before = joint.default_positions()
        with pytest.raises(RuntimeError, match="must be finite"):
            getattr(joint, call)(value)
        assert joint.default_positions().tolist() == before.tolist()


def test_springs_and_meshes_of_no_length(world):
    with pytest.raises(RuntimeError, match="nominal position must be finite, not nan"):
        RevoluteSpring(RevoluteJoint("j", world, world, [0, 0, 1]), math.nan, 1.0)
    with pytest.raises(RuntimeError, match="resolution_hint must be a number; given nan"):
        AddCompliantHydroelasticProperties(math.nan, 1e6, ProximityProperties())


def test_each_physical_number_refuses_what_is_no_number():
    for k in range(len(numbers.PHYSICAL)):
        numbers.physical(k)  # the first of ODD is nan


def test_a_number_that_is_taken_is_noticed(monkeypatch):
    monkeypatch.setattr(numbers, "PHYSICAL", {"planted": lambda x: x})
    with pytest.raises(AssertionError, match="planted takes nan"):
        numbers.physical(0)
