"""Between postures and the poses that global inverse kinematics finds."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sheldrake.common.eigen_geometry import Quaternion
from sheldrake.math import RigidTransform, RotationMatrix
from sheldrake.multibody.inverse_kinematics import _global_joints as joints
from sheldrake.multibody.tree import BodyIndex
from sheldrake.solvers import (
    MathematicalProgram,
    MathematicalProgramResult,
    Solve,
)


class Postures:
    """The part of global inverse kinematics about positions of joints."""

    _plant: Any
    _prog: MathematicalProgram
    _poses: list[Any]
    _inboard: Any
    _lengths: list[Any]

    def _kinematics(self, q: Any) -> list[RigidTransform]:
        """Poses of all bodies but the world."""
        plant, context = self._plant, self._plant.CreateDefaultContext()
        plant.SetPositions(context, np.asarray(q, dtype=float))
        return [plant.EvalBodyPoseInWorld(context, plant.get_body(BodyIndex(i))) for i in range(1, plant.num_bodies())]

    def SetInitialGuess(self, q: Any) -> None:
        """Sets the guess of all variables, the binary ones too, to that of a posture.

        Args:
            q: The posture, shape (nq,).

        Raises:
            RuntimeError: the posture violates a constraint.
        """
        linear = MathematicalProgram()
        linear.AddDecisionVariables(self._prog.decision_variables())
        for binding in (
            *self._prog.linear_constraints(),
            *self._prog.linear_equality_constraints(),
            *self._prog.bounding_box_constraints(),
        ):
            linear.AddConstraint(binding.evaluator(), binding.variables())
        for pose, X_WB in zip(self._poses[1:], self._kinematics(q)):
            self._fix(linear, pose, X_WB)
        result = Solve(linear)
        if not result.is_success():
            raise RuntimeError("GlobalInverseKinematics.SetInitialGuess(): the posture violates a constraint.")
        guess = np.array(result.get_x_val())
        place = self._prog.FindDecisionVariableIndex
        for A, b, error, p in self._lengths:
            guess[place(error)] = np.linalg.norm(A @ result.GetSolution(p) + b)
        for binding in (*self._prog.lorentz_cone_constraints(), *self._prog.rotated_lorentz_cone_constraints()):
            x = guess[[place(v) for v in binding.variables()]]
            if not binding.evaluator().CheckSatisfied(x, 1e-6):
                raise RuntimeError("GlobalInverseKinematics.SetInitialGuess(): the posture violates a constraint.")
        self._prog.SetInitialGuessForAllVariables(guess)

    def ReconstructGeneralizedPositionSolution(self, result: MathematicalProgramResult) -> np.ndarray:
        """Returns the posture whose poses fit those of a solution, shape (nq,).

        Angles are within their limits; rotations of a solution are only nearly rotations, so the fit is not exact.

        Args:
            result: A result of solving the program.
        """
        q, done = np.zeros(self._plant.num_positions()), {0: np.eye(3)}
        for i in range(1, self._plant.num_bodies()):
            self._reconstruct(i, result, q, done)
        return q

    def _reconstruct(self, i: int, result: Any, q: np.ndarray, done: dict[int, np.ndarray]) -> np.ndarray:
        """The rotation of body i, which its joints' positions, put into q, give."""
        if i in done:
            return done[i]
        joint, pose = self._inboard[i], self._poses[i]
        R_WP = self._reconstruct(int(joint.parent_body().index()), result, q, done)
        R_PF, _, R_BM, _ = joints.parts(joint)
        start, R_WB = joint.position_start(), np.array(result.GetSolution(pose.R))
        if joint.type_name() == "weld":
            done[i] = R_WP @ R_PF @ joint.X_FM().rotation().matrix() @ R_BM.T
        elif joint.type_name() == "revolute":
            q[start] = joints.joint_angle(joint, R_WP, R_WB)
            turn = RotationMatrix(_about(joint.revolute_axis(), q[start])).matrix()
            done[i] = R_WP @ R_PF @ turn @ R_BM.T
        else:
            done[i] = joints.nearest_rotation(R_WB)
            q[start : start + 4] = RotationMatrix(R_PF.T @ R_WP.T @ done[i] @ R_BM).ToQuaternion().wxyz()
            q[start + 4 : start + 7] = result.GetSolution(pose.p)
        return done[i]


def _about(axis: Any, angle: float) -> Quaternion:
    return Quaternion(np.append(math.cos(0.5 * angle), math.sin(0.5 * angle) * np.asarray(axis, dtype=float)))
