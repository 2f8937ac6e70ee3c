"""The same graphs of convex sets in both libraries: same relaxations, same samples, same paths."""

import numpy as np
import pytest
from tests.libraries import modules_of

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")
pytest.importorskip("clarabel")

MODULES = ("geometry.optimization", "solvers", "symbolic")
OURS, THEIRS = (modules_of(name, *MODULES) for name in ("sheldrake", "pydrake"))


def random_graph(L, seed, kind="quadratic"):
    """Boxes and balls on the way from a point to another, some edges both ways."""
    o, rng = L.optimization, np.random.default_rng(seed)
    graph = o.GraphOfConvexSets()
    vertices = [graph.AddVertex(o.Point([0.0, 0.0]), "start")]
    for i in range(6):
        center, size = rng.uniform(0.5, 4.5, 2), rng.uniform(0.2, 0.8, 2)
        if i % 2:
            vertices.append(graph.AddVertex(o.Hyperellipsoid.MakeAxisAligned(size, center)))
        else:
            vertices.append(graph.AddVertex(o.HPolyhedron.MakeBox(center - size, center + size)))
    vertices.append(graph.AddVertex(o.VPolytope(np.array([[5.0, 5.2], [5.0, 4.0]])), "goal"))
    for i, u in enumerate(vertices[:-1]):
        for j, v in enumerate(vertices[1:], start=1):
            if i != j and rng.uniform() < 0.45 and (i, j) != (0, len(vertices) - 1):
                graph.AddEdge(u, v, f"{i} to {j}")
    for edge in graph.Edges():
        add_cost(L, edge, kind)
        if rng.uniform() < 0.3:
            edge.AddConstraint(edge.xu()[0] <= edge.xv()[0] + 0.5)
    vertices[2].AddCost(0.3 * vertices[2].x()[1] + 0.5)
    vertices[3].AddConstraint(vertices[3].x()[0] + vertices[3].x()[1] >= 2)
    return graph, vertices[0], vertices[-1]


def add_cost(L, edge, kind):
    difference = np.hstack((np.eye(2), -np.eye(2)))
    both = np.concatenate((edge.xu(), edge.xv()))
    s = L.solvers
    if kind == "quadratic":
        edge.AddCost((edge.xu() - edge.xv()).dot(edge.xu() - edge.xv()) + 0.2)
        return
    cost = {
        "length": lambda: s.L2NormCost(difference, np.zeros(2)),
        "manhattan": lambda: s.L1NormCost(difference, np.array([0.1, 0.0])),
        "greatest": lambda: s.LInfNormCost(difference, np.zeros(2)),
        "perspective": lambda: s.PerspectiveQuadraticCost(
            np.vstack((np.zeros(4), difference)), np.array([2.0, 0.0, 0.0])
        ),
    }[kind]()
    edge.AddCost(L.solvers.Binding[s.Cost](cost, both))


def options_of(L, **fields):
    options = L.optimization.GraphOfConvexSetsOptions()
    options.convex_relaxation = True
    for name, value in fields.items():
        setattr(options, name, value)
    return options


@pytest.mark.parametrize("kind", ["quadratic", "length", "manhattan", "greatest", "perspective"])
@pytest.mark.parametrize("seed", [1, 2, 5])
def test_relaxations_and_rounded_paths(kind, seed):
    found = []
    for L in (OURS, THEIRS):
        graph, start, goal = random_graph(L, seed, kind)
        relaxed = graph.SolveShortestPath(start, goal, options_of(L))
        rounded = graph.SolveShortestPath(start, goal, options_of(L, max_rounded_paths=4, preprocessing=True))
        row = [relaxed.is_success(), rounded.is_success()]
        if rounded.is_success():
            row += [relaxed.get_optimal_cost(), rounded.get_optimal_cost()]
            path = graph.GetSolutionPath(start, goal, rounded)
            row += [[e.name() for e in path], sum(e.GetSolutionCost(rounded) for e in graph.Edges())]
            row += [sum(v.GetSolutionCost(rounded) for v in graph.Vertices())]
        found.append(row)
    mine, other = found
    assert mine[:2] == other[:2]
    np.testing.assert_allclose(mine[2:4] + mine[5:], other[2:4] + other[5:], rtol=1e-5, atol=1e-5)
    if mine[4:5] != other[4:5]:  # several are as short: Drake says so of ours
        path = graph.SolveConvexRestriction([graph.GetEdgeByName(name) for name in mine[4]], options_of(THEIRS))
        np.testing.assert_allclose(path.get_optimal_cost(), other[3], rtol=1e-5)


def test_values_in_a_relaxation():
    found = []
    for L in (OURS, THEIRS):
        graph, start, goal = random_graph(L, 2)
        graph.GetEdgeByName(graph.Edges()[1].name()).AddPhiConstraint(False)
        result = graph.SolveShortestPath(start, goal, options_of(L))
        flows = np.array([result.GetSolution(e.phi()) for e in graph.Edges()])
        products = [e.GetSolutionPhiXu(result) for e in graph.Edges()]
        cost = sum(e.GetSolutionCost(result) for e in graph.Edges())
        used = [v.GetSolution(result) for v in (start, goal)]
        found.append((flows, sum(p for p in products if p is not None), cost, *used))
    for mine, other in zip(*found):
        np.testing.assert_allclose(mine, other, atol=2e-3)  # The program is flat near its solution.


