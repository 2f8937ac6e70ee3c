"""Mathematical programs and solvers.

A `MathematicalProgram` holds variables, costs and constraints; `Solve` looks at their kinds and hands it to the best
solver there is. Convex programs go to libraries (extra `solvers`, HiGHS of SciPy), small linear ones to an own
simplex method, nonlinear ones to an own SQP method.
"""

import sys

from sheldrake.common._names import show_as_own
from sheldrake.solvers._engines.augmented_lagrangian import AugmentedLagrangianNonsmooth, AugmentedLagrangianSmooth
from sheldrake.solvers._engines.branch_and_bound import MixedIntegerBranchAndBound
from sheldrake.solvers._engines.choose import (
    ChooseBestSolver,
    GetAvailableSolvers,
    MakeFirstAvailableSolver,
    MakeSolver,
    Solve,
    SolveInParallel,
)
from sheldrake.solvers._engines.clarabel import (
    ClarabelSolver,
    ClarabelSolverDetails,
    CsdpSolver,
    CsdpSolverDetails,
)
from sheldrake.solvers._engines.daqp import DaqpSolver, DaqpSolverDetails
from sheldrake.solvers._engines.highs import ClpSolver, ClpSolverDetails
from sheldrake.solvers._engines.interface import SolverInterface
from sheldrake.solvers._engines.ipopt import IpoptSolver, IpoptSolverDetails
from sheldrake.solvers._engines.lemke import MobyLcpSolver, UnrevisedLemkeSolver
from sheldrake.solvers._engines.nlopt import NloptSolver, NloptSolverDetails
from sheldrake.solvers._engines.projected_gradient import ProjectedGradientDescentSolver
from sheldrake.solvers._engines.snopt import SnoptSolver, SnoptSolverDetails
from sheldrake.solvers._engines.splitting import OsqpSolver, OsqpSolverDetails, ScsSolver, ScsSolverDetails
from sheldrake.solvers._engines.unavailable import (
    GurobiSolver,
    GurobiSolverDetails,
    MosekSolver,
    MosekSolverDetails,
)
from sheldrake.solvers._functions.bindings import Binding
from sheldrake.solvers._functions.cone_constraints import (
    ExponentialConeConstraint,
    LinearMatrixInequalityConstraint,
    LorentzConeConstraint,
    PositiveSemidefiniteConstraint,
    RotatedLorentzConeConstraint,
)
from sheldrake.solvers._functions.constraints import (
    BoundingBoxConstraint,
    ExpressionConstraint,
    LinearComplementarityConstraint,
    LinearConstraint,
    LinearEqualityConstraint,
    QuadraticConstraint,
)
from sheldrake.solvers._functions.costs import ExpressionCost, LinearCost, QuadraticCost
from sheldrake.solvers._functions.evaluators import (
    Constraint,
    Cost,
    EvaluatorBase,
    PyFunctionConstraint,
    PyFunctionCost,
    VisualizationCallback,
)
from sheldrake.solvers._functions.minimum_value import (
    MinimumValueLowerBoundConstraint,
    MinimumValueUpperBoundConstraint,
)
from sheldrake.solvers._functions.norm_costs import L1NormCost, L2NormCost, LInfNormCost, PerspectiveQuadraticCost
from sheldrake.solvers._ids import (
    CommonSolverOption,
    ProgramAttribute,
    ProgramType,
    SolutionResult,
    SolverId,
    SolverOptions,
    SolverType,
)
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.solvers._program_type import GetProgramType
from sheldrake.solvers._relaxations.mixed_integer_rotation import MixedIntegerRotationConstraintGenerator
from sheldrake.solvers._relaxations.semidefinite import MakeSemidefiniteRelaxation, SemidefiniteRelaxationOptions
from sheldrake.solvers._relaxations.special_ordered_sets import (
    AddBilinearProductMcCormickEnvelopeSos2,
    AddLogarithmicSos1Constraint,
    AddLogarithmicSos2Constraint,
    AddSos2Constraint,
    IntervalBinning,
)
from sheldrake.solvers._result import MathematicalProgramResult
from sheldrake.solvers._sdpa import GenerateSDPA, RemoveFreeVariableMethod

__all__ = [
    "AddBilinearProductMcCormickEnvelopeSos2",
    "AddLogarithmicSos1Constraint",
    "AddLogarithmicSos2Constraint",
    "AddSos2Constraint",
    "AugmentedLagrangianNonsmooth",
    "AugmentedLagrangianSmooth",
    "Binding",
    "BoundingBoxConstraint",
    "ChooseBestSolver",
    "ClarabelSolver",
    "ClarabelSolverDetails",
    "ClpSolver",
    "ClpSolverDetails",
    "CommonSolverOption",
    "Constraint",
    "Cost",
    "CsdpSolver",
    "CsdpSolverDetails",
    "DaqpSolver",
    "DaqpSolverDetails",
    "EvaluatorBase",
    "ExponentialConeConstraint",
    "ExpressionConstraint",
    "ExpressionCost",
    "GenerateSDPA",
    "GetAvailableSolvers",
    "GetProgramType",
    "GurobiSolver",
    "GurobiSolverDetails",
    "IntervalBinning",
    "IpoptSolver",
    "IpoptSolverDetails",
    "L1NormCost",
    "L2NormCost",
    "LInfNormCost",
    "LinearComplementarityConstraint",
    "LinearConstraint",
    "LinearCost",
    "LinearEqualityConstraint",
    "LinearMatrixInequalityConstraint",
    "LorentzConeConstraint",
    "MakeFirstAvailableSolver",
    "MakeSemidefiniteRelaxation",
    "MakeSolver",
    "MathematicalProgram",
    "MathematicalProgramResult",
    "MinimumValueLowerBoundConstraint",
    "MinimumValueUpperBoundConstraint",
    "MixedIntegerBranchAndBound",
    "MixedIntegerRotationConstraintGenerator",
    "MobyLcpSolver",
    "MosekSolver",
    "MosekSolverDetails",
    "NloptSolver",
    "NloptSolverDetails",
    "OsqpSolver",
    "OsqpSolverDetails",
    "PerspectiveQuadraticCost",
    "PositiveSemidefiniteConstraint",
    "ProgramAttribute",
    "ProgramType",
    "ProjectedGradientDescentSolver",
    "PyFunctionConstraint",
    "PyFunctionCost",
    "QuadraticConstraint",
    "QuadraticCost",
    "RemoveFreeVariableMethod",
    "RotatedLorentzConeConstraint",
    "ScsSolver",
    "ScsSolverDetails",
    "SemidefiniteRelaxationOptions",
    "SnoptSolver",
    "SnoptSolverDetails",
    "SolutionResult",
    "Solve",
    "SolveInParallel",
    "SolverId",
    "SolverInterface",
    "SolverOptions",
    "SolverType",
    "UnrevisedLemkeSolver",
    "VisualizationCallback",
]

Binding._scope = sys.modules[__name__]  # type: ignore[attr-defined]  # to type checkers it is a generic class
show_as_own(globals())
