"""Kernels and libm as WebAssembly objects: from the wheel, from the user's cache, or made now.

What the wheel brings is found by the text of a kernel, so that it serves exactly that kernel, whoever asks.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import importlib.util
import pathlib
import subprocess
import sys
import tempfile
import zipfile

from sheldrake.common._native import store
from sheldrake.common._native.prebuilt import FOLDER
from sheldrake.common._native.target import LIBM, Target

WASM = Target(
    "wasm32-unknown-wasi", 1, "generic", "+bulk-memory,+sign-ext,+mutable-globals,+nontrapping-fptoint", "static"
)
FILE = "wasm32.zip"
"""In the folder of what is prebuilt."""
_USES = f"#include <math.h>\n#include <string.h>\nvoid *used[] = {{{', '.join(sorted(LIBM))}}};\n"
LIBM_FILE = "libm.o"
"""In that file."""
NO_COMPILER = (
    "WebAssembly of kernels that the wheel does not bring, such as one's own, needs a compiler: "
    "pip install 'sheldrake[export]' (it brings llvmlite and ziglang)."
)


def code(text: str, symbol: str, short_loops: bool) -> bytes:
    """The object of an entry that is LLVM's text.

    Raises:
        ModuleNotFoundError: the wheel does not bring it, and llvmlite is not installed.
    """
    found = _brought().get(member(text, short_loops))
    if found is None and not store.can_compile():
        raise ModuleNotFoundError(f"{symbol}: {NO_COMPILER}", name="llvmlite")
    return store.code_of_text(text, symbol, short_loops, WASM) if found is None else found


def libm() -> bytes:
    """The mathematical functions, as one object.

    Raises:
        ModuleNotFoundError: the wheel does not bring it, and ziglang is not installed.
        RuntimeError: zig failed; the message has its words.
    """
    found = _brought().get(LIBM_FILE)
    return made_libm() if found is None else found


def made_libm() -> bytes:
    """What `libm` gives, by the zig that is installed; it is kept in the user's cache.

    Raises:
        ModuleNotFoundError: ziglang is not installed.
        RuntimeError: zig failed; the message has its words.
    """
    if importlib.util.find_spec("ziglang") is None:
        raise ModuleNotFoundError(f"libm: {NO_COMPILER}", name="ziglang")
    digest = hashlib.sha256(f"{_USES}{importlib.metadata.version('ziglang')}".encode()).hexdigest()[:20]
    return store.kept(f"libm-wasm32-{digest}.o", "libm for pages", make_libm)


def member(text: str, short_loops: bool) -> str:
    """What a kernel's object is called in the wheel."""
    return hashlib.sha256(repr((text, short_loops)).encode()).hexdigest()[:24]


def pack(path: pathlib.Path, objects: dict[str, bytes]) -> None:
    """Writes what a wheel brings: objects of kernels by `member`, and libm; the same objects give the same bytes."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as file:
        for name, data in sorted(objects.items()):
            file.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)


@functools.cache
def _brought() -> dict[str, bytes]:
    """Objects of the wheel by name; none where there is no such file or it is damaged."""
    try:
        with zipfile.ZipFile(FOLDER / FILE) as file:
            return {name: file.read(name) for name in file.namelist()}
    except (OSError, ValueError, LookupError, zipfile.BadZipFile):
        return {}


def make_libm() -> bytes:
    """libm of zig's C library (musl's functions), as one object."""
    with tempfile.TemporaryDirectory(prefix="sheldrake-") as name:
        folder = pathlib.Path(name)
        (folder / "uses.c").write_text(_USES, encoding="ascii")
        common = ["-target", "wasm32-wasi", "-w", "-fno-builtin", folder / "uses.c"]
        _zig("cc", *common, "-O2", "-c", "-o", folder / "uses.o")
        told = _zig("cc", *common, "-mexec-model=reactor", "-nostartfiles", "-o", folder / "none.wasm", "-v")
        archives = list(dict.fromkeys(word for word in told.split() if word.endswith(".a")))
        _zig("wasm-ld", "-r", "--strip-debug", "-o", folder / LIBM_FILE, folder / "uses.o", *archives)
        return (folder / LIBM_FILE).read_bytes()


def _zig(*words: object) -> str:
    """What zig says."""
    command = [sys.executable, "-m", "ziglang", *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"zig {words[0]} failed: {done.stderr.strip()[:2000]}")
    return done.stderr
