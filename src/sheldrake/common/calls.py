"""Queries: kernels on fixed arrays, called from Python again and again, after stages that they need.

A query is a function of few arrays, or of none, that gives a status. Natively it is a builtin function of Python; on
duals and symbols, or with kernels as plain Python, a closure that does the same.
"""

from __future__ import annotations

import functools
import types
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._kernels.only_stages import only_stages
from sheldrake.common._native import builtin
from sheldrake.common._native.binding import HERE, arguments, first_words
from sheldrake.common.kernel import MISFIT, Kernel, jit_enabled

if TYPE_CHECKING:
    from sheldrake.common._native.templates import Templates
    from sheldrake.common._types import KernelArgument

Query = Callable[..., Any]


class Calls:
    """Queries on one set of arrays. Stages are computed when a query needs them and kept until the counter changes.

    Args:
        counter: One integer, shape (1,), that changes whenever what the stages read was written.
        native: False runs kernels as Python, on arrays of any scalar.
        refuse: Raises the error of a stage that gives a status; without it, queries give that status.
        templates: What was bound on other sets of arrays of the same shapes, and is taken for this one.
        packed: A NamedTuple that is among the arguments of many queries, and the memory that has all its arrays.
    """

    def __init__(
        self,
        counter: np.ndarray,
        native: bool = True,
        refuse: Callable[[], Any] | None = None,
        templates: Templates | None = None,
        packed: tuple[Any, Any] = (None, None),
    ):
        self.native, self._refuse = native and jit_enabled(), refuse
        self._counter, self._kept = counter, np.array([-1, 0], np.int64)
        self._templates, self._packed = templates if self.native else None, packed
        self._stages: list[tuple[Kernel, tuple]] = []
        self._runs: dict[int, Callable[[], int]] = {}
        self._blocks: dict = {}  # what kernels on the same NamedTuples have in common
        self._open_blocks: dict = {}  # the same with relocations

    def stage(self, kernel: Kernel, *args: KernelArgument) -> int:
        """Adds a stage; stages run in the order in which they were added.

        It is compiled when a query first needs it: a program that asks for poses does not wait for velocities.

        Returns:
            The bit that stands for it in what a query needs. All stages come before the first query.
        """
        self._stages.append((kernel, args))
        return 1 << (len(self._stages) - 1)

    @functools.cached_property
    def _table(self) -> np.ndarray:
        """Of each stage its bit, its function and the address of its words, once it is bound."""
        return np.array([word for i in range(len(self._stages)) for word in (1 << i, 0, 0)], np.int64)

    @functools.cached_property
    def _own(self) -> tuple[int, int, int]:
        """Words 7 to 9 of the block of every query."""
        return HERE.place(self._counter), HERE.place(self._kept), HERE.place(self._table)

    def _bind_stages(self, needs: int) -> None:
        """Makes those stages among `needs` that no query has needed before."""
        for i, (kernel, args) in enumerate(self._stages):
            bit = 1 << i
            if not needs & bit or bit in self._runs:
                continue
            if not self.native:
                self._runs[bit] = _plain_run(kernel, args)
                continue
            words = self._stage_words(kernel, args)
            self._runs[bit] = _native_run(kernel, args, words)
            self._table[3 * i + 1 : 3 * i + 3] = HERE.address(kernel), HERE.place(words)

    def _stage_words(self, kernel: Kernel, args: tuple) -> np.ndarray:
        templates = self._templates
        if templates is None or (sites := templates.sites(args, self._packed)) is None:
            return arguments(kernel, args, self._blocks, HERE)[0].words
        key = kernel, sites.common
        words = templates.filled(key, sites.begins)
        if words is None:
            described = arguments(kernel, args, self._open_blocks)[0]
            words = described.placed()
            templates.keep(key, words, described, sites)
        return words

    def query(
        self,
        kernel: Kernel,
        *args: KernelArgument,
        given: tuple[str, ...] = (),
        needs: int = 0,
        answer: np.ndarray | None = None,
        frozen: bool = False,
    ) -> Query:
        """A query.

        Args:
            kernel: An entry kernel.
            args: Its arguments; of those in `given` only the shape counts, and zero axes of a float or int's array.
            given: Names of the floats and float64 arrays that each call brings, in the order of the call. They are
                only read.
            needs: Bits of the stages that must be up to date.
            answer: An array that the kernel fills and of which each call gives a copy, when its status is 0.
            frozen: Whether that copy is read-only.

        Returns:
            A function that gives the answer or else a status, an int: the kernel's, or MISFIT, and then nothing has
            run, when an argument is not a float (NumPy's is one) or a C-contiguous float64 array of its shape.
        """
        self._bind_stages(needs)
        if self.native:
            if builtin.available():
                return self._builtin(kernel, args, given, needs, answer, frozen)
        make = self._through_ctypes if self.native else self._interpreted
        ask = make(kernel, args, given, needs)
        if answer is None:
            return ask

        def copy() -> np.ndarray:
            new = answer.copy()
            new.setflags(not frozen)
            return new

        return lambda *arrays: ask(*arrays) or copy()

    def stages(self, needs: int, answer: np.ndarray | None = None, frozen: bool = False) -> Query:
        """A query that brings stages up to date and does nothing else; `answer` and `frozen` as in `query`."""
        return self.query(only_stages, self._counter, needs=needs, answer=answer, frozen=frozen)

    def update(self, needs: int) -> int:
        """Brings stages up to date, for what reads their results without a query; a status."""
        kept, now = self._kept, self._counter[0]
        if kept[0] != now:
            kept[:] = now, 0
        for i in range(len(self._stages)):
            bit = 1 << i
            if needs & bit & ~int(kept[1]):
                self._bind_stages(bit)
                if status := self._runs[bit]():
                    return self._refuse() if self._refuse else status
                kept[1] |= bit
        return 0

    def outdate(self) -> None:
        """Makes all stages old: their arrays were used for something else, or the model changed."""
        self._kept[1] = 0

    def _builtin(
        self, kernel: Kernel, args: tuple, given: tuple[str, ...], needs: int, answer: np.ndarray | None, frozen: bool
    ) -> Query:
        templates = self._templates
        if templates is None or (sites := templates.sites(args, self._packed)) is None:
            words = arguments(kernel, args, self._blocks, HERE)[0].words
            block = self._block(kernel, args, given, needs, frozen, words)
        else:
            key = kernel, given, needs, frozen, sites.common
            known = templates.filled(key, sites.begins)
            if known is None:
                described = arguments(kernel, args, self._open_blocks)[0]
                block = self._block(kernel, args, given, needs, frozen, described.placed())
                templates.keep(key, block, described, sites)
            else:
                block = known
        block[7:10] = self._own
        block[12] = 0 if answer is None else id(answer)
        block[15] = 0 if self._refuse is None else id(self._refuse)
        return builtin.make(block, (self, args, answer))

    def _block(
        self, kernel: Kernel, args: tuple, given: tuple[str, ...], needs: int, frozen: bool, words: np.ndarray
    ) -> np.ndarray:
        """The block of a builtin function, but for what is of these calls; at its end the kernel's words."""
        first = builtin.HEAD + builtin.PER_ARGUMENT * len(given)
        time = np.float64(_time(kernel, args))
        head = [HERE.address(kernel), int(time.view(np.int64)), *builtin.constants(), len(given), needs]
        head += [0, 0, 0, len(self._stages), first, 0, builtin.new_copy()]
        head += [builtin.READ_ONLY if frozen else builtin.ALL_FLAGS, 0, builtin.caller()]
        for slot, shape in self._given(kernel, args, given):
            head.append(slot)
            head += builtin.NUMBER if shape is None else [len(shape), *shape, *([0] * (2 - len(shape)))]
        return np.array([*head, *words.tolist()], np.int64)

    def _through_ctypes(self, kernel: Kernel, args: tuple, given: tuple[str, ...], needs: int) -> Query:
        bound, slots = kernel.bind(*args, blocks=self._blocks), self._given(kernel, args, given)
        words, _ = bound.keep
        numbers = words.view(np.float64)

        def call(*arrays: Any) -> int:
            if len(arrays) != len(slots):
                return MISFIT
            for array, (slot, shape) in zip(arrays, slots):
                if shape is None:
                    if not isinstance(array, float):
                        return MISFIT
                    numbers[slot] = array
                    continue
                if type(array) is not np.ndarray or array.dtype != np.float64 or array.shape != shape:
                    return MISFIT
                if not (array.flags.c_contiguous and array.flags.aligned):
                    return MISFIT
                words[slot] = HERE.place(array) >> 3
            return (needs and self.update(needs)) or bound()

        return call

    def _interpreted(self, kernel: Kernel, args: tuple, given: tuple[str, ...], needs: int) -> Query:
        places = [kernel.names.index(name) for name in given]
        shapes = [None if isinstance(args[place], float) else np.shape(args[place]) for place in places]
        everything = list(args)

        def shape_of(given: Any) -> Any:
            if isinstance(given, float):
                return None
            fits = type(given) is np.ndarray and given.flags.c_contiguous and given.dtype in (float, object)
            return fits and given.shape

        def call(*arrays: Any) -> int:
            if [shape_of(a) for a in arrays] != shapes:
                return MISFIT
            for place, array in zip(places, arrays):
                everything[place] = array
            return (needs and self.update(needs)) or kernel(*everything) or 0

        return call

    @staticmethod
    def _given(kernel: Kernel, args: tuple, given: tuple[str, ...]) -> list[tuple[int, tuple[int, ...] | None]]:
        """For each given array: which word of the kernel has its address, and its shape; None for a float."""
        first, known = first_words(kernel), dict(zip(kernel.names, args))
        return [(first[name], None if isinstance(known[name], float) else known[name].shape) for name in given]


def object_query(cls: type, **fields: Query) -> Query:
    """A query for a new object of a class of slots: each named slot holds what its own query gives, unchecked."""
    if all(isinstance(ask, types.BuiltinFunctionType) for ask in fields.values()):
        from sheldrake.common._native import instances

        if instances.available():
            return instances.make(cls, fields)

    def make() -> Any:
        new: Any = object.__new__(cls)
        for name, ask in fields.items():
            setattr(new, name, ask())
        return new

    return make


def _time(kernel: Kernel, args: tuple) -> float:
    """What is given for the ABI's time."""
    return next((a for p, a in zip(kernel.parameters, args) if p.kind == "t"), 0.0)


def _native_run(kernel: Kernel, args: tuple, words: np.ndarray) -> Callable[[], int]:
    return lambda: kernel.function(_time(kernel, args), None, HERE.place(words))


def _plain_run(kernel: Kernel, args: tuple) -> Callable[[], int]:
    return lambda: kernel(*args) or 0
