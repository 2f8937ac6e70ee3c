"""Small dense quadratic programs, to rounding.

Which rows hold with equality at the solution is found by the dual method of D. Goldfarb and A. Idnani (Mathematical
Programming 27, 1983): it starts from the least of all points and takes rows that are violated, one by one. For costs
that are not strictly convex it needs a little more on the diagonal, about the last point found (the proximal point
method), which goes again where the solution is computed from its rows.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.common.kernel import IntVector, Matrix, Vector, kernel

_DEPENDENT = 1e-13  # what is left of a row's square that is a combination of others, relative
_ROUNDS = 20  # for each row
_POINTS = 12  # of the proximal point method
_NOISE = 4e-15
INFEASIBLE = -1
REGULARIZATION = 1e-4  # relative to the largest entry of the cost, or 1
EXACT, CLOSE = 1e-11, 1e-9  # what conditions of optimality may miss, relative to their terms: at once, and in the end


@kernel
def product(M, i, N, j, n):
    """Product of the first n numbers of two rows, as four sums that need not wait for each other."""
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for k in range(0, n - 3, 4):
        a += M[i, k] * N[j, k]
        b += M[i, k + 1] * N[j, k + 1]
        c += M[i, k + 2] * N[j, k + 2]
        d += M[i, k + 3] * N[j, k + 3]
    for k in range(n - n % 4, n):
        a += M[i, k] * N[j, k]
    return (a + b) + (c + d)


@kernel
def along(M, i, x, n):
    """The same of a row and a vector."""
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for k in range(0, n - 3, 4):
        a += M[i, k] * x[k]
        b += M[i, k + 1] * x[k + 1]
        c += M[i, k + 2] * x[k + 2]
        d += M[i, k + 3] * x[k + 3]
    for k in range(n - n % 4, n):
        a += M[i, k] * x[k]
    return (a + b) + (c + d)


@kernel
def factor(G, n):
    """Cholesky's factor of the first n rows and columns, in place below the diagonal; whether there is none."""
    for j in range(n):
        square = G[j, j] - product(G, j, G, j, j)
        if not square > 0.0:
            return 1
        pivot = square**0.5
        G[j, j] = pivot
        for i in range(j + 1, n):
            G[i, j] = (G[i, j] - product(G, i, G, j, j)) / pivot
    return 0


@kernel
def forward(L, n, x):
    """x becomes L^-1 x."""
    for i in range(n):
        x[i] = (x[i] - along(L, i, x, i)) / L[i, i]
    return 0


@kernel
def backward(L, n, x):
    """x becomes L^-T x."""
    for a in range(n):
        i = n - 1 - a
        y = x[i] / L[i, i]
        x[i] = y
        for k in range(i):
            x[k] -= L[i, k] * y
    return 0


@kernel
def without_row(G, count, row):
    """Takes a row and column off the matrix whose factor G is, by rotations of columns; whether it was singular."""
    for i in range(row, count - 1):
        for k in range(i + 2):
            G[i, k] = G[i + 1, k]
    for k in range(row, count - 1):
        a, b = G[k, k], G[k, k + 1]
        pivot = (a * a + b * b) ** 0.5
        if not pivot > 0.0:
            return 1
        c, s = a / pivot, b / pivot
        G[k, k] = pivot
        for i in range(k + 1, count - 1):
            left, right = G[i, k], G[i, k + 1]
            G[i, k] = c * left + s * right
            G[i, k + 1] = c * right - s * left
    return 0


@kernel
def combination(M, active, count, G, j, n, r):
    """r becomes what row j is of the active rows, nearest; what is left of its square.

    G holds the factor of the active rows, and gets the row that it has more if j becomes active.
    """
    for a in range(count):
        r[a] = product(M, active[a], M, j, n)
    square = product(M, j, M, j, n)
    forward(G, count, r)
    left = square
    for a in range(count):
        left -= r[a] ** 2
    if count < n:
        for a in range(count):
            G[count, a] = r[a]
        G[count, count] = max(left, 0.0) ** 0.5
    backward(G, count, r)
    return left if left > _DEPENDENT * square else 0.0


