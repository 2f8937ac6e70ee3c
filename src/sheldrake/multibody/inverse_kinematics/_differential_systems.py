"""Systems that follow wanted poses by differential inverse kinematics: step by step of a recipe, or one frame alone."""

from __future__ import annotations

import logging
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import incompatible
from sheldrake.common.value import Value
from sheldrake.math import RigidTransform
from sheldrake.multibody.inverse_kinematics import _differential_ingredients as ingredients
from sheldrake.multibody.inverse_kinematics._differential import (
    DifferentialInverseKinematicsParameters,
    DifferentialInverseKinematicsStatus,
    DoDifferentialInverseKinematics,
    pose_difference,
)
from sheldrake.multibody.math import SpatialVelocity
from sheldrake.multibody.tree import JacobianWrtVariable
from sheldrake.planning import DofMask
from sheldrake.solvers import MathematicalProgram, Solve
from sheldrake.systems.framework import BusValue, Diagram, DiagramBuilder, LeafSystem
from sheldrake.systems.primitives import DiscreteTimeIntegrator, Selector, SelectorParams, WrapToSystem

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import Frame
    from sheldrake.planning import CollisionChecker
    from sheldrake.systems.framework import BasicVector, Context, DiscreteValues, InputPort, OutputPort

_log = logging.getLogger("drake")


