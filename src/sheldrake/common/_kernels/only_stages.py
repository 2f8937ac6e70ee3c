"""Queries that ask for nothing but what stages leave."""

from __future__ import annotations

from sheldrake.common.kernel import IntVector, Vector, kernel


@kernel(top=True)
def only_stages(counter: IntVector) -> None:
    """Does nothing itself."""


@kernel(top=True)
def copy_numbers(numbers: Vector, out: Vector) -> None:
    """Copies numbers."""
    for k in range(out.shape[0]):
        out[k] = numbers[k]
