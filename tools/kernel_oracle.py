"""What a kernel does, by the page that says so (`docs/kernels.md`): evaluates syntax trees, shares nothing with the
compiler. Slow and plain: it is what compiled kernels are compared with, bit for bit (`tools/fuzz_kernels.py`).

Numbers are Python's bool, int, float and complex; arrays are NumPy's; tables and rows those of `common.record`. Where
the page says that a compiled kernel differs from Python, `Oracle.differs` is set: until then, plain Python must agree.
Powers of floats are the C library's, as far as LLVM lets them be: where it need not, `Oracle.last_bits` is set.
Kinds of returned values come from `->` annotations, kinds of variables from the first value; a variable whose name
begins with z is complex from the start, as one to which complex numbers are given later.
"""

from __future__ import annotations

import ast
import builtins
import ctypes
import ctypes.util
import functools
import linecache
import math
import operator
import struct
from collections.abc import Callable
from typing import Any

import numpy as np

from sheldrake.common._kernels import generic
from sheldrake.common.kernel import Kernel
from sheldrake.common.record import Row, _Rows

LOW, HIGH = -(2**63), 2**63 - 1
LARGEST_POWER = 64
_EXACT = 2**53
_libm = ctypes.CDLL(ctypes.util.find_library("m"))


def _c(name: str, arguments: int) -> Callable[..., float]:
    function = getattr(_libm, name)
    function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double] * arguments
    return function


LIBM = {name: _c(name, 1) for name in generic.UNARY}
POW, ATAN2, FMOD, COPYSIGN, FLOOR = (_c("pow", 2), _c("atan2", 2), _c("fmod", 2), _c("copysign", 2), _c("floor", 1))
RANK = {bool: 0, int: 1, float: 2, complex: 3}


class OutOfBounds(Exception):
    """An index is not in its array."""


class _Left(Exception):
    """A `return`: its value, and of which call."""


class _Break(Exception):
    """A `break`."""


class _Continue(Exception):
    """A `continue`."""


class _Enough(Exception):
    """A `break` out of a loop over what a kernel yields: which loop."""


def bits(x: float) -> int:
    """The bits of a float; those of one NaN for all."""
    return -1 if x != x else struct.unpack("<Q", struct.pack("<d", x))[0]


@functools.lru_cache(maxsize=8)
def _functions(path: str) -> dict[int, ast.FunctionDef]:
    """The functions of a file by their first lines."""
    functions = (n for n in ast.walk(ast.parse("".join(linecache.getlines(path)))) if isinstance(n, ast.FunctionDef))
    return {f.decorator_list[0].lineno: f for f in functions if f.decorator_list}


