"""What would move a context's memory while something is computed in it, and so waits."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

from sheldrake.common.value import AbstractValue

if TYPE_CHECKING:
    from sheldrake.systems.framework._engine.store import Store


@dataclasses.dataclass
class Waiting:
    """Calls that `Store.settle` carries out.

    Attributes:
        inputs: Values that connected input ports are fixed to, by node and number.
        structure: A system changed what its `_structure_in` says.
        samples: Samples for which a log had no room: log, how many samples it had then, time [s], value.
        room: How many samples a log must have room for, by log.
    """

    inputs: dict[tuple[int, int], Any] = dataclasses.field(default_factory=dict)
    structure: bool = False
    samples: list[tuple[int, int, Any, Any]] = dataclasses.field(default_factory=list)
    room: dict[int, int] = dataclasses.field(default_factory=dict)

    def move_logs(self, store: Store) -> None:
        """Makes room in the logs, and puts samples where they belong."""
        if self.samples or self.room:
            from sheldrake.systems.framework._engine import logs  # it imports the store

            logs.catch_up(store, self.samples, self.room)

    def copy(self) -> Waiting:
        """An independent copy."""
        inputs = {k: v.Clone() if isinstance(v, AbstractValue) else v.copy() for k, v in self.inputs.items()}
        return Waiting(inputs, self.structure, list(self.samples), dict(self.room))
