"""MathematicalProgram: decision variables, costs and constraints.

What people call. What there is to it is in its parts (`parts`), whose calls it shows; a call of a part is declared and
documented there.
"""

from __future__ import annotations

from typing import Any

from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import incompatible, overload, overloaded
from sheldrake.common._parts import Calls
from sheldrake.solvers._functions.evaluators import Cost
from sheldrake.solvers._ids import SolverId, SolverOptions, SolverType, id_of_type, option_value
from sheldrake.solvers._program.bindings import ProgramBindings
from sheldrake.solvers._program.cones import ProgramCones
from sheldrake.solvers._program.constraints import ProgramConstraints
from sheldrake.solvers._program.costs import ProgramCosts
from sheldrake.solvers._program.epigraphs import ProgramEpigraphs
from sheldrake.solvers._program.parts import ProgramParts
from sheldrake.solvers._program.polynomials import NonnegativePolynomial, ProgramPolynomials
from sheldrake.solvers._program.variables import ProgramVariables
from sheldrake.symbolic import ToLatex

_SOLVER = instance_of(SolverId, SolverType)
_variables = Calls(ProgramVariables, "_parts.variables")
_costs = Calls(ProgramCosts, "_parts.costs")
_constraints = Calls(ProgramConstraints, "_parts.constraints")
_cones = Calls(ProgramCones, "_parts.cones")
_epigraphs = Calls(ProgramEpigraphs, "_parts.epigraphs")
_polynomials = Calls(ProgramPolynomials, "_parts.polynomials")
_bindings = Calls(ProgramBindings, "_parts.bindings")


