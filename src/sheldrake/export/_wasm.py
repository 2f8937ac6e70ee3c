"""The kernels of a frozen diagram as one WebAssembly module, libm included: it imports nothing."""

from __future__ import annotations

from sheldrake.common._native import wasm
from sheldrake.export._frozen import FrozenDiagram
from sheldrake.export._wasm_linker import link


def wasm_module(frozen: FrozenDiagram) -> bytes:
    """The module: its memory is free from `__heap_base` on, its table grows, and each kernel is exported.

    Raises:
        ModuleNotFoundError: the wheel does not bring all of it, and llvmlite or ziglang is not there.
    """
    functions = frozen.description["functions"]
    objects = [wasm.code(f["text"], f["symbol"], f["short_loops"]) for f in functions]
    return link([*objects, wasm.libm()], [f["symbol"] for f in functions])
