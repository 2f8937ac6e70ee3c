import copy
import pickle

import numpy as np
import pytest
from tests.unit.common.counting import calls_of

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.common.eigen_geometry import AngleAxis, Quaternion
from sheldrake.common.kernel import jit_enabled
from sheldrake.math import BsplineBasis, KnotVectorType, RigidTransform, RollPitchYaw, RotationMatrix
from sheldrake.polynomial import Polynomial
from sheldrake.symbolic import Expression, Variable
from sheldrake.trajectories import (
    BezierCurve,
    BsplineTrajectory,
    CompositeTrajectory,
    DerivativeTrajectory,
    DiscreteTimeTrajectory,
    ExponentialPlusPiecewisePolynomial,
    FunctionHandleTrajectory,
    PathParameterizedTrajectory,
    PathParameterizedTrajectory_,
    PiecewisePolynomial,
    PiecewisePolynomial_,
    PiecewisePose,
    PiecewiseQuaternionSlerp,
    PiecewiseQuaternionSlerp_,
    StackedTrajectory,
    StackedTrajectory_,
    Trajectory,
    Trajectory_,
    _bspline,
    _piecewise_polynomial,
)

BREAKS = [0.0, 0.5, 1.7, 2.0, 3.1]
SAMPLES = np.array([[1.0, 2.0, 0.5, 0.4, 3.0], [0.0, -1.0, -1.0, 2.0, 1.0]])
EPS = 1e-7


def slope(trajectory, t, order=1):
    """Central difference of the (order - 1)-th derivative."""
    return (trajectory.EvalDerivative(t + EPS, order - 1) - trajectory.EvalDerivative(t - EPS, order - 1)) / (2 * EPS)


def all_kinds():
    make = PiecewisePolynomial
    yield "zero", make.ZeroOrderHold(BREAKS, SAMPLES)
    yield "first", make.FirstOrderHold(BREAKS, SAMPLES)
    yield "pchip", make.CubicShapePreserving(BREAKS, SAMPLES)
    yield "pchip zero", make.CubicShapePreserving(BREAKS, SAMPLES, zero_end_point_derivatives=True)
    yield "spline", make.CubicWithContinuousSecondDerivatives(BREAKS, SAMPLES)
    yield "clamped", make.CubicWithContinuousSecondDerivatives(BREAKS, SAMPLES, [1.0, 2.0], [0.0, -1.0])
    yield (
        "periodic",
        make.CubicWithContinuousSecondDerivatives(
            BREAKS, np.hstack([SAMPLES[:, :-1], SAMPLES[:, :1]]), periodic_end_condition=True
        ),
    )
    yield "hermite", make.CubicHermite(BREAKS, SAMPLES, 0.1 * SAMPLES)
    yield "lagrange", make.LagrangeInterpolatingPolynomial(BREAKS, SAMPLES)


KINDS = dict(all_kinds())


@pytest.mark.parametrize("kind", KINDS)
def test_goes_through_its_samples(kind):
    p = KINDS[kind]
    expected = np.hstack([SAMPLES[:, :-1], SAMPLES[:, :1]]) if kind == "periodic" else SAMPLES
    found = p.vector_values(BREAKS)
    last = None if kind != "zero" else -1
    np.testing.assert_allclose(found[:, :last], expected[:, :last], atol=1e-12)
    np.testing.assert_allclose(p.value(-5.0), p.value(0.0))
    np.testing.assert_allclose(p.value(99.0), p.value(3.1))
    np.testing.assert_allclose(found, np.hstack([p.value(t) for t in BREAKS]), rtol=1e-15)


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_and_integrals_undo_each_other(kind):
    p = KINDS[kind]
    for t in (0.2, 0.9, 1.85, 2.7):
        np.testing.assert_allclose(p.EvalDerivative(t), slope(p, t), atol=1e-6)
        np.testing.assert_allclose(p.derivative(2).value(t), p.EvalDerivative(t, 2), atol=1e-10)
        np.testing.assert_allclose(p.integral([[1.0], [2.0]]).derivative().value(t), p.value(t), atol=1e-12)
    whole = p.integral(0.5)
    np.testing.assert_allclose(whole.value(0.0), 0.5)
    before, after = whole.value(0.5 - 1e-12), whole.value(0.5)
    np.testing.assert_allclose(before, after, atol=1e-10)


def test_smoothness_at_the_breaks():
    def jumps(p, order):
        return max(np.abs(p.EvalDerivative(t - 1e-10, order) - p.EvalDerivative(t, order)).max() for t in BREAKS[1:-1])

    assert jumps(KINDS["first"], 0) < 1e-8 and jumps(KINDS["first"], 1) > 0.1
    assert jumps(KINDS["pchip"], 1) < 1e-7
    for kind in ("spline", "clamped", "periodic"):
        assert jumps(KINDS[kind], 2) < 1e-6, kind
    p = KINDS["periodic"]
    for order in (0, 1, 2):
        np.testing.assert_allclose(p.EvalDerivative(0.0, order), p.EvalDerivative(3.1, order), atol=1e-9)
    np.testing.assert_allclose(KINDS["clamped"].EvalDerivative(0.0), [[1.0], [2.0]], atol=1e-12)
    np.testing.assert_allclose(KINDS["pchip zero"].EvalDerivative(3.1), 0.0, atol=1e-12)


def test_shape_preserving_does_not_overshoot():
    p = PiecewisePolynomial.CubicShapePreserving([0, 1, 2, 3, 4.0], [[0, 0, 1, 1, 1.0]])
    y = p.vector_values(np.linspace(0, 4, 401))
    assert y.min() >= 0.0 and y.max() <= 1.0 and (np.diff(y) >= -1e-15).all()


def test_matrices_as_samples():
    p = PiecewisePolynomial.FirstOrderHold([0.0, 1.0], [np.eye(2), np.zeros((2, 2))])
    np.testing.assert_array_equal(p.value(0.25), 0.75 * np.eye(2))
    with pytest.raises(RuntimeError, match="only supports vector-valued"):
        p.vector_values([0.0])
    row = PiecewisePolynomial.FirstOrderHold([0.0, 1.0], [np.zeros((1, 3)), np.ones((1, 3))])
    assert row.vector_values([0.0, 0.5]).shape == (2, 3)
    constant = PiecewisePolynomial([[1.0, 2.0]])
    assert constant.start_time() == -np.inf and constant.value(1e9).tolist() == [[1.0, 2.0]]


