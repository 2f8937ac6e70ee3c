"""Sparse matrices for solvers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._bound_calls import LARGEST, BoundCalls, room
from sheldrake.solvers._kernels.rows import sorted_columns, upper_columns

if TYPE_CHECKING:
    import scipy.sparse


def _arrays_for(entries: int, axis: int) -> tuple[np.ndarray, ...]:
    """Rows, columns and values of entries; scratch; where columns start, their rows and values."""
    rows, cols, by_row, order, new_rows = np.zeros((5, entries), dtype=np.int64)
    values, new_values = np.zeros((2, entries))
    first, starts = np.zeros((2, axis + 1), dtype=np.int64)
    return rows, cols, values, by_row, order, first, starts, new_rows, new_values


def _bound(entries: int, axis: int) -> tuple[Any, ...]:
    """A bound call of `sorted_columns`, and its arrays."""
    arrays = _arrays_for(entries, axis)
    return sorted_columns.bind(0, 0, 0, *arrays), *arrays


def _bound_upper(entries: int, axis: int, places: int) -> tuple[Any, ...]:
    """A bound call of `upper_columns`, and its arrays."""
    arrays = np.zeros(places, dtype=np.int64), *_arrays_for(entries, axis)
    return upper_columns.bind(0, 0, *arrays), *arrays


_calls = BoundCalls(_bound, largest=LARGEST)
_upper_calls = BoundCalls(_bound_upper, largest=LARGEST)


class Columns(NamedTuple):
    """A sparse matrix by columns with the attributes of SciPy's, which take as long to make as the program to solve."""

    data: Any
    indices: Any
    indptr: Any
    shape: tuple[int, int]
    has_canonical_format: bool = True

    @classmethod
    def of(cls, matrix: np.ndarray) -> Columns:
        """The numbers of a dense matrix that are not zero."""
        column, row = np.nonzero(matrix.T)
        starts = np.searchsorted(column, np.arange(matrix.shape[1] + 1))
        return cls(matrix[row, column], row, starts, (matrix.shape[0], matrix.shape[1]))

    @classmethod
    def empty(cls, height: int, width: int) -> Columns:
        """A matrix of zeros."""
        return cls(np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros(width + 1, dtype=np.int64), (height, width))

    @classmethod
    def of_triplets(cls, rows: np.ndarray, cols: np.ndarray, values: np.ndarray, shape: tuple[int, int]) -> Columns:
        """Numbers at their places; those at one place add up."""
        count, (height, width) = len(values), shape
        call, all_rows, all_cols, all_values, *_, starts, new_rows, new_values = _calls.of(
            room(count), room(max(shape))
        )
        all_rows[:count], all_cols[:count], all_values[:count] = rows, cols, values
        call.set("entries", count)
        call.set("height", height)
        call.set("width", width)
        left = call()
        return cls(new_values[:left].copy(), new_rows[:left].copy(), starts[: width + 1].copy(), shape)

    @classmethod
    def upper(cls, rows: np.ndarray, cols: np.ndarray, values: np.ndarray, places: np.ndarray, size: int) -> Columns:
        """The upper triangle of a square matrix of triplets, whose rows and columns `places` says."""
        count, n = len(values), len(places)
        found = _upper_calls.of(room(count), room(size), room(n))
        call, all_places, all_rows, all_cols, all_values, *_, starts, new_rows, new_values = found
        all_places[:n], all_rows[:count], all_cols[:count], all_values[:count] = places, rows, cols, values
        call.set("entries", count)
        call.set("size", size)
        left = call()
        return cls(new_values[:left].copy(), new_rows[:left].copy(), starts[: size + 1].copy(), (size, size))

    def cols(self) -> np.ndarray:
        """The column of each entry."""
        return np.repeat(np.arange(self.shape[1]), np.diff(self.indptr))

    def as_lists(self) -> Columns:
        """The same with lists."""
        return self._replace(data=self.data.tolist(), indices=self.indices.tolist(), indptr=self.indptr.tolist())

    @property
    def nnz(self) -> int:
        """Numbers that are kept, as SciPy says it."""
        return len(self.data)

    def in_32_bits(self) -> Columns:
        """The same with places of 32 bits, which solvers in C take."""
        return self._replace(indices=self.indices.astype(np.int32), indptr=self.indptr.astype(np.int32))

    def for_scipy(self) -> scipy.sparse.csc_matrix:
        """The same, for solvers that ask for SciPy's own."""
        from scipy.sparse import csc_matrix

        return csc_matrix(self.in_32_bits()[:3], shape=self.shape)
