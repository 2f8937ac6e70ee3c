"""Everything else in `math` gives pydrake's numbers."""

import math

import numpy as np
import pytest

import sheldrake.math as m
from sheldrake.common import _random
from sheldrake.common.eigen_geometry import Quaternion

pm = pytest.importorskip("pydrake.math")
pc = pytest.importorskip("pydrake.common")
pe = pytest.importorskip("pydrake.common.eigen_geometry")
pytestmark = pytest.mark.peer
SEEDS = list(range(8))


def close(ours, theirs, tolerance=1e-14):
    theirs = np.asarray(theirs, dtype=float)
    scale = max(1.0, np.abs(theirs).max(initial=0.0)) if np.isfinite(theirs).all() else 1.0
    np.testing.assert_allclose(np.asarray(ours, dtype=float), theirs, rtol=tolerance, atol=tolerance * scale)


UNARY = "abs acos arccos arcsin arctan asin atan ceil cos cosh exp floor isnan log sin sinh sqrt tan tanh".split()
NUMBERS = [-2.0, -1.0, -0.3, 0.0, 0.4, 1.0, 3.0, 1000.0, math.inf, -math.inf, math.nan]


@pytest.mark.parametrize("name", UNARY)
def test_functions_of_one_number(name):
    for x in [*NUMBERS, 1, True, np.float32(0.25), np.float64(0.3)]:
        ours, theirs = getattr(m, name)(x), getattr(pm, name)(x)
        assert type(ours) is type(theirs)
        assert ours == theirs or (math.isnan(ours) and math.isnan(theirs)), x
    for wrong in ("a", None, [1.0], np.array([1.0]), np.ones((1, 1))):
        with pytest.raises(TypeError):
            getattr(m, name)(wrong)


@pytest.mark.parametrize("name", ["arctan2", "atan2", "max", "min", "pow"])
def test_functions_of_two_numbers(name):
    for x in NUMBERS:
        for y in NUMBERS:
            ours, theirs = getattr(m, name)(x, y), getattr(pm, name)(x, y)
            assert ours == theirs or (math.isnan(ours) and math.isnan(theirs)), (x, y)


def test_wrap_to():
    for value in np.linspace(-7, 7, 57):
        close(m.wrap_to(value, -1.0, 1.5), pm.wrap_to(value, -1.0, 1.5))


@pytest.mark.parametrize("seed", SEEDS)
def test_quaternion_helpers(seed):
    rng = np.random.default_rng(seed)
    q, r = rng.normal(size=(2, 4))
    q, r = q / np.linalg.norm(q), r / np.linalg.norm(r)
    rates, w = rng.normal(size=4), rng.normal(size=3)
    a, b, pa, pb = Quaternion(q), Quaternion(r), pe.Quaternion(q), pe.Quaternion(r)
    close(m.QuaternionToCanonicalForm(a).wxyz(), pm.QuaternionToCanonicalForm(pa).wxyz())
    close(m.ClosestQuaternion(a, b).wxyz(), pm.ClosestQuaternion(pa, pb).wxyz())
    for name, argument in (
        ("CalculateQuaternionDtFromAngularVelocityExpressedInB", w),
        ("CalculateAngularVelocityExpressedInBFromQuaternionDt", rates),
        ("CalculateQuaternionDtConstraintViolation", rates),
    ):
        close(getattr(m, name)(a, argument), getattr(pm, name)(pa, argument))
    for tolerance in (1e-8, 10.0):
        assert m.IsBothQuaternionAndQuaternionDtOK(a, rates, tolerance) == pm.IsBothQuaternionAndQuaternionDtOK(
            pa, rates, tolerance
        )
        assert m.AreQuaternionsEqualForOrientation(a, b, tolerance) == pm.AreQuaternionsEqualForOrientation(
            pa, pb, tolerance
        )
        assert m.IsQuaternionValid(a, tolerance) == pm.IsQuaternionValid(pa, tolerance)
    assert m.is_quaternion_in_canonical_form(a) == pm.is_quaternion_in_canonical_form(pa)


