"""Adding linear, quadratic and general constraints to a program.

One of the parts that `MathematicalProgram` is put together from.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import instance_of, text
from sheldrake.common._overloads import Mismatch, Ways, kind, overload
from sheldrake.solvers import _kinds as kinds
from sheldrake.solvers._arrays import Matrix
from sheldrake.solvers._functions.bindings import Binding, BindingBase, as_kind, bind, bind_list
from sheldrake.solvers._functions.constraints import (
    BoundingBoxConstraint,
    LinearComplementarityConstraint,
    LinearConstraint,
    LinearEqualityConstraint,
    QuadraticConstraint,
)
from sheldrake.solvers._functions.evaluators import (
    Constraint,
    PyFunctionConstraint,
    VisualizationCallback,
)
from sheldrake.solvers._parse import coefficients, formulas
from sheldrake.solvers._parse import constraints as parse
from sheldrake.solvers._program.bindings import ProgramBindings
from sheldrake.symbolic import Expression, Formula, Variable

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.common._types import Symbolic, Symbolics
    from sheldrake.solvers._arrays import VariablesLike
    from sheldrake.symbolic import Formula


@checked
class ProgramConstraints:
    """Adds constraints that are no cones, and callbacks.

    Args:
        bindings: Where they are kept.
    """

    def __init__(self, bindings: ProgramBindings) -> None:
        self._bindings = bindings

    @typing_overload
    def AddConstraint(
        self, func: Callable[..., object], lb: ArrayLike, ub: ArrayLike, vars: VariablesLike, description: str = ""
    ) -> Binding[Constraint]: ...
    @typing_overload
    def AddConstraint(self, e: Symbolic, lb: float, ub: float) -> Binding[Constraint]: ...
    @typing_overload
    def AddConstraint(self, f: Formula | bool) -> Binding[Constraint]: ...
    @typing_overload
    def AddConstraint(self, constraint: Constraint, vars: VariablesLike) -> Binding[Constraint]: ...
    @typing_overload
    def AddConstraint(self, formulas: np.ndarray | Sequence[Formula]) -> Binding[Constraint]: ...
    @typing_overload
    def AddConstraint(self, binding: BindingBase[Constraint]) -> Binding[Constraint]: ...
    @typing_overload
    def AddConstraint(self, v: Symbolics, lb: ArrayLike, ub: ArrayLike) -> Binding[Constraint]: ...
    def AddConstraint(self, *args: Any, **kwargs: Any) -> Binding[Constraint]:
        """Adds a constraint and returns its binding.

        Called with a function of a vector, `lb`, `ub` and `vars`; with an expression and two bounds; with a formula or
        an array of them; with a `Constraint` and `vars`; or with a binding.

        Raises:
            RuntimeError: a variable is no decision variable, or the constraint never holds.
        """
        return as_kind(Constraint, self._bindings.add(_CONSTRAINT.choose("AddConstraint", args, kwargs)))

    @typing_overload
    def AddLinearConstraint(
        self, A: ArrayLike | Matrix, lb: ArrayLike, ub: ArrayLike, vars: VariablesLike
    ) -> Binding[LinearConstraint]: ...
    @typing_overload
    def AddLinearConstraint(
        self, a: ArrayLike | Matrix, lb: float, ub: float, vars: VariablesLike
    ) -> Binding[LinearConstraint]: ...
    @typing_overload
    def AddLinearConstraint(self, e: Symbolic, lb: float, ub: float) -> Binding[LinearConstraint]: ...
    @typing_overload
    def AddLinearConstraint(self, v: Symbolics, lb: ArrayLike, ub: ArrayLike) -> Binding[LinearConstraint]: ...
    @typing_overload
    def AddLinearConstraint(self, f: Formula | bool) -> Binding[LinearConstraint]: ...
    @typing_overload
    def AddLinearConstraint(self, formulas: np.ndarray | Sequence[Formula]) -> Binding[LinearConstraint]: ...
    def AddLinearConstraint(self, *args: Any, **kwargs: Any) -> Binding[LinearConstraint]:
        """Adds a linear constraint.

        Called as `(A, lb, ub, vars)` with a matrix or a row; `(e, lb, ub)` with one or an array of expressions; or
        with a formula or an array of them.

        Raises:
            RuntimeError: an expression is not linear, or a variable is no decision variable.
        """
        return as_kind(LinearConstraint, self._bindings.add(_LINEAR.choose("AddLinearConstraint", args, kwargs)))

    @typing_overload
    def AddLinearEqualityConstraint(
        self, Aeq: ArrayLike | Matrix, beq: ArrayLike, vars: VariablesLike
    ) -> Binding[LinearEqualityConstraint]: ...
    @typing_overload
    def AddLinearEqualityConstraint(
        self, a: ArrayLike | Matrix, beq: float, vars: VariablesLike
    ) -> Binding[LinearEqualityConstraint]: ...
    @typing_overload
    def AddLinearEqualityConstraint(self, e: Symbolic, b: float) -> Binding[LinearEqualityConstraint]: ...
    @typing_overload
    def AddLinearEqualityConstraint(self, f: Formula | bool) -> Binding[LinearEqualityConstraint]: ...
    @typing_overload
    def AddLinearEqualityConstraint(
        self, formulas: np.ndarray | Sequence[Formula]
    ) -> Binding[LinearEqualityConstraint]: ...
    @typing_overload
    def AddLinearEqualityConstraint(self, v: Symbolics, b: ArrayLike) -> Binding[LinearEqualityConstraint]: ...
    def AddLinearEqualityConstraint(self, *args: Any, **kwargs: Any) -> Binding[LinearEqualityConstraint]:
        """Adds linear equations.

        Called as `(Aeq, beq, vars)` with a matrix or a row; `(e, b)` with one or an array of expressions; or with a
        formula or an array of them.

        Raises:
            RuntimeError: an expression is not linear, a formula no equation, or a variable no decision variable.
        """
        return self._bindings.add(_EQUALITY.choose("AddLinearEqualityConstraint", args, kwargs))

    @typing_overload
    def AddBoundingBoxConstraint(
        self, lb: ArrayLike, ub: ArrayLike, vars: VariablesLike
    ) -> Binding[BoundingBoxConstraint]: ...
    @typing_overload
    def AddBoundingBoxConstraint(self, lb: float, ub: float, var: Variable) -> Binding[BoundingBoxConstraint]: ...
    def AddBoundingBoxConstraint(self, *args: Any, **kwargs: Any) -> Binding[BoundingBoxConstraint]:
        """Adds bounds of variables; called as `(lb, ub, vars)` with numbers or arrays, one variable or an array."""
        return self._bindings.add(_BOX.choose("AddBoundingBoxConstraint", args, kwargs))

    @typing_overload
    def AddQuadraticConstraint(
        self,
        Q: ArrayLike | Matrix,
        b: ArrayLike,
        lb: float,
        ub: float,
        vars: VariablesLike,
        hessian_type: QuadraticConstraint.HessianType | None = None,
    ) -> Binding[QuadraticConstraint]: ...
    @typing_overload
    def AddQuadraticConstraint(
        self, e: Symbolic, lb: float, ub: float, hessian_type: QuadraticConstraint.HessianType | None = None
    ) -> Binding[QuadraticConstraint]: ...
    def AddQuadraticConstraint(self, *args: Any, **kwargs: Any) -> Binding[QuadraticConstraint]:
        """Adds lb <= 1/2 x' Q x + b' x <= ub.

        Called as `(Q, b, lb, ub, vars, hessian_type=None)` or `(e, lb, ub, hessian_type=None)`.

        Raises:
            RuntimeError: the expression is not quadratic.
        """
        return self._bindings.add(_QUADRATIC.choose("AddQuadraticConstraint", args, kwargs))

    def AddLinearComplementarityConstraint(
        self, M: ArrayLike, q: ArrayLike, vars: Sequence[Variable] | np.ndarray
    ) -> Binding[LinearComplementarityConstraint]:
        """Adds x >= 0, M x + q >= 0, x' (M x + q) = 0."""
        new = LinearComplementarityConstraint._make(M, q)
        return self._bindings.add(bind(LinearComplementarityConstraint, new, kinds.vars(vars)))

    def AddVisualizationCallback(
        self, func: Callable[..., object], vars: VariablesLike
    ) -> Binding[VisualizationCallback]:
        """Adds a function that solvers call with their iterates of some variables."""
        return self._bindings.add(_CALLBACK.choose("AddVisualizationCallback", (func, vars), {}))