def test_segments():
    p = KINDS["first"].Clone()
    assert p.get_number_of_segments() == 4 and p.get_segment_times() == BREAKS
    assert [p.get_segment_index(t) for t in (-1.0, 0.5, 1.0, 3.1, 9.0)] == [0, 1, 1, 3, 3]
    assert p.is_time_in_range(3.1) and not p.is_time_in_range(3.2)
    assert (p.start_time(1), p.end_time(1), p.duration(2)) == (0.5, 1.7, pytest.approx(0.3))
    with pytest.raises(RuntimeError, match=r"Segment number 4 out of range \[0, 4\)"):
        p.duration(4)
    assert p.getPolynomial(0, 1).GetCoefficients().tolist() == [0.0, -2.0]
    assert p.getPolynomialMatrix(1).shape == (2, 1) and p.getSegmentPolynomialDegree(0) == 1
    q = PiecewisePolynomial([p.getPolynomialMatrix(i) for i in range(4)], BREAKS)
    assert q.isApprox(p, 1e-15) and not q.isApprox(KINDS["pchip"], 1e-3)
    scalar = PiecewisePolynomial([Polynomial([1.0, 2.0]), Polynomial([3.0])], [0.0, 1.0, 2.0])
    assert scalar.value(0.5)[0, 0] == 2.0 and scalar.value(1.5)[0, 0] == 3.0
    p.setPolynomialMatrixBlock([[Polynomial([7.0, 0.0, 1.0])]], 0, 1, 0)
    np.testing.assert_allclose(p.value(0.25), [[1.5], [7.0625]])
    assert p.breaks.tolist() == BREAKS and p.polynomials.shape == (4, 2, 1, 3)


def test_changes_in_time():
    p = KINDS["pchip"]
    for t in (0.1, 1.2, 2.9):
        q = p.Clone()
        q.shiftRight(2.0)
        np.testing.assert_allclose(q.value(t + 2.0), p.value(t), atol=1e-12)
        q.ScaleTime(3.0)
        np.testing.assert_allclose(q.value(3.0 * (t + 2.0)), p.value(t), atol=1e-12)
        q = p.Clone()
        q.ReverseTime()
        np.testing.assert_allclose(q.value(-t), p.value(t), atol=1e-12)
    piece = p.slice(1, 2)
    assert piece.get_segment_times() == [0.5, 1.7, 2.0]
    joined = p.slice(0, 1)
    joined.ConcatenateInTime(piece)
    joined.ConcatenateInTime(p.slice(3, 1))
    assert joined.isApprox(p, 1e-14)
    joined.RemoveFinalSegment()
    assert joined.end_time() == 2.0
    joined.AppendFirstOrderSegment(2.5, [1.0, 1.0])
    np.testing.assert_allclose(joined.value(2.5), [[1.0], [1.0]])
    joined.AppendCubicHermiteSegment(3.0, [2.0, 2.0], [0.5, -0.5])
    np.testing.assert_allclose(joined.EvalDerivative(3.0), [[0.5], [-0.5]], atol=1e-12)
    np.testing.assert_allclose(joined.EvalDerivative(2.5 - 1e-9), joined.EvalDerivative(2.5), atol=1e-6)
    with pytest.raises(RuntimeError, match="begins at"):
        p.Clone().ConcatenateInTime(p)
    with pytest.raises(RuntimeError, match="not after the end"):
        joined.AppendFirstOrderSegment(3.0, [1.0, 1.0])


def test_shapes_and_sums():
    p = PiecewisePolynomial.FirstOrderHold([0.0, 1.0], [np.arange(6.0).reshape(2, 3), np.ones((2, 3))])
    np.testing.assert_array_equal(p.Transpose().value(0.3), p.value(0.3).T)
    np.testing.assert_array_equal(p.Block(0, 1, 2, 2).value(0.3), p.value(0.3)[:, 1:])
    q = p.Clone()
    q.Reshape(3, 2)
    np.testing.assert_array_equal(q.value(0.0), np.arange(6.0).reshape(2, 3).reshape(3, 2, order="F"))
    np.testing.assert_allclose((p + p).value(0.3), 2.0 * p.value(0.3))
    for wrong in (lambda: p.Block(0, 0, 3, 1), lambda: q.Reshape(5, 1), lambda: p + KINDS["first"]):
        with pytest.raises(RuntimeError):
            wrong()


def test_copies_are_independent():
    p = KINDS["first"]
    for q in (copy.copy(p), copy.deepcopy(p), p.Clone(), pickle.loads(pickle.dumps(p))):
        q.shiftRight(1.0)
        q.setPolynomialMatrixBlock([[Polynomial([7.0])]], 0)
        assert p.start_time() == 0.0 and p.value(0.0)[0, 0] == 1.0


@pytest.mark.parametrize(
    "make, error, words",
    [
        (lambda: PiecewisePolynomial.ZeroOrderHold([0.0, 1.0], [[1.0, 2.0, 3.0]]), RuntimeError, "does not match"),
        (lambda: PiecewisePolynomial.ZeroOrderHold([0.0, 1.0, 0.5], [[1.0, 2.0, 3.0]]), RuntimeError, "increasing"),
        (lambda: PiecewisePolynomial.ZeroOrderHold([0.0, 1.0, np.nan], [[1.0, 2.0, 3.0]]), RuntimeError, "increasing"),
        (lambda: PiecewisePolynomial.FirstOrderHold([0.0], [[1.0]]), RuntimeError, "at least 2"),
        (lambda: PiecewisePolynomial.CubicShapePreserving([0.0, 1.0], [[1.0, 2.0]]), RuntimeError, "at least 3"),
        (lambda: PiecewisePolynomial.FirstOrderHold([0.0, 1.0], [1.0, 2.0]), TypeError, "samples"),
        (
            lambda: PiecewisePolynomial.FirstOrderHold([0.0, 1.0], [np.ones((2, 1)), np.ones((1, 1))]),
            RuntimeError,
            "inconsistent dimensions",
        ),
        (lambda: PiecewisePolynomial.CubicHermite([0.0, 1.0], [[1.0, 2.0]], [[0.0]]), RuntimeError, "different length"),
        (lambda: PiecewisePolynomial().rows(), RuntimeError, "no segments"),
        (lambda: KINDS["first"].derivative(-1), RuntimeError, "negative"),
        (lambda: KINDS["first"].value("a"), TypeError, "number of type float"),
        (lambda: KINDS["first"].value(AutoDiffXd(1.0)), TypeError, "number of type float"),
        (lambda: PiecewisePolynomial(1.0), TypeError, "matrix"),
        (lambda: Trajectory().value(1.0), RuntimeError, "pure virtual"),
    ],
)
def test_errors(make, error, words):
    with pytest.raises(error, match=words):
        make()


