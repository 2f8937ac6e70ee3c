"""Functions of some decision variables: what costs and constraints are."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Hashable
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.common import quick
from sheldrake.common._checked import checked
from sheldrake.common._no_constructor import no_constructor
from sheldrake.common._text import number
from sheldrake.solvers import _arrays
from sheldrake.solvers._kernels import inside as kernels
from sheldrake.solvers._text import latex_bounds, latex_matrix
from sheldrake.symbolic import Expression, Formula, logical_and

if TYPE_CHECKING:
    from numpy.typing import ArrayLike
    from typing_extensions import Self

    from sheldrake.solvers._arrays import VariablesLike
    from sheldrake.symbolic._tape import Written

ANY = -1  # Number of variables of a function that takes any.

_VECTOR = quick.ANY
inside_box = quick.short_way(
    globals(), "inside_box", kernels.inside_box, _VECTOR, _VECTOR, _VECTOR, float, gives=bool
)  # to be looked up when called: another one takes its place


class Many(Protocol):
    """Evaluators that differ by their variables alone, evaluated together: each at its own point."""

    def values(self, points: np.ndarray) -> np.ndarray:
        """Values at points of shape (evaluators, n), shape (evaluators, m)."""

    def slopes(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values, shape (evaluators, m), and their derivatives, shape (evaluators, m, n)."""

    def hessian(self, points: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Second derivatives of the values times weights of shape (evaluators, m), shape (evaluators, n, n)."""


class Changes:
    """Tells whether numbers of any evaluator changed: `latest` is another object after each time."""

    latest = object()

    @classmethod
    def note(cls) -> None:
        """Says that some did; what was made of programs may not fit any more."""
        cls.latest = object()


@no_constructor()
class EvaluatorBase:
    """A function from a vector to a vector, with its derivatives. Not made directly: costs and constraints are."""

    _num_vars: int
    _num_outputs: int
    _description: str = ""
    _sparsity: list[tuple[int, int]] | None = None
    _thread_safe = True

    def _set_sizes(self, num_outputs: int, num_vars: int, description: str = "") -> None:
        self._num_outputs, self._num_vars, self._description = num_outputs, num_vars, description

    def Eval(self, x: ArrayLike) -> np.ndarray:
        """Returns the values at x, shape `(num_outputs,)`; AutoDiffXd or Expression where x is made of these.

        Raises:
            RuntimeError: x has another size than `num_vars()`, or the function knows no such scalar.
        """
        x, kind = _arrays.kind_of(x)
        if self._num_vars not in (ANY, len(x)):
            raise RuntimeError(f"{type(self).__name__}.Eval(): x has {len(x)} elements, expected {self._num_vars}.")
        if kind == _arrays.FLOATS:
            return self._eval(x)
        return self._eval_duals(x) if kind == _arrays.DUALS else self._eval_symbols(_arrays.symbols(x))

    def _eval(self, x: np.ndarray) -> np.ndarray:
        raise NotImplementedError

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        """Derivatives at x, shape `(num_outputs, num_vars)`."""
        return _arrays.values_and_gradient(self._eval_duals(_arrays.variables_at(x)))[1]

    def _eval_with_jacobian(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values and derivatives at x."""
        return self._eval(x), self._jacobian(x)

    def _written(self) -> Written | None:
        """The function as operations for kernels, with two derivatives; None if there are none."""
        return None

    def _alike(self) -> Hashable | None:
        """What evaluators must have in common to be evaluated together; None: one at a time."""
        return None

    def _many(self) -> Many:
        """Evaluates all that are alike, where there is something to be alike by."""
        raise NotImplementedError

    def _of_others(self, vars: np.ndarray) -> Self:
        """The same function as an evaluator of its own, for other variables in the same order."""
        out = self.__class__.__new__(self.__class__)
        out.__dict__.update(self.__dict__)
        return out

    def _eval_duals(self, x: np.ndarray) -> np.ndarray:
        values, gradient = _arrays.values_and_gradient(x)
        y, J = self._eval_with_jacobian(values)
        return _arrays.duals(y, J @ gradient)

    def _eval_symbols(self, x: np.ndarray) -> np.ndarray:
        raise RuntimeError(f"{type(self).__name__} does not support symbolic evaluation.")

    def num_outputs(self) -> int:
        """Returns how many values it has."""
        return self._num_outputs

    def num_vars(self) -> int:
        """Returns how many variables it takes; -1 if any number."""
        return self._num_vars

    def get_description(self) -> str:
        """Returns what a user called it."""
        return self._description

    @checked
    def set_description(self, arg0: str) -> None:
        """Gives it a name for messages."""
        self._description = arg0

    def is_thread_safe(self) -> bool:
        """Tells whether several threads may call it at once; never so for Python functions."""
        return self._thread_safe

    def gradient_sparsity_pattern(self) -> list[tuple[int, int]] | None:
        """Returns which derivatives may differ from zero, as (output, variable); None if all."""
        return self._sparsity

    def SetGradientSparsityPattern(self, gradient_sparsity_pattern: list[tuple[int, int]]) -> None:
        """Says which derivatives may differ from zero.

        Raises:
            ValueError: an index is out of range.
        """
        for row, col in gradient_sparsity_pattern:
            if not (0 <= row < self._num_outputs and (self._num_vars == ANY or 0 <= col < self._num_vars)):
                raise ValueError(f"SetGradientSparsityPattern(): ({row}, {col}) is out of range.")
        self._sparsity = [(int(r), int(c)) for r, c in gradient_sparsity_pattern]

    def ToLatex(self, vars: VariablesLike, precision: int = 3) -> str:
        """Returns LaTeX for the function of given variables."""
        vars = _arrays.variable_vector(vars)
        if self._num_vars not in (ANY, len(vars)):
            raise RuntimeError(f"ToLatex(): expected {self._num_vars} variables, got {len(vars)}.")
        text = self._latex(vars, precision)
        return text + (rf" \tag{{{self._description}}}" if self._description else "")

    def _latex(self, vars: np.ndarray, precision: int) -> str:
        from sheldrake.symbolic import ToLatex

        return rf"\text{{{type(self).__name__}}}({', '.join(ToLatex(v, precision) for v in vars)})"

    def _display(self, vars: np.ndarray) -> str:
        """Text of the function of given variables."""
        named = f" described as '{self._description}'" if self._description else ""
        names = "".join(f" {v}" for v in vars)
        return f"{type(self).__name__}{named} with {len(vars)} decision variables{names}\n"


class Cost(EvaluatorBase):
    """A function with one value, which a solver makes small."""

    def _display(self, vars: np.ndarray) -> str:
        named = f" described as '{self._description}'" if self._description else ""
        return f"{type(self).__name__} {self._eval_symbols(_arrays.symbols(vars))[0]}{named}"


class Constraint(EvaluatorBase):
    """A function whose values a solver keeps between bounds."""

    _lower: np.ndarray
    _upper: np.ndarray

    def _set_bounds(self, lower: np.ndarray, upper: np.ndarray) -> None:
        self._own_bounds(lower.astype(float), upper.astype(float))

    def _own_bounds(self, lower: np.ndarray, upper: np.ndarray) -> None:
        """Sets bounds to arrays of floats that nobody else changes."""
        if lower.size != self._num_outputs or upper.size != self._num_outputs:
            which = "Lower" if lower.size != self._num_outputs else "Upper"
            error = RuntimeError if hasattr(self, "_lower") else ValueError
            raise error(
                f"{which} bound has invalid dimension: {type(self).__name__} expects bounds of size "
                f"{self._num_outputs}, got a lower bound of size {lower.size} and an upper bound of size {upper.size}."
            )
        squares = lower.dot(lower)  # nan if a bound is, and only then: infinities have one sign here
        if upper is not lower:
            squares += upper.dot(upper)
        if squares != squares:
            raise RuntimeError(f"{type(self).__name__}: a bound is nan.")
        self._lower, self._upper = lower, upper
        Changes.note()

    def lower_bound(self) -> np.ndarray:
        """Returns the least values, shape `(num_constraints,)`."""
        return self._lower.copy()

    def upper_bound(self) -> np.ndarray:
        """Returns the greatest values, shape `(num_constraints,)`."""
        return self._upper.copy()

    def num_constraints(self) -> int:
        """Returns how many values there are."""
        return self._num_outputs

    def CheckSatisfied(self, x: ArrayLike, tol: float = 1e-6) -> bool | Formula:
        """Tells whether the values at x are within the bounds, up to `tol`; a Formula where x is symbolic."""
        x, kind = _arrays.kind_of(x)
        if self._num_vars not in (ANY, len(x)):
            raise RuntimeError(f"CheckSatisfied(): x has {len(x)} elements, expected {self._num_vars}.")
        if kind == _arrays.SYMBOLS:
            return self._formula(_arrays.symbols(x))
        if kind == _arrays.DUALS:
            x = _arrays.values_and_gradient(x)[0]
        return self._is_satisfied(x, tol)

    def _is_satisfied(self, x: np.ndarray, tol: float) -> bool:
        y = self._eval(x)
        inside = inside_box(self._lower, self._upper, y, tol)
        return bool((y >= self._lower - tol).all() and (y <= self._upper + tol).all()) if inside is None else inside

    def _formula(self, x: np.ndarray) -> Formula:
        parts = []
        for y, lower, upper in zip(self._eval_symbols(x), self._lower, self._upper):
            if lower == upper:
                parts.append(Expression(lower) == y)
                continue
            parts += [Expression(lower) <= y] if np.isfinite(lower) else []
            parts += [y <= upper] if np.isfinite(upper) else []
        return logical_and(*parts) if parts else Formula.True_()

    @checked
    def CheckSatisfiedVectorized(self, x: ArrayLike, tol: float) -> list[bool]:
        """Tells for each column of x whether it satisfies the constraint."""
        x = np.asarray(x, dtype=float)
        columns = np.ascontiguousarray(x.T if x.ndim == 2 else x[None])
        return [bool(self.CheckSatisfied(column, tol)) for column in columns]

    def _display(self, vars: np.ndarray) -> str:
        named = f" described as '{self._description}'" if self._description else ""
        rows = [f"{type(self).__name__}{named}"]
        for y, lower, upper in zip(self._eval_symbols(_arrays.symbols(vars)), self._lower, self._upper):
            rows.append(f"{number(lower)} <= {y} <= {number(upper)}")
        return "\n".join(rows) + "\n"

    def _latex(self, vars: np.ndarray, precision: int) -> str:
        y = self._eval_symbols(_arrays.symbols(vars))
        return latex_bounds(latex_matrix(y, precision), self._lower, self._upper, precision)


class Opaque:
    """A cost or constraint that is no formula: its text is its name and its variables."""

    _display = EvaluatorBase._display
    _latex = EvaluatorBase._latex


class WithSlopes:
    """An evaluator whose values come with derivatives: `_eval_with_jacobian` has both."""

    if TYPE_CHECKING:

        def _eval_with_jacobian(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]: ...

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        return self._eval_with_jacobian(x)[1]


class VisualizationCallback(EvaluatorBase):
    """A function that a solver calls with its iterates."""

    _thread_safe = False
    _func: Callable[[np.ndarray], Any]

    @classmethod
    def _make(cls, func: Callable, num_vars: int) -> VisualizationCallback:
        self = cls.__new__(cls)
        self._set_sizes(0, num_vars)
        self._func = func
        return self

    def _eval(self, x: np.ndarray) -> np.ndarray:
        self._func(x)
        return np.zeros(0)

    def _eval_duals(self, x: np.ndarray) -> np.ndarray:
        self._func(_arrays.values_and_gradient(x)[0])
        return np.zeros(0, dtype=object)


def _checked(call: str, y: ArrayLike, expected: type, size: int, scalar: bool) -> np.ndarray:
    """What a Python function gave, as a vector of the scalar it was called with.

    Raises:
        TypeError: the scalar is another.
        RuntimeError: the shape is another.
    """
    y = np.asarray(y)
    ndims = (0,) if scalar else (1, 2)
    if y.ndim not in ndims or y.size != size or (y.ndim == 2 and size and 1 not in y.shape):
        words = "0 (scalar)" if scalar else "1 or 2 (vector)"
        raise RuntimeError(
            f"{call}: Return value must be of .ndim = {words} and .size = {size}. Got .ndim = {y.ndim} and .size = "
            f"{y.size} instead."
        )
    if y.size:
        found = _scalar_type(y)
        if found is not expected:
            other = f", not {found.__name__}" if found is not None else ""
            raise TypeError(
                f"When {call} is called with an array of type {expected.__name__} the return value must be the same "
                f"type{other}."
            )
    return y.ravel()


def _scalar_type(y: np.ndarray) -> type | None:
    if y.dtype != object:
        return float if y.dtype.kind in "fi" else y.dtype.type
    return next((type(v) for v in y.flat if type(v).__module__ not in ("builtins", "numpy")), None)


class _PyFunction(WithSlopes):
    """A Python function of a vector as an evaluator."""

    _thread_safe = False
    _func: Callable
    _scalar: bool
    _num_outputs: int

    def _call(self, x: np.ndarray, expected: type) -> np.ndarray:
        return _checked(type(self).__name__, self._func(x), expected, self._num_outputs, self._scalar)

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return self._call(x, float).astype(float)

    def _eval_duals(self, x: np.ndarray) -> np.ndarray:
        return self._call(x, AutoDiffXd)

    def _eval_with_jacobian(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        y, J = _arrays.values_and_gradient(self._call(_arrays.variables_at(x), AutoDiffXd))
        return y, J if J.size or not y.size else np.zeros((len(y), len(x)))


class PyFunctionCost(_PyFunction, Cost):
    """A cost that is a Python function of floats or AutoDiffXd.

    Args:
        num_vars: Size of its argument.
        func: Takes a vector and returns a number of the same scalar.
        description: A name for messages.
    """

    _scalar = True

    def __init__(self, num_vars: int, func: Callable, description: str = ""):
        self._set_sizes(1, num_vars, description)
        self._func = func

    _display = EvaluatorBase._display


class PyFunctionConstraint(Opaque, _PyFunction, Constraint):
    """A constraint that is a Python function of floats or AutoDiffXd.

    Args:
        num_vars: Size of its argument.
        func: Takes a vector and returns a vector of the same scalar.
        lb: Least values.
        ub: Greatest values.
        description: A name for messages.
    """

    _scalar = False

    def __init__(self, num_vars: int, func: Callable, lb: ArrayLike, ub: ArrayLike, description: str = ""):
        self._set(num_vars, func, _arrays.float_vector(lb), _arrays.float_vector(ub), description)

    def _set(self, num_vars: int, func: Callable, lower: np.ndarray, upper: np.ndarray, description: str) -> None:
        self._set_sizes(lower.size, num_vars, description)
        self._own_bounds(lower, upper)
        self._func = func

    @classmethod
    def _of(cls, num_vars: int, func: Callable, lower: np.ndarray, upper: np.ndarray, description: str) -> Self:
        """The constraint with bounds that nobody else has."""
        self = cls.__new__(cls)
        self._set(num_vars, func, lower, upper, description)
        return self

    def set_bounds(self, lower_bound: ArrayLike, upper_bound: ArrayLike) -> None:
        """Sets both bounds."""
        self._set_bounds(_arrays.float_vector(lower_bound), _arrays.float_vector(upper_bound))

    def UpdateLowerBound(self, new_lb: ArrayLike) -> None:
        """Sets the least values."""
        self._set_bounds(_arrays.float_vector(new_lb), self._upper)

    def UpdateUpperBound(self, new_ub: ArrayLike) -> None:
        """Sets the greatest values."""
        self._set_bounds(self._lower, _arrays.float_vector(new_ub))


def takes_vector_function(value: object) -> bool:
    """Whether a value can be called with a vector (and is no evaluator)."""
    return callable(value) and not isinstance(value, EvaluatorBase) and not inspect.isclass(value)
