"""Short ways (`quick`) for objects of AutoDiffXd: the same kernels, on values and along each derivative."""

from __future__ import annotations

import functools
import itertools
import math
import operator
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._forms import FEW, Form, Slots, leaves
from sheldrake.common._scalars import autodiff_class

if TYPE_CHECKING:
    from sheldrake.common.kernel import Kernel

_TIMES = 10
"""To compile a kernel on complex numbers takes so many times longer than to load it."""


def are_possible(takes: tuple[Form, ...], gives: Form) -> bool:
    """Whether there are such objects of duals, the first argument among them: with arrays in slots, not numbers."""
    if not takes or not isinstance(takes[0], Slots):
        return False
    classes = [cls for form in (*takes, gives) for path, _ in leaves(form) for cls, _ in path]
    taken = [(path, leaf) for form in takes for path, leaf in leaves(form)]
    fit = all(min(leaf) > 0 if isinstance(leaf, tuple) else not path for path, leaf in taken)
    return fit and all(hasattr(cls, "_template") for cls in classes)


def not_yet(short_way: Any, kernel: Kernel, takes: tuple[Form, ...], gives: Form, frozen: bool) -> Callable[..., Any]:
    """What a short way asks next: gives None, and puts that for duals in its own place when these came some times."""
    from sheldrake.common._native import methods

    calls = 0

    def ask(*args: Any) -> Any:
        nonlocal calls
        if len(args) != len(takes) or not all(map(_is_of, args, takes)):
            return None
        calls += 1
        if calls <= FEW or (calls <= _TIMES * FEW and not _is_ready(kernel, gives)):
            return None
        made = _made(kernel, takes, gives, frozen, args)
        methods.ask_next(short_way, made)
        return None if made is None else made(*args)

    return ask


def _is_of(value: object, form: Form) -> bool:
    """Whether a value is one of duals that a form of floats has."""
    if isinstance(form, Slots):
        return type(value) is of_duals(form.cls)
    return value.shape == form if isinstance(value, np.ndarray) else form is float


def _is_ready(kernel: Kernel, gives: Form) -> bool:
    from sheldrake.common._native import store

    return gives is bool or store.is_ready(kernel.on_complex)


def _made(kernel: Kernel, takes: tuple[Form, ...], gives: Form, frozen: bool, args: tuple[Any, ...]) -> Any:
    from sheldrake.common._native import duals, store

    if not duals.available() or sum(map(_numbers_of, (leaf for _, leaf in leaves(gives)))) > duals.MOST_NUMBERS:
        return None
    if not _is_ready(kernel, gives):
        if not store.can_compile():
            return None
        store.make(kernel.on_complex, tell=False)
    return _Writer(kernel, takes, gives, frozen).write(args)


_NO_SWEEP = 0, np.zeros(1, np.int64), None


