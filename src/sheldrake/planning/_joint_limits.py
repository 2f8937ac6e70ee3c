"""Limits of positions, velocities and accelerations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common import quick
from sheldrake.common._checked import checked
from sheldrake.common._kinds import flag, instance_of
from sheldrake.common._overloads import dispatch, overload
from sheldrake.planning._dof_mask import DofMask
from sheldrake.solvers import _arrays
from sheldrake.solvers._kernels.inside import inside_box

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.multibody.plant import MultibodyPlant

_KINDS = ("position", "velocity", "acceleration")


def _plant(value: Any) -> Any:
    if not hasattr(value, "GetPositionLowerLimits"):
        raise _arrays.Mismatch
    return value


@checked
class JointLimits:
    """Limits of positions, velocities and accelerations of a robot.

    Made as `()`; `(plant)`; `(plant, active_dof)`; `(other, active_dof)`; or with six vectors, lower and upper limits
    of each. `require_finite_positions`, `require_finite_velocities` and `require_finite_accelerations` may follow.

    Raises:
        RuntimeError: sizes differ, a lower limit is above its upper limit, or one is not finite though required.
    """

    def __init__(self, *args: Any, **kwargs: Any):
        flags = {f"require_finite_{word}": (flag, False) for word in ("positions", "velocities", "accelerations")}
        vectors = {f"{kind}_{end}": _arrays.float_vector for kind in _KINDS for end in ("lower", "upper")}
        mask = instance_of(DofMask)
        ways = [
            overload(lambda self: self._set([np.zeros(0)] * 6, (False,) * 3)),
            overload(lambda self, plant, *need: self._set(_of_plant(plant), need), plant=_plant, **flags),
            overload(
                lambda self, plant, mask, *need: self._set(_selected(_of_plant(plant), mask), need),
                plant=_plant,
                active_dof=mask,
                **flags,
            ),
            overload(
                lambda self, other, mask, *need: self._set(_selected(other._limits, mask), need),
                other=instance_of(JointLimits),
                active_dof=mask,
                **flags,
            ),
            overload(lambda self, *values: self._set(list(values[:6]), values[6:]), **vectors, **flags),
        ]
        dispatch("JointLimits", ways, self, args, kwargs)

    def _set(self, limits: list[np.ndarray], need: Any) -> None:
        for k, (kind, finite) in enumerate(zip(_KINDS, need)):
            lower, upper = limits[2 * k], limits[2 * k + 1]
            if lower.size != upper.size:
                raise RuntimeError(f"JointLimits(): {kind} limits have {lower.size} and {upper.size} values.")
            table = "\n".join(f"{lo:g} {up:g}" for lo, up in zip(lower, upper))
            if np.isnan(lower).any() or np.isnan(upper).any() or np.any(lower > upper):
                problem = f"{kind.capitalize()} limits invalid. Lower values must be <= upper values."
                raise RuntimeError(f"{problem}\n[lower|upper]:\n{table}")
            if finite and not (np.isfinite(lower).all() and np.isfinite(upper).all()):
                raise RuntimeError(f"{kind.capitalize()} limits are not finite.\n[lower|upper]:\n{table}")
        self._limits = [np.array(v) for v in limits]

    def num_positions(self) -> int:
        """Returns the number of positions."""
        return self._limits[0].size

    def num_velocities(self) -> int:
        """Returns the number of velocities."""
        return self._limits[2].size

    def num_accelerations(self) -> int:
        """Returns the number of accelerations."""
        return self._limits[4].size

    def position_lower(self) -> np.ndarray:
        """Returns the lower limits of positions."""
        return self._limits[0].copy()

    def position_upper(self) -> np.ndarray:
        """Returns the upper limits of positions."""
        return self._limits[1].copy()

    def velocity_lower(self) -> np.ndarray:
        """Returns the lower limits of velocities."""
        return self._limits[2].copy()

    def velocity_upper(self) -> np.ndarray:
        """Returns the upper limits of velocities."""
        return self._limits[3].copy()

    def acceleration_lower(self) -> np.ndarray:
        """Returns the lower limits of accelerations."""
        return self._limits[4].copy()

    def acceleration_upper(self) -> np.ndarray:
        """Returns the upper limits of accelerations."""
        return self._limits[5].copy()

    def _within(self, call: str, k: int, value: Any, tolerance: float) -> bool:
        lower, upper = self._limits[2 * k], self._limits[2 * k + 1]
        inside = _inside(lower, upper, value, tolerance)
        if inside is not None and tolerance >= 0.0 and (inside or not np.isnan(value).any()):
            return bool(inside)
        value = np.array(value, dtype=float).ravel()
        if value.size != lower.size or np.isnan(value).any() or not tolerance >= 0.0:
            raise RuntimeError(
                f"{call}(): expected {lower.size} values, none of them nan, and a tolerance that is not negative; got "
                f"{value} and {tolerance}."
            )
        return bool((value >= lower - tolerance).all() and (value <= upper + tolerance).all())

    def CheckInPositionLimits(self, position: ArrayLike, tolerance: float = 0.0) -> bool:
        """Tells whether positions are within limits.

        Raises:
            RuntimeError: the size is another, a value is nan, or the tolerance is negative.
        """
        return self._within("CheckInPositionLimits", 0, position, tolerance)

    def CheckInVelocityLimits(self, velocity: ArrayLike, tolerance: float = 0.0) -> bool:
        """Tells whether velocities are within limits.

        Raises:
            RuntimeError: the size is another, a value is nan, or the tolerance is negative.
        """
        return self._within("CheckInVelocityLimits", 1, velocity, tolerance)

    def CheckInAccelerationLimits(self, acceleration: ArrayLike, tolerance: float = 0.0) -> bool:
        """Tells whether accelerations are within limits.

        Raises:
            RuntimeError: the size is another, a value is nan, or the tolerance is negative.
        """
        return self._within("CheckInAccelerationLimits", 2, acceleration, tolerance)


def _of_plant(plant: MultibodyPlant) -> list[np.ndarray]:
    if not plant.is_finalized():
        raise RuntimeError("JointLimits(): the plant is not finalized.")
    words = ("Position", "Velocity", "Acceleration")
    return [np.array(getattr(plant, f"Get{w}{end}Limits")()) for w in words for end in ("Lower", "Upper")]


def _selected(limits: list[np.ndarray], mask: DofMask) -> list[np.ndarray]:
    if any(v.size != mask.size() for v in limits):
        raise RuntimeError(f"JointLimits(): the mask has size {mask.size()}, the limits {[v.size for v in limits]}.")
    return [v[mask.GetSelectedToFullIndex()] for v in limits]


_inside = quick.short_way(globals(), "_inside", inside_box, quick.ANY, quick.ANY, quick.ANY, float, gives=bool)
