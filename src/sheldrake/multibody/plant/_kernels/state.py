"""Writing state from Python."""

from __future__ import annotations

import numpy as np

from sheldrake.common.kernel import IntVector, Vector, kernel

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
