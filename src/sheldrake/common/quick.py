"""Short ways for methods of values: a kernel on the numbers in objects' slots, as a builtin function of Python.

A method that is written once for all scalars asks its short way first,

    def inverse(self):
        if (made := _inverse(self)) is not None:
            return made
        ...

which gives None for whatever is not exactly of the types it was made for, and where there is no native code. Objects
of AutoDiffXd have ways of the same kernels (`_dual_ways`), once they have come some times.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._forms import ANY as ANY
from sheldrake.common._forms import FEW, Form, Slots, leaves
from sheldrake.common.kernel import jit_enabled

if TYPE_CHECKING:
    from sheldrake.common.kernel import Kernel


def short_way(
    home: dict[Any, Any], name: Any, kernel: Kernel, *takes: Form, gives: Form, frozen: bool = True, duals: bool = True
) -> Any:
    """A function that gives None at first, and puts the short way in its own place when it was called some times.

    Args:
        home: What the function is kept in: a module's `globals()`, or a table.
        name: By what name.
        kernel: An entry whose parameters are the numbers of all arguments, floats or vectors, matrices by rows, and
            then vectors for the numbers of the answer; a status other than 0 says that the long way is to be gone.
        takes: Arguments.
        gives: The answer.
        frozen: Whether an array that is the answer is read-only; arrays in slots always are.
        duals: Whether objects of duals may go this way too; not where the kernel writes constants at some numbers only,
            which have no derivatives there.
    """
    calls = 0

    def not_yet(*args: Any) -> None:
        nonlocal calls
        calls += 1
        if calls > FEW:
            home[name] = found = _made(kernel, takes, gives, frozen)
            if duals and found is not _never:
                _go_on_with_duals(found, kernel, takes, gives, frozen)

    return not_yet


def _go_on_with_duals(found: Any, kernel: Kernel, takes: tuple[Form, ...], gives: Form, frozen: bool) -> None:
    from sheldrake.common import _dual_ways
    from sheldrake.common._native import methods

    if _dual_ways.are_possible(takes, gives):
        methods.ask_next(found, _dual_ways.not_yet(found, kernel, takes, gives, frozen))


_asked: dict[Kernel, int] = {}


def worth_making(kernel: Kernel) -> bool:
    """Whether a kernel is at hand, or was asked for so often that compiling it pays; each question counts."""
    if not jit_enabled():
        return False
    from sheldrake.common._native import store

    if store.is_ready(kernel):
        return True
    _asked[kernel] = _asked.get(kernel, 0) + 1
    return _asked[kernel] > FEW and store.can_compile()


def query(kernel: Kernel, *fixed: np.ndarray, takes: tuple[Form, ...], gives: Form, frozen: bool = True) -> Any:
    """A short way on arrays of one object, which come first among the kernel's parameters; None where there is none.

    Args:
        kernel, takes, gives, frozen: as for `short_way`.
        fixed: Arrays that stay where they are.
    """
    made = _made(kernel, takes, gives, frozen, fixed)
    return None if made is _never else made


def _never(*args: Any) -> None:
    """The short way where there is none."""


def _made(
    kernel: Kernel, takes: tuple[Form, ...], gives: Form, frozen: bool, fixed: tuple[np.ndarray, ...] = ()
) -> Callable[..., Any]:
    if not jit_enabled():
        return _never
    from sheldrake.common._native import methods, store

    if not methods.available():
        return _never
    if not store.is_ready(kernel):
        if not store.can_compile():
            return _never
        store.make(kernel, tell=False)  # a moment, too short to speak of
    return _Writer(kernel, frozen, fixed).write(takes, gives)


class _Writer:
    """Writes the block of one short way (see `methods`)."""

    def __init__(self, kernel: Kernel, frozen: bool, fixed: tuple[np.ndarray, ...]) -> None:
        self.kernel, self.frozen, self.num_fixed = kernel, frozen, len(fixed)
        self.given: list[Any] = list(fixed)  # what the kernel is bound to
        self.taken: list[list[int]] = []
        self.made: list[list[int]] = []
        self.keep: list[Any] = []

    def write(self, takes: tuple[Form, ...], gives: Form) -> Callable[..., Any]:
        from sheldrake.common._native import builtin, methods
        from sheldrake.common._native.binding import HERE, first_words

        for k, form in enumerate(takes):
            for path, leaf in leaves(form):
                self._take(k, path, leaf)
        self._make(gives, self.frozen)
        bound = self.kernel.bind(*self.given)
        words, _ = bound.keep
        slots = list(first_words(self.kernel).values())[self.num_fixed :]
        rows = [[row[0], slot, *row[1:]] for row, slot in zip(self.taken, slots)]
        self._check(rows)
        recipes = methods.HEAD + methods.PER_TAKEN * len(rows)
        begin = recipes + methods.PER_MADE * len(self.made)
        call = methods.functions()
        head = [HERE.address(self.kernel), *builtin.constants()[1:], len(takes), id(None), call["Py_IncRef"]]
        head += [len(rows), len(self.made), recipes, begin]
        head += [builtin.new_copy(), call["PyType_GenericAlloc"], call["PyFloat_FromDouble"]]
        first = takes[0].cls if takes and isinstance(takes[0], Slots) else None
        head += [0, call["PyObject_Vectorcall"], id(first)]
        block = [*head, *itertools.chain(*rows, *self.made), *words.tolist()]
        return methods.METHOD.make(block, (bound, takes, gives, self.keep))

    def _check(self, rows: list[list[int]]) -> None:
        """Raises TypeError for what a block has no room for, as its code would read and write beyond it."""
        from sheldrake.common._native import methods

        fits = len(self.made) <= methods.MOST_MADE
        fits = fits and all(len(row) == methods.PER_TAKEN for row in rows)
        if not (fits and all(len(row) == methods.PER_MADE for row in self.made)):
            raise TypeError(
                f"{self.kernel}: a short way takes vectors and matrices, at most two objects deep, and makes at most "
                f"{methods.MOST_MADE} objects, each of at most {(methods.PER_MADE - 2) // 2} slots."
            )

    def _take(self, argument: int, path: tuple[tuple[type, str], ...], leaf: Form) -> None:
        from sheldrake.common._native import builtin, methods

        hops = [word for cls, name in path for word in (id(cls), methods.place_of_slot(cls, name))]
        if isinstance(leaf, tuple):
            shape = [len(leaf), *leaf, *([0] * (2 - len(leaf)))]
            self.given.append(np.zeros(abs(math.prod(leaf))))
        else:
            shape = list(builtin.NUMBER)
            self.given.append(0.0)
        self.taken.append([argument, *hops, *([0] * (4 - len(hops))), *shape])

    def _make(self, form: Form, frozen: bool) -> None:
        """Adds the rows that make a form.

        Numbers and arrays come first: to make an object may collect garbage, whose finalizers may call this again.
        """
        self._make_object(form, iter([self._make_leaf(leaf, frozen or bool(path)) for path, leaf in leaves(form)]))

    def _make_object(self, form: Form, made_leaves: Iterator[int]) -> int:
        """Adds the rows that make the objects of a form; the number of the last."""
        from sheldrake.common._native import methods

        if not isinstance(form, Slots):
            return next(made_leaves)
        row = [id(form.cls), len(form.parts)]
        for name, part in form.parts.items():
            row += [methods.place_of_slot(form.cls, name), self._make_object(part, made_leaves)]
        return self._add(row)

    def _make_leaf(self, form: Form, frozen: bool) -> int:
        """Adds the row that makes a number or an array; its number."""
        from sheldrake.common._native import builtin, methods
        from sheldrake.common._native.binding import HERE

        if isinstance(form, tuple):
            array = np.zeros(form)
            self.keep.append(array)
            self.given.append(array.reshape(-1))
            return self._add([methods.AN_ARRAY, id(array), builtin.READ_ONLY if frozen else builtin.ALL_FLAGS])
        number = np.zeros(1)
        self.given.append(number)
        truths = [methods.A_TRUTH, HERE.place(number), id(False), id(True)]
        return self._add(truths if form is bool else [methods.A_FLOAT, HERE.place(number)])

    def _add(self, row: list[int]) -> int:
        from sheldrake.common._native import methods

        self.made.append([*row, *([0] * (methods.PER_MADE - len(row)))])
        return len(self.made) - 1
