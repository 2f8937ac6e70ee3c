"""Where values are: items of arrays, rows and fields of tables, tuples that are indexed at run time.

`f` is the `Function` that is being compiled. With bounds checks, what leaves an array leaves the function (`f.check`).
"""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING, Any

from sheldrake.common._native.compiler import scalars
from sheldrake.common._native.compiler.body import struct_of
from sheldrake.common._native.compiler.kinds import (
    FOUR_INTS,
    INT,
    LANES,
    Array,
    Kind,
    Row,
    Rows,
    Scalar,
    Tuple,
    Value,
    Vectors,
)
from sheldrake.common._native.compiler.scalars import Unfit, convert
from sheldrake.common.record import Each, Field, Items, no_such_field

if TYPE_CHECKING:
    from sheldrake.common._native.compiler.function import Function
    from sheldrake.common.record import Layout


class Place:
    """One number in memory, or a tuple of them one after the other."""

    def __init__(self, dtype: Scalar, pointer: str, layout: Layout | None = None) -> None:
        self.dtype, self.pointer = dtype, pointer
        self.kind = _kind_of(INT if dtype is FOUR_INTS else dtype, layout)

    def parts(self, f: Function) -> list[str]:
        """Where its leaves are."""
        element, count = self.dtype.element, len(self.kind.leaves) // len(self.dtype.leaves)
        places = [self.pointer, *(f.b.at(element, self.pointer, i) for i in range(1, count))][:count]
        if len(self.dtype.leaves) == 1:
            return places
        return [f.b.op(f"getelementptr inbounds {element}, ptr {p}, i32 0, i32 {i}") for p in places for i in (0, 1)]

    def read(self, f: Function) -> Value:
        """Its value."""
        return Value(self.kind, tuple(f.b.load(k, f.check_memory(p)) for k, p in zip(self.kind.leaves, self.parts(f))))

    def write(self, f: Function, value: Value) -> None:
        """Stores what is of its kind, or of a lower one."""
        value = f.fit(value, self.kind, "is stored where there is room for")
        for kind, leaf, pointer in zip(self.kind.leaves, value.leaves, self.parts(f)):
            if self.dtype is FOUR_INTS:
                kind, leaf = FOUR_INTS.element, f.b.spread(kind, leaf)
            f.b.store(kind, leaf, f.check_memory(pointer))


def shift_of(dtype: Scalar) -> int:
    """A place in a slab times two to this are bytes; a slab of four worlds has four words at each place."""
    return 5 if dtype in (LANES, FOUR_INTS) else 3


def _kind_of(dtype: Scalar, layout: Layout | None) -> Kind:
    """The kind of a layout of `record`; None is a number's."""
    if layout is None:
        return dtype
    parts = (1,) * layout if isinstance(layout, int) else layout
    return Tuple(tuple(_kind_of(dtype, None if part == 1 else part) for part in parts), None)


def place_of(f: Function, e: ast.Subscript | ast.Attribute) -> Place:
    """What `array[i, j]` or `row.field` stand for when something is stored there."""
    base = f.value(e.value)
    if isinstance(e, ast.Subscript):
        if isinstance(base.kind, Array):
            return item(f, base, e)
        raise Unfit(f"nothing can be stored into an item of {base.kind!r}")
    place = field(f, base, e.attr)
    if isinstance(place, Value) and isinstance(place.kind, (Array, Rows)):
        raise Unfit(f"`{e.attr}` is an array: store into its items")
    if place is None or isinstance(place, Value):
        raise Unfit(f"nothing can be stored into an attribute of {base.kind!r}")
    return place


def item(f: Function, base: Value, e: ast.Subscript) -> Place:
    """An item of an array."""
    b, kind = f.b, base.kind
    indices = [f.value(p) for p in (e.slice.elts if isinstance(e.slice, ast.Tuple) else [e.slice])]
    fits = all(isinstance(i.kind, Scalar) and i.kind.rank <= INT.rank for i in indices)
    if len(indices) != kind.ndim or not fits:
        given = ", ".join(repr(i.kind) for i in indices)
        raise f.error(e.slice, f"an {kind!r} takes {kind.ndim} int as index, not ({given})")
    _refuse_negative(f, e, *indices)
    places = [convert(b, i, INT).leaves[0] for i in indices]
    for i, n in zip(places, base.leaves[1:]):
        f.check_index(i, n)
    at = places[0]
    for i, n in zip(places[1:], base.leaves[2:]):
        at = b.op(f"add nsw i64 {b.op(f'mul nsw i64 {at}, {n}')}, {i}")
    return Place(kind.dtype, b.at(kind.dtype.element, base.leaves[0], at))


def _refuse_negative(f: Function, e: ast.Subscript, *indices: Value) -> None:
    if any(i.known is not None and i.known < 0 for i in indices):
        raise f.error(e.slice, "an index in a kernel does not count from the end: write `a[a.shape[0] - 1]`")


def vector(f: Function, u: Value, i: str) -> Value:
    """One of `Vectors`."""
    b, (slab, pairs, count) = f.b, u.leaves
    f.check_index(i, count)
    at = b.op(f"shl i64 {i}, 1")
    offset = b.load("i64", b.op(f"getelementptr i64, ptr {pairs}, i64 {at}"))
    size = b.load("i64", b.op(f"getelementptr i64, ptr {pairs}, i64 {b.op(f'add i64 {at}, 1')}"))
    address = b.op(f"add i64 {slab}, {b.op(f'shl i64 {offset}, {shift_of(u.kind.dtype)}')}")
    return Value(Array(u.kind.dtype, 1), (b.op(f"inttoptr i64 {address} to ptr"), size))


# ---- tables


