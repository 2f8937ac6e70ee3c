"""Small quadratic programs, from the numbers of their costs and constraints to a solution that is proven."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.common.kernel import IntVector, Vector, kernel
from sheldrake.solvers._kernels.active_set import (
    INFEASIBLE,
    Quadratic,
    active_rows,
    along,
    backward,
    combination,
    factor,
    forward,
    is_among,
    product,
    solve_with_rows,
    transform,
)
from sheldrake.solvers._kernels.definite import has_factor
from sheldrake.solvers._kernels.rows import ABOVE, EQUATION, NEVER, bits

_DEFINITE = 1e-9  # what elimination leaves of a diagonal entry at least
_APART = 1e-8  # what is left of an active row's square without the others at least
_OPTIMAL = 1e-10  # what the conditions of optimality may miss, relative to their terms
_TIGHT = 1e-7  # how far from its bound a row may depend on the active ones without a multiplier that is in doubt


class Given(NamedTuple):
    """Costs and constraints as a program has them.

    Attributes:
        sizes: Of the quadratic costs: sizes of their matrices, then which of them may not be convex. Of the
            constraints: rows of their matrices, then columns; -1 for identities, which have no numbers.
        at: Places of the variables: of the quadratic costs, the linear costs, the constraints.
        numbers: Entries of the matrices of costs, then of constraints, row by row; coefficients of linear terms, of the
            quadratic costs, then of the linear ones; lower bounds, then upper ones.
        chosen: Filled with the given row that each new one is made of; that less `rows` for a lower bound.
        dual: Filled with what the cost gains for each row whose bound grows by one.
        first: Scratch: where the variables of each row begin.
        numbered: Scratch: where its entries begin; -1 for a row of an identity.
        counts: Scratch: how many these are.
        cost: Filled with the cost without its constant, shape (1,).
    """

    sizes: IntVector
    at: IntVector
    numbers: Vector
    chosen: IntVector
    dual: Vector
    first: IntVector
    numbered: IntVector
    counts: IntVector
    cost: Vector


def make_given(rows: int, numbers: int, places: int) -> Given:
    """Memory for so many rows, so many numbers, and so many sizes and places of variables, or fewer."""
    first, numbered, counts = np.zeros((3, rows), dtype=np.int64)
    return Given(
        sizes=np.zeros(places, dtype=np.int64), at=np.zeros(places, dtype=np.int64), numbers=np.zeros(numbers),
        chosen=np.zeros(2 * rows, dtype=np.int64), dual=np.zeros(rows), first=first, numbered=numbered, counts=counts,
        cost=np.zeros(1),
    )  # fmt: skip


@kernel
def _take_costs(given, costs, slopes, slope, Q, q):
    """Adds up matrices and linear terms, which begin at `slope`; gives how many numbers the matrices have.

    That is -1 where one may not be convex.
    """
    n = q.shape[0]
    for i in range(n):
        q[i] = 0.0
        for k in range(n):
            Q[i, k] = 0.0
    for k in range(slopes):
        q[given.at[k]] += given.numbers[slope + k]
    first, number = 0, 0
    for c in range(costs):
        order = given.sizes[c]
        for i in range(order):
            row = given.at[first + i]
            for k in range(order):
                Q[row, given.at[first + k]] += given.numbers[number]
                number += 1
        first += order
        if given.sizes[costs + c] and not has_factor(given.numbers, number - order * order, order):
            return INFEASIBLE
    return number


@kernel
def _choose_rows(given, rows, bound, b):
    """Finds which rows there are: equations, upper bounds, then lower ones; how many equations, and all.

    Lower bounds begin at `bound`.
    """
    filled, equal = 0, 0
    for part in range(3):
        bit = 1 << part
        for i in range(rows):
            low, high = given.numbers[bound + i], given.numbers[bound + rows + i]
            says = bits(low, high)
            if says & NEVER:
                return INFEASIBLE, 0
            if says & bit:
                given.chosen[filled] = i - rows if bit == ABOVE else i
                b[filled] = -low if bit == ABOVE else high
                filled += 1
        if bit == EQUATION:
            equal = filled
    return equal, filled


@kernel
def _take_rows(given, size, blocks, number, place, rows, count, A):
    """Fills the rows that were chosen; sizes of their matrices begin at `size`."""
    row = 0
    for k in range(blocks):
        height, width = given.sizes[size + k], given.sizes[size + blocks + k]
        for i in range(height):
            given.first[row] = place + i if width < 0 else place
            given.numbered[row] = -1 if width < 0 else number
            given.counts[row] = 1 if width < 0 else width
            number += max(width, 0)
            row += 1
        place += height if width < 0 else width
    for j in range(count):
        sign, i = (1.0, given.chosen[j]) if given.chosen[j] >= 0 else (-1.0, given.chosen[j] + rows)
        for k in range(A.shape[1]):
            A[j, k] = 0.0
        for k in range(given.counts[i]):
            value = given.numbers[given.numbered[i] + k] if given.numbered[i] >= 0 else 1.0
            A[j, given.at[given.first[i] + k]] += sign * value
    return 0


@kernel
def _largest(M, rows, n):
    """The largest entry."""
    most = 0.0
    for i in range(rows):
        for k in range(n):
            most = max(most, abs(M[i, k]))
    return most


@kernel
def _is_definite(program, equal, weight):
    """Whether Q, and weight times the squares of the equations, are definite beyond doubt; fills H and f with that."""
    Q, A, H, f = program.Q, program.A, program.H, program.f
    n = program.q.shape[0]
    for i in range(n):
        f[i] = program.q[i]
        for k in range(n):
            H[i, k] = Q[i, k]
    if weight > 0.0:
        for j in range(equal):
            for i in range(n):
                if A[j, i] != 0.0:
                    f[i] -= weight * A[j, i] * program.b[j]
                    for k in range(n):
                        H[i, k] += weight * A[j, i] * A[j, k]
    for i in range(n):
        program.center[i] = H[i, i]
    if factor(H, n) != 0:
        return False
    for i in range(n):
        if not H[i, i] ** 2 > _DEFINITE * program.center[i]:
            return False
    return True


@kernel
def _are_apart(program, rows, count):
    """Whether gradients of all rows that hold with equality are independent beyond doubt: multipliers are unique."""
    A, G, M, x, active = program.A, program.G, program.M, program.x, program.active
    n = len(x)
    for a in range(count):
        if not G[a, a] ** 2 > _APART * product(M, active[a], M, active[a], n):
            return False
    held = count
    for j in range(rows):
        beyond, size = -program.b[j], abs(program.b[j])
        for k in range(n):
            beyond += A[j, k] * x[k]
            size += abs(A[j, k] * x[k])
        if beyond >= -_TIGHT * size and is_among(active, held, j) == 0:
            if held == n or combination(M, active, held, G, j, n, program.r) <= _APART * product(M, j, M, j, n):
                return False
            active[held] = j
            held += 1
    return True


@kernel
def _is_proven(program, rows, equal, count):
    """Whether x and multipliers meet the conditions of optimality, relative to the terms of each."""
    Q, q, A, b, x = program.Q, program.q, program.A, program.b, program.x
    multipliers, active = program.multipliers, program.active
    n = len(x)
    largest, price, terms = 0.0, 0.0, 0.0
    for k in range(n):
        largest, terms = max(largest, abs(x[k])), max(terms, abs(q[k]))
    for i in range(n):
        slope, size = q[i], abs(q[i])
        for k in range(n):
            slope += Q[i, k] * x[k]
            size += abs(Q[i, k]) * largest
        for a in range(count):
            slope += A[active[a], i] * multipliers[a]
            size += abs(A[active[a], i] * multipliers[a])
        if not abs(slope) <= _OPTIMAL * max(size, terms):
            return False
    for a in range(count):
        price = max(price, abs(multipliers[a]))
    for a in range(count):
        if active[a] >= equal and not multipliers[a] >= -_OPTIMAL * price:
            return False
    for j in range(rows):
        beyond, size = -b[j], abs(b[j])
        for k in range(n):
            beyond += A[j, k] * x[k]
            size += abs(A[j, k]) * largest
        if not beyond <= _OPTIMAL * size or (is_among(active, count, j) != 0 and beyond < -_OPTIMAL * size):
            return False
    return True


@kernel
def _refine(program, count):
    """Takes from x and multipliers what they miss the conditions of optimality by, with the factors of the last step.

    In y = L'x these are dy + M'd = L^-1 r and M dy = s.
    """
    Q, q, A, b, x = program.Q, program.q, program.A, program.b, program.x
    H, G, M, active, multipliers = program.H, program.G, program.M, program.active, program.multipliers
    y, change = program.u, program.r
    n = len(x)
    for i in range(n):
        y[i] = -q[i] - along(Q, i, x, n)
    for a in range(count):
        for k in range(n):
            y[k] -= A[active[a], k] * multipliers[a]
    forward(H, n, y)
    for a in range(count):
        change[a] = along(A, active[a], x, n) - b[active[a]] + along(M, active[a], y, n)
    forward(G, count, change)
    backward(G, count, change)
    for a in range(count):
        multipliers[a] += change[a]
        for k in range(n):
            y[k] -= M[active[a], k] * change[a]
    backward(H, n, y)
    for k in range(n):
        x[k] += y[k]
    return 0


@kernel(outline=True)
def _solve(program, rows, equal):
    """Finds x, and the rows that hold with equality there; how many, or -1 where an answer is not proven."""
    Q, q, A, b, x, multipliers = program.Q, program.q, program.A, program.b, program.x, program.multipliers
    n = len(x)
    has_own = _is_definite(program, equal, 0.0)
    if not has_own:
        of_equations = _largest(A, equal, n)
        if of_equations == 0.0:
            return INFEASIBLE
        # Where equations leave no way along which the cost is flat, their squares are a part of it that is zero.
        if not _is_definite(program, equal, _largest(Q, n, n) / of_equations**2):
            return INFEASIBLE
    transform(program.H, A, rows, program.M, program.sizes)
    count = active_rows(
        program.H, program.f, A, b, rows, equal, program.G, program.M, program.d, program.u, program.r, program.sizes,
        x, multipliers, program.active,
    )  # fmt: skip
    if count < 0 or not _are_apart(program, rows, count):
        return INFEASIBLE
    if has_own:
        _refine(program, count)
        if _is_proven(program, rows, equal, count):
            return count
    if solve_with_rows(program.K, Q, q, A, b, program.active, count, x, multipliers) != 0:
        return INFEASIBLE
    return count if _is_proven(program, rows, equal, count) else INFEASIBLE


@kernel(top=True)
def solve_small_quadratic(
    given: Given, program: Quadratic, costs: int, blocks: int, slopes: int, slope: int, rows: int
) -> int:
    """Finds where a strictly convex program is least: how many rows hold with equality there, or -1 if not proven.

    The multipliers are unique then.

    Args:
        given: The program, and what is found.
        program: x, and scratch for all of n variables and twice as many rows as given.
        costs: How many quadratic costs there are.
        blocks: How many matrices of constraints.
        slopes: How many coefficients of linear terms.
        slope: The place of the first one among the numbers, behind all matrices.
        rows: How many rows the constraints have.
    """
    x, q = program.x, program.q
    number = _take_costs(given, costs, slopes, slope, program.Q, q)
    if number < 0:
        return INFEASIBLE
    equal, all_rows = _choose_rows(given, rows, slope + slopes, program.b)
    if equal < 0:
        return INFEASIBLE
    _take_rows(given, 2 * costs, blocks, number, slopes, rows, all_rows, program.A)
    count = _solve(program, all_rows, equal)
    if count < 0:
        return INFEASIBLE
    cost = 0.0
    for i in range(len(x)):
        cost += x[i] * (q[i] + 0.5 * along(program.Q, i, x, len(x)))
    given.cost[0] = cost
    for i in range(rows):
        given.dual[i] = 0.0
    for a in range(count):
        i, price = given.chosen[program.active[a]], program.multipliers[a]
        if i >= 0:
            given.dual[i] -= price
        else:
            given.dual[i + rows] += price
    return count
