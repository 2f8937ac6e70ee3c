"""What worlds are to do, and what they do it with."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.systems.framework._kernels.worlds import Rollout

_NOWHERE: Any = np.zeros(0, np.int64)


class RolloutPlan:
    """A rollout of worlds, in arrays that stay where they are: a kernel is bound to them once.

    Args:
        most: Worlds that may take part.
        state: Numbers of the state with which they begin anew; None: they go on.
        inputs_at: Places in the slab of the inputs, of each sample.
        outputs_at: Those of the outputs.
        rows: Output rows that compute them, in order.
        samples: Most samples.

    Attributes:
        rollout: The arrays, see `_kernels.worlds.Rollout`.
        calls: Kernels bound to them, see `NativeWorlds`.
    """

    def __init__(
        self,
        most: int,
        state: int | None = None,
        inputs_at: np.ndarray = _NOWHERE,
        outputs_at: np.ndarray = _NOWHERE,
        rows: list[int] | None = None,
        samples: int = 1,
    ):
        self.rows = rows or []
        self.calls: dict[Any, Any] = {}
        self.rollout = Rollout(
            who=np.zeros(most, np.int64),
            time=np.zeros((most, 4)),
            state=np.zeros((0 if state is None else most, state or 0)),
            inputs=np.zeros((most * samples if len(inputs_at) else 0, len(inputs_at))),
            inputs_at=inputs_at,
            outputs=np.zeros((most * samples if len(outputs_at) else 0, len(outputs_at))),
            outputs_at=outputs_at,
        )
