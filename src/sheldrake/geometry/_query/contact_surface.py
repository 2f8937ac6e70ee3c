"""The surface on which two overlapping geometries press on each other."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.common._no_constructor import no_constructor
from sheldrake.geometry._ids import GeometryId
from sheldrake.geometry._kernels.hydro_model import (
    Choices,
    Compliance,
    Face,
    FaceValue,
    FaceVertex,
    Found,
    HydroModel,
    HydroTable,
    Mesh,
    Surface,
)
from sheldrake.geometry._meshes.mesh_fields import PolygonSurfaceMeshFieldLinear, TriangleSurfaceMeshFieldLinear
from sheldrake.geometry._meshes.polygon_mesh import PolygonSurfaceMesh, _index
from sheldrake.geometry._meshes.triangle_mesh import TriangleSurfaceMesh
from sheldrake.geometry._numbers import plain, values_of
from sheldrake.geometry._roles import HydroelasticContactRepresentation

_SAME_PLACE = 1e-10  # relative to the surface's size: vertices of neighbouring faces that are nearer are one


@no_constructor("Surfaces come from QueryObject.ComputeContactSurfaces().")
class ContactSurface:
    """Where the pressures of geometries M and N are equal, or that of one meets the other's rigid surface.

    id_M < id_N, and the faces' normals point out of N into M. Everything is in W.
    """

    _ids: tuple[GeometryId, GeometryId]
    _triangle: bool
    _faces: list[tuple[int, ...]]
    _vertex: np.ndarray  # p_WV and pressure
    _value: np.ndarray  # rows of HydroTable.value
    _has: tuple[bool, bool]
    _mesh_and_field: tuple[Any, Any] | None

    @classmethod
    def _make(
        cls, ids: tuple, triangle: bool, faces: list, vertex: np.ndarray, value: np.ndarray, has: tuple[bool, bool]
    ) -> ContactSurface:
        """From the faces' corners (rows of `vertex`) and numbers; `has` tells whether M and N are compliant."""
        new = object.__new__(cls)
        new._ids, new._triangle, new._faces = ids, triangle, faces
        new._vertex, new._value, new._has = vertex, value, has
        new._mesh_and_field = None
        return new

    # ---- who

    def id_M(self) -> GeometryId:
        """Geometry M."""
        return self._ids[0]

    def id_N(self) -> GeometryId:
        """Geometry N."""
        return self._ids[1]

    # ---- faces

    def num_faces(self) -> int:
        """Number of faces."""
        return len(self._faces)

    def num_vertices(self) -> int:
        """Number of vertices."""
        return len(self._vertex)

    def area(self, face_index: int) -> float:
        """Area of a face [m^2]."""
        return plain(self._value[_index("area", face_index, self._faces), FaceValue.area])

    def total_area(self) -> float:
        """Area of all faces [m^2]."""
        return plain(self._value[:, FaceValue.area].sum())

    def face_normal(self, face_index: int) -> np.ndarray:
        """Unit normal of a face in W, out of N into M, shape (3,)."""
        return self._columns("face_normal", face_index, FaceValue.normal.columns)

    def centroid(self, face_index: int | None = None) -> np.ndarray:
        """Centroid of a face, or of the surface, in W [m], shape (3,)."""
        if face_index is not None:
            return self._columns("centroid", face_index, FaceValue.p_WC.columns)
        area, centroids = self._value[:, FaceValue.area], self._value[:, FaceValue.p_WC.columns]
        total = area.sum()
        return area @ centroids / total if total > 0.0 else centroids.mean(axis=0)

    def _columns(self, call: str, face_index: int, columns: slice) -> np.ndarray:
        return self._value[_index(call, face_index, self._faces), columns].copy()

    # ---- mesh and pressure

    def is_triangle(self) -> bool:
        """True if the faces are triangles, False if they are polygons."""
        return self._triangle

    def representation(self) -> HydroelasticContactRepresentation:
        """What the faces are."""
        kinds = HydroelasticContactRepresentation
        return kinds.kTriangle if self._triangle else kinds.kPolygon

    def _built(self) -> tuple[Any, Any]:
        """Mesh and field; made when first asked for."""
        if self._mesh_and_field is None:
            points, pressure = self._vertex[:, FaceVertex.p_WV.columns], self._vertex[:, FaceVertex.pressure].copy()
            if self._triangle:
                mesh: Any = TriangleSurfaceMesh(self._faces, points)
                field: Any = TriangleSurfaceMeshFieldLinear._make(mesh, pressure)
            else:
                mesh = PolygonSurfaceMesh([n for f in self._faces for n in (len(f), *f)], points)
                known = FaceValue.gradient_M if self._has[0] else FaceValue.gradient_N
                gradients = self._value[:, known.columns]
                field = PolygonSurfaceMeshFieldLinear._make(mesh, pressure, gradients)
            self._mesh_and_field = mesh, field
        return self._mesh_and_field

    def _required(self, call: str, triangle: bool) -> tuple[Any, Any]:
        if self._triangle != triangle:
            raise RuntimeError(
                f"ContactSurface.{call}(): the surface is made of {'triangles' if self._triangle else 'polygons'}."
            )
        return self._built()

    def tri_mesh_W(self) -> TriangleSurfaceMesh:
        """The triangles in W.

        Raises:
            RuntimeError: the faces are polygons.
        """
        return self._required("tri_mesh_W", True)[0]

    def tri_e_MN(self) -> TriangleSurfaceMeshFieldLinear:
        """Pressure on the triangles [Pa].

        Raises:
            RuntimeError: the faces are polygons.
        """
        return self._required("tri_e_MN", True)[1]

    def poly_mesh_W(self) -> PolygonSurfaceMesh:
        """The polygons in W.

        Raises:
            RuntimeError: the faces are triangles.
        """
        return self._required("poly_mesh_W", False)[0]

    def poly_e_MN(self) -> PolygonSurfaceMeshFieldLinear:
        """Pressure on the polygons [Pa].

        Raises:
            RuntimeError: the faces are triangles.
        """
        return self._required("poly_e_MN", False)[1]

    # ---- gradients

    def HasGradE_M(self) -> bool:
        """True if M is compliant."""
        return self._has[0]

    def HasGradE_N(self) -> bool:
        """True if N is compliant."""
        return self._has[1]

    def EvaluateGradE_M_W(self, index: int) -> np.ndarray:
        """Gradient of M's pressure at a face, in W [Pa/m], shape (3,).

        Raises:
            RuntimeError: M is rigid.
        """
        return self._gradient("M", index)

    def EvaluateGradE_N_W(self, index: int) -> np.ndarray:
        """Gradient of N's pressure at a face, in W [Pa/m], shape (3,).

        Raises:
            RuntimeError: N is rigid.
        """
        return self._gradient("N", index)

    def _gradient(self, which: str, index: int) -> np.ndarray:
        if not self._has["MN".index(which)]:
            raise RuntimeError(
                f"ContactSurface::EvaluateGradE_{which}_W() invalid; no gradient values stored. Mesh {which} may be "
                "rigid, or the constituent gradients weren't requested."
            )
        gradient = FaceValue.gradient_M if which == "M" else FaceValue.gradient_N
        return self._columns(f"EvaluateGradE_{which}_W", index, gradient.columns)

    # ---- values

    def Equal(self, surface: ContactSurface) -> bool:
        """True if both have the same geometries, faces and pressures, bit for bit."""
        same = self._ids == surface._ids and self._triangle == surface._triangle and self._faces == surface._faces
        same = same and self._has == surface._has and np.array_equal(self._vertex, surface._vertex)
        return same and np.array_equal(self._value, surface._value)

    def __copy__(self) -> ContactSurface:
        return self  # nothing can change it

    def __deepcopy__(self, memo: dict) -> ContactSurface:
        return self


