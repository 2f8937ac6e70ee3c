"""JointSliders: positions of a plant from sliders in the page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.geometry import Meshcat
from sheldrake.geometry._meshcat.stop_button import until_stopped
from sheldrake.systems.framework import LeafSystem

from ._arrow import as_floats

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.multibody.plant._multibody_plant import MultibodyPlant
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._diagram import Diagram
    from sheldrake.systems.framework._vector import BasicVector

_FARTHEST = 10.0  # where a slider ends whose joint has no limit [m or rad]
_STEP = 0.01  # [m or rad]
_STOP_BUTTON = "Stop JointSliders"


class JointSliders(LeafSystem):
    """Adds a slider to the page for each position of a plant; the output port "positions" tells where they stand.

    The output port always reports the sliders as they are at that moment, also to several readers within one
    computation; put a ZeroOrderHold behind it where that matters.

    Args:
        meshcat: Where the sliders are added.
        plant: The finalized plant.
        initial_value: Where the sliders start, shape (nq,); the plant's defaults when left out.
        lower_limit: Lowest value, one number or shape (nq,); the joint's limit counts where it is higher.
        upper_limit: Highest value, one number or shape (nq,); the joint's limit counts where it is lower.
        step: Least change, one number or shape (nq,).
        decrement_keycodes: Keys that lower each slider by a step, by their names in JavaScript.
        increment_keycodes: Keys that raise each slider by a step.

    Raises:
        RuntimeError: when the plant is not finalized, a size is not nq, or a slider's name is taken.
    """

    def __init__(
        self,
        meshcat: Meshcat,
        plant: MultibodyPlant,
        initial_value: ArrayLike | None = None,
        lower_limit: float | ArrayLike | None = None,
        upper_limit: float | ArrayLike | None = None,
        step: float | ArrayLike | None = None,
        decrement_keycodes: Sequence[str] = (),
        increment_keycodes: Sequence[str] = (),
    ):
        super().__init__()
        self._meshcat, self._plant = meshcat, plant
        nq = self._nq = plant.num_positions()
        if initial_value is None:
            initial_value = as_floats(plant.GetPositions(plant.CreateDefaultContext()))
        self._initial = _each(nq, "initial_value", initial_value, 0.0, broadcast=False)
        lower = _each(nq, "lower_limit", lower_limit, -_FARTHEST)
        upper = _each(nq, "upper_limit", upper_limit, _FARTHEST)
        steps = _each(nq, "step", step, _STEP)
        down = _keys(nq, "decrement_keycodes", decrement_keycodes)
        up = _keys(nq, "increment_keycodes", increment_keycodes)
        # The highest lower limit counts, but never above the upper one, which is the lowest; as Drake has it.
        upper = np.minimum(upper, as_floats(plant.GetPositionUpperLimits()))
        lower = np.minimum(np.maximum(lower, as_floats(plant.GetPositionLowerLimits())), upper)
        self._sliders: dict[int, str] = {}
        for i, name in enumerate(slider_names(plant)):
            meshcat.AddSlider(name, lower[i], upper[i], steps[i], self._initial[i], down[i], up[i])
            self._sliders[i] = name
        self.DeclareVectorOutputPort("positions", nq, self._calc, {self.time_ticket()}).disable_caching_by_default()

    def Delete(self) -> None:
        """Removes the sliders; from then on the output port gives the initial value, or what SetPositions() set."""
        for name in self._sliders.values():
            self._meshcat.DeleteSlider(name, strict=False)
        self._sliders.clear()

    def SetPositions(self, q: ArrayLike) -> None:
        """Moves the sliders, and what remains after Delete(), to positions q [m or rad], shape (nq,).

        Raises:
            RuntimeError: when the size is not nq.
        """
        self._initial = _each(self._nq, "q", q, 0.0, broadcast=False)
        for i, name in self._sliders.items():
            self._meshcat.SetSliderValue(name, self._initial[i])

    def Run(self, diagram: Diagram, timeout: float | None = None, stop_button_keycode: str = "Escape") -> np.ndarray:
        """Publishes a diagram whenever a slider moves, until its stop button is pressed or time is over.

        Args:
            diagram: The outermost diagram, which holds the plant and these sliders.
            timeout: Wall time to stay at most [s]; for ever when left out.
            stop_button_keycode: Key that also presses the button "Stop JointSliders"; "" for none.

        Returns:
            The plant's positions as published last, shape (nq,).

        Raises:
            RuntimeError: when the diagram holds neither plant nor sliders, or is part of another one.
        """
        root = diagram.CreateDefaultContext()
        plant_context = self._plant.GetMyMutableContextFromRoot(root)
        own_context = self.GetMyContextFromRoot(root)
        shown = None
        for _ in until_stopped(self._meshcat, _STOP_BUTTON, stop_button_keycode, timeout):
            q = np.array(self.get_output_port().Eval(own_context))
            if shown is None or not np.array_equal(q, shown):
                self._plant.SetPositions(plant_context, q)
                diagram.ForcedPublish(root)
                shown = q
        return np.array(self._plant.GetPositions(plant_context))

    def _calc(self, context: Context, output: BasicVector) -> None:
        values = self._initial.copy()
        for i, name in self._sliders.items():
            values[i] = self._meshcat.GetSliderValue(name)
        output.SetFromVector(values)


def _each(nq: int, name: str, value: ArrayLike | None, default: float, broadcast: bool = True) -> np.ndarray:
    """Returns a value for each position, shape (nq,)."""
    if value is None:
        value = default
    array = np.asarray(value, dtype=float)
    if array.ndim == 0 and broadcast:
        return np.full(nq, float(array))
    array = array.ravel()
    if len(array) != nq:
        raise RuntimeError(f"JointSliders: Expected {name} of size {nq}, but got size {len(array)} instead")
    return array.copy()


def _keys(nq: int, name: str, keys: Sequence[str]) -> list[str]:
    keys = list(keys)
    if keys and len(keys) != nq:
        raise RuntimeError(f"JointSliders: Expected {name} of size zero or {nq}, but got size {len(keys)} instead")
    return keys or [""] * nq


def slider_names(plant: MultibodyPlant) -> list[str]:
    """Returns the joints' names with what tells their positions apart, and the models' where they are needed."""
    plain = plant.GetPositionNames(add_model_instance_prefix=False, always_add_suffix=False)
    if len(set(plain)) == len(plain):
        return plain
    models = [""] * len(plain)
    for joint in map(plant.get_joint, plant.GetJointIndices()):
        for i in range(joint.position_start(), joint.position_start() + joint.num_positions()):
            models[i] = plant.GetModelInstanceName(joint.model_instance())
    return [f"{name}/{model}" for name, model in zip(plain, models)]
