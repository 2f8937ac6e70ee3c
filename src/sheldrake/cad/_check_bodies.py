"""Faults of bodies that show when mass, inertia and geometry are held against each other."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.geometry import Convex, Mesh, Shape
from sheldrake.geometry._shape_types import type_of

from ._plausible import HEAVIEST, LIGHTEST, NOTHING, principal_moments, why_impossible, why_too_large

if TYPE_CHECKING:
    from typing import TypeGuard

    from sheldrake.geometry._meshes.mass_properties import MassProperties
    from sheldrake.multibody.parsing._model.description import BodyDescription, GeometryDescription

_FAR = 0.35  # of the geometry's diagonal: a centre of mass that far from the middle of the geometry is odd
_UNLIKE = 8.0  # ratio of moments of inertia, file to geometry, that uneven material does not explain
_HUGE, _TINY = 10.0, 0.5e-3  # [m] sizes of a robot's link that make one doubt the scale


class Solids(NamedTuple):
    """The geometry of a body.

    Attributes:
        points: Of meshes their vertices, of other shapes the corners of their boxes, in B [m], shape (n, 3).
        volume: Of the convex hulls of the shapes [m^3], zero if not known.
        p_BoBcm: Centroid of the shapes as solids [m], or None.
        I_BBcm: Rotational inertia about it per kilogram of the body [m^2], or None.
    """

    points: np.ndarray
    volume: float
    p_BoBcm: np.ndarray | None
    I_BBcm: np.ndarray | None


def solids_of(body: BodyDescription) -> Solids | None:
    """The geometry of a described body: all of it for its extent, collision (else visual) shapes for its mass."""
    placed = [*body.collisions, *body.visuals]
    points = [p for p in (_points(g) for g in placed) if p is not None]
    if not points:
        return None
    volume, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    hull_volume = 0.0
    for geometry in body.collisions or body.visuals:
        found = _mass_properties(geometry.shape)
        if found is None:
            continue
        R, p = geometry.X_BG.rotation().matrix(), np.asarray(geometry.X_BG.translation())
        centre = R @ found.p_GoGcm + p
        inertia = R @ found.I_GGcm @ R.T
        volume += found.volume
        first += found.volume * centre
        second += 0.5 * np.trace(inertia) * np.eye(3) - inertia + found.volume * np.outer(centre, centre)
        hull_volume += _hull_volume(geometry.shape) or found.volume
    if volume <= 0.0:
        return Solids(np.concatenate(points), 0.0, None, None)
    centre = first / volume
    central = second / volume - np.outer(centre, centre)
    return Solids(np.concatenate(points), hull_volume, centre, np.trace(central) * np.eye(3) - central)


def _is_mesh(shape: Shape) -> TypeGuard[Mesh | Convex]:
    return isinstance(shape, (Mesh, Convex))


def _points(geometry: GeometryDescription) -> np.ndarray | None:
    shape: Shape = geometry.shape
    if _is_mesh(shape):
        from sheldrake.geometry._meshes.mesh_files import read_mesh

        try:
            points = read_mesh(shape.source()).vertices * shape.scale3()
        except RuntimeError:
            return None
    else:
        half = _half_size(shape)
        if half is None:
            return None
        points = half * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    if not len(points):
        return None
    R, p = geometry.X_BG.rotation().matrix(), np.asarray(geometry.X_BG.translation())
    return points @ R.T + p


def _half_size(shape: Shape) -> np.ndarray | None:
    row = type_of(shape)
    return None if row.kind is None or row.box is None else row.box(shape)


def _mass_properties(shape: Shape) -> MassProperties | None:
    from sheldrake.geometry._mass_properties import mass_properties

    try:
        found = mass_properties(shape)
        if found.volume <= 0.0 or why_impossible(1.0, found.I_GGcm / found.volume):
            if not _is_mesh(shape):
                return None
            found = mass_properties(Convex(shape.source().path(), shape.scale3()))
    except (RuntimeError, ValueError, AttributeError):
        return None
    return found if found.volume > 0.0 else None


def _hull_volume(shape: Any) -> float | None:
    from sheldrake.geometry._meshes.mass_properties import of_polygons

    if not _is_mesh(shape):
        return None
    try:
        return of_polygons(shape.GetConvexHull()).volume
    except RuntimeError:
        return None


class BodyFault(NamedTuple):
    """A finding about a body, before it has a place in a file.

    Attributes:
        new_inertia: Whether mass properties made from the geometry put it right.
    """

    severity: str
    code: str
    message: str
    new_inertia: bool = False
    fix: str = ""


def check_inertia(
    name: str, mass: float, p_BoBcm: np.ndarray, I_BBcm: np.ndarray, solids: Solids | None
) -> list[BodyFault]:
    """What is wrong with the mass [kg], centre of mass [m] and inertia about it [kg m^2] of a body."""
    faults: list[BodyFault] = []
    problem = why_impossible(mass, I_BBcm)
    if problem is not None:
        faults.append(BodyFault("error", "inertia-impossible", f"the inertia of '{name}' can not be: {problem}", True))
    if mass <= 0.0 or problem is not None:
        return faults
    moments = principal_moments(I_BBcm)
    if moments[2] <= NOTHING:
        text = f"'{name}' has {mass:g} kg and no rotational inertia"
        return [BodyFault("warning", "inertia-zero", text, solids is not None)]
    if solids is None:
        return faults
    extent = np.ptp(solids.points, axis=0)
    farthest = float(np.linalg.norm(solids.points - p_BoBcm, axis=1).max())
    too_large = why_too_large(mass, I_BBcm, farthest)
    if too_large is not None:
        text = f"the inertia of '{name}' does not fit its geometry: {too_large}"
        if np.allclose(I_BBcm, np.eye(3), rtol=0.0, atol=1e-12):
            text += " (1, 1, 1 is what some programs write when they do not know)"
        faults.append(BodyFault("error", "inertia-too-large", text, True))
    faults += _check_centre(name, p_BoBcm, solids, float(np.linalg.norm(extent)))
    faults += _check_density(name, mass, solids)
    if too_large is None and solids.I_BBcm is not None:
        ratio = moments / np.maximum(principal_moments(solids.I_BBcm * mass), 1e-300)
        worst = ratio[np.argmax(np.abs(np.log(np.maximum(ratio, 1e-300))))]
        if worst > _UNLIKE or worst < 1.0 / _UNLIKE:
            text = (
                f"the principal moments of '{name}', {_three(moments)} kg m^2, are not those of its geometry at "
                f"{mass:g} kg, {_three(principal_moments(solids.I_BBcm * mass))} kg m^2 ({worst:.2g} times)"
            )
            faults.append(BodyFault("warning", "inertia-unlike-geometry", text, True))
    return faults


def _three(values: np.ndarray) -> str:
    return ", ".join(f"{value:.3g}" for value in values)


def _check_centre(name: str, p_BoBcm: np.ndarray, solids: Solids, diagonal: float) -> list[BodyFault]:
    outside = _distance_outside(solids.points, p_BoBcm)
    if outside > 0.02 * diagonal:
        text = f"the centre of mass of '{name}', ({_three(p_BoBcm)}) m, is {outside:.3g} m outside its geometry"
        return [BodyFault("warning", "com-outside", text, True)]
    if solids.p_BoBcm is None:
        return []
    distance = float(np.linalg.norm(p_BoBcm - solids.p_BoBcm))
    if distance <= _FAR * diagonal:
        return []
    text = (
        f"the centre of mass of '{name}', ({_three(p_BoBcm)}) m, is {distance:.3g} m from the middle of its geometry, "
        f"({_three(solids.p_BoBcm)}) m"
    )
    return [BodyFault("warning", "com-off-centre", text, True)]


def _distance_outside(points: np.ndarray, p: np.ndarray) -> float:
    """How far a point is outside the convex hull of points [m], at least; 0 inside."""
    from scipy.spatial import ConvexHull, QhullError

    box = np.maximum(np.maximum(points.min(axis=0) - p, p - points.max(axis=0)), 0.0)
    try:
        planes = ConvexHull(points).equations
    except (QhullError, ValueError):
        return float(np.linalg.norm(box))
    return float(max(np.max(planes[:, :3] @ p + planes[:, 3]), np.linalg.norm(box), 0.0))


def _check_density(name: str, mass: float, solids: Solids) -> list[BodyFault]:
    if solids.volume <= 0.0:
        return []
    density = mass / solids.volume
    if LIGHTEST <= density <= HEAVIEST:
        return []
    what = "denser than any material" if density > HEAVIEST else "lighter than air"
    size = " x ".join(f"{x:.3g}" for x in np.ptp(solids.points, axis=0))
    text = f"'{name}' has {mass:g} kg in a geometry of {size} m: {density:.3g} kg/m^3, {what}"
    return [BodyFault("warning", "density-odd", text, False, "check the mass, and the unit of the geometry")]


def is_odd_size(points: np.ndarray) -> bool:
    """Whether geometry has a size that makes one doubt its unit; points in [m], shape (n, 3)."""
    largest = float(np.ptp(points, axis=0).max())
    return not _TINY <= largest <= _HUGE
