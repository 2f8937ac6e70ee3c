"""Single-point contacts against Drake's ComputePointPairPenetration."""

import numpy as np
import pytest
from tests.unit.geometry.proximity_scenes import HULL_POINTS, SHAPES, Scene, random_pose

from sheldrake import geometry as g
from sheldrake.math import RigidTransform

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


ROUND = ("cylinder", "capsule", "ellipsoid")
SOLID = ("sphere", "box", *ROUND, "mesh")


def pressed_together(scene, rng, depth):
    """Two random poses at which the shapes of a scene overlap by about `depth`."""
    X, Y, d = random_pose(rng, 0.1), random_pose(rng, 0.1), rng.normal(size=3)
    d /= np.linalg.norm(d)
    low, high = 0.0, 3.0
    for _ in range(40):
        middle = (low + high) / 2
        rows = scene.contacts(RigidTransform(X.rotation(), X.translation() + middle * d), Y)
        low, high = (middle, high) if len(rows) and rows[:, 11].max() > depth else (low, middle)
    return RigidTransform(X.rotation(), X.translation() + low * d), Y


@pytest.mark.parametrize("first, second", [(a, b) for i, a in enumerate(SOLID) for b in SOLID[i:]])
def test_shallow_depth_is_never_larger_than_drakes(first, second, mesh_file):
    """Equal between polytopes; where Drake iterates on curved shapes, a smaller depth is the better minimum."""
    rng = np.random.default_rng(19)
    shapes = [shape_of(first, mesh_file), shape_of(second, mesh_file)]
    ours, drake = Scene(shapes, "single_point"), Drake(shapes)
    exact = not {first, second} & set(ROUND) and not ({first, second} == {"sphere", "mesh"})
    for _ in range(6):
        poses = pressed_together(ours, rng, 10 ** rng.uniform(-4, -2.3))
        (a,), (b,) = ours.contacts(*poses)[:, 2:], drake.contacts(*poses)
        assert a[9] <= b[9] + 1e-7
        assert a[9] >= b[9] - (1e-12 if exact else 3e-3)
        if exact:
            assert a[6:9] == pytest.approx(b[6:9], abs=1e-10)


def distances(query):
    return query.ComputeSignedDistancePairwiseClosestPoints()


class Ours(Drake):
    """The same scene in sheldrake's SceneGraph."""

    def __init__(self, shapes):
        self.scene_graph = g.SceneGraph()
        self.source = self.scene_graph.RegisterSource("test")
        self.frames = []
        for i, shape in enumerate(shapes):
            frame = self.scene_graph.RegisterFrame(self.source, g.GeometryFrame(f"frame{i}"))
            instance = g.GeometryInstance(RigidTransform(), shape, f"shape{i}")
            instance.set_proximity_properties(g.ProximityProperties())
            self.scene_graph.RegisterGeometry(self.source, frame, instance)
            self.frames.append(frame)

    def query(self, *poses):
        context = self.scene_graph.CreateDefaultContext()
        values = g.FramePoseVector()
        for frame, X in zip(self.frames, poses):
            values.set_value(frame, X)
        self.scene_graph.get_source_pose_port(self.source).FixValue(context, values)
        return self.scene_graph.get_query_output_port().Eval(context)


@pytest.mark.parametrize("first, second", [(a, b) for i, a in enumerate(SOLID) for b in SOLID[i:]])
def test_signed_distance_of_separated_shapes(first, second, mesh_file):
    """To Drake's stated accuracy; never larger than Drake's."""
    rng = np.random.default_rng(23)
    shapes = [shape_of(first, mesh_file), shape_of(second, mesh_file)]
    ours, drake = Ours(shapes), Drake(shapes)
    for _ in range(4):
        poses = random_pose(rng, 1.5), random_pose(rng, 0.3)
        (a,), (b,) = distances(ours.query(*poses)), distances(drake.query(*poses))
        if b.distance < 1e-3:
            continue
        assert a.distance <= b.distance + 1e-12 and a.distance == pytest.approx(b.distance, abs=2e-4)
        if not {first, second} - {"sphere", "box"}:
            for name in ("p_ACa", "p_BCb", "nhat_BA_W"):
                assert getattr(a, name) == pytest.approx(getattr(b, name), abs=1e-13)


@pytest.mark.parametrize("name", ["sphere", "box", "cylinder", "capsule", "half_space", "block"])
def test_signed_distance_to_point(name, tmp_path):
    """A mesh counts as it is, holes and all, not as its hull."""
    if name == "block":
        path = tmp_path / "block.obj"
        path.write_text(L_BLOCK)
        shape = g.Mesh(path, 0.5)
    else:
        shape = SHAPES[name]
    rng = np.random.default_rng(29)
    ours, drake = Ours([shape]), Drake([shape])
    for _ in range(40):
        X, p = random_pose(rng, 0.5), rng.uniform(-1, 1, 3)
        (a,) = ours.query(X).ComputeSignedDistanceToPoint(p)
        (b,) = drake.query(X).ComputeSignedDistanceToPoint(p)
        assert a.distance == pytest.approx(b.distance, abs=1e-13)
        assert a.p_GN == pytest.approx(b.p_GN, abs=1e-13) and a.grad_W == pytest.approx(b.grad_W, abs=1e-12)
    assert not ours.query(X).ComputeSignedDistanceToPoint(p, threshold=a.distance - 1e-9)


# An L-shaped prism: not convex.
_OUTLINE = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
L_BLOCK = "".join(f"v {x} {y} {z}\n" for z in (0, 1) for x, y in _OUTLINE) + "".join(
    f"f {a + 1} {b + 1} {b + 7}\nf {a + 1} {b + 7} {a + 7}\n" for a, b in zip(range(6), (1, 2, 3, 4, 5, 0))
)
L_BLOCK += "f 1 3 2\nf 1 4 3\nf 1 5 4\nf 1 6 5\nf 7 8 9\nf 7 9 10\nf 7 10 11\nf 7 11 12\n"


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
