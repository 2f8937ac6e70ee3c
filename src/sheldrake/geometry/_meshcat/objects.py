"""What a Meshcat can draw: shapes, meshes, clouds, surfaces, lines."""

from __future__ import annotations

import enum
import logging
import os
from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common._kinds import anything, flag, instance_of, text
from sheldrake.common._overloads import Mismatch, kind, overload, overloaded
from sheldrake.common._scalars import scalar
from sheldrake.geometry._meshes.triangle_mesh import TriangleSurfaceMesh
from sheldrake.geometry._rgba import Rgba
from sheldrake.geometry._shapes import Convex, Mesh, Shape

from .drawables import Lines, Points, Side, Triangles, drawable_of_shape, surface_grid
from .texture import picture_file
from .tree import SceneTree, full_path

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, DTypeLike

    from sheldrake.geometry._point_cloud import PointCloud


log = logging.getLogger("drake")


class SideOfFaceToRender(enum.IntEnum):
    """Which sides of a mesh's faces are seen."""

    kFrontSide = 0
    kBackSide = 1
    kDoubleSide = 2

    __str__ = enum.Enum.__str__


_SIDES: dict[SideOfFaceToRender, Side] = {
    SideOfFaceToRender.kFrontSide: "front",
    SideOfFaceToRender.kBackSide: "back",
    SideOfFaceToRender.kDoubleSide: "double",
}


def _array3(call: str, name: str, value: ArrayLike, dtype: DTypeLike = float) -> np.ndarray:
    array = np.asarray(value, dtype=dtype)
    if array.ndim != 2 or array.shape[0] != 3:
        raise Mismatch(f"Meshcat.{call}(): {name} must have shape (3, n), got {array.shape}.")
    return array


@kind("PointCloud")
def _cloud(value: Any) -> Any:
    """Kind: a cloud of points, whose class is in a package above."""
    if not hasattr(value, "xyzs"):
        raise Mismatch
    return value


_RGBA = (instance_of(Rgba), None)


