"""Machine code of an object file put into this process: what a linker does for kernels, on Linux and x86-64.

LLVM's own linkers come with all of LLVM, which takes 60 ms to load; kernels that are compiled already need no more than
this. All of a file lies in one piece of memory, so that distances within it have 32 bits; what is elsewhere is called
through a jump and read through an address behind it.

The format: Tool Interface Standard, Executable and Linking Format 1.2; System V ABI, AMD64 supplement, 4.4.
"""

from __future__ import annotations

import ctypes
import functools
import mmap
import os
import struct
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

_HEADER, _SECTION, _SYMBOL = struct.Struct("<16sHHIQQQIHHHHHH"), struct.Struct("<IIQQQQIIQQ"), struct.Struct("<IBBHQQ")
_MAGIC, _RELOCATABLE, _X86_64 = b"\x7fELF\x02\x01\x01", 1, 62
_SYMBOLS, _RELOCATIONS, _EMPTY = 2, 4, 8  # types of sections
_IN_MEMORY = 2  # a flag of sections
_UNDEFINED, _RESERVED = 0, 0xFF00  # numbers of sections
_ADDRESS, _DISTANCE, _CALL, _THROUGH_ADDRESS = 1, 2, 4, (9, 41, 42)  # kinds of relocations
_RELOCATION = np.dtype([("at", "<u8"), ("kind", "<u4"), ("symbol", "<u4"), ("addend", "<i8")])
_JUMP = b"\xff\x25\x00\x00\x00\x00"  # to the address behind it
_JUMP_SIZE, _JUMP_TARGET = 16, 6
_mapped: list[mmap.mmap] = []


class _Section(NamedTuple):
    """A row of the table of sections; names and entries' sizes are not needed."""

    kind: int
    flags: int
    offset: int
    size: int
    link: int
    info: int
    align: int


def is_understood() -> bool:
    """Whether kernels of this process are such files."""
    return hasattr(os, "uname") and os.uname()[0] == "Linux" and os.uname()[4] == "x86_64"


