"""The same hydroelastic scenes in sheldrake and in pydrake."""

from __future__ import annotations

import importlib

import numpy as np
from tests.unit.geometry.hydro_properties import properties

TETRAHEDRON = [(0.0, 0.0, 0.0), (1.0, 0.1, 0.0), (0.2, 0.9, 0.1), (0.3, 0.2, 1.1), (0.9, 0.8, 0.9)]


def library(name):
    """The modules of "sheldrake" or "pydrake" by their last names."""
    return {m: importlib.import_module(f"{name}.{m}") for m in ("geometry", "math")}


def write_files(folder):
    """A hull without parallel edges, as OBJ, and a volume with one vertex inside, as VTK."""
    obj, vtk = folder / "hull.obj", folder / "volume.vtk"
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in TETRAHEDRON)
    obj.write_text(vertices + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 5 4\nf 3 4 5\nf 2 3 5\n")
    points = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n0.2 0.2 0.3\n"
    cells = "4 4 1 2 3\n4 0 4 2 3\n4 0 1 4 3\n4 0 1 2 4\n"
    vtk.write_text(
        f"# vtk DataFile Version 3.0\nv\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n{points}"
        f"CELLS 4 20\n{cells}CELL_TYPES 4\n" + "10\n" * 4
    )
    return {"obj": str(obj), "vtk": str(vtk)}


class Pair:
    """Two geometries, each on a frame of its own; the first was registered first."""

    def __init__(self, lib, first, second):
        """`first` and `second`: (name of a shape, its arguments, properties)."""
        g = lib["geometry"]
        self.lib, self.scene_graph = lib, g.SceneGraph()
        self.source = self.scene_graph.RegisterSource("source")
        self.frames, self.ids = [], []
        for i, (shape, arguments, what) in enumerate((first, second)):
            frame = self.scene_graph.RegisterFrame(self.source, g.GeometryFrame(f"frame{i}"))
            instance = g.GeometryInstance(lib["math"].RigidTransform(), getattr(g, shape)(*arguments), "geometry")
            instance.set_proximity_properties(properties(lib["geometry"], **what))
            self.frames.append(frame)
            self.ids.append(self.scene_graph.RegisterGeometry(self.source, frame, instance))
        self.context = self.scene_graph.CreateDefaultContext()

    def query(self, *poses):
        """QueryObject with the frames at (roll, pitch, yaw, x, y, z)."""
        m, vector = self.lib["math"], self.lib["geometry"].FramePoseVector()
        for frame, pose in zip(self.frames, poses):
            vector.set_value(frame, m.RigidTransform(m.RollPitchYaw(*pose[:3]), list(pose[3:])))
        self.scene_graph.get_source_pose_port(self.source).FixValue(self.context, vector)
        return self.scene_graph.get_query_output_port().Eval(self.context)

    def surfaces(self, *poses, triangles=False):
        """Contact surfaces as polygons, or triangles."""
        kinds = self.lib["geometry"].HydroelasticContactRepresentation
        return self.query(*poses).ComputeContactSurfaces(kinds.kTriangle if triangles else kinds.kPolygon)


def mesh_of(lib, shape, arguments, what):
    """The mesh that represents a shape."""
    g = lib["geometry"]
    scene_graph = g.SceneGraph()
    source = scene_graph.RegisterSource("source")
    instance = g.GeometryInstance(lib["math"].RigidTransform(), getattr(g, shape)(*arguments), "geometry")
    instance.set_proximity_properties(properties(lib["geometry"], **what))
    geometry = scene_graph.RegisterAnchoredGeometry(source, instance)
    context = scene_graph.CreateDefaultContext()
    return scene_graph.get_query_output_port().Eval(context).inspector().maybe_get_hydroelastic_mesh(geometry)


def elements_of(mesh):
    """Corners of all elements [m], corners and elements sorted, shape (n, corners, 3)."""
    elements = mesh.tetrahedra() if hasattr(mesh, "tetrahedra") else mesh.triangles()
    vertices = np.array(mesh.vertices())
    corners = np.array([[vertices[e.vertex(k)] for k in range(e.num_vertices())] for e in elements])
    keys = np.round(corners, 7) + 0.0
    order = np.array([np.lexsort(k.T[::-1]) for k in keys])
    corners = np.take_along_axis(corners, order[:, :, None], axis=1)
    keys = np.round(corners, 7).reshape(len(corners), -1) + 0.0
    return corners[np.lexsort(keys.T[::-1])]
