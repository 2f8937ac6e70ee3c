"""From a kernel's source to machine code: `compiler` writes LLVM's text, LLVM optimises it once a target.

Imports llvmlite: loaded only when something must be compiled.
"""

from __future__ import annotations

import gc
import threading
from typing import TYPE_CHECKING, Any, NamedTuple

import llvmlite.binding as llvm

from sheldrake.common._native.compiler.module import text_of
from sheldrake.common._native.target import LIBM, Target

if TYPE_CHECKING:
    from sheldrake.common.kernel import Kernel

_one_at_a_time = threading.RLock()


class Lowered(NamedTuple):
    """An entry kernel before it is optimised: LLVM's text and bitcode, free of any platform, and what its loops are."""

    text: str
    bitcode: bytes
    short_loops: bool


def lower(kernel: Kernel, symbol: str) -> Lowered:
    """An entry kernel in LLVM's language.

    Raises:
        KernelError: if the source is not the language of kernels.
        TypeError: if the entry returns anything but None or an integer, or its source is not there.
    """
    with _one_at_a_time:
        was_enabled = gc.isenabled()
        gc.disable()  # the compiler makes many small objects that all stay alive
        try:
            return read(text_of(kernel, symbol), kernel.short_loops)
        finally:
            if was_enabled:
                gc.enable()


def read(text: str, short_loops: bool) -> Lowered:
    """What `lower` gives, of LLVM's text.

    Raises:
        RuntimeError: if LLVM does not understand the text.
    """
    module = llvm.parse_assembly(text)
    module.verify()
    return Lowered(text, module.as_bitcode(), short_loops)


def emit(lowered: Lowered, symbol: str, target: Target, rename: str | None = None) -> bytes:
    """Object file with machine code for `target` of what `lower` gave; the function is called `rename` in it.

    Raises:
        TypeError: if the code needs anything but libm, memset, memcpy and memmove.
    """
    module = llvm.parse_bitcode(lowered.bitcode)
    machine = target.machine()
    module.triple, module.data_layout = target.triple, str(machine.target_data)
    _optimise(module, symbol, machine, lowered.short_loops)
    foreign = {f.name for f in module.functions if f.is_declaration and not f.name.startswith("llvm.")} - LIBM
    if foreign:
        raise TypeError(f"kernel {symbol} needs {sorted(foreign)}: a kernel may call libm and nothing else.")
    if rename:
        module.get_function(symbol).name = rename
    return machine.emit_object(module)


def _optimise(module: Any, symbol: str, machine: Any, short_loops: bool) -> None:
    for f in module.functions:
        if not f.is_declaration:
            f.linkage = "external" if f.name == symbol else "internal"
    for g in list(module.global_variables):
        if not g.is_declaration:
            g.linkage = "internal"

    options = llvm.PipelineTuningOptions(speed_level=3)
    options.loop_vectorization = options.loop_unrolling = not short_loops
    options.slp_vectorization = True
    passes = llvm.create_pass_builder(machine, options)
    passes.getModulePassManager().run(module, passes)
