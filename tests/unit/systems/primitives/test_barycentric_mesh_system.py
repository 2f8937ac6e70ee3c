"""BarycentricMeshSystem: machine code with the numbers of its mesh."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.all import BarycentricMesh, BarycentricMeshSystem
from sheldrake.common.kernel import Kernel


@pytest.mark.parametrize(
    "grid", [[{0.0, 1.0, 3.0}, {-1.0, 0.5}], [{0.0}, {1.0, 2.0}], [{-1.0, 0.0, 2.0}, {4.0}, {0.0, 1.0, 2.0, 5.0}]]
)
def test_it_interpolates_as_its_mesh(grid):
    mesh = BarycentricMesh(grid)
    rng = np.random.default_rng(2)
    values = rng.normal(size=(3, mesh.get_num_mesh_points()))
    system = BarycentricMeshSystem(mesh, values)
    context = system.CreateDefaultContext()
    assert {type(row.calc) for row in context._store.layout.rows} == {Kernel}
    points = [rng.uniform(-2.0, 6.0, len(grid)) for _ in range(50)]
    points += [mesh.get_mesh_point(i) for i in range(mesh.get_num_mesh_points())]
    points += [np.full(len(grid), x) for x in (0.5, np.inf, -np.inf)]
    for point in points:
        system.get_input_port().FixValue(context, point)
        expected = mesh.Eval(values, point)
        np.testing.assert_allclose(system.get_output_port().Eval(context), expected, rtol=1e-14, atol=1e-14)


def test_it_has_no_other_scalars():
    system = BarycentricMeshSystem(BarycentricMesh([{0.0, 1.0}]), [[1.0, 2.0]])
    with pytest.raises(RuntimeError):
        system.ToAutoDiffXd()


@pytest.mark.parametrize("sizes", [(4,), (3, 1, 5), (2, 4, 3)])
def test_interpolants_of_many_points_have_the_bits_of_each(sizes):
    rng = np.random.default_rng(len(sizes))
    mesh = BarycentricMesh([set(rng.uniform(-1, 1, size)) for size in sizes])
    on_grid = mesh.get_all_mesh_points()
    points = np.hstack((rng.uniform(-1.3, 1.3, (len(sizes), 200)), on_grid, on_grid[:, :1] + 1e-17))
    indices, weights = mesh._interpolants_of_all(points)
    for point, found in zip(points.T, zip(indices.tolist(), weights.tolist())):
        assert found == mesh._interpolants(point.tolist())
