"""Which pairs of bodies a collision checker looks at, and how far it keeps them apart."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.common._kinds import anything, instance_of
from sheldrake.common._overloads import Overload, overload, overloaded
from sheldrake.multibody.tree import BodyIndex, RigidBody
from sheldrake.solvers import _kinds as kinds


def _pair_and(**more: Any) -> tuple[Overload, Overload]:
    """How calls about a pair of bodies are made: with their indices, or themselves."""
    index, body = instance_of(BodyIndex, int), instance_of(RigidBody)
    return overload(bodyA_index=index, bodyB_index=index, **more), overload(bodyA=body, bodyB=body, **more)


class CheckedPairs:
    """Filters and paddings of pairs of bodies: rows and columns are bodies, at least one of a pair is the robot's."""

    _plant: Any
    _filter: np.ndarray
    _padding: np.ndarray
    _robot: np.ndarray  # Whether a body is part of the robot.

    def _set_up_pairs(self, plant: Any, robot_instances: list, environment: float, own: float) -> None:
        instances = {int(i) for i in robot_instances}
        bodies = [plant.get_body(BodyIndex(i)) for i in range(plant.num_bodies())]
        self._robot = np.array([int(b.model_instance()) in instances for b in bodies])
        count = len(bodies)
        self._padding = np.zeros((count, count))
        self.SetPaddingAllRobotEnvironmentPairs(environment)
        self.SetPaddingAllRobotRobotPairs(own)
        self._nominal = self._filter = self._filters_of_the_model(plant, bodies)

    def _filters_of_the_model(self, plant: Any, bodies: list) -> np.ndarray:
        count = len(bodies)
        out = np.zeros((count, count), dtype=np.int32)
        inspector = self._inspector()  # type: ignore[attr-defined]
        welded = {i: {int(b.index()) for b in plant.GetBodiesWeldedTo(bodies[i])} for i in range(count)}
        geometries = [plant.GetCollisionGeometriesForBody(b) for b in bodies]
        for i in range(count):
            for j in range(i, count):
                if i == j or not (self._robot[i] or self._robot[j]):
                    out[i, j] = out[j, i] = -1
                    continue
                states = {inspector.CollisionFiltered(a, b) for a in geometries[i] for b in geometries[j]}
                if len(states) > 1:
                    raise RuntimeError(
                        f"CollisionChecker: some pairs of geometries of bodies {bodies[i].scoped_name()} and "
                        f"{bodies[j].scoped_name()} are filtered, others are not."
                    )
                out[i, j] = out[j, i] = int(j in welded[i] or states == {True})
        return out

    def _index(self, call: str, body: Any) -> int:
        index = int(body.index()) if hasattr(body, "body_frame") else int(body)
        if not 0 <= index < len(self._robot):
            raise RuntimeError(f"CollisionChecker.{call}(): body index {index} is out of range.")
        return index

    def IsPartOfRobot(self, body: Any = None, *, body_index: Any = None) -> bool:
        """Tells whether a body, given itself or by index, is part of the robot."""
        return bool(self._robot[self._index("IsPartOfRobot", body if body_index is None else body_index)])

    def _pair(self, call: str, bodies: tuple) -> tuple[int, int]:
        i, j = (self._index(call, b) for b in bodies)
        if i == j:
            raise RuntimeError(f"CollisionChecker::{call}(): both bodies are {i}.")
        if not (self._robot[i] or self._robot[j]):
            where = f"({i}, {j})"
            raise RuntimeError(f"CollisionChecker::{call}(): cannot be used on pairs of environment bodies: {where}")
        return i, j

    # Padding

    @overloaded(*_pair_and())
    def GetPaddingBetween(self, bodyA: Any, bodyB: Any) -> float:
        """Returns the padding of a pair of bodies, given themselves or by indices [m]."""
        i, j = (self._index("GetPaddingBetween", b) for b in (bodyA, bodyB))
        return float(self._padding[i, j])

    @overloaded(*_pair_and(padding=kinds.number))
    def SetPaddingBetween(self, a: Any, b: Any, padding: float) -> None:
        """Sets the padding of a pair [m]: `(bodyA, bodyB, padding)` with bodies or their indices.

        Raises:
            RuntimeError: they are one body, both of the environment, or the padding is not finite.
        """
        i, j = self._pair("SetPaddingBetween", (a, b))
        self._padding[i, j] = self._padding[j, i] = _finite("SetPaddingBetween", padding)

    def GetPaddingMatrix(self) -> np.ndarray:
        """Returns the paddings of all pairs [m]."""
        return self._padding.copy()

    def SetPaddingMatrix(self, collision_padding: Any) -> None:
        """Sets the paddings of all pairs [m].

        Raises:
            RuntimeError: the matrix has another size, is not symmetric or finite, or says something of one body, or of
                two of the environment.
        """
        M, n = np.array(collision_padding, dtype=float), len(self._robot)
        call = "CollisionChecker::SetPaddingMatrix()"
        if M.shape != (n, n):
            found = "x".join(map(str, M.shape))
            raise RuntimeError(
                f"{call}: The padding matrix must be {n}x{n}. The given padding matrix is the wrong size: {found}."
            )
        for i in range(n):
            if M[i, i] != 0.0:
                raise RuntimeError(
                    f"{call}: The collision padding matrix has invalid values on the diagonal ({i}, {i}) = {M[i, i]:g};"
                    " the values on the diagonal must always be 0."
                )
            for j in range(i + 1, n):
                where = f"({i}, {j}) = {M[i, j]:g}"
                if not np.isfinite(M[i, j]) or M[i, j] != M[j, i]:
                    raise RuntimeError(f"{call}: The collision padding matrix must be finite and symmetric: {where}.")
                if M[i, j] != 0.0 and not (self._robot[i] or self._robot[j]):
                    raise RuntimeError(f"{call}: Padding of two environment bodies must be zero: {where}.")
        self._padding = M

    def _robot_pairs(self, own: bool) -> np.ndarray:
        """Where pairs of robot bodies are, or pairs of a robot body and one of the environment."""
        robot = self._robot
        if own:
            return np.logical_and.outer(robot, robot) & ~np.eye(len(robot), dtype=bool)
        return np.logical_xor.outer(robot, robot)

    def SetPaddingAllRobotEnvironmentPairs(self, padding: float) -> None:
        """Sets the padding between the robot and its environment [m]."""
        self._padding[self._robot_pairs(False)] = _finite("SetPaddingAllRobotEnvironmentPairs", padding)

    def SetPaddingAllRobotRobotPairs(self, padding: float) -> None:
        """Sets the padding between bodies of the robot [m]."""
        self._padding[self._robot_pairs(True)] = _finite("SetPaddingAllRobotRobotPairs", padding)

    def SetPaddingOneRobotBodyAllEnvironmentPairs(self, body_index: Any, padding: float) -> None:
        """Sets the padding between one body of the robot and the environment [m].

        Raises:
            RuntimeError: the body is of the environment.
        """
        i = self._index("SetPaddingOneRobotBodyAllEnvironmentPairs", body_index)
        if not self._robot[i]:
            raise RuntimeError(f"SetPaddingOneRobotBodyAllEnvironmentPairs(): body {i} is no part of the robot.")
        self._padding[i, ~self._robot] = self._padding[~self._robot, i] = _finite("SetPaddingOneRobotBody...", padding)

    def GetLargestPadding(self) -> float:
        """Returns the largest padding of pairs with the robot [m]."""
        pairs = self._robot_pairs(True) | self._robot_pairs(False)
        return float(self._padding[pairs].max(initial=-np.inf)) if pairs.any() else 0.0

    def _uniform(self, own: bool) -> float | None:
        values = np.unique(self._padding[self._robot_pairs(own)])
        return float(values[0]) if values.size == 1 else (None if values.size else 0.0)

    def MaybeGetUniformRobotEnvironmentPadding(self) -> float | None:
        """Returns the padding between robot and environment if it is the same everywhere, else None."""
        return self._uniform(False)

    def MaybeGetUniformRobotRobotPadding(self) -> float | None:
        """Returns the padding between bodies of the robot if it is the same everywhere, else None."""
        return self._uniform(True)

    # Filters

    def GetFilteredCollisionMatrix(self) -> np.ndarray:
        """Returns which pairs are not looked at: 1; 0 for those that are, -1 for those that never are."""
        return self._filter.copy()

    def GetNominalFilteredCollisionMatrix(self) -> np.ndarray:
        """Returns the filters of the model itself."""
        return self._nominal.copy()

    @overloaded(*_pair_and())
    def IsCollisionFilteredBetween(self, bodyA: Any, bodyB: Any) -> bool:
        """Tells whether a pair, given as bodies or by indices, is not looked at."""
        i, j = (self._index("IsCollisionFilteredBetween", b) for b in (bodyA, bodyB))
        return bool(self._filter[i, j] != 0)

    @overloaded(*_pair_and(filter_collision=anything))
    def SetCollisionFilteredBetween(self, a: Any, b: Any, filtered: bool) -> None:
        """Sets whether a pair is left out: `(bodyA, bodyB, filter_collision)` with bodies or their indices.

        Raises:
            RuntimeError: they are one body, or both of the environment.
        """
        i, j = self._pair("SetCollisionFilteredBetween", (a, b))
        matrix = self._filter.copy()
        matrix[i, j] = matrix[j, i] = int(bool(filtered))
        self._set_filter(matrix)

    def SetCollisionFilteredWithAllBodies(self, body: Any = None, *, body_index: Any = None) -> None:
        """Leaves out all pairs with a body of the robot.

        Raises:
            RuntimeError: it is of the environment.
        """
        i = self._index("SetCollisionFilteredWithAllBodies", body if body_index is None else body_index)
        if not self._robot[i]:
            raise RuntimeError(f"SetCollisionFilteredWithAllBodies(): body {i} is no part of the robot.")
        matrix = self._filter.copy()
        matrix[i, :] = matrix[:, i] = 1
        matrix[i, i] = -1
        self._set_filter(matrix)

    def SetCollisionFilterMatrix(self, filter_matrix: Any) -> None:
        """Sets which pairs are not looked at.

        Raises:
            RuntimeError: the matrix has another size, is not symmetric, or has other values than 0 and 1 where these
                belong, and -1 on the diagonal and for pairs of the environment.
        """
        M, n = np.array(filter_matrix, dtype=np.int32), len(self._robot)
        call = "CollisionChecker::SetCollisionFilterMatrix()"
        if M.shape != (n, n):
            found = "x".join(map(str, M.shape))
            raise RuntimeError(f"{call}: The filter matrix must be {n}x{n}; the given one is {found}.")
        for i in range(n):
            if M[i, i] != -1:
                raise RuntimeError(
                    f"{call}: The filtered collision matrix has invalid values on the diagonal ({i}, {i}) = {M[i, i]}; "
                    "the values on the diagonal must always be -1."
                )
            for j in range(i + 1, n):
                allowed = (0, 1) if self._robot[i] or self._robot[j] else (-1,)
                if M[i, j] != M[j, i] or M[i, j] not in allowed:
                    raise RuntimeError(
                        f"{call}: ({i}, {j}) = {M[i, j]} and ({j}, {i}) = {M[j, i]}; allowed: {allowed}."
                    )
        self._set_filter(M)

    def _set_filter(self, matrix: np.ndarray) -> None:
        before, self._filter = self._filter, matrix
        for i, j in np.argwhere(np.triu(before != matrix)):
            self._filter_pair(int(i), int(j), bool(matrix[i, j]))

    def _filter_pair(self, i: int, j: int, filtered: bool) -> None:
        """Tells whatever computes collisions."""


def _finite(call: str, padding: float) -> float:
    if not np.isfinite(padding):
        raise RuntimeError(f"{call}(): the padding must be finite, got {padding}.")
    return float(padding)
