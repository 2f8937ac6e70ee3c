"""Settings of drivers."""

from __future__ import annotations

import copy
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np


class DriverConfig:
    """Settings with defaults, given by name; derived classes list `_defaults`: name, type, default."""

    _defaults: ClassVar[tuple[tuple[str, Any, Any], ...]] = ()
    __fields__: ClassVar[tuple] = ()

    def __init_subclass__(cls) -> None:
        cls.__fields__ = tuple(SimpleNamespace(name=name, type=kind) for name, kind, _ in cls._defaults)

    def __init__(self, **kwargs: Any):
        for name, _, default in self._defaults:
            setattr(self, name, copy.copy(kwargs.pop(name, default)))
        if kwargs:
            names = ", ".join(f.name for f in self.__fields__) or "none"
            raise AttributeError(f"{type(self).__name__} has no field {', '.join(kwargs)}; it has {names}.")

    def __repr__(self) -> str:
        fields = ", ".join(f"{f.name}={getattr(self, f.name)!r}" for f in self.__fields__)
        return f"{type(self).__name__}({fields})"

    def __copy__(self) -> Any:
        return type(self)(**{f.name: getattr(self, f.name) for f in self.__fields__})

    def __deepcopy__(self, memo: dict) -> Any:
        return self.__copy__()


class IiwaDriver(DriverConfig):
    """How a KUKA iiwa is driven.

    Attributes:
        hand_model_name: Name of the model of its hand, which the controller knows of; "" without one.
        ext_joint_filter_tau: Time constant of the low-pass filter of external torques [s].
        desired_kp_gains: Proportional gains [1/s²], shape (n,); None: those of the iiwa.
        control_mode: "position_and_torque", "position_only" or "torque_only".
        arm_child_frame_name: Frame of the arm that is welded to its parent; None: what the directives welded.
        gripper_parent_frame_name: Frame of the arm that the hand is welded to; None: what the directives say.
        lcm_bus: Name of the connection.
        lcm_status_period: How often the status goes out, and commands are looked at [s].
    """

    hand_model_name: str
    ext_joint_filter_tau: float
    desired_kp_gains: np.ndarray | None
    control_mode: str
    arm_child_frame_name: str | None
    gripper_parent_frame_name: str | None
    lcm_bus: str
    lcm_status_period: float

    _defaults = (
        ("hand_model_name", str, ""),
        ("ext_joint_filter_tau", float, 0.01),
        ("desired_kp_gains", np.ndarray | None, None),
        ("control_mode", str, "position_and_torque"),
        ("arm_child_frame_name", str | None, None),
        ("gripper_parent_frame_name", str | None, None),
        ("lcm_bus", str, "default"),
        ("lcm_status_period", float, 0.005),
    )


class SchunkWsgDriver(DriverConfig):
    """How a Schunk WSG gripper is driven.

    Attributes:
        pid_gains: Proportional, integral and derivative gain, shape (3,).
        lcm_bus: Name of the connection.
    """

    pid_gains: np.ndarray
    lcm_bus: str

    _defaults = (("pid_gains", np.ndarray, np.array([7200.0, 0.0, 5.0])), ("lcm_bus", str, "default"))


class ZeroForceDriver(DriverConfig):
    """Drives all actuators of a model with zero."""
