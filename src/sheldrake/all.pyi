"""Every public name of sheldrake in one place, for notebooks and short scripts: `from sheldrake.all import *`.

Where two modules have the same name, the one that pydrake.all gives is here. Programs are clearer, and start faster,
when they import from the modules themselves.

Made by tools/make_stubs.py.
"""

from typing import Any

from sheldrake._pydrake.retired.meshcat_visualizer import (
    ConnectMeshcatVisualizer as ConnectMeshcatVisualizer,
)
from sheldrake._pydrake.retired.poses import *
from sheldrake.autodiffutils import *
from sheldrake.common import *
from sheldrake.common.compatibility import *
from sheldrake.common.containers import *
from sheldrake.common.eigen_geometry import *
from sheldrake.common.schema import *
from sheldrake.common.value import *
from sheldrake.common.yaml import *
from sheldrake.forwarddiff import (
    derivative as derivative,
    gradient as gradient,
    jacobian as jacobian,
)
from sheldrake.geometry import *
from sheldrake.geometry.optimization import *
from sheldrake.lcm import *
from sheldrake.manipulation import *
from sheldrake.math import *
from sheldrake.multibody.benchmarks import *
from sheldrake.multibody.benchmarks.acrobot import *
from sheldrake.multibody.cenic import *
from sheldrake.multibody.contact_solvers import *
from sheldrake.multibody.inverse_kinematics import *
from sheldrake.multibody.math import *
from sheldrake.multibody.meshcat import *
from sheldrake.multibody.optimization import *
from sheldrake.multibody.parsing import *
from sheldrake.multibody.plant import *
from sheldrake.multibody.rational import *
from sheldrake.multibody.tree import *
from sheldrake.perception import *
from sheldrake.planning import *
from sheldrake.polynomial import (
    Polynomial_ as Polynomial_,
)
from sheldrake.solvers import *
from sheldrake.symbolic import (
    CalcMonomialBasisOrderUpToOne as CalcMonomialBasisOrderUpToOne,
    CalcPolynomialWLowerTriangularPart as CalcPolynomialWLowerTriangularPart,
    DecomposeAffineExpression as DecomposeAffineExpression,
    DecomposeAffineExpressions as DecomposeAffineExpressions,
    DecomposeL2NormExpression as DecomposeL2NormExpression,
    DecomposeLinearExpressions as DecomposeLinearExpressions,
    DecomposeLumpedParameters as DecomposeLumpedParameters,
    DecomposeQuadraticPolynomial as DecomposeQuadraticPolynomial,
    Evaluate as Evaluate,
    EvenDegreeMonomialBasis as EvenDegreeMonomialBasis,
    Expression as Expression,
    ExpressionKind as ExpressionKind,
    ExtractVariablesFromExpression as ExtractVariablesFromExpression,
    Formula as Formula,
    FormulaKind as FormulaKind,
    GetVariableVector as GetVariableVector,
    IsAffine as IsAffine,
    Jacobian as Jacobian,
    MakeMatrixBinaryVariable as MakeMatrixBinaryVariable,
    MakeMatrixBooleanVariable as MakeMatrixBooleanVariable,
    MakeMatrixContinuousVariable as MakeMatrixContinuousVariable,
    MakeMatrixVariable as MakeMatrixVariable,
    MakeVectorBinaryVariable as MakeVectorBinaryVariable,
    MakeVectorBooleanVariable as MakeVectorBooleanVariable,
    MakeVectorContinuousVariable as MakeVectorContinuousVariable,
    MakeVectorVariable as MakeVectorVariable,
    Monomial as Monomial,
    MonomialBasis as MonomialBasis,
    OddDegreeMonomialBasis as OddDegreeMonomialBasis,
    Polynomial as Polynomial,
    RationalFunction as RationalFunction,
    ReplaceBilinearTerms as ReplaceBilinearTerms,
    SinCos as SinCos,
    SinCosSubstitutionType as SinCosSubstitutionType,
    Substitute as Substitute,
    SubstituteAndExpandCacheData as SubstituteAndExpandCacheData,
    SubstituteStereographicProjection as SubstituteStereographicProjection,
    TaylorExpand as TaylorExpand,
    ToLatex as ToLatex,
    Variable as Variable,
    Variables as Variables,
    forall as forall,
    from_sympy as from_sympy,
    if_then_else as if_then_else,
    intersect as intersect,
    logical_and as logical_and,
    logical_not as logical_not,
    logical_or as logical_or,
    positive_semidefinite as positive_semidefinite,
    to_sympy as to_sympy,
    uninterpreted_function as uninterpreted_function,
)
from sheldrake.systems.analysis import *
from sheldrake.systems.controllers import *
from sheldrake.systems.drawing import *
from sheldrake.systems.estimators import *
from sheldrake.systems.framework import *
from sheldrake.systems.lcm import *
from sheldrake.systems.perception import *
from sheldrake.systems.planar_scenegraph_visualizer import *
from sheldrake.systems.primitives import *
from sheldrake.systems.pyplot_visualizer import *
from sheldrake.systems.rendering import *
from sheldrake.systems.scalar_conversion import *
from sheldrake.systems.sensors import *
from sheldrake.trajectories import *
from sheldrake.visualization import *

AddResourceSearchPath: Any
AddSoftHydroelasticProperties: Any
AddSoftHydroelasticPropertiesForHalfSpace: Any
BodyFrame_: Any
CalcPairwiseIntersections: Any
CameraProperties: Any
ConnectDrakeVisualizer: Any
ContactResultsToMeshcat = ContactVisualizer
ContactResultsToMeshcatParams = ContactVisualizerParams
DepthCameraProperties: Any
DrakeMockLcm: Any
FindResource: Any
GenerateHtml: Any
GetResourceSearchPaths: Any
GetScopedFrameName: Any
IrisInConfigurationSpace: Any
LogOutput: Any
MeshcatPointCloudVisualizerCpp: Any
MeshcatVisualizerCpp: Any
MinimumDistanceConstraint: Any
MinimumValueConstraint: Any
MobyLCPSolver = MobyLcpSolver
NonsmoothAugmentedLagrangian = AugmentedLagrangianNonsmooth
ReadObjToSurfaceMesh: Any
SignalLogger: Any
SurfaceFace = SurfaceTriangle
SurfaceMesh = TriangleSurfaceMesh
SurfaceVertex: Any
autoDiffToGradientMatrix: Any
autoDiffToValueMatrix: Any
initializeAutoDiff: Any
initializeAutoDiffGivenGradientMatrix: Any
initializeAutoDiffTuple: Any
set_assertion_failure_to_throw_exception: Any
