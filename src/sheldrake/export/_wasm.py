"""The kernels of a frozen diagram as one WebAssembly module, libm included: it imports nothing."""

from __future__ import annotations

import pathlib
import tempfile

from sheldrake.common._native.target import Target
from sheldrake.export._frozen import FrozenDiagram
from sheldrake.export._objects import write_objects, zig

WASM = Target(
    "wasm32-unknown-wasi", 1, "generic", "+bulk-memory,+sign-ext,+mutable-globals,+nontrapping-fptoint", "static"
)


def wasm_module(frozen: FrozenDiagram, call: str) -> bytes:
    """The module: its memory is free from `__heap_base` on, its table grows, and each kernel is exported.

    Raises:
        ModuleNotFoundError: llvmlite or ziglang is not there.
        RuntimeError: the linker failed.
    """
    functions = frozen.description["functions"]
    with tempfile.TemporaryDirectory(prefix="sheldrake-") as name:
        folder = pathlib.Path(name)
        objects = write_objects(functions, WASM, folder)
        options = ["-target", "wasm32-wasi", "-mexec-model=reactor", "-nostartfiles", "-O2", "-s"]
        exports = [f"-Wl,--export={symbol}" for symbol in ("__heap_base", *(f["symbol"] for f in functions))]
        table = ["-Wl,--no-entry", "-Wl,--export-table", "-Wl,--growable-table"]
        out = folder / "kernels.wasm"
        zig(call, "cc", *options, *table, *exports, *objects, "-lm", "-o", out)
        return out.read_bytes()
