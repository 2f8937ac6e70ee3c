"""What is kept between queries must not be seen: other poses, other geometry and other contexts get other answers."""

import threading

import numpy as np
import pytest

from sheldrake import geometry as g
from sheldrake.common.value import Value
from sheldrake.geometry._kernels.model import contact_table
from sheldrake.geometry._query import scene
from sheldrake.math import RigidTransform
from sheldrake.systems.framework import DiagramBuilder, LeafSystem


class Balls:
    """Three balls of radius 0.5 on frames of their own."""

    def __init__(self):
        self.scene_graph = sg = g.SceneGraph()
        self.source = sg.RegisterSource("balls")
        self.frames, self.balls = [], []
        for k in range(3):
            self.frames.append(sg.RegisterFrame(self.source, g.GeometryFrame(f"frame{k}")))
            ball = g.GeometryInstance(RigidTransform(), g.Sphere(0.5), f"ball{k}")
            ball.set_proximity_properties(g.ProximityProperties())
            self.balls.append(sg.RegisterGeometry(self.source, self.frames[-1], ball))

    def context(self, *x):
        context = self.scene_graph.CreateDefaultContext()
        self.place(context, *x)
        return context

    def place(self, context, *x):
        poses = g.FramePoseVector()
        for frame, at in zip(self.frames, x):
            poses.set_value(frame, RigidTransform([at, 0, 0]))
        self.scene_graph.get_source_pose_port(self.source).FixValue(context, poses)

    def touching(self, context):
        query = self.scene_graph.get_query_output_port().Eval(context)
        points = query.ComputePointPairPenetration()
        assert query.HasCollisions() == bool(points)
        return [(self.balls.index(p.id_A), self.balls.index(p.id_B), round(p.depth, 12)) for p in points]


def test_contexts_asked_in_turns():
    balls = Balls()
    apart, near = balls.context(0.0, 2.0, 4.0), balls.context(0.0, 0.75, 4.0)
    for _ in range(2):
        assert balls.touching(apart) == []
        assert balls.touching(near) == [(0, 1, 0.25)]
    balls.place(near, 0.0, 4.5, 4.0)
    assert balls.touching(near) == [(1, 2, 0.5)]
    assert balls.touching(apart) == []


def test_answers_outlive_the_next_query():
    balls = Balls()
    context = balls.context(0.0, 0.75, 4.0)
    (first,) = balls.scene_graph.get_query_output_port().Eval(context).ComputePointPairPenetration()
    balls.place(context, 0.0, 4.0, 4.25)
    assert balls.touching(context) == [(1, 2, 0.75)]
    assert first.depth == pytest.approx(0.25)
    np.testing.assert_allclose(first.p_WCa, [0.5, 0, 0], atol=1e-14)


def test_geometry_changed_in_one_context():
    balls = Balls()
    first, second = balls.context(0.0, 0.75, 4.0), balls.context(0.0, 0.75, 4.0)
    assert balls.touching(first) == [(0, 1, 0.25)]
    pair = g.GeometrySet([balls.balls[0], balls.balls[1]])
    balls.scene_graph.collision_filter_manager(first).Apply(g.CollisionFilterDeclaration().ExcludeWithin(pair))
    assert balls.touching(first) == []
    assert balls.touching(second) == [(0, 1, 0.25)]


def test_threads_have_searches_of_their_own():
    balls, wrong = Balls(), []

    def ask(k):
        context = balls.context(0.0, 0.5 + 0.05 * k, 4.0)
        for _ in range(100):
            if balls.touching(context) != [(0, 1, round(0.5 - 0.05 * k, 12))]:
                wrong.append(k)

    threads = [threading.Thread(target=ask, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_a_pose_that_is_not_connected_is_still_an_error():
    balls = Balls()
    context = balls.context(0.0, 0.75, 4.0)
    assert balls.touching(context) == [(0, 1, 0.25)]
    with pytest.raises(RuntimeError, match=r"'balls'.*not connected"):
        balls.touching(balls.scene_graph.CreateDefaultContext())


class Published(LeafSystem):
    """Gives poses as numbers, as a plant does."""

    def __init__(self, balls):
        super().__init__()
        self.ids, self.x = tuple(balls.frames), np.zeros(3)
        self.DeclareAbstractOutputPort("poses", lambda: Value(g.FramePoseVector()), self.fill, {self.time_ticket()})

    def fill(self, context, value):
        rows = np.tile([1.0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0], (len(self.ids), 1))
        rows[:, 9] = self.x[: len(self.ids)] + context.get_time()
        value.get_mutable_value()._set_rows(self.ids, rows)


def test_poses_of_single_frames_and_geometries_follow_what_is_published():
    balls, builder = Balls(), DiagramBuilder()
    builder.AddSystem(balls.scene_graph)
    published = builder.AddSystem(Published(balls))
    builder.Connect(published.get_output_port(), balls.scene_graph.get_source_pose_port(balls.source))
    published.x = np.array([0.0, 0.75, 4.0])
    root = builder.Build().CreateDefaultContext()
    query = balls.scene_graph.get_query_output_port().Eval(balls.scene_graph.GetMyContextFromRoot(root))
    for t in (0.0, 1.0, 2.0):
        root.SetTime(t)
        for frame, ball, x in zip(balls.frames, balls.balls, published.x):
            for X in (query.GetPoseInWorld(frame), query.GetPoseInWorld(ball), query.GetPoseInParent(frame)):
                np.testing.assert_array_equal(X.translation(), [x + t, 0, 0])
        assert query.ComputeSignedDistancePairClosestPoints(*balls.balls[:2]).distance == pytest.approx(-0.25)
        assert [round(p.depth, 12) for p in query.ComputePointPairPenetration()] == [0.25]
    X.set_translation([7.0, 7.0, 7.0])  # the caller's own
    assert query.GetPoseInWorld(balls.frames[2]).translation()[0] == 6.0
    published.ids = tuple(reversed(balls.frames))
    root.SetTime(3.0)
    np.testing.assert_array_equal(query.GetPoseInWorld(balls.frames[2]).translation(), [3.0, 0, 0])
    assert query.ComputeSignedDistancePairClosestPoints(*balls.balls[1:]).distance == pytest.approx(-0.25)
    published.ids = tuple(balls.frames[:2])
    root.SetTime(4.0)
    with pytest.raises(RuntimeError, match=r"Disagreement in expected number of frames \(3\)"):
        query.GetPoseInWorld(balls.frames[2])
    published.ids = (*balls.frames[:2], g.FrameId.get_new_id())
    root.SetTime(5.0)
    with pytest.raises(RuntimeError, match="was not found in the provided kinematics data"):
        query.GetPoseInWorld(balls.frames[2])


@pytest.mark.parametrize("ask", ["ComputePointPairPenetration", "ComputeSignedDistancePairwiseClosestPoints"])
def test_a_search_that_finds_no_room_is_an_error(monkeypatch, ask):
    balls = Balls()
    query = balls.scene_graph.get_query_output_port().Eval(balls.context(0.0, 0.1, 0.2))
    monkeypatch.setattr(scene, "contact_table", lambda model, capacity: contact_table(model, 1))
    with pytest.raises(RuntimeError, match="More than 1 contact points among 3 pairs"):
        getattr(query, ask)()
