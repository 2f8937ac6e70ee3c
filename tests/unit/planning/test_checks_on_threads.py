"""Collision checks of many configurations: machine code on threads answers as queries one after the other do."""

import itertools

import numpy as np
import pytest

import sheldrake.planning as planning
from sheldrake.common import Parallelism
from sheldrake.geometry import Box, Cylinder, HalfSpace, Sphere
from sheldrake.geometry._kernels.model import contact_table
from sheldrake.geometry.optimization import HPolyhedron, Hyperellipsoid
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.plant import CoulombFriction
from sheldrake.multibody.tree import FixedOffsetFrame, RevoluteJoint
from sheldrake.planning import _native_checks
from sheldrake.planning._native_checks import NativeChecks


def checker(threads=2, **params):
    """An arm of three links in a plane, among a box, a ball and a wall."""
    builder = planning.RobotDiagramBuilder(0.0)
    plant, X, friction = builder.plant(), RigidTransform, CoulombFriction(1.0, 1.0)
    robot, around = plant.AddModelInstance("robot"), plant.AddModelInstance("around")
    inertia, at = SpatialInertia.SolidCubeWithDensity(1.0, 0.1), plant.world_frame()
    for i, shape in enumerate((Sphere(0.1), Cylinder(0.08, 0.2), Box(0.2, 0.1, 0.1))):
        link = plant.AddRigidBody(f"link{i}", robot, inertia)
        plant.AddJoint(RevoluteJoint(f"joint{i}", at, link.body_frame(), [0.0, 0.0, 1.0], -3.0, 3.0))
        plant.RegisterCollisionGeometry(link, X([0.25, 0.0, 0.0]), shape, f"shape{i}", friction)
        at = plant.AddFrame(FixedOffsetFrame(f"end{i}", link.body_frame(), X([0.5, 0.0, 0.0])))
    box = plant.AddRigidBody("box", around, inertia)
    plant.RegisterCollisionGeometry(box, X(), Box(0.2, 0.2, 0.2), "box", friction)
    plant.WeldFrames(plant.world_frame(), box.body_frame(), X([0.8, 0.6, 0.0]))
    plant.RegisterCollisionGeometry(plant.world_body(), X([0.0, -1.0, 0.0]), Sphere(0.3), "ball", friction)
    wall = X(HalfSpace.MakePose([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]).rotation(), [-1.0, 0.0, 0.0])
    plant.RegisterCollisionGeometry(plant.world_body(), wall, HalfSpace(), "wall", friction)
    given = {"model": builder.Build(), "robot_model_instances": [robot], "edge_step_size": 0.1, **params}
    given["implicit_context_parallelism"] = Parallelism(threads)
    return planning.SceneGraphCollisionChecker(planning.CollisionCheckerParams(**given))


QS = list(np.random.default_rng(4).uniform(-3.0, 3.0, (150, 3)))
EDGES = list(itertools.pairwise(QS[:31]))


def of(measure):
    return measure.distance(), measure.alpha_or(-1.0)


def one_by_one(c, qs):
    return [int(c.CheckConfigCollisionFree(q)) for q in qs]


@pytest.mark.parametrize("paddings", [(0.0, 0.0), (0.1, 0.05), (-0.03, 0.2)])
def test_many_configurations_are_checked_as_one_by_one(paddings):
    c = checker(env_collision_padding=paddings[0], self_collision_padding=paddings[1])
    alone = one_by_one(c, QS)
    assert 10 < sum(alone) < 140
    for threads in (1, 2, None):
        assert c.CheckConfigsCollisionFree(QS, threads) == alone
    free = [int(c.CheckEdgeCollisionFree(*edge)) for edge in EDGES]
    measures = [of(c.MeasureEdgeCollisionFree(*edge)) for edge in EDGES]
    assert c.CheckEdgesCollisionFree(EDGES) == free == [int(c.CheckEdgeCollisionFreeParallel(*e)) for e in EDGES]
    assert [of(m) for m in c.MeasureEdgesCollisionFree(EDGES, 2)] == measures
    assert [of(c.MeasureEdgeCollisionFreeParallel(*e)) for e in EDGES] == measures
    seen = planning.VisibilityGraph(c, np.array(QS[:12]).T).toarray()
    assert seen[3, 1] == (alone[3] and alone[1] and c.CheckEdgeCollisionFree(QS[3], QS[1]))


def test_checks_leave_python_to_others(monkeypatch):
    """All is one kernel's call, in which threads do not wait for each other."""
    c, asked = checker(), []
    monkeypatch.setattr(type(c), "_is_free", type(c)._is_free)
    found = NativeChecks.first_collisions
    monkeypatch.setattr(NativeChecks, "first_collisions", lambda *a: asked.append(len(a[1])) or found(*a))
    c.CheckConfigsCollisionFree(QS)
    assert asked == [len(QS)]


