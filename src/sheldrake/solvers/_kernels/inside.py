"""Whether points are within bounds, of themselves or of rows; no number is not."""

from __future__ import annotations

from sheldrake.common.kernel import Vector, kernel

DO_NOT_FIT = 1


@kernel(top=True, strict=True)
def inside_box(lower: Vector, upper: Vector, x: Vector, tol: float, inside: Vector) -> int:
    """Whether lower - tol <= x <= upper + tol; a status."""
    n = x.shape[0]
    if n == 0 or lower.shape[0] != n or upper.shape[0] != n:
        return DO_NOT_FIT
    inside[0] = 1.0
    for i in range(n):
        if not (x[i] >= lower[i] - tol and x[i] <= upper[i] + tol):
            inside[0] = 0.0
    return 0


@kernel
def row_times(A, i, x):
    """Row i of a matrix given by rows, times x."""
    n = x.shape[0]
    y = 0.0
    for j in range(n):
        y += A[i * n + j] * x[j]
    return y


@kernel(top=True, strict=True)
def inside_halfspaces(A: Vector, b: Vector, x: Vector, tol: float, inside: Vector) -> int:
    """Whether A x <= b + tol, A by rows; a status."""
    m, n = b.shape[0], x.shape[0]
    if n == 0 or A.shape[0] != m * n:
        return DO_NOT_FIT
    inside[0] = 1.0
    for i in range(m):
        if not row_times(A, i, x) <= b[i] + tol:
            inside[0] = 0.0
    return 0


@kernel(top=True, strict=True)
def inside_rows(A: Vector, lower: Vector, upper: Vector, x: Vector, tol: float, inside: Vector) -> int:
    """Whether lower - tol <= A x <= upper + tol, A by rows; a status."""
    m, n = lower.shape[0], x.shape[0]
    if n == 0 or upper.shape[0] != m or A.shape[0] != m * n:
        return DO_NOT_FIT
    inside[0] = 1.0
    for i in range(m):
        y = row_times(A, i, x)
        if not (y >= lower[i] - tol and y <= upper[i] + tol):
            inside[0] = 0.0
    return 0


@kernel(top=True, strict=True)
def inside_ellipsoid(A: Vector, center: Vector, x: Vector, tol: float, inside: Vector) -> int:
    """Whether |A (x - center)|^2 <= 1 + tol, A by rows; a status."""
    n = x.shape[0]
    if n == 0 or center.shape[0] != n or A.shape[0] % n != 0:
        return DO_NOT_FIT
    square = 0.0
    for i in range(A.shape[0] // n):
        y = 0.0
        for j in range(n):
            y += A[i * n + j] * (x[j] - center[j])
        square += y * y
    inside[0] = 1.0 if square <= 1.0 + tol else 0.0
    return 0
