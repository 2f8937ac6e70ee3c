"""Compiled kernels on disk: one object file an entry, named by the content of the kernel and of all it calls.

A changed constant, helper or annotation is another name, so nothing is ever stale; docstrings and comments do not
count. Files are written beside their place and renamed, so processes may race; a folder that cannot be written only
costs time. Imports LLVM and the compiler when a kernel must be compiled, elsewhere than on Linux and x86-64 LLVM when
one is loaded.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import os
import pathlib
import platform
import sys
import time
import types
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._native import disk_cache, elf, fingerprints, private_files, sanitizer
from sheldrake.common._native.target import NO_COMPILER, Target, compiler_version, host, initialise, processor

if TYPE_CHECKING:
    from sheldrake.common.kernel import Kernel

ABI = "8"
TIERS: dict[str, str] = {}
"""Where each entry of this process came from: "prebuilt", "cache" or "compiled"."""
_linked: list[Any] = []
_NUMBERS_AND_TEXTS = (int, float, complex, str, bytes, np.generic)


def load(kernel: Kernel) -> tuple[Any, int]:
    """(callable of the ABI, address) of an entry: from the wheel's library, the user's cache, or compiled now."""
    from sheldrake.common._native import prebuilt

    if (ready := prebuilt.load(kernel)) is not None:
        TIERS[prebuilt.qualified(kernel)] = "prebuilt"
        return ready
    code = disk_cache.read(_path(kernel))
    TIERS[prebuilt.qualified(kernel)] = "compiled" if code is None else "cache"
    address = _link(code or make(kernel), symbol_of(kernel))
    return prebuilt.PROTOTYPE(address), address


def load_text(text: str, symbol: str, short_loops: bool) -> tuple[Any, int]:
    """(callable of the ABI, address) of an entry whose kernel is LLVM's text alone, from the cache or compiled now.

    Raises:
        ModuleNotFoundError: if it must be compiled and llvmlite is not there.
    """
    from sheldrake.common._native import prebuilt

    address = _link(code_of_text(text, symbol, short_loops, host()), symbol)
    return prebuilt.PROTOTYPE(address), address


def code_of_text(text: str, symbol: str, short_loops: bool, target: Target, rename: str = "") -> bytes:
    """The object file for a target of an entry that is LLVM's text, from the cache or compiled now.

    Args:
        text: LLVM's.
        symbol: Name of the entry in it.
        short_loops: How it is optimised.
        target: What it is for.
        rename: What the entry is called in the object file, if not the same.

    Raises:
        ModuleNotFoundError: if it must be compiled and llvmlite is not there.
        TypeError: if the code needs anything but libm, memset, memcpy and memmove.
    """
    digest = hashlib.sha256(
        repr((text, short_loops, target, _compiler(), *([rename] if rename else []))).encode()
    ).hexdigest()[:20]

    def emit() -> bytes:
        from sheldrake.common._native import lower

        return lower.emit(lower.read(text, short_loops), symbol, target, rename or None)

    return kept(f"{symbol}-text-{digest}.o", symbol, emit)


def kept(name: str, what: str, make: Callable[[], bytes]) -> bytes:
    """An object file of the cache by its name, which says all that it depends on; it is made now if it is not there."""
    path = cache_folder() / name
    code = disk_cache.read(path)
    if code is None:
        code = _told(what, make)
        disk_cache.write(path, code)
    return code


def make(kernel: Kernel, tell: bool = True) -> bytes:
    """Compiles an entry and keeps it in the cache; its machine code."""
    code = _compile(kernel, symbol_of(kernel), tell)
    disk_cache.write(_path(kernel), code)
    return code


def is_ready(kernel: Kernel) -> bool:
    """Whether an entry need not be compiled."""
    from sheldrake.common._native import prebuilt

    if "_native" in kernel.__dict__ or prebuilt.load(kernel) is not None:
        return True
    if not can_compile():  # nor link what another process compiled
        return False
    path = _path(kernel)
    return private_files.is_trusted(path.parent) and path.exists()


@functools.cache
def can_compile() -> bool:
    """Whether what is not ready can be compiled here."""
    return importlib.util.find_spec("llvmlite") is not None


def is_writable() -> bool:
    """Whether the cache folder takes files."""
    folder = cache_folder()
    if not private_files.is_trusted(folder):
        return False
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return os.access(folder, os.W_OK)


def amount_of_code(kernel: Kernel) -> int:
    """Bytecode of an entry and all it calls: about how long it takes to compile."""
    digest = _Counter()
    _visit(kernel, digest, set())
    return digest.size


class _Counter:
    """Counts what a hash would take."""

    size = 0

    def update(self, data: bytes) -> None:
        self.size += len(data)


def symbol_of(kernel: Kernel) -> str:
    """What the function of an entry is called in its object file."""
    name = kernel.__name__  # of any letters; llvmlite finds symbols of ASCII
    return f"k_{name if name.isascii() else name.encode().hex()}"


def _path(kernel: Kernel) -> pathlib.Path:
    return cache_folder() / f"{kernel.__name__}-{fingerprint(kernel)}.o"


def say(text: str, end: str = "\n") -> None:
    """Tells on standard error what takes time, unless SHELDRAKE_QUIET is set."""
    if os.environ.get("SHELDRAKE_QUIET", "0") == "0":
        print(text, end=end, file=sys.stderr, flush=True)


def cache_folder() -> pathlib.Path:
    """Folder of the compiled kernels of this user, for this Python, compiler and processor.

    SHELDRAKE_CACHE_DIR overrides the place; otherwise it is the operating system's cache folder of the user.
    """
    return private_files.root() / _machine()


@functools.cache
def _machine() -> str:
    kind, level = processor()
    python = ".".join(platform.python_version_tuple()[:2])
    return f"abi{ABI}-python{python}-llvmlite{compiler_version()}-{kind}-{level}"


@functools.cache
def fingerprint(kernel: Kernel) -> str:
    """A hash of what a kernel's machine code depends on: its code, all kernels it calls, constants, annotations and
    the records in them, and the compiler itself. Of kernels in files that have not changed since it is looked up.
    """
    from sheldrake.common._native import prebuilt

    if not fingerprints.is_kept(kernel):
        return _fingerprint(kernel)
    kept, name = fingerprints.of_files(cache_folder()), prebuilt.qualified(kernel)
    return kept.get(name) or kept.add(name, _fingerprint(kernel))


def _fingerprint(kernel: Kernel) -> str:
    digest = hashlib.sha256()
    _visit(kernel, digest, set())
    digest.update(repr([(p.name, p.kind, p.fields) for p in kernel.parameters]).encode())
    digest.update(repr([getattr(p.cls, "PARTS", ()) for p in kernel.parameters]).encode())
    digest.update(os.environ.get("SHELDRAKE_BOUNDSCHECK", "0").encode())
    digest.update(sanitizer.CODE.encode() if sanitizer.SANITIZED else b"")
    digest.update(_compiler().encode())
    return digest.hexdigest()[:20]


@functools.cache
def _compiler() -> str:
    """A hash of the compiler's own source."""
    from sheldrake.common._native import source

    fixed = [
        source.PACKAGE / "common" / name for name in ("record.py", "rows.py", "_native/lower.py", "_native/target.py")
    ]
    return hashlib.sha256(b"".join(path.read_bytes() for path in (*source.compiler_files(), *fixed))).hexdigest()


