"""Quadratic programs that are so small that dense steps take less time than the way to another solver."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sheldrake.common._bound_calls import BoundCalls, room
from sheldrake.common.kernel import Bound
from sheldrake.solvers import _arrays
from sheldrake.solvers._engines.clarabel import ClarabelSolverDetails
from sheldrake.solvers._engines.interface import Engine
from sheldrake.solvers._functions.bindings import BindingBase
from sheldrake.solvers._functions.constraints import BoundingBoxConstraint, LinearConstraint
from sheldrake.solvers._functions.costs import QuadraticCost
from sheldrake.solvers._ids import ProgramAttribute as A
from sheldrake.solvers._ids import SolutionResult, SolverOptions
from sheldrake.solvers._kernels.active_set import Quadratic, make_quadratic
from sheldrake.solvers._kernels.small_quadratic import Given, make_given, solve_small_quadratic
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.solvers._result import MathematicalProgramResult

_VARIABLES, _ROWS, _NUMBERS = 48, 96, 4096  # up to which dense steps take less time
_EQUATIONS = frozenset({A.kQuadraticCost, A.kLinearCost, A.kLinearEqualityConstraint})


class Solution(NamedTuple):
    """Where a program is least.

    Attributes:
        x: The decision variables.
        cost: The cost there.
        held: How many rows hold with equality.
        dual: What the cost gains for each row whose bound grows by one.
        rows: The constraints that these rows are of.
    """

    x: np.ndarray
    cost: float
    held: int
    dual: np.ndarray
    rows: list[BindingBase[LinearConstraint]]

    def duals(self) -> Iterator[tuple[BindingBase, np.ndarray]]:
        """Each constraint and its part of `dual`."""
        begin = 0
        for b in self.rows:
            end = begin + b._evaluator._num_outputs
            yield b, self.dual[begin:end]
            begin = end


def solve_small(prog: MathematicalProgram) -> Solution | None:
    """Solves a program of quadratic and linear costs and linear constraints, up to rounding.

    None where it is large, or there is no proof that a solution and its duals are the only ones: where there is none,
    the cost is flat along a way, or rows that hold with equality depend on each other.
    """
    parts = parts_of(prog)
    n = parts.variables.num_vars()
    if not 0 < n <= _VARIABLES:
        return None
    costs, linear, rows, at = parts.bindings.flat()
    of_costs, of_linear = [b._evaluator for b in costs], [b._evaluator for b in linear]
    numbers, orders = QuadraticCost.matrices(of_costs)
    doubts = [e._is_convex is None for e in of_costs]
    slopes = QuadraticCost.slopes(of_costs)
    slopes += [e._a for e in of_linear]
    terms, (blocks, heights, widths, lower, upper) = _arrays.joined_numbers(slopes), _rows(rows)
    entries, m = _arrays.joined_numbers(numbers + blocks), sum(heights)
    if m > _ROWS or max(len(entries), len(at)) > _NUMBERS or -2 in widths:
        return None
    call, given, program = _calls.of(n, room(m), room(len(entries)), room(len(at)))
    given.numbers[: len(entries)], given.at[: len(at)], given.slopes[: len(terms)] = entries, at, terms
    given.orders[: len(orders)], given.doubts[: len(orders)] = orders, doubts
    if rows:
        given.heights[: len(rows)], given.widths[: len(rows)] = heights, widths
        given.lower[:m], given.upper[:m] = lower, upper
    for name, size in ("costs", len(costs)), ("slopes", len(terms)), ("blocks", len(rows)), ("rows", m):
        call.set(name, size)
    held = call()
    if held < 0:
        return None
    constant = sum([e._c for e in of_costs]) + sum([e._b for e in of_linear])
    for e in of_costs:
        e._is_convex = True
    return Solution(program.x.copy(), given.cost.item() + constant, held, given.dual[:m].copy(), rows)


def _rows(
    rows: list[BindingBase[LinearConstraint]],
) -> tuple[list[np.ndarray | list[float]], list[int], list[int], list[float], list[float]]:
    """Matrices that are no identities; how many rows and columns all have, -1 for identities and -2 for sparse ones.

    Then lower and upper bounds.
    """
    blocks: list[np.ndarray | list[float]] = []
    heights: list[int] = []
    widths: list[int] = []
    lower: list[float] = []
    upper: list[float] = []
    for b in rows:
        e = b._evaluator
        heights.append(e._num_outputs)
        if e._row is not None:
            a, low, high = e._row
            blocks.append(a)
            widths.append(len(a))
            lower.append(low)
            upper.append(high)
            continue
        if isinstance(e, BoundingBoxConstraint):
            widths.append(-1)
        elif e._A.__class__ is np.ndarray:
            blocks.append(e._A)
            widths.append(e._num_vars)
        else:
            widths.append(-2)
        lower += e._lower.tolist()
        upper += e._upper.tolist()
    return blocks, heights, widths, lower, upper


def _bound(n: int, rows: int, numbers: int, places: int) -> tuple[Bound, Given, Quadratic]:
    given, program = make_given(rows, numbers, places), make_quadratic(2 * rows, n)
    return solve_small_quadratic.bind(given, program, 0, 0, 0, 0), given, program


_calls = BoundCalls(_bound)


class ActiveSetSolver(Engine):
    """Solves small quadratic programs for `Solve`; leaves the result as it was begun where it cannot prove one.

    Details are those of Clarabel, who solves what is left, the iterations being the rows that hold with equality.
    """

    _name = "Active set"
    _attributes = _EQUATIONS | {A.kLinearConstraint}

    @classmethod
    def may_solve(cls, prog: MathematicalProgram) -> bool:
        """Whether a program has what this takes, as far as it is told at once."""
        has = parts_of(prog).bindings.attributes()
        return A.kQuadraticCost in has and has <= cls._attributes

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        begin = time.perf_counter()
        found = None if options.options else solve_small(prog)
        if found is None:
            return
        if parts_of(prog).bindings.attributes() <= _EQUATIONS:
            result._solver = "EqConstrainedQP"
        else:
            result._details = ClarabelSolverDetails(time.perf_counter() - begin, found.held, "Solved")
        result._finish(SolutionResult.kSolutionFound, found.x, found.cost)
        result._set_duals_late(found.duals)