def load(code: bytes, symbol: str, given: Mapping[str, int]) -> int:
    """The address of an object file's function, put into this process for good.

    Args:
        code: The file.
        symbol: The function.
        given: Addresses of what the file needs besides what is loaded in this process.

    Raises:
        RuntimeError: it is no such file, has what kernels have not, or needs what is not there.
        OSError: there is no memory, or none that may be run.
    """
    sections = _sections(code)
    begins, end = _placed(sections)
    names, where, numbers = _symbols(code, sections)
    if symbol not in names:
        raise RuntimeError(f"this object file has no {symbol}; it has {', '.join(filter(None, names))}.")
    missing = [i for i in range(1, len(names)) if numbers[i] == _UNDEFINED]
    jumps = (end + 15) & ~15
    size = max(jumps + _JUMP_SIZE * len(missing), 1)
    memory = mmap.mmap(-1, size, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS, mmap.PROT_READ | mmap.PROT_WRITE)
    base = ctypes.addressof(ctypes.c_char.from_buffer(memory))
    for section, begin in zip(sections, begins):
        if section.flags & _IN_MEMORY and section.kind != _EMPTY:
            memory[begin : begin + section.size] = code[section.offset : section.offset + section.size]
    addresses = np.zeros(len(names), np.int64)
    through = np.zeros(len(names), np.int64)  # where the address of what is elsewhere stands
    for i in range(1, len(names)):
        if _UNDEFINED < numbers[i] < _RESERVED:
            addresses[i] = base + begins[numbers[i]] + where[i]
    for k, i in enumerate(missing):
        jump = jumps + _JUMP_SIZE * k
        target = given[names[i]] if names[i] in given else _elsewhere(names[i])
        memory[jump : jump + _JUMP_SIZE - 2] = _JUMP + struct.pack("<Q", target)
        addresses[i], through[i] = base + jump, base + jump + _JUMP_TARGET
    for section in sections:
        if section.kind == _RELOCATIONS and sections[section.info].flags & _IN_MEMORY:
            found = np.frombuffer(code, _RELOCATION, section.size // _RELOCATION.itemsize, section.offset)
            _relocate(np.frombuffer(memory, np.uint8), base, begins[section.info], found, addresses, through)
    _make_executable(base, len(memory))
    _mapped.append(memory)
    return int(addresses[names.index(symbol)])


def _sections(code: bytes) -> list[_Section]:
    if len(code) < _HEADER.size or code[: len(_MAGIC)] != _MAGIC:
        raise RuntimeError("this is no object file of 64 bits.")
    _, kind, machine, _, _, _, start, _, _, _, _, size, count, _ = _HEADER.unpack_from(code)
    if (kind, machine, size) != (_RELOCATABLE, _X86_64, _SECTION.size) or start + size * count > len(code):
        raise RuntimeError("this is no object file of x86-64.")
    rows = (_SECTION.unpack_from(code, start + size * i) for i in range(count))
    return [_Section(kind, *rest[:1], *rest[2:7]) for _, kind, *rest in rows]


def _placed(sections: list[_Section]) -> tuple[list[int], int]:
    """Where each section begins in memory, and where all end."""
    begins, end = [], 0
    for section in sections:
        if section.flags & _IN_MEMORY:
            align = max(section.align, 1)
            end = (end + align - 1) // align * align
        begins.append(end)
        end += section.size if section.flags & _IN_MEMORY else 0
    return begins, end


def _symbols(code: bytes, sections: list[_Section]) -> tuple[list[str], list[int], list[int]]:
    """Of each symbol its name, its place in its section, and that section's number."""
    table = next((s for s in sections if s.kind == _SYMBOLS), None)
    if table is None:
        raise RuntimeError("this object file has no symbols.")
    texts = sections[table.link].offset
    names, where, numbers = [], [], []
    for at in range(table.offset, table.offset + table.size, _SYMBOL.size):
        name, _, _, number, value, _ = _SYMBOL.unpack_from(code, at)
        begin = texts + name
        names.append(code[begin : code.index(b"\0", begin)].decode())
        where.append(value)
        numbers.append(number)
    return names, where, numbers


@functools.cache
def _process() -> ctypes.CDLL:
    """All that is loaded in this process."""
    return ctypes.CDLL(None, use_errno=True)


@functools.cache
def _elsewhere(name: str) -> int:
    """The address of a function of this process, as its dynamic linker finds it."""
    try:
        found = getattr(_process(), name)
    except AttributeError:
        raise RuntimeError(f"a kernel needs {name}, which this process has not.") from None
    return int(ctypes.cast(found, ctypes.c_void_p).value or 0)


def _relocate(
    memory: np.ndarray, base: int, begin: int, found: np.ndarray, addresses: np.ndarray, through: np.ndarray
) -> None:
    """Writes what a section says about places that were not known."""
    at = found["at"].astype(np.int64) + begin
    kinds, symbols = found["kind"], found["symbol"]
    used = set(kinds.tolist())
    unknown = used - {_ADDRESS, _DISTANCE, _CALL, *_THROUGH_ADDRESS}
    targets = addresses[symbols]
    if not used.isdisjoint(_THROUGH_ADDRESS):
        is_read = np.isin(kinds, _THROUGH_ADDRESS)
        targets[is_read] = through[symbols[is_read]]
    if unknown or not targets.all():
        raise RuntimeError(f"this object file has relocations that kernels have not: {unknown or 'to no place'}.")
    values = targets + found["addend"]
    is_near = kinds != _ADDRESS
    _write(memory, at[is_near], (values - at - base)[is_near], 4)
    if _ADDRESS in used:
        _write(memory, at[~is_near], values[~is_near], 8)


def _write(memory: np.ndarray, at: np.ndarray, values: np.ndarray, size: int) -> None:
    """The lowest bytes of numbers, at these places."""
    memory[at[:, None] + np.arange(size)] = values.astype("<i8").view(np.uint8).reshape(-1, 8)[:, :size]


def _make_executable(base: int, size: int) -> None:
    if _process().mprotect(ctypes.c_void_p(base), ctypes.c_size_t(size), mmap.PROT_READ | mmap.PROT_EXEC):
        number = ctypes.get_errno()
        raise OSError(number, f"memory with kernels may not be run: {os.strerror(number)}")
