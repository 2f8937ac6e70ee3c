"""Arrays of a contact solver, made once: the constants of a plant and the work of a context."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.common._kernels.vec import SIX
from sheldrake.multibody.contact_solvers._kernels import problem as records
from sheldrake.multibody.contact_solvers._kernels.problem import Contacts, Factor, Problem, Rows, SolverModel
from sheldrake.multibody.contact_solvers._kernels.solve import APPROXIMATIONS

DRAKE_TOLERANCE = 1e-6
"""Residual that Drake accepts, relative to momentum and impulse. A body at rest may creep at 1e-6 g dt."""

REST_TOLERANCE = 1e-9
"""Our residual: a body with several contact points comes to rest instead of creeping."""

DRAKE_ITERATIONS = 100
"""After which Drake gives up."""

MAX_ITERATIONS = 500
"""Ours: heaps with mass ratios of a thousand need more than 100 where they hit the ground; the problem is convex, so
that iterations do arrive."""

RESOLVED_TURN = 0.2
"""Angle of a step up to which a body that spins has all of its gyroscopic torque, where steps go on to rest [rad]."""

MAX_FACTOR, MAX_FACTOR_OF_DOF = 4_000_000, 250
"""Numbers in the largest factor a workspace makes room for (32 MB), or for each dof if that is more."""

MAX_BLOCKS, MAX_BLOCKS_OF_TREE = 200_000, 40
"""Blocks below the diagonal of the largest factor, or for each tree if that is more."""

FEW_CONTACTS = 4
"""As many contacts with one tree may have their impulses as unknowns, if these are fewer than its velocities."""


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
    moving_tolerance: float = 0.0,
    to_rest: bool = False,
    ahead: bool = False,
) -> SolverModel:
    """The constants of a solver.

    Args:
        tree: first dof and number of dofs of each kinematic tree, shape (num_trees, 2).
        dof: for each dof the next dof towards the base or -1, its number of ancestors and the start of its row in the
            packed momentum matrix, shape (nv, 3).
        dt: time step [s].
        approximation: one of `APPROXIMATIONS`.
        stiction_tolerance: slip speed below which friction counts as stiction [m/s].
        near_rigid_threshold: beta of kSap's contacts.
        relative_tolerance: residual at which iterations stop, relative to momentum and impulse.
        moving_tolerance: the same of one tree with joints that moves, relative to its momentum alone.
        to_rest: solved until what can rest does, instead of as Drake iterates.
        ahead: what rows of one dof do linearly is in v*; so it always is where things come to rest.

    Raises:
        ValueError: if the approximation has no such name.
    """
    if approximation not in APPROXIMATIONS:
        raise ValueError(
            f"make_solver_model(): contact approximation {approximation!r} is not one of {', '.join(APPROXIMATIONS)}."
        )
    option, setting = np.zeros(records.Options.SIZE), np.zeros(records.Settings.SIZE, np.int64)
    dofs = np.ascontiguousarray(dof, np.int64).reshape(-1, records.Dof.SIZE)
    trees = np.array([(f, n, base_dofs(dofs, f, n)) for f, n in tree], np.int64).reshape(-1, records.Tree.SIZE)
    model = SolverModel(option, setting, trees, dofs)
    model.dt = dt
    model.stiction = stiction_tolerance
    model.sigma = 1e-3
    model.near_rigid = near_rigid_threshold
    model.near_rigid_rows = 0.1
    model.relative_tolerance = relative_tolerance
    model.absolute_tolerance = 1e-14
    model.moving_tolerance = moving_tolerance
    model.resolved_turn = RESOLVED_TURN if to_rest else np.inf
    model.max_iterations = MAX_ITERATIONS if to_rest else DRAKE_ITERATIONS
    model.law = APPROXIMATIONS[approximation].law
    model.scalar_rows = APPROXIMATIONS[approximation].scalar_rows
    model.ahead = (to_rest or ahead) and APPROXIMATIONS[approximation].scalar_rows
    model.sides = 1 if APPROXIMATIONS[approximation].symmetric else 2
    return model


def base_dofs(dofs: np.ndarray, first: int, count: int) -> int:
    """6 if all dofs of a tree but its first six hang on these, so that all other rows begin with their columns."""
    chain = count >= SIX and dofs[first + SIX - 1, records.Dof.depth] == SIX - 1
    return SIX if chain and (dofs[first + SIX : first + count, records.Dof.parent] >= first + SIX - 1).all() else 0


def widest(model: SolverModel) -> tuple[int, int]:
    """Most dofs that can move two bodies against each other, and most that can move either, of two trees or of one."""
    longest = sorted(int(model.dof[f : f + n, records.Dof.depth].max()) + 1 for f, n, _ in model.tree if n > 0)
    against = either = max(sum(longest[-2:]), 1)
    height = np.zeros(len(model.dof), np.int64)  # dofs of the longest way from a dof outwards, without itself
    for k in range(len(model.dof) - 1, -1, -1):
        parent, depth = model.dofs[k].parent, model.dofs[k].depth
        if parent >= 0:
            both = int(height[parent] + height[k]) + 1
            against, either = max(against, both), max(either, both + depth)
            height[parent] = max(height[parent], height[k] + 1)
    return against, either


def make_solver_work(
    model: SolverModel,
    contacts: int,
    rows: int,
    dtype: type = float,
    least_width: int = 1,
    rows_of_bodies: bool = True,
) -> SolverWork:
    """Room for a number of contacts and scalar rows.

    Args:
        model: the solver's constants.
        contacts: capacity for contacts.
        rows: capacity for scalar rows.
        dtype: float, or object for duals and symbols.
        least_width: room for so many dofs in a constraint, if those that bodies may have are fewer.
        rows_of_bodies: rows may be between bodies; else they are of `least_width` dofs.
    """
    nv, num_trees = len(model.dof), len(model.tree)
    against, either = widest(model)
    width, row_width = max(against, least_width), max(either if rows_of_bodies else 1, least_width)
    packed = int(np.sum(model.dof[:, records.Dof.depth] + 1))

    def numbers(*shape: int) -> np.ndarray:
        return np.zeros(shape) if dtype is float else np.full(shape, 0.0, dtype=dtype)

    def integers(*shape: int) -> np.ndarray:
        return np.zeros(shape, np.int64)

    sizes = model.tree[:, records.Tree.num_dofs]
    full = nv * nv if model.sides == 2 else (nv * nv + int(np.sum(sizes**2))) // 2
    size = min(full, max(MAX_FACTOR, MAX_FACTOR_OF_DOF * nv)) if contacts + rows else 0
    few = min(contacts, FEW_CONTACTS)
    pairs, most = num_trees * (num_trees - 1) // 2, max(MAX_BLOCKS, MAX_BLOCKS_OF_TREE * num_trees)
    blocks = min(pairs, most) if contacts + rows else 0
    return SolverWork(
        Problem(
            numbers(packed),
            numbers(packed),
            numbers(records.DofVectors.SIZE, nv),
            integers(num_trees, records.Participation.SIZE),
            integers(records.Counts.SIZE),
        ),
        Contacts(
            integers(contacts, records.ContactIndex.SIZE + width),
            numbers(3 * contacts, width),
            numbers(contacts, records.ContactLaw.SIZE),
            numbers(contacts, records.ContactState.SIZE),
        ),
        Rows(
            integers(rows, records.RowIndex.SIZE + row_width),
            numbers(rows, row_width),
            numbers(rows, records.RowLaw.SIZE),
            numbers(rows, records.RowState.SIZE),
        ),
        Factor(
            integers(max(nv, num_trees)),
            integers(num_trees),
            integers(num_trees, records.Block.SIZE),
            integers(num_trees, records.Node.SIZE),
            integers(blocks, records.Entry.SIZE),
            integers(2 * (contacts + rows)),
            numbers(size),
            numbers(nv),
            integers(nv, records.Path.SIZE),
            numbers(3 * few, nv),
            numbers(9 * few * (few + 1) // 2),
            numbers(6 * few),
            numbers(9 * few * (few + 1) // 2),
            numbers(records.Presses.SIZE, 3 * few),
        ),
    )
