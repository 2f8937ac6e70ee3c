"""The types of shapes: a row each with all that is told apart by type.

A new shape is a class, a row here, its name in `__init__`; and, unless it touches others as a hull of vertices does, a
kind in `_kernels/model`, its farthest points in `_kernels/support` and its contacts with planes in
`_kernels/half_space`. What is drawn and written better for some shapes (a round one without facets) falls back on what
their rows say for all others.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.geometry._hydroelastic import meshes
from sheldrake.geometry._hydroelastic.meshes import PressureMesh
from sheldrake.geometry._kernels import model as kernels
from sheldrake.geometry._meshes.mass_properties import MassProperties, of_polygons, of_triangles
from sheldrake.geometry._meshes.mesh_files import read_mesh
from sheldrake.geometry._meshes.polygon_mesh import PolygonSurfaceMesh
from sheldrake.geometry._meshes.surfaces import Surface, capsule, lathe, surface_of, unit_cube
from sheldrake.geometry._shapes import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Mesh,
    MeshcatCone,
    Shape,
    Sphere,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

Vec3 = tuple[float, float, float]


class Tag(NamedTuple):
    """How a format writes a shape: its name and where its numbers are.

    Attributes:
        name: of the element.
        numbers: attributes or children with a number of the constructor each; or one that has all of them.
        absent: what the constructor's numbers are where a file leaves them out; empty where it may not.
    """

    name: str
    numbers: tuple[str, ...]
    absent: tuple[float, ...] = ()


class Geom(NamedTuple):
    """How MJCF writes a shape.

    Attributes:
        type: value of the attribute `type`.
        factors: what numbers of the constructor are multiplied with in `size`.
    """

    type: str
    factors: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class ShapeType:
    """What is told apart by the type of a shape. Functions take a shape; lengths are in [m], in its frame G.

    Attributes:
        shape: the class.
        kind: what the contact kernels call it; None for what touches nothing.
        hull: the hull of vertices that it touches others with, instead of `half_sizes` and `bound`.
        half_sizes: what the kernels know of its size.
        bound: radius of the sphere about Go that holds it.
        box: half sizes of its bounding box; None for other ones.
        middle: centre of that box.
        mass: mass properties for unit density; None for what has no mass.
        surface: vertices and triangles, for those who know no better way to draw it.
        smooth: whether its surface looks smooth.
        pressure: of (shape, resolution hint, margin), the mesh of hydroelastic contact; None for what has none.
        hinted: whether that mesh needs a resolution hint.
        may_be_empty: whether its sizes may be zero.
        urdf: how URDF writes it; the first is written, all are read.
        sdf: how SDFormat does.
        mjcf: how MJCF does.
        viewer: its kind in messages to Drake's viewers, a name of `lcmt_viewer_geometry_data`.
    """

    shape: type[Shape]
    kind: int | None = None
    hull: Callable[[Any], PolygonSurfaceMesh] | None = None
    half_sizes: Callable[[Any], Vec3] = lambda shape: (0.0, 0.0, 0.0)
    bound: Callable[[Any], float] = lambda shape: math.inf
    box: Callable[[Any], np.ndarray] | None = None
    middle: Callable[[Any], Vec3] = lambda shape: (0.0, 0.0, 0.0)
    mass: Callable[[Any], MassProperties] | None = None
    surface: Callable[[Any], Surface] | None = None
    smooth: bool = False
    pressure: Callable[[Any, float, float], PressureMesh] | None = None
    hinted: bool = False
    may_be_empty: bool = False
    urdf: tuple[Tag, ...] = ()
    sdf: tuple[Tag, ...] = ()
    mjcf: Geom | None = None
    viewer: str = ""


def type_of(shape: Shape) -> ShapeType:
    """The row of a shape; a bare one for a class that is not in the table."""
    found = SHAPE_TYPES.get(type(shape))
    if found is not None:
        return found
    for cls in type(shape).__mro__:
        if cls in SHAPE_TYPES:
            return SHAPE_TYPES[cls]
    return SHAPE_TYPES[Shape]


def centred(volume: float, xx: float, yy: float, zz: float) -> MassProperties:
    """Mass properties of a shape about its centre, from its volume [m^3] and the mean squares of x, y, z [m^2]."""
    moments = [[volume * (yy + zz), 0.0, 0.0], [0.0, volume * (xx + zz), 0.0], [0.0, 0.0, volume * (xx + yy)]]
    return MassProperties(volume, np.zeros(3), np.array(moments))


def _mass_of_box(x: float, y: float, z: float) -> MassProperties:
    return centred(x * y * z, x * x / 12.0, y * y / 12.0, z * z / 12.0)


def _mass_of_ellipsoid(axes: np.ndarray) -> MassProperties:
    return centred(4.0 / 3.0 * math.pi * float(np.prod(axes)), *(axes**2 / 5.0))


def _mass_of_sphere(r: float) -> MassProperties:
    return centred(4.0 / 3.0 * math.pi * r**3, *(r * r / 5.0,) * 3)


def _mass_of_cylinder(r: float, l: float) -> MassProperties:
    return centred(math.pi * r * r * l, r * r / 4.0, r * r / 4.0, l * l / 12.0)


def _mass_of_capsule(r: float, l: float) -> MassProperties:
    tube, caps = math.pi * r * r * l, 4.0 / 3.0 * math.pi * r**3
    volume = tube + caps
    across = (tube * r * r / 4.0 + caps * r * r / 5.0) / volume
    # A half ball's mean distance from its flat side is 3 r / 8, its mean square r^2 / 5.
    along = (tube * l * l / 12.0 + caps * (r * r / 5.0 + 0.375 * r * l + l * l / 4.0)) / volume
    return centred(volume, across, across, along)


def _mass_of_mesh(shape: Mesh) -> MassProperties:
    data, scale = read_mesh(shape.source(), "CalcSpatialInertia()"), shape.scale3()
    triangles = data.triangles[:, ::-1] if np.prod(scale) < 0.0 else data.triangles
    return of_triangles(data.vertices * scale, triangles)


def _scaled(surface: Surface, scale: ArrayLike) -> Surface:
    vertices, faces = surface
    return vertices * scale, faces


def _semi_axes(shape: Ellipsoid) -> np.ndarray:
    return np.array([shape.a(), shape.b(), shape.c()])


_RADIUS, _ROUND = ("radius",), ("radius", "length")

_ROWS = (
    ShapeType(shape=Shape),
    ShapeType(
        shape=Box,
        kind=kernels.BOX,
        half_sizes=lambda s: tuple(s.size() / 2.0),
        bound=lambda s: float(np.linalg.norm(s.size() / 2.0)),
        box=lambda s: s.size() / 2.0,
        mass=lambda s: _mass_of_box(s.width(), s.depth(), s.height()),
        surface=lambda s: _scaled(unit_cube(), s.size()),
        pressure=lambda s, hint, margin: meshes.box_mesh(s.size() / 2.0, margin),
        urdf=(Tag("box", ("size",)),),
        sdf=(Tag("box", ("size",), (1.0, 1.0, 1.0)),),
        mjcf=Geom("box", (0.5, 0.5, 0.5)),
        viewer="BOX",
    ),
    ShapeType(
        shape=Sphere,
        kind=kernels.SPHERE,
        half_sizes=lambda s: (s.radius(),) * 3,
        bound=lambda s: s.radius(),
        box=lambda s: np.full(3, s.radius()),
        mass=lambda s: _mass_of_sphere(s.radius()),
        surface=lambda s: capsule(s.radius(), 0.0),
        smooth=True,
        pressure=lambda s, hint, margin: meshes.sphere_mesh(s.radius(), hint, margin),
        hinted=True,
        may_be_empty=True,
        urdf=(Tag("sphere", _RADIUS),),
        sdf=(Tag("sphere", _RADIUS, (1.0,)),),
        mjcf=Geom("sphere", (1.0,)),
        viewer="SPHERE",
    ),
    ShapeType(
        shape=Cylinder,
        kind=kernels.CYLINDER,
        half_sizes=lambda s: (s.radius(), s.radius(), s.length() / 2.0),
        bound=lambda s: math.hypot(s.radius(), s.length() / 2.0),
        box=lambda s: np.array([s.radius(), s.radius(), s.length() / 2.0]),
        mass=lambda s: _mass_of_cylinder(s.radius(), s.length()),
        surface=lambda s: lathe(
            np.array([[0.0, -0.5], [1.0, -0.5], [1.0, 0.5], [0.0, 0.5]]) * (s.radius(), s.length())
        ),
        pressure=lambda s, hint, margin: meshes.cylinder_mesh(s.radius(), s.length(), hint, margin),
        hinted=True,
        urdf=(Tag("cylinder", _ROUND),),
        sdf=(Tag("cylinder", _ROUND, (1.0, 1.0)),),
        mjcf=Geom("cylinder", (1.0, 0.5)),
        viewer="CYLINDER",
    ),
    ShapeType(
        shape=Capsule,
        kind=kernels.CAPSULE,
        half_sizes=lambda s: (s.radius(), s.radius(), s.length() / 2.0),
        bound=lambda s: s.radius() + s.length() / 2.0,
        box=lambda s: np.array([s.radius(), s.radius(), s.length() / 2.0 + s.radius()]),
        mass=lambda s: _mass_of_capsule(s.radius(), s.length()),
        surface=lambda s: capsule(s.radius(), s.length()),
        smooth=True,
        pressure=lambda s, hint, margin: meshes.capsule_mesh(s.radius(), s.length(), hint, margin),
        hinted=True,
        urdf=(Tag("drake:capsule", _ROUND), Tag("capsule", _ROUND)),
        sdf=(Tag("capsule", _ROUND, (0.5, 1.0)), Tag("drake:capsule", _ROUND)),
        mjcf=Geom("capsule", (1.0, 0.5)),
        viewer="CAPSULE",
    ),
    ShapeType(
        shape=Ellipsoid,
        kind=kernels.ELLIPSOID,
        half_sizes=lambda s: (s.a(), s.b(), s.c()),
        bound=lambda s: max(s.a(), s.b(), s.c()),
        box=_semi_axes,
        mass=lambda s: _mass_of_ellipsoid(_semi_axes(s)),
        surface=lambda s: _scaled(capsule(1.0, 0.0), _semi_axes(s)),
        smooth=True,
        pressure=lambda s, hint, margin: meshes.ellipsoid_mesh((s.a(), s.b(), s.c()), hint, margin),
        hinted=True,
        urdf=(Tag("drake:ellipsoid", ("a", "b", "c")),),
        sdf=(Tag("ellipsoid", ("radii",), (1.0, 1.0, 1.0)), Tag("drake:ellipsoid", ("a", "b", "c"))),
        mjcf=Geom("ellipsoid", (1.0, 1.0, 1.0)),
        viewer="ELLIPSOID",
    ),
    ShapeType(
        shape=Convex,
        kind=kernels.HULL,
        hull=lambda s: s.GetConvexHull(),
        mass=lambda s: of_polygons(s.GetConvexHull()),
        surface=lambda s: surface_of(s.GetConvexHull()),
    ),
    ShapeType(
        shape=Mesh,
        kind=kernels.HULL,
        hull=lambda s: s.GetConvexHull(),
        mass=_mass_of_mesh,
    ),
    ShapeType(
        shape=HalfSpace,
        kind=kernels.HALF_SPACE,
    ),
    ShapeType(
        shape=MeshcatCone,
        box=lambda s: np.array([s.a(), s.b(), s.height() / 2.0]),
        middle=lambda s: (0.0, 0.0, s.height() / 2.0),
        surface=lambda s: _scaled(
            lathe(np.array([(0.0, 0.0), (1.0, s.height()), (0.0, s.height())])), (s.a(), s.b(), 1.0)
        ),
    ),
)

SHAPE_TYPES = {row.shape: row for row in _ROWS}
