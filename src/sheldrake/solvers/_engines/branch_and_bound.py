"""Programs with binary variables by branch and bound (Land and Doig, 1960)."""

from __future__ import annotations

import heapq
import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.solvers._engines.choose import MakeSolver
from sheldrake.solvers._functions.bindings import BindingBase
from sheldrake.solvers._ids import SolutionResult, SolverId
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.solvers._result import MathematicalProgramResult
from sheldrake.symbolic import Variable

if TYPE_CHECKING:
    from sheldrake.solvers._arrays import VariablesLike

_INTEGRAL = 1e-5  # So far from 0 or 1 a binary variable may be.


@checked
class MixedIntegerBranchAndBound:
    """Solves a program with binary variables by programs in which they are between 0 and 1, some of them fixed.

    Args:
        prog: The program.
        solver_id: Who solves the programs without binary variables.
        options: Limits.

    Raises:
        RuntimeError: there is no binary variable.
    """

    class Options:
        """Limits of branch and bound.

        Args:
            max_explored_nodes: Most programs that are solved; no limit if not positive.
        """

        def __init__(self, max_explored_nodes: int = -1):
            self.max_explored_nodes = max_explored_nodes

        def __repr__(self) -> str:
            return f"Options(max_explored_nodes={self.max_explored_nodes})"

    def __init__(self, prog: MathematicalProgram, solver_id: SolverId, options: Options | None = None):
        binary = [i for i, v in enumerate(prog.decision_variables()) if v.get_type() is Variable.Type.BINARY]
        if not binary:
            raise RuntimeError("No binary variable found in the optimization program.\n")
        self._original, self._binary = prog, binary
        self._solver = MakeSolver(solver_id)
        self._options = self.Options() if options is None else options
        self._relaxed = _relaxation(prog)
        self._found: list[tuple[float, np.ndarray]] = []

    def Solve(self) -> SolutionResult:
        """Solves the program."""
        self._found, count = [], itertools.count()
        root = self._node({})
        if root.get_solution_result() is not SolutionResult.kSolutionFound:
            return root.get_solution_result()
        queue: list[tuple[float, int, dict[int, float], np.ndarray]] = []
        if not self._keep_if_integral(root):
            heapq.heappush(queue, (root.get_optimal_cost(), next(count), {}, root.get_x_val()))
        explored = 1
        while queue:
            bound, _, fixed, x = heapq.heappop(queue)
            if self._found and bound >= self._found[0][0] - 1e-9 * max(1.0, abs(bound)):
                break
            doubtful = self._most_doubtful(x)
            if 0 < self._options.max_explored_nodes <= explored:
                return SolutionResult.kIterationLimit
            for value in (0.0, 1.0):
                child = self._node({**fixed, doubtful: value})
                explored += 1
                if child.is_success() and not self._keep_if_integral(child):
                    entry = (child.get_optimal_cost(), next(count), {**fixed, doubtful: value}, child.get_x_val())
                    heapq.heappush(queue, entry)
        return SolutionResult.kSolutionFound if self._found else SolutionResult.kInfeasibleConstraints

    def _node(self, fixed: dict[int, float]) -> MathematicalProgramResult:
        prog = self._relaxed.Clone()
        if fixed:
            vars = prog.decision_variables()[list(fixed)]
            prog.AddBoundingBoxConstraint(list(fixed.values()), list(fixed.values()), vars)
        return self._solver.Solve(prog)

    def _most_doubtful(self, x: np.ndarray) -> int:
        """The binary variable that is farthest from being 0 or 1."""
        return max(self._binary, key=lambda i: min(x[i], 1.0 - x[i]))

    def _keep_if_integral(self, relaxed: MathematicalProgramResult) -> bool:
        """Keeps a solution whose binary variables are 0 or 1, be it the best one or not; tells whether it is one."""
        x = relaxed.get_x_val()
        doubtful = self._most_doubtful(x)
        if min(x[doubtful], 1.0 - x[doubtful]) > _INTEGRAL:
            return False
        x[self._binary] = np.round(x[self._binary])
        self._found.append((relaxed.get_optimal_cost(), x))
        self._found.sort(key=lambda item: item[0])
        return True

    def GetOptimalCost(self) -> float:
        """Returns the least cost.

        Raises:
            RuntimeError: nothing was found.
        """
        if not self._found:
            raise RuntimeError("The branch-and-bound process did not find an optimal solution.")
        return self._found[0][0]

    def GetSubOptimalCost(self, nth_suboptimal_cost: int) -> float:
        """Returns the cost of another solution, the next best first.

        Raises:
            RuntimeError: there is none of that number.
        """
        if not 0 <= nth_suboptimal_cost < len(self._found) - 1:
            raise RuntimeError(
                f"Cannot access {nth_suboptimal_cost}'th sub-optimal cost. The branch-and-bound process only found "
                f"{len(self._found)} solution(s)."
            )
        return self._found[nth_suboptimal_cost + 1][0]

    def GetSolution(
        self,
        mip_var: Variable | VariablesLike | None = None,
        nth_best_solution: int = 0,
        *,
        mip_vars: VariablesLike | None = None,
    ) -> Any:
        """Returns the value of a variable, or of an array of them, in one of the solutions.

        Raises:
            RuntimeError: there is no solution of that number, or a variable is none of the program.
        """
        what = mip_var if mip_vars is None else mip_vars
        if not 0 <= nth_best_solution < len(self._found):
            raise RuntimeError(
                f"Cannot access {nth_best_solution}'th integral solution. The branch-and-bound process only found "
                f"{len(self._found)} solution(s)."
            )
        x = self._found[nth_best_solution][1]
        if isinstance(what, Variable):
            return float(x[self._original.FindDecisionVariableIndex(what)])
        array = np.asarray(what, dtype=object)
        values = [x[self._original.FindDecisionVariableIndex(v)] for v in array.flat]
        return np.array(values, dtype=float).reshape(array.shape)


def _relaxation(prog: MathematicalProgram) -> MathematicalProgram:
    """The program with continuous variables in the place of binary ones, which are between 0 and 1."""
    out = MathematicalProgram()
    places: dict[int, Variable] = {}
    relaxed = []
    for v in prog.decision_variables():
        new = v
        if v.get_type() is Variable.Type.BINARY:
            new = Variable(v.get_name())
            relaxed.append(new)
        places[v.get_id()] = new
        out.AddDecisionVariables([new])

    def on_places(binding: BindingBase) -> np.ndarray:
        return np.array([places[v.get_id()] for v in binding._variables], dtype=object)

    for cost in prog.GetAllCosts():
        out.AddCost(cost._evaluator, on_places(cost))
    for constraint in prog.GetAllConstraints():
        out.AddConstraint(constraint._evaluator, on_places(constraint))
    out.AddBoundingBoxConstraint(0.0, 1.0, np.array(relaxed, dtype=object))
    out.SetInitialGuessForAllVariables(prog.initial_guess())
    return out
