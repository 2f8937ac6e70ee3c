"""What a collision checker finds: kinds of collisions, distances, and how much of an edge is free."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._enums import BoundEnum
from sheldrake.common._scalars import frozen
from sheldrake.multibody.tree import BodyIndex

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@checked
class RobotCollisionType(BoundEnum):
    """Whether a robot touches its environment, itself, both or nothing."""

    kNoCollision = 0
    kEnvironmentCollision = 1
    kSelfCollision = 2
    kEnvironmentAndSelfCollision = 3

    def MakeUpdated(
        self, *, in_environment_collision: bool | None = None, in_self_collision: bool | None = None
    ) -> RobotCollisionType:
        """Returns the kind with one of its two parts, or both, set."""
        environment = bool(self.value & 1) if in_environment_collision is None else in_environment_collision
        own = bool(self.value & 2) if in_self_collision is None else in_self_collision
        return RobotCollisionType(int(environment) + 2 * int(own))


@checked
class EdgeMeasure:
    """How long an edge is, and which part of it, from its start, is free of collisions.

    Args:
        distance: Its length; or another one to copy.
        alpha: The free part from 0 to 1; negative if its start is not free.

    Raises:
        RuntimeError: the length is negative, or the part above one.
    """

    _distance: float
    _alpha: float

    def __init__(
        self,
        distance: float | EdgeMeasure | None = None,
        alpha: float | None = None,
        *,
        other: EdgeMeasure | None = None,
    ):
        source = other if isinstance(other, EdgeMeasure) else distance
        if isinstance(source, EdgeMeasure):
            self._distance, self._alpha = source._distance, source._alpha
            return
        if source is None or not source >= 0.0 or alpha is None or not alpha <= 1.0:
            raise RuntimeError(f"EdgeMeasure(): distance {distance} must not be negative, alpha {alpha} at most one.")
        self._distance, self._alpha = float(source), float(alpha)

    def completely_free(self) -> bool:
        """Tells whether all of it is free."""
        return self._alpha == 1.0

    def partially_free(self) -> bool:
        """Tells whether its start is free."""
        return self._alpha >= 0.0

    def distance(self) -> float:
        """Returns its length."""
        return self._distance

    def alpha(self) -> float:
        """Returns the part that is free.

        Raises:
            RuntimeError: its start is not.
        """
        if not self.partially_free():
            raise RuntimeError("EdgeMeasure.alpha(): the start of the edge is in collision.")
        return self._alpha

    def alpha_or(self, default_value: float) -> float:
        """Returns the part that is free, or a default if its start is not."""
        return self._alpha if self.partially_free() else float(default_value)


@checked
class RobotClearance:
    """A table of distances between bodies of the robot and others.

    Args:
        num_positions: Size of configurations; or another table to copy.
    """

    _nq: int
    _robot: list[int]
    _other: list[int]
    _kinds: list[RobotCollisionType]
    _distances: list[float]
    _jacobians: np.ndarray

    def __init__(self, num_positions: Any = None, *, other: RobotClearance | None = None):
        source = other if other is not None else num_positions
        if isinstance(source, RobotClearance):
            self._nq, self._jacobians = source._nq, source._jacobians.copy()
            self._robot, self._other = [*source._robot], [*source._other]
            self._kinds, self._distances = [*source._kinds], [*source._distances]
            return
        self._nq = int(source)
        self._robot, self._other, self._kinds, self._distances = [], [], [], []
        self._jacobians = np.zeros((0, self._nq))

    @classmethod
    def _of(
        cls, robot: np.ndarray, other: np.ndarray, own: np.ndarray, distances: np.ndarray, jacobians: np.ndarray
    ) -> RobotClearance:
        """A table of these rows: bodies, whether both are of the robot, distances, and derivatives, which it keeps."""
        new = cls(jacobians.shape[1])
        kinds = RobotCollisionType.kEnvironmentCollision, RobotCollisionType.kSelfCollision
        new._robot, new._other, new._distances = robot.tolist(), other.tolist(), distances.tolist()
        new._kinds, new._jacobians = [kinds[k] for k in own.tolist()], jacobians
        return new

    def size(self) -> int:
        """Returns the number of rows."""
        return len(self._distances)

    def num_positions(self) -> int:
        """Returns the size of configurations."""
        return self._nq

    def robot_indices(self) -> list:
        """Returns the bodies of the robot."""
        return [BodyIndex(i) for i in self._robot]

    def other_indices(self) -> list:
        """Returns the other bodies."""
        return [BodyIndex(i) for i in self._other]

    def collision_types(self) -> list[RobotCollisionType]:
        """Returns whether the other bodies are of the environment or of the robot."""
        return list(self._kinds)

    def distances(self) -> np.ndarray:
        """Returns distances less padding [m], shape (size,), read-only."""
        return frozen(np.array(self._distances, dtype=float))

    def jacobians(self) -> np.ndarray:
        """Returns the derivatives of distances by configurations, shape (size, num_positions)."""
        out = self._jacobians.view()
        out.flags.writeable = False
        return out

    def mutable_jacobians(self) -> np.ndarray:
        """Returns the derivatives of distances, to be changed."""
        return self._jacobians

    def Reserve(self, size: int) -> None:
        """Does nothing: rows are made as they come."""

    def Append(
        self,
        robot_index: BodyIndex,
        other_index: BodyIndex,
        collision_type: RobotCollisionType,
        distance: float,
        jacobian: ArrayLike,
    ) -> None:
        """Adds a row.

        Raises:
            RuntimeError: the derivative has another size.
        """
        row = np.array(jacobian, dtype=float).reshape(1, -1)
        if row.shape[1] != self._nq:
            raise RuntimeError(f"Append(): the jacobian has {row.shape[1]} columns, expected {self._nq}.")
        robot, other, left = int(robot_index), int(other_index), float(distance)
        self._robot.append(robot)
        self._other.append(other)
        self._kinds.append(collision_type)
        self._distances.append(left)
        self._jacobians = np.vstack((self._jacobians, row))
