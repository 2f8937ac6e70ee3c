"""Sliders in a notebook for the joints of a plant (`pip install ipywidgets`)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.systems.framework import LeafSystem
from sheldrake.systems.jupyter_widgets import listen_to_widgets

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._system import System
    from sheldrake.systems.framework._vector import BasicVector

__all__ = ["JointSliders", "MakeJointSlidersThatPublishOnCallback"]


class JointSliders(LeafSystem):
    """A slider for each position of each joint; output port `positions` gives all positions, shape (nq,).

    Args:
        robot: The plant, finalized.
        lower_limit: Least values, a number or shape (nq,); where a joint's own limit is tighter, that holds.
        upper_limit: Largest values, likewise.
        resolution: Steps of the sliders, a number or shape (nq,).
        length: Width of the sliders in pixels.
        update_period_sec: How often waiting events of the widgets run during a simulation [s].
    """

    def __init__(
        self,
        robot: MultibodyPlant,
        lower_limit: ArrayLike = -10.0,
        upper_limit: ArrayLike = 10.0,
        resolution: ArrayLike = 0.01,
        length: ArrayLike = 200,
        update_period_sec: float = 0.005,
    ):
        from IPython.display import display

        super().__init__()
        self._robot = robot
        self._default_position = robot.GetPositions(robot.CreateDefaultContext())
        self.DeclareVectorOutputPort("positions", robot.num_positions(), self._give_positions)
        self.DeclarePeriodicPublishEvent(update_period_sec, 0.0, listen_to_widgets)
        self._sliders = _joint_sliders(robot, self._default_position, lower_limit, upper_limit, resolution, length)
        for slider in self._sliders.values():
            display(slider)

    def set_positions(self, q: ArrayLike) -> None:
        """Moves the sliders to positions of the plant, shape (nq,)."""
        q = np.asarray(q)
        for i, slider in self._sliders.items():
            slider.value = q[i]

    def set_joint_positions(self, q: Any) -> None:
        """Moves the sliders, one value for each in their order.

        Raises:
            ValueError: the number of values is not the number of sliders.
        """
        if len(q) != len(self._sliders):
            raise ValueError(f"set_joint_positions(): expected {len(self._sliders)} positions, got {len(q)}.")
        for slider, value in zip(self._sliders.values(), q):
            slider.value = value

    def _give_positions(self, context: Context, output: BasicVector) -> None:
        q = self._default_position.copy()
        for i, slider in self._sliders.items():
            q[i] = slider.value
        output.SetFromVector(q)


def MakeJointSlidersThatPublishOnCallback(
    plant: MultibodyPlant,
    publishing_system: System,
    root_context: Context,
    my_callback: Callable[[Any], None] | None = None,
    lower_limit: ArrayLike = -10.0,
    upper_limit: ArrayLike = 10.0,
    resolution: ArrayLike = 0.01,
    length: ArrayLike = 200,
    continuous_update: bool = True,
) -> list:
    """Sliders that set the positions of a plant and publish, without a simulation.

    Args:
        plant: The plant, finalized.
        publishing_system: What publishes when a slider moves: the diagram, or a system in it.
        root_context: Context of the diagram that holds both.
        my_callback: Called with the plant's context, now and whenever a slider moves.
        lower_limit: Least values, a number or shape (nq,); where a joint's own limit is tighter, that holds.
        upper_limit: Largest values, likewise.
        resolution: Steps of the sliders, a number or shape (nq,).
        length: Width of the sliders, anything CSS understands.
        continuous_update: Follow a slider while it is dragged, or only when it is let go.

    Returns:
        The sliders.
    """
    from IPython.display import display

    publishing_context = publishing_system.GetMyContextFromRoot(root_context)
    plant_context = plant.GetMyMutableContextFromRoot(root_context)
    q0 = plant.GetPositions(plant_context)
    sliders = _joint_sliders(plant, q0, lower_limit, upper_limit, resolution, length, continuous_update)

    def moved(change: Any, i: int) -> None:
        q = plant.GetPositions(plant_context).copy()
        q[i] = change["new"]
        plant.SetPositions(plant_context, q)
        show()

    def show() -> None:
        publishing_system.ForcedPublish(publishing_context)
        if my_callback is not None:
            my_callback(plant_context)

    for i, slider in sliders.items():
        slider.observe(lambda change, i=i: moved(change, i), names="value")
        display(slider)
    show()
    return list(sliders.values())


def _joint_sliders(
    plant: MultibodyPlant,
    q0: np.ndarray,
    lower: Any,
    upper: Any,
    resolution: ArrayLike,
    length: ArrayLike,
    continuous_update: bool = True,
) -> dict[int, Any]:
    """A slider for each position of each joint, by the number of the position."""
    from ipywidgets import FloatSlider, Layout

    nq = plant.num_positions()
    lower = np.maximum(np.broadcast_to(lower, nq), plant.GetPositionLowerLimits())
    upper = np.minimum(np.broadcast_to(upper, nq), plant.GetPositionUpperLimits())
    resolution = np.broadcast_to(resolution, nq)
    sliders = {}
    for joint in (plant.get_joint(j) for j in plant.GetJointIndices()):
        for k in range(joint.num_positions()):
            i = joint.position_start() + k
            sliders[i] = FloatSlider(
                value=float(q0[i]),
                min=float(lower[i]),
                max=float(upper[i]),
                step=float(resolution[i]),
                continuous_update=continuous_update,
                description=joint.name() + (f"[{k}]" if joint.num_positions() > 1 else ""),
                style={"description_width": "initial"},
                layout=Layout(width=f"{length}px" if isinstance(length, (int, float)) else str(length)),
            )
    return sliders