# Orientations and poses


def rpy(*angles):
    return RotationMatrix(RollPitchYaw(*angles))


def test_slerp_turns_at_constant_rate():
    rotations = [rpy(0.0, 0.0, 0.0), rpy(0.3, 0.2, 0.5), rpy(-0.3, 1.2, 0.5)]
    s = PiecewiseQuaternionSlerp([0.0, 1.0, 3.0], rotations)
    for t, R in zip((0.0, 1.0, 3.0), rotations):
        np.testing.assert_allclose(RotationMatrix(s.orientation(t)).matrix(), R.matrix(), atol=1e-12)
    for t in (0.3, 1.9, 2.5):
        R, h = RotationMatrix(s.orientation(t)).matrix(), 1e-6
        Rdot = (RotationMatrix(s.orientation(t + h)).matrix() - RotationMatrix(s.orientation(t - h)).matrix()) / (2 * h)
        W = Rdot @ R.T
        np.testing.assert_allclose(s.angular_velocity(t), [W[2, 1], W[0, 2], W[1, 0]], atol=1e-8)
        np.testing.assert_array_equal(s.EvalDerivative(t)[:, 0], s.angular_velocity(t))
        np.testing.assert_array_equal(s.MakeDerivative().value(t)[:, 0], s.angular_velocity(t))
        np.testing.assert_array_equal(s.angular_acceleration(t), 0.0)
    flipped = PiecewiseQuaternionSlerp(
        [0.0, 1.0], [rotations[0].ToQuaternion(), Quaternion(-rotations[1].ToQuaternion().wxyz())]
    )
    np.testing.assert_allclose(flipped.value(0.4), s.value(0.4), atol=1e-15)
    s.Append(4.0, AngleAxis(0.5, [1.0, 0.0, 0.0]))
    s.Append(time=5.0, rotation_matrix=RotationMatrix())
    assert s.end_time() == 5.0 and s.rows() == 4 and s.vector_values([0.0, 1.0]).shape == (4, 2)
    still = PiecewiseQuaternionSlerp([0.0, 1.0], [RotationMatrix(), RotationMatrix()])
    np.testing.assert_array_equal(still.angular_velocity(0.5), 0.0)
    for wrong in (
        lambda: PiecewiseQuaternionSlerp([0.0, 1.0], [Quaternion()]),
        lambda: PiecewiseQuaternionSlerp([0.0], [Quaternion()]),
        lambda: s.Append(4.5, Quaternion()),
        lambda: PiecewiseQuaternionSlerp().value(0.0),
    ):
        with pytest.raises(RuntimeError):
            wrong()


def test_poses():
    poses = [RigidTransform(rpy(0.3 * i, 0.2, 0.1 * i), [i, 2.0, 3.0 * i]) for i in range(3)]
    for p in (
        PiecewisePose.MakeLinear([0.0, 1.0, 2.0], poses),
        PiecewisePose.MakeCubicLinearWithEndLinearVelocity([0.0, 1.0, 2.0], poses, [1, 0, 0], end_vel=[0, 1, 0]),
    ):
        for t, X in zip((0.0, 1.0, 2.0), poses):
            assert p.GetPose(t).IsNearlyEqualTo(X, 1e-12)
        t, h = 0.6, 1e-6
        linear = (p.GetPose(t + h).translation() - p.GetPose(t - h).translation()) / (2 * h)
        np.testing.assert_allclose(p.GetVelocity(t)[3:], linear, atol=1e-8)
        np.testing.assert_array_equal(p.GetVelocity(t)[:3], p.get_orientation_trajectory().angular_velocity(t))
        np.testing.assert_allclose(p.GetAcceleration(t), p.EvalDerivative(t, 2)[:, 0])
        np.testing.assert_allclose(p.MakeDerivative().value(t), p.EvalDerivative(t))
        np.testing.assert_array_equal(p.GetVelocity(9.0), 0.0)
        np.testing.assert_array_equal(p.value(t), p.GetPose(t).GetAsMatrix4())
        assert p.IsApprox(p.Clone(), 1e-14)
    np.testing.assert_allclose(p.GetVelocity(0.0)[3:], [1, 0, 0], atol=1e-12)
    assert not p.IsApprox(PiecewisePose.MakeLinear([0.0, 1.0, 2.0], poses), 1e-3)
    with pytest.raises(RuntimeError, match="different breaks"):
        PiecewisePose(
            PiecewisePolynomial.FirstOrderHold([0.0, 1.0], np.eye(3)[:, :2]),
            PiecewiseQuaternionSlerp([0.0, 2.0], [RotationMatrix(), RotationMatrix()]),
        )


# Curves and compositions


def test_bezier_curves():
    b = BezierCurve(1.0, 3.0, [[1.0, 2.0, 3.0, 5.0], [4.0, 5.0, 7.0, 0.0]])
    np.testing.assert_allclose(b.value(1.0)[:, 0], [1.0, 4.0])
    np.testing.assert_allclose(b.value(3.0)[:, 0], [5.0, 0.0])
    for t in (1.3, 2.2):
        weights = [b.BernsteinBasis(i, t) for i in range(4)]
        assert sum(weights) == pytest.approx(1.0)
        np.testing.assert_allclose(b.control_points() @ weights, b.value(t)[:, 0])
        np.testing.assert_allclose(b.EvalDerivative(t), slope(b, t), atol=1e-6)
        np.testing.assert_allclose(b.MakeDerivative(2).value(t), b.EvalDerivative(t, 2))
        for order in (1, 2, 3):
            points = b.control_points() @ b.AsLinearInControlPoints(order).toarray()
            np.testing.assert_allclose(points, b.MakeDerivative(order).control_points(), atol=1e-12)
        higher = b.Clone()
        higher.ElevateOrder()
        np.testing.assert_allclose(higher.value(t), b.value(t), rtol=1e-14)
        s = Variable("s")
        values = [e.Evaluate({s: t}) for e in b.GetExpression(s)]
        np.testing.assert_allclose(values, b.value(t)[:, 0], rtol=1e-12)
    np.testing.assert_array_equal(b.MakeDerivative(9).value(2.0), 0.0)
    assert BezierCurve().order() == -1 and BezierCurve().value(0.0).shape == (0, 1)
    with pytest.raises(RuntimeError, match="before the start"):
        BezierCurve(1.0, 0.0, [[1.0]])


