"""Options of searches in graphs of convex sets."""

from __future__ import annotations

from typing import Any

from sheldrake.common import Parallelism
from sheldrake.common._options import Options
from sheldrake.solvers import SolverOptions


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

    _fields = (
        ("convex_relaxation", Any, None),
        ("preprocessing", Any, None),
        ("max_rounded_paths", Any, None),
        ("max_rounding_trials", int, 100),
        ("flow_tolerance", float, 1e-5),
        ("rounding_seed", int, 0),
        ("solver", Any, None),
        ("restriction_solver", Any, None),
        ("preprocessing_solver", Any, None),
        ("solver_options", Any, SolverOptions()),
        ("restriction_solver_options", Any, None),
        ("preprocessing_solver_options", Any, None),
        ("parallelism", Any, Parallelism.Max()),
    )


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

    _fields = (
        ("show_slacks", bool, True),
        ("show_vars", bool, True),
        ("show_flows", bool, True),
        ("show_costs", bool, True),
        ("scientific", bool, False),
        ("precision", int, 3),
    )
