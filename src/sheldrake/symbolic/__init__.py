"""Symbolic computation: variables, expressions, formulas, polynomials."""

from sheldrake.common._names import show_as_own
from sheldrake.symbolic import (
    _arguments,
    _build,
    _compiled,
    _decompose,
    _differentiate,
    _expression,
    _formula,
    _functions,
    _monomial,
    _operators,
    _pickled,
    _polynomial,
    _text,
    _traverse,
)
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._formula import Formula
from sheldrake.symbolic._functions import (
    _reduce_add,
    _reduce_mul,
    abs,
    acos,
    arccos,
    arcsin,
    arctan,
    arctan2,
    asin,
    atan,
    atan2,
    ceil,
    cos,
    cosh,
    exp,
    floor,
    forall,
    if_then_else,
    inv,
    isnan,
    log,
    logical_and,
    logical_not,
    logical_or,
    max,
    min,
    positive_semidefinite,
    pow,
    sin,
    sinh,
    sqrt,
    tan,
    tanh,
    uninterpreted_function,
)
from sheldrake.symbolic._gram import CalcPolynomialWLowerTriangularPart
from sheldrake.symbolic._kinds import ExpressionKind, FormulaKind
from sheldrake.symbolic._latex import ToLatex
from sheldrake.symbolic._linear import (
    DecomposeAffineExpression,
    DecomposeAffineExpressions,
    DecomposeL2NormExpression,
    DecomposeLinearExpressions,
    DecomposeLumpedParameters,
    DecomposeQuadraticPolynomial,
    Evaluate,
    ExtractVariablesFromExpression,
    GetVariableVector,
    IsAffine,
    Jacobian,
    ReplaceBilinearTerms,
    Substitute,
    TaylorExpand,
)
from sheldrake.symbolic._monomial import (
    CalcMonomialBasisOrderUpToOne,
    EvenDegreeMonomialBasis,
    Monomial,
    MonomialBasis,
    OddDegreeMonomialBasis,
)
from sheldrake.symbolic._polynomial import Polynomial
from sheldrake.symbolic._rational import RationalFunction
from sheldrake.symbolic._sin_cos import SinCos, SinCosSubstitutionType, SubstituteStereographicProjection
from sheldrake.symbolic._substitute_and_expand import SubstituteAndExpandCacheData
from sheldrake.symbolic._sympy import from_sympy, to_sympy
from sheldrake.symbolic._variable import (
    MakeMatrixBinaryVariable,
    MakeMatrixBooleanVariable,
    MakeMatrixContinuousVariable,
    MakeMatrixVariable,
    MakeVectorBinaryVariable,
    MakeVectorBooleanVariable,
    MakeVectorContinuousVariable,
    MakeVectorVariable,
    Variable,
    Variables,
    intersect,
)

__all__ = [
    "CalcMonomialBasisOrderUpToOne",
    "CalcPolynomialWLowerTriangularPart",
    "DecomposeAffineExpression",
    "DecomposeAffineExpressions",
    "DecomposeL2NormExpression",
    "DecomposeLinearExpressions",
    "DecomposeLumpedParameters",
    "DecomposeQuadraticPolynomial",
    "Evaluate",
    "EvenDegreeMonomialBasis",
    "Expression",
    "ExpressionKind",
    "ExtractVariablesFromExpression",
    "Formula",
    "FormulaKind",
    "GetVariableVector",
    "IsAffine",
    "Jacobian",
    "MakeMatrixBinaryVariable",
    "MakeMatrixBooleanVariable",
    "MakeMatrixContinuousVariable",
    "MakeMatrixVariable",
    "MakeVectorBinaryVariable",
    "MakeVectorBooleanVariable",
    "MakeVectorContinuousVariable",
    "MakeVectorVariable",
    "Monomial",
    "MonomialBasis",
    "OddDegreeMonomialBasis",
    "Polynomial",
    "RationalFunction",
    "ReplaceBilinearTerms",
    "SinCos",
    "SinCosSubstitutionType",
    "Substitute",
    "SubstituteAndExpandCacheData",
    "SubstituteStereographicProjection",
    "TaylorExpand",
    "ToLatex",
    "Variable",
    "Variables",
    "abs",
    "acos",
    "arccos",
    "arcsin",
    "arctan",
    "arctan2",
    "asin",
    "atan",
    "atan2",
    "ceil",
    "cos",
    "cosh",
    "exp",
    "floor",
    "forall",
    "from_sympy",
    "if_then_else",
    "intersect",
    "inv",
    "isnan",
    "log",
    "logical_and",
    "logical_not",
    "logical_or",
    "max",
    "min",
    "positive_semidefinite",
    "pow",
    "sin",
    "sinh",
    "sqrt",
    "tan",
    "tanh",
    "to_sympy",
    "uninterpreted_function",
]

# Expressions, formulas and what is done with them need each other: the classes come first and are told the rest here.
_arguments._build, _arguments.expression.takes = _build, (Expression,)  # type: ignore[attr-defined]
_operators._build, _operators._formula, _operators._Expression = _build, _formula, Expression
_expression._build, _expression._differentiate, _expression._functions = _build, _differentiate, _functions
_expression._decompose, _expression._text, _expression._traverse = _decompose, _text, _traverse
_traverse._compiled = _compiled
_pickled.allow()
_formula._functions, _formula._traverse = _functions, _traverse
_monomial._polynomial = _polynomial

show_as_own(globals(), "_reduce_add", "_reduce_mul")
