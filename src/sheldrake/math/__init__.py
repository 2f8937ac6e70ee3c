"""Rotations, poses, and mathematics on floats, AutoDiffXd and Expression alike."""

from typing import Any

from sheldrake.common._names import _MangledName
from sheldrake.math._rigid_transform import RigidTransform, RigidTransform_
from sheldrake.math._roll_pitch_yaw import RollPitchYaw, RollPitchYaw_
from sheldrake.math._rotation_matrix import RotationMatrix, RotationMatrix_

__all__ = [
    "RigidTransform",
    "RigidTransform_",
    "RollPitchYaw",
    "RollPitchYaw_",
    "RotationMatrix",
    "RotationMatrix_",
]


def __getattr__(name: str) -> Any:
    return _MangledName.module_getattr(module_name=__name__, module_globals=globals(), name=name)
