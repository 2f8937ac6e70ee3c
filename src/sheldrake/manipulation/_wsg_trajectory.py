"""A Schunk WSG gripper moved along trajectories, by commands that are messages."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.manipulation._wsg import SchunkWsgCommandReceiver
from sheldrake.systems.controllers import PidController
from sheldrake.systems.framework import Diagram, DiagramBuilder, InputPort, LeafSystem, OutputPort
from sheldrake.systems.primitives import MatrixGain
from sheldrake.trajectories import PiecewisePolynomial

PERIOD = 0.05
"""How often a new target is looked for [s]."""
MAX_SPEED, MAX_ACCELERATION = 0.42, 5.0
"""What the gripper's hardware can do [m/s, m/s^2]."""
NEW_TARGET = 1e-4
"""A target that differs by less is the same [m]."""

_TARGET, _START, _FROM, _FORCE = range(4)


def path(start: float, target: float) -> PiecewisePolynomial:
    """Position and velocity over time from rest to rest: faster, at most speed if the way is long enough, and slower.

    Between its knots the position is linear, as Drake's is.
    """
    ramp_time = MAX_SPEED / MAX_ACCELERATION
    ramp = 0.5 * MAX_SPEED * ramp_time
    way, direction = abs(target - start), np.sign(target - start)
    if way == 0.0:
        return PiecewisePolynomial.FirstOrderHold([0.0, 1.0], np.array([[start, start], [0.0, 0.0]]))
    if way < 2.0 * ramp:
        speed, half = MAX_SPEED * 0.5 * way / ramp, way / MAX_SPEED
        times, along, speeds = [0.0, half, 2.0 * half], [0.0, 0.5 * way, way], [0.0, speed, 0.0]
    else:
        cruise = (way - 2.0 * ramp) / MAX_SPEED
        times = list(np.cumsum([0.0, ramp_time, cruise, ramp_time]))
        along, speeds = [0.0, ramp, way - ramp, way], [0.0, MAX_SPEED, MAX_SPEED, 0.0]
        if cruise == 0.0:
            times, along, speeds = ([values[k] for k in (0, 1, 3)] for values in (times, along, speeds))
    knots = np.array([start + direction * np.array(along), direction * np.array(speeds)])
    return PiecewisePolynomial.FirstOrderHold(times, knots)


class SchunkWsgTrajectoryGenerator(LeafSystem):
    """From the desired distance of the fingers [m] to its negative and rate now, on the way there.

    Input ports: desired_position, shape (1,); force_limit [N], shape (1,); u2, the fingers' state. Output ports: y0,
    position and velocity; y1, the force limit.

    Args:
        input_size: Size of the state.
        position_index: Which element of the state is the position of the actuated finger.
        use_force_limit: Whether there are ports for the force limit.
    """

    def __init__(self, input_size: int, position_index: int, use_force_limit: bool = True):
        super().__init__()
        self._position_index, self._use_force_limit = int(position_index), bool(use_force_limit)
        self.DeclareVectorInputPort("desired_position", 1)
        if use_force_limit:
            self.DeclareVectorInputPort("force_limit", 1)
        self._state_port = self.DeclareVectorInputPort("u2", int(input_size)).get_index()
        self.DeclareVectorOutputPort("y0", 2, self._calc_target, {self.time_ticket(), self.xd_ticket()})
        if use_force_limit:
            self.DeclareVectorOutputPort("y1", 1, self._calc_force, {self.xd_ticket()})
        self.DeclareDiscreteState(4)
        self.DeclarePeriodicDiscreteUpdateEvent(PERIOD, 0.0, self._look_for_target)

    def _look_for_target(self, context: Any, values: Any) -> None:
        target = -self.get_desired_position_input_port().Eval(context)[0]
        force = self.get_force_limit_input_port().Eval(context)[0] if self._use_force_limit else np.nan
        state = context.get_discrete_state_vector().value()
        if abs(state[_TARGET] - target) > NEW_TARGET:
            position = 2.0 * self.get_state_input_port().Eval(context)[self._position_index]
            values.set_value([target, context.get_time(), position, force])
        else:
            values.set_value([*state[:_FORCE], force])

    def _calc_target(self, context: Any, output: Any) -> None:
        state = context.get_discrete_state_vector().value()
        elapsed = context.get_time() - state[_START]
        output.SetFromVector(path(state[_FROM], state[_TARGET]).value(elapsed)[:, 0])

    def _calc_force(self, context: Any, output: Any) -> None:
        output.SetFromVector([context.get_discrete_state_vector()[_FORCE]])

    def get_desired_position_input_port(self) -> InputPort:
        """The input for the desired distance [m]."""
        return self.GetInputPort("desired_position")

    def get_force_limit_input_port(self) -> InputPort:
        """The input for the most force [N]."""
        return self.GetInputPort("force_limit")

    def get_state_input_port(self) -> InputPort:
        """The input for the fingers' state."""
        return self.get_input_port(self._state_port)

    def get_target_output_port(self) -> OutputPort:
        """The output with position and velocity [m, m/s]."""
        return self.GetOutputPort("y0")

    def get_max_force_output_port(self) -> OutputPort:
        """The output with the most force [N]."""
        return self.GetOutputPort("y1")


