"""The program of a shortest path says each thing once, and has the least length that geometry tells."""

import copy

import numpy as np
import pytest

from sheldrake.geometry.optimization import (
    CartesianProduct,
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    Intersection,
    Point,
    VPolytope,
)
from sheldrake.geometry.optimization._affine import Affine, Rows
from sheldrake.geometry.optimization._shortest_path import ShortestPathProgram
from sheldrake.solvers import L2NormCost, LinearConstraint, LinearEqualityConstraint
from sheldrake.solvers._engines.conic import ConicForm
from sheldrake.solvers._functions.bindings import bind
from sheldrake.symbolic import MakeVectorContinuousVariable


def corridor():
    """From (0, 0) over a box above and back, or over a product of intervals, to (4, 0)."""
    graph = GraphOfConvexSets()
    start, end = graph.AddVertex(Point([0.0, 0.0])), graph.AddVertex(Point([4.0, 0.0]))
    interval = HPolyhedron.MakeBox([1.0], [3.0])
    near = graph.AddVertex(CartesianProduct([interval, HPolyhedron.MakeBox([1.5], [2.0])]))
    far = graph.AddVertex(HPolyhedron.MakeBox([1.0, 5.0], [3.0, 6.0]))
    A = np.hstack((np.eye(2), -np.eye(2)))
    for u, v in ((start, near), (near, end), (start, far), (far, end), (near, far), (far, near)):
        edge = graph.AddEdge(u, v)
        edge.AddCost(bind(L2NormCost, L2NormCost(A, np.zeros(2)), np.concatenate((edge.xu(), edge.xv()))))
    return graph, start, end


def test_flows_are_said_to_be_no_less_than_zero_once():
    graph, start, end = corridor()
    program = ShortestPathProgram(start, end, graph.Edges(), relaxed=True)
    flows = {v.get_id() for v in program.phi.values()}
    boxes = [b.variables()[0].get_id() for b in program.prog.bounding_box_constraints()]
    assert sorted(id for id in boxes if id in flows) == sorted(flows)


@pytest.mark.parametrize("relaxed", [True, False])
def test_the_shortest_path_turns_at_the_nearer_box(relaxed):
    graph, start, end = corridor()
    options = GraphOfConvexSetsOptions()
    options.convex_relaxation = relaxed
    result = graph.SolveShortestPath(start, end, options)
    assert result.is_success()
    np.testing.assert_allclose(result.get_optimal_cost(), 2.0 * np.hypot(2.0, 1.5), rtol=1e-6)


def test_blocks_of_variables_are_gathered_with_each_variable_once():
    x = MakeVectorContinuousVariable(3, "x")
    M = np.arange(6.0).reshape(2, 3)
    e = M @ Affine.of(x) - Affine.of(x[[2, 0]]) + Affine.constant([5.0, 6.0])
    A, vars = e.gathered()
    assert [v.get_id() for v in vars] == [v.get_id() for v in x]
    np.testing.assert_array_equal(A, M - np.eye(3)[[2, 0]])
    np.testing.assert_array_equal(e.b, [5.0, 6.0])


def maze():
    """Regions of many kinds, several of them the same object, with costs and constraints that edges share."""
    graph = GraphOfConvexSets()
    box = HPolyhedron.MakeBox([0.0, 0.0], [2.0, 2.0])
    sets = [
        CartesianProduct([box, box, HPolyhedron.MakeBox([0.1], [3.0])]),
        CartesianProduct([VPolytope(np.array([[1.0, 3.0, 1.0], [1.0, 1.0, 3.0]])), box, Point([0.5])]),
        CartesianProduct([Hyperellipsoid.MakeHypersphere(1.5, [2.0, 2.0]), box, HPolyhedron.MakeBox([0.1], [3.0])]),
        CartesianProduct([box, Intersection(box, HPolyhedron.MakeBox([1.0, 1.0], [3.0, 3.0])), Point([1.0])]),
    ]
    vertices = [graph.AddVertex(s, f"v{i}") for i, s in enumerate(sets)]
    step = L2NormCost(np.hstack((np.eye(2), -np.eye(2))), np.zeros(2))
    equal = LinearEqualityConstraint([[1.0, -1.0]], [0.0])
    between = LinearConstraint([[1.0, 0.0, 1.0], [0.0, 1.0, 1.0]], [-np.inf, 0.0], [4.0, 5.0])
    for v in vertices:
        v.AddCost(bind(L2NormCost, step, v.x()[:4]))
        v.AddConstraint(bind(LinearConstraint, between, v.x()[[0, 3, 4]]))
    for u, v in [(0, 1), (1, 0), (1, 2), (2, 1), (0, 2), (2, 3), (1, 3), (3, 2)]:
        edge = graph.AddEdge(vertices[u], vertices[v])
        edge.AddCost((edge.xu()[:2] - edge.xv()[:2]).dot(edge.xu()[:2] - edge.xv()[:2]) + 0.1)
        for k in range(2):
            edge.AddConstraint(bind(LinearEqualityConstraint, equal, np.array([edge.xu()[2 + k], edge.xv()[k]])))
    return graph, vertices[0], vertices[3]


