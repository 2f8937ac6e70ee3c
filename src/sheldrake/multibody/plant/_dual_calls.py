"""Queries of a context of AutoDiffXd: the kernels' machine code on complex numbers, one run a partial derivative.

The machine code is taken when it is ready, or when it has been asked for so often that compiling it pays; until then
the kernels run as Python on the duals themselves. Both give the same numbers to round-off.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from sheldrake.autodiffutils._complex_step import PATIENCE, Directions, duals_of
from sheldrake.common._kernels.only_stages import only_stages
from sheldrake.common._native import store as kernel_store
from sheldrake.common.calls import Calls, Query
from sheldrake.common.kernel import MISFIT, Kernel, jit_enabled


class DualCalls:
    """`Calls` on arrays of AutoDiffXd.

    Args:
        counter: Changes whenever what the stages read was written.
        constants: Changes whenever the parameters were written.
        x: Positions and velocities.
        p: Parameters.
        views: Parts of x, which kernels take.
    """

    def __init__(
        self, counter: np.ndarray, constants: np.ndarray, x: np.ndarray, p: np.ndarray, views: tuple[np.ndarray, ...]
    ):
        self._plain = Calls(counter, native=False)
        self._inputs = [Directions(x, counter), Directions(p, constants)]
        self._twins: dict[int, Any] = {id(i.duals): i.numbers for i in self._inputs}
        for view in views:
            start = _offset(view, x)
            self._twins[id(view)] = self._inputs[0].numbers[start : start + len(view)]
        self._keep: list[Any] = [x, p, views]
        self._tick = np.zeros(1, np.int64)
        self._stage_arguments: list[tuple[Kernel, tuple]] = []
        self._complex: Calls | None = None

    def stage(self, kernel: Kernel, *args: Any) -> int:
        """As `Calls.stage`."""
        self._stage_arguments.append((kernel, args))
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

    def query(
        self,
        kernel: Kernel,
        *args: Any,
        given: tuple[str, ...] = (),
        needs: int = 0,
        answer: np.ndarray | None = None,
    ) -> Query:
        """As `Calls.query`; the given arrays hold numbers or duals."""
        plain = self._plain.query(kernel, *args, given=given, needs=needs, answer=answer)
        if answer is None or not jit_enabled():
            return plain
        kernels = [kernel, *(k for k, _ in self._stage_arguments)]
        can = kernel_store.can_compile()
        calls, ready = 0, can and all(kernel_store.is_ready(k.on_complex) for k in kernels)
        quick: Callable[..., Any] | None = None

        def ask(*arrays: Any) -> Any:
            nonlocal calls, quick
            if quick is None:
                calls += 1
                if not ready and (calls <= PATIENCE or not can):
                    return plain(*arrays)
                quick = self._quick(plain, kernel, args, given, needs, answer)
            return quick(*arrays)

        return ask

    def _quick(
        self, plain: Query, kernel: Kernel, args: tuple, given: tuple[str, ...], needs: int, answer: np.ndarray
    ) -> Callable[..., Any]:
        if self._complex is None:
            self._complex = Calls(self._tick)
            for stage, arguments in self._stage_arguments:
                self._complex.stage(stage.on_complex, *(self._twin(a) for a in arguments))
        inputs = [Directions(np.zeros(args[kernel.names.index(name)].shape)) for name in given]
        others = {name: i.numbers for name, i in zip(given, inputs)}
        twins = [others[n] if n in others else self._twin(a) for n, a in zip(kernel.names, args)]
        run, out = self._complex.query(kernel.on_complex, *twins, needs=needs), self._twin(answer)
        sources = [*self._inputs, *inputs]

        def ask(*arrays: Any) -> Any:
            if len(arrays) != len(inputs):
                return MISFIT
            for source, array in zip(inputs, arrays):
                if type(array) is not np.ndarray or array.shape != source.duals.shape:
                    return MISFIT
                if array.dtype not in (float, object):
                    return MISFIT
                source.duals, source.seen = array, None
            n = max(source.gather() for source in sources)
            if any(source.n not in (0, n) for source in sources):
                return plain(*arrays)  # which says what is wrong
            slopes = np.zeros((out.size, n))
            moving = {k for source in sources for k in source.moving()}
            for k in sorted(moving) or [0]:
                for source in sources:
                    source.set(k)
                self._tick[0] += 1
                if status := run():
                    return status
                if n:
                    slopes[:, k] = out.imag.ravel()
            return duals_of(out.real, slopes)

        return ask

    def _twin(self, argument: Any) -> Any:
        """The complex array, or workspace, that stands for an argument."""
        if isinstance(argument, tuple):
            if all(a.dtype != object for a in argument):
                return argument  # a model
            if id(argument) not in self._twins:
                self._twins[id(argument)] = type(argument)(*(self._twin(a) for a in argument))
                self._keep.append(argument)
            return self._twins[id(argument)]
        if not isinstance(argument, np.ndarray) or argument.dtype != object:
            return argument
        if id(argument) not in self._twins and isinstance(argument.base, np.ndarray):
            start = _offset(argument, argument.base)  # all views are contiguous parts
            part = self._twin(argument.base).reshape(-1)[start : start + argument.size]
            self._twins[id(argument)] = part.reshape(argument.shape)
            self._keep.append(argument)
        if id(argument) not in self._twins:
            values = [complex(getattr(a, "_v", a)) for a in argument.flat]
            self._twins[id(argument)] = np.array(values, complex).reshape(argument.shape)
            self._keep.append(argument)
        return self._twins[id(argument)]


def _offset(view: np.ndarray, of: np.ndarray) -> int:
    address = [a.__array_interface__["data"][0] for a in (view, of)]
    return (address[0] - address[1]) // of.itemsize