# What the calls take, and the constraints that they make of it.


def _of_function(
    func: Callable[..., Any], lb: np.ndarray, ub: np.ndarray, vars: np.ndarray, description: str
) -> BindingBase[Constraint]:
    return bind(Constraint, PyFunctionConstraint._of(len(vars), func, lb, ub, description), vars)


@kind("Binding", refuses=(Expression, Formula))
def _constraint_binding(value: object) -> BindingBase[Constraint]:
    binding: BindingBase[Constraint] = instance_of(BindingBase)(value)
    instance_of(Constraint)(binding.evaluator())
    return binding


def _linear(
    A: Matrix, lb: np.ndarray | float, ub: np.ndarray | float, vars: np.ndarray
) -> BindingBase[LinearConstraint]:
    lower, upper = _at_least_one(lb), _at_least_one(ub)
    if A.shape == (len(vars), 1) and lower.size == 1 and len(vars) > 1:
        A = A.T  # A flat list of coefficients is one row.
    return bind(LinearConstraint, LinearConstraint._of(A, lower, upper), vars)


def _linear_row(A: Matrix, lb: float, ub: float, vars: np.ndarray) -> BindingBase[LinearConstraint]:
    """The constraint of one row, shape (1, n)."""
    if not isinstance(A, np.ndarray) or A.shape[1] != len(vars) or math.isnan(lb) or math.isnan(ub):
        return _linear(A, lb, ub, vars)
    return bind(LinearConstraint, LinearConstraint._of_row(A[0].tolist(), lb, ub), vars)