class Oracle:
    """Runs kernels; `differs` says that plain Python may do something else.

    With `nan_spreads`, `min` and `max` of a NaN are NaN, which nested ones that share a number may be.
    """

    def __init__(self, limit: int = 100_000, nan_spreads: bool = False) -> None:
        self.nan_spreads = nan_spreads
        self.lost_nan = False  # whether `min` or `max` gave a number though one of its arguments was NaN
        self.has_left = False  # whether the last run went out of an array
        self.differs = False
        self.last_bits = False  # whether the last bits may be others, by a power
        self.left = limit  # statements, so that a faulty program ends
        self.trees: dict[Any, ast.FunctionDef] = {}

    def run(self, kernel: Any, args: list[Any], item: Callable[[Any], None] | None = None) -> Any:
        """The value of a kernel of these arguments; `item` is done with what it yields.

        Raises:
            OutOfBounds: where a kernel compiled with bounds checks leaves.
        """
        function = kernel.py_func
        if function not in self.trees:
            code = function.__code__
            self.trees[function] = _functions(code.co_filename)[code.co_firstlineno]
        tree = self.trees[function]
        frame = _Frame(self, function, dict(zip((a.arg for a in tree.args.args), map(plain, args))))
        frame.yielded = item
        try:
            frame.block(tree.body)
        except _Left as left:
            value, of_call = left.args
            if of_call is not frame:  # of the loop that this one is looped over by
                raise
            wanted = tree.returns
            if isinstance(wanted, ast.Name) and wanted.id in ("float", "complex", "int", "bool"):
                value = self.convert(value, getattr(builtins, wanted.id))
            return value
        return None

    # ---- numbers

    def wrap(self, x: int) -> int:
        """An integer in 64 bits."""
        if not LOW <= x <= HIGH:
            self.differs = True
            x = (x - LOW) % 2**64 + LOW
        return x

    def convert(self, x: Any, kind: type) -> Any:
        """A number as one of a kind that is not lower."""
        if type(x) is kind:
            return x
        assert RANK[type(x)] < RANK[kind], f"{x!r} as {kind}"
        if kind is not int and type(x) is int and abs(x) > _EXACT:
            self.differs = True
        return kind(float(x)) if kind is complex else kind(x)

    def fit(self, value: Any, like: Any) -> Any:
        """A value as one of the kinds of another."""
        if isinstance(like, tuple) and isinstance(value, tuple):
            items = [self.fit(v, k) for v, k in zip(value, like)]
            return type(like)(*items) if hasattr(like, "_fields") else tuple(items)
        if type(like) in RANK and type(value) in RANK:
            if type(value) is not type(like):
                self.differs = True
            return self.convert(value, type(like))
        return value

    def same(self, *numbers: Any) -> tuple[Any, ...]:
        """Numbers as the highest of their kinds."""
        kind = max(map(type, numbers), key=RANK.__getitem__)
        return tuple(self.convert(x, kind) for x in numbers)

    def truth(self, x: Any) -> bool:
        """Whether a number is not 0."""
        assert type(x) in (bool, int, float), x
        return x != 0

    def to_int(self, x: float) -> int:
        """Without its fraction; the nearest of 64 bits, 0 of NaN."""
        if x != x or not LOW <= x < 2.0**63:
            self.differs = True
            return 0 if x != x else LOW if x < 0.0 else HIGH
        return int(x)

    def floor(self, x: float) -> float:
        """The largest whole float that is not above x, by way of an integer."""
        if not math.isfinite(x):
            self.differs = True
        return FLOOR(x) + 0.0

    def divide(self, x: float, y: float) -> float:
        """x / y of IEEE 754."""
        if y == 0.0:
            self.differs = True
        with np.errstate(all="ignore"):
            return float(np.float64(x) / np.float64(y))

    def binary(self, op: type, x: Any, y: Any) -> Any:
        """x op y."""
        if bool in (type(x), type(y)) and not (op in _BITS and type(x) is type(y)):
            self.differs = True  # NumPy has an arithmetic of its own for truths
        if op is ast.Pow:
            self.differs = True
            return self.c(POW, x, y)
        x, y = self.same(x, y)
        if type(x) is bool and op in _BITS:
            return bool(_BITS[op](x, y))
        if type(x) is bool:
            x, y = int(x), int(y)
        if op is ast.Div and type(x) is int:
            x, y = self.convert(x, float), self.convert(y, float)
        return {int: self.integers, float: self.floats, complex: self.complexes}[type(x)](op, x, y)

    def integers(self, op: type, x: int, y: int) -> int:
        """x op y, in 64 bits."""
        if op in _BITS:
            return _BITS[op](x, y)
        if op in _PLAIN:
            return self.wrap(_PLAIN[op](x, y))
        if op in (ast.LShift, ast.RShift):
            if not 0 <= y < 64:
                self.differs = True
                return 0 if op is ast.LShift or x >= 0 else -1
            return self.wrap(x << y) if op is ast.LShift else x >> y
        if y == 0:
            self.differs = True
            return 0
        return self.wrap(x // y if op is ast.FloorDiv else x % y)

    def floats(self, op: type, x: float, y: float) -> float:
        """x op y, by NumPy where Python raises."""
        if op is ast.Div:
            return self.divide(x, y)
        if op in _PLAIN:
            return _PLAIN[op](x, y)
        if y == 0.0 or not math.isfinite(x) or not math.isfinite(y):
            self.differs = True
        with np.errstate(all="ignore"):
            return float((np.floor_divide if op is ast.FloorDiv else np.remainder)(np.float64(x), np.float64(y)))

    def complexes(self, op: type, z: complex, w: complex) -> complex:
        """x op y, as written in textbooks."""
        a, b, c, d = z.real, z.imag, w.real, w.imag
        if op is ast.Add:
            return complex(a + c, b + d)
        if op is ast.Sub:
            return complex(a - c, b - d)
        self.differs = True
        if op is ast.Mult:
            return complex(a * c - b * d, a * d + b * c)
        assert op is ast.Div
        if abs(c) >= abs(d):
            r = self.divide(d, c)
            n = c + d * r
            return complex(self.divide(a + b * r, n), self.divide(b - a * r, n))
        r = self.divide(c, d)
        n = c * r + d
        return complex(self.divide(a * r + b, n), self.divide(b * r - a, n))

    def power(self, x: Any, n: int) -> Any:
        """x ** n of a whole number that is written there, by squaring."""
        assert 0 <= n <= LARGEST_POWER
        kind = max(int, type(x), key=RANK.__getitem__)
        self.differs |= kind is not int or type(x) is bool
        square, result = self.convert(x, kind), None
        if not n:
            return kind(1)
        while n:
            if n & 1:
                result = square if result is None else self.binary(ast.Mult, result, square)
            n >>= 1
            if n:
                square = self.binary(ast.Mult, square, square)
        return result

    def c(self, function: Callable, *xs: Any) -> float:
        """A function of C."""
        self.differs = True
        floats = [self.convert(x, float) for x in xs]
        if function is POW:  # LLVM takes exp2 and sqrt where it knows that the base is 2**n, or what the exponent is
            base, exponent = floats
            special = abs(math.frexp(base)[0]) == 0.5 or base == 10.0 or abs(exponent) in (0.25, 0.5)
            self.last_bits |= special and base != 1.0 and not exponent.is_integer()
        return function(*floats)

    def compare(self, op: type, x: Any, y: Any) -> bool:
        """x op y; complex numbers by their real parts, but for == and !=."""
        x, y = self.same(x, y)
        if type(x) is complex and op not in (ast.Eq, ast.NotEq):
            self.differs = True
            x, y = x.real, y.real
        return _COMPARE[op](x, y)


_BITS: dict[Any, Any] = {ast.BitAnd: operator.and_, ast.BitOr: operator.or_, ast.BitXor: operator.xor}
_PLAIN: dict[Any, Any] = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul}
_COMPARE: dict[Any, Any] = {
    ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}  # fmt: skip


