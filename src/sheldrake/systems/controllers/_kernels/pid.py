"""PID control: u = O (kp e_q + ki integral(e_q) + kd e_v), (e_q, e_v) = x_desired - P x."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from sheldrake.common.kernel import IntVector, Matrix, Vector, Vectors, kernel
from sheldrake.common.record import Record, Stack, integer, table, vector


class Gains(Stack):
    """Of each controlled position."""

    kp = vector("proportional")
    ki = vector("integral", "1/s")
    kd = vector("derivative", "s")


class Projections(Record):
    """Which there are."""

    projects_state = integer("1: P is other than the identity")
    projects_output = integer("1: O is other than the identity")


@table
class Pid(NamedTuple):
    """Gains and projections of a PID controller.

    P: controlled state from the state, shape (2 n, num_states).
    O: outputs from the controls of positions, shape (num_outputs, n).
    """

    gains: Annotated[Matrix, Gains]
    P: Matrix
    O: Matrix
    projects: Annotated[IntVector, Projections]


@kernel
def error(model: Pid, u: Vectors, i: int) -> float:
    """Element i of x_desired - P x."""
    e = u[1][i]
    if model.projects_state == 1:
        for j in range(model.P.shape[1]):
            e -= model.P[i, j] * u[0][j]
    else:
        e -= u[0][i]
    return e


@kernel
def effort(model: Pid, xc: Vector, u: Vectors, i: int) -> float:
    """What the law gives for controlled position i."""
    e_q = error(model, u, i)
    e_v = error(model, u, i + model.gains.shape[1])
    return model.kp[i] * e_q + model.ki[i] * xc[i] + model.kd[i] * e_v


@kernel(top=True, short_loops=True)
def control(model: Pid, xc: Vector, u: Vectors, y: Vector) -> None:
    """The control; the inputs are the state and the desired state."""
    n = model.gains.shape[1]
    if model.projects_output == 1:
        for k in range(y.shape[0]):
            y[k] = 0.0
        for i in range(n):
            effort_i = effort(model, xc, u, i)
            for k in range(y.shape[0]):
                y[k] += model.O[k, i] * effort_i
    else:
        for i in range(n):
            y[i] = effort(model, xc, u, i)


@kernel(top=True, short_loops=True)
def integral(model: Pid, u: Vectors, xdot: Vector) -> None:
    """Derivative of the integral of the error in position."""
    for i in range(xdot.shape[0]):
        xdot[i] = error(model, u, i)
