"""Queries of a context of AutoDiffXd: the kernels' machine code on complex numbers, one run a partial derivative.

The machine code is taken when it is ready, or when it has been asked for so often that compiling it pays; until then
the kernels run as Python on the duals themselves. Both give the same numbers to round-off.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.autodiffutils._complex_step import Source, Sweep, sweep_sources
from sheldrake.autodiffutils._matrices import filled
from sheldrake.common._kernels.only_stages import only_stages
from sheldrake.common._native import store as kernel_store
from sheldrake.common._native.binding import HERE, imaginary_parts
from sheldrake.common.calls import Calls, Query
from sheldrake.common.kernel import MISFIT, Kernel, jit_enabled

if TYPE_CHECKING:
    from sheldrake.common._types import KernelArgument


_NUMBERS = 800
"""As Python kernels take some 0.2 ms a number of the state: so many of these are about as much as compiling one."""


class DualCalls:
    """`Calls` on arrays of AutoDiffXd.

    Args:
        counter: Changes whenever what the stages read was written.
        constants: Changes whenever the parameters were written.
        x: Positions and velocities.
        p: Parameters.
        views: Parts of x, which kernels take.
        refuse: As `Calls` takes it.
    """

    def __init__(
        self,
        counter: np.ndarray,
        constants: np.ndarray,
        x: np.ndarray,
        p: np.ndarray,
        views: tuple[np.ndarray, ...],
        refuse: Callable[[], Any],
    ):
        self._plain = Calls(counter, native=False, refuse=refuse)
        self._patience = _NUMBERS // max(len(x), 1)  # calls as Python before machine code is made
        x_complex, p_complex = np.zeros(x.shape, complex), np.zeros(p.shape, complex)
        self._complex: dict[int, Any] = {id(x): x_complex, id(p): p_complex}
        self._sources = {id(p): [Source(p, constants, p_complex)]}
        for view in views:
            start = _offset(view, x)
            part = self._complex[id(view)] = x_complex[start : start + len(view)]
            self._sources[id(view)] = [Source(view, counter, part)]
        self._sources[id(x)] = [s for view in views for s in self._sources[id(view)]]
        self._keep: list[Any] = [x, p, views]
        self._stages: list[tuple[Kernel, tuple]] = []
        self._results: dict[tuple[int, int], Query] = {}

    def stage(self, kernel: Kernel, *args: KernelArgument) -> int:
        """As `Calls.stage`."""
        self._stages.append((kernel, args))
        return self._plain.stage(kernel, *args)

    def stages(self, needs: int, answer: np.ndarray | None = None, frozen: bool = False) -> Query:
        """As `Calls.stages`."""
        if answer is None:
            return self._plain.stages(needs)
        ask = self.query(only_stages, np.zeros(1, np.int64), needs=needs, answer=answer)

        def copy() -> np.ndarray:
            new = ask()
            new.setflags(write=not frozen)
            return new

        return copy

    def results(self, needs: int, work: Any) -> Results:
        """What stages leave in a workspace."""
        return Results(self, needs, work)

    def result(self, needs: int, array: np.ndarray) -> np.ndarray:
        """What stages leave in an array."""
        ask = self._results.get((needs, id(array)))
        if ask is None:
            ask = self._results[needs, id(array)] = self.stages(needs, answer=array)
            self._keep.append(array)
        return ask()

    def query(
        self,
        kernel: Kernel,
        *args: KernelArgument,
        given: tuple[str, ...] = (),
        needs: int = 0,
        answer: np.ndarray | None = None,
    ) -> Query:
        """As `Calls.query`; the given arrays hold numbers or duals."""
        plain = self._plain.query(kernel, *args, given=given, needs=needs, answer=answer)
        if answer is None or not jit_enabled():
            return plain
        kernels = [kernel, *(k for k, _ in self._needed(needs))]
        can = kernel_store.can_compile()
        calls, ready = 0, all(kernel_store.is_ready(k.on_complex) for k in kernels)
        quick: Callable[..., Any] | None = None

        def ask(*arrays: Any) -> Any:
            nonlocal calls, quick
            if quick is None:
                calls += 1
                if not ready and (calls <= self._patience or not can):
                    return plain(*arrays)
                quick = self._quick(plain, kernel, args, given, needs, answer)
            return quick(*arrays)

        return ask

    def _needed(self, needs: int) -> list[tuple[Kernel, tuple]]:
        return [stage for i, stage in enumerate(self._stages) if needs >> i & 1]

    def _quick(
        self, plain: Query, kernel: Kernel, args: tuple, given: tuple[str, ...], needs: int, answer: np.ndarray
    ) -> Callable[..., Any]:
        inputs = [Source(np.zeros(args[kernel.names.index(name)].shape)) for name in given]
        others = {name: i.numbers for name, i in zip(given, inputs)}
        on_complex = tuple(others[n] if n in others else self._complex_of(a) for n, a in zip(kernel.names, args))
        stages = [(stage, tuple(self._complex_of(a) for a in arguments)) for stage, arguments in self._needed(needs)]
        read = [a for _, arguments in [*self._needed(needs), (kernel, args)] for a in arguments]
        sources = [s for i, several in self._sources.items() if any(id(a) == i for a in read) for s in several]
        sources = [*dict.fromkeys(sources), *inputs]
        out = self._complex_of(answer)
        sweep = Sweep([*stages, (kernel, on_complex)], imaginary_parts(out))
        constants = [a for a in args if isinstance(a, np.ndarray) and a.dtype != object]
        if not inputs and (kernel is only_stages or not constants):
            return self._kept(plain, sweep, sources, out)

        def ask(*arrays: Any) -> Any:
            if len(arrays) != len(inputs):
                return MISFIT
            for source, array in zip(inputs, arrays):
                if type(array) is not np.ndarray or array.shape != source.duals.shape:
                    return MISFIT
                if array.dtype not in (float, object):
                    return MISFIT
                source.duals = array
            slopes = sweep_sources(sweep, sources)
            if slopes is None or isinstance(slopes, int):
                return plain(*arrays)  # which says what is wrong
            return filled(out.real, slopes)

        return ask

    @staticmethod
    def _kept(plain: Query, sweep: Sweep, sources: list[Source], out: np.ndarray) -> Callable[[], np.ndarray]:
        """A query without given arrays, which gives what it gave before as long as no source has changed."""
        counters = [source.counter for source in sources if source.counter is not None]
        seen: list[Any] = []
        kept = out

        def ask() -> np.ndarray:
            nonlocal seen, kept
            now = [counter.item() for counter in counters]
            if seen != now:
                slopes = sweep_sources(sweep, sources)
                if slopes is None or isinstance(slopes, int):
                    return plain()  # which says what is wrong
                kept, seen = filled(out.real, slopes), now
            return kept.copy()

        return ask

    def _complex_of(self, argument: object) -> Any:
        """The complex array, or workspace, that stands for an argument."""
        if isinstance(argument, tuple):
            if all(a.dtype != object for a in argument):
                return argument  # a model
            if id(argument) not in self._complex:
                self._complex[id(argument)] = type(argument)(*(self._complex_of(a) for a in argument))
                self._keep.append(argument)
            return self._complex[id(argument)]
        if not isinstance(argument, np.ndarray) or argument.dtype != object:
            return argument
        if id(argument) not in self._complex and isinstance(argument.base, np.ndarray):
            start = _offset(argument, argument.base)  # all views are contiguous parts
            part = self._complex_of(argument.base).reshape(-1)[start : start + argument.size]
            self._complex[id(argument)] = part.reshape(argument.shape)
            self._keep.append(argument)
        if id(argument) not in self._complex:
            values = [complex(getattr(a, "_v", a)) for a in argument.flat]
            self._complex[id(argument)] = np.array(values, complex).reshape(argument.shape)
            self._keep.append(argument)
        return self._complex[id(argument)]


class Results:
    """What stages would leave in a workspace of duals: each array is computed when it is first read."""

    def __init__(self, calls: DualCalls, needs: int, work: Any):
        self._calls, self._needs, self._work = calls, needs, work

    def __getattr__(self, name: str) -> Any:
        if name not in self._work._fields:
            return getattr(type(self._work), name).fget(self)  # of a record
        found = self._calls.result(self._needs, getattr(self._work, name))
        self.__dict__[name] = found
        return found

    def __getitem__(self, i: int) -> Any:
        return type(self._work).__getitem__(self, i)


def _offset(view: np.ndarray, of: np.ndarray) -> int:
    return (HERE.place(view) - HERE.place(of)) // of.itemsize