class _Writer:
    """Writes the block of one short way (see `_native/duals`).

    Args:
        kernel, takes, gives, frozen: as for `quick.short_way`.
    """

    def __init__(self, kernel: Kernel, takes: tuple[Form, ...], gives: Form, frozen: bool) -> None:
        self.kernel, self.takes, self.gives, self.frozen = kernel, takes, gives, frozen
        self.taken = [(k, path, leaf) for k, form in enumerate(takes) for path, leaf in leaves(form)]
        self.count = sum(math.prod(leaf) for *_, leaf in self.taken if isinstance(leaf, tuple))
        self.answers = [leaf for _, leaf in leaves(gives)]
        self.numbers = sum(map(_numbers_of, self.answers))
        self.made: list[list[int]] = []
        self.keep: list[Any] = []

    def write(self, args: tuple[Any, ...]) -> Any:
        from sheldrake.common._native import builtin, duals, methods
        from sheldrake.common._native.binding import HERE, first_words

        kind, place = autodiff_class(), HERE.place
        values, complexes = np.zeros(self.count), np.zeros(self.count, complex)
        answers, complex_answers = np.zeros(self.numbers + 1), np.zeros(self.numbers + 1, complex)  # or a truth
        slopes, found = np.zeros((self.count, duals.MOST)), np.zeros((self.numbers, duals.MOST))
        bound = self.kernel.bind(*self._cut(values, answers))
        words, _ = bound.keep
        influence, compares, sweep = np.zeros(self.count, np.int64), False, _NO_SWEEP
        if self.numbers:
            influence, compares = self._influence(args)
            sweep = self._sweep(complexes, complex_answers, slopes, found)
        vectors = [np.zeros(n) for n in range(1, duals.MOST + 1)]
        addresses, two = np.array(list(map(id, vectors)), np.int64), _places_of_count()
        slots = list(first_words(self.kernel).values())
        rows = self._rows(slots)
        self._make(self.gives, self.frozen, itertools.count(), place(answers))
        recipes = duals.HEAD + duals.PER_TAKEN * len(rows)
        begin = recipes + methods.PER_MADE * len(self.made)
        call = methods.functions()
        block = [HERE.address(self.kernel), *builtin.constants()[1:], len(self.takes), id(None), call["Py_IncRef"]]
        block += [len(rows), len(self.made), recipes, begin]
        block += [builtin.new_copy(), call["PyType_GenericAlloc"], call["PyFloat_FromDouble"], 0, 0, 0]
        block += [id(np.dtype(object)), id(kind), *(methods.place_of_slot(kind, name) for name in ("_v", "_d"))]
        block += [id(float), id(np.float64), *map(place, (values, complexes, slopes)), int(compares), self.numbers]
        block += [*map(place, (answers, found, addresses)), duals.MOST, 1, -1, 0, call["Py_DecRef"]]
        block += [sweep[0], place(sweep[1]), *map(place, (two, influence))]
        block += [call["PyMem_RawMalloc"], call["PyMem_RawFree"]]
        block += [*itertools.chain(*rows, *self.made), *words.tolist()]
        self.keep += [bound, sweep, values, complexes, answers, complex_answers, slopes, found, influence]
        self.keep += [vectors, addresses, two, self.takes, self.gives]
        return duals.DUALS.make(block, self.keep)

    def _cut(self, given: np.ndarray, answers: np.ndarray) -> list[Any]:
        """Arguments of the kernel: parts of these arrays, and zero for what is a number by itself."""
        arguments: list[Any] = []
        begin = 0
        for *_, leaf in self.taken:
            size = _numbers_of(leaf) if isinstance(leaf, tuple) else 0
            arguments.append(given[begin : begin + size] if size else 0.0)
            begin += size
        begin = 0
        for leaf in self.answers:
            size = max(_numbers_of(leaf), 1)
            arguments.append(answers[begin : begin + size])
            begin += size
        return arguments

    def _sweep(self, given: np.ndarray, answers: np.ndarray, slopes: np.ndarray, found: np.ndarray) -> tuple[Any, ...]:
        """Address of the kernel `sweep`, its words, and what they are of."""
        from sheldrake.common._kernels import sweep
        from sheldrake.common._native.binding import HERE, arguments, imaginary_parts, join
        from sheldrake.common.chain import bound_to_all_memory

        on_complex = self.kernel.on_complex
        words, at = join([arguments(on_complex, tuple(self._cut(given, answers)), {}, HERE)[0]])
        row, nothing = np.array([HERE.address(on_complex)], np.int64), np.zeros((0, 3), np.int64)
        places, wanted = imaginary_parts(given), imaginary_parts(answers)[: self.numbers]
        table = row, words.words, np.array(at[:-1], np.int64), nothing, nothing
        bound = bound_to_all_memory(sweep.sweep, *table, places, slopes, wanted, found)
        return HERE.address(sweep.sweep), bound.keep[0], bound

    def _rows(self, slots: list[int]) -> list[list[int]]:
        from sheldrake.common._native import builtin, methods

        rows, begin = [], 0
        for (argument, path, leaf), slot in zip(self.taken, slots):
            hops = [
                word for cls, name in path for word in (id(of_duals(cls)), methods.place_of_slot(of_duals(cls), name))
            ]
            size = _numbers_of(leaf) if isinstance(leaf, tuple) else 0
            shape = [len(leaf), *leaf, *([0] * (2 - len(leaf)))] if isinstance(leaf, tuple) else [*builtin.NUMBER]
            rows.append([argument, slot, *hops, *([0] * (4 - len(hops))), *shape, begin, size])
            begin += size
        return rows

    def _make(self, form: Form, frozen: bool, first: Iterator[int], answers: int) -> int:
        """Adds the rows that make a form; the number of the last."""
        from sheldrake.common._native import builtin, methods

        if isinstance(form, Slots):
            cls = of_duals(form.cls)
            row = [id(cls), len(form.parts)]
            for name, part in form.parts.items():
                row += [methods.place_of_slot(cls, name), self._make(part, True, first, answers)]
        elif isinstance(form, tuple):
            array = np.full(form, None, object)
            self.keep.append(array)
            size = _numbers_of(form)
            row = [methods.AN_ARRAY, id(array), builtin.READ_ONLY if frozen else builtin.ALL_FLAGS, next(first), size]
            for _ in range(size - 1):
                next(first)
        elif form is bool:
            row = [methods.A_TRUTH, answers, id(False), id(True)]
        else:
            row = [methods.A_FLOAT, 0, 0, next(first)]
        self.made.append([*row, *([0] * (methods.PER_MADE - len(row)))])
        return len(self.made) - 1

    def _influence(self, args: tuple[Any, ...]) -> tuple[np.ndarray, bool]:
        """Which of the answer's numbers each given one has influence on, a bit each; and whether numbers were compared.

        The source is followed at the arguments of a call. Where it compares, it may go another way at others.
        """
        traces = [_Trace(0.0, 1 << i) for i in range(self.count)]
        _Trace.compared = False
        given, answers = np.array(traces, object), np.zeros(self.numbers + 1, object)
        begin = 0
        for argument, path, leaf in self.taken:
            if isinstance(leaf, tuple):
                found = functools.reduce(lambda thing, hop: getattr(thing, hop[1]), path, args[argument])
                for x in found.ravel().tolist():
                    traces[begin].value = np.float64(getattr(x, "_v", x))  # which divides by zero
                    begin += 1
        with np.errstate(all="ignore"):
            self.kernel(*self._cut(given, answers))
        masks = [x.sources if isinstance(x, _Trace) else 0 for x in answers[: self.numbers]]
        influence = [sum((mask >> i & 1) << k for k, mask in enumerate(masks)) for i in range(self.count)]
        return np.array(influence, np.int64), _Trace.compared


