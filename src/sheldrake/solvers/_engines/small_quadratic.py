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

_VARIABLES, _ROWS, _NUMBERS = 64, 128, 8192  # up to which dense steps take less time
_NEEDED = frozenset({A.kQuadraticCost, A.kLinearConstraint})


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
    numbers, sizes = QuadraticCost.matrices(of_costs)
    sizes += [e._is_convex is None for e in of_costs]
    slopes = QuadraticCost.slopes(of_costs) + [e._a for e in of_linear]
    m, bounds = _add_rows(rows, numbers, sizes)
    if m > _ROWS or len(at) > _NUMBERS:
        return None
    terms = sum(map(len, slopes))
    entries = _arrays.joined_numbers(numbers + slopes + bounds)
    if len(entries) > _NUMBERS:
        return None
    call, given, program = _calls.of(n, room(m), room(len(entries)), room(max(len(at), len(sizes))))
    given.sizes[: len(sizes)], given.at[: len(at)], given.numbers[: len(entries)] = sizes, at, entries
    call.set("costs", len(costs))
    call.set("blocks", len(rows))
    call.set("slopes", terms)
    call.set("slope", len(entries) - terms - 2 * m)
    call.set("rows", m)
    held = call()
    if held < 0:
        return None
    constant = sum([e._c for e in of_costs]) + sum([e._b for e in of_linear])
    for e in of_costs:
        e._is_convex = True
    return Solution(program.x.copy(), given.cost.item() + constant, held, given.dual[:m].copy(), rows)


def _add_rows(
    rows: list[BindingBase[LinearConstraint]], numbers: list[np.ndarray | list[float]], sizes: list[int]
) -> tuple[int, list[np.ndarray | list[float]]]:
    """Adds matrices that are no identities to numbers, rows and columns of all to sizes; how many rows, and bounds.

    Of a sparse matrix there are more rows than are solved here.
    """
    heights: list[int] = []
    widths: list[int] = []
    lower: list[np.ndarray | list[float]] = []
    upper: list[np.ndarray | list[float]] = []
    for b in rows:
        e = b._evaluator
        heights.append(e._num_outputs)
        if e._row is not None:
            a, low, high = e._row
            numbers.append(a)
            widths.append(len(a))
            lower.append([low])
            upper.append([high])
            continue
        if isinstance(e, BoundingBoxConstraint):
            widths.append(-1)
        elif e._A.__class__ is np.ndarray:
            numbers.append(e._A)
            widths.append(e._num_vars)
        else:
            return _ROWS + 1, []
        lower.append(e._lower)
        upper.append(e._upper)
    sizes += heights
    sizes += widths
    return sum(heights), lower + upper


def _bound(n: int, rows: int, numbers: int, places: int) -> tuple[Bound, Given, Quadratic]:
    given, program = make_given(rows, numbers, places), make_quadratic(2 * rows, n)
    return solve_small_quadratic.bind(given, program, 0, 0, 0, 0, 0), given, program


_calls = BoundCalls(_bound)


class ActiveSetSolver(Engine):
    """Solves small quadratic programs for `Solve`; leaves the result as it was begun where it cannot prove one.

    Those whose constraints are equations are left to `EqualityConstrainedQPSolver`, which tries the same steps. Details
    are those of Clarabel, who solves what is left, the iterations being the rows that hold with equality.
    """

    _name = "Active set"
    _attributes = frozenset({A.kQuadraticCost, A.kLinearCost, A.kLinearEqualityConstraint, A.kLinearConstraint})

    @classmethod
    def may_solve(cls, prog: MathematicalProgram) -> bool:
        """Whether a program has what this takes, as far as it is told at once."""
        has = parts_of(prog).bindings.attributes()
        return has >= _NEEDED and has <= cls._attributes

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        begin = time.perf_counter()
        found = None if options.options else solve_small(prog)
        if found is None:
            return
        result._details = ClarabelSolverDetails(time.perf_counter() - begin, found.held, "Solved")
        result._finish(SolutionResult.kSolutionFound, found.x, found.cost)
        result._set_duals_late(found.duals)
