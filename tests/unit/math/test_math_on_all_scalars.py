import copy
import pickle

import numpy as np
import pytest

import sheldrake.math as m
from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.common.eigen_geometry import Quaternion, Quaternion_
from sheldrake.math import RigidTransform, RigidTransform_, RollPitchYaw, RollPitchYaw_, RotationMatrix, RotationMatrix_
from sheldrake.symbolic import Expression, Formula, Variable


def test_functions_of_duals_and_symbols():
    x, dual = Variable("x"), AutoDiffXd(0.5, [1.0])
    for name in ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "abs"):
        function = getattr(m, name)
        assert isinstance(function(x), Expression) and isinstance(function(Expression(x)), Expression)
        assert function(dual).value() == function(0.5)
        assert function(x).Evaluate({x: 0.5}) == function(0.5)
    for name in ("atan2", "max", "min"):
        function = getattr(m, name)
        assert function(dual, 2).value() == function(2, dual).value() * 0 + function(0.5, 2)
        assert function(x, 2).Evaluate({x: 0.5}) == function(0.5, 2)
        with pytest.raises(TypeError):
            function(x, dual)
    assert m.pow(dual, 2).derivatives() == pytest.approx([1.0])
    assert m.pow(2, x).Evaluate({x: 3}) == 8
    with pytest.raises(TypeError):
        m.pow(dual, dual)
    assert m.ceil(dual) == 1.0 and m.floor(dual) == 0.0
    assert isinstance(m.isnan(Expression(x)), Formula) and m.isnan(dual) is False
    assert m.wrap_to(AutoDiffXd(3.0, [1.0]), 0.0, 2.0).derivatives() == pytest.approx([1.0])
    assert m.wrap_to(x, 0, 1).Evaluate({x: 2.25}) == 0.25


def test_comparison_of_arrays():
    x = Variable("x")
    assert m.eq([1, 2], [1, 3]).tolist() == [True, False]
    formulas = m.ge(np.array([x, 2 * x]), 3)
    assert formulas.dtype == object and all(isinstance(f, Formula) for f in formulas)
    assert [f.Evaluate({x: 2}) for f in formulas] == [False, True]


def test_inverse_and_product_of_any_scalar():
    dual = np.array([[AutoDiffXd(2.0, [1.0]), 1.0], [0.0, 4.0]], dtype=object)
    product = m.matmul(dual, m.inv(dual))
    assert [[x.value() for x in row] for row in product] == [[1.0, 0.0], [0.0, 1.0]]
    assert m.inv(np.array([[AutoDiffXd(2.0, [1.0])]]))[0, 0].derivatives() == pytest.approx([-0.25])
    x = Variable("x")
    assert m.inv(np.array([[Expression(x)]]))[0, 0].Evaluate({x: 4}) == 0.25
    with pytest.raises(ValueError):
        m.inv(np.ones((2, 3)))
    with pytest.raises(ValueError):
        m.matmul(np.ones((2, 3)), np.ones((2, 3)))


def test_rotations_of_expressions_evaluate_to_rotations_of_floats():
    names = [Variable(name) for name in "abc"]
    values = dict(zip(names, [0.3, -0.4, 2.0]))

    def evaluate(array):
        return [x.Evaluate(values) for x in np.ravel(array)]

    rpy = RollPitchYaw_[Expression](names)
    R = rpy.ToRotationMatrix()
    plain = m.RollPitchYaw(list(values.values())).ToRotationMatrix()
    assert type(R) is RotationMatrix_[Expression]
    np.testing.assert_allclose(evaluate(R.matrix()), plain.matrix().ravel(), atol=1e-15)
    np.testing.assert_allclose(evaluate(rpy.ToQuaternion().rotation()), plain.matrix().ravel(), atol=1e-15)
    np.testing.assert_allclose(evaluate(R.ToQuaternion().wxyz()), plain.ToQuaternion().wxyz(), atol=1e-15)
    np.testing.assert_allclose(evaluate(R.ToRollPitchYaw().vector()), list(values.values()), atol=1e-15)
    X = RigidTransform_[Expression](R, names)
    np.testing.assert_allclose(evaluate((X @ X.inverse()).GetAsMatrix4()), np.eye(4).ravel(), atol=1e-15)
    assert isinstance(X.IsExactlyEqualTo(X), Formula) and X.IsExactlyEqualTo(X).Evaluate()
    assert isinstance(X.IsNearlyEqualTo(RigidTransform_[Expression](), 0.1), Formula)
    assert R.IsValid().Evaluate(values)
    assert type(RigidTransform().cast[Expression]()) is RigidTransform_[Expression]
    assert type(RigidTransform_(p=[names[0], 2, 3])) is RigidTransform_[Expression]
    with pytest.raises(TypeError):
        RigidTransform(p=[names[0], 2, 3])


