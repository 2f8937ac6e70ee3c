"""LᵀDL factorisation and products with packed matrices (Featherstone 2008, section 6.5; layout in `model`)."""

from __future__ import annotations

from sheldrake.common._kernels.generic import is_positive
from sheldrake.common.kernel import Matrix, Vector, kernel
from sheldrake.multibody.tree._kernels.model import DEPTH, DOF_BODY, DOF_PARENT, FREE, KIND, ROW, TreeModel


@kernel
def ltdl(model: TreeModel, L: Vector) -> int:
    """Replaces a packed symmetric matrix by its factor: 1/D on the diagonal, the unit lower triangle below it.

    Returns:
        -1, or the dof whose pivot is not positive (the factor is then of no use).
    """
    bad = -1
    k = model.dof.shape[0] - 1
    while k >= 0:
        if model.body[model.dof[k, DOF_BODY], KIND] == FREE:
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
                a = L[row_k + depth] * r
                for j in range(depth + 1):
                    L[row_i + j] -= a * L[row_k + j]
                L[row_k + depth] = a
                i = model.dof[i, DOF_PARENT]
            k -= 1
    return bad


@kernel
def ltdl_of_6(L, start):
    """The six rows of a free body, with constant bounds so that the compiler unrolls all of it."""
    bad = -1
    for k in range(5, -1, -1):
        row_k = start + k * (k + 1) // 2
        if not is_positive(L[row_k + k]):
            bad = k
        r = 1.0 / L[row_k + k]
        L[row_k + k] = r
        for i in range(k - 1, -1, -1):
            row_i = start + i * (i + 1) // 2
            a = L[row_k + i] * r
            for j in range(i + 1):
                L[row_i + j] -= a * L[row_k + j]
            L[row_k + i] = a
    return bad


@kernel
def ltdl_solve(model: TreeModel, L: Vector, x: Vector) -> None:
    """Replaces x, shape (nv,), by the solution of the factored matrix times itself = x."""
    ltdl_solve_span(model, L, 0, model.dof.shape[0], x, 0)


@kernel
def ltdl_solve_span(model: TreeModel, L: Vector, start: int, end: int, x: Vector, at: int) -> None:
    """The same for the dofs of one tree or more, [start, end); dof k is at x[k - start + at]."""
    shift = at - start
    for k in range(end - 1, start - 1, -1):
        row = model.dof[k, ROW]
        x_k = x[shift + k]
        i = model.dof[k, DOF_PARENT]
        while i >= 0:
            x[shift + i] -= L[row + model.dof[i, DEPTH]] * x_k
            i = model.dof[i, DOF_PARENT]
    for k in range(start, end):
        row = model.dof[k, ROW]
        x_k = x[shift + k] * L[row + model.dof[k, DEPTH]]
        parent = model.dof[k, DOF_PARENT]
        if parent >= 0:
            i = model.dof[parent, DOF_PARENT]
            while i >= 0:
                x_k -= L[row + model.dof[i, DEPTH]] * x[shift + i]
                i = model.dof[i, DOF_PARENT]
            x_k -= L[row + model.dof[parent, DEPTH]] * x[shift + parent]  # last: it was computed just before
        x[shift + k] = x_k


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