def test_sampled_paths_are_the_same():
    found = []
    for L in (OURS, THEIRS):
        graph, start, goal = random_graph(L, 2)
        rng = np.random.default_rng(3)
        flows = {e: float(rng.uniform()) for e in graph.Edges()}
        options = options_of(L, max_rounded_paths=6, rounding_seed=11)
        found.append([[e.name() for e in path] for path in graph.SamplePaths(start, goal, flows, options)])
    assert found[0] == found[1] and len(found[0]) > 2


def test_one_path():
    found = []
    for L in (OURS, THEIRS):
        graph, start, goal = random_graph(L, 2)
        path = graph.GetSolutionPath(
            start, goal, graph.SolveShortestPath(start, goal, options_of(L, max_rounded_paths=4))
        )
        result = graph.SolveConvexRestriction(path[:-1])
        points = [e.v().GetSolution(result) for e in path[:-1]]
        found.append((result.get_optimal_cost(), points, goal.GetSolution(result)))
    np.testing.assert_allclose(found[0][0], found[1][0], rtol=1e-6)
    np.testing.assert_allclose(found[0][1], found[1][1], atol=1e-3)
    assert found[0][2] is None and found[1][2] is None


def renumbered(text):
    """Ids count on within a process: named in order of appearance."""
    import re

    seen = {}
    return re.sub(r"\bv\d+(?= \[| ->|$)", lambda m: seen.setdefault(m.group(), f"n{len(seen)}"), text)


def test_pictures():
    found = []
    for L in (OURS, THEIRS):
        o = L.optimization
        graph = o.GraphOfConvexSets()
        a, b = graph.AddVertex(o.Point([0.0, 1.0]), "a"), graph.AddVertex(o.Point([2.0, 1.0]), "b")
        edge = graph.AddEdge(a, b)
        edge.AddCost((edge.xu()[0] - edge.xv()[0]) ** 2)
        result = graph.SolveConvexRestriction([edge])
        rough = o.GcsGraphvizOptions(show_slacks=False, precision=2, scientific=True)
        texts = [graph.GetGraphvizString(), graph.GetGraphvizString(active_path=[edge])]
        texts += [graph.GetGraphvizString(result), graph.GetGraphvizString(result, rough)]
        found.append([renumbered(t) for t in texts])
    assert found[0] == found[1]


def test_copies():
    for L in (OURS, THEIRS):
        graph, *_ = random_graph(L, 1)
        copy = graph.Clone()
        assert [e.name() for e in copy.Edges()] == [e.name() for e in graph.Edges()]
        assert [len(v.GetCosts()) for v in copy.Vertices()] == [len(v.GetCosts()) for v in graph.Vertices()]
        copy.RemoveVertex(copy.Vertices()[3])
        assert copy.num_vertices() == 7 < graph.num_vertices() and copy.num_edges() < graph.num_edges()


def test_whole_numbers_by_branch_and_bound():
    """Without relaxation the cost is that of the best single path; pydrake needs a commercial solver for this."""
    graph, start, goal = random_graph(OURS, 2, "length")
    exact = graph.SolveShortestPath(start, goal)
    relaxed = graph.SolveShortestPath(start, goal, options_of(OURS))
    path = graph.GetSolutionPath(start, goal, exact)
    best = graph.SolveConvexRestriction(path)
    np.testing.assert_allclose(exact.get_optimal_cost(), best.get_optimal_cost(), rtol=1e-5)
    assert relaxed.get_optimal_cost() <= exact.get_optimal_cost() + 1e-6


def test_what_is_refused():
    o = OURS.optimization
    graph, start, goal = random_graph(OURS, 2)
    with pytest.raises(RuntimeError, match="not in this graph"):
        graph.AddEdge(start, o.GraphOfConvexSets().AddVertex(o.Point([0.0])))
    edge = graph.Edges()[0]
    with pytest.raises(RuntimeError, match="not a decision variable"):
        edge.AddCost(goal.x()[0] * 1.0)
    with pytest.raises(RuntimeError, match="no transcription"):
        edge.AddConstraint(edge.xu()[0] <= 1, set())
    goal.AddCost(goal.x()[0] ** 2 - 3 * goal.x()[0])
    with pytest.raises(RuntimeError, match="non-negative"):
        graph.SolveShortestPath(start, goal, options_of(OURS))


def test_a_planted_fault_is_seen():
    costs = []
    for L, factor in ((OURS, 1.01), (THEIRS, 1.0)):
        graph, start, goal = random_graph(L, 2)
        goal.AddCost(factor * goal.x()[0])
        costs.append(graph.SolveShortestPath(start, goal, options_of(L)).get_optimal_cost())
    assert abs(costs[0] - costs[1]) > 1e-3
