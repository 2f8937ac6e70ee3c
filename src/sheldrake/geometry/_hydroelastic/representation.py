"""The hydroelastic representation of a geometry: what its shape and proximity properties make of it."""

from __future__ import annotations

import functools
import math
from typing import Any, NamedTuple

import numpy as np

from sheldrake.common._text import number
from sheldrake.geometry import _proximity_properties as proximity
from sheldrake.geometry._hydroelastic import meshes
from sheldrake.geometry._hydroelastic.meshes import PressureMesh
from sheldrake.geometry._meshes.convex_hull import make_convex_hull
from sheldrake.geometry._meshes.mesh_files import boundary_triangles, read_mesh
from sheldrake.geometry._meshes.polygon_mesh import PolygonSurfaceMesh, fans
from sheldrake.geometry._meshes.triangle_mesh import TriangleSurfaceMesh
from sheldrake.geometry._meshes.volume_mesh import VolumeMesh
from sheldrake.geometry._properties import ProximityProperties
from sheldrake.geometry._roles import HydroelasticType, Role
from sheldrake.geometry._shape_types import ShapeType, type_of
from sheldrake.geometry._shapes import Capsule, Convex, Cylinder, HalfSpace, Mesh, Shape

_MOST_VERTICES = 1_000_000  # of meshes that a hint, maybe of a file, makes as fine as it likes


class Representation(NamedTuple):
    """A geometry as hydroelastic contact sees it.

    Attributes:
        rigid: rigid or compliant.
        vertices: of the mesh, in G [m], shape (n, 3); empty for a half space.
        elements: triangles, counter-clockwise seen from outside, of a rigid shape, shape (m, 3); tetrahedra of a
            compliant one, shape (m, 4).
        pressure: at the vertices of a compliant shape [Pa], shape (n,).
        modulus: hydroelastic modulus [Pa]; infinite for a rigid shape.
        slope: growth of pressure with depth in a compliant half space [Pa/m].
        margin: distance from the surface at which a compliant half space is noticed [m].
    """

    rigid: bool
    vertices: np.ndarray
    elements: np.ndarray
    pressure: np.ndarray
    modulus: float
    slope: float = 0.0
    margin: float = 0.0

    @property
    def half_space(self) -> bool:
        """Whether it is a half space, which has no mesh."""
        return len(self.elements) == 0

    def mesh(self) -> TriangleSurfaceMesh | VolumeMesh | None:
        """The mesh as a public object; None for a half space."""
        if self.half_space:
            return None
        return (TriangleSurfaceMesh if self.rigid else VolumeMesh)(self.elements.tolist(), self.vertices)


def compliance(properties: ProximityProperties | None) -> HydroelasticType:
    """What the properties ask for."""
    if properties is None:
        return HydroelasticType.kUndefined
    return properties._get(proximity.HYDRO, proximity.COMPLIANCE_TYPE, HydroelasticType.kUndefined)


def check_representation(shape: Shape, properties: ProximityProperties) -> None:
    """Whether the properties say all that the shape's representation needs.

    Raises:
        RuntimeError: one of them is missing or out of range.
    """
    kind = compliance(properties)
    if kind is HydroelasticType.kUndefined:
        return
    word, name = ("rigid" if kind is HydroelasticType.kRigid else "soft"), shape.type_name()
    needed = [proximity.RESOLUTION_HINT] if type_of(shape).hinted else []
    if kind is HydroelasticType.kCompliant:
        if isinstance(shape, HalfSpace):
            needed.append(proximity.SLAB_THICKNESS)
        needed.append(proximity.MODULUS)
    for what in needed:
        if not properties.HasProperty(proximity.HYDRO, what):
            raise RuntimeError(f"Cannot create {word} {name}; missing the ('{proximity.HYDRO}', '{what}') property")
        value = float(properties.GetProperty(proximity.HYDRO, what))
        if not value > 0.0:
            raise RuntimeError(
                f"Cannot create {word} {name}; the ('{proximity.HYDRO}', '{what}') property must be positive, not "
                f"{number(value)}"
            )
    margin = _margin(properties, kind)
    if not margin >= 0.0:
        raise RuntimeError(
            f"Cannot create {word} {name}; the ('{proximity.HYDRO}', '{proximity.MARGIN}') property must not be "
            f"negative, it is {number(margin)}"
        )
    if isinstance(shape, (Cylinder, Capsule)):
        hint = float(properties.GetProperty(proximity.HYDRO, proximity.RESOLUTION_HINT))
        around = 2.0 * math.pi * (shape.radius() + margin) / hint
        vertices = around * around if isinstance(shape, Capsule) else 3.0 * around
        if vertices > _MOST_VERTICES:
            raise RuntimeError(
                f"Cannot create {word} {name}; with the ('{proximity.HYDRO}', '{proximity.RESOLUTION_HINT}') property "
                f"{number(hint)} its mesh would have some {vertices:.0e} vertices, more than {_MOST_VERTICES}: make "
                "the hint larger"
            )


def _margin(properties: ProximityProperties, kind: HydroelasticType) -> float:
    """Rigid shapes have none."""
    if kind is HydroelasticType.kRigid:
        return 0.0
    return float(properties.GetPropertyOrDefault(proximity.HYDRO, proximity.MARGIN, 0.0))


