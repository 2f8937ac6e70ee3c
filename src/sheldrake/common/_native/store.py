"""Compiled kernels on disk: one object file an entry, named by the content of the kernel and of all it calls.

A changed constant, helper or annotation is another name, so nothing is ever stale; docstrings and comments do not
count. Files are written beside their place and renamed, so processes may race; a folder that cannot be written only
costs time. Imports llvmlite when a kernel is loaded, numba when one must be compiled.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import os
import pathlib
import platform
import sys
import tempfile
import time
import types
import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._native.target import NO_COMPILER, host, initialise

if TYPE_CHECKING:
    from sheldrake.common.kernel import Kernel

ABI = "7"
DAY, UNUSED = 86_400.0, 90 * 86_400.0  # [s]
TIERS: dict[str, str] = {}
"""Where each entry of this process came from: "prebuilt", "cache" or "compiled"."""
_engines: list[Any] = []


def load(kernel: Kernel) -> tuple[Any, int]:
    """(callable of the ABI, address) of an entry: from the wheel's library, the user's cache, or compiled now."""
    from sheldrake.common._native import prebuilt

    if (ready := prebuilt.load(kernel)) is not None:
        TIERS[prebuilt.qualified(kernel)] = "prebuilt"
        return ready
    code = _read(_path(kernel))
    TIERS[prebuilt.qualified(kernel)] = "compiled" if code is None else "cache"
    address = _link(code or make(kernel), _symbol(kernel))
    return prebuilt.PROTOTYPE(address), address


def make(kernel: Kernel, tell: bool = True) -> bytes:
    """Compiles an entry and keeps it in the cache; its machine code."""
    code = _compile(kernel, _symbol(kernel), tell)
    _write(_path(kernel), code)
    return code


def is_ready(kernel: Kernel) -> bool:
    """Whether an entry need not be compiled."""
    from sheldrake.common._native import prebuilt

    return "_native" in kernel.__dict__ or prebuilt.load(kernel) is not None or _path(kernel).exists()


@functools.cache
def can_compile() -> bool:
    """Whether what is not ready can be compiled here."""
    return importlib.util.find_spec("numba") is not None


def is_writable() -> bool:
    """Whether the cache folder takes files."""
    folder = cache_folder()
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


def _symbol(kernel: Kernel) -> str:
    return f"k_{kernel.__name__}"


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
    root = os.environ.get("SHELDRAKE_CACHE_DIR")
    if root is None:
        home = pathlib.Path(os.path.expanduser("~"))
        if sys.platform == "win32":
            base = pathlib.Path(os.environ.get("LOCALAPPDATA", home / "AppData" / "Local"))
        elif sys.platform == "darwin":
            base = home / "Library" / "Caches"
        else:
            base = pathlib.Path(os.environ.get("XDG_CACHE_HOME", home / ".cache"))
        root = str(base / "sheldrake")
    return pathlib.Path(root) / _machine()


@functools.cache
def _machine() -> str:
    import importlib.metadata  # not above: with prebuilt kernels nobody asks

    target = host()
    python = ".".join(platform.python_version_tuple()[:2])
    processor = f"{target.triple.split('-')[0]}-{target.level}"
    return f"abi{ABI}-python{python}-numba{importlib.metadata.version('numba')}-{processor}"


def fingerprint(kernel: Kernel) -> str:
    """A hash of what a kernel's machine code depends on: its code, all kernels it calls, constants, and annotations.

    Raises:
        TypeError: if it calls a plain Python function, which could change unseen.
    """
    digest = hashlib.sha256()
    seen: set[int] = set()
    _visit(kernel, digest, seen)
    digest.update(repr([(p.name, p.kind, p.fields) for p in kernel.parameters]).encode())
    digest.update(os.environ.get("SHELDRAKE_BOUNDSCHECK", "0").encode())
    return digest.hexdigest()[:20]


def _visit(kernel: Any, digest: Any, seen: set[int]) -> None:
    from sheldrake.common.kernel import Kernel

    if id(kernel) in seen:
        return
    seen.add(id(kernel))
    digest.update(f"{kernel.__name__}{kernel.top}{kernel.outline}{kernel.strict}{kernel.short_loops}".encode())
    _visit_code(kernel.py_func.__code__, digest, _has_docstring(kernel.py_func.__code__))
    for name, value in _mentioned(kernel.py_func):
        if isinstance(value, Kernel):
            _visit(value, digest, seen)
        elif isinstance(value, (int, float, complex, str, bytes, tuple, np.generic)):
            digest.update(f"{name}={value!r}:{type(value).__name__}".encode())
        elif isinstance(value, type):
            digest.update(f"{name}={value.__name__}:{getattr(value, '_fields', ())}".encode())
        elif isinstance(value, types.FunctionType) and not value.__module__.startswith("sheldrake.common."):
            raise TypeError(f"{kernel!r} calls {value.__qualname__}, a plain Python function: make it a @kernel.")


def _mentioned(function: types.FunctionType) -> Iterator[tuple[str, Any]]:
    """Names in a function's code with what they stand for; `module.name` too, which is two names there."""
    code, scope = function.__code__, function.__globals__
    cells = dict(zip(code.co_freevars, (c.cell_contents for c in function.__closure__ or ())))
    for name in (*code.co_names, *code.co_freevars):
        value = cells.get(name, scope.get(name))
        yield name, value
        if isinstance(value, types.ModuleType) and value.__name__.partition(".")[0] != "numpy":
            yield from ((f"{name}.{n}", getattr(value, n)) for n in code.co_names if hasattr(value, n))


