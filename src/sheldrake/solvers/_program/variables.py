"""The variables of a program, and guesses of their values.

One of the parts that `MathematicalProgram` is put together from.
"""

from __future__ import annotations

import functools
import itertools
import math
import operator
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple
from typing import overload as typing_overload

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import anything, count, instance_of, text
from sheldrake.common._overloads import Mismatch, Ways, incompatible, overload, overloaded
from sheldrake.solvers import _arrays
from sheldrake.symbolic import Expression, Variable, Variables
from sheldrake.symbolic._kinds import VariableType
from sheldrake.symbolic._traverse import object_array
from sheldrake.symbolic._variable import named

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.solvers._arrays import VariablesLike
    from sheldrake.solvers._functions.bindings import BindingBase

_TYPE = VariableType
_id_of, _type_of = operator.attrgetter("_id"), operator.attrgetter("_type")


class DecisionVariables(NamedTuple):
    """Decision variables in order, the place of each by its identity number, and whether one is 0 or 1."""

    variables: list[Variable]
    places: dict[int, int]
    has_binaries: bool


class ProgramVariables:
    """Decision variables and indeterminates in order, their places, the initial guess, and scales."""

    def __init__(self) -> None:
        self._decisions: list[Variable] = []
        self._places: dict[int, int] = {}  # place of a decision variable by its identity number
        self._guess: list[float] = []
        self._indeterminates: list[Variable] = []
        self._indeterminate_places: dict[int, int] = {}
        self._scaling: dict[int, float] = {}
        self._snapshot: DecisionVariables | None = None

    def copy(self) -> ProgramVariables:
        """The same variables in lists of their own."""
        out = ProgramVariables()
        out._decisions, out._places, out._guess = list(self._decisions), dict(self._places), list(self._guess)
        out._indeterminates = list(self._indeterminates)
        out._indeterminate_places = dict(self._indeterminate_places)
        out._scaling = dict(self._scaling)
        return out

    # New variables

    def has_binaries(self) -> bool:
        """Whether a decision variable is 0 or 1."""
        return self.decisions().has_binaries

    def _check_new(self, v: Variable) -> None:
        if v._id in self._indeterminate_places:
            raise RuntimeError(f"{v} is already an indeterminate.")
        if v._type not in (_TYPE.CONTINUOUS, _TYPE.BINARY):
            raise RuntimeError(f"MathematicalProgram: {v!r} is no decision variable; those are continuous or binary.")

    def _append_new(self, vars: list[Variable]) -> None:
        """Adds variables that are in no program yet, of a type that may be."""
        self._places.update(zip(map(_id_of, vars), itertools.count(len(self._decisions))))
        self._decisions += vars
        self._guess += [math.nan] * len(vars)
        self._snapshot = None

    def _new(self, type: VariableType, shape: tuple[int, ...], name: str) -> np.ndarray:
        """New decision variables; those of a column are numbered as a vector (Drake's indeterminates are not)."""
        new = named(_names(shape[:1] if shape[1:] == (1,) else shape, name), type)
        self._append_new(new)
        return _objects(new, shape)

    @typing_overload
    def NewContinuousVariables(self, rows: int, name: str = "x") -> np.ndarray: ...
    @typing_overload
    def NewContinuousVariables(self, rows: int, cols: int, name: str = "x") -> np.ndarray: ...
    def NewContinuousVariables(self, *args: Any, **kwargs: Any) -> np.ndarray:
        """Returns new continuous variables; called as `(rows, name="x")` or `(rows, cols, name="x")`."""
        return self._new(_TYPE.CONTINUOUS, *_NEW_VARIABLES.choose("NewContinuousVariables", args, kwargs))

    @typing_overload
    def NewBinaryVariables(self, rows: int, name: str = "b") -> np.ndarray: ...
    @typing_overload
    def NewBinaryVariables(self, rows: int, cols: int, name: str = "b") -> np.ndarray: ...
    def NewBinaryVariables(self, *args: Any, **kwargs: Any) -> np.ndarray:
        """Returns new variables that are 0 or 1; called as `(rows, name="b")` or `(rows, cols, name="b")`."""
        return self._new(_TYPE.BINARY, *_NEW_BINARIES.choose("NewBinaryVariables", args, kwargs))

    @typing_overload
    def NewIndeterminates(self, rows: int, name: str = "x") -> np.ndarray: ...
    @typing_overload
    def NewIndeterminates(self, rows: int, cols: int, name: str = "X") -> np.ndarray: ...
    def NewIndeterminates(self, *args: Any, **kwargs: Any) -> np.ndarray:
        """Returns new indeterminates; called as `(rows, name="x")` or `(rows, cols, name="X")`."""
        shape, name = _NEW_INDETERMINATES.choose("NewIndeterminates", args, kwargs)
        new = named(_names(shape, name), _TYPE.CONTINUOUS)
        for v in new:
            self._append_indeterminate(v)
        return _objects(new, shape)

    @checked
    def NewSymmetricContinuousVariables(self, rows: int, name: str = "Symmetric") -> np.ndarray:
        """Returns a symmetric matrix of new continuous variables, shape `(rows, rows)`."""
        places = _places_in_triangle(rows)
        new = named([f"{name}({i},{j})" for j in range(rows) for i in range(j, rows)], _TYPE.CONTINUOUS)
        self._append_new(new)
        return _objects(new)[places]

    def AddDecisionVariables(self, decision_variables: VariablesLike) -> None:
        """Adds variables made elsewhere; those that are there already stay where they are.

        Raises:
            RuntimeError: one is an indeterminate, or neither continuous nor binary.
        """
        given, places = self._expect_variables("AddDecisionVariables", decision_variables).tolist(), self._places
        new = {v._id: v for v in given if v._id not in places}
        for v in new.values():
            self._check_new(v)
        self._append_new([*new.values()])

    def _append_indeterminate(self, v: Variable) -> None:
        if v.get_id() in self._places:
            raise RuntimeError(f"{v} is a decision variable in the optimization program.")
        if v.get_type() is not _TYPE.CONTINUOUS:
            raise RuntimeError(f"{v} should be of type CONTINUOUS.")
        self._indeterminate_places[v.get_id()] = len(self._indeterminates)
        self._indeterminates.append(v)

    @checked
    def AddIndeterminate(self, new_indeterminate: Variable) -> int:
        """Adds an indeterminate, if it is not one yet, and returns its place.

        Raises:
            RuntimeError: it is a decision variable.
        """
        if new_indeterminate.get_id() not in self._indeterminate_places:
            self._append_indeterminate(new_indeterminate)
        return self._indeterminate_places[new_indeterminate.get_id()]

    def AddIndeterminates(self, new_indeterminates: VariablesLike | Variables) -> None:
        """Adds indeterminates made elsewhere, from an array or `Variables`."""
        given = new_indeterminates
        for v in given if isinstance(given, Variables) else self._expect_variables("AddIndeterminates", given):
            self.AddIndeterminate(v)

    def remove(self, var: Variable) -> int:
        """Takes out a decision variable that nothing is bound to, and returns the place it had."""
        place, self._snapshot = self._places[var.get_id()], None
        del self._decisions[place], self._guess[place]
        self._places = {v.get_id(): i for i, v in enumerate(self._decisions)}
        scales = {i: s for i, s in self._scaling.items() if i != place}
        self._scaling = {i - (i > place): s for i, s in scales.items()}
        return place

    # What there is

    def num_vars(self) -> int:
        """Returns the number of decision variables."""
        return len(self._decisions)

    def num_indeterminates(self) -> int:
        """Returns the number of indeterminates."""
        return len(self._indeterminates)

    def decision_variables(self) -> np.ndarray:
        """Returns the decision variables in order, shape `(num_vars,)`."""
        return _objects(self._decisions)

    def decisions(self) -> DecisionVariables:
        """The decision variables as they are now: the same object until there are others."""
        if self._snapshot is None:
            self._snapshot = DecisionVariables(
                list(self._decisions), dict(self._places), _TYPE.BINARY in map(_type_of, self._decisions)
            )
        return self._snapshot

    def decision_variable(self, i: int) -> Variable:
        """Returns one decision variable."""
        return self._decisions[i]

    def decision_variable_index(self) -> dict[int, int]:
        """Returns the place of each decision variable by its identity number."""
        return dict(self._places)

    def indeterminates(self) -> np.ndarray:
        """Returns the indeterminates in order, shape `(num_indeterminates,)`."""
        return _objects(self._indeterminates)

    def indeterminate(self, i: int) -> Variable:
        """Returns one indeterminate."""
        return self._indeterminates[i]

    def indeterminates_index(self) -> dict[int, int]:
        """Returns the place of each indeterminate by its identity number."""
        return dict(self._indeterminate_places)

    @checked
    def FindDecisionVariableIndex(self, var: Variable) -> int:
        """Returns the place of a decision variable.

        Raises:
            RuntimeError: it is none.
        """
        place = self._places.get(var.get_id())
        if place is None:
            raise RuntimeError(
                f"{var} is not a decision variable in the mathematical program, when calling "
                "FindDecisionVariableIndex.\n"
            )
        return place

    def FindDecisionVariableIndices(self, vars: VariablesLike) -> list[int]:
        """Returns the places of decision variables."""
        found = self._expect_variables("FindDecisionVariableIndices", vars)
        return [self.FindDecisionVariableIndex(v) for v in found]

    @checked
    def FindIndeterminateIndex(self, var: Variable) -> int:
        """Returns the place of an indeterminate.

        Raises:
            RuntimeError: it is none.
        """
        place = self._indeterminate_places.get(var.get_id())
        if place is None:
            raise RuntimeError(
                f"{var} is not an indeterminate in the mathematical program, when calling GetSolution.\n"
            )
        return place

    def is_decision(self, var: Variable) -> bool:
        """Whether a variable is a decision variable."""
        return var.get_id() in self._places

    def is_indeterminate(self, var: Variable) -> bool:
        """Whether a variable is an indeterminate."""
        return var.get_id() in self._indeterminate_places

    def places_in(self, bindings: Iterable[BindingBase]) -> np.ndarray:
        """Places of the variables of bindings, which are decision variables, one after the other, shape (n,)."""
        places = self._places
        return np.array([places[v._id] for b in bindings for v in b._list], dtype=int)

    def check_decisions(self, vars: Iterable[Variable]) -> None:
        """Raises RuntimeError where one is no decision variable."""
        places = self._places
        for v in vars:
            if v._id not in places:
                raise RuntimeError(f"{v} is not a decision variable of the mathematical program.")

    def _expect_variables(self, call: str, vars: Variable | VariablesLike) -> np.ndarray:
        try:
            return _arrays.variable_vector([vars] if isinstance(vars, Variable) else vars)
        except Mismatch:
            raise incompatible(call, ["(vars: numpy.ndarray of Variable)"], (vars,), {}) from None

    # Guesses

    def initial_guess(self) -> np.ndarray:
        """Returns the guess of all decision variables, nan where there is none."""
        return np.array(self._guess)

    def GetInitialGuess(self, decision_variable: Variable | VariablesLike) -> float | np.ndarray:
        """Returns the guess of a variable, or of an array of them in its shape.

        Raises:
            RuntimeError: a variable is no decision variable.
        """
        if isinstance(decision_variable, (Variable, Expression)):
            v = self._expect_variables("GetInitialGuess", np.array([decision_variable], dtype=object))[0]
            return float(self._guess[self.FindDecisionVariableIndex(v)])
        array = np.asarray(decision_variable, dtype=object)
        vars = self._expect_variables("GetInitialGuess", array)
        places = self._places
        if not all(v._id in places for v in vars.tolist()):
            self.FindDecisionVariableIndices(vars)  # says which one is none
        values = [self._guess[places[v._id]] for v in vars.tolist()]
        return np.array(values, dtype=float).reshape(array.shape, order="F")

    def SetInitialGuess(self, decision_variable: Variable | VariablesLike, variable_guess: ArrayLike) -> None:
        """Sets the guess of a variable, or of an array of them.

        Raises:
            RuntimeError: a variable is no decision variable, or sizes differ.
        """
        places = self._places
        for v, value in self._pairs("SetInitialGuess", decision_variable, variable_guess):
            place = places.get(v._id)
            self._guess[self.FindDecisionVariableIndex(v) if place is None else place] = value

    @checked
    def SetInitialGuessForAllVariables(self, x0: ArrayLike) -> None:
        """Sets the guess of all decision variables, shape `(num_vars,)`.

        Raises:
            RuntimeError: the size is another.
        """
        values = np.asarray(x0, dtype=float).ravel()
        if values.size != self.num_vars():
            raise RuntimeError(
                f"SetInitialGuessForAllVariables(): expected {self.num_vars()} values, got {values.size}."
            )
        self._guess = values.tolist()

    @overloaded(
        overload(decision_variable=anything, decision_variable_new_value=anything, values=instance_of(np.ndarray)),
        overload(decision_variables=anything, decision_variables_new_values=anything, values=instance_of(np.ndarray)),
    )
    def SetDecisionVariableValueInVector(
        self, vars: Variable | VariablesLike, new: ArrayLike, values: np.ndarray
    ) -> None:
        """Writes the value of one or several decision variables into a vector of the values of all.

        Called as `(decision_variable(s), new_value(s), values)`; `values` has shape `(num_vars,)` and is changed.

        Raises:
            RuntimeError: a variable is no decision variable, or sizes differ.
        """
        if values.size != self.num_vars():
            raise RuntimeError(
                f"SetDecisionVariableValueInVector(): values must be an array of {self.num_vars()} floats."
            )
        for v, value in self._pairs("SetDecisionVariableValueInVector", vars, new):
            values[self.FindDecisionVariableIndex(v)] = value

    def _pairs(self, call: str, vars: Variable | VariablesLike, values: ArrayLike) -> list[tuple[Variable, float]]:
        accepted = ["(variable: Variable, value: float)", "(variables: numpy.ndarray, values: numpy.ndarray)"]
        try:
            if isinstance(vars, (Variable, Expression)):
                return [(_arrays.variable_vector(np.array([vars], dtype=object))[0], _arrays.number(values))]
            flat = _arrays.variable_vector(vars)
            floats = np.asarray(values, dtype=float)
            if floats.ndim == 0:
                raise Mismatch
            floats = floats.ravel(order="F")
        except (Mismatch, ValueError, TypeError):
            raise incompatible(call, accepted, (vars, values), {}) from None
        if floats.size != flat.size:
            raise RuntimeError(f"{call}(): {flat.size} variables, but {floats.size} values.")
        return list(zip(flat.tolist(), floats.tolist()))

    # Scaling

    def GetVariableScaling(self) -> dict[int, float]:
        """Returns the factors of scaled variables by place."""
        return dict(self._scaling)

    def SetVariableScaling(self, var: Variable, s: float) -> None:
        """Says that a variable is of the size of s, for solvers that make use of that.

        Raises:
            RuntimeError: s is not positive, or the variable is no decision variable.
        """
        if not s > 0.0:
            raise RuntimeError(f"SetVariableScaling(): the factor must be positive, got {s}.")
        self._scaling[self.FindDecisionVariableIndex(var)] = float(s)

    def ClearVariableScaling(self) -> None:
        """Forgets all factors."""
        self._scaling = {}


