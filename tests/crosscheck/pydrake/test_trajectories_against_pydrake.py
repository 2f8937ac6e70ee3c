"""Values, derivatives and edge cases of trajectories against pydrake's, to 1e-12."""

import importlib
import pathlib

import numpy as np
import pytest
from tests.crosscheck.pydrake import lines

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake.trajectories")
RNG = np.random.default_rng(7)
BREAKS = np.cumsum(0.2 + RNG.random(7))
SAMPLES = RNG.normal(size=(2, 7))
SLOPES = RNG.normal(size=(2, 7))
ANGLES = RNG.normal(size=(7, 3))
TIMES = np.concatenate([BREAKS, np.linspace(BREAKS[0] - 0.5, BREAKS[-1] + 0.5, 41)])


def library(name):
    class Library:
        pass

    for module in ("trajectories", "math", "common.eigen_geometry", "polynomial"):
        loaded = importlib.import_module(f"{name}.{module}")
        for attribute in dir(loaded):
            setattr(Library, attribute, getattr(loaded, attribute))
    return Library


def kinds(m):
    pp = m.PiecewisePolynomial
    periodic = np.hstack([SAMPLES[:, :-1], SAMPLES[:, :1]])
    yield "zero", pp.ZeroOrderHold(BREAKS, SAMPLES)
    yield "first", pp.FirstOrderHold(BREAKS, SAMPLES)
    yield "pchip", pp.CubicShapePreserving(BREAKS, SAMPLES)
    yield "pchip zero", pp.CubicShapePreserving(BREAKS, SAMPLES, True)
    yield "spline", pp.CubicWithContinuousSecondDerivatives(BREAKS, SAMPLES)
    yield "spline of three", pp.CubicWithContinuousSecondDerivatives(BREAKS[:3], SAMPLES[:, :3])
    yield "spline of four", pp.CubicWithContinuousSecondDerivatives(BREAKS[:4], SAMPLES[:, :4])
    yield "clamped", pp.CubicWithContinuousSecondDerivatives(BREAKS, SAMPLES, SLOPES[:, 0], SLOPES[:, 1])
    yield "periodic", pp.CubicWithContinuousSecondDerivatives(BREAKS, periodic, True)
    yield "hermite", pp.CubicHermite(BREAKS, SAMPLES, SLOPES)
    yield "lagrange", pp.LagrangeInterpolatingPolynomial(BREAKS[:5], SAMPLES[:, :5])
    changed = pp.CubicHermite(BREAKS, SAMPLES, SLOPES)
    changed.ReverseTime()
    changed.ScaleTime(0.7)
    changed.shiftRight(BREAKS[-1])
    changed.AppendCubicHermiteSegment(changed.end_time() + 1.0, SLOPES[:, :1], SAMPLES[:, :1])
    changed.AppendFirstOrderSegment(changed.end_time() + 1.0, SLOPES[:, 1:2])
    yield "changed", changed
    rotations = [m.RotationMatrix(m.RollPitchYaw(a)) for a in ANGLES]
    yield "slerp", m.PiecewiseQuaternionSlerp(BREAKS, rotations)
    poses = [m.RigidTransform(R, p) for R, p in zip(rotations, ANGLES)]
    yield "pose", m.PiecewisePose.MakeLinear(BREAKS, poses)
    yield "cubic pose", m.PiecewisePose.MakeCubicLinearWithEndLinearVelocity(BREAKS, poses, ANGLES[0], ANGLES[1])
    curve = m.BezierCurve(BREAKS[0], BREAKS[-1], SAMPLES[:, :5])
    yield "bezier", curve
    spline = m.BsplineTrajectory(m.BsplineBasis(4, [0, 0, 0, 0, 0.4, 0.5, 0.9, 2, 2, 2, 2]), list(SAMPLES.T[..., None]))
    yield "bspline", spline
    finer = spline.CopyHead(1)
    finer.InsertKnots([0.3, 0.5])
    yield "finer bspline", finer
    pace = pp.CubicShapePreserving(BREAKS, np.sort(SAMPLES[:1]) + 2.0)
    yield "path", m.PathParameterizedTrajectory(curve, pace)
    yield "composite", m.CompositeTrajectory.AlignAndConcatenate([curve, pp.FirstOrderHold(BREAKS, SAMPLES)])
    stacked = m.StackedTrajectory()
    stacked.Append(curve)
    stacked.Append(pp.FirstOrderHold([BREAKS[0], BREAKS[-1]], SAMPLES[:, :2]))
    yield "stacked", stacked


