"""The table of types of joints agrees with the classes and with the kernels."""

import numpy as np
import pytest

import sheldrake.multibody.tree as t
from sheldrake.multibody.tree._joint_types import JOINT_TYPES


def test_every_public_joint_has_a_row_and_a_kind_of_its_own():
    classes = [c for c in vars(t).values() if isinstance(c, type) and issubclass(c, t.Joint) and c is not t.Joint]
    public = {c.kTypeName for c in classes}
    assert public == set(JOINT_TYPES) == set(t.Joint._classes)
    assert len({row.kind for row in JOINT_TYPES.values()}) == len(JOINT_TYPES)
    assert all(t.Joint._classes[name]._type is row for name, row in JOINT_TYPES.items())


@pytest.mark.parametrize("row", JOINT_TYPES.values(), ids=lambda row: row.name)
def test_velocities_are_rates_only_where_there_are_as_many_positions(row):
    assert not row.v_is_qdot or len(row.positions) == len(row.velocities)
    assert all(0 <= k < len(row.positions) for k in row.angles)
    assert row.rotates == any(name.startswith("w") for name in row.velocities) or row.name == "curvilinear"


def test_formats_call_no_two_types_alike():
    for names in ("urdf", "sdf"):
        written = [name for row in JOINT_TYPES.values() for name in getattr(row, names)]
        assert len(written) == len(set(written))
    read = [row.mjcf for row in JOINT_TYPES.values() if len(row.mjcf) == 1]
    assert len(read) == len(set(read))


def test_a_joint_without_a_row_is_refused_when_its_class_is_made():
    with pytest.raises(KeyError, match="helical"):

        class HelicalJoint(t.Joint):
            kTypeName = "helical"


def test_the_axis_of_a_joint_is_what_files_write():
    from sheldrake.multibody.plant import MultibodyPlant

    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("b", t.SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    joint = t.ScrewJoint("s", plant.world_frame(), body.body_frame(), [0.0, 3.0, 4.0], 0.1, 0.0)
    np.testing.assert_allclose(joint._axis, [0.0, 0.6, 0.8])
