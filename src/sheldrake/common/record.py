"""Names for what is in the arrays of kernels: `contact.stiffness` where an array alone would be `law[c, 0]`.

A `Record` says what is in a row, in order. The declaration is the documentation; `help(ContactLaw)` prints it:

    class ContactLaw(Record):
        stiffness = number("k", "N/m")
        p_WC = numbers(3, "contact point in W", "m")        # a tuple
        V_WB = numbers((3, 3), "spatial velocity")          # a tuple of tuples: what layouts have, see `numbers`
        weights = array((2, 7), "of two methods")           # an array: for places that are chosen at run time
        dofs = array(..., "dofs that move it", dtype=int)   # all that follows in the row

A `table` is a NamedTuple of arrays, some of them annotated with what is in them. The arrays stay plain ndarrays of any
element type, that others may read by number (`law[:, ContactLaw.stiffness]`); names are another way to the same memory.

    @table
    class Contacts(NamedTuple):
        index: Annotated[IntMatrix, ContactIndex]
        law: Annotated[Matrix, ContactLaw]                # contacts[c].stiffness; `contacts[c]` has the fields of
        J: Annotated[Matrix, Each(3)]                     #   all matrices with records; contacts[c].J is three rows
        option: Annotated[Vector, Options]                # contacts.dt: a record that there is only one of
        x: Annotated[Matrix, DofVectors]                  # contacts.v[k]: a `Stack` names rows, each a vector
        tree: Annotated[IntMatrix, Items("trees", Tree)]  # contacts.trees[t].first_dof, len(contacts.trees)

Several `Items` may stand at one array: views of rows that hold different things. An entry kernel takes a record itself
for a vector that has nothing else: `law: ContactLaw`; `ContactLaw.of(stiffness=..., ...)` makes such a vector.

This is what runs as Python, on floats, complex numbers and objects: properties that read and write the arrays. The
kernel compiler makes addresses of the same declarations (`_native/compiler`). Needs NumPy only.
"""

from __future__ import annotations

import collections
import functools
import sys
import types
import typing
from typing import TYPE_CHECKING, Annotated, Any, NoReturn, SupportsIndex

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import ArrayLike

Layout = typing.Union[int, "tuple[Layout, ...]"]
"""What a tuple looks like: 3 is (x, y, z), (3, 3) is ((a, b, c), (d, e, f)), (1, 3) is (a, (b, c, d))."""


class Field:
    """One named place in a record: `size` numbers from column `at` on.

    `layout` is None of a number or an array, 0 of an array that takes the rest of the row, a `Layout` of a tuple;
    `shape` is that of an array, () of what is none. As an index of NumPy a field is its column.
    """

    def __init__(self, layout: Any, shape: tuple, about: str, unit: str, dtype: str, same_as: Field | None):
        self.layout, self.shape, self.about, self.unit, self.dtype = layout, shape, about, unit, dtype
        self.same_as, self.name, self.at = same_as, "", 0
        self.size = 0 if layout == 0 else int(np.prod(shape)) if shape else 1 if layout is None else _size(layout)

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __index__(self) -> int:
        if self.size != 1:
            raise TypeError(f"{self.name} takes {self.size or 'all further'} columns: use `{self.name}.columns`.")
        return self.at

    @property
    def columns(self) -> slice:
        """Its columns in the array."""
        return slice(self.at, self.at + self.size if self.size else None)

    @property
    def kind(self) -> str:
        """What a kernel gets: "number", "tuple", "array" of known shape, or "rest" of the row."""
        if self.layout == 0:
            return "rest"
        return "array" if self.shape else "number" if self.layout is None else "tuple"

    def __repr__(self) -> str:
        return f"{self.name}@{self.at}:{self.layout}{self.shape}{self.dtype[0]}"

    def described(self) -> str:
        """A line of documentation: name, shape, unit, meaning."""
        shape = {"number": "", "rest": "(...)"}.get(self.kind, f"{self.shape or self.layout}")
        what = " ".join(filter(None, (shape, self.unit and f"[{self.unit}]")))
        return f"    {self.name:20s} {what:14s} {self.about}"


def _size(layout: Layout) -> int:
    return layout if isinstance(layout, int) else sum(map(_size, layout))


def _name_of(dtype: type) -> str:
    return {float: "float64", int: "int64"}[dtype]


def number(about: str, unit: str = "", same_as: Field | None = None) -> Any:
    """A float; `same_as` an earlier field: another name and meaning of the same memory."""
    return Field(None, (), about, unit, "float64", same_as)


