"""What a value in a kernel can be. Every value is a flat list of LLVM values, its leaves; kinds say how to read it.

Equal kinds are one object, so that they are compared by `is`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from sheldrake.common.record import Each, Field, Items, Part


class _One(type):
    """Makes one object of equal arguments; of the same thing for a `Constant`, which need not be hashable."""

    made: dict[tuple, Any] = {}

    def __call__(cls, *args: Any) -> Any:
        key = (cls, *(map(id, args) if cls is Constant else args))
        if key not in cls.made:
            cls.made[key] = super().__call__(*args)
        return cls.made[key]


class Kind(metaclass=_One):
    """A kind of value. `leaves` are the LLVM types a value consists of."""

    leaves: tuple[str, ...] = ()
    name = "?"
    holds_arrays = False  # it is an array, or a table of such

    def __repr__(self) -> str:
        return self.name


class Constant(Kind):
    """Something of Python that is no value in machine code: a kernel, a module, a class, a function."""

    def __init__(self, thing: object) -> None:
        self.thing = thing
        self.name = f"{type(thing).__name__} {getattr(thing, '__name__', thing)}"


class Scalar(Kind):
    """A number; `rank` orders them: what is mixed becomes the higher one."""

    def __init__(self, name: str, rank: int, *leaves: str) -> None:
        self.name, self.rank, self.leaves = name, rank, leaves

    @property
    def element(self) -> str:
        """LLVM's type of such a number in memory."""
        return self.leaves[0] if len(self.leaves) == 1 else f"{{{', '.join(self.leaves)}}}"


BOOL, INT, FLOAT = Scalar("bool", 0, "i1"), Scalar("int", 1, "i64"), Scalar("float", 2, "double")
COMPLEX = Scalar("complex", 3, "double", "double")
LANES = Scalar("lanes", 4, "<4 x double>")
"""A float in each of four worlds, see `lanes`."""
MASK = Scalar("lanes of bools", 4, "<4 x i1>")
"""What a comparison of lanes gives, until somebody asks whether it is true."""
FOUR_INTS = Scalar("int", 1, "<4 x i64>")
"""An integer in memory beside lanes: it is there four times, and read as one."""
DTYPES = {"float64": FLOAT, "int64": INT, "complex128": COMPLEX, "lanes": LANES, "four ints": FOUR_INTS}


class Nothing(Kind):
    """What a kernel without a value returns."""

    name = "None"


NONE = Nothing()


class Tuple(Kind):
    """A tuple, or a NamedTuple of class `cls`."""

    def __init__(self, items: tuple[Kind, ...], cls: Any) -> None:
        self.items, self.cls = items, cls
        self.leaves = tuple(leaf for item in items for leaf in item.leaves)
        self.starts = [sum(len(i.leaves) for i in items[:k]) for k in range(len(items))]
        self.name = cls.__name__ if cls else f"({', '.join(map(repr, items))})"
        self.parts: tuple[Part, ...] = getattr(cls, "PARTS", ())  # what a `table` says about its arrays
        self.holds_arrays = bool(self.parts)
        self.places: dict[str, tuple[int, Any]] = {}
        """Which item has what is called so, and the Field or `Items` that it is of a table's array; None: the item."""
        for n, part in enumerate(self.parts):
            self.places |= {items.name: (n, items) for items in part.items}
            self.places |= {f.name: (n, f) for f in getattr(part.single, "FIELDS", ())}
        self.places = {name: (n, None) for n, name in enumerate(getattr(cls, "_fields", ()))} | self.places


class Array(Kind):
    """An array in C order: its address and its shape."""

    holds_arrays = True

    def __init__(self, dtype: Scalar, ndim: int) -> None:
        self.dtype, self.ndim = dtype, ndim
        self.leaves = ("ptr",) + ("i64",) * ndim
        self.name = f"array of {dtype!r}s with {ndim} ax{'i' if ndim == 1 else 'e'}s"


class Vectors(Kind):
    """Any number of vectors: the slab's address, the address of their (offset, size) pairs, their number."""

    leaves = ("i64", "ptr", "i64")

    def __init__(self, dtype: Scalar) -> None:
        self.dtype = dtype
        self.name = f"Vectors of {dtype!r}s"


class Rows(Kind):
    """`table.trees`: a matrix each row of which is a record; the leaves of the matrix."""

    def __init__(self, matrix: Array, items: Items) -> None:
        self.matrix, self.items = matrix, items
        self.leaves = matrix.leaves
        self.name = items.name


class Row(Kind):
    """One item of a table. For each matrix that has something of it: where its row begins, and the row's length.

    `places`: by the name of a field, which of the matrices has it, and the Field or `Each`.
    """

    def __init__(self, title: str, sources: tuple[tuple[Array, str, Any], ...]) -> None:
        self.name, self.sources = title, sources
        self.leaves = ("ptr", "i64") * len(sources)
        self.places: dict[str, tuple[int, Field | Each]] = {}
        for n, (_, name, what) in enumerate(sources):
            if isinstance(what, Each):
                self.places[name] = n, what
            else:
                self.places |= {f.name: (n, f) for f in what.FIELDS}


class Value(NamedTuple):
    """A value: its kind, the names of its leaves, and what it is if that is known while compiling."""

    kind: Any
    leaves: tuple[str, ...]
    known: Any = None

    def item(self, i: int) -> Value:
        """Item i of a tuple."""
        kind = self.kind.items[i]
        start = self.kind.starts[i]
        return Value(kind, self.leaves[start : start + len(kind.leaves)], self.known and self.known[i])

    @staticmethod
    def pack(values: list[Value], cls: type | None = None) -> Value:
        """A tuple of values."""
        kind = Tuple(tuple(v.kind for v in values), cls)
        known = None if any(v.known is None for v in values) else tuple(v.known for v in values)
        return Value(kind, tuple(leaf for v in values for leaf in v.leaves), known)


NOTHING = Value(NONE, ())