def test_expressions_of_several_curves_are_in_one_variable():
    curves = [BezierCurve(0.0, 2.0, [points]) for points in ([1.0, 2.0, 0.5], [0.0, 3.0])]
    total = sum(curve.GetExpression()[0] for curve in curves)
    (t,) = total.GetVariables()
    assert total.Evaluate({t: 0.7}) == pytest.approx(sum(curve.value(0.7)[0, 0] for curve in curves))


def test_composition():
    pp = PiecewisePolynomial.CubicShapePreserving([0.0, 1.0, 2.0], [[0.0, 0.4, 2.0]])
    curve = BezierCurve(0.0, 2.0, [[1.0, 2.0, 3.0, -4.0], [4.0, 5.0, 7.0, 1.0]])
    path = PathParameterizedTrajectory(curve, pp)
    stacked = StackedTrajectory()
    stacked.Append(pp)
    stacked.Append(curve)
    side = StackedTrajectory(rowwise=False)
    side.Append(curve)
    side.Append(curve)
    composite = CompositeTrajectory([curve, BezierCurve(2.0, 3.0, [[1.0, 2.0], [0.0, 1.0]])])
    aligned = CompositeTrajectory.AlignAndConcatenate([curve, curve, curve])
    np.testing.assert_allclose(path.value(0.7), curve.value(pp.value(0.7)[0, 0]))
    np.testing.assert_allclose(stacked.value(0.7), np.vstack([pp.value(0.7), curve.value(0.7)]))
    np.testing.assert_allclose(side.value(0.7), np.hstack([curve.value(0.7), curve.value(0.7)]))
    np.testing.assert_allclose(composite.value(2.5), [[1.5], [0.5]])
    assert aligned.end_time() == 6.0 and aligned.get_number_of_segments() == 3
    np.testing.assert_allclose(aligned.value(4.7), curve.value(0.7), atol=1e-12)
    for trajectory in (path, stacked, side, composite, aligned, DerivativeTrajectory(curve)):
        for order in (1, 2, 3):
            np.testing.assert_allclose(trajectory.EvalDerivative(0.7, order), slope(trajectory, 0.7, order), atol=1e-5)
            np.testing.assert_allclose(
                trajectory.MakeDerivative(order).value(0.7), trajectory.EvalDerivative(0.7, order), atol=1e-10
            )
    pp.shiftRight(100.0)  # Those that were given it keep it as it was.
    assert path.end_time() == 2.0 and stacked.end_time() == 2.0
    for wrong in (
        lambda: CompositeTrajectory([curve, curve]),
        lambda: CompositeTrajectory([curve, BezierCurve(2.0, 3.0, [[1.0]])]),
        lambda: CompositeTrajectory([]).rows(),
        lambda: PathParameterizedTrajectory(curve, curve),
        lambda: stacked.Append(PiecewisePolynomial([[1.0]])),
        lambda: side.Append(BezierCurve(0.0, 2.0, [[1.0]])),
        lambda: DerivativeTrajectory(FunctionHandleTrajectory(lambda t: [t], 1)),
        lambda: DerivativeTrajectory(curve, -1),
    ):
        with pytest.raises(RuntimeError):
            wrong()
    with pytest.raises(TypeError):
        CompositeTrajectory([1.0])


def test_a_sine_of_all_times_is_made_without_a_warning():
    with np.errstate(invalid="raise"):
        wave = FunctionHandleTrajectory(lambda t: np.sin([t]), 1)
    assert wave.value(1.0) == pytest.approx(np.sin(1.0))


def test_functions_as_trajectories():
    f = FunctionHandleTrajectory(lambda t: np.array([t, t * t]), rows=2, start_time=0.0, end_time=4.0)
    assert f.value(3.0).tolist() == [[3.0], [9.0]] and not f.has_derivative() and f.end_time() == 4.0
    with pytest.raises(RuntimeError, match="set_derivative"):
        f.EvalDerivative(1.0)
    f.set_derivative(lambda t, order: [1.0, 2.0 * t] if order == 1 else [0.0, 2.0])
    assert f.EvalDerivative(3.0).tolist() == [[1.0], [6.0]] and f.MakeDerivative(2).value(3.0)[1, 0] == 2.0
    with pytest.raises(RuntimeError, match="returned a matrix of size 2x1"):
        FunctionHandleTrajectory(lambda t: [t, t], 3).value(0.0)


def test_discrete_times():
    d = DiscreteTimeTrajectory([0.0, 1.0, 2.0], [[1.0], [2.0], [3.0]], time_comparison_tolerance=1e-9)
    assert d.value(1.0 + 1e-10)[0, 0] == 2.0 and d.num_times() == 3 and d.get_times() == [0.0, 1.0, 2.0]
    assert d.ToZeroOrderHold().value(1.5)[0, 0] == 2.0 and (d.start_time(), d.end_time()) == (0.0, 2.0)
    for wrong in (
        lambda: d.value(1.1),
        lambda: d.EvalDerivative(1.0),
        lambda: DiscreteTimeTrajectory([0.0, 1.0], [[1.0]]),
        lambda: DiscreteTimeTrajectory([1.0, 0.0], [[1.0], [2.0]]),
    ):
        with pytest.raises(RuntimeError):
            wrong()


def test_exponentials():
    p = PiecewisePolynomial.FirstOrderHold([0.0, 1.0, 2.0], [[1.0, 2.0, 5.0]])
    e = ExponentialPlusPiecewisePolynomial([[1.0]], [[2.0]], [[1.0, 2.0]], p)
    assert e.value(0.3)[0, 0] == pytest.approx(np.exp(0.6) + 1.3)
    assert e.value(1.5)[0, 0] == pytest.approx(2.0 * np.exp(1.0) + 3.5)
    e.shiftRight(1.0)
    assert e.value(1.3)[0, 0] == pytest.approx(np.exp(0.6) + 1.3) and e.start_time() == 1.0
    with pytest.raises(RuntimeError, match="shapes"):
        ExponentialPlusPiecewisePolynomial([[1.0]], [[2.0]], [[1.0]], p)


