"""Where points are: constraints and a cost."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import anything
from sheldrake.common._overloads import overload, overloaded
from sheldrake.math import RigidTransform
from sheldrake.multibody.inverse_kinematics._kinematic import (
    FRAME,
    PLANT_OR_NONE,
    POINT,
    POSE,
    KinematicFunction,
    form,
    unit3,
    vector3,
)
from sheldrake.solvers import Constraint, Cost, _arrays

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import Frame
    from sheldrake.systems.framework import Context

# A box in frame A; a point of frame B, and where positions are put.
BOX = {"p_AQ_lower": POINT, "p_AQ_upper": POINT}
_IN_B = {"frameB": FRAME, "p_BQ": POINT, "plant_context": anything}


@checked
class PositionConstraint(KinematicFunction, Constraint):
    """A point Q fixed to frame B is in a box of frame A.

    Called as `(plant, frameA, p_AQ_lower, p_AQ_upper, frameB, p_BQ, plant_context)`; or with `frameAbar, X_AbarA` in
    the place of `frameA`, where A is fixed to Abar. With None for `p_BQ` the point is a decision variable too, after q.
    """

    @overloaded(
        overload(
            lambda self, plant, A, *rest: self.__init__(plant, A, None, *rest),
            plant=PLANT_OR_NONE,
            frameA=FRAME,
            **BOX,
            **_IN_B,
        ),
        overload(plant=PLANT_OR_NONE, frameAbar=FRAME, X_AbarA=POSE, **BOX, **_IN_B),
    )
    def __init__(
        self,
        plant: MultibodyPlant | None,
        A: Frame,
        X_AbarA: RigidTransform,
        lower: ArrayLike,
        upper: ArrayLike,
        B: Frame,
        p_BQ: ArrayLike,
        context: Context,
    ):
        self._A, self._B = A, B
        call = "PositionConstraint"
        self._turns = X_AbarA is not None
        X_AAbar = (RigidTransform() if X_AbarA is None else X_AbarA).inverse()
        self._R, self._p = X_AAbar.rotation().matrix(), X_AAbar.translation()
        self._p_BQ = None if p_BQ is None else vector3(call, "p_BQ", p_BQ)
        self._set_plant(plant, context, 3, 0 if self._p_BQ is not None else 3)
        self._set_bounds(vector3(call, "p_AQ_lower", lower), vector3(call, "p_AQ_upper", upper))

    def _value(self, more: np.ndarray) -> np.ndarray:
        if self._p_BQ is not None:
            p_AbarQ = self._point(self._B, self._p_BQ, self._A)
            return self._R @ p_AbarQ + self._p if self._turns else p_AbarQ
        p_AbarB = self._point(self._B, np.zeros(3), self._A)
        return self._R @ (p_AbarB + self._rotation(self._A, self._B) @ more) + self._p

    def _forms(self) -> list[np.ndarray] | None:
        if self._p_BQ is None:
            return None
        return [form(p_BQ=self._p_BQ, slope=along, constant=start) for along, start in zip(self._R, self._p)]

    def _slope(self, more: np.ndarray) -> np.ndarray:
        by_point = self._rotation(self._A, self._B)
        return self._R @ np.hstack((self._point_slope(self._B, more, self._A), by_point))

    def set_bounds(self, new_lb: ArrayLike, new_ub: ArrayLike) -> None:
        """Sets both bounds [m], shape (3,)."""
        self._set_bounds(_arrays.float_vector(new_lb), _arrays.float_vector(new_ub))

    def UpdateLowerBound(self, new_lb: ArrayLike) -> None:
        """Sets the lower bound [m], shape (3,)."""
        self._set_bounds(_arrays.float_vector(new_lb), self._upper)

    def UpdateUpperBound(self, new_ub: ArrayLike) -> None:
        """Sets the upper bound [m], shape (3,)."""
        self._set_bounds(self._lower, _arrays.float_vector(new_ub))


@checked
class PositionCost(KinematicFunction, Cost):
    """e' C e with e from a point P of frame A to a point Q of frame B, in A.

    Args:
        plant: The plant.
        frameA: Frame A.
        p_AP: P in A [m], shape (3,).
        frameB: Frame B.
        p_BQ: Q in B [m], shape (3,).
        C: Weights, shape (3, 3).
        plant_context: Where the positions are put.
    """

    def __init__(
        self,
        plant: MultibodyPlant | None,
        frameA: Frame,
        p_AP: ArrayLike,
        frameB: Frame,
        p_BQ: ArrayLike,
        C: ArrayLike,
        plant_context: Context | None,
    ):
        self._A, self._B = frameA, frameB
        self._p_AP, self._p_BQ = vector3("PositionCost", "p_AP", p_AP), vector3("PositionCost", "p_BQ", p_BQ)
        self._C = np.array(C, dtype=float).reshape(3, 3)
        self._set_plant(plant, plant_context, 1)

    def _value(self, more: np.ndarray) -> np.ndarray:
        e = self._point(self._B, self._p_BQ, self._A) - self._p_AP
        return np.atleast_1d(e @ (self._C @ e))

    def _forms(self) -> list[np.ndarray]:
        return [form(p_AS=self._p_AP, p_BQ=self._p_BQ, square=0.5 * (self._C + self._C.T))]


@checked
class PointToPointDistanceConstraint(KinematicFunction, Constraint):
    """The distance of a point of one frame from a point of another; its value is the square [m²].

    Args:
        plant: The plant.
        frame1: Frame B1.
        p_B1P1: Point P1 in B1 [m], shape (3,).
        frame2: Frame B2.
        p_B2P2: Point P2 in B2 [m], shape (3,).
        distance_lower: Least distance [m].
        distance_upper: Greatest distance [m].
        plant_context: Where the positions are put.
    """

    def __init__(
        self,
        plant: MultibodyPlant | None,
        frame1: Frame,
        p_B1P1: ArrayLike,
        frame2: Frame,
        p_B2P2: ArrayLike,
        distance_lower: float,
        distance_upper: float,
        plant_context: Context | None,
    ):
        call = "PointToPointDistanceConstraint"
        self._A, self._B = frame1, frame2
        self._P1, self._P2 = vector3(call, "p_B1P1", p_B1P1), vector3(call, "p_B2P2", p_B2P2)
        self._set_plant(plant, plant_context, 1)
        self._set_bounds(*squared_bounds(call, distance_lower, distance_upper))

    def _value(self, more: np.ndarray) -> np.ndarray:
        d = self._point(self._B, self._P2, self._A) - self._P1
        return np.atleast_1d(d @ d)

    def _forms(self) -> list[np.ndarray]:
        return [form(p_AS=self._P1, p_BQ=self._P2, square=np.eye(3))]


def squared_bounds(call: str, lower: float, upper: float) -> tuple[np.ndarray, np.ndarray]:
    """Squares of two distances.

    Raises:
        RuntimeError: one is negative, or they are in the wrong order.
    """
    if lower < 0.0 or upper < lower:
        raise RuntimeError(f"{call}: expected 0 <= distance_lower <= distance_upper, got {lower} and {upper}.")
    return np.array([lower * lower]), np.array([upper * upper])


@checked
class PointToLineDistanceConstraint(KinematicFunction, Constraint):
    """The distance of a point from a line of another frame; its value is the square [m²].

    Args:
        plant: The plant.
        frame_point: Frame B1.
        p_B1P: The point P in B1 [m], shape (3,).
        frame_line: Frame B2.
        p_B2Q: A point Q on the line, in B2 [m], shape (3,).
        n_B2: Direction of the line, in B2, shape (3,).
        distance_lower: Least distance [m].
        distance_upper: Greatest distance [m].
        plant_context: Where the positions are put.
    """

    def __init__(
        self,
        plant: MultibodyPlant | None,
        frame_point: Frame,
        p_B1P: ArrayLike,
        frame_line: Frame,
        p_B2Q: ArrayLike,
        n_B2: ArrayLike,
        distance_lower: float,
        distance_upper: float,
        plant_context: Context | None,
    ):
        call = "PointToLineDistanceConstraint"
        self._A, self._B = frame_line, frame_point
        self._P, self._Q = vector3(call, "p_B1P", p_B1P), vector3(call, "p_B2Q", p_B2Q)
        n = unit3(call, "n_B2", n_B2)
        self._across = np.eye(3) - np.outer(n, n)
        self._set_plant(plant, plant_context, 1)
        self._set_bounds(*squared_bounds(call, distance_lower, distance_upper))

    def _value(self, more: np.ndarray) -> np.ndarray:
        d = self._across @ (self._point(self._B, self._P, self._A) - self._Q)
        return np.atleast_1d(d @ d)

    def _forms(self) -> list[np.ndarray]:
        return [form(p_AS=self._Q, p_BQ=self._P, square=self._across)]  # a projection: its square is itself


@checked
class PolyhedronConstraint(KinematicFunction, Constraint):
    """A (p_FP1, p_FP2, ...) <= b for points fixed to frame G, seen from frame F.

    Args:
        plant: The plant.
        frameF: Frame F.
        frameG: Frame G.
        p_GP: The points in G [m], shape (3, n).
        A: Shape (m, 3 n).
        b: Shape (m,).
        plant_context: Where the positions are put.
    """

    def __init__(
        self,
        plant: MultibodyPlant | None,
        frameF: Frame,
        frameG: Frame,
        p_GP: ArrayLike,
        A: ArrayLike,
        b: ArrayLike,
        plant_context: Context | None,
    ):
        self._F, self._G = frameF, frameG
        points = np.array(p_GP, dtype=float)
        self._points = points.reshape(3, 1) if points.ndim == 1 else points
        self._rows, b = np.array(A, dtype=float), np.atleast_1d(np.array(b, dtype=float))
        if self._rows.ndim != 2 or self._rows.shape != (b.size, 3 * self._points.shape[1]):
            raise RuntimeError(
                f"PolyhedronConstraint: A has shape {self._rows.shape}, expected {(b.size, 3 * self._points.shape[1])}."
            )
        self._set_plant(plant, plant_context, b.size)
        self._set_bounds(np.full(b.size, -np.inf), b)

    def _value(self, more: np.ndarray) -> np.ndarray:
        p_FP = self._plant.CalcPointsPositions(self._context, self._G, self._points, self._F)
        return self._rows @ p_FP.ravel(order="F")

    def _slope(self, more: np.ndarray) -> np.ndarray:
        return self._rows @ np.concatenate([self._point_slope(self._G, p, self._F) for p in self._points.T])


@checked
class GazeTargetConstraint(KinematicFunction, Constraint):
    """A target T of frame B is in a cone of frame A with apex S.

    With p from S to T: n'p >= 0 and (n'p)² - cos²(angle) p'p >= 0.

    Args:
        plant: The plant.
        frameA: Frame A.
        p_AS: The apex S in A [m], shape (3,).
        n_A: Direction of the axis, in A, shape (3,).
        frameB: Frame B.
        p_BT: The target T in B [m], shape (3,).
        cone_half_angle: Angle between axis and border, 0 to pi/2 [rad].
        plant_context: Where the positions are put.

    Raises:
        ValueError: the angle is out of range, or the direction zero.
    """

    def __init__(
        self,
        plant: MultibodyPlant | None,
        frameA: Frame,
        p_AS: ArrayLike,
        n_A: ArrayLike,
        frameB: Frame,
        p_BT: ArrayLike,
        cone_half_angle: float,
        plant_context: Context | None,
    ):
        call = "GazeTargetConstraint"
        self._A, self._B = frameA, frameB
        self._S, self._T = vector3(call, "p_AS", p_AS), vector3(call, "p_BT", p_BT)
        n = unit3(call, "a", n_A)
        if not 0.0 <= cone_half_angle <= np.pi / 2.0:
            raise ValueError(f"{call}: cone_half_angle should be within [0, pi/2]")
        self._n = n
        self._M = np.outer(n, n) - np.cos(cone_half_angle) ** 2 * np.eye(3)
        self._set_plant(plant, plant_context, 2)
        self._set_bounds(np.zeros(2), np.full(2, np.inf))

    def _value(self, more: np.ndarray) -> np.ndarray:
        p = self._point(self._B, self._T, self._A) - self._S
        return np.array([self._n @ p, p @ (self._M @ p)])

    def _forms(self) -> list[np.ndarray]:
        ends = {"p_AS": self._S, "p_BQ": self._T}
        return [form(**ends, slope=self._n), form(**ends, square=self._M)]
