"""Where a kernel's arguments are: the one seam between kernels and memory.

A function of the ABI gets its arguments as int64 words. Most are shapes and offsets into a slab, the same wherever the
slab is. The others are addresses, of a model's arrays or of what lies outside the slab: they are *relocations*, which
say of which array. A `Machine` fills them in. `HERE` is this process, where arrays are where NumPy has them and kernels
are machine code; what runs a diagram elsewhere is another, with arrays where it has put them and kernels of its own.
"""

from __future__ import annotations

import ctypes
import functools
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from sheldrake.common._native import sanitizer
from sheldrake.common.kernel import ArraySpec, Parameter

if TYPE_CHECKING:
    from sheldrake.common.kernel import Kernel

Place = Sequence[int]
"""Where an array is in a slab: (offset in doubles, shape...)."""
Call = tuple["Kernel", Mapping[str, Any]]
"""A kernel, and by the names of its parameters where it finds them (`arguments_in_slab`)."""


class Machine(Protocol):
    """What runs kernels: it has a memory, and code."""

    def place(self, array: np.ndarray) -> int:
        """Address of an array [bytes]."""

    def address(self, kernel: Kernel) -> int:
        """What a table of rows holds for a kernel (`common.rows.call_row`)."""


class Here:
    """This process."""

    def place(self, array: np.ndarray) -> int:
        """Address of an array [bytes]."""
        if sanitizer.SANITIZED:
            sanitizer.note(array)
        if _SEES_ARRAYS:
            return _word_at(id(array) + DATA).value
        return array.__array_interface__["data"][0]  # eight times slower

    def places(self, arrays: Iterable[np.ndarray]) -> list[int]:
        """Addresses of arrays [bytes]."""
        if sanitizer.SANITIZED or not _SEES_ARRAYS:
            return [self.place(array) for array in arrays]
        return [_word_at(at + DATA).value for at in map(id, arrays)]

    def address(self, kernel: Kernel) -> int:
        """Address of the kernel's machine code, compiled or loaded when first asked for."""
        return kernel.address


HERE = Here()
DATA = 16
"""Where an array object has the address of its numbers [bytes], if objects are as expected."""
OBJECTS_AS_EXPECTED = (
    sys.implementation.name == "cpython" and object.__basicsize__ == 16 and ctypes.sizeof(ctypes.c_void_p) == 8
)
"""Whether this interpreter's objects begin as those of CPython with a global interpreter lock, on 64 bits."""
_word_at = ctypes.c_int64.from_address


def _finds_numbers(array: np.ndarray) -> bool:
    return OBJECTS_AS_EXPECTED and _word_at(id(array) + DATA).value == array.__array_interface__["data"][0]


_SEES_ARRAYS = _finds_numbers(np.zeros(3)) and _finds_numbers(np.zeros((2, 3))[:, 1])


def imaginary_parts(numbers: np.ndarray) -> np.ndarray:
    """Where the imaginary parts of a C-contiguous complex array are, as addresses by eight."""
    return (HERE.place(numbers) >> 3) + 1 + 2 * np.arange(numbers.size, dtype=np.int64)


class Relocation(NamedTuple):
    """One word that is an address: where it stands, of which array, in bytes or in doubles from the slab."""

    at: int
    array: np.ndarray
    absolute: bool


_relocation = functools.partial(tuple.__new__, Relocation)  # what `Relocation._make` does, five times as fast


class Words(NamedTuple):
    """Arguments of a kernel, or of several; `words` has zeros where `relocations` say what belongs there."""

    words: np.ndarray
    relocations: tuple[Relocation, ...]

    def placed(self, machine: Machine = HERE, slab: int = 0) -> np.ndarray:
        """The words for a machine, and for a slab at this address [bytes]; at 0, offsets are addresses by eight."""
        words = self.words.copy()
        places: dict[int, int] = {}  # many words speak of few arrays
        found = []
        for _, array, absolute in self.relocations:
            where = places.get(id(array))
            if where is None:
                where = places[id(array)] = machine.place(array)
            found.append(where if absolute else (where - slab) >> 3)
        if found:
            words[[r.at for r in self.relocations]] = found
        return words


def join(parts: Iterable[Words]) -> tuple[Words, list[int]]:
    """All words one after the other, and where each part begins; behind them where all end, before a last 0."""
    at, words, relocations = [0], [], []
    for part in parts:
        words.append(part.words)
        begin = at[-1]
        relocations += [_relocation((begin + k, array, absolute)) for k, array, absolute in part.relocations]
        at.append(at[-1] + len(part.words))
    return Words(np.concatenate([*words, np.zeros(1, np.int64)]), tuple(relocations)), at


