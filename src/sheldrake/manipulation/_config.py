"""Settings of drivers."""

from __future__ import annotations

import numpy as np

from sheldrake.common._options import Options, Vector3


class IiwaDriver(Options):
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

    hand_model_name: str = ""
    ext_joint_filter_tau: float = 0.01
    desired_kp_gains: np.ndarray | None = None
    control_mode: str = "position_and_torque"
    arm_child_frame_name: str | None = None
    gripper_parent_frame_name: str | None = None
    lcm_bus: str = "default"
    lcm_status_period: float = 0.005


class SchunkWsgDriver(Options):
    """How a Schunk WSG gripper is driven.

    Attributes:
        pid_gains: Proportional, integral and derivative gain, shape (3,).
        lcm_bus: Name of the connection.
    """

    pid_gains: Vector3 = np.array([7200.0, 0.0, 5.0])
    lcm_bus: str = "default"


class ZeroForceDriver(Options):
    """Drives all actuators of a model with zero."""