def integer(about: str, same_as: Field | None = None) -> Any:
    """An integer."""
    return Field(None, (), about, "", "int64", same_as)


def numbers(layout: Layout, about: str, unit: str = "", same_as: Field | None = None) -> Any:
    """A tuple of floats: `layout` is how many, or a tuple of how many each item has (1: a number)."""
    return Field(layout, (), about, unit, "float64", same_as)


def integers(layout: Layout, about: str, same_as: Field | None = None) -> Any:
    """A tuple of integers."""
    return Field(layout, (), about, "", "int64", same_as)


def array(shape: Any, about: str, unit: str = "", dtype: type = float, same_as: Field | None = None) -> Any:
    """An array in the record, of one or two axes; `...` for the rest of the row."""
    if shape is ...:
        return Field(0, (), about, unit, _name_of(dtype), same_as)
    return Field(None, (shape,) if isinstance(shape, int) else shape, about, unit, _name_of(dtype), same_as)


def vector(about: str, unit: str = "", dtype: type = float, same_as: Field | None = None) -> Any:
    """A row of a `Stack`."""
    return Field(None, (), about, unit, _name_of(dtype), same_as)


class _Meta(type):
    FIELDS: tuple[Field, ...]
    SIZE: int

    def __new__(mcs, name: str, bases: tuple, body: dict) -> _Meta:
        cls = super().__new__(mcs, name, bases, body)
        at, fields = 0, [v for v in body.values() if isinstance(v, Field)]
        for f in fields:
            f.at = at if f.same_as is None else f.same_as.at
            at = max(at, f.at + f.size)
        cls.FIELDS, cls.SIZE = tuple(fields), at
        cls.__doc__ = "\n".join([(cls.__doc__ or "").rstrip(), "", *(f.described() for f in fields)])
        return cls

    def __repr__(cls) -> str:  # what the name of a compiled file depends on
        return f"{cls.__name__}{cls.FIELDS}"


class Record(metaclass=_Meta):
    """What is in a row of a matrix, or in a vector that there is only one of."""

    @classmethod
    def view(cls, vector: np.ndarray) -> Any:
        """The names, on a vector's own memory."""
        return view_of(cls)(vector)

    @classmethod
    def of(cls, **values: ArrayLike) -> np.ndarray:
        """A vector of these values, by name.

        Raises:
            TypeError: a field has no value, or a name is none of the fields.
        """
        own = {f.name: f for f in cls.FIELDS if f.same_as is None}
        for name in values:
            if name not in own:
                raise TypeError(no_such_field(cls.__name__, name, own))
        if missing := own.keys() - values.keys():
            raise TypeError(f"{cls.__name__}.of() needs {', '.join(x for x in own if x in missing)} too.")
        return np.concatenate([_numbers_of(f, values[name]) for name, f in own.items()]).astype(_dtype_of(cls))


class Stack(metaclass=_Meta):
    """What the rows of a matrix are, each a vector."""


class Each(typing.NamedTuple):
    """So many rows of a matrix for each item of a table."""

    number: int


class Items(typing.NamedTuple):
    """A matrix whose rows are counted by something else than the table's: `table.<name>[i]`."""

    name: str
    record: type


class Part(typing.NamedTuple):
    """How one array of a table is seen: `seen` has a Record, a Stack, an `Each`, or any number of `Items`."""

    name: str
    dtype: str
    ndim: int
    seen: tuple

    @property
    def counted(self) -> Any:
        """What `table[i]` has of it: a Record, an `Each`, or None."""
        for what in self.seen:
            if isinstance(what, Each) or (self.ndim == 2 and _is_record(what)):
                return what
        return None

    @property
    def single(self) -> type[Record] | None:
        """What the table itself has of it: a Record of a vector, a Stack of a matrix, or None."""
        for what in self.seen:
            if isinstance(what, type) and (issubclass(what, Stack) or (self.ndim == 1 and _is_record(what))):
                return what
        return None

    @property
    def items(self) -> tuple[Items, ...]:
        """What else its rows are."""
        return tuple(what for what in self.seen if isinstance(what, Items))


def _numbers_of(f: Field, value: Any) -> np.ndarray:
    numbers = np.ravel(_flat(value, f.layout, f.name) if f.kind == "tuple" else value)
    if f.size not in (0, len(numbers)):
        raise TypeError(f"{f.name} takes {f.size} number{'s' * (f.size > 1)}, not {len(numbers)}.")
    return numbers


def _dtype_of(record: type[Record]) -> str:
    return "int64" if all(f.dtype == "int64" for f in record.FIELDS) else "float64"


