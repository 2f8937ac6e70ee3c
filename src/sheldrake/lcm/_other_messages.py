"""Messages of Drake's that no system here sends or takes: for programs that talk to others."""

from __future__ import annotations

from typing import ClassVar

from sheldrake.lcm._messages import Message


class lcmt_quaternion(Message):
    """A quaternion."""

    _fields: ClassVar[list[tuple]] = [("w", "double"), ("x", "double"), ("y", "double"), ("z", "double")]


class lcmt_robot_state(Message):
    """Positions of joints, by name [m or rad], at a time [us]."""

    _fields: ClassVar[list[tuple]] = [
        ("utime", "int64_t"),
        ("num_joints", "int16_t"),
        ("joint_name", "string", "num_joints"),
        ("joint_position", "float", "num_joints"),
    ]


class lcmt_robot_plan(Message):
    """States to go through, one after the other."""

    _fields: ClassVar[list[tuple]] = [
        ("utime", "int64_t"),
        ("num_states", "int32_t"),
        ("plan", lcmt_robot_state, "num_states"),
    ]


class lcmt_force_torque(Message):
    """A force [N] and a torque [N m] at a time [us]."""

    _fields: ClassVar[list[tuple]] = [
        ("timestamp", "int64_t"),
        *((name, "double") for name in ("fx", "fy", "fz", "tx", "ty", "tz")),
    ]


class lcmt_drake_signal(Message):
    """A vector with names at a time [ms]."""

    _fields: ClassVar[list[tuple]] = [
        ("dim", "int32_t"),
        ("val", "double", "dim"),
        ("coord", "string", "dim"),
        ("timestamp", "int64_t"),
    ]


class lcmt_acrobot_u(Message):
    """Torque of an acrobot's elbow [N m]."""

    _fields: ClassVar[list[tuple]] = [("timestamp", "int64_t"), ("tau", "double")]


class lcmt_acrobot_x(Message):
    """State of an acrobot [rad, rad/s]."""

    _fields: ClassVar[list[tuple]] = [
        ("timestamp", "int64_t"),
        *((name, "double") for name in ("theta1", "theta1Dot", "theta2", "theta2Dot")),
    ]


class lcmt_acrobot_y(Message):
    """What an acrobot's sensors see: angles [rad] and torque [N m]."""

    _fields: ClassVar[list[tuple]] = [
        ("timestamp", "int64_t"),
        *((name, "double") for name in ("theta1", "theta2", "tau")),
    ]


class lcmt_allegro_command(Message):
    """Positions [rad] and torques [N m] for an Allegro hand."""

    _fields: ClassVar[list[tuple]] = [
        ("utime", "int64_t"),
        ("num_joints", "int32_t"),
        ("joint_position", "double", "num_joints"),
        ("num_torques", "int32_t"),
        ("joint_torque", "double", "num_torques"),
    ]


class lcmt_allegro_status(Message):
    """What an Allegro hand measures and was commanded: positions [rad], velocities [rad/s], torques [N m]."""

    _fields: ClassVar[list[tuple]] = [
        ("utime", "int64_t"),
        ("num_joints", "int32_t"),
        ("joint_position_measured", "double", "num_joints"),
        ("joint_velocity_estimated", "double", "num_joints"),
        ("joint_position_commanded", "double", "num_joints"),
        ("joint_torque_commanded", "double", "num_joints"),
    ]


class lcmt_jaco_command(Message):
    """Positions [rad] and velocities [rad/s] for joints and fingers of a Jaco arm."""

    _fields: ClassVar[list[tuple]] = [
        ("utime", "int64_t"),
        ("num_joints", "int32_t"),
        ("joint_position", "double", "num_joints"),
        ("joint_velocity", "double", "num_joints"),
        ("num_fingers", "int32_t"),
        ("finger_position", "double", "num_fingers"),
        ("finger_velocity", "double", "num_fingers"),
    ]


class lcmt_jaco_status(Message):
    """What a Jaco arm measures: positions [rad], velocities [rad/s], torques [N m] and currents [A]."""

    _fields: ClassVar[list[tuple]] = [
        ("utime", "int64_t"),
        *(
            field
            for part, count in (("joint", "num_joints"), ("finger", "num_fingers"))
            for field in (
                (count, "int32_t"),
                *(
                    (f"{part}_{what}", "double", count)
                    for what in ("position", "velocity", "torque", "torque_external", "current")
                ),
            )
        ),
    ]


class lcmt_iiwa_status_telemetry(Message):
    """Clocks of a computer and an iiwa [us], and how far they are apart."""

    _fields: ClassVar[list[tuple]] = [
        ("host_utime", "int64_t"),
        ("iiwa_utime", "int64_t"),
        ("estimated_dt_host_minus_iiwa", "int64_t"),
    ]


class lcmt_viewer_command(Message):
    """Asks a viewer for something, or answers."""

    STATUS, LOAD_MODEL, LOAD_RENDERER, SHUTDOWN, START_RECORDING, STOP_RECORDING = 0, 1, 2, 3, 4, 5
    LOAD_TERRAIN, SET_TERRAIN_TRANSFORM = 6, 7
    _fields: ClassVar[list[tuple]] = [("command_type", "int8_t"), ("command_data", "string")]


class lcmt_planar_plant_state(Message):
    """The state of a plant [m or rad, m/s or rad/s] at a time [us]."""

    _fields: ClassVar[list[tuple]] = [
        ("utime", "int64_t"),
        ("num_states", "int32_t"),
        ("plant_state", "double", "num_states"),
    ]