class _ForcesOfFingers(LeafSystem):
    """From the forces on the fingers' mean and on their distance, which is limited, to the forces on each [N]."""

    def __init__(self) -> None:
        super().__init__()
        self.DeclareVectorInputPort("mean_and_grip", 2)
        self.DeclareVectorInputPort("max_force", 1)
        self.DeclareVectorOutputPort("force", 2, self._calc)

    def _calc(self, context: Any, output: Any) -> None:
        mean, grip = self.get_input_port(0).Eval(context)
        limit = 0.5 * self.get_input_port(1).Eval(context)[0]
        grip = min(max(grip, -limit), limit)
        output.SetFromVector([0.5 * mean + grip, 0.5 * mean - grip])


_MEAN_AND_GRIP = np.array([[0.5, 0.5, 0.0, 0.0], [1.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.5, 0.5], [0.0, 0.0, 1.0, -1.0]])
"""From the fingers' state to mean, negative distance and their rates."""
_DESIRED = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
"""The mean stays in the middle; the target is of the negative distance."""


class SchunkWsgController(Diagram):
    """Forces on the fingers of a gripper that follows command messages: a PID controller, and a limit of the grip.

    Input ports: state of the fingers, shape (4,); command_message. Output port: force on the fingers [N], shape (2,).

    Args:
        kp: Proportional gain [N/m].
        ki: Integral gain [N/(m s)].
        kd: Derivative gain [N s/m].
    """

    def __init__(self, kp: float = 2000.0, ki: float = 0.0, kd: float = 5.0):
        super().__init__()
        builder = DiagramBuilder()
        path_ = builder.AddNamedSystem("trajectory_generator", SchunkWsgTrajectoryGenerator(4, 0))
        command = builder.AddNamedSystem("command_receiver", SchunkWsgCommandReceiver())
        desired = builder.AddNamedSystem("desired", MatrixGain(D=_DESIRED))
        gains = ([k, k] for k in (kp, ki, kd))
        pid = builder.AddNamedSystem("pid", PidController(_MEAN_AND_GRIP, np.eye(2), *gains))
        force = builder.AddNamedSystem("force", _ForcesOfFingers())
        builder.Connect(command.get_position_output_port(), path_.get_desired_position_input_port())
        builder.Connect(command.get_force_limit_output_port(), path_.get_force_limit_input_port())
        builder.Connect(path_.get_target_output_port(), desired.get_input_port())
        builder.Connect(desired.get_output_port(), pid.get_input_port_desired_state())
        builder.Connect(pid.get_output_port(), force.get_input_port(0))
        builder.Connect(path_.get_max_force_output_port(), force.get_input_port(1))
        builder.ExportInput(path_.get_state_input_port(), "state")
        builder.ConnectInput("state", pid.get_input_port_estimated_state())
        builder.ExportInput(command.get_input_port(), "command_message")
        builder.ExportOutput(force.get_output_port(), "force")
        builder.BuildInto(self)
