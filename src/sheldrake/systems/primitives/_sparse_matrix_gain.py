"""A gain with a sparse matrix."""

from __future__ import annotations

from typing import Any

from sheldrake.systems.framework import LeafSystem


class SparseMatrixGain(LeafSystem):
    """y = D u.

    Args:
        D: scipy.sparse.csc_matrix of shape (k, m).
    """

    _generic = True

    def __init__(self, D: Any):
        super().__init__()
        self._D = D.tocsc().copy()
        k, m = self._D.shape
        self.DeclareVectorInputPort("u", m)
        self.DeclareVectorOutputPort("y", k, self._calc)

    def D(self) -> Any:
        """The matrix."""
        return self._D.copy()

    def set_D(self, D: Any) -> None:
        """Replaces the matrix by one of the same shape."""
        if D.shape != self._D.shape:
            raise RuntimeError(f"SparseMatrixGain.set_D(): D must have shape {self._D.shape}, not {D.shape}.")
        self._D = D.tocsc().copy()

    def _calc(self, context: Any, output: Any) -> None:
        u = self.get_input_port(0).Eval(context)
        if u.dtype == object:
            output.SetFromVector(self._D.toarray() @ u)
        else:
            output.SetFromVector(self._D @ u)
