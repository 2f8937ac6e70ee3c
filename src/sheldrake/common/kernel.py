"""One decorator for every kernel: the same source runs as plain Python and as machine code.

A kernel is a function in plain loops over arrays and tuples. Called like a function it *is* that function: the
debugger, the textbook, and the path for duals and symbols. Bound to arrays (`bind`) it is native code. Importing this
module does not import llvmlite: what a kernel needs to become native is loaded when it is first bound. What kernels are
written in is told in `docs/kernels.md`.

    @kernel                  inner: always inlined into its callers
    @kernel                  with one `yield`: for loops, `for x in items(a):`; the body of the loop takes its place
    @kernel(outline=True)    inner, but kept as one compiled copy: for large stages, keeps compile time down
    @kernel(top=True)        entry: every parameter annotated; may be bound; returns None or an int status (0 = fine)

Every entry compiles to one C signature, `int64 f(double t, double* slab, int64* words)`. `words` tells where the
arguments are: an array is (offset into the slab in doubles, shape...), or, for parameters named `model` or `*_model`,
(address, shape...); a NamedTuple is its fields in order, a Record its vector; a float is its bits; `Vectors` are their
number and where in `words` their (offset, size) pairs begin, which stand behind everything else. A direct call from
Python passes a null slab, so that "offset" is the address divided by eight: one compiled function serves both.
"""

from __future__ import annotations

import ctypes
import functools
import os
import types
import typing
from collections.abc import Callable
from typing import Annotated, Any, NamedTuple

import numpy as np

from sheldrake.common.record import Record, annotations_of, view_of, width_of

Vector = Annotated[np.ndarray, "float64", 1]
Matrix = Annotated[np.ndarray, "float64", 2]
IntVector = Annotated[np.ndarray, "int64", 1]
IntMatrix = Annotated[np.ndarray, "int64", 2]
Vectors = Annotated[tuple, "float64", 1]
"""A tuple of `Vector`, any number; a kernel takes `len(u)` and `u[i]`."""

INDEX_ERROR = -(2**63)
"""Status of a kernel compiled with bounds checks that left an array."""
DISAGREEMENT = INDEX_ERROR + 2
"""Status of a kernel on lanes (`LaneKernel`) whose worlds would have gone different ways."""
MISFIT = INDEX_ERROR + 1
"""Status of a query (`common.calls`) whose arguments are not the arrays it takes; nothing has run."""


class ArraySpec(NamedTuple):
    """One array argument: its element type, number of axes, and whether `words` hold an absolute address.

    width: How long the rows of a matrix are, where records say so; None elsewhere.
    """

    dtype: str
    ndim: int
    absolute: bool
    width: int | None


class Parameter(NamedTuple):
    """One parameter of an entry kernel.

    kind: "t" (the ABI's time), "float", "int", "array", "tuple" (a NamedTuple class), "record" (a vector by the names
    of a Record), or "arrays" (`Vectors`).
    """

    name: str
    kind: str
    fields: tuple[ArraySpec, ...]
    cls: Any


def jit_enabled() -> bool:
    """False when the environment variable SHELDRAKE_JIT is 0: bound kernels then run as plain Python."""
    return os.environ.get("SHELDRAKE_JIT", "1") != "0"


