"""LᵀDL factorisation and products with packed matrices (Featherstone 2008, section 6.5; layout in `model`)."""

from __future__ import annotations

from sheldrake.common._kernels.generic import is_positive
from sheldrake.common.kernel import Matrix, Vector, kernel
from sheldrake.multibody.tree._kernels.model import DEPTH, DOF_BODY, DOF_PARENT, FREE, KIND, ROW, RUN, TreeModel


@kernel
def ltdl(model: TreeModel, L: Vector) -> int:
    """Replaces a packed symmetric matrix by its factor: 1/D on the diagonal, the unit lower triangle below it.

    Returns:
        -1, or the dof whose pivot is not positive (the factor is then of no use).
    """
    bad = -1
    k = model.dof.shape[0] - 1
    while k >= 0:
        if is_of_free_body(model, k):
            pivot_of_6 = ltdl_of_6(L, model.dof[k - 5, ROW])
            if pivot_of_6 >= 0:
                bad = k - 5 + pivot_of_6
            k -= 6
        else:
            row_k = model.dof[k, ROW]
            pivot = L[row_k + model.dof[k, DEPTH]]
            if not is_positive(pivot):
                bad = k
            r = 1.0 / pivot
            L[row_k + model.dof[k, DEPTH]] = r
            i = model.dof[k, DOF_PARENT]
            while i >= 0:
                row_i = model.dof[i, ROW]
                depth = model.dof[i, DEPTH]
                first = model.dof[i, RUN]
                for _ in range(first, i + 1):  # from the end of the run to its beginning
                    a = L[row_k + depth] * r
                    for j in range(depth + 1):
                        L[row_i + j] -= a * L[row_k + j]
                    L[row_k + depth] = a
                    row_i -= depth
                    depth -= 1
                i = model.dof[first, DOF_PARENT]
            k -= 1
    return bad


@kernel
def ltdl_of_6(L, start):
    """The six rows of a free body, without loops: they would cost more than what is in them."""
    bad = -1
    bad = invert_pivot(L, start + 20, 5, bad)
    eliminate_5(L, start, start + 15, L[start + 20])
    bad = invert_pivot(L, start + 14, 4, bad)
    eliminate_4(L, start, start + 10, L[start + 14])
    bad = invert_pivot(L, start + 9, 3, bad)
    eliminate_3(L, start, start + 6, L[start + 9])
    bad = invert_pivot(L, start + 5, 2, bad)
    eliminate_2(L, start, start + 3, L[start + 5])
    bad = invert_pivot(L, start + 2, 1, bad)
    eliminate_1(L, start, start + 1, L[start + 2])
    return invert_pivot(L, start, 0, bad)


@kernel
def invert_pivot(L, at, k, bad):
    """Puts 1/D in the place of the pivot of row k; k if it is not positive, else `bad`."""
    if not is_positive(L[at]):
        bad = k
    L[at] = 1.0 / L[at]
    return bad


@kernel
def eliminate_1(L, start, row, r):
    """Takes a row from the first row, in proportion; r is 1/D of the row."""
    a = L[row] * r
    L[start] -= a * L[row]
    L[row] = a


@kernel
def eliminate_2(L, start, row, r):
    """Takes a row from the first two rows."""
    a = L[row + 1] * r
    subtract_2(L, start + 1, a, row)
    L[row + 1] = a
    eliminate_1(L, start, row, r)


@kernel
def eliminate_3(L, start, row, r):
    a = L[row + 2] * r
    subtract_3(L, start + 3, a, row)
    L[row + 2] = a
    eliminate_2(L, start, row, r)


@kernel
def eliminate_4(L, start, row, r):
    a = L[row + 3] * r
    subtract_3(L, start + 6, a, row)
    L[start + 9] -= a * L[row + 3]
    L[row + 3] = a
    eliminate_3(L, start, row, r)


@kernel
def eliminate_5(L, start, row, r):
    a = L[row + 4] * r
    subtract_3(L, start + 10, a, row)
    subtract_2(L, start + 13, a, row + 3)
    L[row + 4] = a
    eliminate_4(L, start, row, r)


