"""What of the simulator itself kernels do: how steps of the continuous state, and watches, join the event loop."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._native.binding import HERE, Words, arguments_in_slab, join
from sheldrake.common._native.parallel import prepare
from sheldrake.common.kernel import Kernel
from sheldrake.systems.framework._kernels.program import PYTHON_STEP

if TYPE_CHECKING:
    from sheldrake.systems.analysis._span import Span


class Arguments:
    """What kernels of a span are called with, by the names of their parameters.

    Args:
        span: The event loop, which has `program_model`, `integrator`, `S`, `side` and `row_table`.
        values: Arrays, and NamedTuples of such.
        slab: What is in the slab: (begin, end) of a Vector, a list of these for Vectors.
    """

    def __init__(self, span: Span, values: Mapping[str, Any], slab: Mapping[str, Any]):
        store = span.store
        own = {"program_model": span.program, "integrator": span.numbers, "S": store.S, "side": store.side}
        self._values = {**values, **own, "row_table": span.table if span.native else span.python}
        self._slab, self.S = slab, store.S

    def words(self, kernel: Kernel) -> Words:
        """For a native call on the slab."""
        places: dict[str, Any] = {}
        for name in kernel.names:
            if name in self._slab:
                spans = self._slab[name]
                sized = [(a, b - a) for a, b in (spans if isinstance(spans, list) else [spans])]
                places[name] = sized if isinstance(spans, list) else sized[0]
            elif name in self._values:
                places[name] = self._values[name]
        return arguments_in_slab(kernel, places)

    def placed(self, words: Words) -> np.ndarray:
        """The words for the span's slab."""
        return words.placed(HERE, HERE.place(self.S))

    def call(self, kernel: Kernel) -> Callable[[], int]:
        """A call of the kernel's Python source."""
        found = [self._in_slab(name) if name in self._slab else self._values[name] for name in kernel.names]
        return lambda: kernel(*found) or 0

    def _in_slab(self, name: str) -> Any:
        spans = self._slab[name]
        return tuple(self.S[a:b] for a, b in spans) if isinstance(spans, list) else self.S[slice(*spans)]


def callees(
    span: Span, calls: Sequence[tuple[Kernel, Arguments]], functions: Sequence[Callable]
) -> tuple[Any, np.ndarray, np.ndarray]:
    """(table, words, at) with which a kernel of the span calls other kernels, and behind them Python functions.

    Call k is `call_row(table, k, t, slab, words, at[k])`; `at` has one element more than there are calls.
    """
    guarded = [span.guard(f) for f in functions]
    if not span.native:
        table = [*(arguments.call(kernel) for kernel, arguments in calls), *guarded]
        return table, np.zeros(1, np.int64), np.zeros(len(calls) + 1, int)
    words, at = join(arguments.words(kernel) for kernel, arguments in calls)
    addresses = [*(HERE.address(kernel) for kernel, _ in calls), *(span.address_of(f) for f in guarded)]
    return np.array(addresses, np.int64), words.placed(HERE, HERE.place(span.store.S)), np.array(at)


def set_step(span: Span, kernel: Kernel, arguments: Arguments) -> None:
    """Has a kernel make the steps of a span; it leaves a bad status in the side by itself."""
    set_special(span, PYTHON_STEP, kernel, arguments)


def set_special(span: Span, k: int, kernel: Kernel, arguments: Arguments) -> None:
    """Has a kernel do what is special row `k` of a span; it leaves a bad status in the side by itself."""
    if not span.native:
        span.set_special(k, arguments.call(kernel), None)
        return
    words, call = arguments.placed(arguments.words(kernel)), kernel.function

    def run() -> int:  # which keeps the arrays of the arguments while the span is there
        slab = arguments.S
        return call(slab[0], HERE.place(slab), HERE.place(words))

    span.set_special(k, run, (HERE.address(kernel), words))


__all__ = ["Arguments", "callees", "prepare", "set_special", "set_step"]