def test_quaternion_helpers_of_other_scalars():
    a = Variable("a")
    q = Quaternion_[Expression](a, 0, 0, 0)
    assert m.QuaternionToCanonicalForm(q).w().Evaluate({a: -1}) == 1
    assert isinstance(m.is_quaternion_in_canonical_form(q), Formula)
    assert isinstance(m.IsQuaternionValid(q, 0.1), Formula)
    rates = m.CalculateQuaternionDtFromAngularVelocityExpressedInB(Quaternion().cast[AutoDiffXd](), [1, 2, 3])
    assert [x.value() for x in rates] == [0.0, 0.5, 1.0, 1.5]
    with pytest.raises(TypeError):
        m.ClosestQuaternion(q, Quaternion())
    with pytest.raises(TypeError):
        m.IsQuaternionValid([1, 0, 0, 0], 0.1)


def test_bspline_basis_of_other_scalars():
    u = AutoDiffXd(0.3, [1.0])
    basis = m.BsplineBasis_[AutoDiffXd](3, [0, 0, 0, 1, 1, 1])
    weights = basis.EvaluateLinearInControlPoints(u)
    assert sum(w.derivatives()[0] for w in weights) == pytest.approx(0.0)
    assert weights[0].derivatives() == pytest.approx([-2 * 0.7])
    x = Variable("x")
    curve = m.BsplineBasis_[Expression](3, [0, 0, 0, 1, 1, 1]).EvaluateCurve([[x], [1], [2]], 0.5)
    assert curve[0].Evaluate({x: 0}) == pytest.approx(1.0)
    for twin in (copy.copy(basis), pickle.loads(pickle.dumps(basis)), m.BsplineBasis_[AutoDiffXd](basis)):
        assert type(twin) is type(basis) and twin.order() == 3


@pytest.mark.parametrize(
    "error, make",
    [
        (ValueError, lambda: m.BsplineBasis(4, [0, 1, 2])),
        (ValueError, lambda: m.BsplineBasis(order=4, num_basis_functions=3)),
        (TypeError, lambda: m.BsplineBasis("a", 3)),
        (TypeError, lambda: m.BsplineBasis(3, 4, 0)),
        (RuntimeError, lambda: m.BsplineBasis(3, 4).EvaluateCurve([[1]], 0.5)),
        (RuntimeError, lambda: m.BsplineBasis(3, 4).EvaluateLinearInControlPoints(1.5)),
        (TypeError, lambda: m.BsplineBasis(3, 4).EvaluateCurve([1, 2, 3, 4], 0.5)),
        (TypeError, lambda: m.BsplineBasis(3, 4).ComputeActiveBasisFunctionIndices([0, 0.5, 1])),
        (RuntimeError, lambda: m.BarycentricMesh([])),
        (RuntimeError, lambda: m.BarycentricMesh([{0.0, 1.0}]).EvalBarycentricWeights([1, 2])),
        (RuntimeError, lambda: m.BarycentricMesh([{0.0, 1.0}]).Eval(np.ones((1, 3)), [0])),
        (IndexError, lambda: m.BarycentricMesh([{0.0, 1.0}]).get_mesh_point(2)),
        (RuntimeError, lambda: m.SoftOverMax([], 1)),
        (RuntimeError, lambda: m.SoftUnderMin([1.0], -1)),
        (ValueError, lambda: m.ToSymmetricMatrixFromLowerTriangularColumns([1, 2])),
        (ValueError, lambda: m.ToLowerTriangularColumnsFromMatrix(np.ones((2, 3)))),
        (ValueError, lambda: m.ExtractPrincipalSubmatrix(np.eye(2), {5})),
        (TypeError, lambda: m.ExtractPrincipalSubmatrix(np.eye(2), [0])),
        (RuntimeError, lambda: m.DecomposePSDmatrixIntoXtransposeTimesX(-np.eye(2), 1e-8)),
        (RuntimeError, lambda: m.DecomposePSDmatrixIntoXtransposeTimesX(np.eye(2), -1e-8)),
        (RuntimeError, lambda: m.DecomposePSDmatrixIntoXtransposeTimesX(np.ones((2, 3)), 1e-8)),
        (RuntimeError, lambda: m.DecomposePositiveQuadraticForm([[1.0]], [2.0], 0.5)),
        (RuntimeError, lambda: m.DecomposePositiveQuadraticForm(np.eye(2), [2.0], 5)),
        (RuntimeError, lambda: m.BalanceQuadraticForms(-np.eye(2), np.eye(2))),
        (RuntimeError, lambda: m.BalanceQuadraticForms(np.eye(2), np.zeros((2, 2)))),
        (RuntimeError, lambda: m.ContinuousAlgebraicRiccatiEquation([[0, 1], [0, 0]], [[0], [1]], np.eye(2), [[0]])),
        (RuntimeError, lambda: m.ContinuousAlgebraicRiccatiEquation([[0, 1], [0, 0]], [[0], [0]], np.eye(2), [[1]])),
        (RuntimeError, lambda: m.ContinuousAlgebraicRiccatiEquation(np.eye(3), [[0], [1]], np.eye(2), [[1]])),
        (RuntimeError, lambda: m.DiscreteAlgebraicRiccatiEquation([[1, 1], [0, 1]], [[0], [0]], np.eye(2), [[1]])),
        (RuntimeError, lambda: m.DiscreteAlgebraicRiccatiEquation([[1, 1], [0, 1]], [[0], [1]], -np.eye(2), [[1]])),
        (RuntimeError, lambda: m.RealContinuousLyapunovEquation([[1, 1], [0, -1]], np.eye(2))),
        (RuntimeError, lambda: m.RealDiscreteLyapunovEquation([[1, 0.1], [0, 1]], np.eye(2))),
        (RuntimeError, lambda: m.RealDiscreteLyapunovEquation(np.eye(3), np.eye(2))),
        (RuntimeError, lambda: m.ComputeNumericalGradient(lambda x: x[0], [1.0])),
        (TypeError, lambda: m.VectorToSkewSymmetric([1, 2])),
        (TypeError, lambda: m.IsSymmetric("a")),
    ],
)
def test_errors(error, make):
    with pytest.raises(error):
        make()


