"""A random vector through an affine map."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common import CalcProbabilityDensity, RandomDistribution
from sheldrake.common._checked import checked
from sheldrake.systems.framework import LeafSystem
from sheldrake.systems.framework._port_getters import input_port, output_port

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar, Scalars
    from sheldrake.systems.framework import Context, FixedInputPortValue
    from sheldrake.systems.framework._vector import BasicVector


class LinearTransformDensity(LeafSystem):
    """w_out = A w_in + b, and the density of w_out where the elements of w_in are independent.

    Args:
        distribution: Of each element of w_in.
        input_size: Size of w_in.
        output_size: Size of w_out.
    """

    _generic = True

    def __init__(self, distribution: RandomDistribution, input_size: int, output_size: int):
        super().__init__()
        self._distribution, self._shape = distribution, (int(output_size), int(input_size))
        self.DeclareVectorInputPort("w_in", self._shape[1], distribution)
        self.DeclareVectorInputPort("A", self._shape[0] * self._shape[1])
        self.DeclareVectorInputPort("b", self._shape[0])
        self._inputs[2].optional = True
        self.DeclareVectorOutputPort("w_out", self._shape[0], self._calc)
        self.DeclareVectorOutputPort("w_out_density", 1, self._calc_density)

    def get_distribution(self) -> RandomDistribution:
        """Distribution of each element of w_in."""
        return self._distribution

    get_input_port_w_in = input_port(0, "The input w_in.")
    get_input_port_A = input_port(1, "The input A, its columns one after the other.")
    get_input_port_b = input_port(2, "The input b; zero if it has no value.")
    get_output_port_w_out = output_port(0, "The output w_out.")
    get_output_port_w_out_density = output_port(1, "The output with the density of w_out.")

    @checked
    def FixConstantA(self, context: Context, A: Scalars) -> FixedInputPortValue:
        """Fixes A, shape (output_size, input_size)."""
        A = np.asarray(A)
        if A.shape != self._shape:
            raise RuntimeError(
                f"LinearTransformDensity.FixConstantA(): A must have shape {self._shape}, not {A.shape}."
            )
        return self.get_input_port_A().FixValue(context, A.reshape(-1, order="F"))

    @checked
    def FixConstantB(self, context: Context, b: Scalars) -> FixedInputPortValue:
        """Fixes b, shape (output_size,)."""
        return self.get_input_port_b().FixValue(context, b)

    def _matrix(self, context: Context) -> np.ndarray:
        return self.get_input_port_A().Eval(context).reshape(self._shape, order="F")

    def _calc(self, context: Context, output: BasicVector) -> None:
        w = self._matrix(context) @ self.get_input_port_w_in().Eval(context)
        port = self.get_input_port_b()
        output.SetFromVector(w + port.Eval(context) if port.HasValue(context) else w)

    def CalcDensity(self, context: Context) -> Scalar:
        """Density of w_out.

        Raises:
            RuntimeError: A is not invertible.
        """
        from sheldrake.systems.framework._vector import plain

        A = np.array([[plain(x) for x in row] for row in self._matrix(context)], float)
        if A.shape[0] != A.shape[1] or np.linalg.matrix_rank(A) < len(A):
            raise RuntimeError("CalcDensity() requires the matrix A to be invertible.")
        density = CalcProbabilityDensity(self._distribution, self.get_input_port_w_in().Eval(context))
        return density / abs(float(np.linalg.det(A)))

    def _calc_density(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([self.CalcDensity(context)])
