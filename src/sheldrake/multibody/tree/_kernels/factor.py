"""LᵀDL factorisation and products with packed matrices (Featherstone 2008, section 6.5; layout in `model`)."""

from __future__ import annotations

from sheldrake.common._kernels.generic import is_positive
from sheldrake.common._kernels.vec import read6, write6
from sheldrake.common.kernel import Matrix, Vector, kernel
from sheldrake.multibody.tree._kernels.model import FREE, TreeModel


@kernel
def ltdl(model: TreeModel, L: Vector) -> int:
    """Replaces a packed symmetric matrix by its factor: 1/D on the diagonal, the unit lower triangle below it.

    Returns:
        -1, or the dof whose pivot is not positive (the factor is then of no use).
    """
    bad = -1
    k = len(model.dofs) - 1
    while k >= 0:
        if is_of_free_body(model, k):
            pivot_of_6 = ltdl_of_6(L, model.dofs[k - 5].row)
            if pivot_of_6 >= 0:
                bad = k - 5 + pivot_of_6
            k -= 6
        else:
            row_k = model.dofs[k].row
            pivot = row_k + model.dofs[k].depth
            if not is_positive(L[pivot]):
                bad = k
            r = 1.0 / L[pivot]
            L[pivot] = r
            i = model.dofs[k].parent
            while i >= 0:
                dof_i = model.dofs[i]
                row_i, depth, first = dof_i.row, dof_i.depth, dof_i.run
                for _ in range(first, i + 1):  # from the end of the run to its beginning
                    a = L[row_k + depth] * r
                    for j in range(depth + 1):
                        L[row_i + j] -= a * L[row_k + j]
                    L[row_k + depth] = a
                    row_i -= depth
                    depth -= 1
                i = model.dofs[first].parent
            k -= 1
    return bad


@kernel
def ltdl_of_6(L, start):
    """The six rows of a free body, without loops: they would cost more than what is in them."""
    bad = eliminate(L, start, start + 15, 5, -1)
    bad = eliminate(L, start, start + 10, 4, bad)
    bad = eliminate(L, start, start + 6, 3, bad)
    bad = eliminate(L, start, start + 3, 2, bad)
    bad = eliminate(L, start, start + 1, 1, bad)
    return eliminate(L, start, start, 0, bad)


@kernel
def eliminate(L, start, row, k, bad):
    """Takes row k, at `row`, from those above it, and puts 1/D there; k if the pivot is not positive, else `bad`."""
    if not is_positive(L[row + k]):
        bad = k
    r = 1.0 / L[row + k]
    L[row + k] = r
    if k > 4:
        subtract(L, start + 10, 4, row, r)
    if k > 3:
        subtract(L, start + 6, 3, row, r)
    if k > 2:
        subtract(L, start + 3, 2, row, r)
    if k > 1:
        subtract(L, start + 1, 1, row, r)
    if k > 0:
        subtract(L, start, 0, row, r)
    return bad


@kernel
def subtract(L, at, i, row, r):
    """Takes a row from row i, at `at`, in proportion to its own element i, which becomes that of the triangle."""
    a = L[row + i] * r
    L[at] -= a * L[row]
    if i > 0:
        L[at + 1] -= a * L[row + 1]
    if i > 1:
        L[at + 2] -= a * L[row + 2]
    if i > 2:
        L[at + 3] -= a * L[row + 3]
    if i > 3:
        L[at + 4] -= a * L[row + 4]
    L[row + i] = a


@kernel
def ltdl_solve(model: TreeModel, L: Vector, x: Vector) -> None:
    """Replaces x, shape (nv,), by the solution of the factored matrix times itself = x."""
    ltdl_solve_span(model, L, 0, len(model.dofs), x, 0)


