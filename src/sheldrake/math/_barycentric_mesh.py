"""Interpolation on a rectangular mesh by triangles and their higher-dimensional kin."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable, Sequence
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.math._matrices import float_matrix, float_vector

if TYPE_CHECKING:
    from sheldrake.common._types import Scalars

__all__ = ["BarycentricMesh"]

_FIRST = itemgetter(0)


class BarycentricMesh:
    """A function of several inputs, given at the points of a grid, linear in between.

    Each box of the grid is divided into simplices (R. Munos and A. Moore, Barycentric interpolators for continuous
    space and time reinforcement learning, NIPS 1998). Outside, the nearest boundary counts.
    """

    def __init__(self, input_grid: Sequence[Iterable[float]]):
        """
        Args:
            input_grid: For each input the coordinates of the grid, at least one.

        Raises:
            RuntimeError: there is no input, or one has no coordinates.
        """
        self._grid = [sorted({float(x) for x in coordinates}) for coordinates in input_grid]
        if not self._grid or not all(self._grid):
            raise RuntimeError(f"BarycentricMesh(): the grid {self._grid} needs an input, and a coordinate for each.")
        sizes = [len(coordinates) for coordinates in self._grid]
        self._strides = [int(np.prod(sizes[:i], dtype=int)) for i in range(len(sizes))]
        self._num_points = int(np.prod(sizes, dtype=int))
        self._num_interpolants = 1 + sum(size > 1 for size in sizes)

    def get_input_grid(self) -> list[set[float]]:
        """The coordinates of the grid, one set for each input."""
        return [set(coordinates) for coordinates in self._grid]

    def get_input_size(self) -> int:
        """How many inputs the function has."""
        return len(self._grid)

    def get_num_mesh_points(self) -> int:
        """How many points the grid has."""
        return self._num_points

    def get_num_interpolants(self) -> int:
        """How many points each interpolation uses: one more than there are inputs with more than one coordinate."""
        return self._num_interpolants

    @checked
    def get_mesh_point(self, index: int) -> np.ndarray:
        """Point `index` of the grid, the first input running fastest, shape (inputs,).

        Raises:
            IndexError: there is no such point.
        """
        if not 0 <= index < self._num_points:
            raise IndexError(
                f"BarycentricMesh.get_mesh_point(): index {index} is not within 0 ... {self._num_points - 1}."
            )
        point = []
        for coordinates in self._grid:
            index, i = divmod(index, len(coordinates))
            point.append(coordinates[i])
        return np.array(point)

    def get_all_mesh_points(self) -> np.ndarray:
        """All points of the grid, shape (inputs, points)."""
        return np.column_stack([self.get_mesh_point(i) for i in range(self._num_points)])

    def EvalBarycentricWeights(self, input: Scalars) -> tuple[np.ndarray, np.ndarray]:
        """The points that count at an input, and how much: indices and weights, shape (interpolants,) each.

        Raises:
            RuntimeError: the input has another size.
        """
        x = float_vector("BarycentricMesh.EvalBarycentricWeights", input=input)
        if len(x) != len(self._grid):
            raise RuntimeError(
                f"BarycentricMesh.EvalBarycentricWeights(): input has {len(x)} numbers, the mesh has "
                f"{len(self._grid)} inputs."
            )
        indices, weights = self._interpolants(x.tolist())
        return np.array(indices, dtype=np.int32), np.array(weights)

    def _interpolants(self, point: list[float]) -> tuple[list[int], list[float]]:
        top, fractions = 0, []
        for value, coordinates, stride in zip(point, self._grid, self._strides):
            upper = bisect_left(coordinates, value)
            top += stride * min(upper, len(coordinates) - 1)
            if 0 < upper < len(coordinates):
                below, above = coordinates[upper - 1], coordinates[upper]
                fractions.append(((value - below) / (above - below), stride))
        indices, weights, reached = [top], [], 0.0
        fractions.sort(key=_FIRST)
        for fraction, stride in fractions:
            weights.append(fraction - reached)
            reached = fraction
            indices.append(indices[-1] - stride)
        weights.append(1.0 - reached)
        missing = self._num_interpolants - len(indices)
        return indices + indices[-1:] * missing, weights + [0.0] * missing

    def _interpolants_of_all(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """`_interpolants` of many points, shape (inputs, points): indices and weights, (points, interpolants) each."""
        top = np.zeros(points.shape[1], int)
        fractions, strides = np.full(points.shape, np.inf), np.zeros(points.shape, int)
        for i, (coordinates, stride) in enumerate(zip(map(np.array, self._grid), self._strides)):
            upper = np.searchsorted(coordinates, points[i])
            top += stride * np.minimum(upper, len(coordinates) - 1)
            within = np.flatnonzero((0 < upper) & (upper < len(coordinates)))
            below, above = coordinates[upper[within] - 1], coordinates[upper[within]]
            fractions[i, within] = (points[i, within] - below) / (above - below)
            strides[i, within] = stride
        order = np.argsort(fractions, axis=0, kind="stable")
        reached = np.minimum(np.take_along_axis(fractions, order, 0), 1.0)
        weights = np.diff(reached, axis=0, prepend=0.0, append=1.0)
        indices = top - np.cumsum(np.take_along_axis(strides, order, 0), axis=0)
        count = self._num_interpolants
        return np.vstack((top, indices))[:count].T, weights[:count].T

    def Eval(self, mesh_values: Scalars, input: Scalars) -> np.ndarray:
        """The function at an input, shape (outputs,).

        Args:
            mesh_values: Its values at the points of the grid, shape (outputs, points).
            input: Where, shape (inputs,).

        Raises:
            RuntimeError: the sizes differ.
        """
        values = float_matrix("BarycentricMesh.Eval", mesh_values=mesh_values)
        if values.shape[1] != self._num_points:
            raise RuntimeError(
                f"BarycentricMesh.Eval(): mesh_values has shape {values.shape}; it must have {self._num_points} "
                "columns, one for each point."
            )
        indices, weights = self.EvalBarycentricWeights(input)
        return values[:, indices] @ weights

    def MeshValuesFrom(self, vector_func: Callable[[np.ndarray], Any]) -> np.ndarray:
        """Values of a function at the points of the grid, shape (outputs, points)."""
        return np.column_stack(
            [np.asarray(vector_func(self.get_mesh_point(i)), dtype=float) for i in range(self._num_points)]
        )
