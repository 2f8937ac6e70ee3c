"""A Schunk WSG gripper: two fingers on one axis, seen as their distance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common.value import AbstractValue
from sheldrake.lcm._messages import lcmt_schunk_wsg_command, lcmt_schunk_wsg_status
from sheldrake.manipulation._kernels import fingers
from sheldrake.systems.controllers import PidController
from sheldrake.systems.framework import (
    BasicVector,
    Diagram,
    DiagramBuilder,
    InputPort,
    LeafSystem,
    VectorSystem,
)
from sheldrake.systems.framework._port_getters import input_port, output_port
from sheldrake.systems.primitives import MatrixGain, StateInterpolatorWithDiscreteDerivative
from sheldrake.trajectories import PiecewisePolynomial

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._engine.memory import RootView
    from sheldrake.systems.framework._values import DiscreteValues

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


@checked
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

    def _look_for_target(self, context: Context, values: DiscreteValues) -> None:
        target = -self.get_desired_position_input_port().Eval(context)[0]
        force = self.get_force_limit_input_port().Eval(context)[0] if self._use_force_limit else np.nan
        state = context.get_discrete_state_vector().value()
        if abs(state[_TARGET] - target) > NEW_TARGET:
            position = 2.0 * self.get_state_input_port().Eval(context)[self._position_index]
            values.set_value([target, context.get_time(), position, force])
        else:
            values.set_value([*state[:_FORCE], force])

    def _calc_target(self, context: Context, output: BasicVector) -> None:
        state = context.get_discrete_state_vector().value()
        elapsed = context.get_time() - state[_START]
        output.SetFromVector(path(state[_FROM], state[_TARGET]).value(elapsed)[:, 0])

    def _calc_force(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([context.get_discrete_state_vector()[_FORCE]])

    get_desired_position_input_port = input_port("desired_position", "The input for the desired distance [m].")
    get_force_limit_input_port = input_port("force_limit", "The input for the most force [N].")

    def get_state_input_port(self) -> InputPort:
        """The input for the fingers' state."""
        return self.get_input_port(self._state_port)

    get_target_output_port = output_port("y0", "The output with position and velocity [m, m/s].")
    get_max_force_output_port = output_port("y1", "The output with the most force [N].")


