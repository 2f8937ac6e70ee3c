"""Inner approximations of polyhedra by fewer faces."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sheldrake.geometry.optimization import _polyhedron_programs as programs

if TYPE_CHECKING:
    from sheldrake.geometry.optimization import HPolyhedron

_TOLERANCE = 1e-9


class Settings(NamedTuple):
    """What `HPolyhedron.SimplifyByIncrementalFaceTranslation` is asked; see there."""

    min_volume_ratio: float
    max_iterations: int
    points: np.ndarray
    others: list
    keep_whole_intersection: bool
    padding: float
    random_seed: int


def check(polyhedron: HPolyhedron, settings: Settings) -> None:
    """Refuses settings that are out of range.

    Raises:
        RuntimeError: one of them is.
    """
    call = "SimplifyByIncrementalFaceTranslation()"
    for name, value, good, rule in (
        ("min_volume_ratio", settings.min_volume_ratio, 0.0 < settings.min_volume_ratio <= 1.0, "in (0, 1]"),
        ("max_iterations", settings.max_iterations, settings.max_iterations > 0, "positive"),
        ("intersection_padding", settings.padding, settings.padding >= 0.0, "not negative"),
    ):
        if not good:
            raise RuntimeError(f"{call}: {name} must be {rule}, got {value}.")
    if not polyhedron.IsBounded():
        raise RuntimeError(f"{call}: the polyhedron is unbounded.")
    if not keeps(polyhedron, settings._replace(others=[])):
        raise RuntimeError(f"{call}: a point to contain is outside.")
    if not keeps(polyhedron, settings):
        raise RuntimeError(f"{call}: an intersecting polytope does not meet the polyhedron.")


def keeps(polyhedron: HPolyhedron, settings: Settings) -> bool:
    """Whether a polyhedron contains the points and meets the others."""
    inside = np.all(polyhedron.A() @ settings.points <= polyhedron.b()[:, None] + _TOLERANCE)
    return bool(inside) and all(polyhedron.IntersectsWith(other) for other in settings.others)


def with_fewer_faces(polyhedron: HPolyhedron, settings: Settings) -> tuple[np.ndarray, np.ndarray]:
    """A and b where faces moved inwards, each as little as makes other faces redundant, and those are dropped.

    Args:
        polyhedron: No row of it is redundant.
        settings: What is asked.
    """
    A, b = polyhedron.A(), polyhedron.b()
    # What contains a scaled copy, wherever it is put, has at least its part of the volume.
    copy = settings.min_volume_ratio ** (1.0 / A.shape[1]) * b
    others = [(other.A(), other.b()) for other in settings.others]
    least = np.max(A @ settings.points, axis=1, initial=-np.inf)
    for A_other, b_other in others if settings.keep_whole_intersection else []:
        both = (np.vstack((A, A_other)), np.concatenate((b, b_other)))
        least = np.maximum(least, [programs.largest(*both, row) for row in A])
    keep, rng = list(range(len(b))), np.random.default_rng(settings.random_seed)
    for iteration in range(int(settings.max_iterations)):
        before, order = len(keep), keep.copy()
        if iteration:
            rng.shuffle(order)
        for i in order:
            if i in keep:
                rest = [k for k in keep if k != i]
                room = copy[i] - programs.largest(A[rest], b[rest] - copy[rest], -A[i])
                keep, b = _translated(A, b, keep, i, max(least[i], room), others, settings.padding)
        if len(keep) == before:
            break
    return A[keep], b[keep]


def _translated(
    A: np.ndarray,
    b: np.ndarray,
    keep: list[int],
    i: int,
    least: float,
    others: list[tuple[np.ndarray, np.ndarray]],
    padding: float,
) -> tuple[list[int], np.ndarray]:
    """The faces that are left, and all bounds, after face i moved as far as makes most others redundant."""
    reached = [(_redundant_from(A, b, keep, i, j), j) for j in keep if j != i]
    reached = sorted((pair for pair in reached if pair[0] >= least - _TOLERANCE), reverse=True)
    for count in range(len(reached), 0, -1):
        moved = b.copy()
        moved[i] = min(b[i], max(least, reached[count - 1][0]))
        left = [k for k in keep if k not in programs.implied(A, moved, keep, [j for _, j in reached[:count]])]
        if len(left) < len(keep) and all(_meet(A[left], moved[left], C, d, padding) for C, d in others):
            return left, moved
    return keep, b


def _redundant_from(A: np.ndarray, b: np.ndarray, keep: list[int], i: int, j: int) -> float:
    """The greatest b_i with which face j is redundant: the least a_i x where a_j x >= b_j and the others hold."""
    rest = [k for k in keep if k not in (i, j)]
    rows, bounds = np.vstack((A[rest], -A[j])), np.append(b[rest], -b[j])
    return -programs.largest(rows, bounds, -A[i])


def _meet(A: np.ndarray, b: np.ndarray, A_other: np.ndarray, b_other: np.ndarray, padding: float) -> bool:
    """Whether a point of the other polyhedron is the center of a ball inside A x <= b."""
    inside = b - padding * np.linalg.norm(A, axis=1)
    return programs.point(np.vstack((A, A_other)), np.concatenate((inside, b_other))) is not None