def test_a_users_own_trajectory():
    class Parabola(Trajectory):
        def __init__(self):
            Trajectory.__init__(self)

        def do_rows(self):
            return 2

        def do_cols(self):
            return 1

        def do_start_time(self):
            return 0.0

        def do_end_time(self):
            return 2.0

        def do_value(self, t):
            return [t, t * t]

        def do_has_derivative(self):
            return True

        def DoEvalDerivative(self, t, derivative_order):
            return [[1.0], [2.0 * t]] if derivative_order == 1 else [[0.0], [2.0]]

        def DoMakeDerivative(self, derivative_order):
            return DerivativeTrajectory(self, derivative_order)

        def __deepcopy__(self, memo):
            return Parabola()

    own = Parabola()
    assert own.value(3.0).tolist() == [[3.0], [9.0]] and own.vector_values([0.0, 2.0]).tolist() == [[0, 2], [0, 4]]
    assert own.MakeDerivative().value(1.5).tolist() == [[1.0], [3.0]]
    stacked = StackedTrajectory()
    stacked.Append(own)
    assert CompositeTrajectory([own]).value(1.0).tolist() == stacked.value(1.0).tolist() == [[1.0], [1.0]]
    assert isinstance(own.Clone(), Parabola)


# Other scalars


def test_autodiff():
    make = PiecewisePolynomial_[AutoDiffXd]
    samples = np.array([[AutoDiffXd(1.0, [1.0, 0.0]), AutoDiffXd(2.0), AutoDiffXd(3.0, [0.0, 1.0])]])
    linear = make.FirstOrderHold([0.0, 1.0, 2.0], samples)
    y = linear.value(0.25)[0, 0]
    assert y.value() == 1.25 and y.derivatives().tolist() == [0.75, 0.0]
    assert linear.value(AutoDiffXd(0.25, [0.0, 1.0]))[0, 0].derivatives().tolist() == [0.75, 1.0]
    spline = make.CubicWithContinuousSecondDerivatives([0.0, 1.0, 2.0], samples, [0.0], [0.0])
    h = 1e-6

    def at(first):
        return PiecewisePolynomial.CubicWithContinuousSecondDerivatives(
            [0.0, 1.0, 2.0], [[first, 2.0, 3.0]], [0.0], [0.0]
        ).value(1.4)[0, 0]

    assert spline.value(1.4)[0, 0].derivatives()[0] == pytest.approx((at(1 + h) - at(1 - h)) / (2 * h), abs=1e-8)
    assert isinstance(linear, PiecewisePolynomial_[AutoDiffXd]) and not isinstance(linear, PiecewisePolynomial)
    assert isinstance(linear, Trajectory_[AutoDiffXd]) and not isinstance(linear, Trajectory)
    slerp = PiecewiseQuaternionSlerp_[AutoDiffXd]
    q = slerp([0.0, 1.0], [np.eye(3), rpy(0.1, 0.2, 0.3).matrix()]).value(AutoDiffXd(0.5, [1.0]))
    plain = PiecewiseQuaternionSlerp([0.0, 1.0], [np.eye(3), rpy(0.1, 0.2, 0.3).matrix()])
    difference = (plain.value(0.5 + h) - plain.value(0.5 - h)) / (2 * h)
    np.testing.assert_allclose([x.derivatives()[0] for x in q[:, 0]], difference[:, 0], atol=1e-8)


def test_symbols():
    t = Variable("t")
    make = PiecewisePolynomial_[Expression]
    assert str(make.FirstOrderHold([0, 1], [[0, 2.0]]).value(t * 1)[0, 0]) == "(2 * min(1, max(0, t)))"
    many = make.FirstOrderHold([0, 1, 2], [[0, 2.0, -1.0]]).value(t * 1)[0, 0]
    plain = PiecewisePolynomial.FirstOrderHold([0, 1, 2], [[0, 2.0, -1.0]])
    for at in (-1.0, 0.3, 1.0, 1.8, 5.0):
        assert many.Evaluate({t: at}) == pytest.approx(plain.value(at)[0, 0])


def test_bspline_trajectories():
    basis = BsplineBasis(4, 7, KnotVectorType.kClampedUniform, 1.0, 3.0)
    points = [np.array([[i * 1.0, i * i], [np.sin(i), 1.0]]) for i in range(7)]
    b = BsplineTrajectory(basis, points)
    assert (b.rows(), b.cols(), b.num_control_points()) == (2, 2, 7)
    np.testing.assert_allclose(b.InitialValue(), points[0])
    np.testing.assert_allclose(b.FinalValue(), points[-1])
    for t in (1.2, 1.9, 2.7):
        for order in (1, 2):
            np.testing.assert_allclose(b.EvalDerivative(t, order), slope(b, t, order), atol=1e-5)
        weights = b.EvaluateLinearInControlPoints(t, 1)
        np.testing.assert_allclose(sum(w * p for w, p in zip(weights, points)), b.EvalDerivative(t), atol=1e-12)
        finer = b.Clone()
        finer.InsertKnots([1.3, 2.0, 2.0, 2.9])
        np.testing.assert_allclose(finer.value(t), b.value(t), atol=1e-13)
        np.testing.assert_array_equal(b.CopyBlock(0, 1, 2, 1).value(t), b.value(t)[:, 1:])
    assert finer.num_control_points() == 11 and b.num_control_points() == 7
    scalar = BsplineTrajectory(basis, [list(range(7))])
    linear = scalar.AsLinearInControlPoints(2)
    new = np.arange(7.0) @ linear.toarray()
    np.testing.assert_allclose(new, np.hstack(scalar.MakeDerivative(2).control_points())[0], atol=1e-12)
    assert b.CopyBlock(0, 0, 2, 1).CopyHead(1).rows() == 1
    for wrong in (
        lambda: BsplineTrajectory(basis, points[:5]),
        lambda: BsplineTrajectory().value(0.0),
        lambda: b.InsertKnots([9.0]),
        lambda: b.CopyHead(1),
    ):
        with pytest.raises(RuntimeError):
            wrong()


def test_function_of_the_wrong_size_is_refused_at_once():
    with pytest.raises(RuntimeError, match=r"1x1.*2x1"):
        FunctionHandleTrajectory(lambda t: np.array([[1.0]]), rows=2)