class _ForcesOfFingers(LeafSystem):
    """From the forces on the fingers' mean and on their distance, which is limited, to the forces on each [N]."""

    def __init__(self) -> None:
        super().__init__()
        self.DeclareVectorInputPort("mean_and_grip", 2)
        self.DeclareVectorInputPort("max_force", 1)
        self.DeclareVectorOutputPort("force", 2, self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        mean, grip = self.get_input_port(0).Eval(context)
        limit = 0.5 * self.get_input_port(1).Eval(context)[0]
        grip = min(max(grip, -limit), limit)
        output.SetFromVector([0.5 * mean + grip, 0.5 * mean - grip])


_MEAN_AND_GRIP = np.array([[0.5, 0.5, 0.0, 0.0], [1.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.5, 0.5], [0.0, 0.0, 1.0, -1.0]])
"""From the fingers' state to mean, negative distance and their rates."""
_DESIRED = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
"""The mean stays in the middle; the target is of the negative distance."""


@checked
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


OPEN_POSITION = 0.0550667
"""How far from the middle a finger is when the gripper is open [m]."""


def GetSchunkWsgOpenPosition() -> np.ndarray:
    """Positions of the two fingers when the gripper is open [m], shape (2,)."""
    return np.array([-OPEN_POSITION, OPEN_POSITION])


def MakeMultibodyStateToWsgStateSystem() -> MatrixGain:
    """From the fingers' state (q0, q1, v0, v1) to the gripper's: distance [m] and its rate [m/s]."""
    return MatrixGain(D=np.array([[-1.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 1.0]]))


class _ForceOfFingers(VectorSystem):
    def __init__(self) -> None:
        super().__init__(2, 1, True)

    def DoCalcVectorOutput(self, context: Context, u: np.ndarray, x: np.ndarray, y: np.ndarray) -> None:
        y[0] = abs(u[0] - u[1])


def MakeMultibodyForceToWsgForceSystem() -> VectorSystem:
    """From the forces on the two fingers [N] to the gripper's, their difference without sign."""
    return _ForceOfFingers()


class _PdController(LeafSystem):
    """Holds the fingers' distance by a force that is limited, and their middle by a virtual spring."""

    def __init__(self, kp: float, kd: float, kp_constraint: float, kd_constraint: float, limit: float):
        super().__init__()
        if limit <= 0:
            raise RuntimeError(f"SchunkWsgPositionController(): default_force_limit must be positive, it is {limit} N.")
        self._springs = fingers.Springs.of(kp=kp, kd=kd, kp_middle=kp_constraint, kd_middle=kd_constraint)
        self.DeclareVectorInputPort("desired_state", 2)
        self.DeclareVectorInputPort("force_limit", BasicVector([limit]))
        self._inputs[1].optional = True
        self.DeclareVectorInputPort("state", 4)
        self.DeclareVectorOutputPort("generalized_force", 2, fingers.forces_on_fingers)
        self.DeclareVectorOutputPort("grip_force", 1, fingers.grip_force)

    def _kernel_models(self, root: RootView) -> dict[str, np.ndarray]:
        return {"spring_model": self._springs}

    def _is_generic(self) -> bool:
        return False  # as Drake's

    def _explain_status(self, status: int, context: Context) -> Exception:
        limit = self.get_input_port(1).Eval(context)[0]
        return RuntimeError(f"{self._describe()}: the force limit must be positive, it is {limit} N.")


@checked
class SchunkWsgPositionController(Diagram):
    """Holds the distance of a gripper's fingers.

    Input ports: desired_position [m], shape (1,); force_limit [N], shape (1,), may be left unconnected; state of the
    fingers, shape (4,). Output ports: generalized_force on the fingers [N], shape (2,); grip_force [N], shape (1,).

    Args:
        time_step: Period at which the desired position's rate is computed [s].
        kp_command: Stiffness of the distance [N/m].
        kd_command: Damping of the distance [N s/m].
        kp_constraint: Stiffness of the middle [N/m].
        kd_constraint: Damping of the middle [N s/m].
        default_force_limit: Most force where the port is unconnected [N].
    """

    def __init__(
        self,
        time_step: float = 0.05,
        kp_command: float = 200.0,
        kd_command: float = 5.0,
        kp_constraint: float = 2000.0,
        kd_constraint: float = 5.0,
        default_force_limit: float = 40.0,
    ):
        super().__init__()
        builder = DiagramBuilder()
        gains = kp_command, kd_command, kp_constraint, kd_constraint
        pd = builder.AddNamedSystem("wsg_controller", _PdController(*gains, default_force_limit))
        rate = builder.AddSystem(StateInterpolatorWithDiscreteDerivative(1, time_step))
        builder.Connect(rate.get_output_port(), pd.get_input_port(0))
        builder.ExportInput(rate.get_input_port(), "desired_position")
        builder.ExportInput(pd.get_input_port(1), "force_limit")
        builder.ExportInput(pd.get_input_port(2), "state")
        builder.ExportOutput(pd.get_output_port(0), "generalized_force")
        builder.ExportOutput(pd.get_output_port(1), "grip_force")
        builder.BuildInto(self)

    get_desired_position_input_port = input_port(0, "The input for the desired distance [m].")
    get_force_limit_input_port = input_port(1, "The input for the most force [N].")
    get_state_input_port = input_port(2, "The input for the fingers' state.")
    get_generalized_force_output_port = output_port(0, "The output with the forces on the fingers [N].")
    get_grip_force_output_port = output_port(1, "The output with the force between the fingers [N].")


class SchunkWsgCommandReceiver(LeafSystem):
    """From command messages to the desired distance [m] and the most force [N].

    Args:
        initial_position: Before the first message [m].
        initial_force: Before the first message [N].
    """

    @checked
    def __init__(self, initial_position: float = 0.02, initial_force: float = 40.0):
        super().__init__()
        self._initial = initial_position, initial_force
        self.DeclareAbstractInputPort("command_message", AbstractValue.Make(lcmt_schunk_wsg_command()))
        self.DeclareVectorOutputPort("position", 1, self._calc_position)
        self.DeclareVectorOutputPort("force_limit", 1, self._calc_force)

    def _command(self, context: Context) -> tuple[float, float]:
        """Distance [m] and force [N] asked for. A message of zeros is what a subscriber gives before the first one."""
        message = self.get_input_port().Eval(context)
        if message.utime == 0 and message.target_position_mm == 0.0 and message.force == 0.0:
            return self._initial
        position = message.target_position_mm / 1e3
        return 0.0 if np.isnan(position) else position, message.force

    def _calc_position(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([self._command(context)[0]])

    def _calc_force(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([self._command(context)[1]])

    get_position_output_port = output_port(0, "The output with the desired distance [m].")
    get_force_limit_output_port = output_port(1, "The output with the most force [N].")


class SchunkWsgCommandSender(LeafSystem):
    """From the desired distance [m] and the most force [N] to command messages.

    Args:
        default_force_limit: Where the port is unconnected [N].
    """

    @checked
    def __init__(self, default_force_limit: float = 40.0):
        super().__init__()
        self._limit = default_force_limit
        self.DeclareVectorInputPort("position", 1)
        self.DeclareVectorInputPort("force_limit", 1)
        self.DeclareAbstractOutputPort(
            "lcmt_schunk_wsg_command", lambda: AbstractValue.Make(lcmt_schunk_wsg_command()), self._calc
        )

    def _calc(self, context: Context, output: AbstractValue) -> None:
        limit = self.get_force_limit_input_port()
        force = limit.Eval(context)[0] if limit.HasValue(context) else self._limit
        position = self.get_position_input_port().Eval(context)[0]
        time = int(context.get_time() * 1e6)
        output.set_value(lcmt_schunk_wsg_command(utime=time, target_position_mm=position * 1e3, force=float(force)))

    get_position_input_port = input_port(0, "The input for the desired distance [m].")
    get_force_limit_input_port = input_port(1, "The input for the most force [N].")
    get_command_output_port = output_port(0, "The output with the message.")


class SchunkWsgStatusReceiver(LeafSystem):
    """From status messages to the distance of the fingers with its rate [m, m/s], and their force [N]."""

    def __init__(self) -> None:
        super().__init__()
        self.DeclareAbstractInputPort("lcmt_schunk_wsg_status", AbstractValue.Make(lcmt_schunk_wsg_status()))
        self.DeclareVectorOutputPort("state", 2, self._calc_state)
        self.DeclareVectorOutputPort("force", 1, self._calc_force)

    def _calc_state(self, context: Context, output: BasicVector) -> None:
        message = self.get_input_port().Eval(context)
        output.SetFromVector([message.actual_position_mm / 1e3, message.actual_speed_mm_per_s / 1e3])

    def _calc_force(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([self.get_input_port().Eval(context).actual_force])

    get_status_input_port = input_port(0, "The input for the message.")
    get_state_output_port = output_port(0, "The output with distance and rate [m, m/s].")
    get_force_output_port = output_port(1, "The output with the force [N].")


class SchunkWsgStatusSender(LeafSystem):
    """From the distance of the fingers with its rate [m, m/s], and their force [N], to status messages."""

    def __init__(self) -> None:
        super().__init__()
        self.DeclareVectorInputPort("u0", 2)
        self.DeclareVectorInputPort("u1", 1)
        self.DeclareAbstractOutputPort("y0", lambda: AbstractValue.Make(lcmt_schunk_wsg_status()), self._calc)

    def _calc(self, context: Context, output: AbstractValue) -> None:
        position, speed = self.get_state_input_port().Eval(context)
        force = self.get_force_input_port()
        message = lcmt_schunk_wsg_status(
            utime=int(context.get_time() * 1e6),
            actual_position_mm=position * 1e3,
            actual_speed_mm_per_s=speed * 1e3,
            actual_force=float(force.Eval(context)[0]) if force.HasValue(context) else 0.0,
        )
        output.set_value(message)

    get_state_input_port = input_port(0, "The input for distance and rate [m, m/s].")
    get_force_input_port = input_port(1, "The input for the force [N].")