@kernel
def most_violated(M, d, u, sizes, equal, rows, n, active, count, noise):
    """The row furthest beyond its bound, by equations first; -1 if there is none."""
    found, most = -1, 0.0
    for j in range(rows):
        if j < equal:
            if is_among(active, count, j) == 0:
                return j
            continue
        s = along(M, j, u, n) - d[j]
        s = (s - _NOISE * abs(d[j])) / sizes[j] - noise
        if s > most and is_among(active, count, j) == 0:
            found, most = j, s
    return found


@kernel
def is_among(active, count, j):
    for a in range(count):
        if active[a] == j:
            return 1
    return 0


@kernel
def transform(H, A, rows, M, sizes):
    """M becomes the rows of A where the cost whose factor is in H is a distance; `sizes` their lengths."""
    n = A.shape[1]
    for j in range(rows):
        begin = 0
        while begin < n and A[j, begin] == 0.0:
            M[j, begin] = 0.0
            begin += 1
        for i in range(begin, n):
            M[j, i] = (A[j, i] - product(H, i, M, j, i)) / H[i, i]
        sizes[j] = (1e-300 + product(M, j, M, j, n)) ** 0.5
    return 0


@kernel
def active_rows(H, f, A, b, rows, equal, G, M, d, u, r, sizes, x0, multipliers, active):
    """Finds x0 with the least 1/2 x'Hx + f'x and A x <= b, and its rows that hold; gives how many, or -1.

    H holds the factor of the cost, A and b as many rows, M and `sizes` what `transform` makes of these.
    """
    n = A.shape[1]
    # In u = L'x + L^-1 f the cost is a distance from 0.
    for k in range(n):
        u[k] = f[k]
    forward(H, n, u)
    noise = 0.0
    for k in range(n):
        x0[k] = u[k]
        noise += u[k] ** 2
    noise = _NOISE * noise**0.5
    for j in range(rows):
        d[j] = b[j] + along(M, j, u, n)
    for k in range(n):
        u[k] = 0.0
    count, j, own = 0, most_violated(M, d, u, sizes, equal, rows, n, active, 0, noise), 0.0
    for _ in range(_ROUNDS * (rows + 1)):
        if j < 0:
            for k in range(n):
                x0[k] = u[k] - x0[k]
            backward(H, n, x0)
            return count
        left = combination(M, active, count, G, j, n, r)
        s = along(M, j, u, n) - d[j]
        sign = 1.0 if s >= 0.0 else -1.0
        step, leaves = 1e150, -1
        for a in range(count):
            slope = sign * r[a]
            if active[a] >= equal and slope > 0.0 and multipliers[a] < step * slope:
                step, leaves = multipliers[a] / slope, a
        if left > 0.0 and abs(s) <= step * left:
            step, leaves = abs(s) / left, -1
        elif leaves < 0:
            return INFEASIBLE
        # Along the row less what the others take of it.
        for k in range(n):
            u[k] -= sign * step * M[j, k]
        for a in range(count):
            multipliers[a] -= sign * step * r[a]
            for k in range(n):
                u[k] += sign * step * r[a] * M[active[a], k]
        own += sign * step
        if leaves < 0:
            if count == n:
                return INFEASIBLE
            active[count] = j
            multipliers[count] = own
            count += 1
            own = 0.0
            j = most_violated(M, d, u, sizes, equal, rows, n, active, count, noise)
        else:
            for a in range(leaves, count - 1):
                active[a] = active[a + 1]
                multipliers[a] = multipliers[a + 1]
            if without_row(G, count, leaves) != 0:
                return INFEASIBLE
            count -= 1
    return INFEASIBLE


