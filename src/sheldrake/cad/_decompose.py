"""Approximate convex decomposition: the worst piece is cut by an axis-parallel plane where that saves most volume.

No cut needs a lid: the hull of a clipped surface is the hull of the clipped solid, and the volume of the part of a
solid below x = c is the flux of (x - c, 0, 0) through the surface there, for which the lid and the walls of a cut along
y or z count nothing. After Lien and Amato, Approximate convex decomposition of polyhedra, 2007, with the difference of
volumes as the measure of concavity.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ._solids import Solid

_ENOUGH = 0.02  # hulls together are at most this share of the solid's volume larger than the solid
_MOST_CELLS = 24
_JOIN = 0.003  # share of the solid's volume by which joining two pieces may enlarge them
_WORTHWHILE = 0.7  # several pieces waste at most this share of what one hull does, or it stays one hull
_ALIKE = 0.05  # how much halves of different volume count against a cut
_CANDIDATES = 10  # planes of vertices tried along an axis


@dataclass(eq=False)
class _Cell:
    """The part of the solid in a box.

    Attributes:
        column: Corners of the surface's triangles within the box's range of y and z, shape (m, 3, 3).
        low, high: Ends of the box along x; the other ends are in `column`.
    """

    column: np.ndarray
    low: float
    high: float
    points: np.ndarray  # of the surface in the box, shape (n, 3)
    volume: float
    hull_volume: float

    @property
    def waste(self) -> float:
        return self.hull_volume - self.volume


def decompose(solid: Solid) -> tuple[list[Any], float]:
    """Convex pieces (PolygonSurfaceMesh) that cover a closed solid, and by what share they are larger than it."""
    from sheldrake.geometry._meshes.convex_hull import make_convex_hull

    whole = _make_cell(solid.vertices[solid.triangles], *_range(solid.vertices[:, 0]))
    assert whole is not None
    cells = [whole]
    finished: list[_Cell] = []
    while cells and len(cells) + len(finished) < _MOST_CELLS:
        if sum(cell.waste for cell in cells + finished) <= _ENOUGH * whole.volume:
            break
        worst = max(cells, key=lambda cell: cell.waste)
        cells.remove(worst)
        halves = _best_cut(worst)
        if halves is None:
            finished.append(worst)
        else:
            cells += halves
    pieces = _joined([(cell.points, cell.hull_volume) for cell in cells + finished], _JOIN * whole.volume)
    if sum(volume for _, volume in pieces) - whole.volume > _WORTHWHILE * whole.waste:
        pieces = [(whole.points, whole.hull_volume)]
    error = sum(volume for _, volume in pieces) / whole.volume - 1.0
    return [make_convex_hull(points, f"a piece of '{solid.name}'") for points, _ in pieces], error


def _joined(pieces: list[tuple[np.ndarray, float]], allowed: float) -> list[tuple[np.ndarray, float]]:
    """Pieces joined two by two as long as their common hull is hardly larger than theirs together."""
    pieces = list(pieces)
    while True:
        best, least = None, allowed
        for i, (first, v_first) in enumerate(pieces):
            for j, (second, v_second) in enumerate(pieces[:i]):
                both = np.concatenate([first, second])
                volume = _hull_volume(both)
                if volume is not None and volume - v_first - v_second <= least:
                    best, least = (i, j, both, volume), volume - v_first - v_second
        if best is None:
            return pieces
        i, j, both, volume = best
        pieces = [piece for k, piece in enumerate(pieces) if k not in (i, j)] + [(both, volume)]


def _hull_volume(points: np.ndarray) -> float | None:
    """Volume of the convex hull, or None when the points are flat."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return float(ConvexHull(points).volume) if len(points) > 3 else None
    except QhullError:
        return None


def _range(values: np.ndarray) -> tuple[float, float]:
    return float(values.min()), float(values.max())


def _make_cell(column: np.ndarray, low: float, high: float) -> _Cell | None:
    """The cell, or None when there is nothing solid in it."""
    inside = clip(clip(column, 0, high), 0, low, keep_above=True)
    points = np.unique(np.round(inside.reshape(-1, 3), 12), axis=0)
    hull_volume = _hull_volume(points)
    if hull_volume is None:
        return None
    return _Cell(column, low, high, points, _volume_below(column, high) - _volume_below(column, low), hull_volume)


def _volume_below(column: np.ndarray, at: float) -> float:
    corners = clip(column, 0, at)
    if not len(corners):
        return 0.0
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    area_x = 0.5 * np.cross(b - a, c - a)[:, 0]
    return float(((corners[:, :, 0].mean(axis=1) - at) * area_x).sum())


def _best_cut(cell: _Cell) -> list[_Cell] | None:
    """The two halves with least waste, the more alike the better, or None when there is no cut.

    A cut that saves nothing may be the first of two that do: one through the axis of a hole.
    """
    best, least = None, np.inf
    for axis in range(3):
        for at in _candidates(cell.points[:, axis]):
            halves = _cut(cell, axis, float(at))
            if halves is None:
                continue
            waste = sum(half.waste for half in halves)
            difference = abs(halves[0].volume - halves[-1].volume)
            cost = waste + _ALIKE * difference
            if cost < least and waste <= 1.001 * cell.waste:
                best, least = halves, cost
    return best


def _candidates(coordinates: np.ndarray) -> np.ndarray:
    """Planes through the vertices that lie most often on one, and some at equal distances."""
    values, counts = np.unique(coordinates, return_counts=True)
    low, high = values[0], values[-1]
    often = values[np.argsort(-counts, kind="stable")[:_CANDIDATES]]
    planes = np.unique(np.concatenate([often, np.linspace(low, high, 6)[1:-1]]))
    margin = 1e-3 * (high - low)
    return planes[(planes > low + margin) & (planes < high - margin)]


def _cut(cell: _Cell, axis: int, at: float) -> list[_Cell] | None:
    if axis == 0:
        halves = [_make_cell(cell.column, cell.low, at), _make_cell(cell.column, at, cell.high)]
    else:
        columns = clip(cell.column, axis, at), clip(cell.column, axis, at, keep_above=True)
        halves = [_make_cell(column, cell.low, cell.high) if len(column) else None for column in columns]
    return [half for half in halves if half is not None] if any(h is not None for h in halves) else None


def clip(corners: np.ndarray, axis: int, at: float, keep_above: bool = False) -> np.ndarray:
    """The parts of triangles on one side of the plane x[axis] = at, as triangles; shape (m, 3, 3) to (k, 3, 3)."""
    height = corners[:, :, axis] - at
    if keep_above:
        height = -height
    inside = height <= 0.0
    count = inside.sum(axis=1)
    kept = [corners[count == 3]]
    for number in (1, 2):
        some = count == number
        if not some.any():
            continue
        # Turn each triangle so that the corner alone on its side is the first.
        alone = np.argmax(inside[some] == (number == 1), axis=1)
        order = (alone[:, None] + np.arange(3)) % 3
        rows = np.arange(len(order))[:, None]
        a, b, c = np.moveaxis(corners[some][rows, order], 1, 0)
        ha, hb, hc = np.moveaxis(height[some][rows, order], 1, 0)
        ab = a + (b - a) * (ha / (ha - hb))[:, None]
        ac = a + (c - a) * (ha / (ha - hc))[:, None]
        ab[:, axis] = ac[:, axis] = at
        if number == 1:
            kept.append(np.stack([a, ab, ac], axis=1))
        else:
            kept += [np.stack([ab, b, c], axis=1), np.stack([ab, c, ac], axis=1)]
    return np.concatenate(kept)
