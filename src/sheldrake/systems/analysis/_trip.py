"""What worlds are to do, and what they do it with."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.systems.framework._kernels.worlds import Trip

_NOWHERE: Any = np.zeros(0, np.int64)


class Ride:
    """A trip of worlds, in arrays that stay where they are: a kernel is bound to them once.

    Args:
        most: Worlds that may take part.
        state: Numbers of the state with which they begin anew; None: they go on.
        given_at: Places in the slab of the inputs, of each sample.
        kept_at: Those of the outputs.
        rows: Output rows that compute them, in order.
        samples: Most samples.

    Attributes:
        trip: The arrays, see `_kernels.worlds.Trip`.
        calls: Kernels bound to them, see `NativeWorlds`.
    """

    def __init__(
        self,
        most: int,
        state: int | None = None,
        given_at: np.ndarray = _NOWHERE,
        kept_at: np.ndarray = _NOWHERE,
        rows: list[int] | None = None,
        samples: int = 1,
    ):
        self.rows = rows or []
        self.calls: dict[Any, Any] = {}
        self.trip = Trip(
            who=np.zeros(most, np.int64),
            time=np.zeros((most, 4)),
            state=np.zeros((0 if state is None else most, state or 0)),
            given=np.zeros((most * samples if len(given_at) else 0, len(given_at))),
            given_at=given_at,
            kept=np.zeros((most * samples if len(kept_at) else 0, len(kept_at))),
            kept_at=kept_at,
        )
