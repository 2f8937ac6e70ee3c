"""Sparse matrices for solvers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    import scipy.sparse


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
    def of_triplets(cls, rows: np.ndarray, cols: np.ndarray, values: np.ndarray, shape: tuple[int, int]) -> Columns:
        """Numbers at their places; those at one place add up."""
        order = np.lexsort((rows, cols))
        rows, cols, values = rows[order], cols[order], values[order]
        differs = np.ones(len(rows), bool)
        differs[1:] = (rows[1:] != rows[:-1]) | (cols[1:] != cols[:-1])
        if not differs.all():
            values = np.add.reduceat(values, np.flatnonzero(differs))
            rows, cols = rows[differs], cols[differs]
        return cls(values, rows, np.searchsorted(cols, np.arange(shape[1] + 1)), shape)

    def as_lists(self) -> Columns:
        """The same with lists."""
        return self._replace(data=self.data.tolist(), indices=self.indices.tolist(), indptr=self.indptr.tolist())

    def for_scipy(self) -> scipy.sparse.csc_matrix:
        """The same, for solvers that ask for SciPy's own."""
        from scipy.sparse import csc_matrix

        return csc_matrix((self.data, self.indices.astype(np.int32), self.indptr.astype(np.int32)), shape=self.shape)
