"""Paths in graphs of convex sets: read off a solution, or sampled from one with divided flows."""

from __future__ import annotations

from sheldrake.common import RandomGenerator
from sheldrake.geometry.optimization._gcs_elements import Edge, Vertex
from sheldrake.geometry.optimization._gcs_options import GraphOfConvexSetsOptions


def follow(source: Vertex, target: Vertex, flows: dict[int, float], tolerance: float) -> list[Edge] | None:
    """The path by the edges with the largest flows, at least 1 - tolerance; None if there is none."""
    path: list[Edge] = []
    seen, vertex = {id(source)}, source
    while vertex is not target:
        open_edges = [e for e in vertex._out if id(e._v) not in seen and flows.get(id(e), 0.0) >= 1.0 - tolerance]
        if open_edges:
            path.append(max(open_edges, key=lambda e: flows[id(e)]))
            vertex = path[-1]._v
            seen.add(id(vertex))
        elif path:
            vertex = path.pop()._u
        else:
            return None
    return path


def sample_paths(
    source: Vertex, target: Vertex, flows: dict[int, float], options: GraphOfConvexSetsOptions
) -> tuple[list[list[Edge]], int]:
    """Different paths, each edge taken with a probability proportional to its flow; and how many came again.

    Section 4.2 of T. Marcucci, M. Petersen, D. von Wrangel and R. Tedrake, "Motion planning around obstacles with
    convex optimization", Science Robotics, 2023.

    Raises:
        RuntimeError: less than one path is asked for.
    """
    wanted = options.max_rounded_paths or 0
    if wanted < 1:
        raise RuntimeError(f"SamplePaths(): max_rounded_paths must be at least 1, got {options.max_rounded_paths}.")
    generator = RandomGenerator(options.rounding_seed)
    paths: list[list[Edge]] = []
    known: set[tuple[int, ...]] = set()
    trials = 0
    while len(paths) < wanted and trials < options.max_rounding_trials:
        trials += 1
        path = _sample(generator, source, target, flows, options.flow_tolerance)
        if path is None:
            break
        key = tuple(id(e) for e in path)
        if key not in known:
            known.add(key)
            paths.append(path)
    return paths, trials - len(paths)


def _sample(
    generator: RandomGenerator, source: Vertex, target: Vertex, flows: dict[int, float], least: float
) -> list[Edge] | None:
    path: list[Edge] = []
    seen, vertex = {id(source)}, source
    while vertex is not target:
        candidates = [e for e in vertex._out if id(e._v) not in seen and flows.get(id(e), 0.0) > least]
        if not candidates:
            if not path:
                return None
            vertex = path.pop()._u
            continue
        left = generator._uniform() * sum(flows[id(e)] for e in candidates)
        for e in candidates:
            if left < flows[id(e)]:
                break
            left -= flows[id(e)]
        path.append(e)
        vertex = e._v
        seen.add(id(vertex))
    return path


def usable_edges(source: Vertex, target: Vertex, edges: list[Edge]) -> list[Edge]:
    """The edges that a path without repeated vertices may take, as far as reachability tells."""

    def reached(start: Vertex, forward: bool) -> set[int]:
        found, waiting = {id(start)}, [start]
        while waiting:
            v = waiting.pop()
            for e in v._out if forward else v._in:
                other = e._v if forward else e._u
                if id(other) not in found and e._fixed is not False:
                    found.add(id(other))
                    waiting.append(other)
        return found

    ahead, behind = reached(source, True), reached(target, False)
    return [e for e in edges if id(e._u) in ahead and id(e._v) in behind]
