"""Random orientations, all equally likely."""

from __future__ import annotations

import math

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._random import RandomGenerator
from sheldrake.common.eigen_geometry import AngleAxis, Quaternion
from sheldrake.math._roll_pitch_yaw import RollPitchYaw
from sheldrake.math._rotation_matrix import RotationMatrix

__all__ = [
    "UniformlyRandomAngleAxis",
    "UniformlyRandomQuaternion",
    "UniformlyRandomRPY",
    "UniformlyRandomRotationMatrix",
]


def UniformlyRandomQuaternion(generator: RandomGenerator) -> Quaternion:
    """A random orientation as a quaternion (K. Shoemake, Uniform random rotations, Graphics Gems III, 1992)."""
    u = generator._uniform()
    a, b = generator._uniform() * 2.0 * math.pi, generator._uniform() * 2.0 * math.pi
    r, s = math.sqrt(1.0 - u), math.sqrt(u)
    return Quaternion._make((r * math.sin(a), r * math.cos(a), s * math.sin(b), s * math.cos(b)))


def UniformlyRandomAngleAxis(generator: RandomGenerator) -> AngleAxis:
    """A random orientation as angle and axis."""
    return AngleAxis(UniformlyRandomQuaternion(generator))


@checked
def UniformlyRandomRotationMatrix(generator: RandomGenerator) -> RotationMatrix:
    """A random orientation as a rotation matrix."""
    return RotationMatrix(UniformlyRandomQuaternion(generator))


def UniformlyRandomRPY(generator: RandomGenerator) -> np.ndarray:
    """A random orientation as roll, pitch and yaw [rad], shape (3,)."""
    return RollPitchYaw(UniformlyRandomQuaternion(generator)).vector()
