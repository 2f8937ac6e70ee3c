"""Rotations and poses under Eigen's names: Quaternion, AngleAxis, Isometry3. Drake's own are in `sheldrake.math`."""

from __future__ import annotations

from typing import Any

from sheldrake.common._angle_axis import AngleAxis, AngleAxis_
from sheldrake.common._isometry3 import Isometry3, Isometry3_
from sheldrake.common._names import _MangledName
from sheldrake.common._quaternion import Quaternion, Quaternion_

__all__ = ["AngleAxis", "AngleAxis_", "Isometry3", "Isometry3_", "Quaternion", "Quaternion_"]


def __getattr__(name: str) -> Any:
    return _MangledName.module_getattr(module_name=__name__, module_globals=globals(), name=name)
