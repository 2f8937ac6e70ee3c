"""Graphs whose vertices are convex sets, and shortest paths through points of these."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from sheldrake.common import Parallelism, RandomGenerator
from sheldrake.common._checked import checked
from sheldrake.common._options import Options
from sheldrake.geometry.optimization import _gcs_elements as elements
from sheldrake.geometry.optimization._affine import Known
from sheldrake.geometry.optimization._convex_set import ConvexSet
from sheldrake.geometry.optimization._gcs_elements import Edge, Vertex
from sheldrake.geometry.optimization._shortest_path import ShortestPathProgram, restriction
from sheldrake.geometry.optimization._usable_edges import usable
from sheldrake.solvers import (
    ChooseBestSolver,
    ClarabelSolver,
    GetProgramType,
    MakeSolver,
    MathematicalProgramResult,
    MixedIntegerBranchAndBound,
    ProgramType,
    SolutionResult,
    SolverInterface,
    SolverOptions,
)

if TYPE_CHECKING:
    from sheldrake.solvers import MathematicalProgram

# ---- options


class GraphOfConvexSetsOptions(Options):
    """How shortest paths are searched.

    Attributes:
        convex_relaxation: Whether flows need not be whole numbers; None for the default of the call.
        preprocessing: Whether edges that no path can take are left out first; None for the default of the call.
        max_rounded_paths: How many paths are sampled from a relaxation; None for the default of the call.
        max_rounding_trials: How often sampling is tried.
        flow_tolerance: Edges with less flow are not sampled.
        rounding_seed: Of the samples.
        solver: A solver; None for the best.
        restriction_solver: For single paths; None for `solver`.
        preprocessing_solver: Accepted; preprocessing needs none.
        solver_options: Options of the solver.
        restriction_solver_options: For single paths; None for `solver_options`.
        preprocessing_solver_options: Accepted; preprocessing needs none.
        parallelism: Accepted; one path is solved at a time.
    """

    convex_relaxation: bool | None = None
    preprocessing: bool | None = None
    max_rounded_paths: int | None = None
    max_rounding_trials: int = 100
    flow_tolerance: float = 1e-5
    rounding_seed: int = 0
    solver: SolverInterface | None = None
    restriction_solver: SolverInterface | None = None
    preprocessing_solver: SolverInterface | None = None
    solver_options: SolverOptions = SolverOptions()
    restriction_solver_options: SolverOptions | None = None
    preprocessing_solver_options: SolverOptions | None = None
    parallelism: Parallelism = Parallelism.Max()


class GcsGraphvizOptions(Options):
    """What pictures of a graph show of a solution.

    Attributes:
        show_slacks: Values of slack variables.
        show_vars: Points of vertices.
        show_flows: Flows of edges, which also become their opacity.
        show_costs: Costs.
        scientific: Numbers in scientific notation.
        precision: Digits.
    """

    show_slacks: bool = True
    show_vars: bool = True
    show_flows: bool = True
    show_costs: bool = True
    scientific: bool = False
    precision: int = 3


# ---- paths, read off a solution or sampled from one with divided flows


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
    usable: dict[int, list[_Choice]] = {}
    trials = 0
    while len(paths) < wanted and trials < options.max_rounding_trials:
        trials += 1
        path = _sample(generator, source, target, flows, options.flow_tolerance, usable)
        if path is None:
            break
        key = tuple(id(e) for e in path)
        if key not in known:
            known.add(key)
            paths.append(path)
    return paths, trials - len(paths)


_Choice = tuple["Edge", float, int]  # an edge, its flow and the vertex where it ends


def _sample(
    generator: RandomGenerator,
    source: Vertex,
    target: Vertex,
    flows: dict[int, float],
    least: float,
    usable: dict[int, list[_Choice]],
) -> list[Edge] | None:
    """A path; `usable` is filled with the edges out of vertices whose flow is more than the least."""
    path: list[Edge] = []
    seen, vertex = {id(source)}, source
    while vertex is not target:
        choices = usable.get(id(vertex))
        if choices is None:
            found = [(e, flows.get(id(e), 0.0), id(e._v)) for e in vertex._out]
            choices = usable[id(vertex)] = [choice for choice in found if choice[1] > least]
        candidates = [choice for choice in choices if choice[2] not in seen]
        if not candidates:
            if not path:
                return None
            vertex = path.pop()._u
            continue
        left = generator._uniform() * sum([flow for _, flow, _ in candidates])
        for choice in candidates:
            if left < choice[1]:
                break
            left -= choice[1]
        path.append(choice[0])
        vertex = choice[0]._v
        seen.add(id(vertex))
    return path


def usable_edges(source: Vertex, target: Vertex, edges: list[Edge]) -> list[Edge]:
    """The edges that a path without repeated vertices may take, as far as `usable` tells, and those it has to take."""
    open_edges = [e for e in edges if e._fixed is not False]
    found = usable(id(source), id(target), [(id(e._u), id(e._v)) for e in open_edges])
    return [e for e, may in zip(open_edges, found) if may or e._fixed]


# ---- pictures in the language of Graphviz


def graphviz(
    vertices: list[Vertex],
    edges: list[Edge],
    result: MathematicalProgramResult | None,
    options: GcsGraphvizOptions,
    active_path: list[Edge],
) -> str:
    """The graph; with values of a solution, and a path as dashed edges."""

    def number(value: float | None) -> str:
        return f"{value:.{options.precision}g}" if options.scientific else f"{value:.{options.precision}f}"

    def numbers(values: np.ndarray) -> str:
        texts = [number(v) for v in values]
        width = max((len(t) for t in texts), default=0)
        return "[" + " ".join(t.rjust(width) for t in texts) + "]"

    def node(v: Vertex) -> str:
        lines = [v.name()]
        if result is not None and options.show_vars and (x := v.GetSolution(result)) is not None:
            lines.append(f"x = {numbers(x)}")
        if result is not None and options.show_costs:
            lines.append(f"cost = {number(v.GetSolutionCost(result))}")
        text = "\n".join(lines)
        return f'v{v.id().get_value()} [label="{text}"]\n'

    def arrow(e: Edge) -> str:
        lines, color = [e.name()], ""
        if result is not None and options.show_costs:
            lines.append(f"cost = {number(e.GetSolutionCost(result))}")
        if result is not None and options.show_slacks:
            y, z = e.GetSolutionPhiXu(result), e.GetSolutionPhiXv(result)
            products = (("xu", y), ("xv", z))
            lines.append(",\n".join(f"ϕ{name} = {numbers(v)}" for name, v in products if v is not None))
        if result is not None and options.show_flows:
            flow = result.GetSolution(e.phi())
            lines.append(f"ϕ = {number(flow)}")
            # What takes no part is still to be seen.
            color = f', color="#000000{int(np.floor(min(max(flow, 0.0), 1.0) * 223.0 + 32.0)):02X}"'
        text = "\n".join(lines)
        return f'v{e.u().id().get_value()} -> v{e.v().id().get_value()} [label="{text}"{color}];\n'

    def dashes(e: Edge) -> str:
        ends = f"v{e.u().id().get_value()} -> v{e.v().id().get_value()}"
        return f'{ends} [label="{e.name()} = active", color="#ff0000", style="dashed"];\n'

    parts = [*map(node, vertices), *map(arrow, edges), *map(dashes, active_path)]
    return "digraph GraphOfConvexSets {\nlabelloc=t;\n" + "".join(parts) + "}\n"


# ---- the graph


_log = logging.getLogger("drake")


@checked
class GraphOfConvexSets:
    """A directed graph: each vertex has a point in its convex set, costs and constraints are on vertices and edges."""

    VertexId: TypeAlias = elements.VertexId
    EdgeId: TypeAlias = elements.EdgeId
    Transcription: TypeAlias = elements.Transcription
    Vertex: TypeAlias = elements.Vertex
    Edge: TypeAlias = elements.Edge

    def __init__(self) -> None:
        self._vertices: list[Vertex] = []
        self._edges: list[Edge] = []

    # The graph

    def num_vertices(self) -> int:
        """Returns the number of vertices."""
        return len(self._vertices)

    def num_edges(self) -> int:
        """Returns the number of edges."""
        return len(self._edges)

    def Vertices(self) -> list[Vertex]:
        """Returns the vertices in the order in which they were added."""
        return list(self._vertices)

    def Edges(self) -> list[Edge]:
        """Returns the edges in the order in which they were added."""
        return list(self._edges)

    def AddVertex(self, set: ConvexSet, name: str = "") -> Vertex:
        """Adds a vertex with a copy of a set and returns it."""
        vertex = Vertex._make(set, name or f"v{len(self._vertices)}")
        self._vertices.append(vertex)
        return vertex

    def AddVertexFromTemplate(self, template_vertex: Vertex) -> Vertex:
        """Adds a vertex like another one, with its name, costs and constraints, and returns it."""
        vertex = self.AddVertex(template_vertex._set, template_vertex.name())
        vertex._take(template_vertex)
        return vertex

    def AddEdge(self, u: Vertex, v: Vertex, name: str = "") -> Edge:
        """Adds an edge from u to v and returns it.

        Raises:
            RuntimeError: a vertex is not of this graph.
        """
        self._require("AddEdge", u, v)
        edge = Edge._make(u, v, name or f"e{len(self._edges)}")
        u._out.append(edge)
        v._in.append(edge)
        self._edges.append(edge)
        return edge

    def AddEdgeFromTemplate(self, u: Vertex, v: Vertex, template_edge: Edge) -> Edge:
        """Adds an edge from u to v like another one, with its name, costs and constraints, and returns it.

        Raises:
            RuntimeError: a vertex is not of this graph, or has another dimension than that of the template.
        """
        pairs = ((u, template_edge._u), (v, template_edge._v))
        if any(a.ambient_dimension() != b.ambient_dimension() for a, b in pairs):
            raise RuntimeError("AddEdgeFromTemplate(): the vertices have other dimensions than those of the template.")
        edge = self.AddEdge(u, v, template_edge.name())
        edge._take(template_edge)
        edge._fixed = template_edge._fixed
        return edge

    def GetVertexByName(self, name: str) -> Vertex | None:
        """Returns the first vertex of a name, or None."""
        return next((v for v in self._vertices if v.name() == name), None)

    GetMutableVertexByName = GetVertexByName

    def GetEdgeByName(self, name: str) -> Edge | None:
        """Returns the first edge of a name, or None."""
        return next((e for e in self._edges if e.name() == name), None)

    GetMutableEdgeByName = GetEdgeByName

    def IsValid(self, v: Vertex | Edge | None = None, *, e: Edge | None = None) -> bool:
        """Tells whether a vertex or an edge is of this graph."""
        item = e if v is None else v
        return any(item is own for own in (self._edges if isinstance(item, Edge) else self._vertices))

    def _require(self, call: str, *items: Vertex | Edge) -> None:
        for item in items:
            if not self.IsValid(item):
                kind = type(item).__name__.lower()
                raise RuntimeError(f"{call}(): {kind} {item.name()} is not in this graph.")

    def RemoveVertex(self, vertex: Vertex) -> None:
        """Takes out a vertex and its edges.

        Raises:
            RuntimeError: it is not of this graph.
        """
        self._require("RemoveVertex", vertex)
        for edge in {id(e): e for e in (*vertex._in, *vertex._out)}.values():
            self.RemoveEdge(edge)
        self._vertices = [v for v in self._vertices if v is not vertex]

    def RemoveEdge(self, edge: Edge) -> None:
        """Takes out an edge.

        Raises:
            RuntimeError: it is not of this graph.
        """
        self._require("RemoveEdge", edge)
        edge._u._out = [e for e in edge._u._out if e is not edge]
        edge._v._in = [e for e in edge._v._in if e is not edge]
        self._edges = [e for e in self._edges if e is not edge]

    def ClearAllPhiConstraints(self) -> None:
        """Leaves open of all edges whether they are taken."""
        for edge in self._edges:
            edge.ClearPhiConstraints()

    def Clone(self) -> GraphOfConvexSets:
        """Returns a graph with copies of all vertices and edges."""
        out = GraphOfConvexSets()
        new = {id(v): out.AddVertexFromTemplate(v) for v in self._vertices}
        for e in self._edges:
            out.AddEdgeFromTemplate(new[id(e._u)], new[id(e._v)], e)
        return out

    def GetGraphvizString(
        self,
        result: MathematicalProgramResult | None = None,
        options: GcsGraphvizOptions | None = None,
        active_path: list[Edge] = [],  # noqa: B006  (pydrake's default; never changed)
        *args: Any,
        **kwargs: Any,
    ) -> str:
        """Returns the graph in the language of Graphviz, with values of a solution if there is one.

        Args:
            result: A solution, or None.
            options: What to show; or, here and in the places after it or by name, its fields one by one.
            active_path: Edges to show dashed.
        """
        if isinstance(options, bool):
            given = (options, *(() if isinstance(active_path, list) else (active_path,)), *args)
            kwargs.update(zip(GcsGraphvizOptions._defaults, given))
            options, active_path = None, []
        if options is None:
            options = GcsGraphvizOptions(**kwargs)
        return graphviz(self._vertices, self._edges, result, options, list(active_path))

    # Shortest paths

    def SolveShortestPath(
        self, source: Vertex, target: Vertex, options: GraphOfConvexSetsOptions | None = None
    ) -> MathematicalProgramResult:
        """Returns a solution with a path from source to target, and points, of least cost.

        With `convex_relaxation` flows may be divided among paths; with `max_rounded_paths` then paths are sampled from
        these flows, and the best of them is the solution. Without, small graphs are solved by branch and bound where
        no solver takes programs with whole numbers.

        Raises:
            RuntimeError: a vertex is not of this graph; a cost or constraint has no perspective or may be negative.
        """
        options = GraphOfConvexSetsOptions() if options is None else options
        self._require("SolveShortestPath", source, target)
        edges = self._edges
        if options.preprocessing and source is not target:
            edges = usable_edges(source, target, edges)
        program = ShortestPathProgram(source, target, edges, bool(options.convex_relaxation))
        if source is not target and not (program._out[id(source)] and program._in[id(target)]):
            return self._none(source, target, program)
        result = _solve(program.prog, options.solver, options.solver_options)
        if result.get_x_val().size == program.prog.num_vars():
            found = program.values(result.get_x_val())
            idle = {e._phi: 0.0 for e in self._edges if e._phi not in found}
            result = _with_values(result, {**found, **idle})
        if result.is_success() and options.convex_relaxation and (options.max_rounded_paths or 0) > 0:
            return self._rounded(source, target, result, options)
        return result

    def _none(self, source: Vertex, target: Vertex, program: ShortestPathProgram) -> MathematicalProgramResult:
        if not program._in[id(target)]:
            _log.info("Target vertex %s has no incoming edges.", target.name())
        else:
            _log.info("Source vertex %s has no outgoing edges.", source.name())
        result = MathematicalProgramResult()
        result.set_solution_result(SolutionResult.kInfeasibleConstraints)
        return result

    def _rounded(
        self, source: Vertex, target: Vertex, relaxed: MathematicalProgramResult, options: GraphOfConvexSetsOptions
    ) -> MathematicalProgramResult:
        paths, again = sample_paths(source, target, self._flows(relaxed), options)
        _log.info("Found %d unique paths, discarded %d duplicate paths.", len(paths), again)
        known: Known = {}
        found = [self._restricted(path, options, relaxed, known) for path in paths]
        good = [r for r in found if r.is_success()]
        if good:
            return min(good, key=lambda r: r.get_optimal_cost())
        relaxed.set_solution_result(SolutionResult.kIterationLimit)
        return relaxed

    def _flows(self, result: MathematicalProgramResult) -> dict[int, float]:
        return {id(e): result.GetSolution(e._phi) for e in self._edges if e._phi.get_id() in result._places}

    def SolveConvexRestriction(
        self,
        active_edges: list[Edge],
        options: GraphOfConvexSetsOptions | None = None,
        initial_guess: MathematicalProgramResult | None = None,
    ) -> MathematicalProgramResult:
        """Returns a solution with the points of least cost for edges that are taken; all others are not.

        Args:
            active_edges: The edges.
            options: Solvers and their options.
            initial_guess: A solution with values of the points.

        Raises:
            RuntimeError: an edge is not of this graph.
        """
        options = GraphOfConvexSetsOptions() if options is None else options
        self._require("SolveConvexRestriction", *active_edges)
        return self._restricted(active_edges, options, initial_guess, {})

    def _restricted(
        self,
        active_edges: list[Edge],
        options: GraphOfConvexSetsOptions,
        initial_guess: MathematicalProgramResult | None,
        known: Known,
    ) -> MathematicalProgramResult:
        """The same for edges of this graph; what paths share is written once for those with the same `known`."""
        prog = restriction(active_edges, known)
        if initial_guess is not None:
            guessed = [v for v in prog.decision_variables().tolist() if v.get_id() in initial_guess._places]
            prog.SetInitialGuess(guessed, np.nan_to_num(initial_guess.GetSolution(guessed)))
        solver_options = options.restriction_solver_options or options.solver_options
        result = _solve(prog, options.restriction_solver or options.solver, solver_options)
        values = dict(zip(prog.decision_variables(), result.get_x_val()))
        active = {id(e) for e in active_edges}
        taking_part = [*active_edges, *{id(v): v for e in active_edges for v in (e._u, e._v)}.values()]
        for element in taking_part:
            for cost, ell, _ in element._costs:
                point = np.array([values[v] for v in cost._variables])
                values[ell] = float(cost.evaluator().Eval(point)[0])
        for e in self._edges:
            values[e._phi] = 1.0 if id(e) in active else 0.0
        return _with_values(result, values)

    def GetSolutionPath(
        self, source: Vertex, target: Vertex, result: MathematicalProgramResult, tolerance: float = 1e-3
    ) -> list[Edge]:
        """Returns the edges of the path in a solution, following the largest flows.

        Args:
            source: Where it starts.
            target: Where it ends.
            result: The solution.
            tolerance: How far flows may be from one.

        Raises:
            RuntimeError: the solution is none, there is no such path, or a vertex is not of this graph.
        """
        if not result.is_success():
            raise RuntimeError("Cannot extract a solution path when result.is_success() is false.")
        self._require("GetSolutionPath", source, target)
        path = follow(source, target, self._flows(result), tolerance)
        if path is None:
            raise RuntimeError(
                f"No path found from {source.name()} to {target.name()}: no edges have flows within {tolerance} of one."
            )
        return path

    def SamplePaths(
        self,
        source: Vertex,
        target: Vertex,
        flows: Any = None,
        options: Any = None,
        *,
        result: MathematicalProgramResult | None = None,
    ) -> list[list[Edge]]:
        """Returns different paths, sampled with flows as probabilities.

        Args:
            source: Where they start.
            target: Where they end.
            flows: Flow of each edge, a dict; or a solution.
            options: How many, from which seed (GraphOfConvexSetsOptions).
            result: The solution, by name.

        Raises:
            RuntimeError: less than one path is asked for.
        """
        flows = result if flows is None else flows
        if isinstance(flows, MathematicalProgramResult):
            given = self._flows(flows)
        else:
            given = {id(e): float(flow) for e, flow in flows.items()}
        return sample_paths(source, target, given, options)[0]


def _solve(
    prog: MathematicalProgram, solver: SolverInterface | None, solver_options: SolverOptions
) -> MathematicalProgramResult:
    if solver is not None:
        return SolverInterface.Solve(solver, prog, None, solver_options)
    try:
        best = ChooseBestSolver(prog)
    except ValueError:
        if GetProgramType(prog) not in (ProgramType.kMISOCP, ProgramType.kMIQP, ProgramType.kMISDP):
            raise
        return _branch_and_bound(prog)
    return MakeSolver(best).Solve(prog, None, solver_options)


def _branch_and_bound(prog: MathematicalProgram) -> MathematicalProgramResult:
    """Solves a small program with binary variables by solving relaxations."""
    tree = MixedIntegerBranchAndBound(prog, ClarabelSolver.id())
    outcome = tree.Solve()
    result = MathematicalProgramResult()
    result._start(prog, ClarabelSolver._name)
    if outcome is SolutionResult.kSolutionFound:
        result._finish(outcome, tree.GetSolution(prog.decision_variables()), tree.GetOptimalCost())
    else:
        result._finish(outcome, None, np.inf)
    return result


def _with_values(result: MathematicalProgramResult, values: dict[Any, float]) -> MathematicalProgramResult:
    """The outcome of a solve with other variables' values."""
    out = MathematicalProgramResult()
    out._result, out._cost, out._solver, out._details = result._result, result._cost, result._solver, result._details
    out._variables = list(values)
    out._places = {v.get_id(): i for i, v in enumerate(values)}
    out._x = np.array(list(values.values()), dtype=float)
    return out
