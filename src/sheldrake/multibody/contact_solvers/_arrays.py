"""Arrays of a contact solver, made once: the constants of a plant and the work of a context."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.multibody.contact_solvers._kernels import problem as columns
from sheldrake.multibody.contact_solvers._kernels.elimination import BITS
from sheldrake.multibody.contact_solvers._kernels.problem import Contacts, Factor, Problem, Rows, SolverModel

APPROXIMATIONS = {"lagged": columns.LAGGED, "similar": columns.SIMILAR, "sap": columns.SAP, "tamsi": columns.TAMSI}

DRAKE_TOLERANCE = 1e-6
"""Residual that Drake accepts, relative to momentum and impulse. A body at rest may creep at 1e-6 g dt."""

REST_TOLERANCE = 1e-9
"""Our residual: a body with several contact points comes to rest instead of creeping."""

DRAKE_ITERATIONS = 100
"""After which Drake gives up."""

MAX_ITERATIONS = 500
"""Ours: heaps with mass ratios of a thousand need more than 100 where they hit the ground; the problem is convex, so
that iterations do arrive."""

MAX_FACTOR = 4_000_000
"""Numbers in the largest factor a workspace makes room for (32 MB)."""

MAX_BLOCKS = 200_000
"""Blocks below the diagonal of the largest factor."""


class SolverWork(NamedTuple):
    """What a solve writes; lives in the context."""

    problem: Problem
    contacts: Contacts
    rows: Rows
    factor: Factor


def make_solver_model(
    tree: np.ndarray,
    dof: np.ndarray,
    dt: float,
    approximation: str = "lagged",
    *,
    stiction_tolerance: float = 1e-4,
    near_rigid_threshold: float = 1.0,
    relative_tolerance: float = REST_TOLERANCE,
    polish: int = 0,
    settle: bool = False,
) -> SolverModel:
    """The constants of a solver.

    Args:
        tree: first dof and number of dofs of each kinematic tree, shape (num_trees, 2).
        dof: for each dof the next dof towards the base or -1, its number of ancestors and the start of its row in the
            packed momentum matrix, shape (nv, 3).
        dt: time step [s].
        approximation: "lagged", "similar", "sap" or "tamsi".
        stiction_tolerance: slip speed below which friction counts as stiction [m/s].
        near_rigid_threshold: beta of kSap's contacts.
        relative_tolerance: residual at which iterations stop, relative to momentum and impulse.
        polish: full Newton steps after success; 1 carries the derivatives of duals.
        settle: rest exactly where rest is a solution, and search lines only where the full Newton step does not do;
            False gives Drake's iterates.

    Raises:
        ValueError: if the approximation has no such name.
    """
    if approximation not in APPROXIMATIONS:
        raise ValueError(
            f"make_solver_model(): contact approximation {approximation!r} is not one of {', '.join(APPROXIMATIONS)}."
        )
    option = np.zeros(columns.NUM_OPTIONS)
    option[columns.DT] = dt
    option[columns.STICTION] = stiction_tolerance
    option[columns.SIGMA] = 1e-3
    option[columns.NEAR_RIGID] = near_rigid_threshold
    option[columns.NEAR_RIGID_ROWS] = 0.1
    option[columns.RELATIVE_TOLERANCE] = relative_tolerance
    option[columns.ABSOLUTE_TOLERANCE] = 1e-14
    setting = np.zeros(columns.NUM_SETTINGS, np.int64)
    setting[columns.APPROXIMATION] = APPROXIMATIONS[approximation]
    setting[columns.MAX_ITERATIONS] = MAX_ITERATIONS if settle else DRAKE_ITERATIONS
    setting[columns.POLISH] = polish
    setting[columns.SETTLE] = settle
    return SolverModel(
        option,
        setting,
        np.ascontiguousarray(tree, np.int64).reshape(-1, 2),
        np.ascontiguousarray(dof, np.int64).reshape(-1, 3),
    )


def widest(model: SolverModel) -> int:
    """Most dofs that can move one constraint: the longest paths to the base in two trees."""
    longest = sorted(int(model.dof[f : f + n, columns.DEPTH_OF].max()) + 1 for f, n in model.tree if n > 0)
    if not longest:
        return 1
    # Two bodies of one tree may have disjoint branches, at most all of the tree's dofs.
    return max(sum(longest[-2:]), min(2 * longest[-1], int(model.tree[:, columns.NUM_DOFS].max())))


def make_solver_work(
    model: SolverModel, contacts: int, rows: int, dtype: type = float, least_width: int = 1
) -> SolverWork:
    """Room for a number of contacts and scalar rows.

    Args:
        model: the solver's constants.
        contacts: capacity for contacts.
        rows: capacity for scalar rows.
        dtype: float, or object for duals and symbols.
        least_width: room for so many dofs in a constraint, if those that bodies may have are fewer.
    """
    nv, num_trees, width = len(model.dof), len(model.tree), max(widest(model), least_width)
    packed = int(np.sum(model.dof[:, columns.DEPTH_OF] + 1))

    def numbers(*shape: int) -> np.ndarray:
        return np.zeros(shape) if dtype is float else np.full(shape, 0.0, dtype=dtype)

    def integers(*shape: int) -> np.ndarray:
        return np.zeros(shape, np.int64)

    both_sides = model.setting[columns.APPROXIMATION] == columns.TAMSI
    sizes = model.tree[:, columns.NUM_DOFS]
    size = min(nv * nv if both_sides else (nv * nv + int(np.sum(sizes**2))) // 2, MAX_FACTOR) if contacts + rows else 0
    blocks = min(num_trees * (num_trees - 1) // 2, MAX_BLOCKS) if contacts + rows else 0
    return SolverWork(
        Problem(
            numbers(packed),
            numbers(columns.NUM_VECTORS, nv),
            integers(num_trees, columns.NUM_TREE_COLUMNS),
            integers(columns.NUM_COUNTS),
        ),
        Contacts(
            integers(contacts, int(columns.DOFS) + width),
            numbers(3 * contacts, width),
            numbers(contacts, columns.NUM_LAW),
            numbers(contacts, columns.NUM_STATE),
        ),
        Rows(
            integers(rows, int(columns.ROW_DOFS) + width),
            numbers(rows, width),
            numbers(rows, columns.NUM_ROW_LAW),
            numbers(rows, columns.NUM_ROW_STATE),
        ),
        Factor(
            integers(max(nv, num_trees)),
            integers(num_trees, columns.NUM_BLOCK_COLUMNS),
            integers(blocks, 2),
            integers(num_trees, -(-num_trees // int(BITS))),
            numbers(size),
            numbers(nv),
            integers(nv, 3),
        ),
    )
