"""Linear and semidefinite programs about A x <= b."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.geometry.optimization._affine import Affine, Rows
from sheldrake.solvers import MathematicalProgram, MathematicalProgramResult, Solve
from sheldrake.solvers._engines.clarabel import minimize_on_cones
from sheldrake.solvers._engines.conic import Cone
from sheldrake.solvers._engines.dense_quadratic import solve_dense
from sheldrake.solvers._engines.linear import INFEASIBLE, OPTIMAL, maximize

_FAR = 1e4  # How far away a polar point may be, of points of size one, that its place is known to 1e-12 of their size.
_EXACT = 1e-12
_FEASIBLE = 1e-7  # By how much rows may be violated, as for the linear programs.


def solved(call: str, prog: MathematicalProgram, hint: str = "") -> MathematicalProgramResult:
    """The solution of a program.

    Raises:
        RuntimeError: the solver fails.
    """
    result = Solve(prog)
    if not result.is_success():
        raise RuntimeError(f"{call}(): the solver failed: {result.get_solution_result().name}.{hint}")
    return result


def box_rows(lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A and b of lower <= x <= upper."""
    both = np.eye(lower.size)
    return np.vstack((both, -both)), np.concatenate((upper, -lower))


def box_of(A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """The bounds that the rows are, infinite where there are none; None if a row has several variables.

    Where there is no x at all, a lower bound is above its upper bound.
    """
    if np.count_nonzero(A, axis=1).max(initial=0) > 1:
        return None
    low, high = np.full(A.shape[1], -np.inf), np.full(A.shape[1], np.inf)
    i, j = np.nonzero(A)
    entries = A[i, j]
    ends, is_upper = b[i] / entries, entries > 0.0
    np.minimum.at(high, j[is_upper], ends[is_upper])
    np.maximum.at(low, j[~is_upper], ends[~is_upper])
    says_nothing = np.ones(len(b), dtype=bool)
    says_nothing[i] = False
    if np.any(b[says_nothing] < -_FEASIBLE):  # 0 x <= a negative number
        low[:], high[:] = np.inf, -np.inf
    nearly = (low > high) & (low <= high + _FEASIBLE)
    middle = 0.5 * (low[nearly] + high[nearly])
    low[nearly], high[nearly] = middle, middle
    return low, high


def largest(A: np.ndarray, b: np.ndarray, direction: np.ndarray) -> float:
    """The greatest direction'x; infinite if unbounded, minus infinity if there is no x."""
    if not len(b):
        return np.inf if np.any(direction) else 0.0
    box = box_of(A, b)
    if box is not None:
        low, high = box
        if np.any(low > high):
            return -np.inf
        turned = direction != 0.0
        return float(np.sum(direction[turned] * np.where(direction > 0.0, high, low)[turned]))
    found = maximize(direction, A, b)
    if found.x is not None:
        return float(direction @ found.x)
    return -np.inf if found.status == INFEASIBLE or point(A, b) is None else np.inf


def point(A: np.ndarray, b: np.ndarray) -> np.ndarray | None:
    """Some x; None if there is none."""
    if not len(b):
        return np.zeros(A.shape[1])
    box = box_of(A, b)
    if box is not None:
        return None if np.any(box[0] > box[1]) else np.clip(np.zeros(A.shape[1]), *box)
    return maximize(np.zeros(A.shape[1]), A, b).x


class Image(NamedTuple):
    """The points D w + p of all w with A w <= b."""

    D: np.ndarray
    p: np.ndarray
    A: np.ndarray
    b: np.ndarray


def hull(vertices: np.ndarray) -> Image:
    """The convex hull of columns: weights that are not negative and sum to one."""
    n, count = vertices.shape
    ones = np.ones((1, count))
    return Image(
        vertices, np.zeros(n), np.vstack((-np.eye(count), ones, -ones)), np.append(np.zeros(count), [1.0, -1.0])
    )


def meet(one: Image, other: Image) -> bool:
    """Whether two images have a point in common."""
    D, apart = np.hstack((one.D, -other.D)), other.p - one.p
    (m, n), (k, _) = one.A.shape, other.A.shape
    A = np.zeros((m + k, D.shape[1]))
    A[:m, :n], A[m:, n:] = one.A, other.A
    return point(np.vstack((A, D, -D)), np.concatenate((one.b, other.b, apart, -apart))) is not None


def hull_meets(vertices: np.ndarray, A: np.ndarray, b: np.ndarray) -> bool:
    """Whether the hull of columns has a point x with A x <= b."""
    if not len(b):
        return True
    heights = A @ vertices
    beyond = heights - b[:, None]
    if beyond.min(axis=1).max() > _FEASIBLE * (1.0 + np.abs(heights).max()):  # a face with all of them behind it
        return False
    if beyond.max(axis=0).min() <= 0.0:  # one of them is such a point
        return True
    image = hull(vertices)
    return maximize(np.zeros(len(image.b) - 2), np.vstack((heights, image.A)), np.append(b, image.b)).x is not None


def nearest_of_hull(vertices: np.ndarray, A: np.ndarray, center: np.ndarray) -> np.ndarray | None:
    """The point of the hull of columns with the least |A (x - center)|; None where this way does not find it.

    With p_k = A (v_k - center), the y with the least |y| among those with p_k'y >= 1 for all k is y = x / |x|^2 for the
    point x of the hull of all p_k that is nearest to zero: the plane p'y = 1 is polar to it. There is no such y where
    zero is in the hull, and it is far away where zero is nearly in it.
    """
    n, count = vertices.shape
    if not count or A.shape != (n, n) or not np.isfinite(vertices).all():
        return None
    points = A @ (vertices - center[:, None])
    size = np.abs(points).max()
    if not 0.0 < size < np.inf:
        return None
    y = solve_dense(np.eye(n), np.zeros(n), points.T / -size, np.full(count, -1.0))
    square = 0.0 if y is None else y @ y
    if not 0.0 < square < _FAR**2:
        return None
    nearest = y * (size / square)
    try:
        x = np.linalg.solve(A, nearest)
    except np.linalg.LinAlgError:
        return None
    left = A @ x - nearest
    return x + center if left @ left <= (_EXACT * size) ** 2 else None


def distance_to_hull(vertices: np.ndarray, x: np.ndarray) -> float:
    """By how much a coordinate of x must be changed at least to be in the hull of columns; nan if that is not found.

    It is by how much a direction u - v, of entries that sum to one, tells x from all vertices.
    """
    n, count = vertices.shape
    apart = (vertices - x[:, None]).T
    rows = np.hstack((apart, -apart, -np.ones((count, 1))))
    signs = -np.eye(2 * n + 1)[:-1]
    length = np.append(np.ones(2 * n), 0.0)
    A, b = np.vstack((rows, signs, length)), np.append(np.zeros(count + 2 * n), 1.0)
    found = maximize(-np.eye(2 * n + 1)[-1], A, b)
    return np.nan if found.x is None else -float(found.x[-1])


def is_bounded(A: np.ndarray, b: np.ndarray) -> bool:
    """Whether it is empty, or the rows span the space and no direction stays beneath all of them."""
    box = box_of(A, b)
    if box is not None:
        return bool(np.isfinite(box).all() or np.any(box[0] > box[1]))
    A, b = A[b < np.inf], b[b < np.inf]
    m, n = A.shape
    spans = m > n and np.linalg.matrix_rank(A) == n
    if spans and maximize(-A.sum(axis=0), A, np.zeros(m)).status == OPTIMAL:
        return True
    return point(A, b) is None


def redundant(A: np.ndarray, b: np.ndarray, tol: float) -> list[int]:
    """Rows that the others, without those found before, imply up to a tolerance."""
    keep = _last_of_equals(A, b)
    open_ = keep.copy()
    open_[keep] = ~_met_alone(A[keep], b[keep], tol)
    for i in np.flatnonzero(open_):
        keep[i] = False
        loose = np.append(b[keep], b[i] + 1.0)  # One more than wanted bounds the program.
        keep[i] = largest(np.vstack((A[keep], A[i])), loose, A[i]) > b[i] + tol
    return [int(i) for i in np.flatnonzero(~keep)]


def implied(A: np.ndarray, b: np.ndarray, keep: list[int], candidates: list[int], tol: float = 1e-9) -> set[int]:
    """Which of the candidates the other rows that are kept imply, one after the other, up to a tolerance."""
    out: set[int] = set()
    for j in candidates:
        rest = [k for k in keep if k != j and k not in out]
        if largest(A[rest], b[rest], A[j]) <= b[j] + tol:
            out.add(j)
    return out


def _last_of_equals(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Which rows are not said again, maybe at another scale, by a later one."""
    rows = np.column_stack((A, b))
    lengths = np.linalg.norm(A, axis=1)
    if b.size and lengths.all():
        rows = rows / lengths[:, None]
    last = np.zeros(b.size, dtype=bool)
    last[list({row.tobytes(): i for i, row in enumerate(rows + 0.0)}.values())] = True
    return last


def _met_alone(A: np.ndarray, b: np.ndarray, tol: float) -> np.ndarray:
    """Rows that a ray from inside meets before all others: without them it would go on, beyond the tolerance.

    Not all such rows are found, but each that is saves a linear program.
    """
    found = np.zeros(b.size, dtype=bool)
    try:
        room = b - A @ (center := chebyshev_center(A, b))
    except RuntimeError:
        return found
    if b.size < 2 or not np.isfinite(center).all() or room.min() <= tol:
        return found
    rays = np.concatenate((A, np.random.default_rng(0).normal(size=(16 * b.size, A.shape[1]))))
    slopes = rays @ A.T
    with np.errstate(divide="ignore"):
        reach = np.where(slopes > 0.0, room / slopes, np.inf)
    first, each = reach.argmin(axis=1), np.arange(len(rays))
    nearest = reach[each, first]
    reach[each, first] = np.inf
    with np.errstate(invalid="ignore"):
        beyond = slopes[each, first] * (reach.min(axis=1) - nearest)
    found[first[np.isfinite(nearest) & (beyond > 2.0 * tol)]] = True
    return found


def chebyshev_center(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The center of a largest ball inside.

    Raises:
        RuntimeError: there is none.
    """
    lengths = np.linalg.norm(A, axis=1)
    n = A.shape[1]
    rows = np.vstack((np.column_stack((A, lengths)), -np.eye(1, n + 1, n)))
    found = maximize(np.eye(n + 1)[n], rows, np.append(b, 0.0))
    if found.x is None:
        raise RuntimeError(
            f"ChebyshevCenter(): the linear program has no solution ({found}). Is it unbounded, or without interior?"
        )
    return found.x[:n]


def inscribed_ellipsoid(A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """B and d of the largest B u + d, |u| <= 1, inside: max log det B, |B a_i| + a_i'd <= b_i.

    S. Boyd and L. Vandenberghe, "Convex Optimization", 2004, section 8.4.2.

    Raises:
        RuntimeError: there is none.
    """
    lengths = np.linalg.norm(A, axis=1)
    lengths[lengths == 0.0] = 1.0
    rows, bounds = A / lengths[:, None], b / lengths
    found = _inscribed_on_cones(rows, bounds)
    return _inscribed_by_program(rows, bounds) if found is None else found


def _inscribed_on_cones(rows: np.ndarray, bounds: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """The same as conic program: max sum t_i, t_i <= log Z_ii, (B, Z; Z', diag Z) semidefinite, Z below its diagonal 0.

    Unknowns are B and Z, their upper triangles by columns, then d and t; None if no solution is found.
    """
    m, n = rows.shape
    j, i = np.tril_indices(n)  # so i <= j, column after column
    count, diagonal = i.size, np.flatnonzero(i == j)
    B, Z = np.arange(count), np.arange(count) + count
    d, t = np.arange(n) + 2 * count, np.arange(n) + 2 * count + n
    place = np.zeros((n, n), dtype=np.int64)
    place[i, j] = place[j, i] = B

    balls = np.zeros((m, n + 1, 2 * count + 2 * n))  # (b - a'd, B a) is in a cone
    balls[:, 0, d] = rows
    for k in range(n):
        balls[:, k + 1, place[k]] = -rows
    q, p = np.tril_indices(2 * n)  # of the semidefinite matrix, likewise
    big = np.zeros((q.size, 2 * count + 2 * n))
    scale = np.where(p == q, -1.0, -np.sqrt(2.0))
    left, corner = np.flatnonzero(q < n), np.flatnonzero((p < n) & (q >= n))
    big[left, place[p[left], q[left]]] = scale[left]
    corner = corner[p[corner] >= q[corner] - n]  # Z' where it is not zero
    big[corner, count + place[q[corner] - n, p[corner]]] = scale[corner]
    last = np.flatnonzero((p == q) & (q >= n))
    big[last, Z[diagonal]] = scale[last]
    logs = np.zeros((n, 3, 2 * count + 2 * n))  # exp(t) <= Z_ii
    logs[np.arange(n), 0, t] = logs[np.arange(n), 2, Z[diagonal]] = -1.0

    constants = np.zeros((m, n + 1)), np.zeros(q.size), np.tile([0.0, 1.0, 0.0], n)
    constants[0][:, 0] = bounds
    M = np.concatenate((balls.reshape(-1, balls.shape[2]), big, logs.reshape(-1, logs.shape[2])))
    gain = np.zeros(M.shape[1])
    gain[t] = -1.0
    cones = m * [Cone("second_order", n + 1)] + [Cone("psd", 2 * n)] + n * [Cone("exponential", 3)]
    x = minimize_on_cones(gain, M, np.concatenate([c.ravel() for c in constants]), cones)
    return None if x is None else (x[place], x[d])


def _inscribed_by_program(rows: np.ndarray, bounds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same by whatever solver is there."""
    n = rows.shape[1]
    prog = MathematicalProgram()
    B = prog.NewSymmetricContinuousVariables(n, "B")
    center = prog.NewContinuousVariables(n, "d")
    vars = prog.decision_variables()
    places = {v.get_id(): k for k, v in enumerate(vars)}
    M, z = np.zeros((len(rows), n + 1, len(vars))), np.zeros((len(rows), n + 1))
    M[:, 0, -n:], z[:, 0] = -rows, bounds
    for i in range(n):
        M[:, i + 1, [places[v.get_id()] for v in B[i]]] = rows
    prog.AddMaximizeLogDeterminantCost(B)
    into = Rows(prog)
    for cone, constant in zip(M, z):
        into.lorentz(Affine([(cone, vars)], constant))
    result = solved("MaximumVolumeInscribedEllipsoid", prog, " Is it unbounded, or without interior?")
    return np.array(result.GetSolution(B), dtype=float), result.GetSolution(center)


def inscribed_image(
    A: np.ndarray, b: np.ndarray, outer_A: np.ndarray, outer_b: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """T and t of the largest T x + t, A x <= b, inside another polyhedron: L >= 0, L A = C T, L b <= d - C t.

    Raises:
        RuntimeError: there is none.
    """
    n, m, k = A.shape[1], b.size, outer_b.size
    prog = MathematicalProgram()
    T = prog.NewSymmetricContinuousVariables(n, "T")
    t = prog.NewContinuousVariables(n, "t")
    L = prog.NewContinuousVariables(k, m, "L")
    prog.AddBoundingBoxConstraint(0.0, np.inf, L.ravel())
    prog.AddMaximizeLogDeterminantCost(T)
    for i in range(k):
        for j in range(n):
            e = np.concatenate((A[:, j], -outer_A[i]))
            prog.AddLinearEqualityConstraint(e.reshape(1, -1), np.zeros(1), np.concatenate((L[i], T[:, j])))
        e = np.concatenate((b, outer_A[i]))
        prog.AddLinearConstraint(e.reshape(1, -1), [-np.inf], [outer_b[i]], np.concatenate((L[i], t)))
    result = solved("MaximumVolumeInscribedAffineTransformation", prog)
    return np.array(result.GetSolution(T), dtype=float), result.GetSolution(t)