@pytest.mark.parametrize("seed", SEEDS)
def test_matrices(seed):
    rng = np.random.default_rng(seed)
    M = rng.normal(size=(3, 3))
    S = M @ M.T
    close(m.VectorToSkewSymmetric(M[0]), pm.VectorToSkewSymmetric(M[0]))
    close(m.ToLowerTriangularColumnsFromMatrix(M), pm.ToLowerTriangularColumnsFromMatrix(M))
    close(
        m.ToSymmetricMatrixFromLowerTriangularColumns(range(6)),
        pm.ToSymmetricMatrixFromLowerTriangularColumns(range(6)),
    )
    close(m.ExtractPrincipalSubmatrix(M, {2, 0}), pm.ExtractPrincipalSubmatrix(M, {2, 0}))
    for tolerance in (0.0, 0.1, 1.0):
        assert m.IsPositiveDefinite(S, tolerance) == pm.IsPositiveDefinite(S, tolerance)
        assert m.IsSymmetric(M, tolerance) == pm.IsSymmetric(M, tolerance)
    close(m.inv(M), pm.inv(M), 1e-12)
    close(m.matmul(M, M[0]), pm.matmul(M, M[0]))
    assert m.lt(M, S).tolist() == pm.lt(M, S).tolist()
    for Y in (S, M[:, :2] @ M[:, :2].T, M[:, :1] @ M[:, :1].T, np.zeros((3, 3))):
        X, pX = (one.DecomposePSDmatrixIntoXtransposeTimesX(Y, 1e-10) for one in (m, pm))
        assert len(X) == np.linalg.matrix_rank(Y, tol=1e-8), "Drake may keep a row of rounding noise"
        close(X.T @ X, pX.T @ pX, 1e-12)
    b, c = M[1], 10.0 + seed
    (R, d), (pR, pd) = (one.DecomposePositiveQuadraticForm(S + np.eye(3), b, c) for one in (m, pm))
    close(R, pR, 1e-12)
    close(d, pd, 1e-12)
    T, pT = m.BalanceQuadraticForms(S, M + M.T), pm.BalanceQuadraticForms(S, M + M.T)
    close(np.abs(T), np.abs(pT), 1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_matrix_equations(seed):
    rng = np.random.default_rng(seed)
    A, B = rng.normal(size=(4, 4)), rng.normal(size=(4, 2))
    Q, R, N = rng.normal(size=(4, 4)), rng.normal(size=(2, 2)), 0.1 * rng.normal(size=(4, 2))
    Q, R = Q @ Q.T + np.eye(4), R @ R.T + np.eye(2)
    for name, arguments in (
        ("ContinuousAlgebraicRiccatiEquation", (A, B, Q, R)),
        ("DiscreteAlgebraicRiccatiEquation", (A, B, Q, R)),
        ("DiscreteAlgebraicRiccatiEquation", (A, B, Q, R, N)),
        ("RealContinuousLyapunovEquation", (A, Q)),
        ("RealDiscreteLyapunovEquation", (A, Q)),
    ):
        close(getattr(m, name)(*arguments), getattr(pm, name)(*arguments), 1e-8)


def test_numerical_gradient():
    def f(x):
        return np.array([x[0] ** 2, np.sin(x[1]), x[0] * x[1]])

    for name in ("kForward", "kBackward", "kCentral"):
        for accuracy in (1e-15, 1e-6):
            ours = m.NumericalGradientOption(getattr(m.NumericalGradientMethod, name), accuracy)
            theirs = pm.NumericalGradientOption(getattr(pm.NumericalGradientMethod, name), accuracy)
            assert ours.perturbation_size() == theirs.perturbation_size()
            assert repr(ours) == repr(theirs)
            got, want = (
                m.ComputeNumericalGradient(f, [3.0, 200.0], ours),
                pm.ComputeNumericalGradient(f, [3.0, 200.0], theirs),
            )
            assert got.tolist() == want.tolist()


def test_soft_min_max():
    x = [1.0, 2.5, -3.0, 2.4]
    for name in ("SoftOverMax", "SoftUnderMax", "SoftOverMin", "SoftUnderMin"):
        for alpha in (0.5, 1.0, 20.0, 1e4):
            close(getattr(m, name)(x, alpha=alpha), getattr(pm, name)(x, alpha=alpha))


@pytest.mark.parametrize(
    "arguments",
    [
        (4, 6),
        (3, 4, "kUniform", 1.0, 3.0),
        (1, 3, "kClampedUniform", -1.0, 2.0),
        (3, [0.0, 0.0, 0.0, 0.4, 0.4, 1.5, 2.0, 2.0, 2.5]),
    ],
)
def test_bspline_basis(arguments):
    def make(one):
        kind = [getattr(one.KnotVectorType, x) if isinstance(x, str) else x for x in arguments]
        return one.BsplineBasis(*kind)

    a, b = make(m), make(pm)
    close(a.knots(), b.knots(), 1e-16)
    first, last = b.initial_parameter_value(), b.final_parameter_value()
    assert (a.order(), a.degree(), a.num_basis_functions()) == (b.order(), b.degree(), b.num_basis_functions())
    close([a.initial_parameter_value(), a.final_parameter_value()], [first, last])
    points = [[float(i), (-1.0) ** i] for i in range(a.num_basis_functions())]
    for u in np.clip(np.linspace(first, last, 23), first, last):
        assert a.FindContainingInterval(u) == b.FindContainingInterval(u)
        assert a.ComputeActiveBasisFunctionIndices(u) == b.ComputeActiveBasisFunctionIndices(u)
        interval = [u, (u + last) / 2]
        assert a.ComputeActiveBasisFunctionIndices(interval) == b.ComputeActiveBasisFunctionIndices(interval)
        close(a.EvaluateCurve(points, u), b.EvaluateCurve(points, u))
        close(a.EvaluateLinearInControlPoints(u), b.EvaluateLinearInControlPoints(u))
        close(a.EvaluateBasisFunctionI(1, u), b.EvaluateBasisFunctionI(1, u))


def test_barycentric_mesh():
    rng = np.random.default_rng(0)
    grid = [{0.0, 1.0}, {-1.0, 0.5, 3.0}, {2.0, 3.0}]
    a, b = m.BarycentricMesh(grid), pm.BarycentricMesh(grid)
    assert a.get_input_grid() == b.get_input_grid()
    assert a.get_num_mesh_points() == b.get_num_mesh_points() == 12
    assert a.get_num_interpolants() == b.get_num_interpolants() == 4
    close(a.get_all_mesh_points(), b.get_all_mesh_points())
    values = np.asfortranarray(rng.normal(size=(2, 12)))
    close(a.MeshValuesFrom(lambda x: [x @ x, x[0]]), b.MeshValuesFrom(lambda x: np.array([x @ x, x[0]])))
    for _ in range(60):
        x = rng.uniform(-2, 4, size=3)
        if rng.random() < 0.3:
            x[rng.integers(3)] = rng.choice([0.0, 1.0, 0.5, 3.0])
        (i, w), (j, v) = a.EvalBarycentricWeights(x), b.EvalBarycentricWeights(x)
        assert i.dtype == j.dtype
        close(a.Eval(values, x), b.Eval(values, x), 1e-13)
        dense, want = np.zeros(12), np.zeros(12)
        np.add.at(dense, i, w)
        np.add.at(want, j, v)
        close(dense, want, 1e-15)


@pytest.mark.parametrize("seed", [0, 3, 5489])
def test_random_rotations_are_the_same_sequence(seed):
    a, b = _random.RandomGenerator(seed), pc.RandomGenerator(seed)
    assert [a() for _ in range(5)] == [b() for _ in range(5)]
    for _ in range(3):
        close(m.UniformlyRandomQuaternion(a).wxyz(), pm.UniformlyRandomQuaternion(b).wxyz(), 1e-15)
        close(m.UniformlyRandomRPY(a), pm.UniformlyRandomRPY(b), 1e-14)
        close(m.UniformlyRandomAngleAxis(a).angle(), pm.UniformlyRandomAngleAxis(b).angle(), 1e-14)
        close(m.UniformlyRandomRotationMatrix(a).matrix(), pm.UniformlyRandomRotationMatrix(b).matrix(), 1e-15)
    assert _random.RandomGenerator()() == pc.RandomGenerator()()


def test_probability_density():
    for name in ("kUniform", "kGaussian", "kExponential"):
        for x in ([0.5, 0.2], [0.5, -0.2], [1.0, 0.0], [3.0]):
            ours = _random.CalcProbabilityDensity(getattr(_random.RandomDistribution, name), x)
            close(ours, pc.CalcProbabilityDensity(getattr(pc.RandomDistribution, name), x), 1e-15)


def test_the_public_names_are_pydrakes():
    theirs = {name for name in dir(pm) if not name.startswith("_") and "𝓣" not in name}
    assert theirs - set(m.__all__) == {"functools", "np", "operator"}, "modules pydrake happens to import"
    assert set(m.__all__) <= theirs


def test_the_comparison_notices_a_planted_fault():
    """One ulp in a function, a wrong branch of the basis, and the other sign of a Lyapunov equation must not pass."""
    assert math.nextafter(m.sin(0.4), 1.0) != pm.sin(0.4)
    a, b = m.BsplineBasis(3, 5), pm.BsplineBasis(4, 5)
    with pytest.raises(AssertionError):
        close(a.EvaluateLinearInControlPoints(0.3), b.EvaluateLinearInControlPoints(0.3))
    A = np.array([[-1.0, 1.0], [0.0, -2.0]])
    with pytest.raises(AssertionError):
        close(m.RealContinuousLyapunovEquation(A.T, np.eye(2)), pm.RealContinuousLyapunovEquation(A, np.eye(2)))
