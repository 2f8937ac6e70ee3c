"""A function on a grid as a system."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.systems.framework import LeafSystem
from sheldrake.systems.primitives._kernels.mesh import Corners, Mesh, interpolate

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.math import BarycentricMesh
    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._vector import BasicVector


class BarycentricMeshSystem(LeafSystem):
    """The value of a mesh's function at the input.

    Args:
        mesh: A BarycentricMesh.
        output_values: Values at the mesh's points, shape (number of outputs, number of points).
    """

    def __init__(self, mesh: BarycentricMesh, output_values: ArrayLike, /):
        super().__init__()
        values = np.array(output_values, float)
        if values.ndim != 2 or values.shape[1] != mesh.get_num_mesh_points():
            raise RuntimeError(
                f"BarycentricMeshSystem: output_values must have one column for each of the "
                f"{mesh.get_num_mesh_points()} points of the mesh, not shape {values.shape}."
            )
        self._mesh, self._values = mesh, values
        self.DeclareVectorInputPort("u0", mesh.get_input_size())
        self.DeclareVectorOutputPort("y0", len(values), self._calc)
        n = mesh.get_input_size()
        self._declare_scratch(Corners(np.zeros(n), np.zeros(n, np.int64)))
        self._compute_natively(0, interpolate)

    def _kernel_models(self, root: Any) -> dict:
        grid = [sorted(coordinates) for coordinates in self._mesh.get_input_grid()]
        counts = np.array([len(coordinates) for coordinates in grid], np.int64)
        firsts, strides = np.cumsum(counts) - counts, np.cumprod(counts) // counts
        axes = np.stack([firsts, counts, strides], axis=1)
        return {"mesh_model": Mesh(axes, np.concatenate(grid), np.ascontiguousarray(self._values))}

    def get_mesh(self) -> BarycentricMesh:
        """The mesh."""
        return self._mesh

    def get_output_values(self) -> np.ndarray:
        """Values at the mesh's points."""
        return self._values.copy()

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._mesh.Eval(self._values, self.get_input_port().Eval(context)))
