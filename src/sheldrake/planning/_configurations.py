"""Distances between configurations, and configurations between them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._scalars import frozen

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree._index import JointIndex


@checked
class DistanceAndInterpolationProvider:
    """How far configurations are apart, and what is between them; derived classes write the two `Do...`."""

    def DoComputeConfigurationDistance(self, from_: np.ndarray, to: np.ndarray) -> float:
        """Returns the distance."""
        raise NotImplementedError(f"{type(self).__name__} has no DoComputeConfigurationDistance().")

    def DoInterpolateBetweenConfigurations(self, from_: np.ndarray, to: np.ndarray, ratio: float) -> np.ndarray:
        """Returns a configuration between two."""
        raise NotImplementedError(f"{type(self).__name__} has no DoInterpolateBetweenConfigurations().")

    def ComputeConfigurationDistance(self, arg0: ArrayLike, arg1: ArrayLike) -> float:
        """Returns the distance of two configurations.

        Raises:
            RuntimeError: they have different sizes, or the distance is negative or nan.
        """
        distance = float(self.DoComputeConfigurationDistance(*_pair("ComputeConfigurationDistance", arg0, arg1)))
        if not distance >= 0.0:
            raise RuntimeError(f"ComputeConfigurationDistance(): the distance is {distance}; it must not be negative.")
        return distance

    def InterpolateBetweenConfigurations(self, arg0: ArrayLike, arg1: ArrayLike, arg2: float) -> np.ndarray:
        """Returns the configuration at a ratio from 0 to 1 between two.

        Raises:
            RuntimeError: sizes differ, or the ratio is out of range.
        """
        if not 0.0 <= arg2 <= 1.0:
            raise RuntimeError(f"InterpolateBetweenConfigurations(): the ratio must be from 0 to 1, got {arg2}.")
        a, b = _pair("InterpolateBetweenConfigurations", arg0, arg1)
        return np.asarray(self.DoInterpolateBetweenConfigurations(a, b, float(arg2)), dtype=float)

    def _path(self, q1: ArrayLike, q2: ArrayLike, steps: int) -> np.ndarray:
        """Configurations at equal ratios from one to the other, rows, one more than steps."""
        return np.array([self.InterpolateBetweenConfigurations(q1, q2, k / steps) for k in range(steps + 1)], float)


def _pair(call: str, a: ArrayLike, b: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    a, b = np.array(a, dtype=float).ravel(), np.array(b, dtype=float).ravel()
    if a.size != b.size or not (math.isfinite(a.dot(b)) or (np.isfinite(a).all() and np.isfinite(b).all())):
        raise RuntimeError(f"{call}(): configurations must be finite and of one size, got {a} and {b}.")
    return a, b


@checked
class LinearDistanceAndInterpolationProvider(DistanceAndInterpolationProvider):
    """The norm of weighted differences, and straight lines; quaternions by their angle, and along great circles.

    Args:
        plant: Whose configurations.
        distance_weights: A weight for each position, or a dict of those of joints; for a quaternion (w, 0, 0, 0).

    Raises:
        RuntimeError: there is another number of weights, or one is negative, or no finite number.
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        distance_weights: ArrayLike | None = None,
        *,
        joint_distance_weights: Mapping[JointIndex, float] | None = None,
    ):
        given = distance_weights if joint_distance_weights is None else joint_distance_weights
        nq = plant.num_positions()
        joints = [plant.get_joint(i) for i in plant.GetJointIndices()]
        self._quaternions = sorted(j.position_start() for j in joints if j.type_name() == "quaternion_floating")
        weights = np.ones(nq)
        for start in self._quaternions:
            weights[start + 1 : start + 4] = 0.0
        if isinstance(given, dict):
            for index, values in given.items():
                joint = plant.get_joint(index)
                values = np.atleast_1d(np.array(values, dtype=float))
                if values.size != joint.num_positions():
                    raise RuntimeError(
                        f"Provided distance weights for joint {joint.name()} have size {values.size}, expected "
                        f"{joint.num_positions()}"
                    )
                weights[joint.position_start() : joint.position_start() + values.size] = values
        elif given is not None:
            weights = np.array(given, dtype=float).ravel()
        self._weights = self._checked(weights, nq)

    def _checked(self, weights: np.ndarray, nq: int) -> np.ndarray:
        if weights.size != nq:
            raise RuntimeError(f"Provided distance weights size {weights.size} does not match num_positions {nq}")
        for i, w in enumerate(weights):
            if not math.isfinite(w):
                raise RuntimeError(f"Provided distance weight {i} with value {w:g} is not finite")
            if w < 0.0:
                raise RuntimeError(f"Provided distance weight {i} with value {w:g} is less than zero")
        for start in self._quaternions:
            if weights[start + 1 : start + 4].any():
                raise RuntimeError(
                    f"The weights of a quaternion must be (w, 0, 0, 0), got {weights[start : start + 4]}"
                )
        return weights

    def distance_weights(self) -> np.ndarray:
        """Returns the weight of each position, read-only."""
        return frozen(self._weights.copy())

    def quaternion_dof_start_indices(self) -> list[int]:
        """Returns where quaternions start among positions."""
        return list(self._quaternions)

    def DoComputeConfigurationDistance(self, from_: np.ndarray, to: np.ndarray) -> float:
        """Returns the norm of weighted differences."""
        difference = to - from_
        for start in self._quaternions:
            at = slice(start, start + 4)
            a, b = _unit(from_[at]), _unit(to[at])
            difference[at] = 0.0
            difference[start] = 2.0 * math.atan2(np.linalg.norm(_vector_of_quotient(a, b)), abs(a @ b))
        difference *= self._weights
        return math.sqrt(difference.dot(difference))

    def _path(self, q1: ArrayLike, q2: ArrayLike, steps: int) -> np.ndarray:
        straight = LinearDistanceAndInterpolationProvider.DoInterpolateBetweenConfigurations
        if self._quaternions or type(self).DoInterpolateBetweenConfigurations is not straight:
            return super()._path(q1, q2, steps)
        a, b = _pair("InterpolateBetweenConfigurations", q1, q2)
        return a + (np.arange(steps + 1) / steps)[:, None] * (b - a)

    def DoInterpolateBetweenConfigurations(self, from_: np.ndarray, to: np.ndarray, ratio: float) -> np.ndarray:
        """Returns a configuration on the straight line, with quaternions on great circles."""
        out = from_ + ratio * (to - from_)
        for start in self._quaternions:
            at = slice(start, start + 4)
            out[at] = _slerp(_unit(from_[at]), _unit(to[at]), ratio)
        return out