def plain(x: Any) -> Any:
    """NumPy's numbers as Python's."""
    if isinstance(x, tuple) and not (hasattr(x, "PARTS") or any(isinstance(i, np.ndarray) for i in x)):
        return type(x)(*map(plain, x)) if hasattr(x, "_fields") else tuple(map(plain, x))
    return x.item() if isinstance(x, np.generic) else x


# ---- what is called


def _int(o: Oracle, x: Any) -> int:
    return o.to_int(x) if type(x) is float else o.convert(x, int)


def _extreme(is_better: Callable) -> Callable:
    def call(o: Oracle, *xs: Any) -> Any:
        best = xs[0]
        for x in xs[1:]:
            if type(x) is not type(best):
                o.differs = True
            best, x = o.same(best, x)
            best, worse = (x, best) if o.compare(is_better, x, best) else (best, x)  # type: ignore[arg-type]
            if worse != worse and best == best:
                o.lost_nan = True
                best = worse if o.nan_spreads else best
        return best

    return call


def _real(x: Any) -> float:
    return x.real if type(x) is complex else float(x)


def _unary(name: str) -> Callable:
    f = LIBM[name]

    def slope(o: Oracle, x: float) -> float:
        one = {
            "sin": lambda: LIBM["cos"](x), "cos": lambda: -LIBM["sin"](x), "exp": lambda: f(x),
            "tan": lambda: 1.0 + f(x) * f(x), "tanh": lambda: 1.0 - f(x) * f(x),
            "sinh": lambda: LIBM["cosh"](x), "cosh": lambda: LIBM["sinh"](x),
        }  # fmt: skip
        return one[name]()

    def call(o: Oracle, x: Any) -> Any:
        if type(x) is not complex:
            return f(o.convert(x, float))
        o.differs = True
        a, b = x.real, x.imag
        if name == "sqrt":
            return complex(f(a), o.divide(0.5 * b, f(a)))
        if name == "log":
            return complex(f(a), o.divide(b, a))
        if name in ("asin", "acos"):
            return complex(f(a), o.divide(b if name == "asin" else -b, LIBM["sqrt"](1.0 - a * a)))
        if name == "atan":
            return complex(f(a), o.divide(b, 1.0 + a * a))
        return complex(f(a), slope(o, a) * b)

    return call


def _atan2(o: Oracle, y: Any, x: Any) -> Any:
    y, x = o.same(y, x)
    if type(x) is not complex:
        return ATAN2(o.convert(y, float), o.convert(x, float))
    a, b = x.real, y.real
    return complex(ATAN2(b, a), o.divide(a * y.imag - b * x.imag, a * a + b * b))


