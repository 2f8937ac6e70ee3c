"""Small dense linear programs by the simplex method on a tableau, each answer with its proof.

Each row says that its last entry is a variable of its own plus the other entries times the variables that are at zero.
The slack of row i has number i, x_k has rows + k, and the artificial variable, by which rows may be violated until a
point is found, rows + n. First every x trades places with a slack: then no step looks at it any more, and one that
finds no partner matters to no row. Steps go along the steepest column (G. B. Dantzig, 1951), and where that does not
end by the rule of R. G. Bland (Mathematics of Operations Research 2, 1977), which never cycles.

What the tableau ends with is only a guess, for rounding adds up in it: points are computed once more from the rows that
hold with equality, and signs and products are looked at in A, b and c as they were given.
"""

from __future__ import annotations

from sheldrake.common.kernel import IntVector, Matrix, Vector, kernel
from sheldrake.solvers._kernels.active_set import eliminate

OPTIMAL, INFEASIBLE, UNBOUNDED, UNDECIDED = 0, 1, 2, 3
VIOLATED = 1e-7  # A set of rows that less could satisfy is not called infeasible.
_PROVEN = 1e-11  # what a proof may miss, relative to its terms
_PIVOT = 1e-9  # the least entry to divide by; rows have a largest entry of 1
_ZERO = 1e-12  # the largest entry that is none
_DANTZIG = 2  # times rows and columns: steps along the steepest column
_STEPS = 6  # times rows and columns


@kernel
def pivot_on(T, own, at_zero, height, width, row, col):
    """The variable of a row and that of a column pivot_on places."""
    pivot = T[row, col]
    T[row, col] = 1.0
    for k in range(width):
        T[row, k] = T[row, k] / pivot
    for i in range(height):
        factor = T[i, col]
        if i != row and factor != 0.0:
            T[i, col] = 0.0
            for k in range(width):
                T[i, k] -= factor * T[row, k]
    kept = own[row]
    own[row] = at_zero[col]
    at_zero[col] = kept
    return 0


@kernel
def largest_entry(A, j, n):
    """Of a row, by size."""
    largest = 0.0
    for k in range(n):
        largest = max(largest, abs(A[j, k]))
    return largest


@kernel
def largest_of(x, n):
    """Of the first n numbers, by size."""
    largest = 0.0
    for k in range(n):
        largest = max(largest, abs(x[k]))
    return largest


@kernel
def make_tableau(T, own, at_zero, c, A, b, rows, n):
    """The tableau at x = 0; below the rows that of the cost, and one for the artificial variable."""
    for i in range(rows):
        largest = largest_entry(A, i, n)
        scale = 1.0 / largest if largest > 0.0 else 1.0
        for k in range(n):
            T[i, k] = A[i, k] * scale
        T[i, n] = 0.0
        T[i, n + 1] = b[i] * scale
        own[i] = i
    largest = largest_of(c, n)
    scale = 1.0 / largest if largest > 0.0 else 1.0
    for k in range(n):
        T[rows, k] = -c[k] * scale
        T[rows + 1, k] = 0.0
        at_zero[k] = rows + k
    for k in range(n, n + 2):
        T[rows, k] = 0.0
        T[rows + 1, k] = 0.0
    own[rows] = -1
    own[rows + 1] = -1
    at_zero[n] = rows + n
    return 0


@kernel
def pivot_in_all(T, own, at_zero, rows, n):
    """Each x trades places with a slack, by largest entries; how many did, or -1 if that is not plain."""
    for count in range(n):
        largest, row, col = 0.0, -1, -1
        for i in range(rows):
            if own[i] < rows:
                for k in range(n):
                    if at_zero[k] >= rows and abs(T[i, k]) > largest:
                        largest, row, col = abs(T[i, k]), i, k
        if largest <= _ZERO:
            return count
        if largest < _PIVOT:
            return -1
        pivot_on(T, own, at_zero, rows + 2, n + 2, row, col)
    return n


@kernel
def entering(T, at_zero, cost, rows, n, bland, tolerance):
    """A column along which the cost falls; -1 if there is none."""
    found, steepest = -1, -tolerance
    for k in range(n + 1):
        if at_zero[k] < rows and T[cost, k] < -tolerance:
            if bland != 0:
                if found < 0 or at_zero[k] < at_zero[found]:
                    found = k
            elif T[cost, k] < steepest:
                found, steepest = k, T[cost, k]
    return found


