"""A gain with a sparse matrix."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sheldrake.common._checked import checked
from sheldrake.systems.framework import LeafSystem

if TYPE_CHECKING:
    import scipy.sparse
    from numpy.typing import ArrayLike

    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._vector import BasicVector


def _csc(D: scipy.sparse.spmatrix | ArrayLike) -> scipy.sparse.csc_matrix:
    """A matrix of one's own, of floats."""
    from scipy.sparse import csc_matrix

    return csc_matrix(D, dtype=float, copy=True)


class SparseMatrixGain(LeafSystem):
    """y = D u.

    Args:
        D: A sparse matrix of SciPy, or a dense one, shape (k, m).
    """

    _generic = True

    def __init__(self, D: scipy.sparse.spmatrix | ArrayLike):
        super().__init__()
        self._D = _csc(D)
        k, m = self._D.shape
        self.DeclareVectorInputPort("u", m)
        self.DeclareVectorOutputPort("y", k, self._calc)

    def D(self) -> scipy.sparse.csc_matrix:
        """The matrix."""
        return self._D.copy()

    @checked
    def set_D(self, D: scipy.sparse.spmatrix | ArrayLike) -> None:
        """Replaces the matrix by one of the same shape."""
        new = _csc(D)
        if new.shape != self._D.shape:
            raise RuntimeError(f"SparseMatrixGain.set_D(): D must have shape {self._D.shape}, not {new.shape}.")
        self._D = new

    def _calc(self, context: Context, output: BasicVector) -> None:
        u = self.get_input_port(0).Eval(context)
        if u.dtype == object:
            output.SetFromVector(self._D.toarray() @ u)
        else:
            output.SetFromVector(self._D @ u)