@kernel
def subtract_2(L, at, a, row):
    L[at] -= a * L[row]
    L[at + 1] -= a * L[row + 1]


@kernel
def subtract_3(L, at, a, row):
    subtract_2(L, at, a, row)
    L[at + 2] -= a * L[row + 2]


@kernel
def ltdl_solve(model: TreeModel, L: Vector, x: Vector) -> None:
    """Replaces x, shape (nv,), by the solution of the factored matrix times itself = x."""
    ltdl_solve_span(model, L, 0, model.dof.shape[0], x, 0)


@kernel
def ltdl_solve_span(model: TreeModel, L: Vector, start: int, end: int, x: Vector, at: int) -> None:
    """The same for the dofs of one tree or more, [start, end); dof k is at x[k - start + at]."""
    shift = at - start
    k = end - 1
    while k >= start:
        if is_of_free_body(model, k):
            ltdl_solve_of_6(L, model.dof[k - 5, ROW], x, shift + k - 5)
            k -= 6
        else:
            row = model.dof[k, ROW]
            x_k = x[shift + k]
            i = model.dof[k, DOF_PARENT]
            while i >= 0:
                first = model.dof[i, RUN]
                column = row + model.dof[first, DEPTH] - first
                for j in range(first, i + 1):
                    x[shift + j] -= L[column + j] * x_k
                i = model.dof[first, DOF_PARENT]
            k -= 1
    k = start
    while k < end:
        if is_of_free_body(model, k):
            k += 6
        else:
            row = model.dof[k, ROW]
            x_k = x[shift + k] * L[row + model.dof[k, DEPTH]]
            i = model.dof[k, DOF_PARENT]
            while i >= 0:
                first = model.dof[i, RUN]
                column = row + model.dof[first, DEPTH] - first
                for j in range(first, i + 1):
                    x_k -= L[column + j] * x[shift + j]
                i = model.dof[first, DOF_PARENT]
            x[shift + k] = x_k
            k += 1


@kernel
def is_of_free_body(model, k):
    return model.body[model.dof[k, DOF_BODY], KIND] == FREE


@kernel
def ltdl_solve_of_6(L, start, x, at):
    """Both substitutions of a free body; what hangs on it has been through the first, and comes to the second later."""
    a, b, c = x[at], x[at + 1], x[at + 2]
    d, e, f = x[at + 3], x[at + 4], x[at + 5]
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
    x[at], x[at + 1], x[at + 2] = a, b, c
    x[at + 3], x[at + 4], x[at + 5] = d, e, f


@kernel
def packed_times(model: TreeModel, M: Vector, x: Vector, y: Vector) -> None:
    """y = M x of a packed symmetric matrix; x and y, shape (nv,), are different arrays."""
    packed_times_span(model, M, 0, model.dof.shape[0], x, y)


@kernel
def packed_times_span(model: TreeModel, M: Vector, start: int, end: int, x: Vector, y: Vector) -> None:
    """The same for the dofs [start, end) of one tree or more; only these elements of x and y are touched."""
    for k in range(start, end):
        row = model.dof[k, ROW]
        y[k] = M[row + model.dof[k, DEPTH]] * x[k]
        i = model.dof[k, DOF_PARENT]
        while i >= 0:
            m = M[row + model.dof[i, DEPTH]]
            y[k] += m * x[i]
            y[i] += m * x[k]
            i = model.dof[i, DOF_PARENT]


@kernel
def unpack(model: TreeModel, M: Vector, dense: Matrix) -> None:
    """Writes a packed symmetric matrix into a zeroed one, shape (nv, nv)."""
    for k in range(model.dof.shape[0]):
        row = model.dof[k, ROW]
        i = k
        while i >= 0:
            m = M[row + model.dof[i, DEPTH]]
            dense[k, i] = m
            dense[i, k] = m
            i = model.dof[i, DOF_PARENT]
