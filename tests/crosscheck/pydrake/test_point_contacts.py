"""Single-point contacts against Drake's ComputePointPairPenetration."""

import pathlib
import sys

import numpy as np
import pytest

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "unit" / "geometry"))
from proximity_scenes import HULL_POINTS, SHAPES, Scene, random_pose

from sheldrake import geometry as g

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")

# (first, second): absolute tolerance [m] of depth, points and normal
PAIRS = {
    ("sphere", "half_space"): 1e-14,
    ("box", "half_space"): 1e-14,
    ("cylinder", "half_space"): 1e-14,
    ("capsule", "half_space"): 1e-14,
    ("ellipsoid", "half_space"): 1e-14,
    ("mesh", "half_space"): 1e-14,
    ("sphere", "sphere"): 1e-14,
    ("sphere", "box"): 1e-14,
    ("sphere", "cylinder"): 1e-13,
    ("sphere", "capsule"): 1e-14,
}


@pytest.fixture(scope="module")
def mesh_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("hull") / "hull.obj"
    vertices = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in HULL_POINTS.tolist())
    path.write_text(vertices + "f 1 2 3\n")
    return path


class Drake:
    """The same two shapes in pydrake."""

    def __init__(self, shapes):
        import pydrake.geometry as dg

        self.dg = dg
        self.scene_graph = dg.SceneGraph()
        self.source = self.scene_graph.RegisterSource("test")
        self.frames = []
        for i, shape in enumerate(shapes):
            frame = self.scene_graph.RegisterFrame(self.source, dg.GeometryFrame(f"frame{i}"))
            made = eval(repr(shape), vars(dg))
            instance = dg.GeometryInstance(_identity(), made, f"shape{i}")
            instance.set_proximity_properties(dg.ProximityProperties())
            self.scene_graph.RegisterGeometry(self.source, frame, instance)
            self.frames.append(frame)

    def query(self, *poses):
        from pydrake.math import RigidTransform

        context = self.scene_graph.CreateDefaultContext()
        values = self.dg.FramePoseVector()
        for frame, X in zip(self.frames, poses):
            values.set_value(frame, RigidTransform(X.GetAsMatrix34()))
        self.scene_graph.get_source_pose_port(self.source).FixValue(context, values)
        self.context = context
        return self.scene_graph.get_query_output_port().Eval(context)

    def contacts(self, *poses):
        found = self.query(*poses).ComputePointPairPenetration()
        return np.array([[*p.p_WCa, *p.p_WCb, *p.nhat_BA_W, p.depth] for p in found]).reshape(-1, 10)


def _identity():
    from pydrake.math import RigidTransform

    return RigidTransform()


def shape_of(name, mesh_file):
    return g.Mesh(mesh_file) if name == "mesh" else SHAPES[name]


def worst_difference(first, second, mesh_file, spoil=0.0):
    rng = np.random.default_rng(17)
    shapes = [shape_of(first, mesh_file), shape_of(second, mesh_file)]
    ours, drake = Scene(shapes, "single_point"), Drake(shapes)
    worst, touched = 0.0, 0
    for _ in range(150):
        poses = random_pose(rng, 0.35), random_pose(rng, 0.25)
        a, b = ours.contacts(*poses)[:, 2:] + spoil, drake.contacts(*poses)
        assert len(a) == len(b)
        touched += len(a)
        if len(a):
            worst = max(worst, np.abs(a - b).max())
    assert touched > 40
    return worst


@pytest.mark.parametrize("first, second", PAIRS)
@pytest.mark.parametrize("swapped", [False, True])
def test_same_contact_as_drake(first, second, swapped, mesh_file):
    names = (second, first) if swapped else (first, second)
    assert worst_difference(*names, mesh_file) < PAIRS[first, second]


def test_oracle_notices_a_fault(mesh_file):
    assert worst_difference("box", "half_space", mesh_file, spoil=1e-12) > 1e-13


@pytest.mark.parametrize("name", ["box", "cylinder", "capsule"])
def test_level_shapes_as_in_drake(name, mesh_file):
    """The axis-aligned special cases."""
    from sheldrake.math import RigidTransform, RollPitchYaw

    shapes = [SHAPES[name], g.HalfSpace()]
    ours, drake = Scene(shapes, "single_point"), Drake(shapes)
    for rpy in ((0, 0, 0), (np.pi / 2, 0, 0), (0, np.pi / 2, 0.3), (1e-8, 0, 0), (1e-6, 0, 0), (np.pi, 0, 1)):
        poses = RigidTransform(RollPitchYaw(*rpy).ToRotationMatrix(), [0.1, 0.2, 0.2]), RigidTransform()
        assert ours.contacts(*poses)[:, 2:] == pytest.approx(drake.contacts(*poses), abs=1e-14)
