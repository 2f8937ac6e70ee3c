"""The variables of a program, and guesses of their values.

One of the parts that `MathematicalProgram` is put together from.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import anything, count, instance_of, text
from sheldrake.common._overloads import Mismatch, dispatch, incompatible, overload, overloaded
from sheldrake.solvers import _arrays
from sheldrake.symbolic import Expression, Variable, Variables

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

_TYPE = Variable.Type


class ProgramVariables:
    """Decision variables and indeterminates in order, their places, and the initial guess."""

    _decisions: list[Variable]
    _places: dict[int, int]  # Place of a decision variable by its identity number.
    _indeterminates: list[Variable]
    _indeterminate_places: dict[int, int]
    _guess: list[float]
    _scaling: dict[int, float]

    # New variables

    def _append(self, v: Variable) -> None:
        if v.get_id() in self._indeterminate_places:
            raise RuntimeError(f"{v} is already an indeterminate.")
        if v.get_type() not in (_TYPE.CONTINUOUS, _TYPE.BINARY):
            raise RuntimeError(f"MathematicalProgram: {v!r} is no decision variable; those are continuous or binary.")
        self._places[v.get_id()] = len(self._decisions)
        self._decisions.append(v)
        self._guess.append(np.nan)

    def _new(self, call: str, type: _TYPE, names: tuple[str, str], args: tuple, kwargs: dict, add: Callable) -> Any:
        is_decision = add == self._append  # Drake numbers indeterminates in a column by row and column.

        def vector(_: Any, rows: int, name: str) -> np.ndarray:
            return _filled((rows,), lambda i: Variable(f"{name}({i})", type), add)

        def matrix(_: Any, rows: int, cols: int, name: str) -> np.ndarray:
            if cols == 1 and is_decision:
                return _filled((rows, 1), lambda i, j: Variable(f"{name}({i})", type), add)
            return _filled((rows, cols), lambda i, j: Variable(f"{name}({i},{j})", type), add)

        ways = [
            overload(vector, rows=count, name=(text, names[0])),
            overload(matrix, rows=count, cols=count, name=(text, names[1])),
        ]
        return dispatch(call, ways, self, args, kwargs)

    def NewContinuousVariables(self, *args: Any, **kwargs: Any) -> np.ndarray:
        """Returns new continuous variables; called as `(rows, name="x")` or `(rows, cols, name="x")`."""
        return self._new("NewContinuousVariables", _TYPE.CONTINUOUS, ("x", "x"), args, kwargs, self._append)

    def NewBinaryVariables(self, *args: Any, **kwargs: Any) -> np.ndarray:
        """Returns new variables that are 0 or 1; called as `(rows, name="b")` or `(rows, cols, name="b")`."""
        return self._new("NewBinaryVariables", _TYPE.BINARY, ("b", "b"), args, kwargs, self._append)

    def NewIndeterminates(self, *args: Any, **kwargs: Any) -> np.ndarray:
        """Returns new indeterminates; called as `(rows, name="x")` or `(rows, cols, name="X")`."""
        add = self._append_indeterminate
        return self._new("NewIndeterminates", _TYPE.CONTINUOUS, ("x", "X"), args, kwargs, add)

    def NewSymmetricContinuousVariables(self, rows: int, name: str = "Symmetric") -> np.ndarray:
        """Returns a symmetric matrix of new continuous variables, shape `(rows, rows)`."""
        out = np.empty((rows, rows), dtype=object)
        for j in range(rows):
            for i in range(j, rows):
                out[i, j] = out[j, i] = Variable(f"{name}({i},{j})")
                self._append(out[i, j])
        return out

    def AddDecisionVariables(self, decision_variables: Any) -> None:
        """Adds variables made elsewhere; those that are there already stay where they are.

        Raises:
            RuntimeError: one is an indeterminate, or neither continuous nor binary.
        """
        for v in self._expect_variables("AddDecisionVariables", decision_variables):
            if v.get_id() not in self._places:
                self._append(v)

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

    def AddIndeterminates(self, new_indeterminates: Any) -> None:
        """Adds indeterminates made elsewhere, from an array or `Variables`."""
        given = new_indeterminates
        for v in given if isinstance(given, Variables) else self._expect_variables("AddIndeterminates", given):
            self.AddIndeterminate(v)

    @checked
    def RemoveDecisionVariable(self, var: Variable) -> int:
        """Takes out a variable that no cost or constraint has, and returns the place it had.

        Raises:
            ValueError: it is in use.
            ValueError: it is none of the decision variables.
        """
        place = self._places.get(var.get_id())
        if place is None:
            raise ValueError(f"RemoveDecisionVariable: {var} is not a decision variable of this MathematicalProgram.")
        for binding in self._all_bindings():  # type: ignore[attr-defined]
            if any(v is var for v in binding._variables):
                text = str(binding).rstrip("\n")
                raise ValueError(f"RemoveDecisionVariable: {var} is associated with a {text}.")
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

    def FindDecisionVariableIndices(self, vars: Any) -> list[int]:
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

    def _indices(self, binding: Any) -> np.ndarray:
        """Places of the variables of a binding."""
        return np.array([self._places[v._id] for v in binding._variables], dtype=int)

    def _expect_variables(self, call: str, vars: Any) -> np.ndarray:
        try:
            return _arrays.variable_vector([vars] if isinstance(vars, Variable) else vars)
        except Mismatch:
            raise incompatible(call, ["(vars: numpy.ndarray of Variable)"], (vars,), {}) from None

    def _check_decisions(self, vars: Any) -> None:
        for v in vars:
            if v._id not in self._places:
                raise RuntimeError(f"{v} is not a decision variable of the mathematical program.")

    # Guesses

    def initial_guess(self) -> np.ndarray:
        """Returns the guess of all decision variables, nan where there is none."""
        return np.array(self._guess)

    def GetInitialGuess(self, decision_variable: Any) -> Any:
        """Returns the guess of a variable, or of an array of them in its shape.

        Raises:
            RuntimeError: a variable is no decision variable.
        """
        if isinstance(decision_variable, (Variable, Expression)):
            v = self._expect_variables("GetInitialGuess", np.array([decision_variable], dtype=object))[0]
            return float(self._guess[self.FindDecisionVariableIndex(v)])
        array = np.asarray(decision_variable, dtype=object)
        vars = self._expect_variables("GetInitialGuess", array)
        values = [self._guess[self.FindDecisionVariableIndex(v)] for v in vars]
        return np.array(values, dtype=float).reshape(array.shape, order="F")

    def SetInitialGuess(self, decision_variable: Any, variable_guess: Any) -> None:
        """Sets the guess of a variable, or of an array of them.

        Raises:
            RuntimeError: a variable is no decision variable, or sizes differ.
        """
        for v, value in self._pairs("SetInitialGuess", decision_variable, variable_guess):
            self._guess[self.FindDecisionVariableIndex(v)] = value

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
        self._guess = [float(v) for v in values]

    @overloaded(
        overload(decision_variable=anything, decision_variable_new_value=anything, values=instance_of(np.ndarray)),
        overload(decision_variables=anything, decision_variables_new_values=anything, values=instance_of(np.ndarray)),
    )
    def SetDecisionVariableValueInVector(self, vars: Any, new: Any, values: np.ndarray) -> None:
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

    def _pairs(self, call: str, vars: Any, values: Any) -> list[tuple[Variable, float]]:
        accepted = ["(variable: Variable, value: float)", "(variables: numpy.ndarray, values: numpy.ndarray)"]
        try:
            if isinstance(vars, (Variable, Expression)):
                return [(_arrays.variable_vector(np.array([vars], dtype=object))[0], _arrays.number(values))]
            flat = _arrays.variable_vector(vars)
            if np.ndim(values) == 0:
                raise Mismatch
            floats = np.asarray(values, dtype=float).ravel(order="F")
        except (Mismatch, ValueError, TypeError):
            raise incompatible(call, accepted, (vars, values), {}) from None
        if floats.size != flat.size:
            raise RuntimeError(f"{call}(): {flat.size} variables, but {floats.size} values.")
        return list(zip(flat, map(float, floats)))

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


def _objects(items: list) -> np.ndarray:
    out = np.empty(len(items), dtype=object)
    out[:] = items
    return out


def _filled(shape: tuple[int, ...], make: Callable, add: Callable) -> np.ndarray:
    """New variables, added column after column."""
    out = np.empty(shape, dtype=object)
    for reverse in np.ndindex(*shape[::-1]):
        index = reverse[::-1]
        out[index] = make(*index)
        add(out[index])
    return out
