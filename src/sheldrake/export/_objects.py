"""Machine code of a frozen diagram's kernels for any target, and the linker that joins it."""

from __future__ import annotations

import importlib.util
import pathlib
import subprocess
import sys
from typing import TYPE_CHECKING, Any

from sheldrake.common._native.store import code_of_text
from sheldrake.common._native.target import Target

if TYPE_CHECKING:
    from os import PathLike

NO_COMPILER = "{} needs a compiler and a linker: pip install 'sheldrake[export]' (it brings llvmlite and ziglang)."


def require_compiler(call: str) -> None:
    """Says what to install, before anything is done.

    Raises:
        ModuleNotFoundError: llvmlite or ziglang is not installed.
    """
    for name in ("llvmlite", "ziglang"):
        if importlib.util.find_spec(name) is None:
            raise ModuleNotFoundError(NO_COMPILER.format(call), name=name)


def write_objects(functions: list[dict[str, Any]], target: Target, folder: pathlib.Path) -> list[pathlib.Path]:
    """Writes an object file for each function of a frozen diagram; compiled ones come from the user's cache.

    Raises:
        ModuleNotFoundError: they must be compiled and llvmlite is not there.
    """
    paths = []
    for function in functions:
        path = folder / f"{function['symbol']}.o"
        path.write_bytes(code_of_text(function["text"], function["symbol"], function["short_loops"], target))
        paths.append(path)
    return paths


def zig(call: str, *options: str | PathLike[str]) -> None:
    """Runs zig, as the package ziglang brings it.

    Args:
        call: What is asked for, for errors.
        options: Of the command line.

    Raises:
        ModuleNotFoundError: ziglang is not installed.
        RuntimeError: zig failed; the message has its words.
    """
    if importlib.util.find_spec("ziglang") is None:
        raise ModuleNotFoundError(NO_COMPILER.format(call), name="ziglang")
    command = [sys.executable, "-m", "ziglang", *map(str, options)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{call}: linking failed: {done.stderr.strip()[:2000]}")