def _objects(items: list[Variable], shape: tuple[int, ...] = ()) -> np.ndarray:
    """An array of variables; of a matrix given column after column."""
    out = object_array(items)
    return out.reshape(shape, order="F") if len(shape) > 1 else out


def _names(shape: tuple[int, ...], name: str) -> list[str]:
    """Names of elements, column after column; not to be changed."""
    return _few_names(shape, name) if math.prod(shape) <= _FEW else _written_names(shape, name)


@functools.lru_cache(maxsize=64)
def _places_in_triangle(n: int) -> np.ndarray:
    """Where the entries of a symmetric matrix are among those of its lower triangle, column after column."""
    out = np.empty((n, n), dtype=np.intp)
    cols, rows = np.triu_indices(n)
    out[rows, cols] = out[cols, rows] = np.arange(len(rows))
    return out


def _written_names(shape: tuple[int, ...], name: str) -> list[str]:
    if len(shape) == 1:
        return [f"{name}({i})" for i in range(shape[0])]
    return [f"{name}({i},{j})" for j in range(shape[1]) for i in range(shape[0])]


_FEW = 1000  # names that are kept for the next program
_few_names = functools.lru_cache(maxsize=32)(_written_names)


def _ways(vector: str, matrix: str) -> Ways:
    """Calls `(rows, name)` and `(rows, cols, name)`, as shape and name; the names are the defaults."""
    return Ways(
        [
            overload(lambda rows, name: ((rows,), name), rows=count, name=(text, vector)),
            overload(lambda rows, cols, name: ((rows, cols), name), rows=count, cols=count, name=(text, matrix)),
        ]
    )


_NEW_VARIABLES, _NEW_BINARIES, _NEW_INDETERMINATES = _ways("x", "x"), _ways("b", "b"), _ways("x", "X")