@kernel
def eliminate(K, n):
    """Solves for the last of the n + 1 columns, in place; whether the matrix is singular."""
    for j in range(n):
        pivot = j
        for i in range(j + 1, n):
            if abs(K[i, j]) > abs(K[pivot, j]):
                pivot = i
        if abs(K[pivot, j]) < 1e-200:
            return 1
        for k in range(j, n + 1):
            kept = K[j, k]
            K[j, k] = K[pivot, k]
            K[pivot, k] = kept
        for i in range(j + 1, n):
            factor = K[i, j] / K[j, j]
            for k in range(j, n + 1):
                K[i, k] -= factor * K[j, k]
    for a in range(n):
        i = n - 1 - a
        for k in range(i + 1, n):
            K[i, n] -= K[i, k] * K[k, n]
        K[i, n] = K[i, n] / K[i, i]
    return 0


@kernel
def solve_with_rows(K, Q, q, A, b, active, count, x, multipliers):
    """x and multipliers where these rows hold with equality; whether there are none."""
    n = q.shape[0]
    size = n + count
    for i in range(size):
        for k in range(size + 1):
            K[i, k] = 0.0
    for i in range(n):
        for k in range(n):
            K[i, k] = Q[i, k]
        K[i, size] = -q[i]
    for a in range(count):
        for k in range(n):
            K[n + a, k] = A[active[a], k]
            K[k, n + a] = A[active[a], k]
        K[n + a, size] = b[active[a]]
    if eliminate(K, size) != 0:
        return 1
    for k in range(n):
        x[k] = K[k, size]
    for a in range(count):
        multipliers[a] = K[n + a, size]
    return 0


@kernel
def is_optimal(Q, q, A, b, equal, active, count, x, multipliers, tolerance):
    """Whether x and multipliers meet the conditions of optimality."""
    rows, n = A.shape
    terms, largest = 1.0, 0.0  # all elements of x are about as exact as the largest
    for k in range(n):
        terms, largest = max(terms, abs(q[k])), max(largest, abs(x[k]))
    for a in range(count):
        terms = max(terms, abs(multipliers[a]))
    for a in range(count):
        if active[a] >= equal and not multipliers[a] >= -tolerance * terms:
            return 0
    for i in range(n):
        slope = q[i]
        for k in range(n):
            slope += Q[i, k] * x[k]
        for a in range(count):
            slope += A[active[a], i] * multipliers[a]
        if not abs(slope) <= tolerance * terms:
            return 0
    for j in range(rows):
        beyond, size = -b[j], abs(b[j])
        for k in range(n):
            beyond += A[j, k] * x[k]
            size += abs(A[j, k]) * largest
        if not beyond <= tolerance * size or (j < equal and beyond < -tolerance * size):
            return 0
    return 1


class Quadratic(NamedTuple):
    """A program 1/2 x'Qx + q'x with A x <= b, what is found, and scratch.

    Attributes:
        Q: Positive semidefinite, shape (n, n).
        q: Shape (n,).
        A: Shape (rows, n).
        b: Shape (rows,); infinite where there is no bound.
        x: The solution, shape (n,).
        multipliers: Of the rows that hold with equality there, shape (n + 1,).
        active: These rows, shape (n + 1,).
        H: Scratch, shape (n, n).
        G: Scratch, shape (n, n).
        M: Scratch, shape (rows, n).
        d: Scratch, shape (rows,).
        sizes: Scratch, shape (rows,).
        u: Scratch, shape (n,).
        r: Scratch, shape (n,).
        f: Scratch, shape (n,).
        center: Scratch, shape (n,).
        K: Scratch, shape (2 n, 2 n + 1).
    """

    Q: Matrix
    q: Vector
    A: Matrix
    b: Vector
    x: Vector
    multipliers: Vector
    active: IntVector
    H: Matrix
    G: Matrix
    M: Matrix
    d: Vector
    sizes: Vector
    u: Vector
    r: Vector
    f: Vector
    center: Vector
    K: Matrix


def make_quadratic(rows: int, n: int) -> Quadratic:
    """Memory for a program of n variables and so many rows."""
    vectors = iter(np.zeros((7, n)))
    return Quadratic(
        Q=np.zeros((n, n)), q=next(vectors), A=np.zeros((rows, n)), b=np.zeros(rows), x=next(vectors),
        multipliers=np.zeros(n + 1), active=np.zeros(n + 1, dtype=np.int64), H=np.zeros((n, n)), G=np.zeros((n, n)),
        M=np.zeros((rows, n)), d=np.zeros(rows), sizes=np.zeros(rows), u=next(vectors), r=next(vectors),
        f=next(vectors), center=next(vectors), K=np.zeros((2 * n, 2 * n + 1)),
    )  # fmt: skip


