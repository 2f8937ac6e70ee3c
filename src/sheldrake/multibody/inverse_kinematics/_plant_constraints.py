"""What a plant itself asks of its positions: limits, unit quaternions, and its kinematic constraints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.math import RigidTransform, RotationMatrix
from sheldrake.multibody.inverse_kinematics._orientation import OrientationConstraint
from sheldrake.multibody.inverse_kinematics._position import PointToPointDistanceConstraint, PositionConstraint
from sheldrake.multibody.plant._parts import parts_of
from sheldrake.multibody.tree import QuaternionFloatingJoint
from sheldrake.solvers import Constraint, MathematicalProgram, _arrays
from sheldrake.solvers._functions.bindings import as_kind
from sheldrake.solvers._functions.evaluators import EvaluatorBase

if TYPE_CHECKING:
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import Joint
    from sheldrake.solvers._arrays import VariablesLike
    from sheldrake.systems.framework import Context


_ONE = np.ones(1)
_ONE.setflags(write=False)


class UnitQuaternionConstraint(Constraint):
    """The square of the length of four variables is one."""

    def __init__(self) -> None:
        self._set_sizes(1, 4)
        self._own_bounds(_ONE, _ONE)

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return np.array([x @ x])

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        return 2.0 * x.reshape(1, 4)

    def _eval_symbols(self, x: np.ndarray) -> np.ndarray:
        total = x[0] * x[0]
        for v in x[1:]:
            total = total + v * v
        out = np.empty(1, dtype=object)
        out[0] = total
        return out

    _display = EvaluatorBase._display


def _joints(plant: MultibodyPlant) -> list:
    return list(parts_of(plant).elements.joints)


def _has_quaternion(joint: Joint) -> bool:
    return isinstance(joint, QuaternionFloatingJoint)


def _add_unit_quaternions(
    plant: MultibodyPlant, q: np.ndarray, prog: MathematicalProgram, context: Context | None, describe: bool = True
) -> tuple[list, list]:
    """Adds the constraints of joints that are not locked; returns them and the places of the first elements."""
    joints = [joint for joint in _joints(plant) if _has_quaternion(joint)]
    if context is not None and joints and parts_of(plant).contexts.any_locked(context):
        joints = [joint for joint in joints if not joint.is_locked(context)]
    if not joints:
        return [], []
    bindings, starts = [], [joint.position_start() for joint in joints]
    vars = [q[start : start + 4] for start in starts]
    for joint, its in zip(joints, vars):
        constraint = UnitQuaternionConstraint()
        bindings.append(prog.AddConstraint(constraint, its))
        if describe:
            constraint.set_description(f"Unit quaternion constraint for joint {joint.name()}")
    some = np.concatenate(vars)
    guess = np.reshape(prog.GetInitialGuess(some), (-1, 4))
    unknown = np.isnan(guess).any(axis=1)
    if unknown.any():
        guess[unknown] = 1.0, 0.0, 0.0, 0.0
        prog.SetInitialGuess(some, guess.ravel())
    return bindings, starts


@checked
def AddUnitQuaternionConstraintOnPlant(plant: MultibodyPlant, q_vars: VariablesLike, prog: MathematicalProgram) -> list:
    """Adds that the quaternions of a plant have length one, with elements from -1 to 1, and returns the constraints.

    Where there is no initial guess, it becomes (1, 0, 0, 0).

    Args:
        plant: The plant.
        q_vars: Variables of its positions, shape (nq,).
        prog: The program.
    """
    q = _arrays.variable_vector(q_vars)
    bindings, starts = _add_unit_quaternions(plant, q, prog, None, describe=False)
    out = []
    for binding, start in zip(bindings, starts):
        out += [binding, prog.AddBoundingBoxConstraint(-1.0, 1.0, q[start : start + 4])]
    return [as_kind(Constraint, added) for added in out]


def _limits(plant: MultibodyPlant, context: Context | None, starts: list[int]) -> tuple[np.ndarray, np.ndarray]:
    lower, upper = plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits()
    for start in starts:
        lower[start : start + 4] = np.maximum(lower[start : start + 4], -1.0)
        upper[start : start + 4] = np.minimum(upper[start : start + 4], 1.0)
    if context is not None and parts_of(plant).contexts.any_locked(context):
        positions = plant.GetPositions(context)
        for joint in _joints(plant):
            if joint.num_positions() and joint.is_locked(context):
                at = slice(joint.position_start(), joint.position_start() + joint.num_positions())
                lower[at] = upper[at] = positions[at]
                if _has_quaternion(joint):
                    quaternion = slice(at.start, at.start + 4)
                    lower[quaternion] = upper[quaternion] = positions[quaternion] / np.linalg.norm(
                        positions[quaternion]
                    )
    return lower, upper


def add_limits_and_quaternions(
    plant: MultibodyPlant, q: np.ndarray, prog: MathematicalProgram, context: Context | None, limits: bool
) -> list:
    """Adds unit quaternions, and limits (with joints that are locked) if wanted; returns the constraints."""
    out, starts = _add_unit_quaternions(plant, q, prog, context if limits else None)
    if limits:
        box = prog.AddBoundingBoxConstraint(*_limits(plant, context, starts), q)
        box.evaluator().set_description("Joint limits")
        out.append(box)
    return out


@checked
def AddMultibodyPlantConstraints(
    plant: MultibodyPlant, q: VariablesLike, prog: MathematicalProgram, plant_context: Context | None = None
) -> list:
    """Adds limits, locked joints, unit quaternions and the kinematic constraints of a plant; returns the constraints.

    Args:
        plant: The plant.
        q: Variables of its positions, shape (nq,).
        prog: The program.
        plant_context: Says which joints are locked; where positions are put.

    Raises:
        RuntimeError: there is no context, but a distance, ball or weld constraint that needs one.
    """
    q = _arrays.variable_vector(q)
    out = add_limits_and_quaternions(plant, q, prog, plant_context, True)
    for record in parts_of(plant).elements.constraints.values():
        out += _of_record(plant, record, q, prog, plant_context)
    return [as_kind(Constraint, added) for added in out]


def _of_record(
    plant: MultibodyPlant, record: Any, q: np.ndarray, prog: MathematicalProgram, context: Context | None
) -> list:
    numbers = record.numbers
    if record.kind == "coupler":
        q0, q1 = q[record.A.position_start()], q[record.B.position_start()]
        binding = prog.AddLinearEqualityConstraint(q0 - numbers[0] * q1 == numbers[1])
        joints = f"joint {int(record.A.index())} and joint {int(record.B.index())}"
        binding.evaluator().set_description(f"Coupler constraint for {joints}")
        return [binding]
    if context is None:
        raise RuntimeError(
            f"AddMultibodyPlantConstraints(): the plant has a {record.kind} constraint, which needs a plant_context."
        )
    A, B = record.A.body_frame(), record.B.body_frame()
    found: list[Constraint] = []
    if record.kind == "distance":
        d = numbers[6]
        found.append(PointToPointDistanceConstraint(plant, A, numbers[:3], B, numbers[3:6], d, d, context))
    elif record.kind == "ball":
        p_AP = np.array(numbers[:3])
        found.append(PositionConstraint(plant, A, p_AP, p_AP, B, numbers[3:6], context))
    else:
        half = len(numbers) // 2
        X_AP, X_BQ = (_pose(n) for n in (numbers[:half], numbers[half:]))
        p_AP = X_AP.translation()
        found.append(PositionConstraint(plant, A, p_AP, p_AP, B, X_BQ.translation(), context))
        found.append(OrientationConstraint(plant, A, X_AP.rotation(), B, X_BQ.rotation(), 0.0, context))
    out = []
    for constraint in found:
        bodies = f"body {int(record.A.index())} and body {int(record.B.index())}"
        kind = record.kind.capitalize()
        if record.kind == "weld":
            kind += " orientation" if isinstance(constraint, OrientationConstraint) else " position"
        constraint.set_description(f"{kind} constraint between {bodies}")
        out.append(prog.AddConstraint(constraint, q))
    return out


def _pose(numbers: list[float]) -> RigidTransform:
    """A pose from the numbers that a plant keeps of it."""
    M = np.array(numbers, dtype=float)
    return RigidTransform(RotationMatrix(M[:9].reshape(3, 3)), M[9:12])