class _Trace:
    """A number that knows of which given numbers it is made, a bit each."""

    compared = False

    def __init__(self, value: float, sources: int):
        self.value, self.sources = value, sources


def _following(function: Callable[..., Any]) -> Callable[..., _Trace]:
    def follow(*args: Any) -> _Trace:
        sources = functools.reduce(operator.or_, (x.sources for x in args if isinstance(x, _Trace)), 0)
        return _Trace(function(*(x.value if isinstance(x, _Trace) else x for x in args)), sources)

    return follow


def _comparing(function: Callable[..., bool]) -> Callable[..., bool]:
    def compare(*args: Any) -> bool:
        _Trace.compared = True
        return function(*(x.value if isinstance(x, _Trace) else x for x in args))

    return compare


for _name in ("add", "sub", "mul", "truediv", "pow"):
    _function = getattr(operator, _name)
    setattr(_Trace, f"__{_name}__", _following(_function))
    setattr(_Trace, f"__r{_name}__", _following(lambda x, y, function=_function: function(y, x)))
for _name in ("neg", "pos"):
    setattr(_Trace, f"__{_name}__", _following(getattr(operator, _name)))
for _name in ("lt", "le", "gt", "ge", "eq", "ne"):
    setattr(_Trace, f"__{_name}__", _comparing(getattr(operator, _name)))
for _name in ("sin", "cos", "tan", "arcsin", "arccos", "arctan", "arctan2", "exp", "log", "sqrt"):
    setattr(_Trace, _name, _following(getattr(np, _name)))
_Trace.__abs__ = _following(abs)  # type: ignore[attr-defined]


def _places_of_count() -> np.ndarray:
    """Where the words of `sweep` have the number of derivatives."""
    from sheldrake.common._kernels import sweep
    from sheldrake.common._native.binding import first_words

    first = first_words(sweep.sweep)
    return np.array([first["by_inputs"] + 2, first["slopes"] + 2], np.int64)


def of_duals(cls: Any) -> Any:
    """The class of a family for duals."""
    return cls._template[autodiff_class()]


def _numbers_of(leaf: Form) -> int:
    """How many numbers that are duals."""
    if isinstance(leaf, tuple):
        return math.prod(leaf)
    return 0 if leaf is bool else 1