def join_in_slab(calls: Iterable[Call | None], machine: Machine | None = None) -> tuple[Words, list[int]]:
    """The words of many calls in one slab, and where those of each begin; behind them where all end, before a last 0.

    A call that is None has no words, one that is there twice, as the same object, has them once. Calls of one system
    are given the same models and the same scratch: what these take is written out once.

    Args:
        calls: kernels and their places, see `arguments_in_slab`.
        machine: where arrays have their places: the words are then complete, and there are no relocations. Whoever asks
            keeps the arrays.

    Raises:
        KeyError, TypeError: as `arguments_in_slab`.
    """
    at: list[int] = []
    words: list[int] = []
    relocations: list[tuple[int, np.ndarray, bool]] = []
    blocks: dict[tuple, _Block] = {}
    begins: dict[int, int] = {}
    for call in calls:
        begin = begins.setdefault(id(call), len(words)) if call is not None else len(words)
        at.append(begin)
        if call is not None and begin == len(words):
            writer = _Writer(call[0], blocks, machine)
            writer.write_all(call[1], in_slab=True)
            words += writer.words
            words += writer.behind
            words.append(0)
            relocations += [(begin + k, array, absolute) for k, array, absolute in writer.relocations]
    at.append(len(words))
    return Words(np.array([*words, 0], np.int64), tuple(map(_relocation, relocations))), at


def arguments(
    kernel: Kernel, args: tuple, blocks: dict[tuple, _Block] | None = None, machine: Machine | None = None
) -> tuple[Words, dict[str, tuple[int, str]]]:
    """Words for a direct call on `args`, and where each float or int stands in them.

    Args:
        kernel: an entry kernel.
        args: what it is called on.
        blocks: what calls on the same NamedTuples keep for each other, {} at first.
        machine: as in `join_in_slab`.

    Raises:
        TypeError: if the number, type, axes or memory order of an argument differ from the kernel's annotations.
    """
    if len(args) != len(kernel.parameters):
        names = ", ".join(kernel.names)
        raise TypeError(f"{kernel!r} takes {len(kernel.names)} arguments ({names}), not {len(args)}.")
    writer = _Writer(kernel, blocks, machine)
    return writer.write(dict(zip(kernel.names, args)), in_slab=False), writer.scalars


def arguments_in_slab(kernel: Kernel, places: Mapping[str, Any]) -> Words:
    """Words for a kernel that works in a slab.

    Args:
        kernel: an entry kernel.
        places: by parameter name: a `Place` for an array in the slab, or an array that lies elsewhere; a sequence of
            them for `Vectors` or a NamedTuple; the arrays themselves for `model` and `*_model`; the number for a float
            or int. `t` needs none.

    Raises:
        KeyError: if a parameter has no place.
        TypeError: if a model is not what the kernel's annotations say.
    """
    return _Writer(kernel).write(places, in_slab=True)


def check_record(kernel: Kernel, parameter: Parameter, vector: np.ndarray | Place) -> None:
    """Whether a vector, an array or a place in a slab, is as long as the record that a kernel takes it for.

    Raises:
        TypeError: it is not.
    """
    record = parameter.cls.RECORD
    size = len(vector) if isinstance(vector, np.ndarray) else vector[1]
    open_end = any(f.kind == "rest" for f in record.FIELDS)
    if size < record.SIZE or (size > record.SIZE and not open_end):
        wanted = f"{record.SIZE}{' or more' if open_end else ''}"
        raise TypeError(f"{kernel!r}: {parameter.name} is a {record.__name__} of {wanted} numbers, not of {size}.")


@functools.lru_cache(256)
def first_words(kernel: Kernel) -> dict[str, int]:
    """Where the words of each parameter begin; those of an array are its offset, then its shape."""
    places, at = {}, 0
    for parameter in kernel.parameters:
        places[parameter.name] = at
        at += _size(parameter)
    return places


def _size(parameter: Parameter) -> int:
    """Words a parameter takes at its place."""
    if parameter.kind == "t":
        return 0
    if parameter.kind == "arrays":
        return 2
    return sum(1 + s.ndim for s in parameter.fields) or 1


@functools.lru_cache(maxsize=512)
def _words_before_vectors(kernel: Kernel) -> int:
    return sum(map(_size, kernel.parameters))


class _Block(NamedTuple):
    """What a NamedTuple takes among the words of a call; `relocations` count from its first word."""

    given: Any
    words: list[int]
    relocations: list[tuple[int, np.ndarray, bool]]


