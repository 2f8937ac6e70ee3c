"""Numbers that depend on where a frame B is in a frame A, and how they change with velocities."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from sheldrake.common._kernels.vec import add3, compose, cross3, dot3, read3, rotate, scale3, sub3, transpose
from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector, kernel
from sheldrake.common.record import Record, integer, number, numbers, table
from sheldrake.multibody.tree._kernels.kinematics import from_root, pose_of_frame, relative_pose
from sheldrake.multibody.tree._kernels.model import TreeModel, TreeWork


class Between(Record):
    """Rows of bodies, and frames on them; frame -1 is the body frame."""

    body_A = integer("from where is seen")
    frame_A = integer("")
    body_B = integer("what is seen")
    frame_B = integer("")


class Form(Record):
    """constant + slope . d + d' square d + turn : R_AB, with d from a point S of A to a point Q of B, in A."""

    p_AS = numbers(3, "S", "m")
    p_BQ = numbers(3, "Q", "m")
    constant = number("")
    slope = numbers(3, "")
    square = numbers(9, "a symmetric matrix")
    turn = numbers(9, "what the elements of R_AB are multiplied with")


@table
class Forms(NamedTuple):
    """Forms, and between which frames they are."""

    between: Annotated[IntMatrix, Between]
    form: Annotated[Matrix, Form]


@kernel
def inner9(A, B):
    """The sum of the products of elements of two matrices."""
    total = 0.0
    for k in range(9):
        total += A[k] * B[k]
    return total


@kernel
def value_of(form, R_AB, d):
    square = dot3(d, rotate(form.square, d))
    return form.constant + dot3(form.slope, d) + square + inner9(form.turn, R_AB)


@kernel
def poses_of(model, p, work, form):
    """X_WA, and X_AB."""
    X_WA = pose_of_frame(model, p, work, form.body_A, form.frame_A)
    return X_WA, relative_pose(X_WA, pose_of_frame(model, p, work, form.body_B, form.frame_B))


@kernel
def from_S_to_Q(form, X_AB):
    R_AB, p_AB = X_AB
    return sub3(add3(p_AB, rotate(R_AB, form.p_BQ)), form.p_AS)


@kernel(top=True, short_loops=True)
def form_values(model: TreeModel, p: Vector, work: TreeWork, forms: Forms, values: Vector) -> None:
    """Values of forms, shape (forms,); needs `position_kinematics`."""
    for i in range(len(values)):
        form = forms[i]
        _, X_AB = poses_of(model, p, work, form)
        R_AB, _ = X_AB
        values[i] = value_of(form, R_AB, from_S_to_Q(form, X_AB))


@kernel(top=True, short_loops=True)
def form_slopes(model: TreeModel, p: Vector, work: TreeWork, forms: Forms, found: Matrix) -> None:
    """Values of forms, then their derivatives by each v, shape (forms, 1 + nv); needs `position_kinematics`."""
    for i in range(found.shape[0]):
        form = forms[i]
        X_WA, X_AB = poses_of(model, p, work, form)
        (R_WA, p_WA), (R_AB, _) = X_WA, X_AB
        d = from_S_to_Q(form, X_AB)
        for k in range(found.shape[1]):
            found[i, k] = 0.0
        found[i, 0] = value_of(form, R_AB, d)
        # The value changes as the power of a force at Q and of a torque: those that B and, against them, A feel.
        force_W = rotate(R_WA, add3(form.slope, scale3(rotate(form.square, d), 2.0)))
        torque_W = rotate(R_WA, axial(compose(form.turn, transpose(R_AB))))
        p_WQ = add3(p_WA, rotate(R_WA, add3(d, form.p_AS)))
        add_power(model, work, form.body_B, p_WQ, force_W, torque_W, 1.0, found, i)
        add_power(model, work, form.body_A, p_WQ, force_W, torque_W, -1.0, found, i)


@kernel(top=True, short_loops=True)
def distance_slope(model: TreeModel, work: TreeWork, bodies: IntVector, nearest: Vector, slope: Vector) -> None:
    """By each v, how the distance of two bodies changes; needs `position_kinematics`.

    Args:
        model: The tree.
        work: Its workspace.
        bodies: Rows of A and B.
        nearest: p_WCa and p_WCb, where they are nearest [m], and nhat_BA_W, shape (9,).
        slope: Filled, shape (nv,).
    """
    for k in range(len(slope)):
        slope[k] = 0.0
    nhat_W = read3(nearest, 6)
    add_along(model, work, bodies[0], read3(nearest, 0), nhat_W, 1.0, slope)
    add_along(model, work, bodies[1], read3(nearest, 3), nhat_W, -1.0, slope)


@kernel
def add_along(model, work, b, p_WQ, n_W, sign, slope):
    """Adds, by each v, sign times the velocity along n of the point Q of body b."""
    torque_Root = cross3(from_root(model, work, b, p_WQ), n_W)
    k = model.bodies[b].tip
    while k >= 0:
        w, u = work.dofs[k].S
        slope[k] += sign * (dot3(w, torque_Root) + dot3(u, n_W))
        k = model.dofs[k].parent


@kernel
def axial(N):
    """The torque t whose power w . t is that of N, the sum of N_ij [w]_ij."""
    return (N[7] - N[5], N[2] - N[6], N[3] - N[1])


@kernel
def add_power(model, work, b, p_WQ, force_W, torque_W, sign, found, i):
    """Adds to row i, by each v, sign times the power of a force at Q and of a torque, both on body b."""
    torque_Root = add3(torque_W, cross3(from_root(model, work, b, p_WQ), force_W))
    k = model.bodies[b].tip
    while k >= 0:
        w, u = work.dofs[k].S
        found[i, 1 + k] += sign * (dot3(w, torque_Root) + dot3(u, force_W))
        k = model.dofs[k].parent
