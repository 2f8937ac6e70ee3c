"""Adding costs to a program: expressions are sorted by kind, and bound to variables.

One of the parts that `MathematicalProgram` is put together from.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import flag, instance_of, text
from sheldrake.common._overloads import Ways, kind, overload
from sheldrake.solvers import _kinds as kinds
from sheldrake.solvers._arrays import Matrix
from sheldrake.solvers._functions.bindings import Binding, BindingBase, as_kind, bind
from sheldrake.solvers._functions.costs import LinearCost, QuadraticCost, symmetric_part
from sheldrake.solvers._functions.evaluators import Cost, PyFunctionCost
from sheldrake.solvers._functions.norm_costs import L2NormCost
from sheldrake.solvers._parse import costs as parse
from sheldrake.solvers._program.bindings import ProgramBindings
from sheldrake.symbolic import Expression, Variable

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.common._types import Symbolic
    from sheldrake.solvers._arrays import VariablesLike


@checked
class ProgramCosts:
    """Adds costs.

    Args:
        bindings: Where they are kept.
    """

    def __init__(self, bindings: ProgramBindings) -> None:
        self._bindings = bindings

    @typing_overload
    def AddCost(self, func: Callable[..., object], vars: VariablesLike, description: str = "") -> Binding[Cost]: ...
    @typing_overload
    def AddCost(self, binding: BindingBase[Cost]) -> Binding[Cost]: ...
    @typing_overload
    def AddCost(self, e: Symbolic) -> Binding[Cost]: ...
    @typing_overload
    def AddCost(self, obj: Cost, vars: VariablesLike) -> Binding[Cost]: ...
    def AddCost(self, *args: Any, **kwargs: Any) -> Binding[Cost]:
        """Adds a cost and returns its binding.

        Called with an expression; with a function of a vector and `vars`; with a `Cost` and `vars`; or with a binding.
        An expression becomes a linear, quadratic or length cost if it is one.

        Raises:
            RuntimeError: a variable is no decision variable.
        """
        return as_kind(Cost, self._bindings.add(_COST.choose("AddCost", args, kwargs)))

    @typing_overload
    def AddLinearCost(self, e: Symbolic) -> Binding[LinearCost]: ...
    @typing_overload
    def AddLinearCost(self, a: ArrayLike, b: float, vars: VariablesLike) -> Binding[LinearCost]: ...
    @typing_overload
    def AddLinearCost(self, a: ArrayLike, vars: VariablesLike) -> Binding[LinearCost]: ...
    def AddLinearCost(self, *args: Any, **kwargs: Any) -> Binding[LinearCost]:
        """Adds a linear cost; called as `(e)`, `(a, b, vars)` or `(a, vars)`.

        Raises:
            RuntimeError: the expression is not linear, or a variable is no decision variable.
        """
        return self._bindings.add(_LINEAR.choose("AddLinearCost", args, kwargs))

    @typing_overload
    def AddQuadraticCost(self, e: Symbolic, is_convex: bool | None = None) -> Binding[QuadraticCost]: ...
    @typing_overload
    def AddQuadraticCost(
        self, Q: ArrayLike | Matrix, b: ArrayLike, vars: VariablesLike, is_convex: bool | None = None
    ) -> Binding[QuadraticCost]: ...
    @typing_overload
    def AddQuadraticCost(
        self, Q: ArrayLike | Matrix, b: ArrayLike, c: float, vars: VariablesLike, is_convex: bool | None = None
    ) -> Binding[QuadraticCost]: ...
    def AddQuadraticCost(self, *args: Any, **kwargs: Any) -> Binding[QuadraticCost]:
        """Adds a cost 1/2 x' Q x + b' x + c.

        Called as `(e, is_convex=None)`, `(Q, b, vars, is_convex=None)` or `(Q, b, c, vars, is_convex=None)`.

        Raises:
            RuntimeError: the expression is not quadratic, or a variable is no decision variable.
        """
        return self._bindings.add(_QUADRATIC.choose("AddQuadraticCost", args, kwargs))

    @typing_overload
    def AddQuadraticErrorCost(self, w: float, x_desired: ArrayLike, vars: VariablesLike) -> Binding[QuadraticCost]: ...
    @typing_overload
    def AddQuadraticErrorCost(
        self, Q: ArrayLike | Matrix, x_desired: ArrayLike, vars: VariablesLike
    ) -> Binding[QuadraticCost]: ...
    def AddQuadraticErrorCost(self, *args: Any, **kwargs: Any) -> Binding[QuadraticCost]:
        """Adds the cost (x - x_desired)' Q (x - x_desired); called as `(Q or w, x_desired, vars)`."""
        return self._bindings.add(_ERROR.choose("AddQuadraticErrorCost", args, kwargs))

    def Add2NormSquaredCost(self, A: ArrayLike | Matrix, b: ArrayLike, vars: VariablesLike) -> Binding[QuadraticCost]:
        """Adds the cost |A x - b|^2."""
        return self._bindings.add(_SQUARED_NORM.choose("Add2NormSquaredCost", (A, b, vars), {}))

    @typing_overload
    def AddL2NormCost(self, A: ArrayLike | Matrix, b: ArrayLike, vars: VariablesLike) -> Binding[L2NormCost]: ...
    @typing_overload
    def AddL2NormCost(
        self, e: Symbolic, psd_tol: float = 1e-08, coefficient_tol: float = 1e-08
    ) -> Binding[L2NormCost]: ...
    def AddL2NormCost(self, *args: Any, **kwargs: Any) -> Binding[L2NormCost]:
        """Adds the cost |A x + b|; called as `(A, b, vars)` or `(e, psd_tol=1e-8, coefficient_tol=1e-8)`.

        Raises:
            RuntimeError: the expression is no length.
        """
        return self._bindings.add(_NORM.choose("AddL2NormCost", args, kwargs))