def disagreement(ours, theirs, operate):
    a, b = operate(ours), operate(theirs)
    if a.shape != b.shape:
        return np.inf
    return float((np.abs(a - b) / np.maximum(1.0, np.abs(b))).max())


NAMES = [name for name, _ in kinds(library("sheldrake"))]


@pytest.fixture(scope="module")
def both():
    return dict(kinds(library("sheldrake"))), dict(kinds(library("pydrake")))


@pytest.mark.parametrize("name", NAMES)
def test_same_values_and_derivatives(name, both):
    ours, theirs = (side[name] for side in both)
    tolerance = 1e-9 if name == "lagrange" else 1e-12
    assert ours.start_time() == pytest.approx(theirs.start_time()) and ours.end_time() == pytest.approx(
        theirs.end_time()
    )
    assert (ours.rows(), ours.cols()) == (theirs.rows(), theirs.cols())
    for t in TIMES:
        assert disagreement(ours, theirs, lambda p, t=t: p.value(t)) < tolerance
        for order in (1, 2, 3):
            error = disagreement(ours, theirs, lambda p, t=t, order=order: p.EvalDerivative(t, order))
            assert error < 100 * tolerance, (t, order)
    if "pose" not in name:
        assert disagreement(ours, theirs, lambda p: p.vector_values(list(TIMES))) < tolerance
        if name != "path":
            assert disagreement(ours, theirs, lambda p: p.MakeDerivative(2).value(TIMES[-9])) < 100 * tolerance


@pytest.mark.parametrize(
    "name", [n for n in NAMES if n in ("first", "spline", "changed", "slerp", "pose", "composite")]
)
def test_same_segments(name, both):
    ours, theirs = (side[name] for side in both)
    np.testing.assert_allclose(ours.get_segment_times(), theirs.get_segment_times(), rtol=1e-14)
    for t in TIMES:
        assert ours.get_segment_index(t) == theirs.get_segment_index(t)
        assert ours.is_time_in_range(t) == theirs.is_time_in_range(t)


def test_the_comparison_sees_a_slightly_wrong_sample(both):
    theirs = both[1]["spline"]
    samples = SAMPLES.copy()
    samples[0, 3] += 1e-11
    ours = library("sheldrake").PiecewisePolynomial.CubicWithContinuousSecondDerivatives(BREAKS, samples)
    assert max(disagreement(ours, theirs, lambda p, t=t: p.value(t)) for t in TIMES) > 1e-12


SETUP = """
A, E = AutoDiffXd, Expression


def f(M):
    return np.array([[x.value() if hasattr(x, "value") else x.Evaluate() for x in r] for r in np.atleast_2d(M)])
"""


def test_every_line_gives_the_same():
    path = pathlib.Path(__file__).with_name("trajectory_lines.txt")
    modules = ["symbolic", "autodiffutils", "polynomial", "common.eigen_geometry", "math", "trajectories"]
    different = lines.differences(path, modules, SETUP)
    assert not different, dict(list(different.items())[:5])


def test_lines_see_small_differences():
    assert lines.same("array([1.0, 2.0])", "array([1.0, 2.0000000000000004])")
    assert not lines.same("array([1.0, 2.0])", "array([1.0, 2.00000000001])")
    assert not lines.same("RuntimeError", "TypeError")


COEFFICIENTS = ([1.0], [1.0, 0.0], [1.0, 0.5], [0.0], [0.0, 1.0], [1.0, 2.0], [1.0, 3.0], [1.0, -2.0], [1.0, 2.0, 0.0])


@pytest.mark.parametrize("a", COEFFICIENTS)
def test_what_counts_as_almost_equal(a):
    def program(name):
        L, kinds = library(name), importlib.import_module(f"{name}.common").ToleranceType
        found = []
        for b in COEFFICIENTS:
            p, q = L.Polynomial(a), L.Polynomial(b)
            curves = [L.PiecewisePolynomial([polynomial], [0.0, 1.0]) for polynomial in (p, q)]
            for tolerance in (0.0, 0.1, 0.4, 0.6, 3.0):
                found.append(curves[0].isApprox(curves[1], tolerance))
                for kind in (kinds.kRelative, kinds.kAbsolute):
                    found.append(p.CoefficientsAlmostEqual(q, tolerance, kind))
                    found.append(curves[0].isApprox(curves[1], tolerance, kind))
        return found

    assert program("sheldrake") == program("pydrake")