def _visit(kernel: Any, digest: Any, seen: set[int]) -> None:
    if id(kernel) in seen:
        return
    seen.add(id(kernel))
    for part in _parts(kernel):
        if isinstance(part, bytes):
            digest.update(part)
        else:
            _visit(part, digest, seen)


@functools.cache
def _parts(kernel: Kernel) -> list[bytes | Kernel]:
    """What a kernel consists of, and between it those that it calls: entries share most of them."""
    parts: list[Any] = [f"{kernel.__name__}{kernel.top}{kernel.outline}{kernel.strict}{kernel.short_loops}".encode()]
    _visit_code(kernel.py_func.__code__, parts, _has_docstring(kernel.py_func.__code__))
    for name, value in _mentioned(kernel.py_func):
        _visit_value(name, value, parts)
    joined: list[Any] = [b""]
    for part in parts:
        if isinstance(part, bytes) and isinstance(joined[-1], bytes):
            joined[-1] += part
        else:
            joined.append(part)
    return joined


def _visit_value(name: str, value: Any, parts: list[Any]) -> None:
    """What a kernel's code means by a name."""
    from sheldrake.common.kernel import Kernel

    if isinstance(value, Kernel):
        parts.append(value)
    elif isinstance(value, (*_NUMBERS_AND_TEXTS, tuple)):
        parts.append(f"{name}={value!r}:{type(value).__name__}".encode())
        if isinstance(value, tuple) and not all(isinstance(part, _NUMBERS_AND_TEXTS) for part in value):
            for k, part in enumerate(value):  # by its content: of a kernel, repr() gives the name alone
                _visit_value(f"{name}[{k}]", part, parts)
    elif isinstance(value, type):
        parts.append(f"{name}={value.__name__}:{_layout(value)}".encode())
    elif callable(value):  # mathematics; what else it is, the compiler refuses where it is called
        parts.append(f"{name}={getattr(value, '__module__', '')}.{getattr(value, '__name__', '')}".encode())