@kernel
def ltdl_solve_span(model: TreeModel, L: Vector, start: int, end: int, x: Vector, at: int) -> None:
    """The same for the dofs of one tree or more, [start, end); dof k is at x[k - start + at]."""
    shift = at - start
    k = end - 1
    while k >= start:
        if is_of_free_body(model, k):
            ltdl_solve_of_6(L, model.dofs[k - 5].row, x, shift + k - 5)
            k -= 6
        else:
            row = model.dofs[k].row
            x_k = x[shift + k]
            i = model.dofs[k].parent
            while i >= 0:
                first = model.dofs[i].run
                column = row + model.dofs[first].depth - first
                for j in range(first, i + 1):
                    x[shift + j] -= L[column + j] * x_k
                i = model.dofs[first].parent
            k -= 1
    k = start
    while k < end:
        if is_of_free_body(model, k):
            k += 6
        else:
            row = model.dofs[k].row
            x_k = x[shift + k] * L[row + model.dofs[k].depth]
            i = model.dofs[k].parent
            while i >= 0:
                first = model.dofs[i].run
                column = row + model.dofs[first].depth - first
                for j in range(first, i + 1):
                    x_k -= L[column + j] * x[shift + j]
                i = model.dofs[first].parent
            x[shift + k] = x_k
            k += 1


@kernel
def is_of_free_body(model, k):
    return model.bodies[model.dofs[k].body].kind == FREE


@kernel
def ltdl_solve_of_6(L, start, x, at):
    """Both substitutions of a free body; what hangs on it has been through the first, and comes to the second later."""
    (a, b, c), (d, e, f) = read6(x, at)
    row_b, row_c, row_d, row_e, row_f = start + 1, start + 3, start + 6, start + 10, start + 15
    e -= L[row_f + 4] * f
    d -= L[row_f + 3] * f + L[row_e + 3] * e
    c -= L[row_f + 2] * f + L[row_e + 2] * e + L[row_d + 2] * d
    b -= L[row_f + 1] * f + L[row_e + 1] * e + L[row_d + 1] * d + L[row_c + 1] * c
    a -= L[row_f] * f + L[row_e] * e + L[row_d] * d + L[row_c] * c + L[row_b] * b
    a *= L[start]
    b = b * L[row_b + 1] - L[row_b] * a
    c = c * L[row_c + 2] - (L[row_c] * a + L[row_c + 1] * b)
    d = d * L[row_d + 3] - (L[row_d] * a + L[row_d + 1] * b + L[row_d + 2] * c)
    e = e * L[row_e + 4] - (L[row_e] * a + L[row_e + 1] * b + L[row_e + 2] * c + L[row_e + 3] * d)
    f = f * L[row_f + 5] - (L[row_f] * a + L[row_f + 1] * b + L[row_f + 2] * c + L[row_f + 3] * d + L[row_f + 4] * e)
    write6(x, at, ((a, b, c), (d, e, f)))


@kernel
def packed_times(model: TreeModel, M: Vector, x: Vector, y: Vector) -> None:
    """y = M x of a packed symmetric matrix; x and y, shape (nv,), are different arrays."""
    packed_times_span(model, M, 0, len(model.dofs), x, y)


@kernel
def packed_times_span(model: TreeModel, M: Vector, start: int, end: int, x: Vector, y: Vector) -> None:
    """The same for the dofs [start, end) of one tree or more; only these elements of x and y are touched."""
    for k in range(start, end):
        row = model.dofs[k].row
        y[k] = M[row + model.dofs[k].depth] * x[k]
        i = model.dofs[k].parent
        while i >= 0:
            m = M[row + model.dofs[i].depth]
            y[k] += m * x[i]
            y[i] += m * x[k]
            i = model.dofs[i].parent


@kernel
def unpack(model: TreeModel, M: Vector, dense: Matrix) -> None:
    """Writes a packed symmetric matrix into a zeroed one, shape (nv, nv)."""
    for k in range(len(model.dofs)):
        row = model.dofs[k].row
        i = k
        while i >= 0:
            m = M[row + model.dofs[i].depth]
            dense[k, i] = m
            dense[i, k] = m
            i = model.dofs[i].parent