def representation_of(record: Any) -> Representation | None:
    """The representation of a registered geometry; None when its properties ask for none.

    Raises:
        RuntimeError: a property is missing or out of range, a mesh can not be read, or has no inside.
    """
    return representation_of_shape(record.shape, record.roles.get(Role.kProximity))


def representation_of_shape(shape: Shape, properties: ProximityProperties | None) -> Representation | None:
    """The same for a shape and its proximity properties."""
    kind = compliance(properties)
    if properties is None or kind is HydroelasticType.kUndefined:
        return None
    check_representation(shape, properties)
    hint = float(properties.GetPropertyOrDefault(proximity.HYDRO, proximity.RESOLUTION_HINT, 1.0))
    margin = _margin(properties, kind)
    rigid = kind is HydroelasticType.kRigid
    modulus = float("inf") if rigid else float(properties.GetProperty(proximity.HYDRO, proximity.MODULUS))
    if isinstance(shape, HalfSpace):
        none, slope = np.zeros((0, 3)), 0.0
        if not rigid:
            slope = modulus / float(properties.GetProperty(proximity.HYDRO, proximity.SLAB_THICKNESS))
        return Representation(rigid, none, np.zeros((0, 4), np.int64), np.zeros(0), modulus, slope, margin)
    if rigid and isinstance(shape, Mesh):
        data = read_mesh(shape.source(), "making a rigid hydroelastic mesh")
        mirrored = np.prod(shape.scale3()) < 0.0
        triangles = data.triangles[:, ::-1] if mirrored else data.triangles
        return _rigid(data.vertices * shape.scale3(), triangles)
    if isinstance(shape, (Mesh, Convex)):
        volume = _volume_of_mesh(shape, margin)
    else:
        volume = _volume_of_primitive(type_of(shape), shape._values(), hint, margin)
    if rigid:
        return _rigid(volume.vertices, boundary_triangles(volume.tetrahedra))
    return Representation(False, volume.vertices, volume.tetrahedra, modulus * volume.extent, modulus)


def _rigid(vertices: np.ndarray, triangles: np.ndarray) -> Representation:
    """A rigid surface without the vertices that no triangle uses."""
    used, renumbered = np.unique(triangles, return_inverse=True)
    return Representation(
        True, vertices[used], renumbered.reshape(-1, 3).astype(np.int64), np.zeros(0), float("inf")
    )  # fmt: skip


@functools.lru_cache(maxsize=256)
def _volume_of_primitive(row: ShapeType, values: tuple[float, ...], hint: float, margin: float) -> PressureMesh:
    if row.pressure is None:
        raise NotImplementedError(f"A {row.shape.__name__} has no hydroelastic representation.")
    return row.pressure(row.shape(*values), hint, margin)


def _volume_of_mesh(shape: Mesh | Convex, margin: float) -> PressureMesh:
    """Tetrahedra of a volume mesh as they are; of any other mesh, those of its convex hull.

    Kept for files, while their time of change stays the same.
    """
    source = shape.source()
    if not source.is_path():
        return _make_volume_of_mesh(shape, margin)
    path = source.path()
    stamp = path.stat().st_mtime_ns if path.exists() else 0
    key = (shape.type_name(), path, stamp, tuple(shape.scale3().tolist()), margin)
    if key not in _VOLUMES:
        while len(_VOLUMES) >= _MOST_VOLUMES:
            _VOLUMES.pop(next(iter(_VOLUMES)))
        _VOLUMES[key] = _make_volume_of_mesh(shape, margin)
    return _VOLUMES[key]


_VOLUMES: dict[tuple, PressureMesh] = {}
_MOST_VOLUMES = 64


def _make_volume_of_mesh(shape: Mesh | Convex, margin: float) -> PressureMesh:
    if isinstance(shape, Mesh):
        data = read_mesh(shape.source(), "making a compliant hydroelastic mesh")
        if data.tetrahedra is not None:
            return meshes.volume_mesh(data.vertices * shape.scale3(), data.tetrahedra, data.triangles, margin)
    hull = shape.GetConvexHull()
    if margin > 0.0 and isinstance(shape, Convex):
        hull = _larger(hull, margin)
    star = meshes.star_mesh(hull._vertices, fans(hull._faces), _planes(hull), margin)
    if margin > 0.0 and isinstance(shape, Mesh):
        return meshes.volume_mesh(star.vertices, star.tetrahedra, boundary_triangles(star.tetrahedra), margin)
    return star


def _planes(hull: PolygonSurfaceMesh) -> np.ndarray:
    """Outward unit normals and offsets of a hull's faces, shape (n, 4)."""
    offsets = [hull._vertices[list(f)].mean(axis=0) @ n for f, n in zip(hull._faces, hull._normals)]
    return np.column_stack([hull._normals, offsets])


def _larger(hull: PolygonSurfaceMesh, margin: float) -> PolygonSurfaceMesh:
    """The polytope whose faces lie farther out by a margin."""
    from scipy.spatial import HalfspaceIntersection

    planes = _planes(hull)
    planes[:, 3] += margin
    planes[:, 3] *= -1.0
    corners = HalfspaceIntersection(planes, hull._vertices.mean(axis=0)).intersections
    size = np.ptp(corners, axis=0).max()
    kept: list[np.ndarray] = []
    for corner in corners:  # one for every three planes that meet: the same point for more
        if all(np.abs(corner - other).max() > 1e-9 * size for other in kept):
            kept.append(corner)
    return make_convex_hull(kept, "a convex shape with its hydroelastic margin")