@checked
class DifferentialInverseKinematicsSystem(LeafSystem):
    """Gives velocities that move goal frames as desired, by solving the program of a recipe.

    Input ports: `position` and `nominal_posture`, of all dofs; and one of `desired_cartesian_poses` and
    `desired_cartesian_velocities`, a `BusValue` with a RigidTransform or a SpatialVelocity by the name of each goal
    frame (such as `arm::hand`), in the task frame T. Output port: `commanded_velocity`, of the active dofs; zero,
    with a warning, where the program has no solution.

    Args:
        recipe: Costs and constraints.
        task_frame: Name of frame T.
        collision_checker: The robot and its surroundings.
        active_dof: Which velocities are commanded.
        time_step: Time step [s].
        K_VX: Velocities are this times the way to the desired pose, per time step.
        Vd_TG_limit: Bounds of velocities that come from poses, element by element [rad/s, m/s].

    Raises:
        RuntimeError: the recipe is None, a number is out of range, there is no such frame, or velocities of the plant
            are not the derivatives of its positions.
    """

    Ingredient = ingredients.Ingredient
    Recipe = ingredients.Recipe
    LeastSquaresCost = ingredients.LeastSquaresCost
    JointCenteringCost = ingredients.JointCenteringCost
    CartesianPositionLimitConstraint = ingredients.CartesianPositionLimitConstraint
    CartesianVelocityLimitConstraint = ingredients.CartesianVelocityLimitConstraint
    CollisionConstraint = ingredients.CollisionConstraint
    JointVelocityLimitConstraint = ingredients.JointVelocityLimitConstraint

    def __init__(
        self,
        recipe: ingredients.Recipe | None,
        task_frame: str,
        collision_checker: CollisionChecker | None,
        active_dof: DofMask,
        time_step: float,
        K_VX: float,
        Vd_TG_limit: SpatialVelocity,
    ):
        LeafSystem.__init__(self)
        name = "DifferentialInverseKinematicsSystem()"
        if recipe is None or collision_checker is None:
            raise RuntimeError(f"{name}: {'recipe' if recipe is None else 'collision_checker'} is None.")
        plant = collision_checker.plant()
        for word, value, good in (
            ("time_step", time_step, 0.0 < time_step < math.inf),
            ("K_VX", K_VX, K_VX > 0.0),
            ("Vd_TG_limit", Vd_TG_limit, bool(np.all(Vd_TG_limit.get_coeffs() >= 0.0))),
        ):
            if not good:
                sign = "not be negative" if word == "Vd_TG_limit" else "be positive"
                raise RuntimeError(f"{name}: {word} must {sign}, got {value}.")
        if active_dof.size() != plant.num_positions():
            raise RuntimeError(
                f"{name}: active_dof has size {active_dof.size()}, the plant has {plant.num_positions()} positions."
            )
        self._active_dof, self._active = active_dof, active_dof.GetSelectedToFullIndex()
        self._recipe, self._checker, self._time_step = recipe, collision_checker, float(time_step)
        self._K_VX, self._limit = float(K_VX), Vd_TG_limit
        self._task_frame = _frame(plant, task_frame)
        self._checker_context = collision_checker.MakeStandaloneModelContext()
        nq = plant.num_positions()
        self._position = self.DeclareVectorInputPort("position", nq)
        self._nominal = self.DeclareVectorInputPort("nominal_posture", nq)
        self._poses = self.DeclareAbstractInputPort("desired_cartesian_poses", Value(BusValue()))
        self._velocities = self.DeclareAbstractInputPort("desired_cartesian_velocities", Value(BusValue()))
        self._commanded = self.DeclareVectorOutputPort("commanded_velocity", active_dof.count(), self._command)

    def plant(self) -> MultibodyPlant:
        """Returns the plant of the collision checker."""
        return self._checker.plant()

    def collision_checker(self) -> CollisionChecker:
        """Returns the collision checker."""
        return self._checker

    def active_dof(self) -> DofMask:
        """Returns which velocities are commanded."""
        return self._active_dof

    def time_step(self) -> float:
        """Returns the time step [s]."""
        return self._time_step

    def task_frame(self) -> Frame:
        """Returns frame T."""
        return self._task_frame

    def recipe(self) -> ingredients.Recipe:
        """Returns the costs and constraints."""
        return self._recipe

    def K_VX(self) -> float:
        """Returns the factor from poses to velocities."""
        return self._K_VX

    def Vd_TG_limit(self) -> SpatialVelocity:
        """Returns the bounds of velocities that come from poses [rad/s, m/s]."""
        return self._limit

    def get_input_port_position(self) -> InputPort:
        """Returns the input port of positions."""
        return self._position

    def get_input_port_nominal_posture(self) -> InputPort:
        """Returns the input port of positions that free dofs are drawn to."""
        return self._nominal

    def get_input_port_desired_cartesian_poses(self) -> InputPort:
        """Returns the input port of desired poses."""
        return self._poses

    def get_input_port_desired_cartesian_velocities(self) -> InputPort:
        """Returns the input port of desired velocities."""
        return self._velocities

    def get_output_port_commanded_velocity(self) -> OutputPort:
        """Returns the output port of velocities of the active dofs."""
        return self._commanded

    def _command(self, context: Context, output: BasicVector) -> None:
        step = self._make_step(context)
        for i in range(self._recipe.num_ingredients()):
            self._recipe.ingredient(i)._add_to(step)
        result = Solve(step.prog)
        v_next = result.GetSolution(step.v_next)
        if not result.is_success():
            violated = ", ".join(result.GetInfeasibleConstraintNames(step.prog))
            _log.warning("Differential IK found no velocity and gives zero; violated constraints: %s", violated)
            v_next = np.zeros(step.v_next.size)
        output.SetFromVector(v_next)

    def _make_step(self, context: Context) -> ingredients.Step:
        q, nominal = self._position.Eval(context), self._nominal.Eval(context)
        self._checker.UpdateContextPositions(self._checker_context, q)
        plant, plant_context, T = self.plant(), self._checker_context.plant_context(), self._task_frame
        frames, X_TGs, Vd_TGs = self._goals(context, plant_context)
        jacobians = [
            plant.CalcJacobianSpatialVelocity(plant_context, JacobianWrtVariable.kV, G, np.zeros(3), T, T)
            for G in frames
        ]
        prog = MathematicalProgram()
        return ingredients.Step(
            prog=prog,
            v_next=prog.NewContinuousVariables(len(self._active), "v_next"),
            dt=self._time_step,
            q=q,
            nominal_posture=nominal,
            active=self._active,
            active_dof=self._active_dof,
            collision_checker=self._checker,
            checker_context=self._checker_context,
            frames=frames,
            p_TGs=[X_TG.translation() for X_TG in X_TGs],
            Vd_TGs=np.concatenate(Vd_TGs),
            Jv_TGs=np.vstack(jacobians)[:, self._active],
        )

    def _goals(self, context: Context, plant_context: Context) -> tuple[list, list[RigidTransform], list[np.ndarray]]:
        """The goal frames, where they are, and their desired velocities."""
        ports = [port for port in (self._poses, self._velocities) if port.HasValue(context)]
        if len(ports) != 1:
            raise RuntimeError(
                f"{type(self).__name__}: exactly one of the input ports desired_cartesian_poses and "
                f"desired_cartesian_velocities must be connected, found {len(ports)}."
            )
        bus, plant = ports[0].Eval(context), self.plant()
        frames = [_frame(plant, name) for name in bus]
        if not frames:
            raise RuntimeError(f"{type(self).__name__}: the input {ports[0].get_name()} names no goal frame.")
        X_TGs = [plant.CalcRelativeTransform(plant_context, self._task_frame, G) for G in frames]
        kind = RigidTransform if ports[0] is self._poses else SpatialVelocity
        for name in bus:
            if not isinstance(bus[name], kind):
                found = type(bus[name]).__name__
                raise RuntimeError(
                    f"{type(self).__name__}: {name!r} of {ports[0].get_name()} is a {found}, expected {kind.__name__}."
                )
        desired = [bus[name] for name in bus]
        if kind is SpatialVelocity:
            return frames, X_TGs, [V.get_coeffs() for V in desired]
        limit, rate = self._limit.get_coeffs(), self._K_VX / self._time_step
        ways = [pose_difference(X_TG, wanted) for X_TG, wanted in zip(X_TGs, desired)]
        return frames, X_TGs, [np.clip(rate * way, -limit, limit) for way in ways]


