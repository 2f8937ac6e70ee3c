"""Which edges a path without repeated vertices may take, against all such paths."""

import itertools
import logging

import numpy as np
import pytest

from sheldrake.geometry.optimization import GraphOfConvexSets, GraphOfConvexSetsOptions, Point
from sheldrake.geometry.optimization._usable_edges import usable

MAZE = [(0, 1), (0, 4), (1, 2), (1, 6), (2, 3), (2, 4), (2, 6), (3, 5), (5, 6)]


def taken(source: int, target: int, edges: list) -> set:
    """The edges of all paths that visit no vertex twice."""
    found: set = set()
    waiting = [[source]]
    while waiting:
        path = waiting.pop()
        if path[-1] == target:
            found.update(itertools.pairwise(path))
            continue
        waiting += [[*path, v] for u, v in edges if u == path[-1] and v not in path]
    return found


def test_a_maze_keeps_what_paths_take_alone():
    """Dead ends and ways back go, though from each something is reached."""
    edges = [*MAZE, *((v, u) for u, v in MAZE), (-1, 0), (5, 7)]
    kept = {ends for ends, may in zip(edges, usable(-1, 7, edges)) if may}
    assert kept == taken(-1, 7, edges)
    assert len(kept) == 13


@pytest.mark.parametrize("seed", range(20))
def test_no_edge_of_a_path_is_left_out(seed):
    rng = np.random.default_rng(seed)
    pairs = [(int(u), int(v)) for u, v in rng.integers(0, 7, (rng.integers(4, 18), 2)) if u != v]
    kept = {ends for ends, may in zip(pairs, usable(0, 6, pairs)) if may}
    assert taken(0, 6, pairs) <= kept


def test_large_graphs_keep_what_can_be_reached():
    """A corridor of 1,200 vertices, walked in both directions, with one that leads nowhere."""
    there = [(k, k + 1) for k in range(1200)]
    edges = [*there, *((v, u) for u, v in there), (3, -1)]
    assert usable(0, 1200, edges) == [True] * 2400 + [False]


def line_of_points(edges):
    graph = GraphOfConvexSets()
    vertices = [graph.AddVertex(Point([float(k)])) for k in range(3)]
    made = [graph.AddEdge(vertices[u], vertices[v]) for u, v in edges]
    for edge in made:
        edge.AddCost(1.0 + 0.0 * edge.xu()[0])
    return graph, vertices, made


def test_an_edge_that_must_be_taken_stays():
    """Without it the program would be solved as if nobody had asked for it."""
    graph, (start, _, end), (_, back, _) = line_of_points([(0, 1), (1, 0), (1, 2)])
    options = GraphOfConvexSetsOptions()
    options.convex_relaxation, options.preprocessing = True, True
    logging.getLogger("drake").setLevel(logging.WARNING)
    assert graph.SolveShortestPath(start, end, options).is_success()
    back.AddPhiConstraint(True)
    kept = graph.SolveShortestPath(start, end, options)
    options.preprocessing = False
    assert kept.is_success() == graph.SolveShortestPath(start, end, options).is_success()
