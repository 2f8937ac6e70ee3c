"""LLVM's text of one function while it is written: blocks, names, slots for variables, functions of numbers."""

from __future__ import annotations

from collections.abc import Sequence

_INTRINSICS = {
    **{f"llvm.{f}.f64": 1 for f in ("sin", "cos", "exp", "log", "fabs")},
    **{"llvm.pow.f64": 2, "llvm.copysign.f64": 2, "llvm.fmuladd.f64": 3},
}
_LIBM = {
    **dict.fromkeys(("tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "sqrt", "floor"), 1),
    "atan2": 2,
}
LANES = "<4 x double>"
_OF_LANES = {"sqrt": 1, "floor": 1, "llvm.fabs.f64": 1, "llvm.fmuladd.f64": 3}
"""Functions of doubles that are one instruction for all lanes."""
PREFETCH = "llvm.prefetch.p0"
_TO_INTEGER = "llvm.fptosi.sat.i64.f64"


def _on_lanes(function: str) -> str:
    """LLVM's name of a function of `_OF_LANES`."""
    return f"llvm.{function.removeprefix('llvm.').removesuffix('.f64')}.v4f64"


def declarations() -> list[str]:
    """What a module says of the functions that it calls and does not have."""
    lines = [f"declare double @{name}({', '.join(['double'] * n)})" for name, n in _INTRINSICS.items()]
    lines += [f"declare {LANES} @{_on_lanes(f)}({', '.join([LANES] * n)})" for f, n in _OF_LANES.items()]
    lines += [f"declare double @{f}({', '.join(['double'] * n)}) nounwind memory(read)" for f, n in _LIBM.items()]
    return [*lines, f"declare i64 @{_TO_INTEGER}(double)", f"declare void @{PREFETCH}(ptr, i32, i32, i32)"]


def struct_of(kinds: Sequence[str]) -> str:
    """LLVM's type of several values that a function returns, or that lie side by side."""
    return f"{{{', '.join(kinds)}}}"


class Body:
    """Writes instructions at the end of the current block; nothing where no path leads."""

    def __init__(self, fused: bool) -> None:
        self.fused = fused
        self.lines: list[str] = []
        self.slots: list[str] = []
        self.products: dict[str, tuple[str, str]] = {}  # what is x y, and may be part of a sum
        self.count = 0
        self.block = "entry"
        self.reached = True
        self.known: frozenset[str] = frozenset()  # variables that have a value, whatever path led here
        self.targets: dict[str, frozenset[str]] = {}  # what is known wherever one jumps to a label from
        self.out: str | None = None
        """Where accesses out of bounds go."""

    def op(self, text: str) -> str:
        """An instruction with a result; its name."""
        self.count += 1
        name = f"%v{self.count}"
        self.lines.append(f"  {name} = {text}")
        return name

    def do(self, text: str) -> None:
        """An instruction without a result."""
        if self.reached:
            self.lines.append(f"  {text}")

    def end(self, text: str) -> None:
        """The last instruction of a block."""
        self.do(text)
        self.reached = False

    def label(self) -> str:
        """A name for a block that will follow."""
        self.count += 1
        return f"b{self.count}"

    def start(self, label: str) -> None:
        """The block `label` begins; the one before runs into it."""
        self.go(label)
        self.lines.append(f"{label}:")
        self.block, self.reached, self.known = label, True, self.targets.get(label, self.known)

    def go(self, label: str) -> None:
        """A jump."""
        self._meet(label)
        self.end(f"br label %{label}")

    def fork(self, condition: str, yes: str, no: str) -> None:
        """A jump on a condition."""
        self._meet(yes, no)
        self.end(f"br i1 {condition}, label %{yes}, label %{no}")

    def _meet(self, *labels: str) -> None:
        for label in labels if self.reached else ():
            self.targets[label] = self.targets.get(label, self.known) & self.known

    def leave_unless(self, inside: str) -> None:
        """A jump to `out` unless a condition holds."""
        onward = self.label()
        self.out = self.out or self.label()
        self.fork(inside, onward, self.out)
        self.start(onward)

    def spread(self, kind: str, x: str) -> str:
        """A number in all four lanes."""
        one = self.op(f"insertelement <4 x {kind}> poison, {kind} {x}, i64 0")
        return self.op(f"shufflevector <4 x {kind}> {one}, <4 x {kind}> poison, <4 x i32> zeroinitializer")

    def agreed(self, mask: str) -> str:
        """What all four lanes say; where they do not agree, the function is left."""
        bits = self.op(f"bitcast <4 x i1> {mask} to i4")
        none, all = self.op(f"icmp eq i4 {bits}, 0"), self.op(f"icmp eq i4 {bits}, 15")
        self.leave_unless(self.op(f"or i1 {none}, {all}"))
        return all

    def must_agree(self, mask: str) -> None:
        """Leaves the function where not all four lanes say yes."""
        bits = self.op(f"bitcast <4 x i1> {mask} to i4")
        self.leave_unless(self.op(f"icmp eq i4 {bits}, 15"))

    def slot(self, kind: str) -> str:
        """Memory for a variable, for the life of the function."""
        name = f"%s{len(self.slots)}"
        self.slots.append(f"  {name} = alloca {kind}")
        return name

    def load(self, kind: str, pointer: str) -> str:
        """A value from memory."""
        return self.op(f"load {kind}, ptr {pointer}")

    def store(self, kind: str, value: str, pointer: str) -> None:
        """A value into memory."""
        self.do(f"store {kind} {value}, ptr {pointer}")

    def at(self, element: str, pointer: str, index: str | int) -> str:
        """The address of an element of an array."""
        return self.op(f"getelementptr inbounds {element}, ptr {pointer}, i64 {index}")

    def math(self, function: str, *args: str, kind: str = "double") -> str:
        """A call of a function of doubles, one of `declarations`, or the same in each lane."""
        if kind == LANES and function not in _OF_LANES:
            whole = "poison"
            for i in range(4):
                found = self.math(function, *(self.op(f"extractelement {LANES} {a}, i64 {i}") for a in args))
                whole = self.op(f"insertelement {LANES} {whole}, double {found}, i64 {i}")
            return whole
        given = ", ".join(f"{kind} {a}" for a in args)
        return self.op(f"call {kind} @{function if kind == 'double' else _on_lanes(function)}({given})")

    def to_integer(self, x: str) -> str:
        """A double without its fraction; the nearest there is where it has no place in 64 bits, 0 of NaN."""
        return self.op(f"call i64 @{_TO_INTEGER}(double {x})")

    def phi(self, kinds: Sequence[str], ways: Sequence[tuple[Sequence[str], str]]) -> tuple[str, ...]:
        """Values that depend on which block was before: (values, block) for each."""
        return tuple(
            self.op(f"phi {kind} " + ", ".join(f"[{values[i]}, %{block}]" for values, block in ways))
            for i, kind in enumerate(kinds)
        )

    def text(self, head: str) -> str:
        """The function's definition."""
        return "\n".join([head + " {", "entry:", *self.slots, *self.lines, "}\n"])