@kernel
def leaving(T, own, rows, n, col, bland):
    """The row that a column reaches first; -1 if it goes on for ever."""
    found, least = -1, 1e300
    for i in range(rows):
        slope = T[i, col]
        if slope > _PIVOT and (own[i] < rows or own[i] == rows + n):
            reach = max(T[i, n + 1], 0.0) / slope
            tie = found >= 0 and abs(reach - least) <= _ZERO * (1.0 + least)
            if tie:
                first = own[i] < own[found] if bland != 0 else slope > T[found, col]
                if own[i] == rows + n or (first and own[found] != rows + n):
                    found, least = i, min(reach, least)
            elif reach < least:
                found, least = i, reach
    return found


@kernel
def descend(T, own, at_zero, cost, rows, n):
    """Steps until a row of costs has no negative entry; how it ended, and the column."""
    largest = 1.0
    for k in range(n + 1):
        largest = max(largest, abs(T[cost, k]))
    for step in range(_STEPS * (rows + n)):
        bland = 1 if step > _DANTZIG * (rows + n) else 0
        col = entering(T, at_zero, cost, rows, n, bland, _PROVEN * largest)
        if col < 0:
            return OPTIMAL, -1
        row = leaving(T, own, rows, n, col, bland)
        if row < 0:
            return UNBOUNDED, col
        pivot_on(T, own, at_zero, rows + 2, n + 2, row, col)
    return UNDECIDED, -1


@kernel
def reach_a_point(T, own, at_zero, rows, n):
    """Steps to where no slack is negative."""
    worst, largest, row = 0.0, 0.0, -1
    for i in range(rows):
        largest = max(largest, abs(T[i, n + 1]))
        if own[i] < rows and T[i, n + 1] < worst:
            worst, row = T[i, n + 1], i
    if worst >= -_PROVEN * largest:
        return OPTIMAL  # but for rounding, of which the proof has the last word
    for i in range(rows):
        if own[i] < rows:
            T[i, n] = -1.0
    T[rows + 1, n] = 1.0
    pivot_on(T, own, at_zero, rows + 2, n + 2, row, n)
    status, _ = descend(T, own, at_zero, rows + 1, rows, n)
    if status != OPTIMAL:
        return UNDECIDED
    for i in range(rows):
        if own[i] == rows + n:
            if T[i, n + 1] > _PROVEN * largest:
                return INFEASIBLE
            col = 0
            for k in range(n + 1):
                if at_zero[k] < rows and (at_zero[col] >= rows or abs(T[i, k]) > abs(T[i, col])):
                    col = k
            if at_zero[col] >= rows or abs(T[i, col]) < _PIVOT:
                return UNDECIDED
            pivot_on(T, own, at_zero, rows + 2, n + 2, i, col)
            return OPTIMAL
    return OPTIMAL


@kernel
def multiplier(entry, A, j, n):
    """How often row j is taken, where an entry below the tableau says it of the row with a largest entry of 1."""
    largest = largest_entry(A, j, n)
    return max(entry, 0.0) / (largest if largest > 0.0 else 1.0)


@kernel
def is_impossible(T, at_zero, A, b, rows, n):
    """Whether a combination of rows, none of them negative, says 0 x <= less than nothing."""
    total, bound, largest = 0.0, 0.0, 0.0
    for k in range(n + 1):
        j = at_zero[k]
        if j < rows:
            y = multiplier(T[rows + 1, k], A, j, n)
            total += y
            bound += y * b[j]
            largest = max(largest, T[rows + 1, k])
    if not bound < -VIOLATED * total:
        return 0
    for i in range(n):
        left = 0.0
        for k in range(n + 1):
            j = at_zero[k]
            if j < rows:
                left += multiplier(T[rows + 1, k], A, j, n) * A[j, i]
        if not abs(left) <= _PROVEN * largest:
            return 0
    return 1


@kernel
def point_of_rows(K, x, own, at_zero, A, b, rows, n):
    """x where the slacks at zero are zero; whether that is no point of A x <= b."""
    count = 0
    for k in range(n + 1):
        j = at_zero[k]
        if j < rows:
            col = 0
            for i in range(rows):
                if own[i] >= rows and own[i] < rows + n:
                    K[count, col] = A[j, own[i] - rows]
                    col += 1
            K[count, col] = b[j]
            count += 1
    for k in range(n):
        x[k] = 0.0
    if eliminate(K, count) != 0:
        return 1
    col = 0
    for i in range(rows):
        if own[i] >= rows and own[i] < rows + n:
            x[own[i] - rows] = K[col, count]
            col += 1
    largest = largest_of(x, n)
    for j in range(rows):
        beyond = -b[j]
        for k in range(n):
            beyond += A[j, k] * x[k]
        if not beyond <= _PROVEN * (abs(b[j]) + largest_entry(A, j, n) * largest):
            return 1
    return 0


