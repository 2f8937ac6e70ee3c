"""Trajectories through regions: the same costs, constraints and solutions in both libraries."""

import math

import numpy as np
import pytest
from tests.libraries import modules_of

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")
pytest.importorskip("clarabel")

MODULES = ("geometry.optimization", "planning", "solvers", "symbolic", "trajectories")
OURS, THEIRS = (modules_of(name, *MODULES) for name in ("sheldrake", "pydrake"))
KEEP = []  # What pydrake's objects refer to.


def corridor(L, order=3):
    """From a point through three boxes to another point."""
    o = L.optimization
    T = L.planning.GcsTrajectoryOptimization(2)
    boxes = [([0, 0], [2, 1]), ([1.5, 0], [2.5, 3]), ([1, 2], [4, 3])]
    regions = [o.HPolyhedron.MakeBox(*b) for b in boxes]
    start = T.AddRegions([o.Point([0.2, 0.2])], 0, name="start")
    middle = T.AddRegions(regions, order, h_min=0.1, h_max=10, name="middle")
    goal = T.AddRegions([o.Point([3.8, 2.9])], 0)
    edges = T.AddEdges(start, middle), T.AddEdges(middle, goal)
    KEEP.append(T)
    return T, (start, middle, goal), edges


def texts(T, L):
    """All costs and constraints of all vertices and edges."""
    use = L.optimization.GraphOfConvexSets.Transcription
    graph, out = T.graph_of_convex_sets(), []
    for element in (*graph.Vertices(), *graph.Edges()):
        out.append(element.name())
        for kind in (use.kRelaxation, use.kRestriction):
            out += [str(c) for c in element.GetCosts({kind})] + [str(c) for c in element.GetConstraints({kind})]
    return [t.replace("== -0\n", "== 0\n") for t in out]


def apply_plain(T, parts, edges, L):
    T.AddTimeCost(2.0)
    T.AddPathLengthCost(3.0)
    T.AddPathLengthCost(np.array([[2.0, 0.5], [0.0, 1.0]]))
    parts[1].AddPathEnergyCost(np.array([[2.0, 0.5], [0.5, 1.0]]))
    T.AddPathEnergyCost(0.7)
    T.AddVelocityBounds([-1, -1], [1, 1.5])
    T.AddPathContinuityConstraints(1)
    edges[0].AddZeroDerivativeConstraints(1)
    edges[1].AddVelocityBounds([-0.1, -0.1], [0.2, 0.2])


def apply_own(T, parts, edges, L):
    m = parts[1]
    points, (tu, tv), (xu, xv) = (
        m.vertex_control_points(),
        *(f() for f in (m.edge_constituent_vertex_durations, m.edge_constituent_vertex_control_points)),
    )
    m.AddVertexCost(m.vertex_duration() * 1.5 + points[0, 0])
    m.AddVertexConstraint(points[0, 0] <= 3)
    m.AddEdgeCost(tu + 2 * tv)
    m.AddEdgeConstraint(xu[0, 0] <= xv[0, 1] + 2)
    norm = L.solvers.L2NormCost(np.eye(2), np.zeros(2))
    m.AddVertexCost(L.solvers.Binding[L.solvers.Cost](norm, points[:, 1]))


def apply_nonlinear(T, parts, edges, L):
    T.AddNonlinearDerivativeBounds([-1, -2], [1, 2], 2)
    T.AddContinuityConstraints(1)
    # Where the second curve alone has the derivative, pydrake 1.51.1 takes the duration of the first one.
    edges[1].AddNonlinearDerivativeBounds([-1, -2], [1, 2], 2)


@pytest.mark.parametrize("apply", [apply_plain, apply_own, apply_nonlinear])
def test_costs_and_constraints(apply):
    found = []
    for L in (OURS, THEIRS):
        T, parts, edges = corridor(L)
        apply(T, parts, edges, L)
        found.append(texts(T, L))
    assert found[0] == found[1]


def test_values_of_nonlinear_constraints():
    found = []
    for L in (OURS, THEIRS):
        T, parts, edges = corridor(L)
        apply_nonlinear(T, parts, edges, L)
        exact = {L.optimization.GraphOfConvexSets.Transcription.kRestriction}
        rows = []
        for element in (parts[1].Vertices()[0], parts[1].Edges()[0]):
            for c in element.GetConstraints(exact):
                x = np.random.default_rng(1).uniform(0.2, 1, c.evaluator().num_vars())
                rows += [c.evaluator().Eval(x), c.evaluator().lower_bound(), c.evaluator().upper_bound()]
        found.append(rows)
    for mine, other in zip(*found):
        np.testing.assert_allclose(mine, other, atol=1e-12)


def values(trajectory, count=30):
    return trajectory.vector_values(np.linspace(trajectory.start_time(), trajectory.end_time(), count))


