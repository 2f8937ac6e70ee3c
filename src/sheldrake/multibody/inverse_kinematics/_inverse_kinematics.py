"""InverseKinematics: a program on the positions of a plant."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sheldrake.common._checked import checked
from sheldrake.common._kinds import flag, instance_of
from sheldrake.common._overloads import overload, overloaded
from sheldrake.multibody.inverse_kinematics import _distance as distance
from sheldrake.multibody.inverse_kinematics import _orientation as orientation
from sheldrake.multibody.inverse_kinematics import _position as position
from sheldrake.multibody.inverse_kinematics._kinematic import FRAME, PLANT, POINT, POSE
from sheldrake.multibody.inverse_kinematics._plant_constraints import add_limits_and_quaternions
from sheldrake.solvers import MathematicalProgram
from sheldrake.systems.framework import Context

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike

    from sheldrake.math import RigidTransform, RotationMatrix
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import Frame
    from sheldrake.solvers import Binding
    from sheldrake.solvers._functions.evaluators import Constraint, Cost


@checked
class InverseKinematics:
    """Positions of a plant as decision variables, and methods that add what they should satisfy.

    Called as `(plant, with_joint_limits=True)` or `(plant, plant_context, with_joint_limits=True)`. Constraints on
    distances between geometries need a context that is part of that of a diagram with a SceneGraph; joints that are
    locked in it stay where they are. Solving changes the positions in the context.
    """

    @overloaded(
        overload(plant=PLANT, plant_context=(instance_of(Context), None), with_joint_limits=(flag, True)),
        overload(
            lambda self, plant, limits: self.__init__(plant, None, limits), plant=PLANT, with_joint_limits=(flag, True)
        ),
    )
    def __init__(self, plant: MultibodyPlant, context: Context, limits: bool):
        self._plant = plant
        self._own_context = None if context is not None else plant.CreateDefaultContext()
        self._context = self._own_context if context is None else context
        self._prog = MathematicalProgram()
        self._q = self._prog.NewContinuousVariables(plant.num_positions(), "q")
        add_limits_and_quaternions(plant, self._q, self._prog, context, limits)

    def q(self) -> np.ndarray:
        """Returns the variables of the positions, shape (nq,)."""
        return self._q.copy()

    def prog(self) -> MathematicalProgram:
        """Returns the program."""
        return self._prog

    def get_mutable_prog(self) -> MathematicalProgram:
        """Returns the program."""
        return self._prog

    def context(self) -> Context:
        """Returns the context of the plant."""
        return self._context

    def get_mutable_context(self) -> Context:
        """Returns the context of the plant."""
        return self._context

    @overloaded(
        overload(
            lambda self, B, p_BQ, A, *box: self.AddPositionConstraint(B, p_BQ, A, None, *box),
            frameB=FRAME,
            p_BQ=POINT,
            frameA=FRAME,
            **position.BOX,
        ),
        overload(frameB=FRAME, p_BQ=POINT, frameAbar=FRAME, X_AbarA=POSE, **position.BOX),
    )
    def AddPositionConstraint(
        self, B: Frame, p_BQ: ArrayLike | None, A: Frame, X_AbarA: RigidTransform, lower: ArrayLike, upper: ArrayLike
    ) -> Binding[Constraint]:
        """Adds that a point Q of frame B is in a box of frame A.

        Called as `(frameB, p_BQ, frameA, p_AQ_lower, p_AQ_upper)`, or as
        `(frameB, p_BQ, frameAbar, X_AbarA, p_AQ_lower, p_AQ_upper)` with A fixed to Abar.
        """
        return self._add(position.PositionConstraint(self._plant, A, X_AbarA, lower, upper, B, p_BQ, self._context))

    def _add(self, constraint: Constraint) -> Binding:
        return self._prog.AddConstraint(constraint, self._q)

    def AddPositionCost(
        self, frameA: Frame, p_AP: ArrayLike, frameB: Frame, p_BQ: ArrayLike, C: ArrayLike
    ) -> Binding[Cost]:
        """Adds the cost e' C e with e from P of frame A to Q of frame B, in A."""
        cost = position.PositionCost(self._plant, frameA, p_AP, frameB, p_BQ, C, self._context)
        return self._prog.AddCost(cost, self._q)

    def AddOrientationConstraint(
        self, frameAbar: Frame, R_AbarA: RotationMatrix, frameBbar: Frame, R_BbarB: RotationMatrix, theta_bound: float
    ) -> Binding[Constraint]:
        """Adds that the angle between A (fixed to Abar) and B (fixed to Bbar) is at most `theta_bound` [rad]."""
        return self._add(
            orientation.OrientationConstraint(
                self._plant, frameAbar, R_AbarA, frameBbar, R_BbarB, theta_bound, self._context
            )
        )

    def AddOrientationCost(
        self, frameAbar: Frame, R_AbarA: RotationMatrix, frameBbar: Frame, R_BbarB: RotationMatrix, c: float
    ) -> Binding[Cost]:
        """Adds the cost c (1 - cos(angle)) of the angle between A (fixed to Abar) and B (fixed to Bbar)."""
        cost = orientation.OrientationCost(self._plant, frameAbar, R_AbarA, frameBbar, R_BbarB, c, self._context)
        return self._prog.AddCost(cost, self._q)

    def AddGazeTargetConstraint(
        self, frameA: Frame, p_AS: ArrayLike, n_A: ArrayLike, frameB: Frame, p_BT: ArrayLike, cone_half_angle: float
    ) -> Binding[Constraint]:
        """Adds that T of frame B is in the cone with apex S and axis n of frame A."""
        return self._add(
            position.GazeTargetConstraint(self._plant, frameA, p_AS, n_A, frameB, p_BT, cone_half_angle, self._context)
        )

    def AddAngleBetweenVectorsConstraint(
        self, frameA: Frame, na_A: ArrayLike, frameB: Frame, nb_B: ArrayLike, angle_lower: float, angle_upper: float
    ) -> Binding[Constraint]:
        """Adds bounds [rad] on the angle between a direction of frame A and one of frame B."""
        return self._add(
            orientation.AngleBetweenVectorsConstraint(
                self._plant, frameA, na_A, frameB, nb_B, angle_lower, angle_upper, self._context
            )
        )

    def AddAngleBetweenVectorsCost(
        self, frameA: Frame, na_A: ArrayLike, frameB: Frame, nb_B: ArrayLike, c: float
    ) -> Binding[Cost]:
        """Adds the cost c (1 - cos(angle)) of the angle between a direction of frame A and one of frame B."""
        cost = orientation.AngleBetweenVectorsCost(self._plant, frameA, na_A, frameB, nb_B, c, self._context)
        return self._prog.AddCost(cost, self._q)

    def AddPointToPointDistanceConstraint(
        self,
        frame1: Frame,
        p_B1P1: ArrayLike,
        frame2: Frame,
        p_B2P2: ArrayLike,
        distance_lower: float,
        distance_upper: float,
    ) -> Binding[Constraint]:
        """Adds bounds [m] on the distance of a point of one frame from a point of another."""
        return self._add(
            position.PointToPointDistanceConstraint(
                self._plant, frame1, p_B1P1, frame2, p_B2P2, distance_lower, distance_upper, self._context
            )
        )

    def AddPointToLineDistanceConstraint(
        self,
        frame_point: Frame,
        p_B1P: ArrayLike,
        frame_line: Frame,
        p_B2Q: ArrayLike,
        n_B2: ArrayLike,
        distance_lower: float,
        distance_upper: float,
    ) -> Binding[Constraint]:
        """Adds bounds [m] on the distance of a point of one frame from a line of another."""
        return self._add(
            position.PointToLineDistanceConstraint(
                self._plant, frame_point, p_B1P, frame_line, p_B2Q, n_B2, distance_lower, distance_upper, self._context
            )
        )

    def AddPolyhedronConstraint(
        self, frameF: Frame, frameG: Frame, p_GP: ArrayLike, A: ArrayLike, b: ArrayLike
    ) -> Binding[Constraint]:
        """Adds A (p_FP1, p_FP2, ...) <= b for points of frame G seen from frame F."""
        return self._add(position.PolyhedronConstraint(self._plant, frameF, frameG, p_GP, A, b, self._context))

    def AddDistanceConstraint(
        self, geometry_pair: tuple[Any, Any], distance_lower: float, distance_upper: float
    ) -> Binding[Constraint]:
        """Adds bounds [m] on the signed distance of two geometries."""
        return self._add(
            distance.DistanceConstraint(self._plant, geometry_pair, self._context, distance_lower, distance_upper)
        )

    def AddMinimumDistanceLowerBoundConstraint(
        self, bound: float, influence_distance_offset: float = 0.01
    ) -> Binding[Constraint]:
        """Adds that all pairs of geometries that may collide are at least `bound` [m] from each other."""
        return self._add(
            distance.MinimumDistanceLowerBoundConstraint(
                self._plant, bound, self._context, None, influence_distance_offset
            )
        )

    def AddMinimumDistanceUpperBoundConstraint(
        self, bound: float, influence_distance_offset: float
    ) -> Binding[Constraint]:
        """Adds that some pair of geometries that may collide is at most `bound` [m] apart."""
        return self._add(
            distance.MinimumDistanceUpperBoundConstraint(self._plant, bound, self._context, influence_distance_offset)
        )