@kernel
def is_best(K, y, own, at_zero, c, A, rows, n):
    """Whether c is a combination y of the rows whose slacks are at zero, none of them negative."""
    count = 0
    for j in range(rows):
        y[j] = 0.0
    for i in range(rows):
        if own[i] >= rows and own[i] < rows + n:
            col = 0
            for k in range(n + 1):
                if at_zero[k] < rows:
                    K[count, col] = A[at_zero[k], own[i] - rows]
                    col += 1
            K[count, col] = c[own[i] - rows]
            count += 1
    if eliminate(K, count) != 0:
        return 0
    largest, col = largest_of(c, n), 0
    for k in range(n + 1):
        if at_zero[k] < rows:
            largest = max(largest, abs(K[col, count]) * largest_entry(A, at_zero[k], n))
            col += 1
    col = 0
    for k in range(n + 1):
        if at_zero[k] < rows:
            if not K[col, count] * largest_entry(A, at_zero[k], n) >= -_PROVEN * largest:
                return 0
            y[at_zero[k]] = max(K[col, count], 0.0)
            col += 1
    for i in range(n):
        left, col = c[i], 0
        for k in range(n + 1):
            if at_zero[k] < rows:
                left -= K[col, count] * A[at_zero[k], i]
                col += 1
        if not abs(left) <= _PROVEN * largest:
            return 0
    return 1


@kernel
def goes_on(T, own, at_zero, ray, c, A, rows, n, col):
    """Whether along the ray of a column the cost falls and no row is ever reached."""
    for k in range(n):
        ray[k] = 0.0
    if at_zero[col] >= rows:
        ray[at_zero[col] - rows] = 1.0 if T[rows, col] < 0.0 else -1.0
    for i in range(rows):
        if own[i] >= rows and own[i] < rows + n:
            ray[own[i] - rows] = -T[i, col] if at_zero[col] < rows or T[rows, col] < 0.0 else T[i, col]
    gain, largest = 0.0, largest_of(ray, n)
    for k in range(n):
        gain += c[k] * ray[k]
    if not gain > _PIVOT * largest_of(c, n) * largest:
        return 0
    for j in range(rows):
        slope = 0.0
        for k in range(n):
            slope += A[j, k] * ray[k]
        if not slope <= _PROVEN * largest_entry(A, j, n) * largest:
            return 0
    return 1


@kernel(top=True)
def solve_linear_program(
    rows: int,
    n: int,
    c: Vector,
    A: Matrix,
    b: Vector,
    x: Vector,
    y: Vector,
    T: Matrix,
    K: Matrix,
    ray: Vector,
    own: IntVector,
    at_zero: IntVector,
) -> int:
    """Finds where c'x is greatest with A x <= b; 0, 1 if no x is possible, 2 if c'x has no limit, 3 if undecided.

    Arrays may be larger than what is used of them.

    Args:
        rows: How many rows there are.
        n: How many variables there are.
        c: Shape (n,).
        A: Shape (rows, n).
        b: Shape (rows,), finite.
        x: Filled with the solution, or with some point from where c'x grows for ever, shape (n,).
        y: Filled with how much a solution gains for each row whose bound grows by one, shape (rows,).
        T: Scratch, shape (rows + 2, n + 2).
        K: Scratch, shape (n, n + 1).
        ray: Scratch, shape (n,).
        own: Scratch, shape (rows + 2,).
        at_zero: Scratch, shape (n + 1,).
    """
    make_tableau(T, own, at_zero, c, A, b, rows, n)
    if pivot_in_all(T, own, at_zero, rows, n) < 0:
        return UNDECIDED
    status = reach_a_point(T, own, at_zero, rows, n)
    if status == INFEASIBLE:
        return INFEASIBLE if is_impossible(T, at_zero, A, b, rows, n) != 0 else UNDECIDED
    if status != OPTIMAL:
        return UNDECIDED
    # Of an x that matters to no row only the cost can speak.
    col, steepest = -1, 0.0
    for k in range(n):
        if at_zero[k] >= rows and at_zero[k] < rows + n and abs(T[rows, k]) > steepest:
            col, steepest = k, abs(T[rows, k])
    if steepest > _PIVOT:
        status = UNBOUNDED
    else:
        status, col = descend(T, own, at_zero, rows, rows, n)
    if status == UNDECIDED or point_of_rows(K, x, own, at_zero, A, b, rows, n) != 0:
        return UNDECIDED
    if status == UNBOUNDED:
        return UNBOUNDED if goes_on(T, own, at_zero, ray, c, A, rows, n, col) != 0 else UNDECIDED
    return OPTIMAL if is_best(K, y, own, at_zero, c, A, rows, n) != 0 else UNDECIDED
