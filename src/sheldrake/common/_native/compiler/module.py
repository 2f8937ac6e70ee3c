"""All functions of an entry in LLVM's language, each once for each list of argument kinds."""

from __future__ import annotations

import os
import threading
import types
from typing import TYPE_CHECKING, Any, NamedTuple

from sheldrake.common._native import sanitizer
from sheldrake.common._native.compiler import memory, prelude
from sheldrake.common._native.compiler.body import Body, declarations, struct_of
from sheldrake.common._native.compiler.errors import KernelError
from sheldrake.common._native.compiler.function import Function
from sheldrake.common._native.compiler.kinds import DTYPES, FLOAT, INT, NONE, Array, Kind, Tuple, Value, Vectors
from sheldrake.common._native.compiler.scalars import Unfit, Wider
from sheldrake.common._native.compiler.source import source_of
from sheldrake.common.kernel import DISAGREEMENT, INDEX_ERROR, Kernel, LaneKernel

if TYPE_CHECKING:
    from sheldrake.common.kernel import ArraySpec, Parameter

_lock = threading.RLock()  # kinds are compared by identity: nobody makes two of one at the same time


class Options(NamedTuple):
    """How a function is compiled: whether sums with products have one rounding, and as in `common.kernel.kernel`."""

    fused: bool
    outline: bool


class Compiled(NamedTuple):
    """A function that is in the module."""

    name: str
    returns: Kind


class Module:
    """The functions that an entry needs; `text` is the whole."""

    def __init__(self, bounds: bool = False, lanes: bool = False) -> None:
        self.bounds, self.lanes, self.may_leave = bounds, lanes, bounds or lanes
        self.texts: list[str] = []
        self.compiled: dict[tuple, Compiled] = {}
        self.active: set[Any] = set()
        self.checked: set[Any] = set()  # functions whose grammar is right

    @staticmethod
    def kernel(caller: Function | _Reader, thing: object) -> tuple[Any, Options]:
        """The function of a kernel or of the prelude, and how it is compiled: the latter as its caller."""
        if isinstance(thing, Kernel):
            return thing.py_func, Options(not thing.strict, thing.outline)
        if isinstance(thing, types.FunctionType) and thing.__module__ == prelude.__name__:
            return thing, Options(caller.b.fused, False)
        return None, Options(False, False)

    def call(self, caller: Function, function: Any, options: Options, args: list[Value]) -> Value:
        """A call of a kernel; compiles it when it is met first with such arguments."""
        if function in self.active:
            raise Unfit(f"{function.__name__} calls itself: kernels do not recurse")
        self.active.add(function)
        try:
            if source_of(function).expression is not None and not options.outline:
                return self.inline(caller, function, options, args)
            key = (function, options, *(a.kind for a in args))
            if key not in self.compiled:
                self.compiled[key] = self.compile(function, options, [a.kind for a in args])
        finally:
            self.active.discard(function)
        return self.jump(caller, self.compiled[key], args)

    def inline(self, caller: Function, function: types.FunctionType, options: Options, args: list[Value]) -> Value:
        """The one expression of a kernel as part of its caller's text."""
        b = caller.b
        inner = Function(self, function, b)
        inner.check_grammar()
        inner.variables = dict(zip(inner.source.parameters, args))
        fused, b.fused = b.fused, options.fused
        try:
            return inner.within(inner.source.tree, inner.value, inner.source.expression)
        finally:
            b.fused = fused

    def returned(self, kind: Kind) -> tuple[str, ...]:
        """LLVM's types of what a function gives back; with bounds checks, first whether it stayed inside of arrays."""
        return ("i1", *kind.leaves) if self.may_leave else kind.leaves

    def jump(self, caller: Function | _Reader, callee: Compiled, args: list[Value]) -> Value:
        """The call of a function that is in the module."""
        b, kinds = caller.b, self.returned(callee.returns)
        given = ", ".join(f"{kind} {leaf}" for a in args for kind, leaf in zip(a.kind.leaves, a.leaves))
        if not kinds:
            b.do(f"call void @{callee.name}({given})")
            return Value(callee.returns, ())
        whole = _whole(kinds)
        result = b.op(f"call {whole} @{callee.name}({given})")
        leaves = [result]
        if len(kinds) > 1:
            leaves = [b.op(f"extractvalue {whole} {result}, {i}") for i in range(len(kinds))]
        if self.may_leave:
            b.leave_unless(leaves.pop(0))
        return Value(callee.returns, tuple(leaves))

    def compile(self, function: types.FunctionType, options: Options, kinds: list[Kind]) -> Compiled:
        """Puts a function into the module."""
        heads: list[str] = []
        values = []
        for kind in kinds:
            leaves = tuple(f"%a{len(heads) + i}" for i in range(len(kind.leaves)))
            heads += [f"{k} {leaf}" for k, leaf in zip(kind.leaves, leaves)]
            values.append(Value(kind, leaves))
        wider: dict[str, Kind] = {}
        while True:
            f = Function(self, function, Body(options.fused))
            f.wider = wider
            try:
                f.run(values)
                break
            except Wider as need:
                wider[need.name] = need.kind
        assert f.returns is not None
        name = f'"{function.__name__}:{len(self.compiled)}"'  # none of LLVM's own names, of any letters
        result = _whole(self.returned(f.returns))
        how = "noinline" if options.outline else "alwaysinline"
        self.texts.append(f.b.text(f"define internal {result} @{name}({', '.join(heads)}) {how} nounwind"))
        return Compiled(name, f.returns)

    def entry(self, kernel: Kernel, symbol: str) -> None:
        """Puts an entry and its function of the ABI into the module.

        Raises:
            KernelError: if the kernel or one that it calls is not what can be compiled.
            TypeError: if the entry returns anything but None or an integer.
        """
        kinds = [_kind_of(p) for p in kernel.parameters]
        self.active.add(kernel.py_func)
        reader = _Reader()
        inner = self.compile(*self.kernel(reader, kernel), kinds)
        if inner.returns is not NONE and inner.returns is not INT:
            raise TypeError(f"{kernel!r} returns {inner.returns!r}; an entry kernel returns None or an int status.")
        args = [Value(kind, tuple(reader.argument(p))) for p, kind in zip(kernel.parameters, kinds)]
        status = self.jump(reader, inner, args).leaves
        reader.b.end(f"ret i64 {status[0] if status else 0}")
        if reader.b.out is not None:
            reader.b.start(reader.b.out)
            reader.b.end(f"ret i64 {DISAGREEMENT if self.lanes else INDEX_ERROR}")
        self.texts.append(reader.b.text(f'define i64 @"{symbol}"(double %t, ptr %slab, ptr %words)'))

    def text(self) -> str:
        """The module in LLVM's language."""
        return "\n".join([*declarations(), sanitizer.CODE if sanitizer.SANITIZED else "", *self.texts])