@functools.cache
def _layout(cls: type) -> str:
    """What a record or NamedTuple consists of, in words."""
    return repr((getattr(cls, "_fields", ()), getattr(cls, "PARTS", ())))


def _mentioned(function: Any) -> Iterator[tuple[str, Any]]:
    """Names in a function's code with what they stand for, and what `module.name` and `Class.name` stand for."""
    code, scope = function.__code__, function.__globals__
    cells = {n: c.cell_contents for n, c in zip(code.co_freevars, function.__closure__ or ()) if c != types.CellType()}
    for name in (*code.co_names, *code.co_freevars):
        yield from _with_attributes(name, cells.get(name, scope.get(name)), code.co_names)


def _with_attributes(path: str, value: object, names: tuple[str, ...], depth: int = 3) -> Iterator[tuple[str, Any]]:
    """A value and, of what is no value of a kernel itself, the attributes that have one of these names."""
    yield path, value
    is_whole = value is None or isinstance(value, (int, float, complex, str, tuple, np.generic)) or value is np
    if depth and not is_whole and (isinstance(value, type) or not callable(value)):
        for name in names:
            if hasattr(value, name):
                yield from _with_attributes(f"{path}.{name}", getattr(value, name), names, depth - 1)


def _has_docstring(code: types.CodeType) -> bool:
    """Whether the first constant of a function is its docstring; a flag says so since Python 3.14.

    Before that, the first constant is the docstring, or None where there is none.
    """
    if sys.version_info >= (3, 14):
        return bool(code.co_flags & 0x4000000)  # inspect.CO_HAS_DOCSTRING
    return bool(code.co_consts) and isinstance(code.co_consts[0], str)


def _visit_code(code: types.CodeType, parts: list[Any], has_docstring: bool = False) -> None:
    parts.append(code.co_code)
    parts.append(repr((code.co_names, code.co_varnames)).encode())
    for constant in code.co_consts[has_docstring:]:
        if isinstance(constant, types.CodeType):
            _visit_code(constant, parts)
        else:
            parts.append(repr(constant).encode())


def _compile(kernel: Kernel, symbol: str, tell: bool) -> bytes:
    if not can_compile():
        raise ModuleNotFoundError(f"{kernel!r}: {NO_COMPILER}", name="llvmlite")
    from sheldrake.common._native import lower

    def emit() -> bytes:
        return lower.emit(lower.lower(kernel, symbol), symbol, host())

    return _told(kernel.__name__, emit) if tell else emit()


def _told(what: str, make: Callable[[], bytes]) -> bytes:
    """What `make` makes; people see that it is compiled, and how long it took."""
    start = time.perf_counter()
    say(f"sheldrake: compiling {what}, once on this machine ...", end="")
    try:
        return make()
    finally:
        say(f" {time.perf_counter() - start:.1f} s")


def _link(code: bytes, symbol: str) -> int:
    """The address of an object file's function, put into this process.

    Code and its constants must be in one piece: addresses between them have 32 bits, and memory that MCJIT asks for
    piece by piece is farther apart, now and then, where there are many threads or gigabytes of arrays (a failed
    assertion of LLVM ends the process). JITLink, which does so, is tried on Linux alone; on x86-64 there is our own.
    """
    if elf.is_understood():
        return elf.load(code, symbol, {sanitizer.SYMBOL: sanitizer.address()})
    initialise()
    return (_by_jit_link if sys.platform == "linux" else _by_mcjit)(code, symbol)


@functools.cache
def _linker() -> Any:
    import llvmlite.binding as llvm

    machine = llvm.Target.from_default_triple().create_target_machine(jit=True)
    return llvm.create_lljit_compiler(machine, use_jit_link=True)


def _by_jit_link(code: bytes, symbol: str) -> int:
    import llvmlite.binding as llvm

    library = llvm.JITLibraryBuilder().add_object_img(code).add_current_process().export_symbol(symbol)
    library.import_symbol(sanitizer.SYMBOL, sanitizer.address())
    linked = library.link(_linker(), f"{symbol} {len(_linked)}")
    _linked.append(linked)  # the machine code lives as long as it
    return linked[symbol]


def _by_mcjit(code: bytes, symbol: str) -> int:
    import llvmlite.binding as llvm

    llvm.add_symbol(sanitizer.SYMBOL, sanitizer.address())
    machine = llvm.Target.from_default_triple().create_target_machine(jit=True)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    _linked.append(engine)
    return engine.get_function_address(symbol)
