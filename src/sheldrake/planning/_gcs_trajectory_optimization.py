"""Trajectories through graphs of regions.

T. Marcucci, M. Petersen, D. von Wrangel and R. Tedrake, "Motion planning around obstacles with convex optimization",
Science Robotics, 2023; here each region has one duration instead of a curve of time.
"""

from __future__ import annotations

import copy
import itertools
import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import anything, count, text
from sheldrake.common._overloads import overload, overloaded
from sheldrake.geometry.optimization import (
    ComputePairwiseIntersections,
    ConvexSet,
    GcsGraphvizOptions,
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
    Intersection,
    Point,
)
from sheldrake.geometry.optimization._angles import check_joints
from sheldrake.planning import _gcs_subgraphs as subgraphs
from sheldrake.planning._gcs_subgraphs import EdgesBetweenSubgraphs, Subgraph
from sheldrake.solvers._kinds import number
from sheldrake.trajectories import BezierCurve, CompositeTrajectory

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.solvers import MathematicalProgramResult

_TURN = 2.0 * math.pi
_NO_TIME = 1e-8  # [s]: so near to zero solvers leave a duration that may be zero.

_DURATIONS = {"h_min": (number, 1e-6), "h_max": (number, 20.0), "name": (text, "")}


@checked
class GcsTrajectoryOptimization:
    """Finds a trajectory of Bézier curves, one in each region that it passes.

    Args:
        num_positions: Dimension of the regions.
        continuous_revolute_joints: Places of angles that go around.

    Raises:
        RuntimeError: a place is repeated or out of range.
    """

    Subgraph: TypeAlias = subgraphs.Subgraph
    EdgesBetweenSubgraphs: TypeAlias = subgraphs.EdgesBetweenSubgraphs

    def __init__(self, num_positions: int, continuous_revolute_joints: Sequence[int] = ()):
        self._num_positions = int(num_positions)
        self._joints = check_joints(continuous_revolute_joints, self._num_positions)
        self._gcs = GraphOfConvexSets()
        self._subgraphs: list[Subgraph] = []
        self._between: list[EdgesBetweenSubgraphs] = []
        # What holds for the whole graph, and so for parts that are added later.
        self._rules: list[tuple[type, int, Callable[[Any], None]]] = []

    def num_positions(self) -> int:
        """Returns the dimension of the regions."""
        return self._num_positions

    def continuous_revolute_joints(self) -> list[int]:
        """Returns the places of angles that go around."""
        return list(self._joints)

    def graph_of_convex_sets(self) -> GraphOfConvexSets:
        """Returns the graph."""
        return self._gcs

    def GetSubgraphs(self) -> list[Subgraph]:
        """Returns the subgraphs."""
        return list(self._subgraphs)

    def GetEdgesBetweenSubgraphs(self) -> list[EdgesBetweenSubgraphs]:
        """Returns the edges between subgraphs."""
        return list(self._between)

    def GetGraphvizString(
        self,
        result: MathematicalProgramResult | None = None,
        options: GcsGraphvizOptions | None = None,
        *args: Any,
        **kwargs: Any,
    ) -> str:
        """Returns the graph in the language of Graphviz, with values of a solution if there is one."""
        return self._gcs.GetGraphvizString(result, options, *args, **kwargs)

    # The graph

    @overloaded(
        overload(
            lambda self, regions, order, *rest: self.AddRegions(regions, None, order, *rest),
            regions=anything,
            order=count,
            **_DURATIONS,
        ),
        overload(
            regions=anything, edges_between_regions=anything, order=count, **_DURATIONS, edge_offsets=(anything, None)
        ),
    )
    def AddRegions(
        self,
        regions: Sequence[ConvexSet],
        pairs: Any,
        order: int,
        h_min: float,
        h_max: float,
        name: str,
        offsets: Any = None,
    ) -> Subgraph:
        """Adds regions and edges between those that meet, and returns them.

        Called as `(regions, order, h_min=1e-6, h_max=20, name="")`, or as `(regions, edges_between_regions, order,
        h_min=1e-6, h_max=20, name="", edge_offsets=None)` with pairs of places of regions and, for angles that go
        around, by how much the first of each pair has to be moved.

        Raises:
            RuntimeError: a region has another dimension, or the shortest duration is longer than the longest.
        """
        regions = list(regions)
        if pairs is None:
            pairs, offsets = ComputePairwiseIntersections(regions, self._joints) if len(regions) > 1 else ([], None)
        pairs = [tuple(pair) for pair in pairs]
        name = name or f"Subgraph{len(self._subgraphs)}"
        subgraph = Subgraph._make(self, regions, pairs, order, h_min, h_max, name, offsets)
        self._subgraphs.append(subgraph)
        for rule in self._rules:
            self._follow(subgraph, *rule)
        return subgraph

    def RemoveSubgraph(self, subgraph: Subgraph) -> None:
        """Takes out regions with all their edges.

        Raises:
            RuntimeError: the subgraph is none of this graph.
        """
        self._require_own("RemoveSubgraph", subgraph)
        self._between = [b for b in self._between if b._from is not subgraph and b._to is not subgraph]
        for vertex in subgraph._vertices:
            self._gcs.RemoveVertex(vertex)
        self._subgraphs = [s for s in self._subgraphs if s is not subgraph]

    def _require_own(self, call: str, subgraph: Subgraph) -> None:
        if not any(subgraph is own for own in self._subgraphs):
            raise RuntimeError(f"{call}(): subgraph {subgraph.name()} is not of this graph.")

    def AddEdges(
        self,
        from_subgraph: Subgraph,
        to_subgraph: Subgraph,
        subspace: ConvexSet | None = None,
        edges_between_regions: Any = None,
        edge_offsets: Any = None,
    ) -> EdgesBetweenSubgraphs:
        """Adds edges from regions of one subgraph to those of another that they meet, and returns them.

        Args:
            from_subgraph: The first one.
            to_subgraph: The second one.
            subspace: Where the curves have to meet, a Point or an HPolyhedron; None for anywhere.
            edges_between_regions: Pairs of places of regions, instead of those that meet.
            edge_offsets: By how much the first of each pair has to be moved.

        Raises:
            RuntimeError: a subgraph is none of this graph, or the subspace is of another kind.
        """
        for subgraph in (from_subgraph, to_subgraph):
            self._require_own("AddEdges", subgraph)
        offsets = edge_offsets
        if edges_between_regions is not None:
            pairs = [tuple(p) for p in edges_between_regions]
        else:
            pairs, offsets = self._meeting(from_subgraph._regions, to_subgraph._regions, subspace)
        edges = EdgesBetweenSubgraphs._make(self, from_subgraph, to_subgraph, pairs, offsets, subspace)
        self._between.append(edges)
        for rule in self._rules:
            self._follow(edges, *rule)
        return edges

    def _meeting(self, A: list, B: list, subspace: ConvexSet | None) -> tuple[list, list | None]:
        if subspace is None:
            return ComputePairwiseIntersections(A, B, self._joints)
        if subspace.ambient_dimension() != self._num_positions:
            raise RuntimeError(f"AddEdges(): the subspace has dimension {subspace.ambient_dimension()}.")
        inside = [(i, Intersection(s, subspace)) for i, s in enumerate(A)]
        near = [(i, s) for i, s in inside if not s.IsEmpty()]
        return [(i, j) for i, s in near for j in range(len(B)) if s.IntersectsWith(B[j])], None

    # What holds for the whole graph

    def _for_all(self, least_order: int, apply: Callable[[Any], None], kind: type = subgraphs.Subgraph) -> None:
        """Applies a rule to all parts of a kind whose curves are of this order, at least, and to those added later."""
        self._rules.append((kind, least_order, apply))
        parts: list[subgraphs.Part] = [*self._subgraphs, *self._between]
        for part in parts:
            self._follow(part, kind, least_order, apply)

    @staticmethod
    def _follow(part: subgraphs.Part, kind: type, least_order: int, apply: Callable[[Any], None]) -> None:
        if isinstance(part, kind) and min(part._orders()) >= least_order:
            apply(part)

    def AddTimeCost(self, weight: float = 1.0) -> None:
        """Adds the duration of all curves, times a weight, to the cost; also of those added later."""
        self._for_all(0, lambda s: s.AddTimeCost(weight))

    def AddPathLengthCost(self, weight_matrix: Any = 1.0, *, weight: Any = None) -> None:
        """Adds the lengths of steps between control points to the cost; also of curves added later."""
        W = subgraphs.weights("AddPathLengthCost", self._num_positions, weight_matrix if weight is None else weight)
        self._for_all(1, lambda s: s.AddPathLengthCost(W))

    def AddPathEnergyCost(self, weight_matrix: Any = 1.0, *, weight: Any = None) -> None:
        """Adds the squares of steps between control points to the cost; also of curves added later."""
        W = subgraphs.energy_weights(
            "AddPathEnergyCost", self._num_positions, weight_matrix if weight is None else weight
        )
        self._for_all(1, lambda s: s.AddPathEnergyCost(W))

    def AddVelocityBounds(self, lb: ArrayLike, ub: ArrayLike) -> None:
        """Keeps velocities of all curves between bounds; also of those added later."""
        bounds = subgraphs.checked_bounds("AddVelocityBounds", self._num_positions, lb, ub)
        self._for_all(1, lambda s: s.AddVelocityBounds(*bounds))

    def AddNonlinearDerivativeBounds(self, lb: ArrayLike, ub: ArrayLike, derivative_order: int) -> None:
        """Keeps a higher time derivative of all curves between bounds; also of those added later."""
        bounds = subgraphs.checked_bounds("AddNonlinearDerivativeBounds", self._num_positions, lb, ub)
        subgraphs.require_higher(derivative_order)
        self._for_all(derivative_order, lambda s: s.AddNonlinearDerivativeBounds(*bounds, derivative_order))

    def AddPathContinuityConstraints(self, continuity_order: int) -> None:
        """Makes a derivative of the path r(s) agree wherever curves of high enough order meet."""
        subgraphs.require_more_than_position(continuity_order)
        self._for_all(
            continuity_order, lambda part: part.AddPathContinuityConstraints(continuity_order), subgraphs.Part
        )

    def AddContinuityConstraints(self, continuity_order: int) -> None:
        """Makes a time derivative of q(t) agree wherever curves of high enough order meet."""
        subgraphs.require_more_than_position(continuity_order)
        self._for_all(continuity_order, lambda part: part.AddContinuityConstraints(continuity_order), subgraphs.Part)

    # Solutions

    def SolvePath(
        self, source: Subgraph, target: Subgraph, options: GraphOfConvexSetsOptions | None = None
    ) -> tuple[CompositeTrajectory, Any]:
        """Returns the trajectory of least cost from a region of one subgraph to one of another, and the solution.

        Without other options the relaxation is solved, and the best of up to five paths sampled from it is taken. The
        trajectory is empty if none was found. Regions of order 0 (points) that take no time have no curve in it.

        Raises:
            RuntimeError: a subgraph is none of this graph; or a curve of an order above 0 takes no time.
        """
        for subgraph in (source, target):
            self._require_own("SolvePath", subgraph)
        chosen = copy.copy(GraphOfConvexSetsOptions() if options is None else options)
        for name, default in (("convex_relaxation", True), ("preprocessing", True), ("max_rounded_paths", 5)):
            if getattr(chosen, name) is None:
                setattr(chosen, name, default)
        dummies: list[Any] = []
        start = self._gathered(source, "Dummy source", dummies, True)
        goal = self._gathered(target, "Dummy target", dummies, False)
        try:
            result = self._gcs.SolveShortestPath(start, goal, chosen)
            if not result.is_success():
                return CompositeTrajectory([]), result
            tolerance = 1.0 if chosen.convex_relaxation and not chosen.max_rounded_paths else 1e-3
            path = self._gcs.GetSolutionPath(start, goal, result, tolerance)
            vertices = [path[0].u(), *(e.v() for e in path)] if path else [start]
            return self._trajectory([v for v in vertices if v not in dummies], result), result
        finally:
            for vertex in dummies:
                self._gcs.RemoveVertex(vertex)

    def _gathered(self, subgraph: Subgraph, name: str, dummies: list, outward: bool) -> Any:
        """The only vertex of a subgraph, or one without dimensions with edges to (or from) all of them."""
        if subgraph.size() == 1:
            return subgraph._vertices[0]
        dummy = self._gcs.AddVertex(Point(np.zeros(0)), name)
        dummies.append(dummy)
        for vertex in subgraph._vertices:
            self._gcs.AddEdge(*((dummy, vertex) if outward else (vertex, dummy)))
        return dummy

    def _trajectory(self, vertices: list, result: MathematicalProgramResult) -> CompositeTrajectory:
        segments, t = [], 0.0
        for vertex in vertices:
            x = vertex.GetSolution(result)
            points, duration = x[:-1].reshape(-1, self._num_positions).T, float(x[-1])
            if points.shape[1] == 1 and duration < _NO_TIME:  # a point that is passed without a stop
                continue
            if duration < np.finfo(float).eps:
                raise RuntimeError(
                    f"GcsTrajectoryOptimization: the curve in {vertex.name()} takes no time ({duration:g} s), in which "
                    "its control points cannot be passed. Give regions of an order above 0 an h_min above 0."
                )
            segments.append(BezierCurve(t, t + duration, points))
            t += duration
        return CompositeTrajectory(segments)

    def SolveConvexRestriction(
        self,
        active_vertices: list,
        options: GraphOfConvexSetsOptions | None = None,
        initial_guess: MathematicalProgramResult | None = None,
    ) -> tuple[CompositeTrajectory, Any]:
        """Returns the trajectory of least cost through given vertices in order, and the solution.

        Args:
            active_vertices: The vertices.
            options: Solvers and their options.
            initial_guess: A solution to start from.

        Raises:
            RuntimeError: two neighbours are not connected by an edge, or by several; or a curve of an order above 0
                takes no time.
        """
        edges = []
        for u, v in itertools.pairwise(active_vertices):
            found = [e for e in u.outgoing_edges() if e.v() is v]
            if not found:
                raise RuntimeError(f"Vertex: {u.name()} is not connected to vertex: {v.name()}.")
            if len(found) > 1:
                raise RuntimeError(f"Vertex: {u.name()} is connected to vertex: {v.name()} through multiple edges.")
            edges += found
        result = self._gcs.SolveConvexRestriction(edges, options, initial_guess)
        if not result.is_success():
            return CompositeTrajectory([]), result
        return self._trajectory(list(active_vertices), result), result

    @staticmethod
    def NormalizeSegmentTimes(trajectory: CompositeTrajectory) -> CompositeTrajectory:
        """Returns the path r(s) of a solution: the same curves, each in one second.

        Raises:
            RuntimeError: a segment is no Bézier curve.
        """
        start = trajectory.start_time()
        curves = [_bezier(trajectory, i) for i in range(trajectory.get_number_of_segments())]
        return CompositeTrajectory(
            [BezierCurve(start + i, start + i + 1.0, c.control_points()) for i, c in enumerate(curves)]
        )

    @staticmethod
    def UnwrapToContinuousTrajectory(
        gcs_trajectory: CompositeTrajectory,
        continuous_revolute_joints: list[int],
        starting_rounds: list[int] | None = None,
        tol: float = 1e-8,
    ) -> CompositeTrajectory:
        """Returns a solution without the whole turns by which angles jump from one curve to the next.

        Args:
            gcs_trajectory: The solution.
            continuous_revolute_joints: Places of the angles.
            starting_rounds: For each angle, in which turn [2 pi k, 2 pi (k + 1)) it starts; None to leave the start.
            tol: How far jumps may be from whole turns [rad].

        Raises:
            RuntimeError: a jump is no whole turn, a segment is no Bézier curve, or places or rounds are wrong.
        """
        joints = check_joints(continuous_revolute_joints, gcs_trajectory.rows())
        if starting_rounds is not None and len(starting_rounds) != len(joints):
            raise RuntimeError(
                f"UnwrapToContinuousTrajectory(): {len(starting_rounds)} starting rounds for {len(joints)} joints."
            )
        segments: list[BezierCurve] = []
        end: np.ndarray | None = None
        for i in range(gcs_trajectory.get_number_of_segments()):
            curve = _bezier(gcs_trajectory, i)
            points = np.array(curve.control_points())
            shift = np.zeros(len(points))
            if end is not None:
                shift[joints] = np.round((end - points[:, 0])[joints] / _TURN) * _TURN
                gap = np.abs(points[:, 0] + shift - end).max()
                if gap > tol:
                    raise RuntimeError(
                        f"UnwrapToContinuousTrajectory(): segments {i - 1} and {i} are {gap:g} apart (mod 2 pi)."
                    )
            elif starting_rounds is not None:
                rounds = np.floor(points[joints, 0] / _TURN)
                shift[joints] = (np.array(starting_rounds) - rounds) * _TURN
            points = points + shift[:, None]
            end = points[:, -1]
            segments.append(BezierCurve(curve.start_time(), curve.end_time(), points))
        return CompositeTrajectory(segments)


def _bezier(trajectory: CompositeTrajectory, i: int) -> BezierCurve:
    curve = trajectory.segment(i)
    if not isinstance(curve, BezierCurve):
        raise RuntimeError(f"All segments must be of type BezierCurve; segment {i} is a {type(curve).__name__}.")
    return curve
