"""Sliders for the posture of a plant: what a person moves, in place of the numbers in its state."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common.eigen_geometry import Quaternion
from sheldrake.geometry import Meshcat
from sheldrake.math import RollPitchYaw, RotationMatrix
from sheldrake.multibody.meshcat._joint_sliders import slider_names
from sheldrake.multibody.tree import QuaternionFloatingJoint

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.multibody.plant._multibody_plant import MultibodyPlant
    from sheldrake.multibody.tree._rigid_body import RigidBody
    from sheldrake.systems.framework._context.context import Context

_STEP = 0.001  # [m or rad]
_FARTHEST = 2.0  # where a slider of a place ends that has no limit [m]
_TURN = 3.142  # where a slider of an angle ends that has no limit, in steps of the slider [rad]
_POSE = ("x", "y", "z", "roll", "pitch", "yaw")


@dataclasses.dataclass(frozen=True)
class _Slider:
    """One slider.

    Attributes:
        name: Its label.
        lower: Lowest value [m or rad].
        upper: Highest value [m or rad].
        position: Number of the position it moves; of a body that floats, of its first one.
        part: What it moves of a body that floats, a number in `_POSE`; None for a joint.
    """

    name: str
    lower: float
    upper: float
    position: int
    part: int | None = None


class PostureSliders:
    """Adds sliders to the page: one for each position of a joint, six for a body that floats.

    A floating body has x, y, z [m] and roll, pitch, yaw [rad], "body_x" and so on, and not the four numbers of a
    quaternion, of which none can be moved alone.

    Args:
        meshcat: Where the sliders are added.
        plant: The finalized plant.
        positions: Where they start [m or rad], shape (nq,); the plant's defaults when left out.

    Raises:
        RuntimeError: when a slider's name is taken.
    """

    def __init__(self, meshcat: Meshcat, plant: MultibodyPlant, positions: ArrayLike | None = None):
        if positions is None:
            positions = plant.GetPositions(plant.CreateDefaultContext())
        self._meshcat, self._nq = meshcat, plant.num_positions()
        self._sliders = _sliders_of(plant)
        self._home = self._values_of(positions)
        for slider, value in zip(self._sliders, self._home):
            meshcat.AddSlider(slider.name, min(slider.lower, value), max(slider.upper, value), _STEP, value)

    def positions(self) -> np.ndarray:
        """Returns the plant's positions that the sliders stand for [m or rad], shape (nq,)."""
        q = np.zeros(self._nq)
        poses: dict[int, np.ndarray] = {}
        for slider, value in zip(self._sliders, self._values()):
            if slider.part is None:
                q[slider.position] = value
            else:
                poses.setdefault(slider.position, np.zeros(6))[slider.part] = value
        for i, pose in poses.items():
            q[i : i + 4], q[i + 4 : i + 7] = RollPitchYaw(pose[3:]).ToQuaternion().wxyz(), pose[:3]
        return q

    def names(self) -> set[str]:
        """Returns the sliders' names."""
        return {slider.name for slider in self._sliders}

    def MoveJoints(self, plant: MultibodyPlant, context: Context, moved: set[str]) -> None:
        """Puts the joints, and what floats, of some sliders where these stand, at rest; the others go on.

        Args:
            plant: The plant.
            context: Its context.
            moved: Names of sliders.
        """
        q, given, v = plant.GetPositions(context), self.positions(), plant.GetVelocities(context)
        starts = {slider.position for slider in self._sliders if slider.name in moved}
        for joint in map(plant.get_joint, plant.GetJointIndices()):
            first, count = joint.position_start(), joint.num_positions()
            if starts & set(range(first, first + count)):
                q[first : first + count] = given[first : first + count]
                v[joint.velocity_start() : joint.velocity_start() + joint.num_velocities()] = 0.0
        if starts:
            plant.SetPositions(context, q)
            plant.SetVelocities(context, v)

    def SetPositions(self, q: ArrayLike | None) -> None:
        """Moves the sliders to positions of the plant [m or rad], shape (nq,)."""
        self._move(self._values_of(q))

    def GoHome(self) -> None:
        """Moves the sliders to where they started."""
        self._move(self._home)

    def GoAnywhere(self, generator: np.random.Generator) -> None:
        """Moves the joints' sliders at random; bodies that float stay where they are."""
        drawn = [generator.uniform(slider.lower, slider.upper) for slider in self._sliders]
        values = [new if s.part is None else old for s, new, old in zip(self._sliders, drawn, self._values())]
        self._move(values)

    def Lift(self, body: RigidBody, height: float) -> None:
        """Raises a floating body, and where it starts, by a height [m]."""
        z = next(
            n for n, s in enumerate(self._sliders) if s.position == body.floating_positions_start() and s.part == 2
        )
        self._home[z] += height
        self._meshcat.SetSliderValue(self._sliders[z].name, self._home[z])

    def _values(self) -> list[float]:
        return [self._meshcat.GetSliderValue(slider.name) for slider in self._sliders]

    def _move(self, values: list[float]) -> None:
        for slider, value in zip(self._sliders, values):
            self._meshcat.SetSliderValue(slider.name, value)

    def _values_of(self, q: ArrayLike | None) -> list[float]:
        """The sliders' values for positions, shape (nq,)."""
        q, values = np.asarray(q, dtype=float), []
        for slider in self._sliders:
            i = slider.position
            values.append(float(q[i]) if slider.part is None else _pose_of(q[i : i + 7])[slider.part])
        return values


def _pose_of(q: np.ndarray) -> list[float]:
    """x, y, z [m], roll, pitch, yaw [rad] of a floating body's positions, shape (7,)."""
    R = RotationMatrix(Quaternion(wxyz=q[:4] / np.linalg.norm(q[:4])))
    return [*map(float, q[4:]), *map(float, RollPitchYaw(R).vector())]


def _sliders_of(plant: MultibodyPlant) -> list[_Slider]:
    """One slider for each position of a joint and six for a body that floats, in the order of positions."""
    lower, upper = plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits()
    names, sliders = slider_names(plant), []
    for joint in sorted((plant.get_joint(j) for j in plant.GetJointIndices()), key=lambda j: j.position_start()):
        first = joint.position_start()
        if isinstance(joint, QuaternionFloatingJoint):
            stem, _, rest = names[first].partition("qw")  # "body_qw", or "body_qw/model" of a name that is there twice
            for part, name in enumerate(_POSE):
                end = _FARTHEST if part < 3 else _TURN
                sliders.append(_Slider(f"{stem}{name}{rest}", -end, end, first, part))
            continue
        for k in range(joint.num_positions()):
            i, end = first + k, _FARTHEST if joint.position_suffix(k) in ("x", "y", "z") else _TURN
            low = float(lower[i]) if math.isfinite(lower[i]) else -end
            high = float(upper[i]) if math.isfinite(upper[i]) else end
            sliders.append(_Slider(names[i], min(low, high), high, i))
    return sliders