def _frame(plant: MultibodyPlant, name: str) -> Frame:
    model, _, frame = str(name).rpartition("::")
    return plant.GetFrameByName(frame, plant.GetModelInstanceByName(model)) if model else plant.GetFrameByName(frame)


@checked
class DifferentialInverseKinematicsIntegrator(LeafSystem):
    """Integrates the velocities that move frame E to the wanted pose; its output are joint positions.

    Input ports: `X_AE_desired` (RigidTransform), `X_WE_desired` (as it was called of old; read if that one has no
    value), `robot_state` (positions and velocities, optional) and `use_robot_state` (bool, optional): if true, each
    step starts from the state of the robot instead of the last output. Output port: `joint_positions`.

    Called as `(robot, [frame_A,] frame_E, time_step, parameters, robot_context=None,
    log_only_when_result_state_changes=True)`; frame A is the world if absent. Of the robot's context the parameters
    count; positions start from zero, or where `SetPositions` or the port `robot_state` says.
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
        self._robot_context = robot.CreateDefaultContext()
        if values["robot_context"] is not None:
            self._robot_context.SetTimeStateAndParametersFrom(values["robot_context"])
        nq = robot.num_positions()
        self._X_AE_port = self.DeclareAbstractInputPort("X_AE_desired", Value(RigidTransform()))
        self._X_WE_port = self.DeclareAbstractInputPort("X_WE_desired", Value(RigidTransform()))
        self._state_port = self.DeclareVectorInputPort("robot_state", nq + robot.num_velocities())
        self._use_port = self.DeclareAbstractInputPort("use_robot_state", Value(False))
        self.DeclareDiscreteState(nq)
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
        if "frame_A" not in kwargs and (len(args) < 3 or isinstance(args[2], (int, float, np.number))):
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


class _PositionIntegrator(DiscreteTimeIntegrator):
    """An integrator whose value is unknown until it is set."""

    def _set_default_context(self, context: Context) -> None:
        self.set_integral_value(context, np.full(self.get_output_port(0).size(), math.nan))


def _all_positions(active: DofMask) -> SelectorParams:
    """Positions of active dofs from input 0, of the others from input 1: the estimated state."""
    pick, place = SelectorParams.OutputSelection, active.GetFullToSelectedIndex()
    picks = [
        pick(input_port_index=1, input_offset=i) if k is None else pick(input_port_index=0, input_offset=k)
        for i, k in enumerate(place)
    ]
    sizes = (active.count(), 2 * active.size())
    return SelectorParams(
        inputs=[SelectorParams.InputPortParams(size=size) for size in sizes],
        outputs=[SelectorParams.OutputPortParams(selections=picks)],
    )


@checked
class DifferentialInverseKinematicsController(Diagram):
    """Integrates the velocities of a `DifferentialInverseKinematicsSystem` to positions that a robot can be sent.

    Input ports: `estimated_state` (positions and velocities of all dofs; those of passive dofs are used),
    `desired_poses` (BusValue of RigidTransform) and `nominal_posture`. Output ports: `commanded_position` and
    `commanded_velocity` of the active dofs. The integral starts as nan: see `set_initial_position`.

    Args:
        differential_inverse_kinematics: The system; it becomes a part of this diagram.
        planar_rotation_dof_indices: Which commanded positions are wrapped to +-pi.
    """

    def __init__(
        self,
        differential_inverse_kinematics: DifferentialInverseKinematicsSystem,
        planar_rotation_dof_indices: list[int],
    ):
        Diagram.__init__(self)
        ik = self._ik = differential_inverse_kinematics
        builder = DiagramBuilder()
        builder.AddSystem(ik)
        active, n = ik.active_dof(), ik.active_dof().count()
        self._integrator = builder.AddSystem(_PositionIntegrator(n, ik.time_step()))
        merge = builder.AddSystem(Selector(_all_positions(active)))
        wrap = builder.AddSystem(WrapToSystem(n))
        for index in planar_rotation_dof_indices:
            wrap.set_interval(index, -math.pi, math.pi)
        builder.Connect(ik.get_output_port_commanded_velocity(), self._integrator.get_input_port(0))
        builder.Connect(self._integrator.get_output_port(0), merge.get_input_port(0))
        builder.Connect(merge.get_output_port(0), ik.get_input_port_position())
        builder.Connect(self._integrator.get_output_port(0), wrap.get_input_port(0))
        builder.ExportInput(merge.get_input_port(1), "estimated_state")
        builder.ExportInput(ik.get_input_port_desired_cartesian_poses(), "desired_poses")
        builder.ExportInput(ik.get_input_port_nominal_posture(), "nominal_posture")
        builder.ExportOutput(wrap.get_output_port(0), "commanded_position")
        builder.ExportOutput(ik.get_output_port_commanded_velocity(), "commanded_velocity")
        builder.BuildInto(self)

    def differential_inverse_kinematics(self) -> DifferentialInverseKinematicsSystem:
        """Returns the system that finds velocities."""
        return self._ik

    def get_mutable_differential_inverse_kinematics(self) -> DifferentialInverseKinematicsSystem:
        """Returns the system that finds velocities, to be changed."""
        return self._ik

    def set_initial_position(self, context: Context, value: ArrayLike) -> None:
        """Sets the positions to start from.

        Args:
            context: This diagram's context.
            value: Positions of all dofs, shape (nq,); those of passive dofs are not used.

        Raises:
            RuntimeError: the size is another.
        """
        q, active = np.array(value, dtype=float).ravel(), self._ik.active_dof()
        if q.size != active.size():
            raise RuntimeError(f"set_initial_position(): expected {active.size()} positions, got {q.size}.")
        mine = self._integrator.GetMyMutableContextFromRoot(context)
        self._integrator.set_integral_value(mine, q[active.GetSelectedToFullIndex()])
