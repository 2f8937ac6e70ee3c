"""Quadratic programs that are so small that dense steps take less time than the way to another solver."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from sheldrake.common._bound_calls import BoundCalls, room
from sheldrake.common.kernel import Bound
from sheldrake.solvers import _arrays
from sheldrake.solvers._engines.clarabel import ClarabelSolver, ClarabelSolverDetails
from sheldrake.solvers._functions.bindings import BindingBase
from sheldrake.solvers._functions.constraints import (
    BoundingBoxConstraint,
    LinearConstraint,
    LinearEqualityConstraint,
)
from sheldrake.solvers._functions.costs import LinearCost, QuadraticCost
from sheldrake.solvers._ids import SolutionResult, SolverOptions
from sheldrake.solvers._kernels.active_set import Quadratic, make_quadratic
from sheldrake.solvers._kernels.small_quadratic import Given, make_given, solve_small_quadratic
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.solvers._result import MathematicalProgramResult

_VARIABLES, _ROWS = 48, 96  # up to which dense steps take less time
_NUMBERS = 4096


class Solution:
    """Where a program is least.

    Attributes:
        x: The decision variables.
        cost: The cost there.
        held: How many rows hold with equality.
    """

    def __init__(self, x: np.ndarray, cost: float, held: int, dual: np.ndarray, rows: list[BindingBase]) -> None:
        self.x, self.cost, self.held, self._dual, self._rows = x, cost, held, dual, rows

    def duals(self) -> Iterator[tuple[BindingBase, np.ndarray]]:
        """What the cost gains for each row of the linear constraints whose bound grows by one."""
        begin = 0
        for b in self._rows:
            end = begin + b._evaluator._num_outputs
            yield b, self._dual[begin:end]
            begin = end


def solve_small(prog: MathematicalProgram) -> Solution | None:
    """Solves a program of quadratic and linear costs and linear constraints, up to rounding.

    None where it is large, or there is no proof that a solution and its duals are the only ones: where there is none,
    the cost is flat along a way, or rows that hold with equality depend on each other.
    """
    bindings, variables = parts_of(prog).bindings, parts_of(prog).variables
    n = variables.num_vars()
    costs, linear = bindings.of(QuadraticCost), bindings.of(LinearCost)
    rows: list[Any] = [
        *bindings.of(LinearConstraint), *bindings.of(LinearEqualityConstraint), *bindings.of(BoundingBoxConstraint)
    ]  # fmt: skip
    if not costs or n > _VARIABLES:
        return None
    of_costs, of_linear = [b._evaluator for b in costs], [b._evaluator for b in linear]
    numbers, orders = QuadraticCost.matrices(of_costs)
    slopes = QuadraticCost.slopes(of_costs)
    slopes += [e._a for e in of_linear]
    heights: list[int] = []
    widths: list[int] = []
    lower: list[np.ndarray | list[float]] = []
    upper: list[np.ndarray | list[float]] = []
    for b in rows:
        e = b._evaluator
        heights.append(e._num_outputs)
        row = e._row
        if row is not None:
            a, low, high = row
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
            return None
        lower.append(e._lower)
        upper.append(e._upper)
    m = sum(heights)
    entries, at = _arrays.joined_numbers(numbers), bindings.places(*costs, *linear, *rows)
    if m > _ROWS or max(len(entries), len(at)) > _NUMBERS:
        return None
    call, given, program = _calls.of(n, room(m), room(len(entries)), room(max(len(at), len(rows))))
    terms = _arrays.joined_numbers(slopes)
    given.orders[: len(orders)], given.numbers[: len(entries)], given.at[: len(at)] = orders, entries, at
    given.slopes[: len(terms)] = terms
    if rows:
        given.heights[: len(rows)], given.widths[: len(rows)] = heights, widths
        given.lower[:m], given.upper[:m] = _arrays.joined_numbers(lower), _arrays.joined_numbers(upper)
    call.set("costs", len(costs))
    call.set("slopes", len(terms))
    call.set("blocks", len(rows))
    call.set("rows", m)
    call.set("place", len(terms))
    held = call()
    if held < 0:
        return None
    constant = sum([e._c for e in of_costs]) + sum([e._b for e in of_linear])
    return Solution(program.x.copy(), given.cost.item() + constant, held, given.dual[:m].copy(), rows)


def _bound(n: int, rows: int, numbers: int, places: int) -> tuple[Bound, Given, Quadratic]:
    given, program = make_given(rows, numbers, places), make_quadratic(2 * rows, n)
    return solve_small_quadratic.bind(given, program, 0, 0, 0, 0, 0), given, program


_calls = BoundCalls(_bound)


class SmallQuadraticSolver(ClarabelSolver):
    """Solves small quadratic programs by rows that hold with equality, and what of them is in doubt by Clarabel.

    Where options are given these are for Clarabel.
    """

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        begin = time.perf_counter()
        found = None if options.options else solve_small(prog)
        if found is None:
            super()._do_solve(prog, guess, options, result)
            return
        result._solver = "Active set"
        result._details = ClarabelSolverDetails(time.perf_counter() - begin, found.held, "Solved")
        result._finish(SolutionResult.kSolutionFound, found.x, found.cost)
        result._set_duals_late(found.duals)
