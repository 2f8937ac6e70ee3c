"""A system that follows goal frames by a program that the user composes."""

from __future__ import annotations

import logging
import math
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common.value import Value
from sheldrake.math import RigidTransform
from sheldrake.multibody.inverse_kinematics import _differential_ingredients as ingredients
from sheldrake.multibody.inverse_kinematics._differential import pose_difference
from sheldrake.multibody.math import SpatialVelocity
from sheldrake.multibody.tree import JacobianWrtVariable
from sheldrake.planning import DofMask
from sheldrake.solvers import MathematicalProgram, Solve
from sheldrake.systems.framework import BusValue, LeafSystem

if TYPE_CHECKING:
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import Frame
    from sheldrake.planning import CollisionChecker
    from sheldrake.systems.framework import BasicVector, Context, InputPort, OutputPort

_log = logging.getLogger("drake")


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
        recipe: ingredients.Recipe,
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