def _clip(o: Oracle, x: Any, low: Any, high: Any) -> Any:
    o.differs |= len({type(x), type(low), type(high)}) > 1
    x, low, high = o.same(x, low, high)
    return high if o.compare(ast.Gt, x, high) else low if o.compare(ast.Lt, x, low) else x


def _floor(o: Oracle, x: Any) -> Any:
    return complex(o.floor(x.real), 0.0) if type(x) is complex else o.floor(o.convert(x, float))


def _abs(o: Oracle, x: Any) -> Any:
    return abs(x) if type(x) is float else o.wrap(abs(o.convert(x, int)))


def _len(o: Oracle, x: Any) -> int:
    return len(x)


def _zero(o: Oracle, x: Any) -> bool:
    return o.compare(ast.Eq, x, 0.0)


CALLS: dict[Any, Callable] = {
    builtins.abs: _abs, builtins.len: _len, builtins.bool: Oracle.truth, builtins.int: _int, np.int64: _int,
    builtins.float: lambda o, x: o.convert(x, float), np.float64: lambda o, x: o.convert(x, float),
    builtins.complex: lambda o, *x: complex(*x), builtins.min: _extreme(ast.Lt), builtins.max: _extreme(ast.Gt),
    np.floor: lambda o, x: FLOOR(o.convert(x, float)), generic.floor: _floor,
    math.floor: lambda o, x: o.to_int(FLOOR(x)) if type(x) is float else o.convert(x, int),
    math.sqrt: _unary("sqrt"), generic.atan2: _atan2, generic.clip: _clip, generic.is_zero: _zero,
    generic.mul_add: lambda o, a, b, c: o.binary(ast.Add, o.binary(ast.Mult, a, b), c),
    generic.has_slopes: lambda o, x: type(x) is complex, generic.value_of: lambda o, x: _real(x),
    generic.is_positive: lambda o, x: _real(x) > 0.0, generic.is_finite: lambda o, x: abs(_real(x)) < math.inf,
    math.pow: lambda o, x, y: o.c(POW, x, y), math.fmod: lambda o, x, y: o.c(FMOD, x, y),
    math.copysign: lambda o, x, y: o.c(COPYSIGN, x, y), generic.whole: lambda o, x: o.to_int(FLOOR(_real(x))),
}  # fmt: skip
CALLS |= {getattr(generic, name): _unary(name) for name in generic.UNARY}


