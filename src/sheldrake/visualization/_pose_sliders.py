"""MeshcatPoseSliders: a pose from six sliders in the page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common.value import AbstractValue
from sheldrake.geometry import Meshcat
from sheldrake.geometry._meshcat.stop_button import until_stopped
from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.systems.framework import EventStatus, LeafSystem

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, DTypeLike

    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._system import System

_NAMES = ("roll", "pitch", "yaw", "x", "y", "z")
_STOP_BUTTON = "Stop PoseSliders"


def _six(name: str, value: ArrayLike, dtype: DTypeLike = float) -> np.ndarray:
    array = np.asarray(value, dtype=dtype)
    if array.shape not in ((6,), (6, 1)):
        raise TypeError(f"MeshcatPoseSliders(): {name} must have shape (6,), got {array.shape}.")
    return array.ravel().copy()


class MeshcatPoseSliders(LeafSystem):
    """Adds sliders for roll, pitch, yaw [rad], x, y and z [m]; the output port "pose" tells the pose they stand for.

    The optional input port "pose" counts at initialization only, over `initial_pose`. The output port always reports
    the sliders as they are at that moment, also to several readers within one computation.

    Args:
        meshcat: Where the sliders are added.
        initial_pose: Where they start.
        lower_limit: Lowest values, shape (6,).
        upper_limit: Highest values, shape (6,).
        step: Least changes, shape (6,).
        decrement_keycodes: Six keys that lower the sliders by a step, by their names in JavaScript.
        increment_keycodes: Six keys that raise the sliders by a step.
        prefix: Begins the sliders' names, "{prefix}_roll" and so on.
        visible: Which of the sliders there are, shape (6,); the others stay as `initial_pose` has them.

    Raises:
        RuntimeError: when there are not six keycodes, or a slider's name is taken.
        TypeError: when an array has another shape.
    """

    def __init__(
        self,
        meshcat: Meshcat,
        initial_pose: RigidTransform | None = None,
        lower_limit: ArrayLike = (-np.pi, -np.pi, -np.pi, -1.0, -1.0, -1.0),
        upper_limit: ArrayLike = (np.pi, np.pi, np.pi, 1.0, 1.0, 1.0),
        step: ArrayLike = (0.01,) * 6,
        decrement_keycodes: Sequence[str] = ("KeyQ", "KeyS", "KeyA", "KeyJ", "KeyK", "KeyU"),
        increment_keycodes: Sequence[str] = ("KeyE", "KeyW", "KeyD", "KeyL", "KeyI", "KeyO"),
        prefix: str = "",
        visible: ArrayLike = (True,) * 6,
    ):
        super().__init__()
        lower, upper = _six("lower_limit", lower_limit), _six("upper_limit", upper_limit)
        steps, shown = _six("step", step), _six("visible", visible, bool)
        for name, keys in (("decrement_keycodes", decrement_keycodes), ("increment_keycodes", increment_keycodes)):
            if len(keys) != 6:
                raise RuntimeError(f"MeshcatPoseSliders(): Expected {name} of size 6, but got size {len(keys)} instead")
        self._meshcat = meshcat
        self._initial = _numbers(RigidTransform() if initial_pose is None else initial_pose)
        self._sliders: dict[int, str] = {}
        for i in map(int, np.flatnonzero(shown)):
            name = f"{prefix}_{_NAMES[i]}" if prefix else _NAMES[i]
            meshcat.AddSlider(
                name, lower[i], upper[i], steps[i], self._initial[i], decrement_keycodes[i], increment_keycodes[i]
            )
            self._sliders[i] = name
        pose = AbstractValue.Make(RigidTransform())
        self.DeclareAbstractInputPort("pose", pose)
        port = self.DeclareAbstractOutputPort("pose", pose.Clone, self._calc, {self.time_ticket()})
        port.disable_caching_by_default()
        self.DeclareInitializationPublishEvent(publish=self._initialize)

    def Delete(self) -> None:
        """Removes the sliders; from then on the output port gives the initial pose, or what SetPose() set."""
        for name in self._sliders.values():
            self._meshcat.DeleteSlider(name, strict=False)
        self._sliders.clear()

    def SetPose(self, pose: RigidTransform | ArrayLike) -> None:
        """Moves the sliders, and what remains after Delete(), to a pose."""
        self._initial = _numbers(pose)
        for i, name in self._sliders.items():
            self._meshcat.SetSliderValue(name, self._initial[i])

    def Run(
        self, system: System, context: Context, timeout: float | None = None, stop_button_keycode: str = "Escape"
    ) -> RigidTransform:
        """Publishes a system whenever a slider moves, until its stop button is pressed or time is over.

        Args:
            system: This system, or the outermost diagram that holds it.
            context: Its context.
            timeout: Wall time to stay at most [s]; for ever when left out.
            stop_button_keycode: Key that also presses the button "Stop PoseSliders"; "" for none.

        Returns:
            The pose as published last.
        """
        own = context if system is self else self.GetMyContextFromRoot(context)
        shown = None
        for _ in until_stopped(self._meshcat, _STOP_BUTTON, stop_button_keycode, timeout):
            values = self._values()
            if shown is None or not np.array_equal(values, shown):
                shown = values
                pose = self.get_output_port().Eval(own)
                system.ForcedPublish(context)
        return pose

    def _values(self) -> np.ndarray:
        values = self._initial.copy()
        for i, name in self._sliders.items():
            values[i] = self._meshcat.GetSliderValue(name)
        return values

    def _initialize(self, context: Context) -> EventStatus:
        if self.get_input_port().HasValue(context):
            self.SetPose(self.get_input_port().Eval(context))
            return EventStatus.Succeeded()
        return EventStatus.DidNothing()

    def _calc(self, context: Context, output: AbstractValue) -> None:
        values = self._values()
        output.set_value(RigidTransform(RollPitchYaw(values[:3]), values[3:]))


def _numbers(pose: Any) -> np.ndarray:
    """Returns roll, pitch, yaw [rad], x, y, z [m] of a pose, shape (6,)."""
    return np.concatenate([RollPitchYaw(pose.rotation()).vector(), pose.translation()])