@functools.cache
def view_of(record: type[Record]) -> Any:
    """A table of one vector that is a record: what the parameter `law: ContactLaw` of a kernel is."""
    make: Any = collections.namedtuple
    cls = make(record.__name__, "_", rename=True)  # a name that no field has, and that is not told
    cls.__annotations__ = {cls._fields[0]: Annotated[np.ndarray, _dtype_of(record), 1, record]}
    cls.RECORD = record
    cls.__repr__ = lambda self: "\n".join([record.__name__, *_lines(self, record.FIELDS)])
    return table(cls)


def _is_record(what: object) -> bool:
    return isinstance(what, type) and issubclass(what, Record)


def width_of(ndim: int, seen: Iterable[Any]) -> int | None:
    """How long the rows of a matrix are, by what is in them: as the longest record; None if records do not say."""
    records = [getattr(what, "record", what) for what in seen] if ndim == 2 else []
    if not records or not all(_is_record(r) and all(f.kind != "rest" for f in r.FIELDS) for r in records):
        return None
    return max(r.SIZE for r in records)


def annotations_of(owner: Any) -> dict[str, Any]:
    """What the annotations of a function or NamedTuple of a module stand for.

    Most are names of that module; to look these up takes a tenth of the time of `typing.get_type_hints`.
    """
    scope = owner.__globals__ if isinstance(owner, types.FunctionType) else vars(sys.modules[owner.__module__])

    def meant(annotation: Any) -> Any:
        text = getattr(annotation, "__forward_arg__", annotation)
        if not isinstance(text, str):
            return annotation
        return scope[text] if text in scope else eval(text, scope)

    return {name: meant(annotation) for name, annotation in owner.__annotations__.items()}


def parts_of(cls: type) -> tuple[Part, ...]:
    """How a table sees its arrays."""
    hints = annotations_of(cls)
    metas = [(name, hints[name].__metadata__) for name in cls._fields]  # type: ignore[attr-defined]
    return tuple(Part(name, m[0], m[1], tuple(m[2:])) for name, m in metas)


def no_such_field(owner: str, name: str, names: Iterable[str]) -> str:
    """What is said about a misspelt field."""
    return f"{owner} has no field {name!r}; it has {', '.join(names)}."


# ---- what runs as Python


class Row:
    """One item of a table; reads and writes the arrays. Prints as its fields."""

    __slots__ = ("_at", "_table")
    FIELDS: tuple = ()
    BLOCKS: tuple[str, ...] = ()

    def __init__(self, table: tuple[Any, ...], at: SupportsIndex):
        self._table, self._at = table, at

    def __repr__(self) -> str:
        return "\n".join([f"{type(self).__name__} {self._at}", *_lines(self, self.FIELDS)])

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(self._unknown(name))

    def __setattr__(self, name: str, value: Any) -> None:
        try:
            object.__setattr__(self, name, value)
        except AttributeError:
            raise AttributeError(self._unknown(name)) from None

    def _unknown(self, name: str) -> str:
        return no_such_field(type(self).__name__, name, [*(f.name for f in self.FIELDS), *self.BLOCKS])


def _lines(owner: Any, fields: tuple) -> list[str]:
    return [f"    {f.name} = {_shown(getattr(owner, f.name))} {f.unit}".rstrip() for f in fields]


def _shown(value: object) -> str:
    if isinstance(value, tuple):
        return f"({', '.join(map(_shown, value))})"
    return str(value)


class _Rows:
    """`table.trees`: rows of one matrix."""

    __slots__ = ("_row", "_table", "_where")

    def __init__(self, table: tuple[Any, ...], where: str, row: type):
        self._table, self._where, self._row = table, where, row

    def __getitem__(self, i: Any) -> Any:
        return self._row(self._table, i)

    def __len__(self) -> int:
        return len(getattr(self._table, self._where))


def _tuple_of(values: list, layout: Layout) -> tuple:
    if isinstance(layout, int):
        return tuple(values)
    items, at = [], 0
    for part in layout:
        n = _size(part)
        items.append(values[at] if part == 1 else _tuple_of(values[at : at + n], part))
        at += n
    return tuple(items)


def _flat(value: Any, layout: Layout, name: str) -> list:
    wanted = layout if isinstance(layout, int) else len(layout)
    if len(value) != wanted:
        raise TypeError(f"{name} takes a tuple of {wanted}, not of {len(value)}.")
    if isinstance(layout, int):
        return list(value)
    return [x for v, part in zip(value, layout) for x in ([v] if part == 1 else _flat(v, part, name))]


