"""Values of output ports that are parts of the state."""

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