def test_quaternion_samples_have_the_sign_nearer_to_the_one_before():
    q = Quaternion(0.6, 0.8, 0.0, 0.0)
    s = PiecewiseQuaternionSlerp([0.0, 1.0], [q, Quaternion(-0.6, -0.8, 0.0, 0.0)])
    np.testing.assert_array_equal([sample.wxyz() for sample in s.get_quaternion_samples()], [q.wxyz(), q.wxyz()])


def test_values_are_few_calls():
    times = np.linspace(0.0, 1.0, 5)
    points = np.random.default_rng(0).normal(size=(3, 5))
    poses = [RigidTransform(RotationMatrix.MakeZRotation(t), [t, 0.0, 0.0]) for t in times]
    cubic = PiecewisePolynomial.CubicShapePreserving(times, points)
    motion = PiecewisePose.MakeLinear(times, poses)
    spline = BsplineTrajectory(BsplineBasis(4, 5), points)
    for ask, most in ((cubic.value, 13), (spline.value, 50), (motion.GetPose, 63), (motion.GetVelocity, 38)):
        assert calls_of(lambda ask=ask: ask(0.3)) <= most
    if jit_enabled():
        for ask in (cubic.value, spline.value, motion.GetPose, motion.GetVelocity):
            for _ in range(4):
                ask(0.3)
            assert calls_of(lambda ask=ask: ask(0.3)) <= 7


@pytest.mark.parametrize(
    "make",
    [
        PiecewisePolynomial.ZeroOrderHold,
        PiecewisePolynomial.FirstOrderHold,
        PiecewisePolynomial.CubicShapePreserving,
        PiecewisePolynomial.CubicWithContinuousSecondDerivatives,
        lambda times, points: PiecewisePolynomial.CubicHermite(times, points, points),
        lambda times, points: BsplineTrajectory(BsplineBasis(4, len(times)), points).MakeDerivative(),
    ],
)
def test_many_segments_are_made_in_as_many_calls_as_few(make):
    few, many = (
        calls_of(lambda n=n: make(np.linspace(0.0, 1.0, n), np.random.default_rng(0).normal(size=(3, n))))
        for n in (6, 106)
    )
    assert many - few <= 200  # two a segment: conversions of numbers, no arithmetic on arrays


CURVES = {
    "polynomial": lambda: PiecewisePolynomial.CubicShapePreserving([0.0, 1.0, 2.0, 3.0], SOME[:, :4]),
    "steps": lambda: PiecewisePolynomial.ZeroOrderHold([0.0, 1.0, 2.0], SOME[:, :3]),
    "constant": lambda: PiecewisePolynomial(SOME[:, :2]),
    "degrees": lambda: PiecewisePolynomial(
        [np.array([[Polynomial([1.0, 2.0, 3.0])]]), np.array([[Polynomial([4.0])]])], [0.0, 1.0, 3.0]
    ),
    "spline": lambda: BsplineTrajectory(BsplineBasis(4, 6), SOME),
    "open spline": lambda: BsplineTrajectory(BsplineBasis(3, 6, KnotVectorType.kUniform, -1.0, 2.0), SOME),
    "spline of matrices": lambda: BsplineTrajectory(BsplineBasis(2, 3), list(SOME.reshape(3, 2, 3))),
    "Bezier": lambda: BezierCurve(0.5, 2.0, SOME),
    "composite": lambda: CompositeTrajectory([BezierCurve(k, k + 1.0, SOME[:, k : k + 3]) for k in range(3)]),
    "path": lambda: PathParameterizedTrajectory(
        BsplineTrajectory(BsplineBasis(4, 6), SOME), PiecewisePolynomial.FirstOrderHold([0.0, 3.0], [[0.0, 1.0]])
    ),
}
SOME = np.random.default_rng(4).normal(size=(3, 6))


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("order", range(4))
def test_values_are_the_same_however_often_they_are_asked_for(curve, order):
    first, again = (CURVES[curve]() for _ in range(2))
    for t in (-0.5, 0.0, 0.3, 1.0, 1.7, 2.0, 3.0, 4.5):
        for _ in range(3):
            again.EvalDerivative(t, order)
        for when in (t, np.float64(t), np.array(t)):
            value = again.EvalDerivative(when, order)
            np.testing.assert_allclose(value, first.Clone().EvalDerivative(t, order), rtol=1e-12, atol=1e-12)
            value += 1.0  # is ours to change
    if jit_enabled() and curve != "path":
        assert calls_of(lambda: again.EvalDerivative(0.3, order)) <= 11
    with pytest.raises(TypeError):
        again.EvalDerivative("0.3", order)
    if order == 0:
        times = np.array([0.1, 0.9, 1.4])
        if 1 in (first.rows(), first.cols()):
            np.testing.assert_array_equal(
                again.vector_values(times).ravel("F"), np.ravel([again.value(t) for t in times])
            )
        for copied in (copy.deepcopy(again), pickle.loads(pickle.dumps(again))):
            np.testing.assert_allclose(copied.value(0.3), again.value(0.3), rtol=1e-12)


def test_values_after_changes():
    line = PiecewisePolynomial.FirstOrderHold([0.0, 1.0], [[0.0, 1.0]])
    other = PiecewisePolynomial.FirstOrderHold([-2.0, 1.0], [[3.0, 4.0]])
    other.shiftRight(3.5)
    changes = [
        lambda: line.AppendFirstOrderSegment(1.5, [3.0]),
        lambda: line.AppendCubicHermiteSegment(2.0, [1.0], [0.5]),
        lambda: line.RemoveFinalSegment(),
        lambda: line.ConcatenateInTime(other),
        lambda: line.ReverseTime(),
        lambda: line.ScaleTime(0.5),
        lambda: line.shiftRight(1.25),
        lambda: line.setPolynomialMatrixBlock(Polynomial([5.0, 1.0]), 0),
        lambda: setattr(line, "breaks", line.breaks - 1.0),
        lambda: setattr(line, "polynomials", 2.0 * line.polynomials),
        lambda: setattr(line, "polynomials", np.ones((line.get_number_of_segments(), 2, 3, 2))),
        lambda: line.Reshape(3, 2),
    ]
    for change in changes:
        if change is changes[3]:
            other.shiftRight(line.end_time() - other.start_time())
        change()
        for _ in range(6):
            for t in (-3.0, -1.6, -0.2, 0.4, 1.2):
                fresh = line.Clone()
                np.testing.assert_allclose(line.value(t), fresh.value(t), atol=1e-14)
                np.testing.assert_allclose(line.EvalDerivative(t), fresh.EvalDerivative(t), atol=1e-14)
    curve, spline = BezierCurve(0.0, 1.0, SOME), BsplineTrajectory(BsplineBasis(3, 6), SOME)
    for changed, change in ((curve, curve.ElevateOrder), (spline, lambda: spline.InsertKnots([0.4]))):
        before = [changed.value(0.3) for _ in range(6)]
        change()
        np.testing.assert_allclose([changed.value(0.3) for _ in range(6)], before, atol=1e-14)


