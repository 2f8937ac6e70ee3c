"""MathematicalProgram: decision variables, costs and constraints.

What people call. What there is to it is in its parts (`parts`), whose calls it shows; a call of a part is declared and
documented there.
"""

from __future__ import annotations

from sheldrake.common._copies import Cloned
from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import incompatible, overload, overloaded
from sheldrake.common._parts import Call, part
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
_variables = part(ProgramVariables, "_parts.variables")
_costs = part(ProgramCosts, "_parts.costs")
_constraints = part(ProgramConstraints, "_parts.constraints")
_cones = part(ProgramCones, "_parts.cones")
_epigraphs = part(ProgramEpigraphs, "_parts.epigraphs")
_polynomials = part(ProgramPolynomials, "_parts.polynomials")
_bindings = part(ProgramBindings, "_parts.bindings")


class MathematicalProgram(Cloned):
    """Decision variables, costs whose sum is to be small, and constraints to be satisfied."""

    NonnegativePolynomial = NonnegativePolynomial

    def __init__(self) -> None:
        variables = ProgramVariables()
        self._parts = ProgramParts(variables, ProgramBindings(variables))
        self._options = SolverOptions()

    # --- Variables

    NewContinuousVariables = Call(_variables.NewContinuousVariables)
    NewBinaryVariables = Call(_variables.NewBinaryVariables)
    NewIndeterminates = Call(_variables.NewIndeterminates)
    NewSymmetricContinuousVariables = Call(_variables.NewSymmetricContinuousVariables)
    AddDecisionVariables = Call(_variables.AddDecisionVariables)
    AddIndeterminate = Call(_variables.AddIndeterminate)
    AddIndeterminates = Call(_variables.AddIndeterminates)
    num_vars = Call(_variables.num_vars)
    num_indeterminates = Call(_variables.num_indeterminates)
    decision_variables = Call(_variables.decision_variables)
    decision_variable = Call(_variables.decision_variable)
    decision_variable_index = Call(_variables.decision_variable_index)
    indeterminates = Call(_variables.indeterminates)
    indeterminate = Call(_variables.indeterminate)
    indeterminates_index = Call(_variables.indeterminates_index)
    FindDecisionVariableIndex = Call(_variables.FindDecisionVariableIndex)
    FindDecisionVariableIndices = Call(_variables.FindDecisionVariableIndices)
    FindIndeterminateIndex = Call(_variables.FindIndeterminateIndex)
    initial_guess = Call(_variables.initial_guess)
    GetInitialGuess = Call(_variables.GetInitialGuess)
    SetInitialGuess = Call(_variables.SetInitialGuess)
    SetInitialGuessForAllVariables = Call(_variables.SetInitialGuessForAllVariables)
    SetDecisionVariableValueInVector = Call(_variables.SetDecisionVariableValueInVector)
    GetVariableScaling = Call(_variables.GetVariableScaling)
    SetVariableScaling = Call(_variables.SetVariableScaling)
    ClearVariableScaling = Call(_variables.ClearVariableScaling)

    # --- Costs

    AddCost = Call(_costs.AddCost)
    AddLinearCost = Call(_costs.AddLinearCost)
    AddQuadraticCost = Call(_costs.AddQuadraticCost)
    AddQuadraticErrorCost = Call(_costs.AddQuadraticErrorCost)
    Add2NormSquaredCost = Call(_costs.Add2NormSquaredCost)
    AddL2NormCost = Call(_costs.AddL2NormCost)

    # --- Constraints

    AddConstraint = Call(_constraints.AddConstraint)
    AddLinearConstraint = Call(_constraints.AddLinearConstraint)
    AddLinearEqualityConstraint = Call(_constraints.AddLinearEqualityConstraint)
    AddBoundingBoxConstraint = Call(_constraints.AddBoundingBoxConstraint)
    AddQuadraticConstraint = Call(_constraints.AddQuadraticConstraint)
    AddLinearComplementarityConstraint = Call(_constraints.AddLinearComplementarityConstraint)
    AddVisualizationCallback = Call(_constraints.AddVisualizationCallback)

    # --- Cones

    AddLorentzConeConstraint = Call(_cones.AddLorentzConeConstraint)
    AddRotatedLorentzConeConstraint = Call(_cones.AddRotatedLorentzConeConstraint)
    AddQuadraticAsRotatedLorentzConeConstraint = Call(_cones.AddQuadraticAsRotatedLorentzConeConstraint)
    AddExponentialConeConstraint = Call(_cones.AddExponentialConeConstraint)
    AddPositiveSemidefiniteConstraint = Call(_cones.AddPositiveSemidefiniteConstraint)
    AddPrincipalSubmatrixIsPsdConstraint = Call(_cones.AddPrincipalSubmatrixIsPsdConstraint)
    AddLinearMatrixInequalityConstraint = Call(_cones.AddLinearMatrixInequalityConstraint)
    AddPositiveDiagonallyDominantMatrixConstraint = Call(_cones.AddPositiveDiagonallyDominantMatrixConstraint)
    AddPositiveDiagonallyDominantDualConeMatrixConstraint = Call(
        _cones.AddPositiveDiagonallyDominantDualConeMatrixConstraint
    )
    AddScaledDiagonallyDominantMatrixConstraint = Call(_cones.AddScaledDiagonallyDominantMatrixConstraint)
    AddScaledDiagonallyDominantDualConeMatrixConstraint = Call(
        _cones.AddScaledDiagonallyDominantDualConeMatrixConstraint
    )
    TightenPsdConstraintToDd = Call(_cones.TightenPsdConstraintToDd)
    TightenPsdConstraintToSdd = Call(_cones.TightenPsdConstraintToSdd)
    RelaxPsdConstraintToDdDualCone = Call(_cones.RelaxPsdConstraintToDdDualCone)
    RelaxPsdConstraintToSddDualCone = Call(_cones.RelaxPsdConstraintToSddDualCone)

    # --- Costs and constraints with new variables and cones

    AddL2NormCostUsingConicConstraint = Call(_epigraphs.AddL2NormCostUsingConicConstraint)
    AddL1NormCostInEpigraphForm = Call(_epigraphs.AddL1NormCostInEpigraphForm)
    AddMaximizeLogDeterminantCost = Call(_epigraphs.AddMaximizeLogDeterminantCost)
    AddLogDeterminantLowerBoundConstraint = Call(_epigraphs.AddLogDeterminantLowerBoundConstraint)
    AddMaximizeGeometricMeanCost = Call(_epigraphs.AddMaximizeGeometricMeanCost)

    # --- Polynomials

    MakePolynomial = Call(_polynomials.MakePolynomial)
    Reparse = Call(_polynomials.Reparse)
    NewFreePolynomial = Call(_polynomials.NewFreePolynomial)
    NewEvenDegreeFreePolynomial = Call(_polynomials.NewEvenDegreeFreePolynomial)
    NewOddDegreeFreePolynomial = Call(_polynomials.NewOddDegreeFreePolynomial)
    NewSosPolynomial = Call(_polynomials.NewSosPolynomial)
    NewEvenDegreeNonnegativePolynomial = Call(_polynomials.NewEvenDegreeNonnegativePolynomial)
    NewEvenDegreeSosPolynomial = Call(_polynomials.NewEvenDegreeSosPolynomial)
    NewEvenDegreeSdsosPolynomial = Call(_polynomials.NewEvenDegreeSdsosPolynomial)
    NewEvenDegreeDsosPolynomial = Call(_polynomials.NewEvenDegreeDsosPolynomial)
    AddSosConstraint = Call(_polynomials.AddSosConstraint)
    AddEqualityConstraintBetweenPolynomials = Call(_polynomials.AddEqualityConstraintBetweenPolynomials)

    # --- What there is, and values of it

    generic_costs = Call(_bindings.generic_costs)
    linear_costs = Call(_bindings.linear_costs)
    quadratic_costs = Call(_bindings.quadratic_costs)
    l2norm_costs = Call(_bindings.l2norm_costs)
    generic_constraints = Call(_bindings.generic_constraints)
    quadratic_constraints = Call(_bindings.quadratic_constraints)
    linear_constraints = Call(_bindings.linear_constraints)
    linear_equality_constraints = Call(_bindings.linear_equality_constraints)
    bounding_box_constraints = Call(_bindings.bounding_box_constraints)
    lorentz_cone_constraints = Call(_bindings.lorentz_cone_constraints)
    rotated_lorentz_cone_constraints = Call(_bindings.rotated_lorentz_cone_constraints)
    linear_matrix_inequality_constraints = Call(_bindings.linear_matrix_inequality_constraints)
    positive_semidefinite_constraints = Call(_bindings.positive_semidefinite_constraints)
    linear_complementarity_constraints = Call(_bindings.linear_complementarity_constraints)
    exponential_cone_constraints = Call(_bindings.exponential_cone_constraints)
    visualization_callbacks = Call(_bindings.visualization_callbacks)
    GetAllCosts = Call(_bindings.GetAllCosts)
    GetAllConstraints = Call(_bindings.GetAllConstraints)
    GetLinearConstraints = Call(_bindings.GetLinearConstraints)
    required_capabilities = Call(_bindings.required_capabilities)
    IsThreadSafe = Call(_bindings.IsThreadSafe)
    RemoveDecisionVariable = Call(_bindings.RemoveDecisionVariable)
    RemoveCost = Call(_bindings.RemoveCost)
    RemoveConstraint = Call(_bindings.RemoveConstraint)
    RemoveVisualizationCallback = Call(_bindings.RemoveVisualizationCallback)
    GetBindingVariableValues = Call(_bindings.GetBindingVariableValues)
    EvalBinding = Call(_bindings.EvalBinding)
    EvalBindings = Call(_bindings.EvalBindings)
    EvalBindingVectorized = Call(_bindings.EvalBindingVectorized)
    EvalBindingAtInitialGuess = Call(_bindings.EvalBindingAtInitialGuess)
    CheckSatisfied = Call(_bindings.CheckSatisfied)
    CheckSatisfiedAtInitialGuess = Call(_bindings.CheckSatisfiedAtInitialGuess)

    # --- Options

    @overloaded(overload(solver_id=_SOLVER, solver_option=instance_of(str), option_value=option_value))
    def SetSolverOption(self, solver: SolverId | SolverType, name: str, value: float | int | str) -> None:
        """Sets an option of one solver; called as `(solver_id or SolverType, name, value)`."""
        self._options._put((solver if isinstance(solver, SolverId) else id_of_type(solver)).name(), name, value)

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