def test_evaluators_that_edges_share_make_the_program_that_each_would_make_alone(monkeypatch):
    graph, start, end = maze()
    shared = ShortestPathProgram(start, end, graph.Edges(), relaxed=True).prog
    monkeypatch.setattr(Rows, "alike", lambda self, source, of, add: add())
    alone = ShortestPathProgram(start, end, graph.Edges(), relaxed=True).prog
    assert shared.num_vars() == alone.num_vars()
    found, expected = ConicForm(shared), ConicForm(alone)
    assert found.cones == expected.cones
    np.testing.assert_array_equal(found.b, expected.b)
    np.testing.assert_array_equal(found.q, expected.q)
    for a, b in zip(found.A[:3], expected.A[:3]):
        np.testing.assert_array_equal(a, b)
    evaluators = {id(c.evaluator()) for c in shared.GetAllConstraints()}
    assert len(evaluators) < 0.7 * len(shared.GetAllConstraints())


def test_copies_of_sets_are_sets_of_their_own():
    point = Point([1.0, 2.0])
    product = CartesianProduct([point, point])
    copies = point.Clone(), copy.copy(point), copy.deepcopy(point), product.Clone().factor(0)
    point.set_x([3.0, 4.0])
    for other in copies:
        np.testing.assert_array_equal(other.x(), [1.0, 2.0])
    inner = product.factor(0)
    clone = product.Clone()
    inner.set_x([5.0, 6.0])
    np.testing.assert_array_equal(clone.factor(0).x(), [1.0, 2.0])


def test_bounding_boxes_of_boxes_and_others():
    box = Hyperrectangle.MaybeCalcAxisAlignedBoundingBox
    turned = HPolyhedron([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]], np.ones(4))
    found = box(turned)
    np.testing.assert_allclose([found.lb(), found.ub()], [[-1.0, -1.0], [1.0, 1.0]], atol=1e-9)
    found = box(HPolyhedron.MakeBox([0.0, -1.0], [2.0, 3.0]))
    np.testing.assert_array_equal([found.lb(), found.ub()], [[0.0, -1.0], [2.0, 3.0]])
    assert box(HPolyhedron([[1.0, 0.0]], [1.0])) is None
    assert box(HPolyhedron([[1.0], [-1.0]], [1.0, -2.0])) is None


def test_an_ellipsoid_touches_a_polyhedron_where_a_general_program_says():
    rng = np.random.default_rng(0)
    for n in (2, 3, 5):
        ellipsoid = Hyperellipsoid(rng.normal(size=(n, n)), rng.normal(size=n))
        polyhedron = HPolyhedron.MakeBox(np.full(n, 2.0), np.full(n, 3.0)).Intersection(
            HPolyhedron(rng.normal(size=(4, n)), np.full(4, 20.0))
        )
        found, point = ellipsoid.MinimumUniformScalingToTouch(polyhedron)
        expected, there = ellipsoid.MinimumUniformScalingToTouch(CartesianProduct([polyhedron]))
        assert found == pytest.approx(expected, rel=1e-6) and polyhedron.PointInSet(point, 1e-9)
        np.testing.assert_allclose(point, there, atol=1e-4)
    empty = HPolyhedron([[1.0, 0.0], [-1.0, 0.0]], [0.0, -1.0])
    with pytest.raises(RuntimeError, match="other set empty"):
        Hyperellipsoid.MakeUnitBall(2).MinimumUniformScalingToTouch(empty)


def test_a_set_that_is_given_several_times_stays_one():
    """So that what it constrains is written once; it is still a copy of the one that was given."""
    box = HPolyhedron.MakeBox([0.0], [1.0])
    product = CartesianProduct([box, Point([2.0]), box])
    assert product.factor(0) is product.factor(2) is not box
    assert product.PointInSet([0.5, 2.0, 1.0]) and not product.PointInSet([0.5, 2.0, 1.5])