class _Reader:
    """Writes the code that reads an entry's arguments from `words`."""

    def __init__(self) -> None:
        self.b, self.at = Body(False), 0
        self.slab = self.b.op("ptrtoint ptr %slab to i64")

    def word(self) -> str:
        self.at += 1
        return self.b.load("i64", self.b.op(f"getelementptr i64, ptr %words, i64 {self.at - 1}"))

    def array(self, spec: ArraySpec) -> list[str]:
        b, where = self.b, self.word()
        shift = memory.shift_of(DTYPES[spec.dtype])
        address = where if spec.absolute else b.op(f"add i64 {self.slab}, {b.op(f'shl i64 {where}, {shift}')}")
        shape = [self.word() for _ in range(spec.ndim)]
        if spec.width is not None:  # a number in the code: no products for addresses, no register for it
            shape[-1] = str(spec.width)
        return [b.op(f"inttoptr i64 {address} to ptr"), *shape]

    def argument(self, p: Parameter) -> list[str]:
        """The leaves of an argument of the entry."""
        if p.kind == "t":
            return ["%t"]
        if p.kind in ("float", "int"):
            word = self.word()
            return [self.b.op(f"bitcast i64 {word} to double") if p.kind == "float" else word]
        if p.kind == "arrays":
            number, at = self.word(), self.word()
            return [self.slab, self.b.op(f"getelementptr i64, ptr %words, i64 {at}"), number]
        return [leaf for spec in p.fields for leaf in self.array(spec)]


def _whole(kinds: tuple[str, ...]) -> str:
    """LLVM's type of what a function returns."""
    return "void" if not kinds else kinds[0] if len(kinds) == 1 else struct_of(kinds)


def _kind_of(p: Parameter) -> Kind:
    if p.kind in ("t", "float", "int"):
        return INT if p.kind == "int" else FLOAT
    if p.kind == "arrays":
        return Vectors(DTYPES[p.fields[0].dtype])
    arrays = tuple(Array(DTYPES[s.dtype], s.ndim) for s in p.fields)
    return Tuple(arrays, p.cls) if p.kind in ("tuple", "record") else arrays[0]


def text_of(kernel: Kernel, symbol: str) -> str:
    """An entry and all it needs, in LLVM's language; the same on every Python and every machine.

    Raises:
        KernelError: if something in it is not the language of kernels (`docs/kernels.md`).
        TypeError: if the entry returns anything but None or an integer, or a source is not there.
    """
    with _lock:
        bounds = sanitizer.SANITIZED or os.environ.get("SHELDRAKE_BOUNDSCHECK", "0") != "0"
        module = Module(bounds, isinstance(kernel, LaneKernel))
        try:
            module.entry(kernel, symbol)
        except KernelError as problem:
            raise problem.with_traceback(None) from None  # it says itself which line of which kernel is wrong
        except RecursionError:
            raise TypeError(f"{kernel!r}: an expression or the calls in it are nested too deeply.") from None
        return module.text()