def surfaces_of(table: HydroTable, model: HydroModel, ids: list[GeometryId]) -> list[tuple[int, ContactSurface]]:
    """The surfaces in a table with their numbers there, sorted by the numbers of M and N.

    Args:
        table: filled by the kernels.
        model: what they read.
        ids: of the geometries.
    """
    triangle = bool(model.setting[Choices.triangles])
    modulus, half_space = model.number[:, Compliance.modulus], model.geometry[:, Mesh.num_leaves] == 0
    count = int(table.count[Found.num_surfaces])
    ends = [*table.surface[:count, Surface.first_face].tolist(), int(table.count[Found.num_faces])]
    found = []
    for s in sorted(range(count), key=lambda s: tuple(table.surface[s, :2].tolist())):
        m, n = int(table.surface[s, Surface.geometry_M]), int(table.surface[s, Surface.geometry_N])
        faces, vertex = _loops(table, ends[s], ends[s + 1], triangle, bool(half_space[m] or half_space[n]))
        value, has = table.value[ends[s] : ends[s + 1]].copy(), (bool(modulus[m] < np.inf), bool(modulus[n] < np.inf))
        found.append((s, ContactSurface._make((ids[m], ids[n]), triangle, faces, vertex, value, has)))
    return found


def _loops(
    table: HydroTable, first: int, end: int, triangle: bool, shared: bool
) -> tuple[list[tuple[int, ...]], np.ndarray]:
    """Corners of faces and the vertices they number; `shared` makes vertices at one place one vertex."""
    rows = table.face[first:end]
    if triangle:
        corners = rows[:, Face.corners.columns]
        low, high = int(corners.min()), int(corners.max()) + 1
        loops = (corners - low).tolist()
    else:
        starts, counts = rows[:, Face.corners.at], rows[:, Face.num_corners]
        low, high = int(starts[0]), int(starts[-1] + counts[-1])
        loops = [range(a - low, a - low + n) for n, a in zip(counts.tolist(), starts.tolist())]
    points = table.vertex[low:high] + 0.0
    if not shared:
        return [tuple(loop) for loop in loops], points
    places = values_of(points[:, FaceVertex.p_WV.columns])
    grid = _SAME_PLACE * max(np.ptp(places, axis=0).max(), 1e-300)
    places = np.round(places / grid)
    _, kept, which = np.unique(places, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(kept)
    number = np.empty(len(order), np.int64)
    number[order] = np.arange(len(order))
    renumbered = number[which.reshape(-1)].tolist()
    return [tuple(renumbered[v] for v in loop) for loop in loops], points[kept[order]]
