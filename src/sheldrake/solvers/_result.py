"""What a solver found.

Values by variable, cost, duals by constraint, and the solver's own details.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, overload

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch, incompatible
from sheldrake.solvers import _arrays
from sheldrake.solvers._functions.bindings import BindingBase, as_kind
from sheldrake.solvers._functions.evaluators import Constraint
from sheldrake.solvers._ids import SolutionResult, SolverId
from sheldrake.solvers._program.parts import parts_of
from sheldrake.symbolic import Expression, Polynomial, Variable
from sheldrake.symbolic import _build as build
from sheldrake.symbolic import _traverse as traverse

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from numpy.typing import ArrayLike

    from sheldrake.common._types import Symbolic
    from sheldrake.solvers import Binding
    from sheldrake.solvers._program.program import MathematicalProgram


_ONLY_VARIABLES = {Variable}


class MathematicalProgramResult:
    """Values of decision variables, the cost, duals, and how the solver ended."""

    def __init__(self) -> None:
        self._set([], {}, "")
        self._x = np.zeros(0)

    def _set(self, variables: list[Variable], places: dict[int, int], solver: str) -> None:
        self._variables, self._places, self._solver = variables, places, solver
        self._cost, self._result = np.nan, SolutionResult.kSolutionResultNotSet
        self._details: Any = None
        self._late_details: Callable[[], Any] | None = None
        self._duals: dict[tuple, np.ndarray] = {}
        self._late_duals: Callable[[], Iterable[tuple[BindingBase, ArrayLike]]] | None = None
        self._more: list[tuple[np.ndarray, float]] = []

    def _start(self, prog: MathematicalProgram, solver: str) -> None:
        """Empties it for the variables of a program, and the name of a solver, which is to `_finish` it."""
        variables, places, _ = parts_of(prog).variables.decisions()
        self._set(variables, places, solver)

    def _finish(self, result: SolutionResult, x: ArrayLike | None, cost: float) -> None:
        """Says how the solve ended; without a feasible point the cost is inf, if unbounded -inf."""
        self._result = result
        self._x = np.full(len(self._variables), np.nan) if x is None else np.array(x, dtype=float)
        self._cost = float(cost)
        if result is SolutionResult.kInfeasibleConstraints:
            self._cost = np.inf
        elif result in (SolutionResult.kUnbounded, SolutionResult.kDualInfeasible):
            self._cost = -np.inf

    def _set_dual(self, binding: BindingBase, dual: ArrayLike) -> None:
        self._duals[binding._identity()] = np.atleast_1d(np.asarray(dual, dtype=float))

    def _set_duals_late(self, duals: Callable[[], Iterable[tuple[BindingBase, ArrayLike]]]) -> None:
        """Duals that are computed when somebody asks for one."""
        self._late_duals = duals

    def _set_details_late(self, details: Callable[[], Any]) -> None:
        """What the solver tells, made when somebody asks."""
        self._late_details = details

    def _all_duals(self) -> dict[tuple, np.ndarray]:
        if self._late_duals is not None:
            for binding, dual in self._late_duals():
                self._set_dual(binding, dual)
            self._late_duals = None
        return self._duals

    def __getstate__(self) -> dict[str, Any]:
        self._all_duals()  # what computes them belongs to the program
        if self._late_details is not None:
            self.get_solver_details()
        return self.__dict__

    # How it ended

    def is_success(self) -> bool:
        """Tells whether a solution was found."""
        return self._result is SolutionResult.kSolutionFound

    def get_solution_result(self) -> SolutionResult:
        """Returns how the solve ended."""
        return self._result

    @checked
    def set_solution_result(self, arg0: SolutionResult) -> None:
        """Says how the solve ended."""
        self._result = arg0

    def get_solver_id(self) -> SolverId:
        """Returns the name of what found the solution, be it asked for by another name: of `ClpSolver` "Simplex".

        `Solve` itself does small quadratic programs, as "Active set".
        """
        return SolverId(self._solver)

    def get_solver_details(self) -> Any:
        """Returns what this solver tells beyond the solution.

        Raises:
            RuntimeError: it tells nothing.
        """
        if self._late_details is not None:
            self._details, self._late_details = self._late_details(), None
        if self._details is None:
            raise RuntimeError("The solver_details has not been set yet.")
        return self._details

    def get_optimal_cost(self) -> float:
        """Returns the cost at the solution."""
        return self._cost

    # Values

    def get_x_val(self) -> np.ndarray:
        """Returns the values of all decision variables, shape `(num_vars,)`."""
        return self._x.copy()

    @checked
    def set_x_val(self, x_val: ArrayLike) -> None:
        """Sets the values of all decision variables.

        Raises:
            ValueError: the size is another.
        """
        values = np.asarray(x_val, dtype=float).ravel()
        if values.size != len(self._variables):
            raise ValueError(
                f"MathematicalProgramResult::set_x_val, the dimension of x_val is {values.size}, expected "
                f"{len(self._variables)}"
            )
        self._x = values.copy()

    @checked
    def SetSolution(self, var: Variable, value: float) -> None:
        """Sets the value of one decision variable."""
        self._x[self._place(var)] = value

    def _place(self, var: Variable) -> int:
        place = self._places.get(var._id)
        if place is None:
            raise ValueError(f"GetVariableValue: {var} is not captured by the variable_index map.")
        return place

    @overload
    def GetSolution(self) -> np.ndarray: ...
    @overload
    def GetSolution(self, var: Variable, /) -> float: ...
    @overload
    def GetSolution(self, e: Expression, /) -> Expression: ...
    @overload
    def GetSolution(self, p: Polynomial, /) -> Polynomial: ...
    @overload
    def GetSolution(self, array: np.ndarray | Sequence[Symbolic], /) -> np.ndarray: ...
    def GetSolution(self, *args: Any) -> float | np.ndarray | Expression | Polynomial:
        """Returns values at the solution.

        Called with nothing, a variable or an array of them it returns floats; with an expression, an array of
        expressions or a polynomial it returns the same with values in the place of the decision variables.

        Raises:
            ValueError: a variable is no decision variable; or an indeterminate of the polynomial is one.
        """
        if not args:
            return self.get_x_val()
        return self._values(args[0], self._x, "GetSolution")

    def _values(
        self, what: Expression | Callable[..., Any] | Binding, x: np.ndarray, call: str
    ) -> float | np.ndarray | Expression | Polynomial:
        if isinstance(what, Variable):
            return float(x[self._place(what)])
        if isinstance(what, Polynomial):
            return self._polynomial(what, x)
        if isinstance(what, Expression):
            return self._substituted([what], x)[0]
        try:
            array = np.asarray(what, dtype=object)
        except ValueError:
            array = np.empty(0)
        items = array.ravel().tolist()
        if array.ndim and _ONLY_VARIABLES.issuperset(map(type, items)):
            try:
                places = [self._places[v._id] for v in items]
            except KeyError:
                places = [self._place(v) for v in items]  # says which is none
            return x[np.array(places, dtype=int)].reshape(array.shape)
        try:
            es = _arrays.expression_array(array)
        except Mismatch:
            accepted = ["()", "(Variable)", "(Expression)", "(Polynomial)", "(numpy.ndarray of one of these)"]
            raise incompatible(call, accepted, (what,), {}) from None
        es = es.reshape(-1, 1) if es.ndim == 1 else es
        return traverse.object_array(self._substituted(list(es.flat), x), es.shape)

    def _env(self, x: np.ndarray) -> dict[Variable, float]:
        return dict(zip(self._variables, x.tolist()))

    def _substituted(self, es: list[Expression], x: np.ndarray) -> list[Expression]:
        return traverse.substitute(es, {v: build.constant(value) for v, value in self._env(x).items()})

    def _polynomial(self, p: Polynomial, x: np.ndarray) -> Polynomial:
        for v in p.indeterminates():
            if v.get_id() in self._places:
                raise ValueError(
                    f"GetSolution: {v} is an indeterminate in the polynomial, but result stores its value as a "
                    "decision variable."
                )
        found = p.monomial_to_coefficient_map()
        return Polynomial(dict(zip(found, self._substituted(list(found.values()), x))))

    @checked
    def EvalBinding(self, arg0: BindingBase) -> np.ndarray:
        """Returns the value of a cost or constraint at the solution."""
        return arg0._evaluator.Eval(np.array([self._x[self._place(v)] for v in arg0._variables], dtype=float))

    @checked
    def GetDualSolution(self, constraint: BindingBase) -> np.ndarray:
        """Returns the dual variables of a constraint.

        For `lower <= f(x) <= upper` these are the derivatives of the optimal cost by the active bounds; for cones, a
        point of the dual cone.

        Raises:
            ValueError: the solver gave none for it.
        """
        found = self._all_duals().get(constraint._identity())
        if found is None:
            raise ValueError(
                "Either this constraint does not belong to the mathematical program for which the result is obtained, "
                f"or {self._solver} does not currently support getting dual solution yet."
            )
        return found.copy()

    # Other solutions

    def num_suboptimal_solution(self) -> int:
        """Returns how many other solutions there are."""
        return len(self._more)

    def get_suboptimal_objective(self, solution_number: int) -> float:
        """Returns the cost of one of the other solutions."""
        return self._more[solution_number][1]

    @checked
    def GetSuboptimalSolution(self, arg0: Any, arg1: int) -> Any:
        """Returns values at one of the other solutions."""
        return self._values(arg0, self._more[arg1][0], "GetSuboptimalSolution")

    # What is not satisfied

    @checked
    def GetInfeasibleConstraints(self, prog: MathematicalProgram, tol: float | None = None) -> list:
        """Returns the constraints of a program that the values do not satisfy.

        Args:
            prog: The program that was solved.
            tol: Largest violation that counts as none; 1e-6 if absent.
        """
        tol = 1e-6 if tol is None else tol
        return [
            as_kind(Constraint, b)
            for b in prog.GetAllConstraints()
            if not b._evaluator.CheckSatisfied(prog.GetBindingVariableValues(b, self._x), tol)
        ]

    @checked
    def GetInfeasibleConstraintNames(self, prog: MathematicalProgram, tol: float | None = None) -> list[str]:
        """Returns a line for each row of a constraint that the values do not satisfy."""
        tol = 1e-6 if tol is None else tol
        out = []
        for b in self.GetInfeasibleConstraints(prog, tol):
            c = b._evaluator
            name = c.get_description() or type(c).__name__
            values = self.EvalBinding(b)
            for i, (y, low, high) in enumerate(zip(values, c.lower_bound(), c.upper_bound())):
                if y < low - tol or y > high + tol or np.isnan(y):
                    out.append(f"{name}[{i}]: {low:f} <= {y:f} <= {high:f}")
        return out