@pytest.mark.parametrize("curve", [c for c in CURVES if c not in ("path", "composite")])
def test_kernels_of_values_have_the_bits_of_their_source(curve):
    t = 0.37
    made, seen = CURVES[curve](), []
    with pytest.MonkeyPatch.context() as patch:
        for module in (_piecewise_polynomial, _bspline):
            patch.setattr(module, "query", lambda kernel, *args, out: seen.append((kernel, args, out)))
        made._make_query(1)
    (kernel, args, out) = seen[0]
    args = [t if isinstance(a, float) else a for a in args]
    kernel(*args, out)
    plain = out.copy()
    kernel.native(*args, out)
    np.testing.assert_array_equal(out, plain)


def test_a_trajectory_derived_from_ours_may_give_lists():
    class Mine(PiecewisePolynomial):
        def do_value(self, t):
            return [1.0, t]

    assert Mine(np.zeros((2, 1))).value(3.0).tolist() == [[1.0], [3.0]]


def test_derivatives_of_paths_are_trajectories_of_their_own_scalar():
    ramp = PiecewisePolynomial_[AutoDiffXd].FirstOrderHold([0.0, 1.0], [[0.0, 1.0]])
    slope = PathParameterizedTrajectory_[AutoDiffXd](ramp, ramp).MakeDerivative()
    assert isinstance(slope, Trajectory_[AutoDiffXd])
    stacked = StackedTrajectory_[AutoDiffXd]()
    stacked.Append(slope)
    assert stacked.value(0.5)[0, 0].value() == 1.0


def test_appending_what_does_not_fit_leaves_the_trajectory_as_it_was():
    line = PiecewisePolynomial.FirstOrderHold([0.0, 1.0], [[0.0, 1.0]])
    for _ in range(6):  # so many times that values come from a kernel
        assert line.value(0.5) == 0.5
    with pytest.raises(TypeError):
        line.AppendCubicHermiteSegment(2.0, [0.0], "slope")
    with pytest.raises(RuntimeError, match="the sample is"):
        line.AppendCubicHermiteSegment(2.0, [0.0], [0.0, 0.0])
    assert line.get_segment_times() == [0.0, 1.0]
    line.AppendCubicHermiteSegment(2.0, [1.0], [0.0])
    assert line.value(2.0) == 1.0
    assert line.EvalDerivative(2.0) == 0.0


def test_a_derivative_is_no_part_of_its_curve():
    points = np.array([[0.0, 1.0, 4.0]])
    for curve in BezierCurve(0.0, 1.0, points), BsplineTrajectory(BsplineBasis(3, 3), [[p] for p in points.T]):
        before = curve.value(0.25)
        slope = curve.MakeDerivative()
        assert slope.value(0.25).item() == pytest.approx(2.0 * (0.75 * 1.0 + 0.25 * 3.0))
        slope.ElevateOrder() if isinstance(slope, BezierCurve) else slope.InsertKnots([0.5])
        assert curve.value(0.25) == before


def test_poses_asked_often_are_those_of_the_long_way():
    """From the fourth call on they come from kernels; whoever has a part of the motion may change it."""
    times = [0.0, 0.5, 2.0]
    poses = [RigidTransform(RotationMatrix.MakeZRotation(2.0 * t), [t * t, 1.0, -t]) for t in times]
    often, once = PiecewisePose.MakeLinear(times, poses), PiecewisePose.MakeLinear(times, poses)
    for ask in ("GetPose", "GetVelocity", "value"):
        for _ in range(5):
            getattr(often, ask)(0.1)
    for t in (-1.0, 0.0, 0.3, 0.5, 1.9, 2.0, 7.0):
        first = PiecewisePose.MakeLinear(times, poses)
        X = first.GetPose(t)
        assert often.GetPose(t).IsExactlyEqualTo(X)
        np.testing.assert_array_equal(often.GetVelocity(t), first.GetVelocity(t))
        np.testing.assert_array_equal(often.value(t), X.GetAsMatrix4())
    assert not often.GetPose(0.3).translation().flags.writeable
    with pytest.raises(TypeError):
        often.GetPose("soon")
    again = often.Clone()
    assert again.GetPose(0.3).IsExactlyEqualTo(once.GetPose(0.3))
    often.get_position_trajectory().shiftRight(0.25)
    assert often.GetPose(0.3).IsExactlyEqualTo(once.GetPose(0.3))  # as in Drake, that was a copy


def test_orientations_asked_often_are_those_of_the_long_way():
    rng = np.random.default_rng(0)
    samples = [Quaternion(q / np.linalg.norm(q)) for q in rng.normal(size=(4, 4))]
    often = PiecewiseQuaternionSlerp([0.0, 1.0, 2.0, 3.0], samples)
    for _ in range(5):
        often.orientation(0.1)
        often.value(0.1)
    for t in (-1.0, 0.0, 0.4, 1.0, 2.2, 3.0, 4.0):
        first = PiecewiseQuaternionSlerp([0.0, 1.0, 2.0, 3.0], samples)
        np.testing.assert_array_equal(often.orientation(t).wxyz(), first.orientation(t).wxyz())
        np.testing.assert_array_equal(often.value(t), first.value(t))
        assert often.value(t).flags.writeable
    often.Append(4.0, samples[0])
    np.testing.assert_allclose(abs(often.orientation(4.0).wxyz() @ samples[0].wxyz()), 1.0)