def test_enumerations():
    kind = m.KnotVectorType
    assert repr(kind.kUniform) == "<KnotVectorType.kUniform: 0>" and int(kind.kClampedUniform) == 1
    assert kind(1) is kind.kClampedUniform and kind.kUniform != 0 and kind.kUniform < kind.kClampedUniform
    assert m.DecomposePSDmatrixIntoXtransposeTimesX(-np.eye(2), 1e-8, return_empty_if_not_psd=True).shape == (0, 2)


def test_rotations_of_constant_symbols_take_one_branch():
    one, R = Expression(1.0), RotationMatrix_[Expression]
    q = Quaternion_[Expression](rotation=np.eye(3) * one)
    assert [c.Evaluate() for c in q.wxyz()] == [1.0, 0.0, 0.0, 0.0]
    assert q.slerp(t=0.5, other=q).w().EqualTo(one)
    assert R().ToAngleAxis().angle().EqualTo(Expression(0.0))
    b = R.MakeFromOneVector(b_A=np.array([1.0, 2.0, 3.0]) * one, axis_index=0)
    expected = m.RotationMatrix.MakeFromOneVector(b_A=[1.0, 2.0, 3.0], axis_index=0).matrix()
    assert [e.Evaluate() for e in b.matrix().flat] == pytest.approx(expected.ravel())
    assert R.ProjectToRotationMatrix(2.0 * np.eye(3) * one).IsNearlyIdentity(1e-12).EqualTo(Formula.True_())
    with pytest.raises(RuntimeError, match="variable x"):
        R.MakeFromOneVector(b_A=np.array([Variable("x"), 2.0, 3.0]) * one, axis_index=0)


def test_positive_definite_matrices_have_a_square_factor_whatever_the_tolerance():
    assert m.DecomposePSDmatrixIntoXtransposeTimesX(np.diag([0.8, 0.5]), zero_tol=0.7).shape == (2, 2)
    assert m.DecomposePSDmatrixIntoXtransposeTimesX(np.diag([0.8, 0.0]), zero_tol=0.7).shape == (1, 2)


def test_plain_numbers_have_a_way_of_their_own_to_the_same_quaternions_and_angles():
    generator = np.random.default_rng(8)
    for k in range(200):
        angles = (
            generator.uniform(-np.pi, np.pi, 3) if k % 4 else generator.choice([0.0, np.pi / 2, np.pi, -np.pi / 2], 3)
        )
        R = RotationMatrix(RollPitchYaw(angles))
        dual = RotationMatrix_[AutoDiffXd](R.matrix())
        assert R.ToQuaternion().wxyz().tolist() == [x.value() for x in dual.ToQuaternion().wxyz()]
        assert R.ToRollPitchYaw().vector().tolist() == [x.value() for x in dual.ToRollPitchYaw().vector()]
        assert RollPitchYaw(*angles.tolist()).vector().tolist() == angles.tolist()
    for M in (np.diag([1.0, 1.0, -1.0]), np.full((3, 3), np.nan), np.diag([1.0, 1.2, 1.0])):
        with pytest.raises(RuntimeError, match="is not a rotation matrix"):
            RotationMatrix(M)
