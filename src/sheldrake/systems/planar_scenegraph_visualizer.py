"""Drawings of a SceneGraph, pressed flat, by matplotlib: for notebooks and planar robots."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common.value import AbstractValue
from sheldrake.geometry import Convex, HalfSpace, Mesh, QueryObject, Rgba, Role
from sheldrake.geometry._meshcat.drawables import drawable_of_shape, triangles_of
from sheldrake.systems.framework._port_getters import input_port
from sheldrake.systems.pyplot_visualizer import PyPlotVisualizer

if TYPE_CHECKING:
    from sheldrake.geometry import SceneGraph, SceneGraphInspector
    from sheldrake.systems.framework import Context, DiagramBuilder, OutputPort

__all__ = ["ConnectPlanarSceneGraphVisualizer", "PlanarSceneGraphVisualizer"]

_ONTO_XZ = ((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
_GROUND, _THICKNESS = 50.0, 1.0  # half the width and the depth of what stands for a half space [m]
_WIDTH = 6.4  # of the figure [inch]


class PlanarSceneGraphVisualizer(PyPlotVisualizer):
    """Draws the illustration geometry of a SceneGraph, projected onto a plane: the hull of each geometry, filled.

    Of two geometries, the one whose middle is nearer to the viewer covers the other. Port: input "geometry_query".

    Args:
        scene_graph: The SceneGraph, whose query port is to be connected.
        draw_period: Time between drawings [s]; by default 1/30.
        T_VW: Projection of the world onto the view, shape (3, 4): two rows that give x and y in the view, one that they
            are divided by. The last row is (0, 0, 0, 1) for a view from infinitely far.
        xlim: Left and right end of the view.
        ylim: Lower and upper end of the view.
        facecolor: Color of the figure.
        use_random_colors: Whether each body gets a color of its own instead of those of the model.
        substitute_collocated_mesh_files: Whether a mesh file that cannot be read is replaced by an OBJ, VTK or glTF
            file of the same name beside it.
        ax: Axes to draw into, instead of a figure of its own.
        show: Whether to show the figure; by default if matplotlib's backend can.

    Raises:
        ValueError: when T_VW has another shape.
    """

    def __init__(
        self,
        scene_graph: SceneGraph,
        draw_period: float | None = None,
        T_VW: Any = _ONTO_XZ,
        xlim: Any = (-1.0, 1),
        ylim: Any = (-1, 1),
        facecolor: Any = (1, 1, 1),
        use_random_colors: bool = False,
        substitute_collocated_mesh_files: bool = True,
        ax: Any = None,
        show: bool | None = None,
    ):
        self._T_VW = np.array(T_VW, dtype=float)
        if self._T_VW.shape != (3, 4):
            raise ValueError(f"PlanarSceneGraphVisualizer(): T_VW must have shape (3, 4), got {self._T_VW.shape}.")
        height = _WIDTH * (ylim[1] - ylim[0]) / (xlim[1] - xlim[0])
        super().__init__(draw_period=draw_period, facecolor=facecolor, figsize=(_WIDTH, height), ax=ax, show=show)
        self.set_name("planar_scenegraph_visualizer")
        self._scene_graph = scene_graph
        self._random_colors, self._substitute = use_random_colors, substitute_collocated_mesh_files
        self._drawn_version: Any = None
        # Frame, vertices in it, shape (n, 3), and what matplotlib draws.
        self._patches: list[tuple[Any, np.ndarray, Any]] = []
        self.DeclareAbstractInputPort("geometry_query", AbstractValue.Make(QueryObject()))
        self.fig.set_size_inches(_WIDTH, height)
        self.ax.axis("equal")
        self.ax.axis("off")
        self.ax.set_xlim(xlim)
        self.ax.set_ylim(ylim)
        # From the view's plane to the viewer: what both rows of the projection leave out.
        self._toward_viewer_W = np.cross(self._T_VW[0, :3], self._T_VW[1, :3])

    get_geometry_query_input_port = input_port(0, "Returns the input port for the SceneGraph's query port.")

    def draw(self, context: Context) -> None:
        """Draws the geometry where it is in a context."""
        query = self.get_geometry_query_input_port().Eval(context)
        inspector = query.inspector()
        version = inspector.geometry_version()
        if self._drawn_version is None or not self._drawn_version.IsSameAs(version, Role.kIllustration):
            self._make_patches(inspector)
            self._drawn_version = type(version)(version)
        depths = []
        for frame, p_FV, patch in self._patches:
            p_WV = query.GetPoseInWorld(frame).multiply(p_FV.T).T
            patch.set_xy(convex_hull(self._project(p_WV)))
            depths.append(float(p_WV.mean(axis=0) @ self._toward_viewer_W))
        for order, i in enumerate(np.argsort(depths, kind="stable")):
            self._patches[i][2].set_zorder(order)
        self.ax.set_title(f"t = {float(context.get_time()):.1f}")

    def _project(self, p_WV: np.ndarray) -> np.ndarray:
        """Returns points in the view, shape (n, 2), of points in the world, shape (n, 3)."""
        homogeneous = np.hstack([p_WV, np.ones((len(p_WV), 1))]) @ self._T_VW.T
        return homogeneous[:, :2] / homogeneous[:, 2:]

    def _make_patches(self, inspector: SceneGraphInspector) -> None:
        for _, _, patch in self._patches:
            patch.remove()
        self._patches = []
        palette = np.random.default_rng(0)
        for frame in inspector.GetAllFrameIds():
            body_color = palette.uniform(0.2, 0.9, 3)
            for geometry in inspector.GetGeometries(frame, Role.kIllustration):
                properties: Any = inspector.GetIllustrationProperties(geometry)  # there are some, by its role
                if properties.HasProperty("meshcat", "accepting"):
                    continue  # for a certain Meshcat visualizer only, as ellipsoids of inertia are
                p_GV = self._outline(inspector.GetShape(geometry))
                rgba = properties.GetPropertyOrDefault("phong", "diffuse", Rgba(0.9, 0.9, 0.9, 1.0))
                color = np.append(body_color, rgba.a()) if self._random_colors else rgba.rgba
                (patch,) = self.ax.fill([0, 0, 0], [0, 0, 0], facecolor=color, edgecolor="k", closed=True)
                self._patches.append((frame, inspector.GetPoseInFrame(geometry).multiply(p_GV.T).T, patch))

    def _outline(self, shape: Any) -> np.ndarray:
        """Returns points of a shape, shape (n, 3) [m], whose hull is the shape's."""
        if isinstance(shape, HalfSpace):
            corners = np.array(np.meshgrid((-_GROUND, _GROUND), (-_GROUND, _GROUND), (-_THICKNESS, 0.0)))
            return corners.reshape(3, -1).T
        if isinstance(shape, (Convex, Mesh)):
            try:
                hull = shape.GetConvexHull()
            except RuntimeError:
                other = _beside(shape) if self._substitute else None
                if other is None:
                    raise
                hull = other.GetConvexHull()
            return np.array([hull.vertex(v) for v in range(hull.num_vertices())])
        triangles = triangles_of(drawable_of_shape(shape, Rgba()))
        assert triangles is not None
        return triangles.vertices


