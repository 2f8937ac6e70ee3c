"""Signed distances of pairs of geometries, touching or not."""

from __future__ import annotations

from sheldrake.common._kernels.vec import add3, dot3, rotate, rotate_back, scale3, sub3
from sheldrake.common.kernel import Matrix, kernel

from .model import ELLIPSOID, HALF_SPACE, KIND, RADIUS, SPHERE, Z_AXIS, ContactTable, GeometryModel
from .separation import separation
from .sphere import point_shape
from .support import margin_of, support
from .table import column, emit, place_geometry, position_of, rotation_of


@kernel(outline=True)
def signed_distance(model, table, i, j, reach):
    """(phi, nhat_ji_W, p_WCi, p_WCj) of shapes i and j, the kind of i not after that of j."""
    if model.geometry[j, KIND] == HALF_SPACE:
        nhat = column(rotation_of(table, j), Z_AXIS)
        p_WCi = sub3(support(model, table, i, scale3(nhat, -1.0)), scale3(nhat, margin_of(model, i)))
        phi = dot3(nhat, sub3(p_WCi, position_of(table, j)))
        return phi, nhat, p_WCi, sub3(p_WCi, scale3(nhat, phi))
    if model.geometry[i, KIND] == SPHERE and model.geometry[j, KIND] <= ELLIPSOID:
        radius = model.size[i, RADIUS]
        R_WG = rotation_of(table, j)
        p_WG = position_of(table, j)
        p_WS = position_of(table, i)
        phi, gradient, nearest = point_shape(model, j, rotate_back(R_WG, sub3(p_WS, p_WG)))
        nhat = rotate(R_WG, gradient)
        return phi - radius, nhat, sub3(p_WS, scale3(nhat, radius)), add3(p_WG, rotate(R_WG, nearest))
    return separation(model, table, i, j, reach)


@kernel(top=True)
def find_distances(geometry_model: GeometryModel, X_WB: Matrix, reach: float, table: ContactTable) -> int:
    """Fills the table with one row for every pair whose signed distance is at most `reach`; its depth is -distance."""
    place_geometry(geometry_model, X_WB, table)
    table.count[0] = 0
    table.count[1] = 0
    for k in range(geometry_model.pair.shape[0]):
        i = geometry_model.pair[k, 0]
        j = geometry_model.pair[k, 1]
        if geometry_model.geometry[j, KIND] < geometry_model.geometry[i, KIND]:
            i = geometry_model.pair[k, 1]
            j = geometry_model.pair[k, 0]
        phi, nhat_ji, p_WCi, p_WCj = signed_distance(geometry_model, table, i, j, reach)
        if phi <= reach:
            emit(geometry_model, table, i, j, p_WCi, p_WCj, nhat_ji, -phi)
    return table.count[1]
