"""What is kept between queries must not be seen: other poses, other geometry and other contexts get other answers."""

import copy
import threading

import numpy as np
import pytest

from sheldrake import geometry as g
from sheldrake.common.value import Value
from sheldrake.geometry._kernels.model import contact_table
from sheldrake.geometry._query import scene
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.systems.analysis import Simulator
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


def test_what_a_caller_does_to_an_answer_is_not_seen_in_the_next():
    balls = Balls()
    context = balls.context(0.0, 0.75, 4.0)
    query = balls.scene_graph.get_query_output_port().Eval(context)

    def ask():
        (pair,) = query.ComputePointPairPenetration()
        return (
            pair,
            query.ComputeSignedDistancePairwiseClosestPoints()[0],
            query.ComputeSignedDistanceToPoint([0, 0, 1])[0],
        )

    before = [repr(answer) for answer in ask()]
    for answer in ask():
        for name, kind in type(answer).__annotations__.items():
            if kind == "np.ndarray":
                getattr(answer, name)[:] = 7.0
                assert np.all(getattr(answer, name) == 7.0)
        for again in (copy.copy(answer), copy.deepcopy(answer)):
            assert repr(again) == repr(answer)
        with pytest.raises(AttributeError, match="has no attribute 'p_WCc'"):
            _ = answer.p_WCc
    assert [repr(answer) for answer in ask()] == before


def test_distances_of_other_reach_and_points_in_an_unchanged_context():
    balls = Balls()
    context = balls.context(0.0, 2.0, 4.0)
    query = balls.scene_graph.get_query_output_port().Eval(context)
    for _ in range(2):
        assert len(query.ComputeSignedDistancePairwiseClosestPoints(1.5)) == 2
        assert len(query.ComputeSignedDistancePairwiseClosestPoints()) == 3
        for x in (0.0, 1.0, 2.0):
            distances = [to.distance for to in query.ComputeSignedDistanceToPoint([x, 0, 0])]
            np.testing.assert_allclose(distances, np.abs(x - np.array([0.0, 2.0, 4.0])) - 0.5, atol=1e-14)
        assert len(query.ComputeSignedDistanceToPoint([0, 0, 0], 0.0)) == 1


class TestOnAPlant:
    """Poses that a plant shows are read where it has them."""

    def make(self, time_step=0.0):
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step)
        shapes = [g.Box(0.2, 0.3, 0.4), g.Sphere(0.1), g.Capsule(0.1, 0.2), g.HalfSpace()]
        for k, shape in enumerate(shapes[:3]):
            body = plant.AddRigidBody(f"body{k}", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
            plant.RegisterCollisionGeometry(
                body, RigidTransform([0.01, 0.02, 0.03]), shape, f"shape{k}", CoulombFriction()
            )
        plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), shapes[3], "ground", CoulombFriction())
        plant.Finalize()
        diagram = builder.Build()
        return plant, scene_graph, diagram

    def answers(self, query):
        """All of them as numbers."""
        ids, numbers = query.inspector().GetAllGeometryIds(), [query.HasCollisions()]
        numbers += [i.get_value() for pair in query.FindCollisionCandidates() for i in pair]
        for p in query.ComputePointPairPenetration():
            numbers += [p.id_A.get_value(), p.id_B.get_value(), p.depth, *p.p_WCa, *p.p_WCb, *p.nhat_BA_W]
        for d in query.ComputeSignedDistancePairwiseClosestPoints():
            numbers += [d.id_A.get_value(), d.id_B.get_value(), d.distance, *d.p_ACa, *d.p_BCb, *d.nhat_BA_W]
        for to in query.ComputeSignedDistanceToPoint([0.3, 0.2, 0.1]):
            numbers += [to.id_G.get_value(), to.distance, *to.p_GN, *to.grad_W]
        for i in (*ids, *query.inspector().GetAllFrameIds()):
            numbers += query.GetPoseInWorld(i).GetAsMatrix34().ravel().tolist()
        return np.array(numbers, float)

    def agree(self, query, other):
        """Poses are composed in Python at first, by kernels later, which may round otherwise."""
        np.testing.assert_allclose(self.answers(query), self.answers(other), rtol=0, atol=1e-12)

    @pytest.mark.parametrize("time_step", [0.0, 0.01])
    def test_as_in_a_context_that_keeps_nothing(self, time_step):
        plant, scene_graph, diagram = self.make(time_step)
        kept, fresh = diagram.CreateDefaultContext(), diagram.CreateDefaultContext()
        fresh.DisableCaching()
        port, rng = scene_graph.get_query_output_port(), np.random.default_rng(3)
        for _ in range(4):
            q = plant.GetPositions(plant.GetMyContextFromRoot(kept)) + rng.uniform(-0.1, 0.1, plant.num_positions())
            for context in (kept, fresh):
                plant.SetPositions(plant.GetMyMutableContextFromRoot(context), q)
            for _ in range(3):
                query, other = (port.Eval(scene_graph.GetMyContextFromRoot(c)) for c in (kept, fresh))
                self.agree(query, other)

    def test_after_steps_and_other_geometry_and_memory_that_moves(self):
        plant, scene_graph, diagram = self.make(0.01)
        simulator = Simulator(diagram)
        context = simulator.get_mutable_context()
        mine = scene_graph.GetMyMutableContextFromRoot(context)
        query = scene_graph.get_query_output_port().Eval(mine)

        def check():
            copied = context.Clone()
            other = scene_graph.get_query_output_port().Eval(scene_graph.GetMyContextFromRoot(copied))
            for _ in range(3):
                self.agree(query, other)
            return self.answers(query)

        seen = [check()]
        simulator.AdvanceTo(0.05)
        seen.append(check())
        source = plant.get_source_id()
        (first, *_) = plant.GetCollisionGeometriesForBody(plant.GetBodyByName("body0"))
        scene_graph.ChangeShape(mine, source, first, g.Sphere(0.2), RigidTransform([0.1, 0, 0]))
        seen.append(check())
        forces = plant.get_applied_generalized_force_input_port()
        forces.FixValue(plant.GetMyMutableContextFromRoot(context), np.ones(plant.num_velocities()))
        seen.append(check())
        simulator.AdvanceTo(0.1)
        seen.append(check())
        np.testing.assert_allclose(seen[2], seen[3], rtol=0, atol=1e-12)
        for a, b in ((0, 1), (1, 2), (3, 4)):
            assert seen[a].shape != seen[b].shape or np.abs(seen[a] - seen[b]).max() > 1e-6

    def test_in_a_frozen_cache_what_is_out_of_date_raises(self):
        plant, scene_graph, diagram = self.make()
        context = diagram.CreateDefaultContext()
        mine = scene_graph.GetMyContextFromRoot(context)
        query = scene_graph.get_query_output_port().Eval(mine)
        (first, *_) = query.inspector().GetAllGeometryIds(g.Role.kProximity)
        for _ in range(3):
            query.HasCollisions(), query.GetPoseInWorld(first)
        plant.SetPositions(plant.GetMyMutableContextFromRoot(context), plant.GetPositions(plant.CreateDefaultContext()))
        context.FreezeCache()
        for ask in (query.HasCollisions, lambda: query.GetPoseInWorld(first)):
            with pytest.raises(RuntimeError, match="frozen"):
                ask()
