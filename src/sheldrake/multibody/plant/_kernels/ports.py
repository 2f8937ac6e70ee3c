"""Values of output ports that are parts of the state, and what stands for a motion that cannot be."""

from __future__ import annotations

from sheldrake.common.kernel import IntVector, Vector, kernel


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
