"""One kernel for one list of argument kinds: its statements and expressions as LLVM's text.

Methods are called as the parts of Python's syntax tree are: what has no `do_` or `of_` is not the language.

A variable that is stored once is the value itself. Others have slots, whose kind is that of
the first store; LLVM makes values of them.
"""

from __future__ import annotations

import ast
import builtins as python
import types
from collections.abc import Callable, Hashable, Sequence
from typing import TYPE_CHECKING, Any

from sheldrake.common._native import sanitizer
from sheldrake.common._native.compiler import memory, prelude, scalars
from sheldrake.common._native.compiler.body import Body, struct_of
from sheldrake.common._native.compiler.builtins import BUILTINS, meant, refusal
from sheldrake.common._native.compiler.errors import KernelError
from sheldrake.common._native.compiler.kinds import (
    BOOL,
    INT,
    LANES,
    MASK,
    NOTHING,
    Array,
    Constant,
    Kind,
    Scalar,
    Tuple,
    Value,
)
from sheldrake.common._native.compiler.scalars import LARGEST_POWER, Unfit, Wider, number, widest
from sheldrake.common._native.compiler.source import Source, source_of

if TYPE_CHECKING:
    from sheldrake.common._native.compiler.module import Module


class Function:
    """Compiles one function; `returns` is the kind of what it returns, known when it is done."""

    def __init__(self, module: Module, python_function: types.FunctionType, body: Body) -> None:
        self.module, self.python, self.b = module, python_function, body
        self.source: Source = source_of(python_function)
        self.at: ast.AST = self.source.tree  # what is being compiled
        self.variables: dict[str, Value] = {}
        self.slots: dict[str, tuple[Kind, list[str]]] = {}
        self.loops: list[tuple[str, str]] = []
        self.wider: dict[str, Kind] = {}
        self.returns: Kind | None = None
        self.item: Callable[[Value], None] | None = None  # what is done with what a loop's kernel yields
        self.after = ""  # where such a kernel returns to
        self.scope = ""  # before its variables, where the loop's function tells which must be wider
        self.loops_in: tuple[Any, ...] = (python_function,)  # kernels that this one is written into as a loop

    # ---- the whole

    def run(self, values: list[Value]) -> None:
        """Compiles the body, with parameters that have these values."""
        self.check_grammar()
        for name, value in zip(self.source.parameters, values):
            self.assign_name(name, value)
        self.block(self.source.body)
        if self.b.reached:
            if self.returns not in (None, NOTHING.kind):
                raise self.error(self.source.tree, f"returns {self.returns!r} on some ways and nothing on others")
            self.leave(NOTHING)
        self.returns = self.returns or NOTHING.kind  # of one that never ends
        if self.b.out is not None:  # where accesses out of bounds go
            self.b.start(self.b.out)
            self.b.end(self.result([_ZEROS.get(kind, "0") for kind in self.returns.leaves], "false"))

    def check_grammar(self) -> None:
        """Refuses what is wrong whatever the arguments are."""
        if self.python in self.module.checked:
            return
        given = self.source.tree.args
        if given.vararg or given.kwarg or given.kwonlyargs or given.posonlyargs or given.defaults:
            raise self.error(self.source.tree, "a kernel takes plain parameters, without defaults or stars")
        for n in (n for s in self.source.body for n in ast.walk(s)):
            part = type(n).__name__
            if isinstance(n, ast.stmt) and not hasattr(self, f"do_{part}"):
                raise self.error(n, f"a kernel has no statement `{_word(n)}`")
            if isinstance(n, ast.expr) and not hasattr(self, f"of_{part}") and part not in ("Yield", "YieldFrom"):
                raise self.error(n, f"a kernel has no {_word(n)}")
        if self.source.yields > 1:
            raise self.error(self.source.tree, "a kernel yields in one place: loops have their body there")
        self.module.checked.add(self.python)

    def leave(self, value: Value) -> None:
        """Returns from the function."""
        if self.item is not None:
            self.b.go(self.after)
            return
        value = self.decided(value)
        if self.returns is None:
            self.returns = self.wider.get("", value.kind)
        if (wide := widest(self.returns, value.kind)) is not self.returns:
            raise Wider("", wide)
        value = self.fit(value, self.returns, "is returned where an earlier return gives")
        self.b.end(self.result(value.leaves, "true"))

    def result(self, leaves: Sequence[str], inside: str) -> str:
        """The instruction that returns leaves; before them, with bounds checks, whether it stayed inside of arrays."""
        assert self.returns is not None
        kinds = self.module.returned(self.returns)
        leaves = [inside, *leaves] if self.module.may_leave else leaves
        if len(kinds) <= 1:
            return f"ret {kinds[0]} {leaves[0]}" if kinds else "ret void"
        whole = struct_of(kinds)
        result = "undef"
        for i, (kind, leaf) in enumerate(zip(kinds, leaves)):
            result = self.b.op(f"insertvalue {whole} {result}, {kind} {leaf}, {i}")
        return f"ret {whole} {result}"

    def error(self, node: ast.AST, message: str) -> KernelError:
        """An error at a place of this kernel."""
        return KernelError(f"{self.python.__name__}: {message}", self.source.path, node)

    # ---- statements

    def block(self, statements: list[ast.stmt]) -> None:
        """Statements, as far as a path leads there."""
        for statement in statements:
            if not self.b.reached:
                return
            self.within(statement, getattr(self, f"do_{type(statement).__name__}"), statement)

    def within(self, node: ast.AST, compile: Callable[..., Any], *args: object) -> Any:
        """What `compile(*args)` gives for a node; what does not fit together is an error where it was met."""
        self.at = node
        try:
            return compile(*args)
        except Unfit as problem:
            raise self.error(self.at, str(problem)) from None

    def do_Assign(self, s: ast.Assign) -> None:
        value = self.value(s.value)
        for target in s.targets:
            self.assign(target, value)

    def do_AnnAssign(self, s: ast.AnnAssign) -> None:
        if s.value is not None:
            self.assign(s.target, self.value(s.value))

    def assign(self, target: ast.expr, value: Value) -> None:
        """Stores into a name, an item of an array, a field of a row, or a tuple of such."""
        self.at = target
        if isinstance(target, ast.Name):
            self.assign_name(target.id, value)
        elif isinstance(target, ast.Tuple):
            if not isinstance(value.kind, Tuple) or len(value.kind.items) != len(target.elts):
                raise Unfit(f"{value.kind!r} cannot be unpacked into {len(target.elts)}")
            for i, part in enumerate(target.elts):
                self.assign(part, value.item(i))
        elif isinstance(target, (ast.Subscript, ast.Attribute)):
            memory.place_of(self, target).write(self, value)
        else:
            raise Unfit("a kernel stores into names, items of arrays and fields")

    def decided(self, value: Value) -> Value:
        """What lanes say of a comparison, when it is kept: they must agree."""
        return Value(BOOL, (scalars.truth(self.b, value),)) if value.kind is MASK else value

    def assign_name(self, name: str, value: Value) -> None:
        value = self.decided(value)
        self.b.known |= {self.scope + name}
        was = self.slots[name][0] if name in self.slots else self.variables.get(name, value).kind
        if name in self.source.slotted and isinstance(was, Constant) and was is not value.kind:
            raise Unfit(f"`{name}` is {was!r}, which is known while compiling and stays")
        if name in self.source.parameters and was is not value.kind and was.holds_arrays:
            raise Unfit(f"`{name}` is {was!r} that the caller gave: store into its items or fields")
        if isinstance(value.kind, Constant) or name not in self.source.slotted:
            if name in self.slots:
                raise Unfit(f"{value.kind!r} is given to `{name}`, which has been {self.slots[name][0]!r}")
            self.variables[name] = value
            return
        if name not in self.slots:
            kind = self.wider.get(self.scope + name, value.kind)
            self.slots[name] = kind, [self.b.slot(leaf) for leaf in kind.leaves]
        kind, slots = self.slots[name]
        if (wide := widest(kind, value.kind)) is not kind:
            raise Wider(self.scope + name, wide)
        value = self.fit(value, kind, f"is given to `{name}`, which has been")
        for leaf_kind, leaf, slot in zip(kind.leaves, value.leaves, slots):
            self.b.store(leaf_kind, leaf, slot)

    def fit(self, value: Value, kind: Kind, why: str) -> Value:
        """A value as one of a kind."""
        if (leaves := self.fitted(value, kind)) is not None:
            return value if value.kind is kind else Value(kind, leaves)
        late = value.kind is scalars.FLOAT and kind is INT and "which has been" in why
        hint = ": a variable has one kind, so begin with 0.0 instead of 0" if late else ""
        raise Unfit(f"{value.kind!r} {why} {kind!r}{hint}")

    def fitted(self, value: Value, kind: Kind) -> tuple[str, ...] | None:
        """The leaves of a value as one of a kind, if it fits."""
        if value.kind is kind:
            return value.leaves
        if isinstance(kind, Scalar) and isinstance(value.kind, Scalar) and value.kind.rank < kind.rank:
            return scalars.convert(self.b, value, kind).leaves
        if isinstance(kind, Tuple) and isinstance(value.kind, Tuple) and len(kind.items) == len(value.kind.items):
            items = [self.fitted(value.item(i), k) for i, k in enumerate(kind.items)]
            return None if None in items else tuple(leaf for item in items for leaf in item or ())
        return None

    def do_AugAssign(self, s: ast.AugAssign) -> None:
        if isinstance(s.target, ast.Name):
            old = self.value(ast.copy_location(ast.Name(s.target.id, ast.Load()), s.target))
            self.assign(s.target, self.arithmetic(s.op, old, self.value(s.value)))
            return
        self.at = s.target
        place = memory.place_of(self, s.target)
        old, self.at = place.read(self), s
        place.write(self, self.arithmetic(s.op, old, self.value(s.value)))

    def do_Expr(self, s: ast.Expr) -> None:
        if isinstance(s.value, ast.Yield) and self.item is not None:
            self.item(NOTHING if s.value.value is None else self.value(s.value.value))
        elif isinstance(s.value, ast.YieldFrom) and self.item is not None:
            each = ast.Name("each of", ast.Load())
            loop = ast.For(ast.Name("each of", ast.Store()), s.value.value, [ast.Expr(ast.Yield(each))], [])
            self.do_For(ast.fix_missing_locations(ast.copy_location(loop, s)))
        elif not isinstance(s.value, ast.Constant):
            self.value(s.value)

    def do_Return(self, s: ast.Return) -> None:
        self.leave(NOTHING if s.value is None else self.value(s.value))

    def do_Pass(self, s: ast.Pass) -> None:
        """Nothing."""

    def do_If(self, s: ast.If) -> None:
        b, yes, no = self.b, self.b.label(), self.b.label()
        after = b.label() if s.orelse else no
        self.branch(s.test, yes, no)
        b.start(yes)
        self.block(s.body)
        if s.orelse:
            b.go(after)
            b.start(no)
            self.block(s.orelse)
        if b.reached or after in b.targets:
            b.start(after)

    def do_While(self, s: ast.While) -> None:
        b, head, body, after = self.b, self.b.label(), self.b.label(), self.b.label()
        self.refuse_else(s)
        b.start(head)
        forever = isinstance(s.test, ast.Constant) and bool(s.test.value)
        if forever:
            b.go(body)
        else:
            self.branch(s.test, body, after)
        b.start(body)
        self.inside(s.body, head, after)
        b.go(head)
        if after in b.targets:
            b.start(after)

    def inside(self, statements: list[ast.stmt], again: str, after: str) -> None:
        """The body of a loop."""
        self.loops.append((again, after))
        self.block(statements)
        self.loops.pop()

    def refuse_else(self, s: ast.For | ast.While) -> None:
        if s.orelse:
            raise self.error(s.orelse[0], "a loop in a kernel has no `else`")

    def do_Break(self, s: ast.Break) -> None:
        self.b.go(self.loops[-1][1])

    def do_Continue(self, s: ast.Continue) -> None:
        self.b.go(self.loops[-1][0])

    def do_For(self, s: ast.For) -> None:
        self.refuse_else(s)
        if isinstance(s.iter, ast.Call):
            over = getattr(self.value(s.iter.func).kind, "thing", None)
            if over is range:
                self.for_range(s, s.iter)
                return
            function, options = self.module.kernel(self, over)
            self.at = s.iter
            if function is not None and self.source_at(function).yields:
                self.for_each(s, s.iter, function, options.fused)
                return
        items = self.value(s.iter)
        if not isinstance(items.kind, Tuple) or len(set(items.kind.items)) > 1:
            raise self.error(s.iter, f"a kernel loops over a range or a tuple of like items, not {items.kind!r}")
        n = len(items.kind.items)
        if n:
            table = memory.table_of(self, items)
            self.count(s, "0", str(n), 1, lambda i: memory.look_up(self, items, table, i))

    def for_range(self, s: ast.For, call: ast.Call) -> None:
        """Counts; by other steps than 1 or -1, the steps themselves, whose number is worked out before."""
        if call.keywords or not 1 <= len(call.args) <= 3:
            raise self.error(call, "a range has one to three arguments")
        bounds = [scalars.convert(self.b, self.value(a), INT) for a in call.args]
        start, stop = (number(0), bounds[0]) if len(bounds) == 1 else bounds[:2]
        step = bounds[2].known if len(bounds) > 2 else 1
        if not step:
            raise self.error(call.args[2], "the step of a range is a number that is known and not 0")
        if abs(step) == 1:
            self.count(s, start.leaves[0], stop.leaves[0], step, lambda i: i)
            return
        b, (low, high) = self.b, (start, stop) if step > 0 else (stop, start)
        some = b.op(f"icmp slt i64 {low.leaves[0]}, {high.leaves[0]}")
        gap = b.op(f"sub i64 {b.op(f'sub i64 {high.leaves[0]}, {low.leaves[0]}')}, 1")
        steps = b.op(f"add i64 {b.op(f'udiv i64 {gap}, {abs(step)}')}, 1")
        steps = b.op(f"select i1 {some}, i64 {steps}, i64 0")

        def item(i: Value) -> Value:
            return Value(INT, (b.op(f"add i64 {start.leaves[0]}, {b.op(f'mul i64 {i.leaves[0]}, {step}')}"),))

        self.count(s, "0", steps, 1, item, "ult")  # there may be 2**63 steps

    def for_each(self, s: ast.For, call: ast.Call, function: types.FunctionType, fused: bool) -> None:
        """Loops over what a kernel yields: it is written here, and the body of the loop in the place of its `yield`."""
        b, after = self.b, self.b.label()
        args = self.arguments(call)
        self.check_number(function, args)
        if function in self.loops_in:
            raise Unfit(f"{function.__name__} loops over itself: kernels do not recurse")

        def item(value: Value) -> None:
            onward, inner_fused, b.fused = b.label(), b.fused, own_fused
            try:
                self.within(s.target, self.assign, s.target, value)
                self.inside(s.body, onward, after)
            except KernelError as problem:
                in_body.append(problem)
                raise
            b.start(onward)
            b.fused = inner_fused

        inner = Function(self.module, function, b)
        inner.item, inner.after = item, after
        inner.wider, inner.scope = self.wider, f"{function.__name__}."
        inner.loops_in = (*self.loops_in, function)
        in_body: list[KernelError] = []
        own_fused, b.fused = b.fused, fused
        try:
            inner.check_grammar()
            for name, value in zip(inner.source.parameters, args):
                inner.assign_name(name, value)
            inner.block(inner.source.body)
        except KernelError as problem:
            if problem not in in_body:
                problem.called_at(function.__name__, self.source.path, call)
            raise
        b.fused = own_fused
        b.start(after)

    def count(
        self, s: ast.For, start: str, stop: str, step: int, item: Callable[[Value], Value], below: str = "slt"
    ) -> None:
        b, head, body, latch, after = self.b, self.b.label(), self.b.label(), self.b.label(), self.b.label()
        before, following = b.block, f"%n{b.label()}"
        b.start(head)
        i = b.op(f"phi i64 [{start}, %{before}], [{following}, %{latch}]")
        b.fork(b.op(f"icmp {below if step > 0 else 'sgt'} i64 {i}, {stop}"), body, after)
        b.start(body)
        self.assign(s.target, item(Value(INT, (i,))))
        self.inside(s.body, latch, after)
        b.start(latch)
        b.do(f"{following} = add nsw i64 {i}, {step}")
        b.go(head)
        b.start(after)

    # ---- conditions

    def branch(self, test: ast.expr, yes: str, no: str) -> None:
        """A jump to one of two blocks."""
        if isinstance(test, ast.BoolOp):
            for part in test.values[:-1]:
                onward = self.b.label()
                self.branch(part, *((onward, no) if isinstance(test.op, ast.And) else (yes, onward)))
                self.b.start(onward)
            self.branch(test.values[-1], yes, no)
        elif isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
            self.branch(test.operand, no, yes)
        else:
            self.b.fork(self.truth(test), yes, no)

    def truth(self, test: ast.expr) -> str:
        return self.value(test, scalars.truth)

    def check_index(self, i: str, n: str) -> None:
        """With bounds checks, leaves the function where an index is not in an array of length n."""
        if self.module.bounds:
            self.b.leave_unless(self.b.op(f"icmp ult i64 {i}, {n}"))

    def check_memory(self, pointer: str) -> str:
        """An address; of a sanitised kernel, leaves the function where it is in no living array."""
        if sanitizer.SANITIZED:
            self.b.leave_unless(self.b.op(f"call i1 @in_living_memory(ptr {pointer})"))
        return pointer

    # ---- expressions

    def value(self, e: ast.expr, use: Callable[[Body, Value], Any] | None = None) -> Any:
        """The value of an expression, or what is made of it."""
        outer, self.at = self.at, e
        value = getattr(self, f"of_{type(e).__name__}", self.no_expression)(e)
        result = value if use is None else use(self.b, value)
        self.at = outer
        return result

    def no_expression(self, e: ast.expr) -> Value:
        raise Unfit(f"a kernel has no {_word(e)} here")

    def of_Constant(self, e: ast.Constant) -> Value:
        return self.of_python(e.value)

    def of_python(self, thing: Any) -> Value:
        """What a constant of Python is."""
        thing = thing.item() if hasattr(thing, "dtype") and getattr(thing, "ndim", 1) == 0 else thing
        if isinstance(thing, (bool, int, float, complex)):
            return number(thing)
        if isinstance(thing, tuple):
            return Value.pack([self.of_python(x) for x in thing], type(thing) if hasattr(thing, "_fields") else None)
        return NOTHING if thing is None else Value(Constant(thing), (), thing)

    def of_Name(self, e: ast.Name) -> Value:
        if e.id in self.source.variables and self.scope + e.id not in self.b.known:
            raise Unfit(f"`{e.id}` has a value on some ways here and none on others")
        if e.id in self.variables:
            return self.variables[e.id]
        if e.id in self.slots:
            kind, slots = self.slots[e.id]
            return Value(kind, tuple(self.b.load(k, slot) for k, slot in zip(kind.leaves, slots)))
        function = self.python
        if e.id in function.__code__.co_freevars:
            cell = function.__closure__[function.__code__.co_freevars.index(e.id)]  # type: ignore[index]
            if cell != types.CellType():
                return self.of_python(cell.cell_contents)
        for scope in (function.__globals__, vars(python)):
            if e.id in scope and e.id not in self.source.slotted:
                return self.of_python(scope[e.id])
        raise Unfit(f"`{e.id}` has no value here")

    def of_Tuple(self, e: ast.Tuple) -> Value:
        return Value.pack([self.value(x) for x in e.elts])

    def of_Attribute(self, e: ast.Attribute) -> Value:
        base = self.value(e.value)
        kind = base.kind
        if (place := memory.field(self, base, e.attr)) is not None:
            return place if isinstance(place, Value) else place.read(self)
        if isinstance(kind, Array) and e.attr == "shape":
            return Value.pack([Value(INT, (n,)) for n in base.leaves[1:]])
        if isinstance(kind, Scalar) and e.attr in ("real", "imag"):
            return scalars.real(base) if e.attr == "real" else scalars.imaginary(base)
        if isinstance(kind, Constant) and hasattr(kind.thing, e.attr):
            return self.of_python(getattr(kind.thing, e.attr))
        raise Unfit(f"{kind!r} has no `{e.attr}`")

    def of_Subscript(self, e: ast.Subscript) -> Value:
        return memory.subscript(self, e)

    def of_UnaryOp(self, e: ast.UnaryOp) -> Value:
        if isinstance(e.op, ast.USub) and isinstance(e.operand, ast.Constant) and type(e.operand.value) is int:
            return number(-e.operand.value)  # the least integer is minus one that has no place
        x = self.value(e.operand)
        if isinstance(e.op, ast.Not):
            return Value(BOOL, (self.b.op(f"xor i1 {scalars.truth(self.b, x)}, true"),))
        if isinstance(e.op, ast.USub):
            return scalars.negate(self.b, x)
        if isinstance(e.op, ast.Invert):
            return scalars.invert(self.b, x)
        return scalars.convert(self.b, x, max(scalars.common(x), INT, key=lambda k: k.rank))

    def of_BinOp(self, e: ast.BinOp) -> Value:
        return self.arithmetic(e.op, self.value(e.left), self.value(e.right))

    def arithmetic(self, op: ast.operator, x: Value, y: Value) -> Value:
        if isinstance(op, ast.Pow) and y.kind is INT and y.known is not None and 0 <= y.known <= LARGEST_POWER:
            return self.power(scalars.convert(self.b, x, scalars.common(x, y)), y.known)
        result = scalars.binary(self.b, type(op), x, y)
        if isinstance(result, Value):
            return result
        kind = scalars.common(x, y, *([number(0)] if result.endswith("_int") else []))
        return self.call(getattr(prelude, result), [scalars.convert(self.b, v, kind) for v in (x, y)])

    def power(self, x: Value, n: int) -> Value:
        """x ** n by squaring."""
        result, square = None, x
        while n:
            if n & 1:
                result = square if result is None else self.arithmetic(ast.Mult(), result, square)
            n >>= 1
            if n:
                square = self.arithmetic(ast.Mult(), square, square)
        return scalars.convert(self.b, number(1), x.kind) if result is None else result

    def of_Compare(self, e: ast.Compare) -> Value:
        if len(e.ops) > 1:
            raise Unfit("a kernel compares two numbers; write `a < b and b < c`")
        if type(e.ops[0]) not in scalars.INT_COMPARE:
            raise Unfit(f"a kernel has no comparison `{_word(e.ops[0])}`")
        return scalars.compare(self.b, type(e.ops[0]), self.value(e.left), self.value(e.comparators[0]))

    def of_BoolOp(self, e: ast.BoolOp) -> Value:
        b, merge, ways = self.b, self.b.label(), []
        is_and = isinstance(e.op, ast.And)
        for part in e.values[:-1]:
            onward, condition = b.label(), self.truth(part)
            ways.append(((("false" if is_and else "true"),), b.block))
            b.fork(condition, *((onward, merge) if is_and else (merge, onward)))
            b.start(onward)
        ways.append(((self.truth(e.values[-1]),), b.block))
        b.start(merge)
        return Value(BOOL, b.phi(("i1",), ways))

    def of_IfExp(self, e: ast.IfExp) -> Value:
        b, yes, no, merge = self.b, self.b.label(), self.b.label(), self.b.label()
        if isinstance(e.test, ast.Compare):
            test = self.value(e.test)
            if test.kind is MASK:
                return self.choose_by_lanes(test, self.value(e.body), self.value(e.orelse))
            b.fork(scalars.truth(b, test), yes, no)
        else:
            self.branch(e.test, yes, no)
        b.start(yes)
        one, one_block, mark = self.value(e.body), b.block, len(b.lines)
        b.go(merge)
        b.start(no)
        other = self.value(e.orelse)
        kind = widest(one.kind, other.kind)
        if isinstance(kind, Scalar) and isinstance(other.kind, Scalar):
            kind = scalars.common(one, other)
        rest = b.lines[mark:]  # a conversion of the first choice stands where that choice is made
        del b.lines[mark:]
        one = self.fit(one, kind, "is chosen where the other choice is")
        b.lines += rest
        other = self.fit(other, kind, "is chosen where the other choice is")
        ways = [(one.leaves, one_block), (other.leaves, b.block)]
        b.start(merge)
        return Value(kind, b.phi(kind.leaves, ways))

    def choose_by_lanes(self, mask: Value, one: Value, other: Value) -> Value:
        """In each lane one of two values, both of which are worked out; where they have integers, lanes must agree."""
        kind, why = widest(one.kind, other.kind), "is chosen where the other choice is"
        if isinstance(kind, Scalar) and isinstance(other.kind, Scalar):
            kind = scalars.common(one, other)
        kind = scalars.on_lanes(kind)
        one, other = self.fit(one, kind, why), self.fit(other, kind, why)
        alike = all(leaf == LANES.element for leaf in kind.leaves)
        return self.choose(mask if alike else self.decided(mask), one, other)

    def choose(self, condition: Value, one: Value, other: Value) -> Value:
        """One of two values of a kind, both of which are there."""
        pairs = zip(one.kind.leaves, one.leaves, other.leaves)
        test = f"{condition.kind.leaves[0]} {condition.leaves[0]}"
        return Value(one.kind, tuple(self.b.op(f"select {test}, {k} {x}, {k} {y}") for k, x, y in pairs))

    # ---- calls

    def of_Call(self, e: ast.Call) -> Value:
        called = self.value(e.func)
        if not isinstance(called.kind, Constant):
            raise self.error(e.func, f"{called.kind!r} cannot be called")
        return self.call(called.kind.thing, self.arguments(e))

    def arguments(self, e: ast.Call) -> list[Value]:
        """What a call gives."""
        if e.keywords:
            raise Unfit("a call in a kernel has no keyword arguments")
        return [self.value(a) for a in e.args]

    def call(self, thing: Any, args: list[Value]) -> Value:
        """A call of a builtin, a class of tuples, or another kernel."""
        thing = meant(thing)
        if (builtin := BUILTINS.get(thing) if isinstance(thing, Hashable) else None) is not None:
            made, least, most = builtin
            if not least <= len(args) <= most:
                wanted = f"{least}" if least == most else f"{least} or more" if most > 9 else f"{least} to {most}"
                raise Unfit(f"{thing.__name__} takes {wanted} arguments, not {len(args)}")
            return made(self, *args)
        if isinstance(thing, type) and hasattr(thing, "_fields"):
            if len(args) != len(thing._fields):
                raise Unfit(f"{thing.__name__} has {len(thing._fields)} fields, not {len(args)}")
            return Value.pack(args, thing)
        function, options = self.module.kernel(self, thing)
        if function is None:
            raise Unfit(refusal(thing))
        yields = self.source_at(function).yields
        self.check_number(function, args)
        if yields:
            raise Unfit(f"{function.__name__} yields: it is for loops, `for x in {function.__name__}(...)`")
        try:
            return self.module.call(self, function, options, args)
        except KernelError as problem:
            problem.called_at(function.__name__, self.source.path, self.at)
            raise

    def source_at(self, function: types.FunctionType) -> Source:
        """The source of a kernel that is called."""
        try:
            return source_of(function)
        except TypeError as problem:
            raise Unfit(str(problem)) from None

    def check_number(self, function: types.FunctionType, args: list[Value]) -> None:
        """Refuses a wrong number of arguments."""
        parameters = source_of(function).parameters
        if len(parameters) != len(args):
            given = f"{function.__name__}({', '.join(parameters)})"
            raise Unfit(f"{given} takes {len(parameters)} arguments, not {len(args)}")


_ZEROS = {"ptr": "null", "double": "0.0", "i1": "false", "<4 x double>": "zeroinitializer"}
_WORDS = {
    "FunctionDef": "def", "ListComp": "list comprehension", "GeneratorExp": "generator", "Dict": "dictionary",
    "JoinedStr": "text", "List": "list: write a tuple", "Set": "set", "Lambda": "lambda", "Slice": "slice",
    "NotIn": "not in", "IsNot": "is not", "Starred": "star", "NamedExpr": "`:=`", "Await": "await",
}  # fmt: skip


def _word(node: ast.AST) -> str:
    """What people call a part of Python."""
    name = type(node).__name__
    return _WORDS.get(name, name.lower())