def test_the_shape_of_derivatives_of_poses():
    def program(name):
        L = library(name)
        poses = [L.RigidTransform(L.RollPitchYaw(0.1 * i, 0.2, -0.3 * i), [i, 2.0, 0.0]) for i in range(3)]
        pose, times = L.PiecewisePose, [0.0, 1.0, 2.0]
        linear, cubic = pose.MakeLinear(times, poses), pose.MakeCubicLinearWithEndLinearVelocity(times, poses)
        orders = [L.DerivativeTrajectory(linear, order) for order in range(3)]
        shapes = [(d.rows(), d.cols(), d.value(0.5).shape, d.MakeDerivative().rows()) for d in orders]
        return shapes, [linear.IsApprox(cubic, tolerance) for tolerance in (0.1, 1.0, 5.0, 100.0)]

    assert program("sheldrake") == program("pydrake")


def test_what_trajectories_refuse():
    points, two = np.ones((2, 4)), [[1.0, 2.0], [3.0, 4.0]]
    wrong = [
        lambda L: L.BezierCurve(0.0, 1.0, None),
        lambda L: L.BezierCurve(0.0, np.nan, points),
        lambda L: L.PiecewisePolynomial.FirstOrderHold([0, 1], two).start_time(1.0),
        lambda L: L.PiecewisePolynomial.FirstOrderHold([0, 1], two).end_time(segment_index=0.0),
        lambda L: L.PiecewisePolynomial.FirstOrderHold([0, 1], two).getPolynomialMatrix(0.0),
        lambda L: L.PiecewisePolynomial.FirstOrderHold([0, 1], two).derivative(1.0),
        lambda L: L.PiecewiseQuaternionSlerp([0, 1], [np.eye(3)] * 2).Append(np.nan, L.Quaternion()),
        lambda L: L.FunctionHandleTrajectory(lambda t: np.ones((1, 1)), 1).set_derivative([]),
    ]
    for name in ("sheldrake", "pydrake"):
        for program in wrong:
            with pytest.raises((TypeError, RuntimeError, SystemExit)):
                program(library(name))


@pytest.mark.parametrize("apart", [0.0, 1e-9, 0.05, 0.2, 0.5, 1.0])
def test_how_far_apart_approximate_orientations_may_be(apart):
    def program(name):
        L = library(name)

        def pose(angle):
            end = L.RigidTransform(L.RotationMatrix.MakeZRotation(angle), [0, 0, 0])
            return L.PiecewisePose.MakeLinear([0.0, 1.0], [L.RigidTransform(), end])

        tolerances = (0.0, 2e-9, 0.1, 0.3, 0.49, 0.51, 1.1, 3.0, 7.0)
        return [pose(0.7).IsApprox(pose(0.7 + apart), tolerance) for tolerance in tolerances]

    assert program("sheldrake") == program("pydrake")


def test_no_elements_outside_of_matrices():
    L = library("sheldrake")  # (Drake reads what lies beside them)
    curve = L.PiecewisePolynomial.FirstOrderHold([0, 1], [[1.0, 2.0], [3.0, 4.0]])
    spline = L.BsplineTrajectory(L.BsplineBasis(2, 3), [np.ones((2, 1))] * 3)
    assert curve.getPolynomial(0, 1).GetDegree() == curve.getSegmentPolynomialDegree(0, 1) == 1
    assert spline.CopyBlock(1, 0, 1, 1).rows() == 1
    for row, column in ((-1, 0), (2, 0), (0, 1), (0, -1)):
        with pytest.raises(RuntimeError, match="is not inside 2 x 1"):
            curve.getPolynomial(0, row, column)
        with pytest.raises(RuntimeError, match="is not inside 2 x 1"):
            curve.getSegmentPolynomialDegree(0, row, column)
        with pytest.raises(RuntimeError, match="is not inside 2 x 1"):
            spline.CopyBlock(row, column, 1, 1)
