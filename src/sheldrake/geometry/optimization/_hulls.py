"""Between the vertices of a polytope and its half-spaces, by SciPy's Qhull."""

from __future__ import annotations

import numpy as np

from sheldrake.geometry.optimization._affine_subspace import column_space, complement

_SAME = 1e-9  # Facets whose unit normals and offsets differ by less are one face.


def half_spaces(vertices: np.ndarray, tol: float) -> tuple[np.ndarray, np.ndarray]:
    """A and b of the hull of points, columns; a flat hull gets its plane as pairs of rows."""
    from scipy.spatial import ConvexHull

    start = vertices[:, 0]
    basis = column_space(vertices - start[:, None], tol)
    across = complement(basis)
    local = basis.T @ (vertices - start[:, None])
    if basis.shape[1] == 0:
        A, b = np.zeros((0, 0)), np.zeros(0)
    elif basis.shape[1] == 1:
        A, b = np.array([[1.0], [-1.0]]), np.array([local.max(), -local.min()])
    else:
        rows = _distinct(ConvexHull(local.T).equations)
        A, b = rows[:, :-1], -rows[:, -1]
    A = np.vstack((A @ basis.T, across.T, -across.T))
    return A, np.concatenate((b, np.zeros(2 * across.shape[1]))) + A @ start


def _distinct(rows: np.ndarray) -> np.ndarray:
    """Rows without those that repeat an earlier one."""
    kept: list[np.ndarray] = []
    size = max(1.0, np.abs(rows[:, -1]).max())
    for row in rows:
        if not kept or np.abs(np.array(kept) - row).max(axis=1).min() > _SAME * size:
            kept.append(row)
    return np.array(kept)


def extreme_points(vertices: np.ndarray, tol: float) -> np.ndarray:
    """The points that are corners of the hull, columns in order."""
    from scipy.spatial import ConvexHull

    if vertices.shape[1] < 2:
        return vertices
    start = vertices[:, 0]
    basis = column_space(vertices - start[:, None], tol)
    local = basis.T @ (vertices - start[:, None])
    if basis.shape[1] == 0:
        return vertices[:, :1]
    if basis.shape[1] == 1:
        return vertices[:, [int(local.argmin()), int(local.argmax())]]
    return vertices[:, ConvexHull(local.T).vertices]


def vertices_of(A: np.ndarray, b: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """The corners of A x <= b, columns, around a point in its interior."""
    from scipy.spatial import HalfspaceIntersection

    if A.shape[1] == 1:
        up, down = A[:, 0] > 0.0, A[:, 0] < 0.0
        return np.array([[np.max(b[down] / A[down, 0]), np.min(b[up] / A[up, 0])]])
    corners = HalfspaceIntersection(np.column_stack((A, -b)), inside).intersections
    corners = corners[np.isfinite(corners).all(axis=1)]
    kept: list[np.ndarray] = []
    size = max(1.0, np.abs(corners).max())
    for corner in corners:
        if not kept or np.abs(np.array(kept) - corner).max(axis=1).min() > _SAME * size:
            kept.append(corner)
    return np.array(kept).T