def test_solutions():
    found = []
    for L in (OURS, THEIRS):
        T, parts, edges = corridor(L)
        apply_plain(T, parts, edges, L)
        trajectory, result = T.SolvePath(parts[0], parts[2])
        path = T.NormalizeSegmentTimes(trajectory)
        vertices = T.graph_of_convex_sets().Vertices()
        again, restricted = T.SolveConvexRestriction(vertices)
        from_many, _ = T.SolvePath(parts[1], parts[2])
        costs = [result.get_optimal_cost(), restricted.get_optimal_cost()]
        times = [trajectory.get_segment_times(), path.get_segment_times(), from_many.get_segment_times()]
        found.append((costs, *times, values(trajectory), values(again)))
    for mine, other in zip(*found):
        np.testing.assert_allclose(mine, other, atol=1e-4)


def test_a_nonlinear_solution_keeps_its_bounds():
    """Accelerations are within bounds, and velocities go on, in the trajectory itself."""
    T, parts, _ = corridor(OURS, order=4)
    T.AddTimeCost()
    T.AddVelocityBounds([-1, -1], [1, 1])
    T.AddContinuityConstraints(1)
    parts[1].AddNonlinearDerivativeBounds([-2, -2], [2, 2], 2)
    T.AddPathLengthCost(0.1)
    trajectory, result = T.SolvePath(parts[0], parts[2])
    assert result.is_success()
    t = np.linspace(0.01, trajectory.end_time() - 0.01, 200)
    assert np.abs([trajectory.EvalDerivative(s, 2) for s in t]).max() < 2.01
    for joint in trajectory.get_segment_times()[2:-2]:
        before, after = (trajectory.EvalDerivative(joint + d) for d in (-1e-7, 1e-7))
        np.testing.assert_allclose(before, after, atol=1e-3)


def test_no_path():
    for L in (OURS, THEIRS):
        T, parts, _ = corridor(L)
        trajectory, result = T.SolvePath(parts[2], parts[0])
        assert not result.is_success() and trajectory.get_number_of_segments() == 0


def test_angles_that_go_around():
    found = []
    for L in (OURS, THEIRS):
        o = L.optimization
        T = L.planning.GcsTrajectoryOptimization(2, [0])
        lows = (0.0, 1.5, 3.0, 4.5)
        regions = T.AddRegions([o.HPolyhedron.MakeBox([a, 0], [a + 1.8, 1]) for a in lows], 1, name="ring")
        start = T.AddRegions([o.Point([0.5, 0.5])], 0)
        goal = T.AddRegions([o.Point([6.0, 0.7])], 0)
        T.AddEdges(start, regions), T.AddEdges(regions, goal)
        T.AddPathLengthCost()
        trajectory, result = T.SolvePath(start, goal)
        flat = T.UnwrapToContinuousTrajectory(trajectory, [0])
        turned = T.UnwrapToContinuousTrajectory(trajectory, [0], starting_rounds=[2])
        names = [e.name() for e in regions.Edges()]
        found.append((names, result.get_optimal_cost(), flat.value(flat.end_time()), turned.value(0.0), values(flat)))
        KEEP.append(T)
    assert found[0][0] == found[1][0]
    for mine, other in zip(found[0][1:4], found[1][1:4]):
        np.testing.assert_allclose(mine, other, atol=1e-5)
    np.testing.assert_allclose(found[0][2][0, 0], 6.0 - 2 * math.pi, atol=1e-6)  # The short way around.


def test_subspaces():
    found = []
    for L in (OURS, THEIRS):
        o = L.optimization
        T, parts, _ = corridor(L)
        other = T.AddRegions([o.HPolyhedron.MakeBox([0, 0], [4, 4]), o.HPolyhedron.MakeBox([3, 0], [4, 1])], 2)
        box = T.AddEdges(parts[1], other, o.HPolyhedron.MakeBox([1.8, 0.5], [2.2, 0.9]))
        point = T.AddEdges(parts[1], other, o.Point([3.5, 2.5]))
        chosen = T.AddEdges(other, parts[1], edges_between_regions=[(0, 2)])
        found.append([[e.name() for e in es.Edges()] for es in (box, point, chosen)] + texts(T, L))
    assert found[0] == found[1]


def test_removed_subgraphs():
    for L in (OURS, THEIRS):
        T, parts, _ = corridor(L)
        T.RemoveSubgraph(parts[1])
        assert T.graph_of_convex_sets().num_vertices() == 2 and T.graph_of_convex_sets().num_edges() == 0
        assert len(T.GetSubgraphs()) == 2 and T.GetEdgesBetweenSubgraphs() == []


REFUSED = [
    lambda L, T, parts, edges: T.AddPathContinuityConstraints(0),
    lambda L, T, parts, edges: parts[1].AddPathContinuityConstraints(5),
    lambda L, T, parts, edges: edges[0].AddPathContinuityConstraints(1),
    lambda L, T, parts, edges: parts[0].AddVelocityBounds([0, 0], [1, 1]),
    lambda L, T, parts, edges: T.AddNonlinearDerivativeBounds([0, 0], [1, 1], 1),
    lambda L, T, parts, edges: edges[0].AddZeroDerivativeConstraints(4),
    lambda L, T, parts, edges: edges[0].AddZeroDerivativeConstraints(0),
    lambda L, T, parts, edges: L.planning.GcsTrajectoryOptimization(2, [2]),
    lambda L, T, parts, edges: T.SolveConvexRestriction(T.graph_of_convex_sets().Vertices()[::2]),
]


