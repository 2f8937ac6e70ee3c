"""A query that asks for nothing but its stages."""

from __future__ import annotations

from sheldrake.common.kernel import IntVector, kernel


@kernel(top=True)
def only_stages(counter: IntVector) -> None:
    """Does nothing itself."""
