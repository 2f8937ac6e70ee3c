"""The kinds of expressions, formulas and variables, with Drake's numbers."""

from __future__ import annotations

from sheldrake.common._enums import IndexEnum


class ExpressionKind(IndexEnum):
    """What an expression is at its top. The numbers order the terms of sums and products."""

    Constant = 0
    Var = 32753
    Add = 32754
    Mul = 32755
    Div = 32756
    Log = 32757
    Abs = 32758
    Exp = 32759
    Sqrt = 32760
    Pow = 32761
    Sin = 32762
    Cos = 32763
    Tan = 32764
    Asin = 32765
    Acos = 32766
    Atan = 32767
    Atan2 = 65521
    Sinh = 65522
    Cosh = 65523
    Tanh = 65524
    Min = 65525
    Max = 65526
    Ceil = 65527
    Floor = 65528
    IfThenElse = 65529
    NaN = 65530
    UninterpretedFunction = 65531


class FormulaKind(IndexEnum):
    """What a formula is at its top."""

    False_ = 0
    True_ = 1
    Var = 2
    Eq = 3
    Neq = 4
    Gt = 5
    Geq = 6
    Lt = 7
    Leq = 8
    And = 9
    Or = 10
    Not = 11
    Forall = 12
    Isnan = 13
    PositiveSemidefinite = 14


class VariableType(IndexEnum):
    """What values a variable takes."""

    CONTINUOUS = 0
    INTEGER = 1
    BINARY = 2
    BOOLEAN = 3
    RANDOM_UNIFORM = 4
    RANDOM_GAUSSIAN = 5
    RANDOM_EXPONENTIAL = 6

    def __str__(self) -> str:
        return f"Type.{self.name}"

    def __repr__(self) -> str:
        return f"<Type.{self.name}: {self.value}>"


CONSTANT, VAR, ADD, MUL, DIV, POW = 0, 32753, 32754, 32755, 32756, 32761
ABS, SQRT, ATAN2, MIN, MAX = 32758, 32760, 65521, 65525, 65526
IF_THEN_ELSE, NAN, UNINTERPRETED = 65529, 65530, 65531
LOG, EXP, SIN, COS, TAN, ASIN, ACOS, ATAN = 32757, 32759, 32762, 32763, 32764, 32765, 32766, 32767
SINH, COSH, TANH, CEIL, FLOOR = 65522, 65523, 65524, 65527, 65528
"""The same numbers as plain integers, for the hot paths."""

UNARY_NAMES = {
    LOG: "log", ABS: "abs", EXP: "exp", SQRT: "sqrt", SIN: "sin", COS: "cos", TAN: "tan", ASIN: "asin", ACOS: "acos",
    ATAN: "atan", SINH: "sinh", COSH: "cosh", TANH: "tanh", CEIL: "ceil", FLOOR: "floor",
}  # fmt: skip
BINARY_NAMES = {POW: "pow", ATAN2: "atan2", MIN: "min", MAX: "max"}
