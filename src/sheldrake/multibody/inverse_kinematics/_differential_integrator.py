"""A system that follows a wanted pose by differential inverse kinematics."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._overloads import incompatible
from sheldrake.common.value import Value
from sheldrake.math import RigidTransform
from sheldrake.multibody.inverse_kinematics._differential import (
    DifferentialInverseKinematicsParameters,
    DifferentialInverseKinematicsStatus,
    DoDifferentialInverseKinematics,
)
from sheldrake.systems.framework import LeafSystem

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.systems.framework import BasicVector, Context, DiscreteValues

_log = logging.getLogger("drake")


class DifferentialInverseKinematicsIntegrator(LeafSystem):
    """Integrates the velocities that move frame E to the wanted pose; its output are joint positions.

    Input ports: `X_AE_desired` (RigidTransform), `X_WE_desired` (as it was called of old; read if that one has no
    value), `robot_state` (positions and velocities, optional) and `use_robot_state` (bool, optional): if true, each
    step starts from the state of the robot instead of the last output. Output port: `joint_positions`.

    Called as `(robot, [frame_A,] frame_E, time_step, parameters, robot_context=None,
    log_only_when_result_state_changes=True)`; frame A is the world if absent.
    """

    _NAMES = ("robot", "frame_A", "frame_E", "time_step", "parameters")

    def __init__(self, *args: Any, **kwargs: Any):
        LeafSystem.__init__(self)
        values = self._read(args, kwargs)
        robot = self._robot = values["robot"]
        self._A, self._E = values["frame_A"], values["frame_E"]
        if self._A is self._E:
            raise RuntimeError("DifferentialInverseKinematicsIntegrator: frame_A and frame_E are the same.")
        self._time_step = float(values["time_step"])
        self._parameters: DifferentialInverseKinematicsParameters = values["parameters"]
        self._parameters.set_time_step(self._time_step)
        given = values["robot_context"]
        self._robot_context = (given if given is not None else robot.CreateDefaultContext()).Clone()
        nq = robot.num_positions()
        self._X_AE_port = self.DeclareAbstractInputPort("X_AE_desired", Value(RigidTransform()))
        self._X_WE_port = self.DeclareAbstractInputPort("X_WE_desired", Value(RigidTransform()))
        self._state_port = self.DeclareVectorInputPort("robot_state", nq + robot.num_velocities())
        self._use_port = self.DeclareAbstractInputPort("use_robot_state", Value(False))
        self.DeclareDiscreteState(np.array(robot.GetPositions(self._robot_context)))
        self._remembers = bool(values["log_only_when_result_state_changes"])
        if self._remembers:
            self.DeclareDiscreteState(np.array([float(DifferentialInverseKinematicsStatus.kSolutionFound.value)]))
        self.DeclareVectorOutputPort(
            "joint_positions", nq, self._positions_out, {self.discrete_state_ticket(self._group(0))}
        )
        self.DeclarePeriodicDiscreteUpdateEvent(self._time_step, 0.0, self._integrate)
        self.DeclareInitializationDiscreteUpdateEvent(self._initialize)

    def _group(self, i: int) -> Any:
        from sheldrake.systems.framework import DiscreteStateIndex

        return DiscreteStateIndex(i)

    def _read(self, args: tuple, kwargs: dict) -> dict[str, Any]:
        names: tuple[str, ...] = self._NAMES
        if "frame_A" not in kwargs and (len(args) < 3 or isinstance(args[2], (int, float))):
            names = tuple(n for n in names if n != "frame_A")
        optional = {"robot_context": None, "log_only_when_result_state_changes": True}
        values = {**optional, **kwargs, **dict(zip((*names, *optional), args))}
        if not set(names) <= set(values) or set(values) - set(names) - set(optional):
            accepted = ["(robot, [frame_A,] frame_E, time_step, parameters, robot_context, ...)"]
            raise incompatible(type(self).__name__, accepted, args, kwargs, constructor=True)
        values.setdefault("frame_A", values["robot"].world_frame())
        return values

    def get_parameters(self) -> DifferentialInverseKinematicsParameters:
        """Returns the parameters."""
        return self._parameters

    def get_mutable_parameters(self) -> DifferentialInverseKinematicsParameters:
        """Returns the parameters, to be changed."""
        return self._parameters

    def SetPositions(self, context: Context, positions: ArrayLike) -> None:
        """Sets the positions to start from, shape (nq,)."""
        context.SetDiscreteState(0, np.asarray(positions, dtype=float))

    def ForwardKinematics(self, context: Context) -> RigidTransform:
        """Returns the pose of E in A at the current positions."""
        self._update_robot(context)
        return self._robot.CalcRelativeTransform(self._robot_context, self._A, self._E)

    def _uses_robot(self, context: Context) -> bool:
        return self._use_port.HasValue(context) and bool(self._use_port.Eval(context))

    def _update_robot(self, context: Context) -> np.ndarray:
        """Puts the positions to start from into the robot's context and returns them."""
        nq = self._robot.num_positions()
        if self._uses_robot(context):
            self._robot.SetPositionsAndVelocities(self._robot_context, self._state_port.Eval(context))
            return np.array(self._robot.GetPositions(self._robot_context))
        q = np.array(context.get_discrete_state(0).value())
        self._robot.SetPositions(self._robot_context, q)
        self._robot.SetVelocities(self._robot_context, np.zeros(self._robot.num_velocities()))
        return q[:nq]

    def _X_AE(self, context: Context) -> RigidTransform:
        """The desired pose; the robot's context has the positions to start from."""
        if self._X_AE_port.HasValue(context) or not self._X_WE_port.HasValue(context):
            return self._X_AE_port.Eval(context)
        X_AW = self._robot.CalcRelativeTransform(self._robot_context, self._A, self._robot.world_frame())
        return X_AW @ self._X_WE_port.Eval(context)

    def _integrate(self, context: Context, discrete_state: DiscreteValues) -> None:
        q = self._update_robot(context)
        found = DoDifferentialInverseKinematics(
            self._robot, self._robot_context, self._X_AE(context), self._A, self._E, self._parameters
        )
        Status = DifferentialInverseKinematicsStatus
        last = Status.kSolutionFound.value
        if self._remembers:
            last = int(context.get_discrete_state(1).value()[0])
            discrete_state.get_mutable_vector(1).SetFromVector([float(found.status.value)])
        if found.status is not Status.kSolutionFound and (not self._remembers or last != found.status.value):
            _log.warning("Differential IK could not follow the wanted pose: %s.", found.status.name[1:])
        if found.joint_velocities is not None:
            qdot = self._robot.MapVelocityToQDot(self._robot_context, found.joint_velocities)
            q = q + self._time_step * np.asarray(qdot)
        discrete_state.get_mutable_vector(0).SetFromVector(q)

    def _initialize(self, context: Context, discrete_state: DiscreteValues) -> None:
        if self._state_port.HasValue(context):
            q = self._state_port.Eval(context)[: self._robot.num_positions()]
            discrete_state.get_mutable_vector(0).SetFromVector(np.array(q))

    def _positions_out(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(np.array(context.get_discrete_state(0).value()))
