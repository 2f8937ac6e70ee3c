"""MathematicalProgram: decision variables, costs and constraints."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import anything, instance_of
from sheldrake.common._names import name_parts_after
from sheldrake.common._overloads import expect, incompatible, overload, overloaded
from sheldrake.solvers import _kinds as kinds
from sheldrake.solvers._functions.bindings import BindingBase, as_kind
from sheldrake.solvers._functions.constraints import LinearConstraint
from sheldrake.solvers._functions.costs import Cost
from sheldrake.solvers._functions.evaluators import Constraint
from sheldrake.solvers._ids import ProgramAttribute, SolverId, SolverOptions, SolverType, id_of_type, option_value
from sheldrake.solvers._program.cones import ProgramCones
from sheldrake.solvers._program.constraints import ProgramConstraints
from sheldrake.solvers._program.costs import ProgramCosts
from sheldrake.solvers._program.polynomials import ProgramPolynomials
from sheldrake.solvers._program.variables import ProgramVariables
from sheldrake.symbolic import ToLatex, Variable

_SOLVER = instance_of(SolverId, SolverType)
_COSTS = ("generic_costs", "linear_costs", "quadratic_costs", "l2norm_costs")
_CONSTRAINTS = (
    "generic_constraints",
    "quadratic_constraints",
    "linear_constraints",
    "linear_equality_constraints",
    "bounding_box_constraints",
    "lorentz_cone_constraints",
    "rotated_lorentz_cone_constraints",
    "linear_matrix_inequality_constraints",
    "positive_semidefinite_constraints",
    "linear_complementarity_constraints",
    "exponential_cone_constraints",
)
_A = ProgramAttribute
_ATTRIBUTES = {
    "generic_costs": _A.kGenericCost,
    "linear_costs": _A.kLinearCost,
    "quadratic_costs": _A.kQuadraticCost,
    "l2norm_costs": _A.kL2NormCost,
    "generic_constraints": _A.kGenericConstraint,
    "quadratic_constraints": _A.kQuadraticConstraint,
    "linear_constraints": _A.kLinearConstraint,
    "linear_equality_constraints": _A.kLinearEqualityConstraint,
    "bounding_box_constraints": _A.kLinearConstraint,
    "lorentz_cone_constraints": _A.kLorentzConeConstraint,
    "rotated_lorentz_cone_constraints": _A.kRotatedLorentzConeConstraint,
    "linear_matrix_inequality_constraints": _A.kPositiveSemidefiniteConstraint,
    "positive_semidefinite_constraints": _A.kPositiveSemidefiniteConstraint,
    "linear_complementarity_constraints": _A.kLinearComplementarityConstraint,
    "exponential_cone_constraints": _A.kExponentialConeConstraint,
    "visualization_callbacks": _A.kCallback,
}


def _list_getter(name: str) -> Any:
    def getter(self: Any) -> list:
        return list(self._lists[name])

    getter.__name__ = name
    getter.__doc__ = f"Returns the bindings of the {name.replace('_', ' ')}, in the order they were added."
    return getter


class MathematicalProgram(ProgramVariables, ProgramCosts, ProgramConstraints, ProgramCones, ProgramPolynomials):
    """Decision variables, costs whose sum is to be small, and constraints to be satisfied."""

    def __init__(self) -> None:
        self._decisions, self._places, self._guess = [], {}, []
        self._indeterminates, self._indeterminate_places = [], {}
        self._scaling = {}
        self._lists = {name: [] for name in _ATTRIBUTES}
        self._options = SolverOptions()

    # What there is

    def _all_bindings(self) -> list[BindingBase]:
        return [b for bindings in self._lists.values() for b in bindings]

    def GetAllCosts(self) -> list:
        """Returns the bindings of all costs."""
        return [as_kind(Cost, b) for name in _COSTS for b in self._lists[name]]

    def GetAllConstraints(self) -> list:
        """Returns the bindings of all constraints."""
        return [as_kind(Constraint, b) for name in _CONSTRAINTS for b in self._lists[name]]

    def GetLinearConstraints(self) -> list:
        """Returns the bindings of linear constraints, then of linear equalities; bounding boxes do not count."""
        names = ("linear_constraints", "linear_equality_constraints")
        return [as_kind(LinearConstraint, b) for name in names for b in self._lists[name]]

    def required_capabilities(self) -> set[ProgramAttribute]:
        """Returns what a solver must know how to handle."""
        found = {_ATTRIBUTES[name] for name, bindings in self._lists.items() if bindings}
        if any(v.get_type() is Variable.Type.BINARY for v in self._decisions):
            found.add(_A.kBinaryVariable)
        return found

    def IsThreadSafe(self) -> bool:
        """Tells whether several threads may evaluate it at once; not with Python functions."""
        return all(b._evaluator.is_thread_safe() for b in self._all_bindings())

    # Values

    @checked
    def GetBindingVariableValues(self, binding: BindingBase, prog_var_vals: Any) -> np.ndarray:
        """Returns the values of the variables of a binding from those of all decision variables.

        Raises:
            RuntimeError: the number of values is another than that of decision variables, or a variable is none.
        """
        values = np.asarray(prog_var_vals)
        if values.ndim == 2 and 1 in values.shape:
            values = values.ravel()
        if values.shape != (self.num_vars(),):
            raise RuntimeError(
                f"GetBindingVariableValues(): expected {self.num_vars()} values of decision variables, got shape "
                f"{values.shape}."
            )
        return values[[self.FindDecisionVariableIndex(v) for v in binding._variables]]

    def EvalBinding(self, binding: BindingBase, prog_var_vals: Any) -> np.ndarray:
        """Returns the value of a cost or constraint for values of all decision variables."""
        return expect("EvalBinding", binding, BindingBase)._evaluator.Eval(
            self.GetBindingVariableValues(binding, prog_var_vals)
        )

    def EvalBindings(self, bindings: Any, prog_var_vals: Any) -> np.ndarray:
        """Returns the values of several, one after the other."""
        found = [self.EvalBinding(b, prog_var_vals) for b in bindings]
        return np.concatenate(found) if found else np.zeros(0)

    def EvalBindingVectorized(self, binding: BindingBase, prog_var_vals: Any) -> np.ndarray:
        """Returns the values as columns for values of all decision variables as columns."""
        return np.stack([self.EvalBinding(binding, c) for c in np.asarray(prog_var_vals, dtype=float).T], axis=1)

    def EvalBindingAtInitialGuess(self, binding: BindingBase) -> np.ndarray:
        """Returns the value at the initial guess."""
        return self.EvalBinding(binding, self.initial_guess())

    @overloaded(
        overload(binding=kinds.binding, prog_var_vals=anything, tol=(kinds.number, 1e-6)),
        overload(bindings=anything, prog_var_vals=anything, tol=(kinds.number, 1e-6)),
    )
    def CheckSatisfied(self, bindings: Any, values: Any, tol: float) -> bool:
        """Tells whether one or several constraints are satisfied; called as `(binding(s), prog_var_vals, tol=1e-6)`."""
        bindings = [bindings] if isinstance(bindings, BindingBase) else bindings
        return all(bool(b._evaluator.CheckSatisfied(self.GetBindingVariableValues(b, values), tol)) for b in bindings)

    @overloaded(
        overload(binding=kinds.binding, tol=(kinds.number, 1e-6)),
        overload(bindings=anything, tol=(kinds.number, 1e-6)),
    )
    def CheckSatisfiedAtInitialGuess(self, bindings: Any, tol: float) -> bool:
        """Tells whether one or several constraints are satisfied at the guess; called as `(binding(s), tol=1e-6)`."""
        return self.CheckSatisfied(bindings, self.initial_guess(), tol)

    # Options

    @overloaded(overload(solver_id=_SOLVER, solver_option=instance_of(str), option_value=option_value))
    def SetSolverOption(self, solver: SolverId | SolverType, name: str, value: Any) -> None:
        """Sets an option of one solver; called as `(solver_id or SolverType, name, value)`."""
        self._options.SetOption(solver if isinstance(solver, SolverId) else id_of_type(solver), name, value)

    def SetSolverOptions(self, arg0: SolverOptions) -> None:
        """Replaces all options."""
        if not isinstance(arg0, SolverOptions):
            raise incompatible("SetSolverOptions", ["(arg0: SolverOptions)"], (arg0,), {})
        self._options = SolverOptions(arg0.options)

    def solver_options(self) -> SolverOptions:
        """Returns the options that solvers start from."""
        return self._options

    # Copies and text

    def Clone(self) -> MathematicalProgram:
        """Returns a program with the same variables and the same evaluators, and lists of its own."""
        out = MathematicalProgram()
        out._decisions, out._places, out._guess = list(self._decisions), dict(self._places), list(self._guess)
        out._indeterminates = list(self._indeterminates)
        out._indeterminate_places = dict(self._indeterminate_places)
        out._scaling = dict(self._scaling)
        out._lists = {name: list(bindings) for name, bindings in self._lists.items()}
        out._options = SolverOptions(self._options.options)
        return out

    def __copy__(self) -> MathematicalProgram:
        return self.Clone()

    def __deepcopy__(self, memo: dict) -> MathematicalProgram:
        return self.Clone()

    def __str__(self) -> str:
        out = ""
        for title, vars in (("Decision variables:", self._decisions), ("Indeterminates:", self._indeterminates)):
            if vars:
                width = max(len(str(v)) for v in vars)
                out += f"{title} {' '.join(str(v).rjust(width) for v in vars)}\n\n"
        for binding in (*self.GetAllCosts(), *self.GetAllConstraints()):
            text = str(binding)
            out += text if text.endswith("\n") and not isinstance(binding._evaluator, Cost) else text + "\n"
        return out

    def ToLatex(self, precision: int = 3) -> str:
        r"""Returns LaTeX for the whole program, an `align*` environment."""
        costs = [b.ToLatex(precision) for b in self.GetAllCosts()]
        constraints = [b.ToLatex(precision) for b in self.GetAllConstraints()]
        if not self._decisions:
            return r"\text{This MathematicalProgram has no decision variables.}"
        out = "\\begin{align*}\n"
        names = ", ".join(ToLatex(v, precision) for v in self._decisions)
        out += rf"\min_{{{names}}} \quad & " if costs else rf"\text{{find}}_{{{names}}} \quad & "
        out += "\\\\\n &  + ".join(costs)
        for i, text in enumerate(constraints):
            if i == 0:
                out += "\\\\\n " + r"\text{subject to}\quad & " + text
            else:
                out += ",\\\\\n & " + text
        return out + (".\\\\\n" if constraints else "\n") + "\\end{align*}\n"


for _name in (*_COSTS, *_CONSTRAINTS, "visualization_callbacks"):
    setattr(MathematicalProgram, _name, _list_getter(_name))


name_parts_after(MathematicalProgram, object)
