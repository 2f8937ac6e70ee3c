"""Kernels from the library that the wheel brings: llvmlite is not imported.

The library serves only if it was made from the code that is installed; an edited kernel is compiled instead.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import hashlib
import json
import os
import pathlib
import sys
from typing import TYPE_CHECKING, Any, NamedTuple

from sheldrake.common._native import private_files, sanitizer
from sheldrake.common._native.source import PACKAGE, is_made_from, stamps

if TYPE_CHECKING:
    from sheldrake.common.kernel import Kernel

FOLDER = PACKAGE / "_prebuilt"
ENDING = {"darwin": ".dylib", "win32": ".dll"}.get(sys.platform, ".so")
PROTOTYPE = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p)


class Library(NamedTuple):
    """A loaded library, the level of this processor in it, and the symbols of its entries by qualified name."""

    dll: Any
    level: int
    entries: dict[str, str]


def qualified(kernel: Kernel) -> str:
    """The name of an entry in a manifest."""
    return f"{kernel.__module__}:{kernel.__qualname__}"


@functools.cache
def library() -> tuple[Library | None, str]:
    """The library of this installation, or None, and in words why."""
    if os.environ.get("SHELDRAKE_PREBUILT", "1") == "0":
        return None, "switched off by SHELDRAKE_PREBUILT=0"
    if os.environ.get("SHELDRAKE_BOUNDSCHECK", "0") != "0" or sanitizer.SANITIZED:
        return None, "SHELDRAKE_BOUNDSCHECK or SHELDRAKE_SANITIZE asks for other code"
    path, manifest_path = FOLDER / f"kernels{ENDING}", FOLDER / "kernels.json"
    try:
        manifest = json.loads(manifest_path.read_text(encoding="utf-8"))
        if reason := _fault(manifest, path, manifest_path):
            return None, reason
        dll = ctypes.CDLL(str(path))
        level = dll.sheldrake_cpu_level() if hasattr(dll, "sheldrake_cpu_level") else 1
        return Library(dll, max(x for x in manifest["levels"] if x <= level), manifest["entries"]), "in use"
    except FileNotFoundError:
        return None, "this installation has none (an editable install, or built without a linker)"
    except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
        return None, f"the library cannot be used: {manifest_path.name} or {path.name} is damaged ({error})"


def _fault(manifest: dict, path: pathlib.Path, manifest_path: pathlib.Path) -> str:
    """Why a library does not serve, or nothing; what was found of files is found again as long as none has changed."""
    names = [name for name in (f"{PACKAGE}/{name}" for name in manifest["sources"]) if os.path.isfile(name)]
    found = json.dumps(stamps([manifest_path, path, *names])).encode()
    seal = private_files.root() / "seals" / hashlib.sha256(str(path).encode()).hexdigest()[:20]
    if private_files.read(seal) == found:
        return ""
    if not is_made_from(manifest["sources"]):
        return "the library was built from other sources than those installed"
    if manifest["sha256"] != hashlib.sha256(path.read_bytes()).hexdigest():
        return f"{path.name} is damaged"
    if private_files.is_trusted(seal.parent):
        with contextlib.suppress(OSError):  # the next process asks once more
            private_files.write(seal, found)
    return ""


def load(kernel: Kernel) -> tuple[Any, int] | None:
    """(callable of the ABI, address) of an entry, or None when the library does not serve it."""
    if not kernel.__module__.startswith("sheldrake."):
        return None
    found, _ = library()
    if found is None or qualified(kernel) not in found.entries:
        return None
    symbol = getattr(found.dll, f"{found.entries[qualified(kernel)]}_{found.level}")
    address = ctypes.cast(symbol, ctypes.c_void_p).value
    assert address is not None
    return PROTOTYPE(address), address
