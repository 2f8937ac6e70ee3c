"""Where rays meet shapes.

Each `meet_*` takes rays in the frame G of a shape, origins and unit directions of shape (n, 3). It returns the distance
to the first point of its surface that lies ahead [m], infinite where there is none, and the outward unit normals there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sheldrake.geometry._kernels.model import (
    BOX,
    CAPSULE,
    CYLINDER,
    ELLIPSOID,
    HALF_SPACE,
    HULL,
    SPHERE,
    Geometry,
    GeometryModel,
    PlacedGeometry,
    Size,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

Hits = tuple[np.ndarray, np.ndarray]

_TRIANGLES_AT_ONCE = 1 << 20  # ray-triangle pairs worked on at a time: some 100 MB


def rays_of(p_WO: ArrayLike, direction_W: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Origins and unit directions, both of shape (n, 3), from what `ComputeRayIntersections` is called with."""
    p, d = np.asarray(p_WO, float), np.asarray(direction_W, float)
    for name, value in (("p_WO", p), ("direction_W", d)):
        if value.ndim not in (1, 2) or value.shape[0] != 3:
            raise ValueError(f"ComputeRayIntersections(): {name} has shape {value.shape}, not (3,) or (3, n).")
    try:
        p, d = (x.T for x in np.broadcast_arrays(p.reshape(3, -1), d.reshape(3, -1)))
    except ValueError:
        origins, directions = p.shape[1], d.shape[1]
        raise ValueError(f"ComputeRayIntersections(): {origins} origins, but {directions} directions.") from None
    length = np.linalg.norm(d, axis=1, keepdims=True)
    bad = np.flatnonzero(~((length > 0.0) & np.isfinite(length)).ravel() | ~np.isfinite(p).all(axis=1))
    if len(bad):
        raise ValueError(f"ComputeRayIntersections(): ray {bad[0]} goes from {p[bad[0]]} along {d[bad[0]]}.")
    return p, d / length


class Surface(NamedTuple):
    """The triangles of a mesh.

    Attributes:
        vertices: in G [m], shape (v, 3).
        triangles: counter-clockwise seen from outside, shape (t, 3).
    """

    vertices: np.ndarray
    triangles: np.ndarray


