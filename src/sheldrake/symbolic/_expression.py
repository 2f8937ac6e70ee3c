"""The class Expression. How expressions are made is in `_build`, what is done with them in the files beside."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch, overloaded
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._arguments import SUBSTITUTIONS
from sheldrake.symbolic._operators import Operators
from sheldrake.symbolic._variable import Variable, Variables

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sheldrake.common import RandomGenerator
    from sheldrake.common._types import Symbolic, Symbolics

# Modules that need the class below; the package binds them when all is loaded.
_build: Any = None
_decompose: Any = None
_differentiate: Any = None
_functions: Any = None
_text: Any = None
_traverse: Any = None


class Expression(Operators):
    """A formula for a number, in variables: immutable, and simplified a little as it is made.

    Comparing two expressions gives a `Formula`, not a bool; `EqualTo` tells whether they have the same structure.

    Args:
        value: A number or a variable; zero if absent.
    """

    __slots__ = (
        "__weakref__", "_constant", "_found", "_kind", "_made", "_number", "_order", "_terms", "_twin", "_unit",
        "_variables",
    )  # fmt: skip
    _constant: float  # Of a sum or a product; so are the terms.
    _found: dict[Any, Any]  # What was asked of it before, by question; absent until somebody asks.
    _kind: int
    _made: Any  # What it is made of; of a sum or a product once it has been put in order.
    _number: int  # Equal expressions have the same; 0 until it has been asked for.
    _order: tuple  # Empty until then.
    _terms: dict
    _twin: Expression  # The one whose number it has.
    _unit: Expression | None  # Of a product, that without its constant, once known.
    _variables: Any
    __hash__ = None  # type: ignore[assignment]  # comparing two of them gives a formula, so no dict can hold them

    def __new__(cls, *args: Any, **kwargs: Any) -> Expression:
        given = (*args, *(v for n, v in kwargs.items() if n in ("constant", "var")))
        e = _build.ZERO if not given and not kwargs else None
        if len(given) == 1 and len(args) + len(kwargs) == 1:
            e = _build.as_expression(given[0])
        if e is None:
            raise Mismatch(
                f"Expression(): incompatible constructor arguments; expected nothing, a number or a Variable, got "
                f"{given!r}."
            )
        return e

    @property
    def _args(self) -> Any:
        """What it is made of: numbers and other expressions."""
        return _build.in_order(self) if self._made is None else self._made

    @property
    def _serial(self) -> int:
        """A number that it shares with what is equal."""
        return self._number or _build.number_of(self)

    @property
    def _key(self) -> tuple:
        """What expressions are sorted by."""
        return self._order or _build.key_of(self)

    def EqualTo(self, other: Expression) -> bool:
        """Tells whether both have the same structure; that is sufficient, not necessary, for being equal."""
        return _build.expect("EqualTo", other)._serial == self._serial

    def get_kind(self) -> k.ExpressionKind:
        """Returns what the expression is at its top."""
        return k.ExpressionKind(self._kind)

    def GetVariables(self) -> Variables:
        """Returns the variables in it."""
        return Variables._of(_traverse.variables_of(self))

    GetFreeVariables = GetVariables

    def Evaluate(self, env: Mapping[Variable, float] | None = None, generator: RandomGenerator | None = None) -> float:
        """Returns the value for given values of the variables.

        Args:
            env: Values by variable.
            generator: Gives the values of random variables that `env` does not have.

        Raises:
            RuntimeError: a variable has no value, a value is nan, or a division by zero.
            ValueError: a function is asked outside its domain.
        """
        return _traverse.evaluate([self], env, generator)[0]

    @checked
    def EvaluatePartial(self, env: dict[Variable, float]) -> Expression:
        """Returns the expression with values in the place of some variables."""
        return _traverse.substitute([self], _traverse.numbers_by_variable("EvaluatePartial", env))[0]

    @overloaded(*SUBSTITUTIONS)
    def Substitute(
        self, what: Mapping[Variable, Symbolic] | Variable | Symbolics, e: Symbolic | None = None
    ) -> Expression:
        """Returns the expression with others in the place of variables, all at once.

        Called as `Substitute(var, e)` or `Substitute({var: e, ...})`.
        """
        return _traverse.substitute([self], _traverse.substitution("Substitute", what, e))[0]

    def Expand(self) -> Expression:
        """Returns it with products of sums, and integer powers of them, multiplied out."""
        return _decompose.expand(self)

    def Differentiate(self, x: Variable) -> Expression:
        """Returns the partial derivative.

        Raises:
            RuntimeError: it has none that can be written down.
        """
        return _differentiate.differentiate([self], x)[0]

    def Jacobian(self, vars: Symbolics) -> np.ndarray:
        """Returns the partial derivatives by each of the variables, shape `(n,)`."""
        return _traverse.object_array(_differentiate.jacobian([self], _traverse.variable_list("Jacobian", vars))[0])

    def is_polynomial(self) -> bool:
        """Tells whether it is a polynomial in its variables."""
        return _traverse.is_polynomial(self)

    def Unapply(self) -> tuple[Any, list]:
        """Returns a function and its arguments that give this expression when called."""
        return _functions.unapply(self)

    def to_string(self) -> str:
        """Returns the text of it."""
        return str(self)

    def __copy__(self) -> Expression:
        return self

    def __deepcopy__(self, memo: dict) -> Expression:
        return self

    def __str__(self) -> str:
        return _text.text_of(self)

    def __repr__(self) -> str:
        return f'<Expression "{self}">'
