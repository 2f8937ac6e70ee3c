"""numba without what it does for others: while `Lean` is active, it writes LLVM's text and nothing else.

A scene has some 240 kernels, each a small function, so that what numba does once a function is most of a compile: it
links each function with all it calls, asks all of NumPy's rules at every `a * b`, and tells listeners of each step.
Imports numba; all of this is its inner life, which is why its minor version is pinned.
"""

from __future__ import annotations

import functools
import weakref
from typing import Any

import llvmlite.binding as llvm
from numba.core import base, cgutils, codegen, cpu, dispatcher, event, imputils, lowering, postproc, transforms
from numba.core.types import functions

OUTLINED: weakref.WeakSet = weakref.WeakSet()
"""Python functions of the kernels that are compiled once and called."""
_typed: dict[tuple, Any] = {}
_takes_loc = functools.cache(base._has_loc)
_size_of = functools.cache(base.BaseContext.get_abi_sizeof)


class Texts(codegen.CodeLibrary):
    """LLVM's text of one function, and the libraries of those that it calls."""

    def __init__(self, owner: Any, name: str):
        super().__init__(owner, name)
        self._texts: list[str] = []
        self._called: list[Texts] = []

    def add_ir_module(self, ir_module: Any) -> None:
        self._texts.append(cgutils.normalize_ir_text(str(ir_module)))

    def add_linking_library(self, library: Texts) -> None:
        self._called.append(library)

    def finalize(self) -> None:
        self._finalized = True

    def linked(self) -> Any:
        """One LLVM module of this function and of all that it needs, verified."""
        module = llvm.parse_assembly(str(self._codegen._create_empty_module(self.name)))
        libraries: list[Texts] = [self]
        seen = {self}
        for library in libraries:  # grows while it runs
            for text in library._texts:
                module.link_in(llvm.parse_assembly(text))
            new = [called for called in dict.fromkeys(library._called) if called not in seen]
            libraries += new
            seen.update(new)
        module.verify()
        return module

    def _no_code(self, *_: Any) -> Any:
        raise NotImplementedError("Kernels are compiled by sheldrake, not by numba's own engine.")

    get_function = get_llvm_str = get_asm_str = _no_code


class Lean:
    """A context in which numba compiles kernels; one at a time, under numba's own lock."""

    def __enter__(self) -> None:
        patches: list[tuple[Any, str, Any]] = [
            (codegen.JITCPUCodegen, "_library_class", Texts),
            (cpu.CPUContext, "get_executable", lambda self, library, fndesc, env: lambda: fndesc),
            (dispatcher._DispatcherBase, "add_overload", _add_overload),
            (base, "user_function", _call_of(imputils.user_function)),
            (lowering.BaseLower, "setup_function", _set_up(lowering.BaseLower.setup_function)),
            (lowering.Lower, "delvar", lambda self, name: None),  # kernels own nothing that must be given back
            (postproc.PostProcessor, "run", _lifetimes_of(postproc.PostProcessor.run)),
            (functions.BaseFunction, "get_call_type", _typed_once(functions.BaseFunction.get_call_type)),
            (base, "_has_loc", _takes_loc),
            (base.BaseContext, "get_abi_sizeof", _size_of),
            (event, "broadcast", lambda what: None),
        ]
        self.saved = [(owner, name, getattr(owner, name)) for owner, name, _ in patches]
        for owner, name, replacement in patches:
            setattr(owner, name, replacement)

    def __exit__(self, *_: object) -> None:
        for owner, name, original in self.saved:
            setattr(owner, name, original)


def _add_overload(self: Any, compiled: Any) -> None:
    self.overloads[tuple(compiled.signature.args)] = compiled


def _call_of(plain: Any) -> Any:
    def call(function: Any, libs: Any = ()) -> Any:
        """A call of another kernel: without bounds checks none can fail, so nothing is asked after it."""

        def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            if context.enable_boundscheck:
                return checked(context, builder, sig, args)
            callee = context.declare_function(builder.module, function)
            return context.call_conv.call_function(builder, callee, function.restype, function.argtypes, args)[1]

        checked = plain(function, libs)
        generate.signature, generate.libs = function.argtypes, tuple(libs)  # type: ignore[attr-defined]
        return generate

    return call


def _set_up(plain: Any) -> Any:
    def setup_function(self: Any, described: Any) -> None:
        """Keeps large stages apart, which LLVM would inline where they are called once: most passes cost more then."""
        plain(self, described)
        if self.func_ir.func_id.func in OUTLINED:
            self.function.attributes.add("noinline")

    return setup_function


def _lifetimes_of(plain: Any) -> Any:
    def run(self: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
        """Lifetimes are worked out when something asks for them: nothing must be given back."""
        ir = self.func_ir
        if ir.is_generator:
            plain(self, emit_dels, extend_lifetimes)
            return
        ir.blocks = transforms.canonicalize_cfg(ir.blocks)
        ir.variable_lifetime, ir.generator_info = postproc.VariableLifetime(ir.blocks), None

    return run


def _typed_once(plain: Any) -> Any:
    def get_call_type(self: Any, context: Any, args: tuple, kws: dict) -> Any:
        """The signature of an operator or built-in function, found once for each list of argument types."""
        if kws:
            return plain(self, context, args, kws)
        key = (self, *args)
        if key not in _typed:
            found = plain(self, context, args, kws)
            if found is None or any(isinstance(a, functions.Dispatcher) for a in args):
                return found
            _typed[key] = found
        return _typed[key]

    return get_call_type