def _property(f: Field, row_of: Any) -> property:
    """Property for a field of the row that `row_of(object)` gives, a vector."""
    at, end = f.at, f.at + f.size
    if f.kind == "number":

        def put(owner: Any, value: Any) -> None:
            row_of(owner)[at] = value

        return property(lambda owner: row_of(owner)[at], put, doc=f.about)
    if f.kind == "rest":
        return property(lambda owner: row_of(owner)[at:], doc=f.about)
    if f.kind == "array":
        return property(lambda owner: row_of(owner)[at:end].reshape(f.shape), doc=f.about)

    def put_all(owner: Any, values: Any) -> None:
        flat, row = _flat(values, f.layout, f.name), row_of(owner)
        for i, value in enumerate(flat, at):
            row[i] = value

    def get_all(owner: Any) -> tuple:
        row = row_of(owner)  # numbers stay NumPy's: quotients by zero as compiled
        return _tuple_of([row[i] for i in range(at, end)], f.layout)

    return property(get_all, put_all, doc=f.about)


def _in_row(array: str, f: Field) -> property:
    return _property(f, lambda row: getattr(row._table, array)[row._at])


def _block(array: str, n: int) -> property:
    return property(lambda row: getattr(row._table, array)[n * row._at : n * row._at + n])


def _of_table(number: int, f: Field) -> property:
    """Of a field of the vector that is item `number` of a table."""
    item, at = tuple.__getitem__, f.at
    if f.kind != "number":
        return _property(f, lambda table: item(table, number))

    def put(owner: Any, value: Any) -> None:
        item(owner, number)[at] = value

    return property(lambda owner: item(owner, number)[at], put, doc=f.about)


def _in_stack(array: str, f: Field) -> property:
    return property(lambda table: getattr(table, array)[f.at], doc=f.about)


def _items(array: str, record: type[Record]) -> property:
    row = _row_class(record.__name__, [(array, f) for f in record.FIELDS], {})
    return property(lambda table: _Rows(table, array, row), doc=record.__doc__)


def _row_class(name: str, fields: list[tuple[str, Field]], blocks: dict[str, int]) -> type:
    body: dict[str, Any] = {f.name: _in_row(array, f) for array, f in fields}
    body |= {block: _block(block, n) for block, n in blocks.items()}
    body |= {"__slots__": (), "FIELDS": tuple(f for _, f in fields), "BLOCKS": tuple(blocks)}
    return type(name, (Row,), body)


def _check_kinds(cls: type, part: Part) -> None:
    for what in part.seen:
        for f in getattr(getattr(what, "record", what), "FIELDS", ()):
            if f.dtype != part.dtype:
                raise TypeError(f"{cls.__name__}.{part.name} holds {part.dtype}; {f.name!r} is declared {f.dtype}.")


def table(cls: Any) -> Any:
    """Gives a NamedTuple of arrays the names that the records of its annotations have.

    Raises:
        TypeError: if two things have one name, or a field of integers is in an array of floats.
    """
    parts = parts_of(cls)
    taken: set[str] = set(cls._fields)
    of_rows: set[str] = set()

    def take(name: str, names: set[str]) -> None:
        if name in names:
            raise TypeError(f"{cls.__name__}: there are two of {name!r}.")
        names.add(name)

    fields: list[tuple[str, Field]] = []
    blocks: dict[str, int] = {}
    for p in parts:
        _check_kinds(cls, p)
        for items in p.items:
            take(items.name, taken)
            setattr(cls, items.name, _items(p.name, items.record))
        for f in getattr(p.single, "FIELDS", ()):
            take(f.name, taken)
            setattr(cls, f.name, _of_table(cls._fields.index(p.name), f) if p.ndim == 1 else _in_stack(p.name, f))
        if isinstance(p.counted, Each):
            take(p.name, of_rows)
            blocks[p.name] = p.counted.number
        for f in getattr(p.counted, "FIELDS", ()):
            take(f.name, of_rows)
            fields.append((p.name, f))
    if fields or blocks:
        row = _row_class(cls.__name__, fields, blocks)
        cls.__getitem__ = lambda self, i: tuple.__getitem__(self, i) if isinstance(i, slice) else row(self, i)
    names = [name for name in (*cls._fields, *sorted(taken - set(cls._fields))) if name[0] != "_"]
    cls.__getattr__ = lambda self, name: _refuse(cls.__name__, name, names)
    cls.PARTS = parts
    return cls


def _refuse(owner: str, name: str, names: list[str]) -> NoReturn:
    raise AttributeError(no_such_field(owner, name, names))