class MathematicalProgram:
    """Decision variables, costs whose sum is to be small, and constraints to be satisfied."""

    NonnegativePolynomial = NonnegativePolynomial

    def __init__(self) -> None:
        variables = ProgramVariables()
        self._parts = ProgramParts(variables, ProgramBindings(variables))
        self._options = SolverOptions()

    # --- Variables

    NewContinuousVariables = _variables(ProgramVariables.NewContinuousVariables)
    NewBinaryVariables = _variables(ProgramVariables.NewBinaryVariables)
    NewIndeterminates = _variables(ProgramVariables.NewIndeterminates)
    NewSymmetricContinuousVariables = _variables(ProgramVariables.NewSymmetricContinuousVariables)
    AddDecisionVariables = _variables(ProgramVariables.AddDecisionVariables)
    AddIndeterminate = _variables(ProgramVariables.AddIndeterminate)
    AddIndeterminates = _variables(ProgramVariables.AddIndeterminates)
    num_vars = _variables(ProgramVariables.num_vars)
    num_indeterminates = _variables(ProgramVariables.num_indeterminates)
    decision_variables = _variables(ProgramVariables.decision_variables)
    decision_variable = _variables(ProgramVariables.decision_variable)
    decision_variable_index = _variables(ProgramVariables.decision_variable_index)
    indeterminates = _variables(ProgramVariables.indeterminates)
    indeterminate = _variables(ProgramVariables.indeterminate)
    indeterminates_index = _variables(ProgramVariables.indeterminates_index)
    FindDecisionVariableIndex = _variables(ProgramVariables.FindDecisionVariableIndex)
    FindDecisionVariableIndices = _variables(ProgramVariables.FindDecisionVariableIndices)
    FindIndeterminateIndex = _variables(ProgramVariables.FindIndeterminateIndex)
    initial_guess = _variables(ProgramVariables.initial_guess)
    GetInitialGuess = _variables(ProgramVariables.GetInitialGuess)
    SetInitialGuess = _variables(ProgramVariables.SetInitialGuess)
    SetInitialGuessForAllVariables = _variables(ProgramVariables.SetInitialGuessForAllVariables)
    SetDecisionVariableValueInVector = _variables(ProgramVariables.SetDecisionVariableValueInVector)
    GetVariableScaling = _variables(ProgramVariables.GetVariableScaling)
    SetVariableScaling = _variables(ProgramVariables.SetVariableScaling)
    ClearVariableScaling = _variables(ProgramVariables.ClearVariableScaling)

    # --- Costs

    AddCost = _costs(ProgramCosts.AddCost)
    AddLinearCost = _costs(ProgramCosts.AddLinearCost)
    AddQuadraticCost = _costs(ProgramCosts.AddQuadraticCost)
    AddQuadraticErrorCost = _costs(ProgramCosts.AddQuadraticErrorCost)
    Add2NormSquaredCost = _costs(ProgramCosts.Add2NormSquaredCost)
    AddL2NormCost = _costs(ProgramCosts.AddL2NormCost)

    # --- Constraints

    AddConstraint = _constraints(ProgramConstraints.AddConstraint)
    AddLinearConstraint = _constraints(ProgramConstraints.AddLinearConstraint)
    AddLinearEqualityConstraint = _constraints(ProgramConstraints.AddLinearEqualityConstraint)
    AddBoundingBoxConstraint = _constraints(ProgramConstraints.AddBoundingBoxConstraint)
    AddQuadraticConstraint = _constraints(ProgramConstraints.AddQuadraticConstraint)
    AddLinearComplementarityConstraint = _constraints(ProgramConstraints.AddLinearComplementarityConstraint)
    AddVisualizationCallback = _constraints(ProgramConstraints.AddVisualizationCallback)

    # --- Cones

    AddLorentzConeConstraint = _cones(ProgramCones.AddLorentzConeConstraint)
    AddRotatedLorentzConeConstraint = _cones(ProgramCones.AddRotatedLorentzConeConstraint)
    AddQuadraticAsRotatedLorentzConeConstraint = _cones(ProgramCones.AddQuadraticAsRotatedLorentzConeConstraint)
    AddExponentialConeConstraint = _cones(ProgramCones.AddExponentialConeConstraint)
    AddPositiveSemidefiniteConstraint = _cones(ProgramCones.AddPositiveSemidefiniteConstraint)
    AddPrincipalSubmatrixIsPsdConstraint = _cones(ProgramCones.AddPrincipalSubmatrixIsPsdConstraint)
    AddLinearMatrixInequalityConstraint = _cones(ProgramCones.AddLinearMatrixInequalityConstraint)
    AddPositiveDiagonallyDominantMatrixConstraint = _cones(ProgramCones.AddPositiveDiagonallyDominantMatrixConstraint)
    AddPositiveDiagonallyDominantDualConeMatrixConstraint = _cones(
        ProgramCones.AddPositiveDiagonallyDominantDualConeMatrixConstraint
    )
    AddScaledDiagonallyDominantMatrixConstraint = _cones(ProgramCones.AddScaledDiagonallyDominantMatrixConstraint)
    AddScaledDiagonallyDominantDualConeMatrixConstraint = _cones(
        ProgramCones.AddScaledDiagonallyDominantDualConeMatrixConstraint
    )
    TightenPsdConstraintToDd = _cones(ProgramCones.TightenPsdConstraintToDd)
    TightenPsdConstraintToSdd = _cones(ProgramCones.TightenPsdConstraintToSdd)
    RelaxPsdConstraintToDdDualCone = _cones(ProgramCones.RelaxPsdConstraintToDdDualCone)
    RelaxPsdConstraintToSddDualCone = _cones(ProgramCones.RelaxPsdConstraintToSddDualCone)

    # --- Costs and constraints with new variables and cones

    AddL2NormCostUsingConicConstraint = _epigraphs(ProgramEpigraphs.AddL2NormCostUsingConicConstraint)
    AddL1NormCostInEpigraphForm = _epigraphs(ProgramEpigraphs.AddL1NormCostInEpigraphForm)
    AddMaximizeLogDeterminantCost = _epigraphs(ProgramEpigraphs.AddMaximizeLogDeterminantCost)
    AddLogDeterminantLowerBoundConstraint = _epigraphs(ProgramEpigraphs.AddLogDeterminantLowerBoundConstraint)
    AddMaximizeGeometricMeanCost = _epigraphs(ProgramEpigraphs.AddMaximizeGeometricMeanCost)

    # --- Polynomials

    MakePolynomial = _polynomials(ProgramPolynomials.MakePolynomial)
    Reparse = _polynomials(ProgramPolynomials.Reparse)
    NewFreePolynomial = _polynomials(ProgramPolynomials.NewFreePolynomial)
    NewEvenDegreeFreePolynomial = _polynomials(ProgramPolynomials.NewEvenDegreeFreePolynomial)
    NewOddDegreeFreePolynomial = _polynomials(ProgramPolynomials.NewOddDegreeFreePolynomial)
    NewSosPolynomial = _polynomials(ProgramPolynomials.NewSosPolynomial)
    NewEvenDegreeNonnegativePolynomial = _polynomials(ProgramPolynomials.NewEvenDegreeNonnegativePolynomial)
    NewEvenDegreeSosPolynomial = _polynomials(ProgramPolynomials.NewEvenDegreeSosPolynomial)
    NewEvenDegreeSdsosPolynomial = _polynomials(ProgramPolynomials.NewEvenDegreeSdsosPolynomial)
    NewEvenDegreeDsosPolynomial = _polynomials(ProgramPolynomials.NewEvenDegreeDsosPolynomial)
    AddSosConstraint = _polynomials(ProgramPolynomials.AddSosConstraint)
    AddEqualityConstraintBetweenPolynomials = _polynomials(ProgramPolynomials.AddEqualityConstraintBetweenPolynomials)

    # --- What there is, and values of it

    generic_costs = _bindings(ProgramBindings.generic_costs)
    linear_costs = _bindings(ProgramBindings.linear_costs)
    quadratic_costs = _bindings(ProgramBindings.quadratic_costs)
    l2norm_costs = _bindings(ProgramBindings.l2norm_costs)
    generic_constraints = _bindings(ProgramBindings.generic_constraints)
    quadratic_constraints = _bindings(ProgramBindings.quadratic_constraints)
    linear_constraints = _bindings(ProgramBindings.linear_constraints)
    linear_equality_constraints = _bindings(ProgramBindings.linear_equality_constraints)
    bounding_box_constraints = _bindings(ProgramBindings.bounding_box_constraints)
    lorentz_cone_constraints = _bindings(ProgramBindings.lorentz_cone_constraints)
    rotated_lorentz_cone_constraints = _bindings(ProgramBindings.rotated_lorentz_cone_constraints)
    linear_matrix_inequality_constraints = _bindings(ProgramBindings.linear_matrix_inequality_constraints)
    positive_semidefinite_constraints = _bindings(ProgramBindings.positive_semidefinite_constraints)
    linear_complementarity_constraints = _bindings(ProgramBindings.linear_complementarity_constraints)
    exponential_cone_constraints = _bindings(ProgramBindings.exponential_cone_constraints)
    visualization_callbacks = _bindings(ProgramBindings.visualization_callbacks)
    GetAllCosts = _bindings(ProgramBindings.GetAllCosts)
    GetAllConstraints = _bindings(ProgramBindings.GetAllConstraints)
    GetLinearConstraints = _bindings(ProgramBindings.GetLinearConstraints)
    required_capabilities = _bindings(ProgramBindings.required_capabilities)
    IsThreadSafe = _bindings(ProgramBindings.IsThreadSafe)
    RemoveDecisionVariable = _bindings(ProgramBindings.RemoveDecisionVariable)
    RemoveCost = _bindings(ProgramBindings.RemoveCost)
    RemoveConstraint = _bindings(ProgramBindings.RemoveConstraint)
    RemoveVisualizationCallback = _bindings(ProgramBindings.RemoveVisualizationCallback)
    GetBindingVariableValues = _bindings(ProgramBindings.GetBindingVariableValues)
    EvalBinding = _bindings(ProgramBindings.EvalBinding)
    EvalBindings = _bindings(ProgramBindings.EvalBindings)
    EvalBindingVectorized = _bindings(ProgramBindings.EvalBindingVectorized)
    EvalBindingAtInitialGuess = _bindings(ProgramBindings.EvalBindingAtInitialGuess)
    CheckSatisfied = _bindings(ProgramBindings.CheckSatisfied)
    CheckSatisfiedAtInitialGuess = _bindings(ProgramBindings.CheckSatisfiedAtInitialGuess)

    # --- Options

    @overloaded(overload(solver_id=_SOLVER, solver_option=instance_of(str), option_value=option_value))
    def SetSolverOption(self, solver: SolverId | SolverType, name: str, value: float | int | str) -> None:
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

    # --- Copies and text

    def Clone(self) -> MathematicalProgram:
        """Returns a program with the same variables and the same evaluators, and lists of its own."""
        out = MathematicalProgram()
        out._parts = self._parts.copy()
        out._options = SolverOptions(self._options.options)
        return out

    def __copy__(self) -> MathematicalProgram:
        return self.Clone()

    def __deepcopy__(self, memo: dict[int, Any]) -> MathematicalProgram:
        return self.Clone()

    def __str__(self) -> str:
        out = "" if self.num_vars() else "No decision variables.\n"
        for title, vars in (
            ("Decision variables:", self.decision_variables()),
            ("Indeterminates:", self.indeterminates()),
        ):
            if len(vars):
                width = max(len(str(v)) for v in vars)
                out += f"{title} {' '.join(str(v).rjust(width) for v in vars)}\n\n"
        for binding in (*self.GetAllCosts(), *self.GetAllConstraints()):
            text = str(binding)
            out += text if text.endswith("\n") and not isinstance(binding.evaluator(), Cost) else text + "\n"
        return out

    def ToLatex(self, precision: int = 3) -> str:
        r"""Returns LaTeX for the whole program, an `align*` environment."""
        costs = [b.ToLatex(precision) for b in self.GetAllCosts()]
        constraints = [b.ToLatex(precision) for b in self.GetAllConstraints()]
        if not self.num_vars():
            return r"\text{This MathematicalProgram has no decision variables.}"
        out = "\\begin{align*}\n"
        names = ", ".join(ToLatex(v, precision) for v in self.decision_variables())
        out += rf"\min_{{{names}}} \quad & " if costs else rf"\text{{find}}_{{{names}}} \quad & "
        out += "\\\\\n &  + ".join(costs)
        for i, text in enumerate(constraints):
            if i == 0:
                out += "\\\\\n " + r"\text{subject to}\quad & " + text
            else:
                out += ",\\\\\n & " + text
        return out + (".\\\\\n" if constraints else "\n") + "\\end{align*}\n"