@pytest.mark.parametrize("threads", [1, 2])
def test_a_search_that_fails_ends_the_check(monkeypatch, threads):
    c = checker()
    monkeypatch.setattr(_native_checks, "contact_table", lambda model, capacity: contact_table(model, 1))
    with pytest.raises(RuntimeError, match=r"More than 1 contact points among .* the contact table is full"):
        c.CheckConfigsCollisionFree(QS, threads)


def test_filters_and_shapes_that_come_later_count():
    c = checker()
    before = c.CheckConfigsCollisionFree(QS)
    plant = c.plant()
    c.SetCollisionFilteredBetween(plant.GetBodyByName("link2"), plant.GetBodyByName("box"), True)
    filtered = c.CheckConfigsCollisionFree(QS)
    assert filtered == one_by_one(c, QS) and sum(filtered) > sum(before)
    c.AddCollisionShapeToBody("held", plant.GetBodyByName("link2"), Sphere(0.2), RigidTransform([0.5, 0.0, 0.0]))
    held = c.CheckConfigsCollisionFree(QS)
    assert held == one_by_one(c, QS) and sum(held) < sum(filtered)


def test_a_check_of_ones_own_is_asked():
    class Timid(planning.SceneGraphCollisionChecker):
        def _is_free(self, context):
            return False

    c = checker()
    c.__class__ = Timid
    assert c.CheckConfigsCollisionFree(QS[:3]) == [0, 0, 0]
    blind = checker()
    blind._is_free = lambda context: True
    assert all(blind.CheckConfigsCollisionFree(QS))


def test_what_is_no_configuration_is_refused():
    c = checker()
    for bad in ([0.0, 0.0], [0.0, np.nan, 0.0]):
        with pytest.raises(RuntimeError, match="3 finite values"):
            c.CheckConfigsCollisionFree([QS[0], bad])


def test_regions_do_not_depend_on_threads():
    c = checker()
    center = next(
        q for q in QS if c.CheckConfigCollisionFree(q) and c.CalcRobotClearance(q, 0.5).distances().min() > 0.1
    )
    start, domain = Hyperellipsoid.MakeHypersphere(0.05, center), HPolyhedron.MakeBox([-3.0] * 3, [3.0] * 3)
    found = []
    for threads in (1, 2):
        options = planning.IrisZoOptions()
        common = options.sampled_iris_options
        common.max_iterations, common.max_iterations_separating_planes = 1, 3
        common.parallelism = Parallelism(threads)
        found.append(planning.IrisZo(c, start, domain, options))
    assert np.array_equal(found[0].A(), found[1].A()) and np.array_equal(found[0].b(), found[1].b())
    assert len(found[0].b()) > 6


def test_one_configuration_and_one_edge_are_what_queries_of_another_context_say():
    """The checker's own context is asked by kernels, one that stands alone by queries."""
    c = checker()
    alone = c.MakeStandaloneModelContext()
    rng = np.random.default_rng(8)
    link, box = (c.plant().GetBodyByName(name) for name in ("link2", "box"))

    def compare():
        free = []
        for _ in range(40):
            q1, q2 = rng.uniform(-2.5, 2.5, (2, 3))
            free.append(c.CheckConfigCollisionFree(q1))
            assert free[-1] is c.CheckContextConfigCollisionFree(alone, q1)
            assert c.CheckEdgeCollisionFree(q1, q2) is c.CheckContextEdgeCollisionFree(alone, q1, q2)
            mine, other = c.MeasureEdgeCollisionFree(q1, q2), c.MeasureContextEdgeCollisionFree(alone, q1, q2)
            assert mine.completely_free() == other.completely_free()
            assert mine.partially_free() == other.partially_free()
            assert not mine.partially_free() or mine.alpha() == other.alpha()
        return sum(free)

    assert 5 < compare() < 38
    c.SetPaddingAllRobotEnvironmentPairs(0.1)
    compare()
    c.SetPaddingOneRobotBodyAllEnvironmentPairs(link.index(), 0.0)
    compare()
    c.SetPaddingAllRobotEnvironmentPairs(0.0)
    c.SetCollisionFilteredBetween(link, box, True)
    compare()
    c.AddCollisionShapeToBody("more", link, Sphere(0.5), RigidTransform([0.3, 0.0, 0.0]))
    compare()
    c.RemoveAllAddedCollisionShapes()
    compare()
