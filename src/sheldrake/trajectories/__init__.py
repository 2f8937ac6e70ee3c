"""Matrices and poses that depend on time."""

from typing import Any

from sheldrake.common._names import _MangledName, show_as_own
from sheldrake.common._scalars import ScalarTemplate
from sheldrake.common.cpp_template import TemplateClass
from sheldrake.trajectories._base import Trajectory
from sheldrake.trajectories._bezier import BezierCurve
from sheldrake.trajectories._bspline import BsplineTrajectory
from sheldrake.trajectories._composed import (
    CompositeTrajectory,
    PathParameterizedTrajectory,
    StackedTrajectory,
)
from sheldrake.trajectories._derivative_trajectory import (
    DerivativeTrajectory,
    _WrappedTrajectory,
)
from sheldrake.trajectories._exponential import ExponentialPlusPiecewisePolynomial
from sheldrake.trajectories._functions import (
    DiscreteTimeTrajectory,
    FunctionHandleTrajectory,
)
from sheldrake.trajectories._orientation import PiecewisePose, PiecewiseQuaternionSlerp
from sheldrake.trajectories._piecewise import PiecewiseTrajectory
from sheldrake.trajectories._piecewise_constant_curvature import PiecewiseConstantCurvatureTrajectory
from sheldrake.trajectories._piecewise_polynomial import PiecewisePolynomial

__all__ = [
    "BezierCurve",
    "BezierCurve_",
    "BsplineTrajectory",
    "BsplineTrajectory_",
    "CompositeTrajectory",
    "CompositeTrajectory_",
    "DerivativeTrajectory",
    "DerivativeTrajectory_",
    "DiscreteTimeTrajectory",
    "DiscreteTimeTrajectory_",
    "ExponentialPlusPiecewisePolynomial",
    "ExponentialPlusPiecewisePolynomial_",
    "FunctionHandleTrajectory",
    "FunctionHandleTrajectory_",
    "PathParameterizedTrajectory",
    "PathParameterizedTrajectory_",
    "PiecewiseConstantCurvatureTrajectory",
    "PiecewiseConstantCurvatureTrajectory_",
    "PiecewisePolynomial",
    "PiecewisePolynomial_",
    "PiecewisePose",
    "PiecewisePose_",
    "PiecewiseQuaternionSlerp",
    "PiecewiseQuaternionSlerp_",
    "PiecewiseTrajectory",
    "PiecewiseTrajectory_",
    "StackedTrajectory",
    "StackedTrajectory_",
    "Trajectory",
    "Trajectory_",
]

# A class's siblings for other scalars derive from its bases' siblings, so bases come first.
Trajectory_ = ScalarTemplate("Trajectory_", Trajectory, scope=__name__, value_type=True)
PiecewiseTrajectory_ = ScalarTemplate("PiecewiseTrajectory_", PiecewiseTrajectory, scope=__name__)
BezierCurve_ = ScalarTemplate("BezierCurve_", BezierCurve, scope=__name__)
BsplineTrajectory_ = ScalarTemplate("BsplineTrajectory_", BsplineTrajectory, scope=__name__)
CompositeTrajectory_ = ScalarTemplate("CompositeTrajectory_", CompositeTrajectory, scope=__name__)
DerivativeTrajectory_ = ScalarTemplate("DerivativeTrajectory_", DerivativeTrajectory, scope=__name__)
DiscreteTimeTrajectory_ = ScalarTemplate("DiscreteTimeTrajectory_", DiscreteTimeTrajectory, scope=__name__)
FunctionHandleTrajectory_ = ScalarTemplate("FunctionHandleTrajectory_", FunctionHandleTrajectory, scope=__name__)
PathParameterizedTrajectory_ = ScalarTemplate(
    "PathParameterizedTrajectory_", PathParameterizedTrajectory, scope=__name__
)
PiecewiseConstantCurvatureTrajectory_ = ScalarTemplate(
    "PiecewiseConstantCurvatureTrajectory_", PiecewiseConstantCurvatureTrajectory, scope=__name__
)
PiecewisePolynomial_ = ScalarTemplate("PiecewisePolynomial_", PiecewisePolynomial, scope=__name__)
PiecewisePose_ = ScalarTemplate("PiecewisePose_", PiecewisePose, scope=__name__)
PiecewiseQuaternionSlerp_ = ScalarTemplate("PiecewiseQuaternionSlerp_", PiecewiseQuaternionSlerp, scope=__name__)
StackedTrajectory_ = ScalarTemplate("StackedTrajectory_", StackedTrajectory, scope=__name__)
_WrappedTrajectory_ = ScalarTemplate("_WrappedTrajectory_", _WrappedTrajectory, scope=__name__)
show_as_own(globals())
ExponentialPlusPiecewisePolynomial_ = TemplateClass("ExponentialPlusPiecewisePolynomial_")
ExponentialPlusPiecewisePolynomial_.__doc__ = (
    "The class ExponentialPlusPiecewisePolynomial for each scalar type (float only)."
)
ExponentialPlusPiecewisePolynomial_.add_instantiation(float, ExponentialPlusPiecewisePolynomial, skip_rename=True)


def __getattr__(name: str) -> Any:
    return _MangledName.module_getattr(module_name=__name__, module_globals=globals(), name=name)