def _at_least_one(b: np.ndarray | float) -> np.ndarray:
    return b if isinstance(b, np.ndarray) else np.array([b])


def _equality(A: Matrix, b: np.ndarray | float, vars: np.ndarray) -> BindingBase[LinearEqualityConstraint]:
    right = _at_least_one(b)
    return bind(LinearEqualityConstraint, LinearEqualityConstraint._of(A, right, right), vars)


def _box(lb: np.ndarray, ub: np.ndarray, vars: np.ndarray) -> BindingBase[BoundingBoxConstraint]:
    return bind(BoundingBoxConstraint, BoundingBoxConstraint._of(lb, ub), vars)


def _box_of_one(lb: float, ub: float, var: Variable) -> BindingBase[BoundingBoxConstraint]:
    if math.isnan(lb) or math.isnan(ub):
        return _box(np.array([lb]), np.array([ub]), np.array([var], dtype=object))  # says so
    return bind_list(BoundingBoxConstraint, BoundingBoxConstraint._of_variable(lb, ub), [var])


def _box_for_all(lb: float, ub: float, vars: np.ndarray) -> BindingBase[BoundingBoxConstraint]:
    return _box(np.array([lb] * len(vars)), np.array([ub] * len(vars)), vars)


def _quadratic(
    Q: Matrix, b: np.ndarray, lb: float, ub: float, vars: np.ndarray, hessian: QuadraticConstraint.HessianType | None
) -> BindingBase[QuadraticConstraint]:
    return bind(QuadraticConstraint, QuadraticConstraint(Q, b, lb, ub, hessian), vars)