@pytest.mark.parametrize(
    "make",
    [
        lambda: PiecewisePolynomial.CubicShapePreserving([0.0, 0.5, 2.0], [[1.0, 2.0, 0.5], [0.0, 1.0, -1.0]]),
        lambda: PiecewisePolynomial.ZeroOrderHold([0.0, 0.5, 2.0], [[1.0, 2.0, 0.5]]),
        lambda: PiecewisePolynomial.FirstOrderHold([0.0, 1.0], np.arange(6.0).reshape(2, 1, 3)),
        lambda: PiecewisePolynomial(np.array([[1.0], [2.0]])),
        lambda: BsplineTrajectory(BsplineBasis(3, 5, initial_parameter_value=0.0, final_parameter_value=2.0),
                                  np.arange(10.0).reshape(2, 5) ** 2),
        lambda: BezierCurve(0.0, 2.0, np.arange(10.0).reshape(2, 5) ** 2),
        lambda: PathParameterizedTrajectory(
            PiecewisePolynomial.CubicShapePreserving([0.0, 0.5, 2.0], [[1.0, 2.0, 0.5], [0.0, 1.0, -1.0]]),
            PiecewisePolynomial.FirstOrderHold([0.0, 0.5, 2.0], [[0.0, 1.5, 2.0]]),
        ),
        lambda: CompositeTrajectory(
            [PiecewisePolynomial.ZeroOrderHold([0.2 * k, 0.2 * (k + 1)], [[k, 0.0], [1.0, 0.0]]) for k in range(5)]
        ),
        lambda: CompositeTrajectory(
            [PiecewisePolynomial.FirstOrderHold([k, k + 1.0], np.arange(6.0).reshape(2, 1, 3) - k) for k in range(3)]
        ),
    ],
    ids=["cubic", "steps", "row", "constant", "spline", "curve", "path", "segments", "rows"],
)  # fmt: skip
def test_many_values_asked_often_are_those_of_single_times(make):
    often = make()
    for _ in range(6):
        often.vector_values([0.1, 0.2])
    for times in (
        np.linspace(-1.0, 3.0, 81),
        np.linspace(3.0, -1.0, 20),
        [0.3, 1, 2.0],
        np.zeros(0),
        [],
        np.array([[0.1, 0.7]]),
    ):
        found = often.vector_values(times)
        expected = [make().value(t).ravel() for t in np.ravel(times)]
        size = max(often.rows(), often.cols())
        columns = found if often.cols() == 1 else found.T
        # The first values of a curve are sums of Bernstein's polynomials, de Boor's rule comes later.
        np.testing.assert_allclose(columns, np.reshape(expected, (-1, size)).T, rtol=1e-14, atol=1e-15)
    with pytest.raises(TypeError):
        often.vector_values("soon")


def test_many_values_know_of_what_was_appended():
    trajectory = PiecewisePolynomial.FirstOrderHold([0.0, 1.0], [[0.0, 1.0]])
    for _ in range(6):
        trajectory.vector_values(np.array([0.5, 1.5]))
    trajectory.AppendFirstOrderSegment(2.0, [[5.0]])
    np.testing.assert_array_equal(trajectory.vector_values(np.array([0.5, 1.5])), [[0.5, 3.0]])


def test_angular_velocities_asked_often_are_those_of_the_segments():
    rotations = [rpy(0.0, 0.0, 0.0), rpy(0.3, 0.2, 0.5), rpy(0.3, 0.2, 0.5), rpy(-0.3, 1.2, 0.5)]
    s = PiecewiseQuaternionSlerp([0.0, 1.0, 1.5, 3.0], rotations)
    times = [-1.0, 0.0, 0.3, 1.0, 1.2, 1.5, 2.9, 3.0, 4.0]
    segments = [0, 0, 0, 1, 1, 2, 2, 2, 2]
    for _ in range(6):  # a function is made on the way
        for t, segment in zip(times, segments):
            np.testing.assert_array_equal(s.angular_velocity(t), s._velocity_of(segment))
            assert s.angular_velocity(t).shape == (3,)
    s.Append(4.0, rotations[0])
    np.testing.assert_array_equal(s.angular_velocity(3.5), s._velocity_of(3))


@pytest.mark.parametrize("kind", [KnotVectorType.kUniform, KnotVectorType.kClampedUniform])
@pytest.mark.parametrize("order", [1, 2, 4])
def test_values_of_basis_functions_are_curves_of_units(order, kind):
    basis = BsplineBasis(order, 7, kind, 0.0, 2.0)
    for u in (0.0, 0.3, 0.5, 1.0, 1.99, 2.0):
        units = [basis.EvaluateCurve(list(unit.reshape(7, 1, 1)), u).item() for unit in np.eye(7)]
        weights = basis.EvaluateLinearInControlPoints(u)
        np.testing.assert_allclose(weights, units, rtol=0, atol=1e-15)
        assert [basis.EvaluateBasisFunctionI(i, u) for i in range(7)] == weights.tolist()
        curve = BsplineTrajectory(basis, [np.array([[x]]) for x in np.arange(7.0) ** 2])
        np.testing.assert_allclose(curve.EvaluateLinearInControlPoints(u), units, rtol=0, atol=1e-15)
        np.testing.assert_allclose(curve.value(u), curve.EvaluateLinearInControlPoints(u) @ np.arange(7.0) ** 2)
    with pytest.raises(RuntimeError, match="not within"):
        basis.EvaluateLinearInControlPoints(2.1)


@pytest.mark.parametrize("dependent", [False, True])
def test_sums_over_eigenvectors_are_matrix_exponentials(dependent):
    from scipy.linalg import expm

    from sheldrake.trajectories._exponential import MatrixExponential

    rng = np.random.default_rng(5)
    A = np.array([[0.0, 1.0], [0.0, 0.0]]) if dependent else rng.normal(size=(5, 5))
    exp = MatrixExponential(A)
    assert (exp.modes is None) == dependent  # a chain of integrators has one eigenvector
    alpha, K = rng.normal(size=(len(A), 2)), rng.normal(size=(3, len(A)))
    zero = PiecewisePolynomial.ZeroOrderHold([0.0, 1.0, 2.0], np.zeros((3, 3)))
    trajectory = ExponentialPlusPiecewisePolynomial(K, A, alpha, zero)
    for t in (-0.5, 0.0, 0.3, 1.0, 1.9, 2.0):
        slow = expm(A * t)
        tolerance = 1e-12 * np.abs(slow).max()
        np.testing.assert_allclose(exp.applied(t, alpha), slow @ alpha, atol=10 * tolerance)
        np.testing.assert_allclose(exp.applied(t, alpha[:, 0]), slow @ alpha[:, 0], atol=10 * tolerance)
        j = int(t >= 1.0)
        expected = K @ expm(A * (t - j)) @ alpha[:, j : j + 1]
        np.testing.assert_allclose(trajectory.value(t), expected, atol=100 * tolerance)