# What the calls take, and the costs that they make of it.


def _of_function(func: Callable[..., Any], vars: np.ndarray, description: str) -> BindingBase[Cost]:
    return bind(Cost, PyFunctionCost(len(vars), func, description), vars)


@kind("Binding", refuses=(Expression, Variable))
def _cost_binding(value: object) -> BindingBase[Cost]:
    binding: BindingBase[Cost] = instance_of(BindingBase)(value)
    instance_of(Cost)(binding.evaluator())
    return binding


def _linear(a: np.ndarray, b: float, vars: np.ndarray) -> BindingBase[LinearCost]:
    return bind(LinearCost, LinearCost._of(a, b), vars)


def _quadratic(
    Q: Matrix, b: np.ndarray, c: float, vars: np.ndarray, is_convex: bool | None
) -> BindingBase[QuadraticCost]:
    return bind(QuadraticCost, QuadraticCost._of(symmetric_part(Q), b, c, is_convex), vars)


def _error(Q: Matrix, x_desired: np.ndarray, vars: np.ndarray) -> BindingBase[QuadraticCost]:
    slope = Q.dot(x_desired)
    new = QuadraticCost._of(symmetric_part(2.0 * Q), -2.0 * slope, float(x_desired.dot(slope)), None)
    return bind(QuadraticCost, new, vars)


def _squared_norm(A: Matrix, b: np.ndarray, vars: np.ndarray) -> BindingBase[QuadraticCost]:
    across = A.T  # by `dot`, which takes a fifth of the time of @ for a few numbers
    new = QuadraticCost._of(symmetric_part(2.0 * across.dot(A)), -2.0 * across.dot(b), float(b.dot(b)), True)
    return bind(QuadraticCost, new, vars)


def _norm(A: Matrix, b: np.ndarray, vars: np.ndarray) -> BindingBase[L2NormCost]:
    return bind(L2NormCost, L2NormCost(A, b), vars)


def _maybe_flag(value: bool | None) -> bool | None:
    return None if value is None else flag(value)


_CONVEX = (_maybe_flag, None)
_TOLERANCE = (kinds.number, 1e-8)
_COST = Ways(
    [
        overload(_of_function, func=kinds.function, vars=kinds.vars, description=(text, "")),
        overload(lambda binding: binding, binding=_cost_binding),
        overload(parse.cost, e=kinds.expression),
        overload(lambda cost, vars: bind(Cost, cost, vars), obj=instance_of(Cost), vars=kinds.vars),
    ]
)
_LINEAR = Ways(
    [
        overload(parse.linear_cost, e=kinds.expression),
        overload(_linear, a=kinds.vector, b=kinds.number, vars=kinds.vars),
        overload(lambda a, vars: _linear(a, 0.0, vars), a=kinds.vector, vars=kinds.vars),
    ]
)
_QUADRATIC = Ways(
    [
        overload(parse.quadratic_cost, e=kinds.expression, is_convex=_CONVEX),
        overload(
            lambda Q, b, vars, is_convex: _quadratic(Q, b, 0.0, vars, is_convex),
            Q=kinds.matrix,
            b=kinds.vector,
            vars=kinds.vars,
            is_convex=_CONVEX,
        ),
        overload(_quadratic, Q=kinds.matrix, b=kinds.vector, c=kinds.number, vars=kinds.vars, is_convex=_CONVEX),
    ]
)
_ERROR = Ways(
    [
        overload(
            lambda w, x_desired, vars: _error(w * np.eye(x_desired.size), x_desired, vars),
            w=kinds.number,
            x_desired=kinds.vector,
            vars=kinds.vars,
        ),
        overload(_error, Q=kinds.matrix, x_desired=kinds.vector, vars=kinds.vars),
    ]
)
_SQUARED_NORM = Ways([overload(_squared_norm, A=kinds.matrix, b=kinds.vector, vars=kinds.vars)])
_NORM = Ways(
    [
        overload(_norm, A=kinds.matrix, b=kinds.vector, vars=kinds.vars),
        overload(parse.l2norm_cost, e=kinds.expression, psd_tol=_TOLERANCE, coefficient_tol=_TOLERANCE),
    ]
)
