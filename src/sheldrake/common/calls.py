"""Queries: kernels on fixed arrays, called from Python again and again, after stages that they need.

A query is a function of few arrays, or of none, that gives a status. Natively it is a builtin function of Python; on
duals and symbols, or with kernels as plain Python, a closure that does the same.
"""

from __future__ import annotations

import functools
import itertools
import types
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._kernels.only_stages import copy_numbers, only_stages
from sheldrake.common._native import builtin
from sheldrake.common._native.binding import HERE, arguments, first_words
from sheldrake.common.kernel import MISFIT, Kernel, jit_enabled

if TYPE_CHECKING:
    from sheldrake.common._types import KernelArgument

Query = Callable[..., Any]
_NONE = np.zeros(builtin.RELOCATIONS_HEAD, np.int64)
"""No relocations."""


class Calls:
    """Queries on one set of arrays. Stages are computed when a query needs them and kept until the counter changes.

    Args:
        counter: One integer, shape (1,), that changes whenever what the stages read was written.
        native: False runs kernels as Python, on arrays of any scalar.
        refuse: Raises the error of a stage that gives a status; without it, queries give that status.
    """

    _brought = 0
    """Whether the first argument of a call says which memory it is about."""

    def __init__(self, counter: np.ndarray, native: bool = True, refuse: Callable[..., Any] | None = None):
        self.native, self._refuse = native and jit_enabled(), refuse
        self._counter, self._kept = counter, np.array([-1, 0], np.int64)
        self._stages: list[tuple[Kernel, tuple]] = []
        self._runs: dict[int, Callable[[], int]] = {}
        self._blocks: dict = {}  # what kernels on the same NamedTuples have in common
        self._keep: list[Any] = []

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
        """Of each stage its bit, its function, and the addresses of its words and relocations, once it is bound."""
        return np.array([word for i in range(len(self._stages)) for word in (1 << i, 0, 0, 0)], np.int64)

    def _places(self) -> tuple[int, int]:
        """Words 8 and 9 of the block of every query."""
        return HERE.place(self._counter), HERE.place(self._kept)

    def _bind_stages(self, needs: int) -> None:
        """Makes those stages among `needs` that no query has needed before."""
        for i, (kernel, args) in enumerate(self._stages):
            bit = 1 << i
            if not needs & bit or bit in self._runs:
                continue
            if not self.native:
                self._runs[bit] = _plain_run(kernel, args)
                continue
            words, relocations = self._words(kernel, args)
            self._runs[bit] = _native_run(kernel, args, words)
            row = HERE.address(kernel), HERE.place(words), HERE.place(relocations)
            self._table[builtin.PER_STAGE * i + 1 : builtin.PER_STAGE * (i + 1)] = row
            self._keep.append(relocations)

    def _words(self, kernel: Kernel, args: tuple, given: tuple[str, ...] = ()) -> tuple[np.ndarray, np.ndarray]:
        """The words of a kernel, and the relocations among them."""
        return arguments(kernel, args, self._blocks, HERE)[0].words, _NONE

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

    def part(self, needs: int, numbers: np.ndarray, *shape: int) -> Query:
        """A query for a read-only copy, of this shape, of numbers that stages leave."""
        answer = np.zeros(shape)
        return self.query(copy_numbers, numbers, answer.reshape(-1), needs=needs, answer=answer, frozen=True)

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
        words, relocations = self._words(kernel, args, given)
        time = np.float64(_time(kernel, args))
        block = [HERE.address(kernel), int(time.view(np.int64)), *builtin.constants(), len(given), needs]
        block += [self._brought, *self._places(), HERE.place(self._table), len(self._stages)]
        block += [builtin.HEAD + builtin.PER_ARGUMENT * len(given), 0 if answer is None else id(answer)]
        block += [builtin.new_copy(), builtin.READ_ONLY if frozen else builtin.ALL_FLAGS]
        block += [0 if self._refuse is None else id(self._refuse), builtin.caller(), HERE.place(relocations)]
        for slot, shape in self._given(kernel, args, given):
            block.append(slot)
            block += builtin.NUMBER if shape is None else [len(shape), *shape, *([0] * (2 - len(shape)))]
        return builtin.QUERY.make([*block, *words.tolist()], (self, args, answer, relocations))

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