@pytest.mark.parametrize("number", range(len(REFUSED)))
def test_what_is_refused(number):
    for L in (OURS, THEIRS):
        with pytest.raises(RuntimeError):
            REFUSED[number](L, *corridor(L))


def test_a_planted_fault_is_seen():
    costs = []
    for L, factor in ((OURS, 1.01), (THEIRS, 1.0)):
        T, parts, _ = corridor(L)
        T.AddPathLengthCost(factor)
        costs.append(T.SolvePath(parts[0], parts[2])[1].get_optimal_cost())
    assert abs(costs[0] - costs[1]) > 1e-2


def at_rest_at_both_ends(L, order, acceleration, jerk, smooth):
    """Least time and length through two boxes, from rest to rest, under bounds of higher derivatives."""
    o = L.optimization
    T = L.planning.GcsTrajectoryOptimization(2)
    start, goal = (T.AddRegions([o.Point(p)], 0, name=n) for n, p in (("s", [0.1, 0.1]), ("g", [1.88, 1.88])))
    boxes = [o.HPolyhedron.MakeBox([0, 0], [1, 1]), o.HPolyhedron.MakeBox([0.8, 0.8], [2, 2])]
    middle = T.AddRegions(boxes, order, h_min=0.01, h_max=20, name="m")
    for edges in (T.AddEdges(start, middle), T.AddEdges(middle, goal)):
        edges.AddZeroDerivativeConstraints(1)
    T.AddTimeCost()
    T.AddPathLengthCost()
    T.AddVelocityBounds([-2, -2], [2, 2])
    for bound, derivative in ((acceleration, 2), (jerk, 3)):
        if bound:
            T.AddNonlinearDerivativeBounds([-bound] * 2, [bound] * 2, derivative)
    if smooth:
        middle.AddContinuityConstraints(1)
        T.AddContinuityConstraints(2)
    KEEP.append(T)
    return T.SolvePath(start, goal)


@pytest.mark.parametrize("order", [4, 6])
@pytest.mark.parametrize("acceleration, jerk", [(1.0, None), (0.5, None), (1.0, 3.0)])
@pytest.mark.parametrize("smooth", [False, True])
def test_nonlinear_bounds_of_curves_that_start_and_end_at_rest(order, acceleration, jerk, smooth):
    trajectory, result = at_rest_at_both_ends(OURS, order, acceleration, jerk, smooth)
    _, theirs = at_rest_at_both_ends(THEIRS, order, acceleration, jerk, smooth)
    assert result.is_success() and theirs.is_success()
    assert result.get_optimal_cost() <= theirs.get_optimal_cost() * (1.0 + 1e-4)  # minima are local ones
    for t in np.linspace(trajectory.start_time(), trajectory.end_time(), 201)[1:-1]:
        assert np.abs(trajectory.EvalDerivative(t, 2)).max() <= acceleration + 1e-4
    assert np.abs(trajectory.EvalDerivative(trajectory.start_time(), 1)).max() < 1e-5


@pytest.mark.parametrize("h_max", [0.0, 1.0])
def test_points_that_take_no_time_have_no_curve(h_max):
    found = []
    for L in (OURS, THEIRS):
        o = L.optimization
        T = L.planning.GcsTrajectoryOptimization(2)
        start, goal = (T.AddRegions([o.Point(p)], 0, 0.0, h_max, n) for n, p in (("s", [0.1, 0.1]), ("g", [1.9, 1.8])))
        middle = T.AddRegions([o.HPolyhedron.MakeBox([0, 0], [2, 2])], 3, name="m")
        T.AddEdges(start, middle)
        T.AddEdges(middle, goal)
        T.AddTimeCost()
        T.AddVelocityBounds([-1, -1], [1, 1])
        KEEP.append(T)
        trajectory, result = T.SolvePath(start, goal)
        ends = trajectory.value(trajectory.start_time()), trajectory.value(trajectory.end_time())
        found.append((result.get_optimal_cost(), trajectory.get_number_of_segments(), *np.ravel(ends)))
    np.testing.assert_allclose(found[0], found[1], atol=1e-5)
    assert found[0][1] == 1


def test_curves_that_take_no_time_are_refused():
    for L in (OURS, THEIRS):
        T, parts, _ = corridor(L)
        short = T.AddRegions([L.optimization.Point([0.2, 0.2])], 1, h_min=0.0, h_max=0.0, name="short")
        T.AddEdges(short, parts[1])
        T.AddPathLengthCost()
        with pytest.raises(RuntimeError):
            T.SolvePath(short, parts[2])