class Kernel:
    """A function in plain loops, callable as Python and bindable as native code. Made by `kernel`."""

    __name__: str
    __qualname__: str

    def __init__(
        self,
        function: Callable,
        top: bool,
        outline: bool,
        strict: bool,
        short_loops: bool = False,
        lanes: Callable[..., LaneMemory] | None = None,
    ):
        self.py_func, self.top, self.outline, self.strict = function, top, outline, strict
        self.short_loops, self.lanes = short_loops, lanes
        functools.update_wrapper(self, function)

    def __call__(self, *args: Any) -> Any:
        """Runs the Python source; an entry's vectors that are records have their names there."""
        if self.top and self._records:
            args = tuple(view(a) if view and isinstance(a, np.ndarray) else a for a, view in zip(args, self._records))
        return self.py_func(*args)

    def __repr__(self) -> str:
        return f"<kernel {self.__module__}.{self.__qualname__}>"

    def __reduce__(self) -> str:
        return self.__qualname__

    @functools.cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, in order."""
        code = self.py_func.__code__
        return code.co_varnames[: code.co_argcount]

    @functools.cached_property
    def model_names(self) -> tuple[str, ...]:
        """Names of the parameters that are constant arrays."""
        return tuple(name for name in self.names if name == "model" or name.endswith("_model"))

    @functools.cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """What the annotations of an entry kernel declare.

        Raises:
            TypeError: if the kernel is not an entry, or a parameter has no annotation that a kernel can take.
        """
        if not self.top:
            raise TypeError(f"{self!r} is an inner kernel: only @kernel(top=True) can be bound.")
        hints = annotations_of(self.py_func)
        return tuple(_parameter(self, name, hints.get(name)) for name in self.names)

    @functools.cached_property
    def _records(self) -> tuple:
        """Of each parameter how it is seen, if it is a record; empty if none is."""
        hints = annotations_of(self.py_func)
        views = tuple(view_of(hints[name]) if _is_record(hints.get(name)) else None for name in self.names)
        return views if any(views) else ()

    @functools.cached_property
    def on_complex(self) -> ComplexKernel:
        """The same source on complex arrays, for derivatives; see `ComplexKernel`."""
        return ComplexKernel(self)

    @functools.cached_property
    def on_lanes(self) -> LaneKernel:
        """The same source on four worlds at once; see `LaneKernel`."""
        return LaneKernel(self)

    @property
    def address(self) -> int:
        """Address of the native function in this process, compiled or loaded when first asked for."""
        return self._native[1]

    @property
    def function(self) -> Callable[..., int]:
        """The native function of this process: t, address of the slab, address of the words."""
        return self._native[0]

    @functools.cached_property
    def _native(self) -> tuple[Any, int]:
        from sheldrake.common._native import store

        return store.load(self)

    @functools.cached_property
    def form(self) -> Form:
        """What binds it to arrays that need no check; see `Form`."""
        return Form(self)

    def bind(self, *args: Any, blocks: dict | None = None) -> Bound:
        """A call without arguments on these very arrays, at the cost of a C call.

        The arrays are kept alive and must not be reallocated; floats and ints can be changed with `Bound.set`.

        Args:
            args: The arguments.
            blocks: What kernels bound to the same NamedTuples keep for each other, {} at first.

        Returns:
            A callable that returns the status: 0, or what the kernel says went wrong.

        Raises:
            TypeError: if an argument is not what the annotation says (element type, axes, C order).
        """
        from sheldrake.common._native.binding import HERE, arguments

        described, places = arguments(self, args, blocks, HERE)
        words = described.words
        if not jit_enabled():
            given = list(args)
            bound = Bound(lambda: self(*given) or 0)
            bound.scalars = {n: (given, i) for i, n in enumerate(self.names)}
        else:
            time = next((a for p, a in zip(self.parameters, args) if p.kind == "t"), 0.0)
            # Objects of ctypes are converted once here, numbers would be in each call.
            null, where = ctypes.c_void_p(None), ctypes.c_void_p(HERE.place(words))
            bound = Bound(self.function, ctypes.c_double(time), null, where)
            seen = {"float": words.view(np.float64), "int": words}
            bound.scalars = {n: (seen[kind], i) for n, (i, kind) in places.items()}
        bound.keep = words, args
        return bound

    def native(self, *args: Any) -> int:
        """Binds and calls once."""
        return self.bind(*args)()


class ComplexKernel(Kernel):
    """An entry kernel compiled for arrays of complex numbers; models and single numbers stay as they are.

    An imaginary part stands for a first derivative, scaled down so far that its square is nothing beside 1: what comes
    out is what dual numbers would give (the complex step: Squire and Trapp, SIAM Review 40, 1998, with functions taken
    to first order). Comparisons are of real parts.
    """

    def __init__(self, kernel: Kernel):
        super().__init__(kernel.py_func, kernel.top, kernel.outline, kernel.strict, kernel.short_loops)
        self.real, self.__qualname__ = kernel, f"{kernel.__qualname__}.on_complex"

    @functools.cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Those of the kernel, their float64 arrays complex."""

        def spec(field: ArraySpec) -> ArraySpec:
            plain = field.absolute or field.dtype != "float64"
            return field if plain else field._replace(dtype="complex128")

        return tuple(p._replace(fields=tuple(spec(f) for f in p.fields)) for p in self.real.parameters)