@kernel(outline=True)
def prepare(program):
    """What depends on Q and A alone; what there is more on the diagonal, or -1 if Q is not convex."""
    Q, H = program.Q, program.H
    n = program.q.shape[0]
    largest = 1.0
    for i in range(n):
        for k in range(n):
            largest = max(largest, abs(Q[i, k]))
            H[i, k] = Q[i, k]
    weight = REGULARIZATION * largest
    for i in range(n):
        H[i, i] += weight
    if factor(H, n) != 0:
        return -1.0
    transform(H, program.A, len(program.b), program.M, program.sizes)
    return weight


@kernel(outline=True)
def solve_prepared(program, equal, weight):
    """Finds x, by as many proximal points as it takes; how many rows hold with equality, or -1.

    Q and A are those for which `prepare` gave a weight.
    """
    Q, q, A, b, x, center = program.Q, program.q, program.A, program.b, program.x, program.center
    f, multipliers, active = program.f, program.multipliers, program.active
    if weight < 0.0:
        return INFEASIBLE
    for k in range(len(q)):
        center[k] = 0.0
    for point in range(_POINTS):
        for i in range(len(q)):
            f[i] = q[i] - weight * center[i]
        count = active_rows(
            program.H, f, A, b, len(b), equal, program.G, program.M, program.d, program.u, program.r, program.sizes,
            center, multipliers, active,
        )  # fmt: skip
        if count < 0:
            return INFEASIBLE
        tolerance = EXACT if point < _POINTS - 1 else CLOSE
        if solve_with_rows(program.K, Q, q, A, b, active, count, x, multipliers) == 0:
            if is_optimal(Q, q, A, b, equal, active, count, x, multipliers, tolerance) != 0:
                return count
    return INFEASIBLE


@kernel
def solve_quadratic(program, equal):
    """Both."""
    return solve_prepared(program, equal, prepare(program))


@kernel(outline=True)
def solve_by_rows(program, equal, count):
    """Tries whether the same rows hold with equality as when the program was solved last; how many, or -1 if not."""
    Q, q, A, b, x = program.Q, program.q, program.A, program.b, program.x
    active, multipliers = program.active, program.multipliers
    if solve_with_rows(program.K, Q, q, A, b, active, count, x, multipliers) != 0:
        return INFEASIBLE
    is_found = is_optimal(Q, q, A, b, equal, active, count, x, multipliers, EXACT)
    return count if is_found != 0 else INFEASIBLE


@kernel(top=True)
def least_of_free(H: Matrix, g: Vector, free: Vector, G: Matrix, r: Vector, x: Vector) -> None:
    """Where 1/2 x'Hx + g'x is least, x being 0 where it is not free; 0 if there is no least.

    Args:
        H: Shape (n, n), symmetric.
        g: Shape (n,).
        free: Above zero where x is free, shape (n,).
        G: Scratch, shape (n, n).
        r: Scratch, shape (n,).
        x: Filled, shape (n,).
    """
    n, count = len(g), 0
    for i in range(n):
        x[i] = 0.0
        if free[i] > 0.0:
            own = 0
            for k in range(i + 1):
                if free[k] > 0.0:
                    G[count, own] = H[i, k]
                    own += 1
            r[count] = -g[i]
            count += 1
    if factor(G, count) == 0:
        forward(G, count, r)
        backward(G, count, r)
        count = 0
        for i in range(n):
            if free[i] > 0.0:
                x[i] = r[count]
                count += 1


@kernel(top=True)
def solve_dense_program(program: Quadratic, equal: int) -> int:
    """Finds where a program is least: how many rows hold with equality there, or -1 if none is found.

    Args:
        program: The program.
        equal: How many of the first rows are equations.
    """
    return solve_quadratic(program, equal)