def row_at(f: Function, base: Value, i: str) -> Value:
    """`table[i]` or `table.trees[i]`: for each matrix that has something of it, where it begins there."""
    kind, title = base.kind, base.kind.name
    if isinstance(kind, Rows):
        title = kind.items.record.__name__
        matrices = [(Value(kind.matrix, base.leaves), kind.items.name, kind.items.record)]
    else:
        parts = [(n, part) for n, part in enumerate(kind.parts) if part.counted is not None]
        matrices = [(base.item(n), part.name, part.counted) for n, part in parts]
    leaves = [leaf for m, _, what in matrices for leaf in _begin(f, m, i, getattr(what, "number", 1))]
    return Value(Row(title, tuple((m.kind, name, what) for m, name, what in matrices)), tuple(leaves))


def _begin(f: Function, matrix: Value, i: str, times: int) -> tuple[str, str]:
    b, (data, height, width) = f.b, matrix.leaves
    f.check_index(i, height if times == 1 else b.op(f"udiv i64 {height}, {times}"))
    at = i if times == 1 else b.op(f"mul nsw i64 {i}, {times}")
    return b.at(matrix.kind.dtype.element, data, b.op(f"mul nsw i64 {at}, {width}")), width


def field(f: Function, base: Value, name: str) -> Place | Value | None:
    """A field of a row or table: a place, or, of one that is an array, its value; None of what has no fields."""
    kind = base.kind
    if isinstance(kind, Row):
        n, what = _named(kind.name, name, kind.places)
        begin, width = base.leaves[2 * n : 2 * n + 2]
        matrix = kind.sources[n][0]
        if isinstance(what, Each):
            return Value(matrix, (begin, str(what.number), width))
        return _field(f, matrix.dtype, begin, width, what)
    if not isinstance(kind, Tuple) or not kind.cls:
        return None
    n, what = _named(kind.name, name, kind.places)
    where, part = base.item(n), what and kind.parts[n]
    if what is None:
        return where
    if isinstance(what, Items):
        return Value(Rows(where.kind, what), where.leaves)
    dtype = where.kind.dtype
    if part.ndim == 1:
        return _field(f, dtype, where.leaves[0], where.leaves[1], what)
    data, height, width = where.leaves
    f.check_index(str(what.at), height)
    at = f.b.op(f"mul nsw i64 {what.at}, {width}")
    return Value(Array(dtype, 1), (f.b.at(dtype.element, data, at), width))


def _named(owner: str, name: str, places: dict[str, tuple[int, Any]]) -> tuple[int, Any]:
    if name not in places:
        raise Unfit(no_such_field(owner, name, [n for n in places if n[0] != "_"]))
    return places[name]


def _field(f: Function, dtype: Scalar, begin: str, width: str, field: Field) -> Place | Value:
    """A field of a row of `width` numbers that begins at `begin`."""
    if field.size or field.at:
        f.check_index(str(field.at + field.size - 1), width)
    where = f.b.at(dtype.element, begin, field.at) if field.at else begin
    if field.kind in ("number", "tuple"):
        return Place(dtype, where, field.layout)
    if field.kind == "rest":
        return Value(Array(dtype, 1), (where, f.b.op(f"sub i64 {width}, {field.at}")))
    return Value(Array(dtype, len(field.shape)), (where, *map(str, field.shape)))


# ---- tuples


def table_of(f: Function, items: Value) -> str:
    """Memory that holds a tuple of like items."""
    element = struct_of(items.kind.items[0].leaves)
    table = f.b.slot(f"[{len(items.kind.items)} x {element}]")
    for i in range(len(items.kind.items)):
        value = items.item(i)
        for j, (kind, leaf) in enumerate(zip(value.kind.leaves, value.leaves)):
            f.b.store(kind, leaf, f.b.op(f"getelementptr inbounds {element}, ptr {table}, i64 {i}, i32 {j}"))
    return table


def look_up(f: Function, items: Value, table: str, i: Value) -> Value:
    """Item i of a tuple in memory."""
    kind = items.kind.items[0]
    f.check_index(i.leaves[0], str(len(items.kind.items)))
    how = f"getelementptr inbounds {struct_of(kind.leaves)}, ptr {table}, i64 {i.leaves[0]}, i32"
    return Value(kind, tuple(f.b.load(k, f.b.op(f"{how} {j}")) for j, k in enumerate(kind.leaves)))


def subscript(f: Function, e: ast.Subscript) -> Value:
    """The value of `base[...]`."""
    base = f.value(e.value)
    kind = base.kind
    if isinstance(kind, Array):
        return item(f, base, e).read(f)
    if isinstance(e.slice, (ast.Slice, ast.Tuple)):
        raise f.error(e.slice, f"{kind!r} takes one int as index")
    i = f.value(e.slice)
    if isinstance(kind, Tuple) and not any(part.counted for part in kind.parts):
        return _item_of_tuple(f, e, base, i)
    _refuse_negative(f, e, i)
    at = scalars.convert(f.b, i, INT).leaves[0]
    if isinstance(kind, (Tuple, Rows)):
        return row_at(f, base, at)
    if isinstance(kind, Vectors):
        return vector(f, base, at)
    raise f.error(e.value, f"{kind!r} has no items")


def _item_of_tuple(f: Function, e: ast.Subscript, base: Value, i: Value) -> Value:
    count = len(base.kind.items)
    if isinstance(i.known, int):
        if not -count <= i.known < count:
            raise Unfit(f"{base.kind!r} has {count} items and no item {i.known}")
        return base.item(i.known % count)
    if i.kind is not INT:
        raise f.error(e.slice, f"{base.kind!r} takes an int as index, not {i.kind!r}")
    if len(set(base.kind.items)) != 1:
        raise f.error(e.slice, f"which item of {base.kind!r} must be known: they are of several kinds")
    return look_up(f, base, table_of(f, base), i)
