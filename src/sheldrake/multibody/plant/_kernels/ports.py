"""State written from Python, output ports that are parts of it, and what stands for a motion that cannot be."""

import numpy as np

from sheldrake.common.kernel import IntVector, Vector, kernel

# ---- state

LARGEST = np.finfo(np.float64).max


@kernel(top=True)
def write_finite(
    given: Vector, target: Vector, changes: IntVector, from_python: IntVector, written: IntVector, level: int
) -> int:
    """Copies numbers into a context and counts the change as `Store.touch` would.

    Returns:
        0, or 1 when a number is infinite or nan; nothing is written then.
    """
    for k in range(given.shape[0]):
        if not (given[k] >= -LARGEST and given[k] <= LARGEST):
            return 1
    for k in range(given.shape[0]):
        target[k] = given[k]
    for k in range(level, 3):
        changes[k] += 1
        from_python[k] += 1
    from_python[3] += 1
    written[0] += 1
    return 0


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
