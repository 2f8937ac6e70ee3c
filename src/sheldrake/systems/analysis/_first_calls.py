"""What Python rows cost, measured on their first calls."""

from __future__ import annotations

import time
import weakref
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sheldrake.systems.analysis._span import Span

MOST = 64


class FirstCalls:
    """Times the first calls of a row, then has the span call the row itself: later calls cost what they did before.

    Attributes:
        seconds: what each of the first calls took [s].

    Args:
        run: the row.
        span: has `call_directly(r)`; not kept alive.
        r: the row's number.
    """

    def __init__(self, run: Callable[[], int], span: Span, r: int):
        self.run, self._span, self._r = run, weakref.ref(span), r
        self.seconds: list[float] = []

    def __call__(self) -> int:
        begin = time.perf_counter()
        result = self.run()
        self.seconds.append(time.perf_counter() - begin)
        if len(self.seconds) >= MOST and (span := self._span()) is not None:
            span.call_directly(self._r)
        return result