class Memory(NamedTuple):
    """What a context has."""

    slab: np.ndarray
    side: np.ndarray
    room: np.ndarray
    """Integers, and what else its queries leave for each other."""
    models: Addresses


class CallsInMemory(Calls):
    """Queries on memory that each call brings: the same ones for all contexts that are laid out alike.

    A query is called with a `Memory`, and then with the given arguments; `types.MethodType` makes one call of both.
    There are such only where `builtin.available()`.

    Args:
        like: A memory like those. Arguments are arrays in it, its models, and what lives no longer than a call.
        counter: Where in the side the counter is, see `Calls`.
        kept: Where in the room two words are for what is known of the stages; they are 0 at first, unlike the counter.
        refuse: Raises the error of a stage that gives a status, given slab and models.
    """

    _brought = 1

    def __init__(self, like: Memory, counter: int, kept: int, refuse: Callable[..., Any]):
        super().__init__(like.side, refuse=refuse)
        self.like, self._at = like, (8 * counter, 8 * kept)
        self._models = {id(array): number for number, array in enumerate(like.models.arrays, start=1)}
        parts = (builtin.IN_SLAB, like.slab), (builtin.IN_SIDE, like.side), (builtin.IN_ROOM, like.room)
        self._spans = [(kind, begin := HERE.place(part), begin + part.nbytes) for kind, part in parts]

    def _places(self) -> tuple[int, int]:
        return self._at

    def _words(self, kernel: Kernel, args: tuple, given: tuple[str, ...] = ()) -> tuple[np.ndarray, np.ndarray]:
        described, brought = arguments(kernel, args)[0], {id(args[kernel.names.index(name)]) for name in given}
        words, found = described.words, []
        for at, array, absolute in described.relocations:
            if id(array) in brought:
                continue
            place, number = HERE.place(array), self._models.get(id(array))
            kind, begin = next(((k, a) for k, a, b in self._spans if a <= place < b), (builtin.ELSEWHERE, 0))
            if number is not None:
                found += [at, builtin.MODEL if absolute else builtin.MODEL_FAR, number]
            elif absolute:
                words[at] = place
            elif kind == builtin.IN_SLAB:
                words[at] = (place - begin) >> 3
            else:
                found += [at, kind, (place - begin) >> 3]
        return words, np.array([len(found) // 3, *[0] * (builtin.RELOCATIONS_HEAD - 1), *found], np.int64)


_serial = itertools.count(1)


class Addresses(np.ndarray):
    """A number that no other has, and where the models of a memory are [bytes], see `CallsInMemory`.

    Attributes:
        form: What all must have in common that are given to the same queries: shapes and integers. Kernels that write
            only where a tree has something leave the rest of an answer as it was, zeros.
        owner: Whose models they are.
        arrays: The models.
    """

    form: tuple
    owner: Any
    arrays: tuple[np.ndarray, ...]

    @classmethod
    def of(cls, arrays: tuple[np.ndarray, ...], owner: object) -> Addresses:
        """Those of some arrays, which are kept."""
        new = np.array([next(_serial), *HERE.places(arrays)], np.int64).view(cls)
        new.form = tuple([(a.dtype, a.shape, a.strides, a.dtype == np.int64 and a.tobytes()) for a in arrays])
        new.owner, new.arrays = owner, arrays
        return new


def object_query(cls: type, **fields: Query) -> Query:
    """A query for a new object of a class of slots: each named slot holds what its own query gives, unchecked.

    All queries are given what it is given.
    """
    if all(isinstance(ask, types.BuiltinFunctionType) for ask in fields.values()):
        from sheldrake.common._native import instances

        if instances.available():
            return instances.make(cls, fields)

    def make(*args: Any) -> Any:
        new: Any = object.__new__(cls)
        for name, ask in fields.items():
            setattr(new, name, ask(*args))
        return new

    return make


def _time(kernel: Kernel, args: tuple) -> float:
    """What is given for the ABI's time."""
    return next((a for p, a in zip(kernel.parameters, args) if p.kind == "t"), 0.0)


def _native_run(kernel: Kernel, args: tuple, words: np.ndarray) -> Callable[[], int]:
    return lambda: kernel.function(_time(kernel, args), None, HERE.place(words))


def _plain_run(kernel: Kernel, args: tuple) -> Callable[[], int]:
    return lambda: kernel(*args) or 0
