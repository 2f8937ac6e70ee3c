"""The program of a shortest path says each thing once, and has the least length that geometry tells."""

import numpy as np
import pytest

from sheldrake.geometry.optimization import (
    CartesianProduct,
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
    HPolyhedron,
    Point,
)
from sheldrake.geometry.optimization._affine import Affine
from sheldrake.geometry.optimization._shortest_path import ShortestPathProgram
from sheldrake.solvers import L2NormCost
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