def _unit(z: np.ndarray) -> np.ndarray:
    return z / np.linalg.norm(z)


def _vector_of_quotient(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The vector part of conj(a) b."""
    return a[0] * b[1:] - b[0] * a[1:] - np.cross(a[1:], b[1:])


def _slerp(a: np.ndarray, b: np.ndarray, ratio: float) -> np.ndarray:
    """Shoemake, "Animating rotation with quaternion curves", 1985, on the shorter way."""
    cosine = float(a @ b)
    if cosine < 0.0:
        b, cosine = -b, -cosine
    if cosine > 1.0 - 1e-15:
        return (1.0 - ratio) * a + ratio * b
    angle = math.acos(cosine)
    return (math.sin((1.0 - ratio) * angle) * a + math.sin(ratio * angle) * b) / math.sin(angle)


class FunctionProvider(DistanceAndInterpolationProvider):
    """A distance function, and an interpolation function, which a checker may replace one by one."""

    def __init__(self, distance: Callable, interpolation: Callable):
        self.distance, self.interpolation = distance, interpolation

    def DoComputeConfigurationDistance(self, from_: np.ndarray, to: np.ndarray) -> float:
        """Returns what the distance function gives."""
        return self.distance(from_, to)

    def DoInterpolateBetweenConfigurations(self, from_: np.ndarray, to: np.ndarray, ratio: float) -> np.ndarray:
        """Returns what the interpolation function gives."""
        return self.interpolation(from_, to, ratio)

    def _path(self, q1: ArrayLike, q2: ArrayLike, steps: int) -> np.ndarray:
        line = getattr(self.interpolation, "__self__", None)
        if isinstance(line, LinearDistanceAndInterpolationProvider):
            if self.interpolation == line.DoInterpolateBetweenConfigurations:
                return line._path(q1, q2, steps)
        return super()._path(q1, q2, steps)
