"""From a kernel's source to machine code: numba lowers once, LLVM optimises once a target.

Imports numba: loaded only when something must be compiled.
"""

from __future__ import annotations

import gc
import os
from typing import TYPE_CHECKING, Any, NamedTuple

import llvmlite.binding as llvm
import numba
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.compiler_lock import global_compiler_lock

from sheldrake.common._native.arrays import ArrayType, VectorsType, make_array, make_vectors
from sheldrake.common._native.lean import OUTLINED, Lean
from sheldrake.common._native.pipeline import KernelCompiler
from sheldrake.common._native.target import Target
from sheldrake.common.kernel import INDEX_ERROR, ArraySpec

if TYPE_CHECKING:
    from sheldrake.common.kernel import Kernel

I64, F64 = ir.IntType(64), ir.DoubleType()
FASTMATH = {"contract", "nsz", "arcp"}
LIBM = frozenset(
    "sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp exp2 expm1 log log2 log10 log1p pow sqrt "
    "floor ceil trunc round fabs fmod fma fmin fmax hypot cbrt copysign ldexp memset memcpy memmove".split()
)
"""The only symbols a kernel may leave to the linker: kernels allocate nothing and call nobody."""


def dispatcher_of(kernel: Kernel) -> Any:
    """numba's dispatcher for a kernel, with the options every kernel has.

    `_nrt=False` makes an allocation a compile error and halves the code; it is numba's private option, which is why
    numba's minor version is pinned.
    """
    from sheldrake.common._native import overloads

    overloads.register()
    options: dict[str, Any] = dict(_nrt=False, error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)
    options["pipeline_class"] = KernelCompiler
    options["boundscheck"] = os.environ.get("SHELDRAKE_BOUNDSCHECK", "0") != "0"
    if not kernel.strict:
        options["fastmath"] = FASTMATH
    options["forceinline"] = not kernel.top and not kernel.outline
    if kernel.outline:
        OUTLINED.add(kernel.py_func)
    return numba.njit(**options)(kernel.py_func)


def _array_type(spec: ArraySpec) -> ArrayType:
    return ArrayType(getattr(types, spec.dtype), spec.ndim)


def _signature(kernel: Kernel) -> tuple:
    signature: list[Any] = []
    for p in kernel.parameters:
        if p.kind in ("t", "float"):
            signature.append(types.float64)
        elif p.kind == "int":
            signature.append(types.int64)
        elif p.kind == "array":
            signature.append(_array_type(p.fields[0]))
        elif p.kind == "arrays":
            signature.append(VectorsType(getattr(types, p.fields[0].dtype)))
        else:
            signature.append(types.BaseTuple.from_types([_array_type(s) for s in p.fields], p.cls))
    return tuple(signature)


class _Reader:
    """Emits the code that reads an entry's arguments from `words`."""

    def __init__(self, context: Any, builder: Any, function: Any):
        self.context, self.b, self.at = context, builder, 0
        self.t, slab, self.words = function.args
        self.slab = builder.ptrtoint(slab, I64)

    def word(self) -> Any:
        self.at += 1
        return self.b.load(self.b.gep(self.words, [I64(self.at - 1)]))

    def array(self, spec: ArraySpec) -> Any:
        b, where = self.b, self.word()
        address = where if spec.absolute else b.add(self.slab, b.shl(where, I64(3)))
        shape = [self.word() for _ in range(spec.ndim)]
        return make_array(self.context, b, _array_type(spec), address, shape)

    def argument(self, p: Any, ty: Any) -> Any:
        if p.kind == "t":
            return self.t
        if p.kind == "float":
            return self.b.bitcast(self.word(), F64)
        if p.kind == "int":
            return self.word()
        if p.kind == "array":
            return self.array(p.fields[0])
        if p.kind == "arrays":
            return make_vectors(self.context, self.b, ty, self.slab, self.words, self.word(), self.word())
        return self.context.make_tuple(self.b, ty, [self.array(s) for s in p.fields])


def _lower(kernel: Kernel, symbol: str) -> Any:
    """The unoptimised LLVM module of everything an entry needs, with `symbol` as its one function of the ABI."""
    signature = _signature(kernel)
    entry = kernel.dispatcher
    with Lean(), global_compiler_lock:
        entry.compile(signature)
        compiled = entry.overloads[signature]
        context, described = compiled.target_context, compiled.fndesc
        library = context.codegen().create_library(f"abi.{symbol}")
        module = library.create_ir_module(f"abi.{symbol}")
        kind = ir.FunctionType(I64, [F64, F64.as_pointer(), I64.as_pointer()])
        function = ir.Function(module, kind, symbol)
        function.calling_convention = ""
        builder = ir.IRBuilder(function.append_basic_block())
        reader = _Reader(context, builder, function)
        args = [reader.argument(p, ty) for p, ty in zip(kernel.parameters, signature)]
        function_type = context.call_conv.get_function_type(described.restype, described.argtypes)
        inner = cgutils.get_or_insert_function(module, function_type, described.llvm_func_name)
        status, out = context.call_conv.call_function(builder, inner, described.restype, described.argtypes, args)
        if isinstance(described.restype, types.Integer):
            result = builder.sext(out, I64) if out.type != I64 else out
        elif described.restype is types.none:
            result = I64(0)
        else:
            raise TypeError(f"{kernel!r} returns {described.restype}; an entry kernel returns None or an int status.")
        builder.ret(builder.select(status.is_error, I64(INDEX_ERROR), result))
        library.add_ir_module(module)
        library.add_linking_library(compiled.library)
        return library.linked()


class Lowered(NamedTuple):
    """An entry kernel before it is optimised: LLVM's bitcode, free of any platform, and what its loops are."""

    bitcode: bytes
    short_loops: bool


def lower(kernel: Kernel, symbol: str) -> Lowered:
    """An entry kernel in LLVM's language.

    Raises:
        numba.core.errors.NumbaError: if the source is not what numba can type.
        TypeError: if the entry returns anything but None or an integer.
    """
    was_enabled = gc.isenabled()
    gc.freeze()
    gc.disable()  # the compiler makes millions of small objects that all stay alive
    try:
        return Lowered(_lower(kernel, symbol).as_bitcode(), kernel.short_loops)
    finally:
        gc.unfreeze()
        if was_enabled:
            gc.enable()


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