class Objects:
    """Draws things.

    Args:
        tree: The scene.
    """

    def __init__(self, tree: SceneTree):
        self._tree = tree

    def _set_shape(
        self, path: str, shape: Shape, rgba: Rgba | None = None, diffuse_map: str | os.PathLike = ""
    ) -> None:
        if isinstance(shape, (Mesh, Convex)) and shape.source().is_path() and not os.path.exists(shape.source().path()):
            log.warning("Meshcat: Could not open mesh filename %s", shape.source().path())
            return
        rgba = Rgba(0.9, 0.9, 0.9, 1.0) if rgba is None else rgba.__copy__()
        picture = picture_file(diffuse_map) if diffuse_map else ""
        self._tree.set_object(full_path(path), drawable_of_shape(shape, rgba, picture))

    def _set_cloud(self, path: str, cloud: PointCloud, point_size: float = 0.001, rgba: Rgba | None = None) -> None:
        points = np.array(cloud.xyzs(), dtype=float).T
        rgba = Rgba(0.9, 0.9, 0.9, 1.0) if rgba is None else rgba.__copy__()
        if cloud.has_rgbs():
            colors = np.array(cloud.rgbs(), dtype=np.uint8).T
        else:
            colors = np.round(255 * rgba.rgba[:3]).astype(np.uint8)
        finite = np.isfinite(points).all(axis=1)
        points, colors = points[finite], colors if colors.ndim == 1 else colors[finite]
        self._tree.set_object(full_path(path), Points(points, colors, float(point_size), rgba))

    def _set_surface(
        self, path: str, mesh: TriangleSurfaceMesh, rgba: Rgba | None = None, *args: Any, **kwargs: Any
    ) -> None:
        vertices = np.array([mesh.vertex(v) for v in range(mesh.num_vertices())], dtype=float).T
        faces = [[mesh.element(t).vertex(i) for i in range(3)] for t in range(mesh.num_triangles())]
        self.SetTriangleMesh(path, vertices, np.array(faces).T, rgba, *args, **kwargs)

    @typing_overload
    def SetObject(self, path: str, shape: Shape, rgba: Rgba = ..., diffuse_map: str | os.PathLike = "") -> None: ...
    @typing_overload
    def SetObject(
        self,
        path: str,
        mesh: TriangleSurfaceMesh,
        rgba: Rgba = ...,
        wireframe: bool = False,
        wireframe_line_width: float = 1.0,
        side: SideOfFaceToRender = ...,
    ) -> None: ...
    @typing_overload
    def SetObject(self, path: str, cloud: PointCloud, point_size: float = 0.001, rgba: Rgba = ...) -> None: ...
    @overloaded(
        overload(_set_shape, path=text, shape=instance_of(Shape), rgba=_RGBA, diffuse_map=(anything, "")),
        overload(
            _set_surface, path=text, mesh=instance_of(TriangleSurfaceMesh), rgba=_RGBA, wireframe=(flag, False),
            wireframe_line_width=(scalar(float), 1.0), side=(anything, SideOfFaceToRender.kDoubleSide),
        ),
        overload(_set_cloud, path=text, cloud=_cloud, point_size=(scalar(float), 0.001), rgba=_RGBA),
    )  # fmt: skip
    def SetObject(self, *args: Any, **kwargs: Any) -> None:
        """Draws something at a path, in place of what was drawn there.

        - `SetObject(path, shape, rgba=Rgba(0.9, 0.9, 0.9), diffuse_map="")`, with a picture file that is drawn on the
          shape, tinted by the color; not on a Mesh, a Convex or a HalfSpace
        - `SetObject(path, mesh, rgba=Rgba(0.1, 0.1, 0.1), wireframe=False, wireframe_line_width=1.0,
          side=kDoubleSide)`, for a TriangleSurfaceMesh
        - `SetObject(path, cloud, point_size=0.001, rgba=Rgba(0.9, 0.9, 0.9))`, for a PointCloud

        Of a Mesh or Convex whose file does not exist there is a warning alone.

        Raises:
            RuntimeError: when a mesh file cannot be read, or a picture is missing.
            TypeError: when the arguments fit no overload.
        """
        raise NotImplementedError  # one of the ways above is taken

    def SetTriangleMesh(
        self,
        path: str,
        vertices: Any,
        faces: Any,
        rgba: Rgba | None = None,
        wireframe: bool = False,
        wireframe_line_width: float = 1.0,
        side: SideOfFaceToRender = SideOfFaceToRender.kDoubleSide,
    ) -> None:
        """Draws a triangle mesh.

        Args:
            path: Path in the scene.
            vertices: Positions [m], shape (3, n).
            faces: Vertex numbers, shape (3, m).
            rgba: Color; dark grey when left out.
            wireframe: Whether only the edges are drawn.
            wireframe_line_width: Width of edges in pixels; pages draw 1.
            side: Which side of the faces is seen.

        Raises:
            TypeError: when a shape is wrong.
            ValueError: when a face names a vertex that does not exist.
        """
        rgba = Rgba(0.1, 0.1, 0.1, 1.0) if rgba is None else rgba.__copy__()
        self._set_triangles("SetTriangleMesh", path, vertices, faces, rgba, wireframe, side)

    def SetTriangleColorMesh(
        self,
        path: str,
        vertices: Any,
        faces: Any,
        colors: Any,
        wireframe: bool = False,
        wireframe_line_width: float = 1.0,
        side: SideOfFaceToRender = SideOfFaceToRender.kDoubleSide,
    ) -> None:
        """Draws a triangle mesh with a color at each vertex.

        Args:
            path: Path in the scene.
            vertices: Positions [m], shape (3, n).
            faces: Vertex numbers, shape (3, m).
            colors: Red, green, blue in [0, 1] of each vertex, shape (3, n).
            wireframe: Whether only the edges are drawn.
            wireframe_line_width: Width of edges in pixels; pages draw 1.
            side: Which side of the faces is seen.

        Raises:
            TypeError: when a shape is wrong.
            ValueError: when a face names a vertex that does not exist.
        """
        colors = _array3("SetTriangleColorMesh", "colors", colors).T.copy()
        if len(colors) != np.shape(vertices)[1]:
            raise ValueError(
                f"Meshcat.SetTriangleColorMesh(): {np.shape(vertices)[1]} vertices but {len(colors)} colors."
            )
        rgba = Rgba(*np.clip(colors.mean(axis=0), 0, 1)) if len(colors) else Rgba()
        self._set_triangles("SetTriangleColorMesh", path, vertices, faces, rgba, wireframe, side, colors)

    def _set_triangles(
        self,
        call: str,
        path: str,
        vertices: Any,
        faces: Any,
        rgba: Rgba,
        wireframe: bool,
        side: SideOfFaceToRender,
        colors: Any = None,
    ) -> None:
        vertices = _array3(call, "vertices", vertices).T.copy()
        faces = _array3(call, "faces", faces, dtype=np.int64).T.copy()
        if faces.size and (faces.min() < 0 or faces.max() >= len(vertices)):
            raise ValueError(
                f"Meshcat.{call}(): faces name vertices {faces.min()} to {faces.max()}, but there are {len(vertices)}."
            )
        drawable = Triangles(vertices, faces, rgba, bool(wireframe), _SIDES[SideOfFaceToRender(side)], colors)
        self._tree.set_object(full_path(path), drawable)

    def PlotSurface(
        self,
        path: str,
        X: ArrayLike,
        Y: ArrayLike,
        Z: ArrayLike,
        rgba: Rgba | None = None,
        wireframe: bool = False,
        wireframe_line_width: float = 1.0,
    ) -> None:
        """Draws a surface over a grid of points, as matplotlib's plot_surface does.

        Args:
            path: Path in the scene.
            X: x of the points [m], shape (rows, columns).
            Y: y of the points [m], shape (rows, columns).
            Z: z of the points [m], shape (rows, columns).
            rgba: Color; blue when left out.
            wireframe: Whether only the edges are drawn.
            wireframe_line_width: Width of edges in pixels; pages draw 1.

        Raises:
            ValueError: when the shapes differ or have fewer than two rows or columns.
        """
        X, Y, Z = (np.asarray(a, dtype=float) for a in (X, Y, Z))
        if not (X.shape == Y.shape == Z.shape and X.ndim == 2 and min(X.shape) >= 2):
            raise ValueError(
                f"Meshcat.PlotSurface(): X, Y, Z must have one shape, at least (2, 2); got {X.shape}, {Y.shape}, "
                f"{Z.shape}."
            )
        rgba = Rgba(0.1, 0.1, 0.9, 1.0) if rgba is None else rgba
        vertices, faces = surface_grid(X, Y, Z)
        self.SetTriangleMesh(path, vertices.T, faces.T, rgba, wireframe, wireframe_line_width)

    def SetLine(self, path: str, vertices: Any, line_width: float = 1.0, rgba: Rgba | None = None) -> None:
        """Draws a line from point to point.

        Args:
            path: Path in the scene.
            vertices: The points [m], shape (3, n).
            line_width: Width in pixels.
            rgba: Color; dark grey when left out.

        Raises:
            TypeError: when the shape is wrong.
        """
        points = _array3("SetLine", "vertices", vertices).T
        segments = np.stack([points[:-1], points[1:]], axis=1)
        self._set_lines(path, segments, line_width, rgba)

    def SetLineSegments(
        self, path: str, start: ArrayLike, end: ArrayLike, line_width: float = 1.0, rgba: Rgba | None = None
    ) -> None:
        """Draws separate line segments.

        Args:
            path: Path in the scene.
            start: Where each starts [m], shape (3, n).
            end: Where each ends [m], shape (3, n).
            line_width: Width in pixels.
            rgba: Color; dark grey when left out.

        Raises:
            TypeError: when a shape is wrong.
            ValueError: when the shapes differ.
        """
        start, end = _array3("SetLineSegments", "start", start), _array3("SetLineSegments", "end", end)
        if start.shape != end.shape:
            raise ValueError(
                f"Meshcat.SetLineSegments(): start and end must have one shape, got {start.shape} and {end.shape}."
            )
        self._set_lines(path, np.stack([start.T, end.T], axis=1), line_width, rgba)

    def _set_lines(self, path: str, segments: np.ndarray, width: float, rgba: Rgba | None) -> None:
        rgba = Rgba(0.1, 0.1, 0.1, 1.0) if rgba is None else rgba.__copy__()
        self._tree.set_object(full_path(path), Lines(segments.copy(), float(width), rgba))
