"""An iiwa's commands and status, as vectors and as messages."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._enums import IndexEnum
from sheldrake.common.value import AbstractValue
from sheldrake.lcm._messages import lcmt_iiwa_command, lcmt_iiwa_status
from sheldrake.systems.framework import BasicVector, EventStatus, LeafSystem
from sheldrake.systems.framework._port_getters import input_port, output_port

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._values import DiscreteValues

kIiwaArmNumJoints = 7
kIiwaLcmStatusPeriod = 0.005


class IiwaControlMode(IndexEnum):
    """What an iiwa takes for commands."""

    kPositionOnly = 0
    kTorqueOnly = 1
    kPositionAndTorque = 2


@checked
def position_enabled(control_mode: IiwaControlMode) -> bool:
    """Whether positions are commanded."""
    return control_mode is not IiwaControlMode.kTorqueOnly


@checked
def torque_enabled(control_mode: IiwaControlMode) -> bool:
    """Whether torques are commanded."""
    return control_mode is not IiwaControlMode.kPositionOnly


@checked
def ParseIiwaControlMode(control_mode: str) -> IiwaControlMode:
    """The mode of this name: "position_only", "torque_only" or "position_and_torque".

    Raises:
        RuntimeError: there is none.
    """
    names = {
        "position_only": IiwaControlMode.kPositionOnly,
        "torque_only": IiwaControlMode.kTorqueOnly,
        "position_and_torque": IiwaControlMode.kPositionAndTorque,
    }
    if control_mode not in names:
        raise RuntimeError(
            f"ParseIiwaControlMode: Invalid control_mode string: {control_mode!r} (valid: {', '.join(names)})"
        )
    return names[control_mode]


def get_iiwa_max_joint_velocities() -> np.ndarray:
    """Fastest velocities of the seven joints [rad/s]."""
    return np.array([1.483529, 1.483529, 1.745329, 1.308996, 2.268928, 2.356194, 2.356194])


class IiwaCommandReceiver(LeafSystem):
    """From command messages to positions and torques; before the first message, where the arm was and no torque.

    Args:
        num_joints: How many joints there are.
        control_mode: Which outputs there are.
    """

    @checked
    def __init__(
        self,
        num_joints: int = kIiwaArmNumJoints,
        control_mode: IiwaControlMode = IiwaControlMode.kPositionAndTorque,
    ):
        super().__init__()
        if num_joints < 1:
            raise RuntimeError(f"IiwaCommandReceiver(): num_joints must be positive, got {num_joints}.")
        self._n = n = num_joints
        self.DeclareAbstractInputPort("lcmt_iiwa_command", AbstractValue.Make(lcmt_iiwa_command()))
        self.DeclareVectorInputPort("position_measured", n)
        self.DeclareDiscreteState(n)  # where the arm was at first, and whether that is known
        self.DeclareDiscreteState(1)
        self.DeclarePerStepDiscreteUpdateEvent(self._hold)
        self.DeclareForcedDiscreteUpdateEvent(self._hold)
        self.DeclareInitializationDiscreteUpdateEvent(self._hold)
        if position_enabled(control_mode):
            self.DeclareVectorOutputPort("position", n, self._calc_position)
        if torque_enabled(control_mode):
            self.DeclareVectorOutputPort("torque", n, self._calc_torque)
        self.DeclareVectorOutputPort("time", 1, self._calc_time)

    def _measured(self, context: Context) -> np.ndarray:
        port = self.get_position_measured_input_port()
        return port.Eval(context) if port.HasValue(context) else np.zeros(self._n)

    def _hold(self, context: Context, values: DiscreteValues) -> EventStatus:
        if context.get_discrete_state(1)[0]:
            return EventStatus.DidNothing()
        values.set_value(0, self._measured(context))
        values.set_value(1, [1.0])
        return EventStatus.Succeeded()

    def _message(self, context: Context) -> Any:
        message = self.get_message_input_port().Eval(context)
        return None if message.utime == 0 and not message.num_joints and not message.num_torques else message

    def _calc_position(self, context: Context, output: BasicVector) -> None:
        message = self._message(context)
        if message is not None:
            output.SetFromVector(self._sized("joint_position", message.joint_position))
        elif context.get_discrete_state(1)[0]:
            output.SetFromVector(context.get_discrete_state(0).value())
        else:
            output.SetFromVector(self._measured(context))

    def _calc_torque(self, context: Context, output: BasicVector) -> None:
        message = self._message(context)
        torque = [] if message is None else message.joint_torque
        output.SetFromVector(self._sized("joint_torque", torque) if len(torque) else np.zeros(self._n))

    def _sized(self, name: str, values: Sequence[float]) -> list:
        if len(values) != self._n:
            raise RuntimeError(
                f"{self._describe()}: {name} of the command has {len(values)} elements; the arm has {self._n} joints."
            )
        return list(values)

    def _calc_time(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([self.get_message_input_port().Eval(context).utime / 1e6])

    get_message_input_port = input_port("lcmt_iiwa_command", "The message.")
    get_position_measured_input_port = input_port(
        "position_measured", "Positions of the arm [rad]; zero if unconnected."
    )
    get_commanded_position_output_port = output_port("position", "Commanded positions [rad].")
    get_commanded_torque_output_port = output_port("torque", "Commanded torques [N m].")
    get_time_output_port = output_port("time", "The message's time [s].")


@checked
class IiwaCommandSender(LeafSystem):
    """From positions and torques to command messages.

    Args:
        num_joints: How many joints there are.
        control_mode: Which inputs there are.
    """

    def __init__(
        self,
        num_joints: int = kIiwaArmNumJoints,
        control_mode: IiwaControlMode = IiwaControlMode.kPositionAndTorque,
    ):
        super().__init__()
        self._position = self._torque = None
        if position_enabled(control_mode):
            self._position = self.DeclareVectorInputPort("position", num_joints).get_index()
        if torque_enabled(control_mode):
            self._torque = self.DeclareVectorInputPort("torque", num_joints).get_index()
        self._time = self.DeclareVectorInputPort("time", 1).get_index()
        self.DeclareAbstractOutputPort("lcmt_iiwa_command", lambda: AbstractValue.Make(lcmt_iiwa_command()), self._calc)

    def _values(self, context: Context, index: Any) -> list:
        if index is None or not self.get_input_port(index).HasValue(context):
            return []
        return self.get_input_port(index).Eval(context).tolist()

    def _calc(self, context: Context, output: AbstractValue) -> None:
        time = self._values(context, self._time) or [context.get_time()]
        if self._position is not None:
            self.get_input_port(self._position).Eval(context)  # it must be connected
        position, torque = self._values(context, self._position), self._values(context, self._torque)
        message = lcmt_iiwa_command(
            utime=int(time[0] * 1e6),
            num_joints=len(position),
            joint_position=position,
            num_torques=len(torque),
            joint_torque=torque,
        )
        output.set_value(message)

    get_position_input_port = input_port("position", "Positions [rad].")
    get_torque_input_port = input_port("torque", "Torques [N m]; may be left unconnected if positions are commanded.")
    get_time_input_port = input_port("time", "The message's time [s]; the context's if unconnected.")


_STATUS = (
    "position_commanded",
    "position_measured",
    "velocity_estimated",
    "torque_commanded",
    "torque_measured",
    "torque_external",
)


class IiwaStatusSender(LeafSystem):
    """From what an arm measures and was commanded to status messages.

    Input ports: position_commanded, position_measured [rad]; velocity_estimated [rad/s], zero if unconnected;
    torque_commanded, torque_measured (as commanded if unconnected), torque_external (zero if unconnected) [N m];
    time_measured [s], the context's time if unconnected.

    Args:
        num_joints: How many joints there are.
    """

    @checked
    def __init__(self, num_joints: int = kIiwaArmNumJoints):
        super().__init__()
        self._n = num_joints
        for name in _STATUS:
            self.DeclareVectorInputPort(name, num_joints)
        self.DeclareVectorInputPort("time_measured", 1)
        self.DeclareAbstractOutputPort("lcmt_iiwa_status", lambda: AbstractValue.Make(lcmt_iiwa_status()), self._calc)

    def _or(self, context: Context, name: str, default: Any) -> list:
        port = self.GetInputPort(name)
        return port.Eval(context).tolist() if port.HasValue(context) else list(default)

    def _calc(self, context: Context, output: AbstractValue) -> None:
        zeros = [0.0] * self._n
        commanded = self.GetInputPort("torque_commanded").Eval(context).tolist()
        message = lcmt_iiwa_status(
            utime=int(self._or(context, "time_measured", [context.get_time()])[0] * 1e6),
            num_joints=self._n,
            joint_position_measured=self.GetInputPort("position_measured").Eval(context).tolist(),
            joint_velocity_estimated=self._or(context, "velocity_estimated", zeros),
            joint_position_commanded=self.GetInputPort("position_commanded").Eval(context).tolist(),
            joint_position_ipo=zeros,
            joint_torque_measured=self._or(context, "torque_measured", commanded),
            joint_torque_commanded=commanded,
            joint_torque_external=self._or(context, "torque_external", zeros),
        )
        output.set_value(message)

    get_time_measured_input_port = input_port("time_measured")
    get_position_commanded_input_port = input_port("position_commanded")
    get_position_measured_input_port = input_port("position_measured")
    get_velocity_estimated_input_port = input_port("velocity_estimated")
    get_torque_commanded_input_port = input_port("torque_commanded")
    get_torque_measured_input_port = input_port("torque_measured")
    get_torque_external_input_port = input_port("torque_external")


class IiwaStatusReceiver(LeafSystem):
    """From status messages to vectors; zero before the first message.

    Args:
        num_joints: How many joints there are.
    """

    @checked
    def __init__(self, num_joints: int = kIiwaArmNumJoints):
        super().__init__()
        self.DeclareAbstractInputPort("lcmt_iiwa_status", AbstractValue.Make(lcmt_iiwa_status()))
        self.DeclareVectorOutputPort("time_measured", 1, self._calc_time)
        for name in _STATUS:
            self.DeclareVectorOutputPort(name, num_joints, _reader(f"joint_{name}"))

    def _calc_time(self, context: Context, output: BasicVector) -> None:
        message = self.get_input_port().Eval(context)
        output.SetFromVector([message.utime / 1e6 if message.num_joints else 0.0])

    get_time_measured_output_port = output_port("time_measured")
    get_position_commanded_output_port = output_port("position_commanded")
    get_position_measured_output_port = output_port("position_measured")
    get_velocity_estimated_output_port = output_port("velocity_estimated")
    get_torque_commanded_output_port = output_port("torque_commanded")
    get_torque_measured_output_port = output_port("torque_measured")
    get_torque_external_output_port = output_port("torque_external")


def _reader(field: str) -> Callable[[Context, BasicVector], None]:
    def calc(context: Context, output: BasicVector) -> None:
        values = getattr(context._system.get_input_port().Eval(context), field)
        output.SetFromVector(np.array(values) if len(values) else np.zeros(output.size()))

    return calc
