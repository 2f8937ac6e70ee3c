"""State written from Python, output ports that are parts of it, and what stands for a motion that cannot be."""

import numpy as np

from sheldrake.common._kernels.vec import quaternion_of_rotation, read3, write3, write4
from sheldrake.common.kernel import IntVector, Matrix, Vector, kernel

# ---- state

LARGEST = np.finfo(np.float64).max


@kernel(top=True)
def write_finite(given: Vector, target: Vector, side: IntVector, room: IntVector, level: int) -> int:
    """Copies numbers into a context and counts the change as `Store.touch` would.

    Args:
        given: The numbers.
        target: Where they belong.
        side: The side of the context; its first three words are the counters of changes.
        room: See `Store.rooms`.
        level: Of the counter of the state.

    Returns:
        0, or 1 when a number is infinite or nan; nothing is written then.
    """
    for k in range(given.shape[0]):
        if not (given[k] >= -LARGEST and given[k] <= LARGEST):
            return 1
    for k in range(given.shape[0]):
        target[k] = given[k]
    count_change(side, room, level)
    return 0


@kernel(top=True)
def write_number(given: float, target: Vector, side: IntVector, room: IntVector, level: int) -> int:
    """`write_finite` of one number."""
    if not (given >= -LARGEST and given <= LARGEST):
        return 1
    target[0] = given
    count_change(side, room, level)
    return 0


@kernel(top=True)
def write_pose(R: Matrix, p: Vector, target: Vector, side: IntVector, room: IntVector, level: int) -> int:
    """`write_finite` of a pose, as a quaternion and a position."""
    for i in range(3):
        for k in range(3):
            if not (R[i, k] >= -LARGEST and R[i, k] <= LARGEST):
                return 1
        if not (p[i] >= -LARGEST and p[i] <= LARGEST):
            return 1
    R_FM = (R[0, 0], R[0, 1], R[0, 2], R[1, 0], R[1, 1], R[1, 2], R[2, 0], R[2, 1], R[2, 2])
    write4(target, 0, quaternion_of_rotation(R_FM))
    write3(target, 4, read3(p, 0))
    count_change(side, room, level)
    return 0


@kernel
def count_change(side, room, level):
    """What `Store.touch` does."""
    for k in range(level, 3):
        side[k] += 1
        room[k] += 1
    room[3] += 1


# ---- ports


@kernel(top=True)
def select_discrete_state(xd: Vector, select_model: IntVector, out: Vector) -> None:
    """The elements of the discrete state that belong to a model instance."""
    for i in range(out.shape[0]):
        out[i] = xd[select_model[i]]


@kernel(top=True)
def select_continuous_state(xc: Vector, select_model: IntVector, out: Vector) -> None:
    """The elements of the continuous state that belong to a model instance."""
    for i in range(out.shape[0]):
        out[i] = xc[select_model[i]]


GEOMETRY_NOT_CONNECTED, CONSTRAINTS_IN_CONTINUOUS_TIME = 121, 123


@kernel(top=True)
def refuse_without_geometry(p: Vector, out: Vector) -> int:
    """Takes no step: the plant has collision geometry, but nothing answers its geometry queries."""
    return GEOMETRY_NOT_CONNECTED


@kernel(top=True)
def refuse_constraints(p: Vector, out: Vector) -> int:
    """Gives no derivatives: the plant has constraints, which only the discrete step keeps."""
    return CONSTRAINTS_IN_CONTINUOUS_TIME