def meet_any(
    model: GeometryModel,
    X_WG: np.ndarray,
    surfaces: Mapping[int, Surface],
    wanted: Iterable[int],
    p_WO: np.ndarray,
    d_W: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where rays first meet some geometry.

    Args:
        model: the geometry.
        X_WG: its poses, R row-major, p and centre of the bounding sphere [m], shape (g, 15).
        surfaces: those of meshes, which count as their convex hulls without.
        wanted: which of the geometry.
        p_WO: origins [m], shape (n, 3).
        d_W: unit directions, shape (n, 3).

    Returns:
        distance [m] and number of the geometry (-1: none) of shape (n,), normals in W of shape (n, 3).
    """
    distance, who, normal = np.full(len(p_WO), np.inf), np.full(len(p_WO), -1), np.full_like(p_WO, np.nan)
    for g in wanted:
        pose = X_WG[g]
        R_WG, p_WG = pose[PlacedGeometry.R_WG.columns].reshape(3, 3), pose[PlacedGeometry.p_WG.columns]
        centre_W = pose[PlacedGeometry.centre_W.columns]
        near = np.flatnonzero(_reaches(p_WO, d_W, centre_W, model.size[g, Size.bound]))
        p, d = (p_WO[near] - p_WG) @ R_WG, d_W[near] @ R_WG
        t, n = meet_triangles(p, d, *surfaces[g]) if g in surfaces else meet(model, g, p, d)
        nearer = t < distance[near]
        rows = near[nearer]
        distance[rows], who[rows], normal[rows] = t[nearer], g, n[nearer] @ R_WG.T
    return distance, who, normal


def _reaches(p: np.ndarray, d: np.ndarray, centre: np.ndarray, radius: float) -> np.ndarray:
    """Which rays come (with something to spare) as near to a point as this."""
    if not np.isfinite(radius):
        return np.full(len(p), True)
    r = centre - p
    r -= np.maximum((r * d).sum(axis=1), 0.0)[:, None] * d
    return (r * r).sum(axis=1) <= (1.001 * radius) ** 2 + 1e-12 * (centre @ centre)


def meet(model: GeometryModel, g: int, p: np.ndarray, d: np.ndarray) -> Hits:
    """Rays and geometry g of a model; a mesh counts as its convex hull."""
    kind, size = int(model.geometry[g, Geometry.kind]), model.size[g]
    if kind == HALF_SPACE:
        return meet_half_space(p, d)
    if kind == HULL:
        first = model.geometry[g, Geometry.first_face]
        return meet_hull(p, d, model.face[first : first + model.geometry[g, Geometry.num_faces]])
    sizes = np.full(3, size[Size.radius]) if kind == SPHERE else size[Size.half_sizes.columns]
    return _FORMULAS[kind](p, d, sizes)


# ---- intervals of a ray inside something convex: from, to; empty when to < from


def _first_ahead(enter: np.ndarray, leave: np.ndarray) -> np.ndarray:
    """Distance to the first end of an interval that is not behind the ray's origin."""
    distance = np.where(enter >= 0.0, enter, leave)
    return np.where((leave >= enter) & (distance >= 0.0), distance, np.inf)


def _slab(p: np.ndarray, d: np.ndarray, half: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
    """Where |p + t d| <= half."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (-half - p) / d, (half - p) / d
    outside = np.abs(p) > half
    still = d == 0.0
    enter = np.where(still, np.where(outside, np.inf, -np.inf), np.minimum(a, b))
    leave = np.where(still, np.where(outside, -np.inf, np.inf), np.maximum(a, b))
    return enter, leave


def _ball(p: np.ndarray, d: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Where |p + t d| <= radius, for points of any number of coordinates; d need not have length one."""
    a, b = (d * d).sum(axis=1), (p * d).sum(axis=1)
    safe = np.where(a > 0.0, a, 1.0)
    nearest = p - (b / safe)[:, None] * d  # less cancellation than b² - a c for a far origin
    rest = radius**2 - (nearest * nearest).sum(axis=1)
    half = np.sqrt(np.maximum(rest, 0.0) / safe)
    middle = -b / safe
    inside = rest >= 0.0
    enter = np.where(inside, np.where(a > 0.0, middle - half, -np.inf), np.inf)
    leave = np.where(inside, np.where(a > 0.0, middle + half, np.inf), -np.inf)
    return enter, leave


def _unit(n: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(n, axis=1, keepdims=True)
    return n / np.where(length > 0.0, length, 1.0)


def _points(p: np.ndarray, d: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """Of what hits; origins of what does not."""
    return p + np.where(np.isfinite(distance), distance, 0.0)[:, None] * d


# ---- shapes


def meet_half_space(p: np.ndarray, d: np.ndarray) -> Hits:
    """The plane z = 0, from either side."""
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -p[:, 2] / d[:, 2]
    distance = np.where((d[:, 2] != 0.0) & (t >= 0.0), t, np.inf)
    return distance, np.tile([0.0, 0.0, 1.0], (len(p), 1))


def meet_ellipsoid(p: np.ndarray, d: np.ndarray, semi_axes: np.ndarray) -> Hits:
    """A ball where space is scaled by the semi-axes."""
    distance = _first_ahead(*_ball(p / semi_axes, d / semi_axes, 1.0))
    return distance, _unit(_points(p, d, distance) / semi_axes**2)


def meet_box(p: np.ndarray, d: np.ndarray, half: np.ndarray) -> Hits:
    """Three slabs."""
    enters, leaves = _slab(p, d, half)
    distance = _first_ahead(enters.max(axis=1), leaves.min(axis=1))
    at = _points(p, d, distance)
    rows, face = np.arange(len(p)), np.argmax(np.abs(at) - half, axis=1)
    normal = np.zeros_like(p)
    normal[rows, face] = np.where(at[rows, face] < 0.0, -1.0, 1.0)
    return distance, normal


def meet_cylinder(p: np.ndarray, d: np.ndarray, size: np.ndarray) -> Hits:
    """A disk in the plane, and a slab along the axis."""
    radius, half = size[Size.radius], size[Size.half_length]
    side, caps = _ball(p[:, :2], d[:, :2], radius), _slab(p[:, 2], d[:, 2], half)
    distance = _first_ahead(np.maximum(side[0], caps[0]), np.minimum(side[1], caps[1]))
    at = _points(p, d, distance)
    on_cap = np.abs(at[:, 2]) - half > np.hypot(at[:, 0], at[:, 1]) - radius
    normal = _unit(at * [1.0, 1.0, 0.0])
    normal[on_cap] = np.where(at[on_cap, 2:] < 0.0, -1.0, 1.0) * [0.0, 0.0, 1.0]
    return distance, normal


def meet_capsule(p: np.ndarray, d: np.ndarray, size: np.ndarray) -> Hits:
    """A cylinder and a ball at each end: what a ray has of each makes one interval."""
    radius, half = size[Size.radius], size[Size.half_length]
    side, caps = _ball(p[:, :2], d[:, :2], radius), _slab(p[:, 2], d[:, 2], half)
    parts = [(np.maximum(side[0], caps[0]), np.minimum(side[1], caps[1]))]
    parts += [_ball(p - [0.0, 0.0, z], d, radius) for z in (-half, half)]
    there = [leave >= enter for enter, leave in parts]
    enter = np.min([np.where(ok, part[0], np.inf) for ok, part in zip(there, parts)], axis=0)
    leave = np.max([np.where(ok, part[1], -np.inf) for ok, part in zip(there, parts)], axis=0)
    distance = _first_ahead(enter, leave)
    at = _points(p, d, distance)
    axis = np.zeros_like(at)
    axis[:, 2] = np.clip(at[:, 2], -half, half)
    return distance, _unit(at - axis)


def meet_hull(p: np.ndarray, d: np.ndarray, faces: np.ndarray) -> Hits:
    """A convex polytope: rows of `faces` are outward normal and offset."""
    height, rate = p @ faces[:, :3].T - faces[:, 3], d @ faces[:, :3].T
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -height / rate
    enters = np.where(rate < 0.0, t, np.where((rate == 0.0) & (height > 0.0), np.inf, -np.inf))
    leaves = np.where(rate > 0.0, t, np.inf)
    first, last = enters.argmax(axis=1), leaves.argmin(axis=1)
    rows = np.arange(len(p))
    enter, leave = enters[rows, first], leaves[rows, last]
    distance = _first_ahead(enter, leave)
    return distance, faces[np.where(enter >= 0.0, first, last), :3]


def meet_triangles(p: np.ndarray, d: np.ndarray, vertices: np.ndarray, triangles: np.ndarray) -> Hits:
    """Triangles that are counter-clockwise seen from outside, from either side (Moeller and Trumbore 1997).

    A ray through an edge hits one of its triangles at least.
    """
    a = vertices[triangles[:, 0]]
    u, v = vertices[triangles[:, 1]] - a, vertices[triangles[:, 2]] - a
    out = np.cross(u, v)
    distance, normal = np.full(len(p), np.inf), np.zeros_like(p)
    step = max(1, _TRIANGLES_AT_ONCE // max(1, len(triangles)))
    for begin in range(0, len(p), step):
        rays = slice(begin, begin + step)
        r = p[rays, None, :] - a
        det = -(d[rays] @ out.T)
        q = np.cross(r, d[rays, None, :])
        slack = 1e-12 * np.abs(det)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.einsum("ntk,tk->nt", r, out) / det
        beta, gamma = np.einsum("ntk,tk->nt", q, v), -np.einsum("ntk,tk->nt", q, u)
        beta, gamma = beta * np.sign(det), gamma * np.sign(det)
        inside = (beta >= -slack) & (gamma >= -slack) & (beta + gamma <= np.abs(det) + slack) & (det != 0.0)
        t = np.where(inside & (t >= 0.0), t, np.inf)
        best = t.argmin(axis=1)
        distance[rays] = t[np.arange(len(t)), best]
        normal[rays] = _unit(out[best])
    return distance, normal


_FORMULAS: dict[int, Callable[..., Hits]] = {
    SPHERE: meet_ellipsoid,
    ELLIPSOID: meet_ellipsoid,
    BOX: meet_box,
    CYLINDER: meet_cylinder,
    CAPSULE: meet_capsule,
}

HAVE_FORMULAS = {HALF_SPACE, HULL, *_FORMULAS}
"""Kinds of shapes that rays meet exactly; the others are met as they are drawn."""
