"""Between the vertices of a polytope and its half-spaces, by SciPy's Qhull where it is not flat."""

from __future__ import annotations

import numpy as np

from sheldrake.geometry.optimization import _plane_hulls
from sheldrake.geometry.optimization._affine_subspace import column_space, complement

_SAME = 1e-9  # Facets whose unit normals and offsets differ by less are one face.
_AT_ONCE = 10**6  # numbers that are compared in one step


def half_spaces(vertices: np.ndarray, tol: float) -> tuple[np.ndarray, np.ndarray]:
    """A and b of the hull of points, columns; a flat hull gets its plane as pairs of rows."""
    start = vertices[:, 0]
    basis = column_space(vertices - start[:, None], tol)
    across = complement(basis)
    local = basis.T @ (vertices - start[:, None])
    if basis.shape[1] == 0:
        A, b = np.zeros((0, 0)), np.zeros(0)
    elif basis.shape[1] == 1:
        A, b = np.array([[1.0], [-1.0]]), np.array([local.max(), -local.min()])
    elif basis.shape[1] == 2:
        A, b = _plane_hulls.edges(local.T)
    else:
        from scipy.spatial import ConvexHull

        rows = ConvexHull(local.T).equations
        rows = _distinct(rows, rows[:, -1])
        A, b = rows[:, :-1], -rows[:, -1]
    A = np.vstack((A @ basis.T, across.T, -across.T))
    return A, np.concatenate((b, np.zeros(2 * across.shape[1]))) + A @ start


def _distinct(rows: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Rows without those that repeat an earlier one, up to a part of the greatest of the sizes."""
    tol, step = _SAME * max(1.0, np.abs(sizes).max()), max(1, _AT_ONCE // rows.size)
    blocks = (np.abs(rows[i : i + step, None] - rows) <= tol for i in range(0, len(rows), step))
    first = np.concatenate([same.all(axis=2).argmax(axis=1) for same in blocks])
    return rows[first == np.arange(len(rows))]


def extreme_points(vertices: np.ndarray, tol: float) -> np.ndarray:
    """The points that are corners of the hull, columns in order."""
    if vertices.shape[1] < 2:
        return vertices
    start = vertices[:, 0]
    basis = column_space(vertices - start[:, None], tol)
    local = basis.T @ (vertices - start[:, None])
    if basis.shape[1] == 0:
        return vertices[:, :1]
    if basis.shape[1] == 1:
        return vertices[:, [int(local.argmin()), int(local.argmax())]]
    if basis.shape[1] == 2:
        return vertices[:, _plane_hulls.corners((local if len(vertices) > 2 else vertices).T)]
    from scipy.spatial import ConvexHull

    return vertices[:, ConvexHull(local.T).vertices]


def volume(vertices: np.ndarray, tol: float) -> float:
    """Volume of the hull of points, columns: length or area in few dimensions."""
    dimension = len(vertices)
    if vertices.shape[1] <= dimension or column_space(vertices - vertices[:, :1], tol).shape[1] < dimension:
        return 0.0
    if dimension == 1:
        return float(np.ptp(vertices))
    if dimension == 2:
        return _plane_hulls.area(vertices.T)
    from scipy.spatial import ConvexHull

    return float(ConvexHull(vertices.T).volume)


def vertices_of(A: np.ndarray, b: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """The corners of A x <= b, columns, around a point in its interior."""
    if A.shape[1] == 1:
        up, down = A[:, 0] > 0.0, A[:, 0] < 0.0
        return np.array([[np.max(b[down] / A[down, 0]), np.min(b[up] / A[up, 0])]])
    if A.shape[1] == 2:
        corners = _plane_hulls.meetings(A, b, inside)
        return _distinct(corners, corners).T
    from scipy.spatial import HalfspaceIntersection

    corners = HalfspaceIntersection(np.column_stack((A, -b)), inside).intersections
    corners = corners[np.isfinite(corners).all(axis=1)]
    return _distinct(corners, corners).T