def _beside(shape: Any) -> Any:
    """Returns the same mesh from a file of the same name and another ending, None when there is none."""
    source = shape.source()
    if not source.is_path():
        return None
    stem = os.path.splitext(os.fspath(source.path()))[0]
    for ending in (".obj", ".vtk", ".gltf"):
        if os.path.isfile(stem + ending):
            return type(shape)(stem + ending, shape.scale3())
    return None


def convex_hull(points: np.ndarray) -> np.ndarray:
    """Returns the corners of the convex hull of points, shape (n, 2), counterclockwise (Andrew 1979)."""
    ordered = np.unique(points, axis=0)
    if len(ordered) < 3:
        return ordered

    def chain(sequence: np.ndarray) -> list[np.ndarray]:
        found: list[np.ndarray] = []
        for p in sequence:
            while len(found) > 1 and _turn(found[-2], found[-1], p) <= 0:
                found.pop()
            found.append(p)
        return found[:-1]

    return np.array(chain(ordered) + chain(ordered[::-1]))


def _turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    """Returns twice the area of the triangle a, b, c, positive when it is run through counterclockwise."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def ConnectPlanarSceneGraphVisualizer(
    builder: DiagramBuilder, scene_graph: SceneGraph, output_port: OutputPort | None = None, **kwargs: Any
) -> PlanarSceneGraphVisualizer:
    """Adds a PlanarSceneGraphVisualizer to a diagram, connects it and returns it.

    Args:
        builder: The diagram in the making.
        scene_graph: The SceneGraph.
        output_port: The query port to connect, where it is not the SceneGraph's own.
        **kwargs: For PlanarSceneGraphVisualizer.
    """
    visualizer = builder.AddSystem(PlanarSceneGraphVisualizer(scene_graph, **kwargs))
    port = scene_graph.get_query_output_port() if output_port is None else output_port
    builder.Connect(port, visualizer.get_geometry_query_input_port())
    return visualizer
