"""Actuators and their gains.

Gains make an actuator a spring and damper on its joint, solved for implicitly in the discrete step.
"""

from __future__ import annotations

import copy
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._options import Options
from sheldrake.common._scalars import writable
from sheldrake.multibody.tree._element import NamedElement, finite, vector
from sheldrake.multibody.tree._index import JointActuatorIndex
from sheldrake.multibody.tree._joint import Joint

if TYPE_CHECKING:
    from sheldrake.common._types import Scalars
    from sheldrake.systems.framework import Context


class PdControllerGains(Options):
    """Gains of a joint's position controller.

    Args:
        p: Effort for a distance from the wanted position [N m/rad or N/m].
        d: Effort for a distance from the wanted velocity [N m s/rad or N s/m].
    """

    p: float = 0.0
    d: float = 0.0


class JointActuator(NamedElement):
    """Applies an effort to a joint of one degree of freedom. Made by `MultibodyPlant.AddJointActuator`."""

    _index_type = JointActuatorIndex

    @checked
    def __init__(self, name: str, joint: Joint, effort_limit: float = np.inf):
        super().__init__(name, joint.model_instance())
        if not effort_limit > 0.0:
            raise RuntimeError(f"JointActuator effort limit must be strictly positive (not {effort_limit})")
        self._joint, self._effort_limit = joint, float(effort_limit)
        self._rotor_inertia, self._gear_ratio = 0.0, 1.0
        self._gains: PdControllerGains | None = None
        self._input_start = -1

    def joint(self) -> Any:  # of whatever type: callers know which
        """The joint it acts on."""
        return self._joint

    def effort_limit(self) -> float:
        """Largest effort [N m or N]."""
        return self._effort_limit

    @checked
    def set_effort_limit(self, effort_limit: float) -> None:
        """Sets the largest effort [N m or N].

        Raises:
            RuntimeError: it is not positive.
        """
        if not effort_limit > 0.0:
            raise RuntimeError(f"JointActuator effort limit must be strictly positive (not {effort_limit})")
        self._effort_limit = float(effort_limit)
        if self._owner is not None:
            self._owner.actuator_changed(self)

    # --- rotor

    def default_rotor_inertia(self) -> float:
        """Inertia of the rotor about its axis [kg m²]."""
        return self._rotor_inertia

    @checked
    def set_default_rotor_inertia(self, rotor_inertia: float) -> None:
        """Sets the rotor inertia of a default context [kg m²]."""
        if not rotor_inertia >= 0.0:
            raise RuntimeError(f"JointActuator rotor inertia must be nonnegative (not {rotor_inertia})")
        self._rotor_inertia = float(rotor_inertia)

    def default_gear_ratio(self) -> float:
        """Turns of the rotor for one of the joint (or [rad/m] for a prismatic joint)."""
        return self._gear_ratio

    @checked
    def set_default_gear_ratio(self, gear_ratio: float) -> None:
        """Sets the gear ratio of a default context.

        Raises:
            RuntimeError: it is not finite.
        """
        self._gear_ratio = finite("JointActuator.set_default_gear_ratio", "gear_ratio", float(gear_ratio))

    def default_reflected_inertia(self) -> float:
        """Rotor inertia as the joint feels it [kg m² or kg]."""
        return self._gear_ratio * self._gear_ratio * self._rotor_inertia

    def rotor_inertia(self, context: Context) -> float:
        """Rotor inertia as the context has it [kg m²]."""
        return self._finalized("rotor_inertia").contexts.numbers(context, self._group).item(0)

    def gear_ratio(self, context: Context) -> float:
        """Gear ratio as the context has it."""
        return self._finalized("gear_ratio").contexts.numbers(context, self._group + 1).item(0)

    @checked
    def SetRotorInertia(self, context: Context, rotor_inertia: float) -> None:
        """Changes the rotor inertia in a context [kg m²]."""
        self._finalized("SetRotorInertia").contexts.write_numbers(context, self._group, [rotor_inertia])

    @checked
    def SetGearRatio(self, context: Context, gear_ratio: float) -> None:
        """Changes the gear ratio in a context."""
        self._finalized("SetGearRatio").contexts.write_numbers(context, self._group + 1, [gear_ratio])

    def calc_reflected_inertia(self, context: Context) -> float:
        """Rotor inertia as the joint feels it, in a context [kg m² or kg]."""
        gear = self.gear_ratio(context)
        return gear * gear * self.rotor_inertia(context)

    # --- inputs

    def input_start(self) -> int:
        """Where its efforts start in the plant's actuation vector."""
        self._finalized("input_start")
        return self._input_start

    def num_inputs(self) -> int:
        """Number of its efforts."""
        return self._joint.num_velocities()

    def get_actuation_vector(self, u: Scalars) -> np.ndarray:
        """Its part of the plant's actuation vector u."""
        owner = self._finalized("get_actuation_vector")
        u = vector("get_actuation_vector", "u", u, owner.plant.num_actuated_dofs())
        return u[self._input_start : self._input_start + self.num_inputs()]

    def set_actuation_vector(self, u_actuator: Scalars, u: np.ndarray) -> None:
        """Writes its part of the plant's actuation vector u, in place.

        Raises:
            RuntimeError: either has another size.
        """
        call, owner = "set_actuation_vector", self._finalized("set_actuation_vector")
        u_actuator = vector(call, "u_actuator", u_actuator, self.num_inputs())
        vector(call, "u", writable(call, "u", u), owner.plant.num_actuated_dofs())
        part = u[self._input_start : self._input_start + self.num_inputs()]
        part[:] = np.reshape(u_actuator, part.shape)

    # --- position control

    @checked
    def set_controller_gains(self, gains: PdControllerGains) -> None:
        """Gives it a position controller, which the discrete update treats implicitly; takes it away if both are zero.

        Raises:
            RuntimeError: a gain is negative or not finite.
        """
        if not (0.0 <= gains.p < math.inf and 0.0 <= gains.d < math.inf):
            raise RuntimeError(
                f"JointActuator.set_controller_gains(): the gains of actuator {self._name!r} must be finite and not "
                f"negative, not p = {gains.p} and d = {gains.d}."
            )
        self._gains = copy.copy(gains) if gains.p or gains.d else None
        if self._owner is not None:
            self._owner.actuator_changed(self)

    def has_controller(self) -> bool:
        """Whether it has a position controller."""
        return self._gains is not None

    def get_controller_gains(self) -> PdControllerGains:
        """The gains of its position controller.

        Raises:
            RuntimeError: it has none.
        """
        if self._gains is None:
            raise RuntimeError(f"JointActuator.get_controller_gains(): actuator {self._name!r} has no controller.")
        return copy.copy(self._gains)
