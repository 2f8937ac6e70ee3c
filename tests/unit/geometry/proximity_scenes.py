"""Small proximity scenes: one geometry a body, contacts by the kernels' Python source or native code."""

import numpy as np

from sheldrake import geometry as g
from sheldrake.geometry._compiled.points import compile_proximity
from sheldrake.geometry._compiled.search import find_contacts
from sheldrake.geometry._kernels.model import contact_table
from sheldrake.geometry._state.records import WORLD_FRAME_ID
from sheldrake.geometry._state.state import GeometryState
from sheldrake.math import RigidTransform, RotationMatrix

HULL_POINTS = np.random.default_rng(7).normal(size=(40, 3)) * [0.3, 0.4, 0.5]

SHAPES = {
    "sphere": g.Sphere(0.4),
    "box": g.Box(0.6, 0.8, 1.0),
    "cylinder": g.Cylinder(0.3, 0.9),
    "capsule": g.Capsule(0.25, 0.7),
    "ellipsoid": g.Ellipsoid(0.3, 0.5, 0.7),
    "half_space": g.HalfSpace(),
}


def random_pose(rng, scale=1.0):
    """A uniformly random rotation and a position within a cube of half size `scale` [m]."""
    q = rng.normal(size=4)
    w, x, y, z = q / np.linalg.norm(q)
    R = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return RigidTransform(RotationMatrix(R), rng.uniform(-scale, scale, 3))


def row_of(X):
    return np.concatenate([X.rotation().matrix().ravel(), X.translation()])


class Scene:
    """Shapes, each on a body of its own; body i + 1 has shape i."""

    def __init__(self, shapes, algorithm="multi_point", X_BG=None):
        state = GeometryState()
        source = state.register_source("test")
        frames = {WORLD_FRAME_ID: 0}
        for i, shape in enumerate(shapes):
            frame = state.register_frame(source, WORLD_FRAME_ID, g.GeometryFrame(f"frame{i}"))
            frames[frame] = i + 1
            instance = g.GeometryInstance(RigidTransform() if X_BG is None else X_BG[i], shape, f"shape{i}")
            properties = g.ProximityProperties()
            properties.AddProperty("material", "point_contact_algorithm", algorithm)
            instance.set_proximity_properties(properties)
            state.register_geometry(source, frame, instance)
        state.apply_proximity_defaults(g.DefaultProximityProperties())
        self.state = state
        self.model, self.ids = compile_proximity(state, frames)
        self.table = contact_table(self.model)
        self.X_WB = np.zeros((len(shapes) + 1, 12))
        self.X_WB[:, [0, 4, 8]] = 1.0

    def contacts(self, *poses, native=False):
        """Rows (A, B, p_WCa, p_WCb, nhat_BA_W, depth), shape (n, 12)."""
        for body, X in enumerate(poses, 1):
            self.X_WB[body] = row_of(X)
        status = find_contacts(self.model, self.X_WB, self.table, native)
        assert status == 0
        n = self.table.num_contacts
        return np.hstack([self.table.pair[:n, :2], self.table.point[:n]])


def height_of(X_WH, points):
    """Heights of points, shape (n, 3), above the plane z = 0 of frame H [m]."""
    return (points - X_WH.translation()) @ X_WH.rotation().matrix()[:, 2]