def _has_docstring(code: types.CodeType) -> bool:
    """Whether the first constant of a function is its docstring; a flag says so since Python 3.14.

    Before that, the first constant is the docstring, or None where there is none.
    """
    if sys.version_info >= (3, 14):
        return bool(code.co_flags & 0x4000000)  # inspect.CO_HAS_DOCSTRING
    return bool(code.co_consts) and isinstance(code.co_consts[0], str)


def _visit_code(code: types.CodeType, digest: Any, has_docstring: bool = False) -> None:
    digest.update(code.co_code)
    digest.update(repr((code.co_names, code.co_varnames)).encode())
    for constant in code.co_consts[has_docstring:]:
        if isinstance(constant, types.CodeType):
            _visit_code(constant, digest)
        else:
            digest.update(repr(constant).encode())


def _compile(kernel: Kernel, symbol: str, tell: bool) -> bytes:
    if importlib.util.find_spec("numba") is None:
        raise ModuleNotFoundError(f"{kernel!r}: {NO_COMPILER}", name="numba")
    from sheldrake.common._native import lower

    start = time.perf_counter()
    if tell:
        say(f"sheldrake: compiling {kernel.__name__}, once on this machine ...", end="")
    try:
        code = lower.emit(lower.lower(kernel, symbol), symbol, host())
    finally:
        if tell:
            say(f" {time.perf_counter() - start:.1f} s")
    return code


def _read(path: pathlib.Path) -> bytes | None:
    """The object file at `path`, or None when there is none or it is damaged (its own hash stands before it)."""
    try:
        data = path.read_bytes()
        if time.time() - path.stat().st_mtime > DAY:
            path.touch()  # what is in use does not grow old
    except OSError:
        return None
    return data[32:] if hashlib.sha256(data[32:]).digest() == data[:32] else None


def _write(path: pathlib.Path, code: bytes) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        descriptor, temporary = tempfile.mkstemp(dir=path.parent)
        with os.fdopen(descriptor, "wb") as file:
            file.write(hashlib.sha256(code).digest() + code)
        os.replace(temporary, path)
    except OSError as error:
        _warn_once(str(path.parent), str(error))
    else:
        _prune(path.parents[1])


@functools.cache
def _prune(root: pathlib.Path) -> None:
    """Removes what no process has read for three months: other versions' kernels, and files that a crash left."""
    for file in root.glob("abi*/*"):
        try:
            if time.time() - file.stat().st_mtime > UNUSED:
                file.unlink()
                file.parent.rmdir()  # refuses while files are left
        except OSError:
            continue


@functools.cache
def _warn_once(folder: str, reason: str) -> None:
    warnings.warn(f"Compiled kernels cannot be kept in {folder} ({reason}): each process compiles anew.", stacklevel=2)


def _link(code: bytes, symbol: str) -> int:
    import llvmlite.binding as llvm

    initialise()
    machine = llvm.Target.from_default_triple().create_target_machine(jit=True)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    _engines.append(engine)  # the machine code lives as long as its engine
    return engine.get_function_address(symbol)
