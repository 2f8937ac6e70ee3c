"""A Panda's commands and status, as vectors and as messages."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, cast

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common.value import AbstractValue
from sheldrake.lcm._messages import lcmt_panda_command, lcmt_panda_status
from sheldrake.systems.framework import BasicVector, EventStatus, LeafSystem
from sheldrake.systems.framework._port_getters import input_port, output_port

if TYPE_CHECKING:
    from collections.abc import Callable

    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._values import DiscreteValues

kPandaArmNumJoints = 7
PandaControlMode = SimpleNamespace(kNone=0, kPosition=1, kVelocity=2, kTorque=4)
"""What a Panda takes for commands; modes are combined by |."""
_ALL_MODES = PandaControlMode.kPosition | PandaControlMode.kVelocity | PandaControlMode.kTorque
_COMMANDS = {
    "position": PandaControlMode.kPosition,
    "velocity": PandaControlMode.kVelocity,
    "torque": PandaControlMode.kTorque,
}


def _checked_mode(control_mode: int) -> int:
    mode = int(control_mode)
    if mode & ~_ALL_MODES:
        raise RuntimeError(f"Invalid control_mode bits set: {mode & ~_ALL_MODES:#x}")
    return mode


@checked
class PandaCommandReceiver(LeafSystem):
    """From command messages to vectors; before the first message, where the arm was, no velocity and no torque.

    Args:
        num_joints: How many joints there are.
        control_mode: Which outputs there are: the sum of some of PandaControlMode.
    """

    def __init__(self, num_joints: int, control_mode: int):
        super().__init__()
        self._n, self._mode = int(num_joints), _checked_mode(control_mode)
        self.DeclareAbstractInputPort("lcmt_panda_command", AbstractValue.Make(lcmt_panda_command()))
        self.DeclareVectorInputPort("position_measured", self._n)
        if self._mode & PandaControlMode.kPosition:
            self.DeclareDiscreteState(1)
            self.DeclareDiscreteState(self._n)
            self.DeclarePerStepDiscreteUpdateEvent(self._latch)
            self.DeclareVectorOutputPort("position", self._n, self._calc_position)
        if self._mode & PandaControlMode.kVelocity:
            self.DeclareVectorOutputPort("velocity", self._n, self._calc_velocity)
        if self._mode & PandaControlMode.kTorque:
            self.DeclareVectorOutputPort("torque", self._n, self._calc_torque)

    def LatchInitialPosition(self, context: Context) -> None:
        """Remembers where the arm is: the commanded position until a message comes.

        Raises:
            RuntimeError: positions are not commanded.
        """
        if not self._mode & PandaControlMode.kPosition:
            raise RuntimeError(f"{self._describe()}: LatchInitialPosition() is for arms under position control.")
        position = self.get_position_measured_input_port().Eval(context)
        context.SetDiscreteState(0, [1.0])
        context.SetDiscreteState(1, position)

    def _latch(self, context: Context, values: DiscreteValues) -> EventStatus:
        if context.get_discrete_state(0)[0]:
            return EventStatus.DidNothing()
        values.set_value(0, [1.0])
        values.set_value(1, self.get_position_measured_input_port().Eval(context))
        return EventStatus.Succeeded()

    def _commanded(self, context: Context, name: str) -> list | None:
        """What the message says; None before the first."""
        message = self.get_message_input_port().Eval(context)
        sizes = message.num_joint_position, message.num_joint_velocity, message.num_joint_torque
        if message.utime == 0 and not any(sizes) and not message.control_mode_expected:
            return None
        if message.control_mode_expected != self._mode:
            raise RuntimeError(
                f"PandaCommandReceiver {self.GetSystemPathname()} has control_mode {self._mode}, but the message "
                f"expects {message.control_mode_expected}."
            )
        values = getattr(message, f"joint_{name}")
        if len(values) != self._n:
            raise RuntimeError(
                f"PandaCommandReceiver {self.GetSystemPathname()} expected {self._n} {name} joints, but received "
                f"{len(values)}."
            )
        return list(values)

    def _calc_position(self, context: Context, output: BasicVector) -> None:
        commanded = self._commanded(context, "position")
        if commanded is not None:
            output.SetFromVector(commanded)
        elif context.get_discrete_state(0)[0]:
            output.SetFromVector(context.get_discrete_state(1).value())
        else:
            output.SetFromVector(self.get_position_measured_input_port().Eval(context))

    def _calc_velocity(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._commanded(context, "velocity") or np.zeros(self._n))

    def _calc_torque(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._commanded(context, "torque") or np.zeros(self._n))

    get_message_input_port = input_port("lcmt_panda_command", "The message.")
    get_position_measured_input_port = input_port("position_measured")
    get_commanded_position_output_port = output_port("position")
    get_commanded_velocity_output_port = output_port("velocity")
    get_commanded_torque_output_port = output_port("torque")


class PandaCommandSender(LeafSystem):
    """From positions, velocities and torques to command messages.

    Args:
        num_joints: How many joints there are.
        control_mode: Which inputs there are: the sum of some of PandaControlMode.
    """

    @checked
    def __init__(self, num_joints: int, control_mode: int):
        super().__init__()
        self._mode = _checked_mode(control_mode)
        for name, bit in _COMMANDS.items():
            if self._mode & bit:
                self.DeclareVectorInputPort(name, int(num_joints))
        model = AbstractValue.Make(lcmt_panda_command())
        self.DeclareAbstractOutputPort("lcmt_panda_command", model.Clone, self._calc)

    def _calc(self, context: Context, output: AbstractValue) -> None:
        message = lcmt_panda_command(utime=int(context.get_time() * 1e6), control_mode_expected=self._mode)
        for name, bit in _COMMANDS.items():
            values = self.GetInputPort(name).Eval(context).tolist() if self._mode & bit else []
            setattr(message, f"num_joint_{name}", len(values))
            setattr(message, f"joint_{name}", values)
        output.set_value(message)

    get_position_input_port = input_port("position")
    get_velocity_input_port = input_port("velocity")
    get_torque_input_port = input_port("torque")


_STATUS = {
    "position_commanded": "joint_position_desired",
    "position_measured": "joint_position",
    "velocity_commanded": "joint_velocity_desired",
    "velocity_measured": "joint_velocity",
    "acceleration_commanded": "joint_acceleration_desired",
    "torque_commanded": "joint_torque_desired",
    "torque_measured": "joint_torque",
    "torque_external": "joint_torque_external",
}
"""The field of each port."""


@checked
class PandaStatusSender(LeafSystem):
    """From what a Panda measures and was commanded to status messages.

    What is left unconnected is zero, and torque_measured as commanded; position_measured and torque_commanded must be
    connected.

    Args:
        num_joints: How many joints there are.
    """

    def __init__(self, num_joints: int = kPandaArmNumJoints):
        super().__init__()
        self._n = int(num_joints)
        for name in _STATUS:
            self.DeclareVectorInputPort(name, self._n)
        model = AbstractValue.Make(lcmt_panda_status())
        self.DeclareAbstractOutputPort("lcmt_panda_status", model.Clone, self._calc)

    def _calc(self, context: Context, output: AbstractValue) -> None:
        message = lcmt_panda_status(utime=int(context.get_time() * 1e6), num_joints=self._n)
        torque = self.GetInputPort("torque_commanded").Eval(context).tolist()
        for name, field in _STATUS.items():
            port = self.GetInputPort(name)
            if port.HasValue(context) or name == "position_measured":
                values = port.Eval(context).tolist()
            else:
                values = torque if name == "torque_measured" else [0.0] * self._n
            setattr(message, field, values)
        output.set_value(message)

    get_position_commanded_input_port = input_port("position_commanded")
    get_position_measured_input_port = input_port("position_measured")
    get_velocity_commanded_input_port = input_port("velocity_commanded")
    get_velocity_measured_input_port = input_port("velocity_measured")
    get_acceleration_commanded_input_port = input_port("acceleration_commanded")
    get_torque_commanded_input_port = input_port("torque_commanded")
    get_torque_measured_input_port = input_port("torque_measured")
    get_torque_external_input_port = input_port("torque_external")


class PandaStatusReceiver(LeafSystem):
    """From status messages to vectors; zero before the first message.

    Args:
        num_joints: How many joints there are.
    """

    @checked
    def __init__(self, num_joints: int = kPandaArmNumJoints):
        super().__init__()
        self._n = int(num_joints)
        self.DeclareAbstractInputPort("lcmt_panda_status", AbstractValue.Make(lcmt_panda_status()))
        for name, field in _STATUS.items():
            self.DeclareVectorOutputPort(name, self._n, self._reader(field))

    def _reader(self, field: str) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            system = cast("PandaStatusReceiver", context._system)
            message = system.get_input_port().Eval(context)
            if message.num_joints not in (0, system._n):
                raise RuntimeError(
                    f"PandaStatusReceiver {system.GetSystemPathname()} expected {system._n} joints, but received "
                    f"{message.num_joints}."
                )
            output.SetFromVector(np.array(getattr(message, field)) if message.num_joints else np.zeros(system._n))

        return calc

    get_position_commanded_output_port = output_port("position_commanded")
    get_position_measured_output_port = output_port("position_measured")
    get_velocity_commanded_output_port = output_port("velocity_commanded")
    get_velocity_measured_output_port = output_port("velocity_measured")
    get_acceleration_commanded_output_port = output_port("acceleration_commanded")
    get_torque_commanded_output_port = output_port("torque_commanded")
    get_torque_measured_output_port = output_port("torque_measured")
    get_torque_external_output_port = output_port("torque_external")