class _Frame:
    """A call of a kernel: its variables."""

    def __init__(self, oracle: Oracle, function: Any, variables: dict[str, Any]) -> None:
        self.o, self.function, self.variables = oracle, function, variables

        self.yielded: Callable[[Any], None] | None = None

    # ---- statements

    def block(self, statements: list[ast.stmt]) -> None:
        for s in statements:
            self.o.left -= 1
            assert self.o.left > 0, "a program without end"
            getattr(self, f"do_{type(s).__name__}")(s)

    def do_Expr(self, s: ast.Expr) -> None:
        self.value(s.value)

    def do_Pass(self, s: ast.Pass) -> None:
        """Nothing."""

    def do_Assign(self, s: ast.Assign) -> None:
        value = self.value(s.value)
        for target in s.targets:
            self.store(target, value)

    def do_AnnAssign(self, s: ast.AnnAssign) -> None:
        if s.value is not None:
            self.store(s.target, self.value(s.value))

    def do_AugAssign(self, s: ast.AugAssign) -> None:
        put, get = self.place(s.target)
        old = get()
        put(self.operation(s.op, old, s.value))

    def do_Return(self, s: ast.Return) -> None:
        raise _Left(None if s.value is None else self.value(s.value), self)

    def do_Break(self, s: ast.Break) -> None:
        raise _Break

    def do_Continue(self, s: ast.Continue) -> None:
        raise _Continue

    def do_If(self, s: ast.If) -> None:
        self.block(s.body if self.o.truth(self.value(s.test)) else s.orelse)

    def do_While(self, s: ast.While) -> None:
        while self.o.truth(self.value(s.test)):
            if self.once(s.body):
                break

    def do_For(self, s: ast.For) -> None:
        if isinstance(s.iter, ast.Call) and isinstance(called := self.value(s.iter.func), Kernel):
            self.for_each(called, [self.value(a) for a in s.iter.args], lambda x: self.store(s.target, x), s)
            return
        for item in self.value(s.iter):
            self.store(s.target, item)
            if self.once(s.body):
                break

    def for_each(self, called: Any, args: list[Any], store: Callable[[Any], None], s: ast.For) -> None:
        """A loop over what a kernel yields."""
        this = object()

        def item(x: Any) -> None:
            store(x)
            if self.once(s.body):
                raise _Enough(this)

        try:
            self.o.run(called, args, item)
        except _Enough as enough:
            if enough.args[0] is not this:
                raise

    def of_Yield(self, e: ast.Yield) -> None:
        assert self.yielded is not None
        self.yielded(None if e.value is None else self.value(e.value))

    def of_YieldFrom(self, e: ast.YieldFrom) -> None:
        assert self.yielded is not None and isinstance(e.value, ast.Call)
        called, args = self.value(e.value.func), [self.value(a) for a in e.value.args]
        if isinstance(called, Kernel):
            self.o.run(called, args, self.yielded)
        else:
            for i in range(*map(int, args)):
                self.yielded(i)

    def once(self, body: list[ast.stmt]) -> bool:
        """A turn of a loop; whether it was the last."""
        self.o.left -= 1
        try:
            self.block(body)
        except _Continue:
            return False
        except _Break:
            return True
        return False

    def store(self, target: ast.expr, value: Any) -> None:
        if isinstance(target, ast.Tuple):
            assert len(value) == len(target.elts)
            for part, item in zip(target.elts, value):
                self.store(part, item)
        else:
            self.place(target)[0](value)

    def place(self, e: ast.expr) -> tuple[Callable, Callable]:
        """How to write and read what an expression stands for."""
        if isinstance(e, ast.Name):
            return lambda value: self.name_is(e.id, value), lambda: self.variables[e.id]
        assert isinstance(e, (ast.Subscript, ast.Attribute))
        base = self.value(e.value)
        if isinstance(e, ast.Subscript):
            where = self.where(base, self.value(e.slice))
            kind = {"i": int, "f": float, "c": complex}[base.dtype.kind]
            return lambda v: base.__setitem__(where, self.o.convert(v, kind)), lambda: base[where].item()
        self.check_field(base, e.attr)
        kind = type(plain(getattr(base, e.attr)))

        def put(value: Any) -> None:
            setattr(base, e.attr, value if kind is tuple else self.o.convert(value, kind))

        return put, lambda: plain(getattr(base, e.attr))

    def name_is(self, name: str, value: Any) -> None:
        if name.startswith("z") and type(value) in (int, float):
            value = self.o.convert(value, complex)
        if name in self.variables:
            value = self.o.fit(value, self.variables[name])
        self.variables[name] = value

    # ---- memory

    def where(self, base: np.ndarray, index: Any) -> tuple[int, ...]:
        """Indices into an array."""
        indices = tuple(int(i) for i in (index if isinstance(index, tuple) else (index,)))
        assert len(indices) == base.ndim
        if not all(0 <= i < n for i, n in zip(indices, base.shape)):
            raise OutOfBounds
        return indices

    def check_field(self, base: Any, name: str) -> None:
        """Whether a field is in its row, as far as it is known."""
        for array, field, width in _fields(base, name):
            if array.ndim == 2 and isinstance(field, int):  # of a `Stack`
                if field >= len(array):
                    raise OutOfBounds
            elif width < field.at + field.size:
                raise OutOfBounds

    def item(self, base: Any, index: Any) -> Any:
        if isinstance(base, np.ndarray):
            return base[self.where(base, index)].item()
        if isinstance(base, _Rows):
            if not 0 <= index < len(base):
                raise OutOfBounds
            return base[index]
        if getattr(base, "PARTS", ()) and any(p.counted is not None for p in base.PARTS):
            for part in base.PARTS:
                times = getattr(part.counted, "number", 1)
                if part.counted is not None and not 0 <= index < len(getattr(base, part.name)) // times:
                    raise OutOfBounds
            return base[index]
        if isinstance(base, tuple) and not (isinstance(index, int) and -len(base) <= index < len(base)):
            raise OutOfBounds
        return plain(base[index])

    # ---- expressions

    def value(self, e: ast.expr) -> Any:
        return getattr(self, f"of_{type(e).__name__}")(e)

    def of_Constant(self, e: ast.Constant) -> Any:
        return e.value

    def of_Name(self, e: ast.Name) -> Any:
        if e.id in self.variables:
            return self.variables[e.id]
        code, cells = self.function.__code__, self.function.__closure__
        if e.id in code.co_freevars:
            return plain(cells[code.co_freevars.index(e.id)].cell_contents)
        scope = self.function.__globals__
        return plain(scope[e.id] if e.id in scope else getattr(builtins, e.id))

    def of_Tuple(self, e: ast.Tuple) -> tuple:
        return tuple(self.value(x) for x in e.elts)

    def of_Attribute(self, e: ast.Attribute) -> Any:
        base = self.value(e.value)
        if type(base) in RANK:
            return (_real(base) if type(base) in (float, complex) else base) if e.attr == "real" else (
                base.imag if type(base) is complex else 0.0
            )  # fmt: skip
        self.check_field(base, e.attr)
        return plain(getattr(base, e.attr))

    def of_Subscript(self, e: ast.Subscript) -> Any:
        base, index = self.value(e.value), self.value(e.slice)
        if type(base) is tuple and index < 0 and not isinstance(e.slice, ast.UnaryOp):
            raise OutOfBounds  # only what is written there counts from the end
        return self.item(base, index)

    def of_UnaryOp(self, e: ast.UnaryOp) -> Any:
        if isinstance(e.op, ast.USub) and isinstance(e.operand, ast.Constant):
            return -e.operand.value
        x = self.value(e.operand)
        if isinstance(e.op, ast.Not):
            return not self.o.truth(x)
        if type(x) is bool:
            self.o.differs, x = True, int(x)
        if isinstance(e.op, ast.Invert):
            return ~x
        if isinstance(e.op, ast.UAdd):
            return x
        return self.o.wrap(-x) if type(x) is int else complex(-x.real, -x.imag) if type(x) is complex else -x

    def of_BinOp(self, e: ast.BinOp) -> Any:
        return self.operation(e.op, self.value(e.left), e.right)

    def operation(self, op: ast.operator, x: Any, right: ast.expr) -> Any:
        """x op the value of an expression."""
        if isinstance(op, ast.Pow) and isinstance(right, ast.Constant) and type(right.value) is int:
            return self.o.power(x, right.value)
        return self.o.binary(type(op), x, self.value(right))

    def of_Compare(self, e: ast.Compare) -> bool:
        x = self.value(e.left)
        return self.o.compare(type(e.ops[0]), x, self.value(e.comparators[0]))

    def of_BoolOp(self, e: ast.BoolOp) -> bool:
        is_and = isinstance(e.op, ast.And)
        for part in e.values:
            value = self.value(part)
            self.o.differs |= type(value) is not bool
            if self.o.truth(value) is not is_and:
                return not is_and
        return is_and

    def of_IfExp(self, e: ast.IfExp) -> Any:
        chosen, other = (e.body, e.orelse) if self.o.truth(self.value(e.test)) else (e.orelse, e.body)
        value = self.value(chosen)
        if isinstance(other, (ast.Constant, ast.Name)) and type(value) in RANK:
            like = self.value(other)
            if RANK[type(like)] > RANK[type(value)]:
                self.o.differs = True
                return self.o.convert(value, type(like))
        return value

    def of_Call(self, e: ast.Call) -> Any:
        called = self.value(e.func)
        args = [self.value(a) for a in e.args]
        if called is range:
            return range(*map(int, args))
        if isinstance(called, Kernel):
            return self.o.run(called, args)
        if isinstance(called, type) and hasattr(called, "_fields"):
            return called(*args)
        return CALLS[called](self.o, *args)


def _fields(base: Any, name: str) -> list[tuple[np.ndarray, Any, int]]:
    """(array, Field, numbers in its row) of a field that is called so; of a `Stack` (array, row, ...)."""
    found: list[tuple[np.ndarray, Any, int]] = []
    table = base._table if isinstance(base, Row) else base
    for part in getattr(table, "PARTS", ()):
        array = getattr(table, part.name)
        own = [part.counted, *(i.record for i in part.items)] if isinstance(base, Row) else [part.single]
        for what in own:
            for f in getattr(what, "FIELDS", ()):
                if f.name == name and (not isinstance(base, Row) or f in type(base).FIELDS):
                    found.append((array, f.at if array.ndim == 2 and part.single is what else f, array.shape[-1]))
    return found
