"""How fast the surfaces of belts run, and how far they have come.

Speeds come as a `BusValue`, which kernels do not see: a stage in Python writes them into the scratch. What a discrete
plant's surfaces have come is abstract state; that of a continuous one's is continuous state behind the velocities.
"""

from __future__ import annotations

import types
from typing import Any

import numpy as np

from sheldrake.common.value import AbstractValue
from sheldrake.multibody.plant._building.settings import Settings
from sheldrake.multibody.plant._building.surface_axes import SurfaceAxes
from sheldrake.multibody.plant._step.input_ports import InputPorts, has_value
from sheldrake.systems.framework import BusValue, Context, LeafSystem, State


class SurfaceSpeeds:
    """Speeds and displacements of the surfaces that run.

    Args:
        axes: Which there are.
        settings: Discrete or continuous.
        inputs: Where speeds come from.
    """

    def __init__(self, axes: SurfaceAxes, settings: Settings, inputs: InputPorts) -> None:
        self._axes, self._settings, self._inputs = axes, settings, inputs
        self._state = -1  # number of the abstract state
        self._names: list[str] = []

    def declare(self, plant: LeafSystem) -> None:
        """Declares what a discrete plant needs to know how far its surfaces have come."""
        self._names = [body.scoped_name().get_full() for body in self._axes.bodies()]
        if not self._names or not self._settings.is_discrete():
            return
        self._state = int(plant.DeclareAbstractState(AbstractValue.Make(np.zeros(len(self._names)))))
        move = types.MethodType(_move_surfaces, plant)
        plant.DeclarePeriodicUnrestrictedUpdateEvent(self._settings.time_step, 0.0, move)
        plant.DeclareForcedUnrestrictedUpdateEvent(move)

    def any(self) -> bool:
        """Whether there are any."""
        return bool(self._names)

    def speeds(self, context: Context) -> np.ndarray:
        """Speed of each [m/s]: zero where the surface_speeds port says none.

        Raises:
            RuntimeError: what it says is no finite number.
        """
        i = self._inputs.surface_speeds
        if not self._names or not has_value(context, i):
            return np.zeros(len(self._names))
        bus = context._system._input_port(i).Eval(context)
        return np.array([_speed(bus, name) for name in self._names])

    def displacements(self, context: Context) -> BusValue:
        """How far each has come [m], by the scoped name of the body."""
        if self._settings.is_discrete():
            come = context.get_abstract_state(self._state).get_value() if self._state >= 0 else ()
        else:
            come = context.get_continuous_state().get_misc_continuous_state().CopyToVector()
        bus = BusValue()
        for name, distance in zip(self._names, come):
            bus.Set(name, AbstractValue.Make(float(distance)))
        return bus

    def move(self, context: Context, state: State) -> None:
        """Where surfaces are a time step later."""
        come = state.get_mutable_abstract_state(self._state)
        come.set_value(come.get_value() + self._settings.time_step * self.speeds(context))


def _speed(bus: BusValue, name: str) -> float:
    value = bus.Find(name)
    if value is None:
        return 0.0
    if not isinstance(value, (float, int, np.floating, np.integer)) or not np.isfinite(value):
        raise RuntimeError(
            f"MultibodyPlant: the surface_speeds port gives {name!r} the speed {value!r}; expected is a finite number."
        )
    return float(value)


def _move_surfaces(plant: Any, context: Context, state: State) -> None:
    plant._parts.surface_speeds.move(context, state)