def _quadratic_of_expression(
    e: Expression, lb: float, ub: float, hessian: QuadraticConstraint.HessianType | None
) -> BindingBase[QuadraticConstraint]:
    c = coefficients.quadratic(e, "ParseQuadraticConstraint")
    return _quadratic(c.hessian(), c.b, lb - c.c, ub - c.c, c.vars, hessian)


def _callback(func: Callable[[np.ndarray], Any], vars: np.ndarray) -> BindingBase[VisualizationCallback]:
    return bind(VisualizationCallback, VisualizationCallback._make(func, len(vars)), vars)


@kind("float array of shape (n,)", refuses=(int, float))
def _bound(value: ArrayLike) -> np.ndarray:
    if type(value) is np.ndarray and value.ndim == 1:
        return kinds.vector(value)
    if not np.ndim(value):
        raise Mismatch
    return kinds.vector(np.ravel(value, order="F"))


_HESSIAN = (instance_of(QuadraticConstraint.HessianType), None)
_CONSTRAINT = Ways(
    [
        overload(
            _of_function,
            func=kinds.function,
            lb=kinds.vector,
            ub=kinds.vector,
            vars=kinds.vars,
            description=(text, ""),
        ),
        overload(parse.constraint, e=kinds.expression, lb=kinds.number, ub=kinds.number),
        overload(formulas.formula_constraint, f=kinds.formula),
        overload(
            lambda constraint, vars: bind(Constraint, constraint, vars),
            constraint=instance_of(Constraint),
            vars=kinds.vars,
        ),
        overload(formulas.formulas_constraint, formulas=kinds.formulas),
        overload(lambda binding: binding, binding=_constraint_binding),
        overload(parse.constraint, v=kinds.expressions, lb=_bound, ub=_bound),
    ]
)
_LINEAR = Ways(
    [
        overload(_linear, A=kinds.matrix, lb=kinds.vector, ub=kinds.vector, vars=kinds.vars),
        overload(_linear_row, a=kinds.row, lb=kinds.number, ub=kinds.number, vars=kinds.vars),
        overload(parse.linear_constraint, e=kinds.expression, lb=kinds.number, ub=kinds.number),
        overload(parse.linear_constraint, v=kinds.expressions, lb=_bound, ub=_bound),
        overload(lambda f: formulas.formula_constraint(f, linear=True), f=kinds.formula),
        overload(lambda fs: formulas.formulas_constraint(fs, linear=True), formulas=kinds.formulas),
    ]
)
_EQUALITY = Ways(
    [
        overload(_equality, Aeq=kinds.matrix, beq=kinds.vector, vars=kinds.vars),
        overload(_equality, a=kinds.row, beq=kinds.number, vars=kinds.vars),
        overload(parse.equality_constraint, e=kinds.expression, b=kinds.number),
        overload(lambda f: formulas.formulas_equality([f]), f=kinds.formula),
        overload(formulas.formulas_equality, formulas=kinds.formulas),
        overload(parse.equality_constraint, v=kinds.expressions, b=_bound),
    ]
)
_BOX = Ways(
    [
        overload(_box, lb=_bound, ub=_bound, vars=kinds.vars),
        overload(_box_of_one, lb=kinds.number, ub=kinds.number, var=kinds.variable),
        overload(_box_for_all, lb=kinds.number, ub=kinds.number, vars=kinds.vars),
    ]
)
_QUADRATIC = Ways(
    [
        overload(
            _quadratic,
            Q=kinds.matrix,
            b=kinds.vector,
            lb=kinds.number,
            ub=kinds.number,
            vars=kinds.vars,
            hessian_type=_HESSIAN,
        ),
        overload(_quadratic_of_expression, e=kinds.expression, lb=kinds.number, ub=kinds.number, hessian_type=_HESSIAN),
    ]
)
_CALLBACK = Ways([overload(_callback, func=kinds.function, vars=kinds.vars)])