class LaneMemory(NamedTuple):
    """What of its arguments a kernel needs that four worlds call at once: arrays, or parts of such.

    Attributes:
        constant: what it reads that no step changes.
        reads: what else it reads before it writes it, whether kernels before it wrote that or not.
        writes: what it writes, all of it; what it leaves out is the same in all worlds, and never changes.
        tables: matrices of which it writes the first rows, all of each, with where it says how many they are.
        changes: what others wrote before it, of which it may leave something else when worlds do not agree in it.
    """

    constant: tuple[np.ndarray, ...] = ()
    reads: tuple[np.ndarray, ...] = ()
    writes: tuple[np.ndarray, ...] = ()
    tables: tuple[tuple[np.ndarray, np.ndarray], ...] = ()
    changes: tuple[np.ndarray, ...] = ()


class LaneKernel(Kernel):
    """An entry kernel compiled for four worlds at once: a float is four of them, one a world, in a vector register.

    Its slab has each number of four slabs of one layout, one after the other. Models are those of all four, and so is
    where the kernel goes: `if` and `while` may ask about lanes, but where these do not agree the kernel is left, with
    the status `DISAGREEMENT`, and worlds are to be taken one by one. `a if x > y else b` chooses for each lane, and
    `in_any(x > y)` says whether something must be done for one of them at least.
    """

    def __init__(self, kernel: Kernel):
        super().__init__(kernel.py_func, kernel.top, kernel.outline, kernel.strict, kernel.short_loops)
        self.alone, self.__qualname__ = kernel, f"{kernel.__qualname__}.on_lanes"

    @functools.cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Those of the kernel, their arrays of four worlds."""
        types = {"float64": "lanes", "int64": "four ints"}

        def spec(field: ArraySpec) -> ArraySpec:
            return field if field.absolute else field._replace(dtype=types[field.dtype])

        return tuple(p._replace(fields=tuple(spec(f) for f in p.fields)) for p in self.alone.parameters)


class Bound(functools.partial):
    """A kernel on fixed arrays; call it without arguments."""

    scalars: dict[str, tuple]
    keep: tuple

    def set(self, name: str, value: float) -> None:
        """Changes the float or int parameter `name` for the next calls."""
        where, at = self.scalars[name]
        where[at] = value


class Form:
    """Where each argument of a kernel without `Vectors` stands among its words: binds it at a fraction of the cost.

    Args:
        kernel: An entry kernel.
    """

    _NUMBERS: typing.ClassVar[dict[str, list[int]]] = {"t": [], "float": [0], "int": [0]}
    """Words of parameters that are numbers."""

    def __init__(self, kernel: Kernel):
        from sheldrake.common._native.binding import HERE, first_words

        self._kernel, self._place, self._places = kernel, HERE.place, HERE.places
        begin = first_words(kernel)
        self._parts = [(p.name, p.kind, any(field.absolute for field in p.fields)) for p in kernel.parameters]
        self._scalars = {p.name: (p.kind, begin[p.name]) for p in kernel.parameters if p.kind in ("float", "int")}

    def words(self, arrays: dict[str, Any], known: dict[str, list[int]]) -> np.ndarray:
        """The words for arrays that are of the right types and axes; floats and ints are 0.

        Args:
            arrays: By name of the parameter.
            known: Words of parameters that were bound before to the same arrays, and where new ones of models are kept.
        """
        words: list[int] = []
        for name, kind, absolute in self._parts:
            if kind in self._NUMBERS:
                words += self._NUMBERS[kind]
                continue
            found = known.get(name)
            if found is None:
                found, shift = [], 0 if absolute else 3
                parts = arrays[name] if kind == "tuple" else (arrays[name],)
                for array, where in zip(parts, self._places(parts)):
                    found += (where >> shift, *array.shape)
                if absolute:
                    known[name] = found
            words += found
        return np.array([*words, 0], np.int64)

    def bind(self, words: np.ndarray, arrays: tuple) -> Bound:
        """The kernel on such words, which `Bound.set` changes; the arrays that they are of are kept alive."""
        where = ctypes.c_void_p(self._place(words))
        bound = Bound(self._kernel.function, ctypes.c_double(0.0), ctypes.c_void_p(None), where)
        seen = {"float": words.view(np.float64), "int": words}
        bound.scalars = {name: (seen[kind], at) for name, (kind, at) in self._scalars.items()}
        bound.keep = words, arrays
        return bound


def _parameter(owner: Kernel, name: str, hint: object) -> Parameter:
    absolute = name == "model" or name.endswith("_model")
    if hint is float:
        return Parameter(name, "t" if name == "t" and owner.names[0] == "t" else "float", (), None)
    if hint is int:
        return Parameter(name, "int", (), None)
    if (spec := _array(hint, absolute)) is not None:
        return Parameter(name, "array", (spec,), None)
    if hint == Vectors:
        return Parameter(name, "arrays", (ArraySpec("float64", 1, absolute, None),), None)
    if _is_record(hint):
        view = view_of(hint)
        (part,) = view.PARTS
        return Parameter(name, "record", (ArraySpec(part.dtype, 1, absolute, None),), view)
    if isinstance(hint, type) and issubclass(hint, tuple) and hasattr(hint, "_fields"):
        fields = _fields(hint, absolute)
        if None not in fields:
            return Parameter(name, "tuple", typing.cast(Any, fields), hint)
    raise TypeError(
        f"{owner!r}: parameter {name!r} is annotated {hint!r}; a kernel takes Vector, Matrix, IntVector, IntMatrix, "
        "Vectors, float, int, a Record, or a NamedTuple of arrays."
    )


@functools.cache
def _fields(cls: type, absolute: bool) -> tuple[ArraySpec | None, ...]:
    """The arrays of a NamedTuple; None for what is no array."""
    if (parts := getattr(cls, "PARTS", None)) is not None:  # a table knows them
        return tuple(ArraySpec(p.dtype, p.ndim, absolute, width_of(p.ndim, p.seen)) for p in parts)
    hints = annotations_of(cls)
    return tuple(_array(hints[name], absolute) for name in cls._fields)  # type: ignore[attr-defined]


def _is_record(hint: object) -> bool:
    return isinstance(hint, type) and issubclass(hint, Record)


def _array(hint: Any, absolute: bool) -> ArraySpec | None:
    meta = getattr(hint, "__metadata__", None)
    if meta is None or getattr(hint, "__origin__", None) is not np.ndarray:
        return None
    return ArraySpec(meta[0], meta[1], absolute, width_of(meta[1], meta[2:]))


def kernel(
    function: Callable | None = None,
    *,
    top: bool = False,
    outline: bool = False,
    strict: bool = False,
    short_loops: bool = False,
    lanes: Callable[..., LaneMemory] | None = None,
) -> Any:
    """Makes a kernel of a function in plain loops; see the module's text for the kinds.

    Args:
        function: the function, when used without parentheses.
        top: an entry, which Python may bind.
        outline: an inner kernel that is compiled once and called, rather than inlined.
        strict: no contraction or reordering of floating point: the bits of the Python source.
        short_loops: an entry whose loops run some ten times, as often as a robot has joints: they are neither unrolled
            nor given vector instructions, whose beginning and end would cost more than the rest.
        lanes: of an entry that four worlds may call at once: given its arguments, which of the memory it needs.
    """
    if function is None:
        return lambda f: Kernel(f, top, outline, strict, short_loops, lanes)
    if not isinstance(function, types.FunctionType):
        raise TypeError(f"@kernel takes a Python function, not {function!r}.")
    return Kernel(function, top, outline, strict, short_loops, lanes)
