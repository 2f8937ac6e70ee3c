"""A linker of WebAssembly objects, in Python: what wasm-ld does for kernels and libm, so that pages need no linker.

The format is that of LLVM (WebAssembly tool conventions, "Linking"). What is not reached from an export is left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

STACK = 1 << 20
"""Bytes for the stack, which grows down to address 0: what overflows it leaves the memory, and traps."""
_PAGE = 1 << 16
_TYPES, _IMPORTS, _FUNCTIONS, _TABLE, _MEMORY, _GLOBALS, _EXPORTS = range(1, 8)  # sections
_ELEMENTS, _CODE, _DATA = range(9, 12)
_FUNCTION, _DATUM, _GLOBAL, _SECTION, _TAG, _TABLE_SYMBOL = range(6)  # symbols
_WEAK, _LOCAL, _UNDEFINED, _EXPLICIT_NAME = 0x1, 0x2, 0x10, 0x40
_SYMBOL_TABLE, _SEGMENT_INFO = 8, 5  # parts of the section "linking"
_STACK_POINTER, _TABLE_NAME = "__stack_pointer", "__indirect_function_table"
_I32, _FUNCREF = 0x7F, 0x70
_MAGIC = b"\0asm\1\0\0\0"

# Kinds of relocations: how the place is written, and whether a number is added.
_FUNCTION_INDEX, _TABLE_SLEB, _TABLE_I32, _ADDRESS_LEB, _ADDRESS_SLEB, _ADDRESS_I32, _TYPE_INDEX = range(7)
_GLOBAL_INDEX, _TABLE_NUMBER = 7, 20
_ADDENDS = (_ADDRESS_LEB, _ADDRESS_SLEB, _ADDRESS_I32)


def link(objects: Sequence[bytes], exports: Sequence[str]) -> bytes:
    """One module of objects. It imports nothing and exports the functions named, and `memory`, a table that can grow
    (`__indirect_function_table`), and where free memory begins (`__heap_base`).

    Raises:
        RuntimeError: something is not defined, or defined twice, or an object is of a kind that kernels are not.
    """
    return _Module([_Object(data) for data in objects], exports).data()


class _Reader:
    """Reads a WebAssembly file from a place on."""

    def __init__(self, data: bytes, at: int = 0):
        self.data, self.at = data, at

    def take(self, count: int) -> bytes:
        self.at += count
        return self.data[self.at - count : self.at]

    def number(self) -> int:
        """An unsigned number (LEB128)."""
        value = shift = 0
        while True:
            byte = self.data[self.at]
            self.at += 1
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value

    def signed(self) -> int:
        begin = self.at
        value = self.number()
        bits = 7 * (self.at - begin)
        return value - (1 << bits) if value >> (bits - 1) else value

    def name(self) -> str:
        return self.take(self.number()).decode()

    def limits(self) -> None:
        for _ in range(1 + (self.take(1)[0] & 1)):
            self.number()


class _Symbol(NamedTuple):
    """What relocations speak of. `place` is the number of a function or a segment, `offset` within the segment."""

    kind: int
    flags: int
    name: str
    place: int
    offset: int = 0


class _Relocation(NamedTuple):
    kind: int
    at: int
    symbol: int
    addend: int


class _Body(NamedTuple):
    """A function's code or a segment's data, where it begins in its section, and its relocations."""

    at: int
    data: bytes
    relocations: list[_Relocation]


class _Object:
    """An object file, taken apart."""

    def __init__(self, data: bytes):
        if data[:8] != _MAGIC:
            raise RuntimeError("a kernel's code for WebAssembly is no WebAssembly.")
        self.types: list[bytes] = []
        self.imports: list[str] = []  # of functions
        self.function_types: list[int] = []
        self.functions: list[_Body] = []
        self.segments: list[_Body] = []
        self.alignments: list[int] = []
        self.symbols: list[_Symbol] = []
        self._other_imports: dict[int, list[str]] = {}
        for number, name, section in _sections(data):
            if number == _TYPES:
                self._read_types(section)
            elif number == _IMPORTS:
                self._read_imports(section)
            elif number == _FUNCTIONS:
                self.function_types = [section.number() for _ in range(section.number())]
            elif number == _CODE:
                self.functions = [_body(section) for _ in range(section.number())]
            elif number == _DATA:
                self.segments = [_segment(section) for _ in range(section.number())]
            elif name == "linking":
                self._read_linking(section)
            elif name in ("reloc.CODE", "reloc.DATA"):
                _read_relocations(section, self.functions if name == "reloc.CODE" else self.segments)

    def _read_types(self, section: _Reader) -> None:
        for _ in range(section.number()):
            begin = section.at
            section.take(1)
            section.take(section.number())
            section.take(section.number())
            self.types.append(section.data[begin : section.at])

    def _read_imports(self, section: _Reader) -> None:
        for _ in range(section.number()):
            section.name()
            name, kind = section.name(), section.take(1)[0]
            if kind == 0:
                section.number()
                self.imports.append(name)
                continue
            self._other_imports.setdefault(kind, []).append(name)
            if kind == 3:
                section.take(2)
            else:  # a table has the type of its elements before its limits
                section.take(kind == 1)
                section.limits()

    def _read_linking(self, section: _Reader) -> None:
        if (version := section.number()) != 2:
            raise RuntimeError(f"a kernel's object for WebAssembly is of version {version}; this linker reads 2.")
        while section.at < len(section.data):
            kind, size = section.take(1)[0], section.number()
            part = _Reader(section.take(size))
            if kind == _SYMBOL_TABLE:
                self.symbols = [self._read_symbol(part) for _ in range(part.number())]
            elif kind == _SEGMENT_INFO:
                for _ in range(part.number()):
                    part.name()
                    self.alignments.append(1 << part.number())
                    part.number()

    def _read_symbol(self, part: _Reader) -> _Symbol:
        kind, flags = part.take(1)[0], part.number()
        if kind == _SECTION:
            return _Symbol(kind, flags, "", part.number())
        if kind == _DATUM:
            name = part.name()
            if flags & _UNDEFINED:
                return _Symbol(kind, flags, name, -1)
            index, offset, _ = part.number(), part.number(), part.number()
            return _Symbol(kind, flags, name, index, offset)
        index = part.number()
        if not flags & _UNDEFINED or flags & _EXPLICIT_NAME:
            return _Symbol(kind, flags, part.name(), index)
        names = self.imports if kind == _FUNCTION else self._other_imports[1 if kind == _TABLE_SYMBOL else 3]
        return _Symbol(kind, flags, names[index], index)


def _sections(data: bytes) -> Iterator[tuple[int, str, _Reader]]:
    """Number, name if it has one, and content of each section."""
    file = _Reader(data, len(_MAGIC))
    while file.at < len(data):
        number, size = file.take(1)[0], file.number()
        section = _Reader(file.take(size))
        yield number, section.name() if number == 0 else "", section


def _body(section: _Reader) -> _Body:
    size = section.number()
    return _Body(section.at, section.take(size), [])


def _segment(section: _Reader) -> _Body:
    if section.number() != 0:
        raise RuntimeError("a kernel's object for WebAssembly has data that are not placed when it is loaded.")
    section.take(1)  # its place within the object: i32.const PLACE, end
    section.signed()
    section.take(1)
    return _body(section)


def _read_relocations(section: _Reader, bodies: list[_Body]) -> None:
    """Gives each body its relocations; they come in the order of their places."""
    section.number()  # of the section they belong to
    bodies = [body for body in bodies if body.data]
    k = 0
    for _ in range(section.number()):
        kind, at, symbol = section.take(1)[0], section.number(), section.number()
        addend = section.signed() if kind in _ADDENDS else 0
        while at >= bodies[k].at + len(bodies[k].data):
            k += 1
        bodies[k].relocations.append(_Relocation(kind, at - bodies[k].at, symbol, addend))


_Place = tuple[int, int]
"""An object, and a function or a segment in it."""


class _Module:
    """What is reached, in the order in which it is: a module of it."""

    def __init__(self, objects: list[_Object], exports: Sequence[str]):
        self._objects, self._exports = objects, list(exports)
        self._defined = self._definitions()
        self.functions: dict[_Place, int] = {}
        self.segments: dict[_Place, int] = {}  # its address
        self.table: dict[_Place, int] = {}  # place in the table, from 1 on: 0 is nobody's
        self._types: dict[bytes, int] = {}
        self._end = STACK
        self._waiting: list[tuple[int, _Body]] = []
        for name in self._exports:
            self._reach(*self._find(name, _FUNCTION))
        while self._waiting:
            o, body = self._waiting.pop()
            for relocation in body.relocations:
                self._follow(o, relocation)

    def _definitions(self) -> dict[str, tuple[int, _Symbol]]:
        found: dict[str, tuple[int, _Symbol]] = {}
        for o, unit in enumerate(self._objects):
            for symbol in unit.symbols:
                if symbol.flags & (_UNDEFINED | _LOCAL) or symbol.kind not in (_FUNCTION, _DATUM):
                    continue
                known = found.get(symbol.name)
                if known is None or (known[1].flags & _WEAK and not symbol.flags & _WEAK):
                    found[symbol.name] = o, symbol
                elif not (known[1].flags | symbol.flags) & _WEAK:
                    raise RuntimeError(f"'{symbol.name}' is defined twice.")
        return found

    def _find(self, name: str, kind: int) -> tuple[int, _Symbol]:
        found = self._defined.get(name)
        if found is None or found[1].kind != kind:
            raise RuntimeError(f"'{name}' is defined nowhere: a kernel calls libm, memset, memcpy and memmove alone.")
        return found

    def _resolve(self, o: int, number: int) -> tuple[int, _Symbol]:
        """The object and the definition of a symbol that an object mentions."""
        symbol = self._objects[o].symbols[number]
        return (o, symbol) if not symbol.flags & _UNDEFINED else self._find(symbol.name, symbol.kind)

    def _follow(self, o: int, relocation: _Relocation) -> None:
        kind = relocation.kind
        if kind == _TYPE_INDEX:
            return
        if kind in (_GLOBAL_INDEX, _TABLE_NUMBER):
            name = self._objects[o].symbols[relocation.symbol].name
            if name != (_STACK_POINTER if kind == _GLOBAL_INDEX else _TABLE_NAME):
                raise RuntimeError(f"'{name}' is no global or table that a kernel may use.")
            return
        if kind > _TYPE_INDEX:
            raise RuntimeError(f"a kernel's object for WebAssembly has a relocation of an unknown kind, {kind}.")
        where, symbol = self._resolve(o, relocation.symbol)
        self._reach(where, symbol)
        if kind in (_TABLE_SLEB, _TABLE_I32):
            self.table.setdefault((where, symbol.place), len(self.table) + 1)

    def _reach(self, o: int, symbol: _Symbol) -> None:
        """Takes a function or a segment in."""
        place, unit = (o, symbol.place), self._objects[o]
        if symbol.kind == _FUNCTION and place not in self.functions:
            self.functions[place] = len(self.functions)
            self._waiting.append((o, self._body(place)))
        elif symbol.kind == _DATUM and place not in self.segments:
            align, segment = unit.alignments[symbol.place], unit.segments[symbol.place]
            self.segments[place] = address = -(-self._end // align) * align
            self._end = address + len(segment.data)
            self._waiting.append((o, segment))

    def _body(self, place: _Place) -> _Body:
        unit = self._objects[place[0]]
        return unit.functions[place[1] - len(unit.imports)]

    def _type(self, unit: _Object, number: int) -> int:
        return self._types.setdefault(unit.types[number], len(self._types))

    def _patched(self, o: int, body: _Body) -> bytes:
        """A body with numbers and addresses of this module."""
        out = bytearray(body.data)
        for relocation in body.relocations:
            value, width = self._value(o, relocation), 5
            if relocation.kind in (_TABLE_I32, _ADDRESS_I32):
                value_bytes, width = value.to_bytes(4, "little"), 4
            else:
                value_bytes = _padded(value)
            out[relocation.at : relocation.at + width] = value_bytes
        return bytes(out)

    def _value(self, o: int, relocation: _Relocation) -> int:
        kind = relocation.kind
        if kind == _TYPE_INDEX:
            return self._type(self._objects[o], relocation.symbol)
        if kind in (_GLOBAL_INDEX, _TABLE_NUMBER):
            return 0  # the stack pointer is the first global, and there is one table
        where, symbol = self._resolve(o, relocation.symbol)
        place = where, symbol.place
        if kind == _FUNCTION_INDEX:
            return self.functions[place]
        if kind in (_TABLE_SLEB, _TABLE_I32):
            return self.table[place]
        return self.segments[place] + symbol.offset + relocation.addend

    def data(self) -> bytes:
        """The module's bytes."""
        bodies = [self._patched(place[0], self._body(place)) for place in self.functions]
        types = []
        for o, f in self.functions:
            unit = self._objects[o]
            types.append(_leb(self._type(unit, unit.function_types[f - len(unit.imports)])))
        heap = -(-self._end // 16) * 16
        constant = b"\x41%s\x0b"  # i32.const VALUE, end
        exported = [(name, 0, self.functions[o, symbol.place]) for name, (o, symbol) in self._exported()]
        exported += [("memory", 2, 0), (_TABLE_NAME, 1, 0), ("__heap_base", 3, 1)]
        names = [_leb(len(name)) + name.encode() + bytes([kind]) + _leb(index) for name, kind, index in exported]
        elements = b"".join(_leb(self.functions[place]) for place in self.table)
        element = b"\0" + constant % _sleb(1) + _leb(len(self.table)) + elements
        segments = [
            b"\0" + constant % _sleb(address) + _with_size(self._patched(o, self._objects[o].segments[s]))
            for (o, s), address in self.segments.items()
        ]
        globals_ = [bytes([_I32, 1]) + constant % _sleb(STACK), bytes([_I32, 0]) + constant % _sleb(heap)]
        return _MAGIC + b"".join(
            [
                _section(_TYPES, list(self._types)),
                _section(_FUNCTIONS, types),
                _section(_TABLE, [bytes([_FUNCREF, 0]) + _leb(len(self.table) + 1)]),
                _section(_MEMORY, [b"\0" + _leb(-(-heap // _PAGE))]),
                _section(_GLOBALS, globals_),
                _section(_EXPORTS, names),
                _section(_ELEMENTS, [element] if self.table else []),
                _section(_CODE, [_with_size(body) for body in bodies]),
                _section(_DATA, segments),
            ]
        )

    def _exported(self) -> Iterator[tuple[str, tuple[int, _Symbol]]]:
        for name in self._exports:
            yield name, self._find(name, _FUNCTION)


def _leb(value: int) -> bytes:
    """A number that is not negative, as LEB128."""
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])


def _sleb(value: int) -> bytes:
    """A number that is not negative, as signed LEB128."""
    out = bytearray()
    while value >= 0x40:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])


def _padded(value: int) -> bytes:
    """A number below 2^31 in five bytes, as LEB128, signed or not."""
    return bytes([value >> 7 * k & 0x7F | (0x80 if k < 4 else 0) for k in range(5)])


def _with_size(data: bytes) -> bytes:
    return _leb(len(data)) + data


def _section(number: int, items: list[bytes]) -> bytes:
    return bytes([number]) + _with_size(_leb(len(items)) + b"".join(items)) if items else b""
