"""Rotations, poses, and mathematics on floats, AutoDiffXd and Expression alike."""

from typing import Any

from sheldrake.common._names import _MangledName, show_as_own
from sheldrake.math import _rotation_matrix
from sheldrake.math._arrays import eq, ge, gt, inv, le, lt, matmul, ne
from sheldrake.math._barycentric_mesh import BarycentricMesh
from sheldrake.math._bspline_basis import BsplineBasis, BsplineBasis_, KnotVectorType
from sheldrake.math._functions import (
    abs,
    acos,
    arccos,
    arcsin,
    arctan,
    arctan2,
    asin,
    atan,
    atan2,
    ceil,
    cos,
    cosh,
    exp,
    floor,
    isnan,
    log,
    max,
    min,
    pow,
    sin,
    sinh,
    sqrt,
    tan,
    tanh,
    wrap_to,
)
from sheldrake.math._gradient import ComputeNumericalGradient, NumericalGradientMethod, NumericalGradientOption
from sheldrake.math._matrices import (
    BalanceQuadraticForms,
    DecomposePositiveQuadraticForm,
    DecomposePSDmatrixIntoXtransposeTimesX,
    ExtractPrincipalSubmatrix,
    IsPositiveDefinite,
    IsSymmetric,
    ToLowerTriangularColumnsFromMatrix,
    ToSymmetricMatrixFromLowerTriangularColumns,
    VectorToSkewSymmetric,
)
from sheldrake.math._matrix_equations import (
    ContinuousAlgebraicRiccatiEquation,
    DiscreteAlgebraicRiccatiEquation,
    RealContinuousLyapunovEquation,
    RealDiscreteLyapunovEquation,
)
from sheldrake.math._quaternions import (
    AreQuaternionsEqualForOrientation,
    CalculateAngularVelocityExpressedInBFromQuaternionDt,
    CalculateQuaternionDtConstraintViolation,
    CalculateQuaternionDtFromAngularVelocityExpressedInB,
    ClosestQuaternion,
    IsBothQuaternionAndQuaternionDtOK,
    IsQuaternionValid,
    QuaternionToCanonicalForm,
    is_quaternion_in_canonical_form,
)
from sheldrake.math._random_rotations import (
    UniformlyRandomAngleAxis,
    UniformlyRandomQuaternion,
    UniformlyRandomRotationMatrix,
    UniformlyRandomRPY,
)
from sheldrake.math._rigid_transform import RigidTransform, RigidTransform_
from sheldrake.math._roll_pitch_yaw import RollPitchYaw, RollPitchYaw_
from sheldrake.math._rotation_matrix import RotationMatrix, RotationMatrix_
from sheldrake.math._soft_min_max import SoftOverMax, SoftOverMin, SoftUnderMax, SoftUnderMin

__all__ = [
    "AreQuaternionsEqualForOrientation",
    "BalanceQuadraticForms",
    "BarycentricMesh",
    "BsplineBasis",
    "BsplineBasis_",
    "CalculateAngularVelocityExpressedInBFromQuaternionDt",
    "CalculateQuaternionDtConstraintViolation",
    "CalculateQuaternionDtFromAngularVelocityExpressedInB",
    "ClosestQuaternion",
    "ComputeNumericalGradient",
    "ContinuousAlgebraicRiccatiEquation",
    "DecomposePSDmatrixIntoXtransposeTimesX",
    "DecomposePositiveQuadraticForm",
    "DiscreteAlgebraicRiccatiEquation",
    "ExtractPrincipalSubmatrix",
    "IsBothQuaternionAndQuaternionDtOK",
    "IsPositiveDefinite",
    "IsQuaternionValid",
    "IsSymmetric",
    "KnotVectorType",
    "NumericalGradientMethod",
    "NumericalGradientOption",
    "QuaternionToCanonicalForm",
    "RealContinuousLyapunovEquation",
    "RealDiscreteLyapunovEquation",
    "RigidTransform",
    "RigidTransform_",
    "RollPitchYaw",
    "RollPitchYaw_",
    "RotationMatrix",
    "RotationMatrix_",
    "SoftOverMax",
    "SoftOverMin",
    "SoftUnderMax",
    "SoftUnderMin",
    "ToLowerTriangularColumnsFromMatrix",
    "ToSymmetricMatrixFromLowerTriangularColumns",
    "UniformlyRandomAngleAxis",
    "UniformlyRandomQuaternion",
    "UniformlyRandomRPY",
    "UniformlyRandomRotationMatrix",
    "VectorToSkewSymmetric",
    "abs",
    "acos",
    "arccos",
    "arcsin",
    "arctan",
    "arctan2",
    "asin",
    "atan",
    "atan2",
    "ceil",
    "cos",
    "cosh",
    "eq",
    "exp",
    "floor",
    "ge",
    "gt",
    "inv",
    "is_quaternion_in_canonical_form",
    "isnan",
    "le",
    "log",
    "lt",
    "matmul",
    "max",
    "min",
    "ne",
    "pow",
    "sin",
    "sinh",
    "sqrt",
    "tan",
    "tanh",
    "wrap_to",
]

show_as_own(globals())

_rotation_matrix.RollPitchYaw_ = RollPitchYaw_


def __getattr__(name: str) -> Any:
    return _MangledName.module_getattr(module_name=__name__, module_globals=globals(), name=name)