class _Writer:
    """Writes the words of one call: those of `Vectors` stand behind all others.

    Args:
        kernel: what is called.
        blocks: NamedTuples that are written already, kept for other calls.
        machine: where arrays have their places; without one there are relocations.
    """

    def __init__(
        self, kernel: Kernel, blocks: dict[tuple, _Block] | None = None, machine: Machine | None = None
    ) -> None:
        self.kernel, self.machine = kernel, machine
        self.words: list[int] = []
        self.behind: list[int] = []
        self.relocations: list[tuple[int, np.ndarray, bool]] = []  # each to become a `Relocation`
        self.scalars: dict[str, tuple[int, str]] = {}
        self.blocks: dict[tuple, _Block] = {} if blocks is None else blocks

    def write(self, given: Mapping[str, Any], in_slab: bool) -> Words:
        self.write_all(given, in_slab)
        words = np.array([*self.words, *self.behind, 0], np.int64)
        return Words(words, tuple(map(_relocation, self.relocations)))

    def write_all(self, given: Mapping[str, Any], in_slab: bool) -> None:
        for parameter in self.kernel.parameters:
            if parameter.kind == "tuple":
                self._tuple(parameter, given[parameter.name], in_slab)
            elif parameter.kind != "t":
                self._parameter(parameter, given[parameter.name], in_slab)

    def _tuple(self, parameter: Parameter, argument: Any, in_slab: bool) -> None:
        absolute = bool(parameter.fields) and parameter.fields[0].absolute
        key = parameter.cls, absolute, id(argument)
        block = self.blocks.get(key)
        if block is None:
            if not isinstance(argument, parameter.cls) and (absolute or not in_slab):
                expected, found = parameter.cls.__name__, type(argument).__name__
                raise TypeError(f"{self.kernel!r}: {parameter.name} must be a {expected}, not {found}.")
            block = self.blocks[key] = _Block(argument, [], [])
            places = in_slab and not absolute
            for k, (spec, a) in enumerate(zip(parameter.fields, argument)):
                if places and not isinstance(a, np.ndarray) and spec.width in (None, a[-1]):
                    block.words.extend(a)
                    continue
                if not _fits(spec, a):
                    raise self._refusal(f"{parameter.name}.{parameter.cls._fields[k]}", spec, a)
                self._place(block.words, block.relocations, 0, spec, a)
        begin = len(self.words)
        self.words += block.words
        if block.relocations:
            self.relocations += [(begin + k, array, absolute) for k, array, absolute in block.relocations]

    def _whole(self, name: str, argument: Any) -> int:
        whole = int(argument)
        if whole != argument or not -(2**63) <= whole < 2**63:
            raise TypeError(f"{self.kernel!r}: {name} must be a whole number of 64 bits, not {argument!r}.")
        return whole

    def _parameter(self, parameter: Parameter, argument: Any, in_slab: bool) -> None:
        name, kind, words = parameter.name, parameter.kind, self.words
        if kind in ("float", "int"):
            self.scalars[name] = len(words), kind
            words.append(int(np.float64(argument).view(np.int64)) if kind == "float" else self._whole(name, argument))
        elif kind in ("array", "record"):
            if kind == "record":
                argument = argument[0] if isinstance(argument, parameter.cls) else argument
                check_record(self.kernel, parameter, argument)
            self._array(words, 0, name, parameter.fields[0], argument, in_slab)
        elif kind == "arrays":
            head = _words_before_vectors(self.kernel)
            words += [len(argument), head + len(self.behind)]
            for i, a in enumerate(argument):
                self._array(self.behind, head, f"{name}[{i}]", parameter.fields[0], a, in_slab)

    def _array(self, words: list[int], start: int, title: str, spec: ArraySpec, a: Any, in_slab: bool) -> None:
        if in_slab and not spec.absolute and not isinstance(a, np.ndarray):
            words.extend(a)
            return
        if not _fits(spec, a):
            raise self._refusal(title, spec, a)
        self._place(words, self.relocations, start, spec, a)

    def _place(self, words: list[int], relocations: list, start: int, spec: ArraySpec, a: np.ndarray) -> None:
        """Appends where an array is, and its shape."""
        if self.machine is None:
            relocations.append((start + len(words), a, spec.absolute))
            words.append(0)
        else:
            where = self.machine.place(a)
            words.append(where if spec.absolute else where >> 3)
        words.extend(a.shape)

    def _refusal(self, title: str, spec: ArraySpec, a: Any) -> TypeError:
        """Why an array is not what the kernel's annotations say."""
        if isinstance(a, np.ndarray) and a.dtype == object:
            return TypeError(
                f"{self.kernel!r}: {title} holds objects; call the kernel as a function instead of binding it."
            )
        found = f"{a.dtype} array of shape {a.shape}" if isinstance(a, np.ndarray) else repr(type(a).__name__)
        wrong_kind = not isinstance(a, np.ndarray) or a.dtype != spec.dtype or a.ndim != spec.ndim
        found += "" if wrong_kind or a.flags.aligned else " at an odd address"
        axes = f"{spec.ndim} axes" + ("" if spec.width is None else f", the last of {spec.width}")
        return TypeError(f"{self.kernel!r}: {title} must be a C-contiguous {spec.dtype} array of {axes}, not {found}.")


_DTYPES = {"float64": np.dtype(np.float64), "int64": np.dtype(np.int64)}
"""NumPy compares these much faster with one another than with their names."""


def _fits(spec: ArraySpec, a: Any) -> bool:
    """Whether an array is what the kernel's annotations say."""
    if not isinstance(a, np.ndarray) or a.ndim != spec.ndim or a.dtype != _DTYPES.get(spec.dtype, spec.dtype):
        return False
    if spec.width is not None and spec.width != a.shape[-1]:
        return False
    return a.flags.carray or (a.flags.c_contiguous and a.flags.aligned)
