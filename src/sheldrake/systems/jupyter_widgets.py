"""Widgets of a notebook as systems whose outputs are the widgets' values (`pip install ipywidgets`)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common.jupyter import process_ipywidget_events
from sheldrake.common.value import Value
from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.systems.framework import LeafSystem

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context

__all__ = ["PoseSliders", "WidgetSystem"]

_EVENTS_AT_ONCE = 10


class PoseSliders(LeafSystem):
    """Six sliders, shown in the notebook at once, that give a pose at the output port `pose`.

    Args:
        visible: Which sliders are shown.
        min_range: Least values of the sliders [rad, m].
        max_range: Largest values [rad, m].
        value: First values [rad, m].
    """

    class Visible(NamedTuple):
        """Which sliders are shown."""

        roll: bool = True
        pitch: bool = True
        yaw: bool = True
        x: bool = True
        y: bool = True
        z: bool = True

    class MinRange(NamedTuple):
        """Least values of the sliders [rad, m]."""

        roll: float = -np.pi
        pitch: float = -np.pi
        yaw: float = -np.pi
        x: float = -1.0
        y: float = -1.0
        z: float = -1.0

    class MaxRange(NamedTuple):
        """Largest values of the sliders [rad, m]."""

        roll: float = np.pi
        pitch: float = np.pi
        yaw: float = np.pi
        x: float = 1.0
        y: float = 1.0
        z: float = 1.0

    class Value(NamedTuple):
        """Values of the sliders [rad, m]."""

        roll: float = 0.0
        pitch: float = 0.0
        yaw: float = 0.0
        x: float = 0.0
        y: float = 0.0
        z: float = 0.0

    def __init__(
        self, visible: Any = Visible(), min_range: Any = MinRange(), max_range: Any = MaxRange(), value: Any = Value()
    ):  # the defaults are immutable
        from IPython.display import display
        from ipywidgets import FloatSlider, Layout

        super().__init__()
        self.DeclareAbstractOutputPort("pose", lambda: _POSE.Clone(), self.DoCalcOutput)
        self.DeclarePeriodicPublishEvent(0.1, 0.0, listen_to_widgets)
        self._sliders = []
        for name in self.Value._fields:
            slider = FloatSlider(
                value=getattr(value, name),
                min=getattr(min_range, name),
                max=getattr(max_range, name),
                step=0.01,
                continuous_update=True,
                description=name,
                layout=Layout(width="90%"),
            )
            self._sliders.append(slider)
            if getattr(visible, name):
                display(slider)

    def SetPose(self, pose: Any) -> None:
        """Moves all sliders to a pose: anything that `RigidTransform` takes."""
        X = RigidTransform(pose)
        self.SetRpy(RollPitchYaw(X.rotation()))
        self.SetXyz(X.translation())

    def SetRpy(self, rpy: RollPitchYaw) -> None:
        """Moves the sliders of the angles."""
        self._move(self._sliders[:3], rpy.vector())

    def SetXyz(self, xyz: Any) -> None:
        """Moves the sliders of the position [m], shape (3,)."""
        self._move(self._sliders[3:], xyz)

    def _move(self, sliders: list, values: Any) -> None:
        for slider, value in zip(sliders, values):
            slider.value = float(value)

    def DoCalcOutput(self, context: Context, output: Any) -> None:
        """The pose that the sliders show."""
        values = np.array([slider.value for slider in self._sliders])
        output.set_value(RigidTransform(RollPitchYaw(values[:3]), values[3:]))


class WidgetSystem(LeafSystem):
    """Groups of widgets, shown in the notebook at once; output port `widget_group_i` gives the values of group i.

    Args:
        args: The groups, each a list (or tuple, ...) of widgets whose values are numbers.
        update_period_sec: How often waiting events of the widgets run during a simulation [s].
    """

    def __init__(self, *args: Any, update_period_sec: float = 0.1):
        from IPython.display import display

        super().__init__()
        self._groups = [list(group) for group in args]
        self.DeclarePeriodicPublishEvent(update_period_sec, 0.0, listen_to_widgets)
        for i, group in enumerate(self._groups):
            self.DeclareVectorOutputPort(
                f"widget_group_{i}", len(group), lambda context, output, i=i: self.DoCalcOutput(context, output, i)
            )
            for widget in group:
                display(widget)

    def DoCalcOutput(self, context: Context, output: Any, port_index: int) -> None:
        """The values of a group."""
        output.SetFromVector([float(widget.value) for widget in self._groups[port_index]])


_POSE = Value(RigidTransform())


def listen_to_widgets(context: Context | None = None, event: Any = None) -> None:
    """Lets waiting events of widgets run: what a periodic publish event calls."""
    process_ipywidget_events(_EVENTS_AT_ONCE)
