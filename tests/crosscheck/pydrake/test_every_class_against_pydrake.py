"""Calls of classes that need no plant, their arguments made from Drake's signatures, give what they give in Drake."""

import importlib
import warnings

import numpy as np
import pytest

import sheldrake.all as sheldrake

pydrake = pytest.importorskip("pydrake.all")
every_class = pytest.importorskip("benchmarks.every_class")
pytestmark = pytest.mark.peer

LIBRARIES = (sheldrake, pydrake)
KNOWN = {
    "AutoDiffXd.tan(): .tanh.acos.derivatives",  # ill-conditioned: acos close to one
    "Expression.Jacobian(vars: [object[m, 1]]): [1]",  # a term 0 / (1 + x)^2 that Drake keeps
}
"""Differences that are known, up to what is found."""


@pytest.fixture
def sweep(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        made = every_class.Sweep()
        made.at = str(tmp_path / "at")
        yield made


@pytest.mark.parametrize(
    ("name", "least"),
    [
        ("AutoDiffXd", 30), ("Expression", 20), ("RigidTransform", 25), ("RotationMatrix", 25), ("RollPitchYaw", 10),
        ("Quaternion", 10), ("SpatialVelocity", 12), ("SpatialForce", 10), ("Point", 15), ("CameraInfo", 10),
        ("BasicVector", 10), ("LinearConstraint", 15), ("LinearCost", 8), ("JointLimits", 8),
        ("Integrator", 30), ("StackedTrajectory", 10),
    ],
)  # fmt: skip
def test_answers(sweep, name, least):
    asked = [title for title, _ in sweep.of_class(name, "")]
    assert [line for line in sweep.differences if not line.startswith(tuple(KNOWN))] == []
    assert len(asked) >= least


def test_a_wrong_answer_and_a_wrong_change_are_found(sweep, monkeypatch):
    monkeypatch.setattr(sheldrake.RigidTransform, "translation", lambda self: np.array([1.0, 2.0, 3.001]))
    monkeypatch.setattr(sheldrake.RotationMatrix, "set", lambda self, R: None)
    list(sweep.of_class("RigidTransform", "translation\\(\\)"))
    sweep.alike = True
    list(sweep.of_class("RotationMatrix", "\\.set\\("))
    assert any(line.startswith("RigidTransform: .translation") for line in sweep.differences)
    assert any(line.startswith("RotationMatrix.set(") and "afterwards" in line for line in sweep.differences)


@pytest.mark.parametrize("scalar", ["float", "AutoDiffXd", "Expression"])
def test_allocated_contexts_have_what_was_declared(scalar):
    """State and parameters as they were declared; what a system sets by itself is not there yet."""
    found = []
    for lib in LIBRARIES:
        builder = lib.DiagramBuilder()
        integrator = builder.AddSystem(lib.Integrator([1.0, 2.0]))
        builder.AddSystem(lib.FirstOrderLowPassFilter([0.1]))
        diagram = builder.Build()
        if scalar != "float":
            diagram = diagram.ToAutoDiffXd() if scalar == "AutoDiffXd" else diagram.ToSymbolic()
        contexts = [diagram.AllocateContext(), diagram.CreateDefaultContext(), integrator.AllocateContext()]
        found.append([str(context.get_continuous_state_vector().CopyToVector()) for context in contexts])
        found[-1].append(str(integrator.AllocateTimeDerivatives().CopyToVector()))
    assert found[0] == found[1]


def test_bounds_keep_their_matrix():
    for lib in LIBRARIES:
        bounds = lib.BoundingBoxConstraint([-1.0, -2.0], [1.0, 2.0])
        bounds.UpdateCoefficients(np.eye(2), [0.0, -1.0], [3.0, 4.0])
        bounds.RemoveTinyCoefficient(0.5)
        assert bounds.lower_bound().tolist() == [0.0, -1.0] and bounds.upper_bound().tolist() == [3.0, 4.0]
        np.testing.assert_array_equal(bounds.GetDenseA(), np.eye(2))
        assert bounds.Eval(np.array([5.0, 6.0])).tolist() == [5.0, 6.0]
    with pytest.raises(RuntimeError, match="is the identity"):  # in Drake the matrix changes, not what is computed
        bounds_of_ours = sheldrake.BoundingBoxConstraint([-1.0], [1.0])
        bounds_of_ours.UpdateCoefficients([[2.0]], [0.0], [1.0])
    assert bounds_of_ours.lower_bound().tolist() == [-1.0]


def test_slope_of_the_absolute_value_of_no_number():
    for lib in LIBRARIES:
        assert abs(lib.AutoDiffXd(np.nan, [2.0])).derivatives().tolist() == [2.0]
        assert lib.AutoDiffXd(-1.0, [2.0]).abs().derivatives().tolist() == [-2.0]


@pytest.mark.parametrize("accuracy", [1e-9, 0.02, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("most", [1, 10, 700])
def test_sampled_volumes(accuracy, most):
    """As many samples of the same numbers, and the same error from them."""
    found = []
    for lib in LIBRARIES:
        sets = [lib.Hyperellipsoid(np.eye(3), [0, 0, 0]), lib.VPolytope(np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]))]
        sampled = [each.CalcVolumeViaSampling(lib.RandomGenerator(3), accuracy, most) for each in sets]
        found.append([[each.volume, each.rel_accuracy, each.num_samples] for each in sampled])
    if accuracy in (1e-9, 1.0):  # sets whose boxes differ by rounding may differ in a sample close to the boundary
        assert [each[2] for each in found[0]] == [each[2] for each in found[1]]
    np.testing.assert_allclose([each[:2] for each in found[0]], [each[:2] for each in found[1]], rtol=0.03)


def test_parts_of_poses_and_stacks_that_change_between_calls():
    """What is kept for calls in a loop is made anew when a stack grows; what poses give away are copies."""
    found = []
    for lib in LIBRARIES:
        poses = [lib.RigidTransform(lib.RollPitchYaw(0.1 * k, 0.2, 0.3), [1.0 * k, 2.0, 3.0]) for k in range(3)]
        motion = lib.PiecewisePose.MakeLinear([0.0, 1.0, 2.0], poses)
        stack = lib.StackedTrajectory()
        stack.Append(lib.PiecewisePolynomial.FirstOrderHold([0.0, 2.0], [[0.0, 1.0], [2.0, 5.0]]))
        answers = []
        for turn in range(3):
            if turn == 1:
                copied = motion.Clone()
                motion.get_position_trajectory().ReverseTime()
                motion.get_position_trajectory().shiftRight(2.0)
                stack.Append(lib.BezierCurve(0.0, 2.0, [[0.0, 1.0, 3.0]]))
            for t in (-1.0, 0.0, 0.3, 1.0, 2.0, 2.5):
                for _ in range(5):  # the fourth call makes what is kept
                    now = [motion.value(t), motion.EvalDerivative(t), motion.GetPose(t).GetAsMatrix4()]
                    now += [motion.GetVelocity(t), stack.value(t), stack.EvalDerivative(t, 1)]
                answers += [*now, stack.vector_values([0.0, t]), stack.vector_values(np.array([t]))]
        answers.append(copied.value(0.3))
        found.append(answers)
    for ours, drakes in zip(*found):
        np.testing.assert_allclose(ours, drakes, atol=1e-14)
    assert (len(found[0][20]), len(found[0][20 + 48])) == (2, 3)  # the stack has a row more


def test_colours():
    for lib in LIBRARIES:
        colour = lib.Rgba(0.1, 0.2, 0.6, 0.5)
        np.testing.assert_allclose((colour * colour).rgba, [0.01, 0.04, 0.36, 0.25])
        np.testing.assert_allclose(colour.scale_rgb(2.0).rgba, [0.2, 0.4, 1.0, 0.5])
        colour.update(b=1)
        assert colour == lib.Rgba(0.1, 0.2, 1, np.float64(0.5)) and colour != lib.Rgba(0.1, 0.2, 1.0)
        assert (colour.r(), colour.a()) == (0.1, 0.5) and type(colour.b()) is float
        for wrong in (1.5, np.nan):
            with pytest.raises(RuntimeError, match="within the range"):
                colour.update(g=wrong)
        with pytest.raises(TypeError):
            lib.Rgba("0.1", 0.2, 0.3)
        with pytest.raises(TypeError):
            colour.update(r="0.5")
        np.testing.assert_array_equal(colour.rgba, [0.1, 0.2, 1.0, 0.5])


def test_points_in_sets_and_constraints_asked_often():
    """The long way and, after some hundred calls, the short one; what is odd keeps to the long way."""
    rng = np.random.default_rng(0)
    A, b, points = rng.normal(size=(7, 3)), np.abs(rng.normal(size=7)) + 0.2, 0.7 * rng.normal(size=(300, 3))
    low, high, nothing = np.array([-1.0, -1.0, -0.5]), np.array([1.0, 0.5, 1.0]), np.array([0.0, np.nan, 0.0])
    found = []
    for lib in LIBRARIES:
        fortran = np.asfortranarray(A)
        sets = [lib.HPolyhedron(A, b), lib.HPolyhedron(fortran, b), lib.HPolyhedron(A[:1], b[:1])]
        sets += [lib.Point([0.1, 0.2, 0.3]), lib.Hyperrectangle(low, high), lib.Hyperellipsoid(A, [0, 0, 0.1])]
        bounds = [lib.LinearConstraint(A, -b, b), lib.LinearConstraint(fortran, -b, b)]
        bounds += [lib.LinearEqualityConstraint(A[:1], b[:1]), lib.BoundingBoxConstraint(low, high)]
        prog = lib.MathematicalProgram()
        x = prog.NewContinuousVariables(3)
        bounds.append(prog.AddLinearConstraint(x[0] + 2 * x[1] - x[2] <= 0.3).evaluator())
        bounds.append(prog.AddBoundingBoxConstraint(-1.0, 0.5, x[0]).evaluator())
        asked = [each.PointInSet for each in sets] + [each.CheckSatisfied for each in bounds]
        sizes = [3] * len(sets) + [each.num_vars() for each in bounds]
        for ask, n in zip(asked, sizes):
            odd = [] if ask is asked[3] else [nothing[:n]]  # for Drake no number is near any point
            for point in [*points[:, :n], *odd]:
                found.append([ask(point.copy()), ask(point.copy(), 0.5), ask(list(point))])
            if (owner := ask.__self__) in bounds:
                each = [ask(point.copy(), 0.5) for point in points[:, :n]]
                assert owner.CheckSatisfiedVectorized(points[:, :n].T, 0.5) == each
            with pytest.raises(TypeError):
                ask(None)
            if lib is sheldrake:  # Drake ends the process
                for _ in range(2):
                    with pytest.raises(RuntimeError):
                        ask(np.zeros(n + 1))
    ours, drakes = np.array(found).reshape(2, -1, 3)
    assert all(type(answer) is bool for row in found for answer in row)
    np.testing.assert_array_equal(ours, drakes)
    assert 0.1 < ours.mean() < 0.9


def test_joint_limits_asked_often():
    """As in Drake in and out of the limits, also what is refused."""
    rng = np.random.default_rng(0)
    values, found = 0.8 * rng.normal(size=(260, 2)), []
    for lib in LIBRARIES:
        limits = lib.JointLimits(*[sign * np.array([1.0, 0.5]) for _ in range(3) for sign in (-1, 1)])
        answers = [limits.CheckInPositionLimits(value, 0.1) for value in values]
        answers += [limits.CheckInVelocityLimits(value) for value in values]
        for wrong in ([np.nan, 0.0], [0.0, np.nan], [0.0], np.array([np.nan, 5.0])):
            with pytest.raises((RuntimeError, SystemExit)):
                limits.CheckInPositionLimits(np.array(wrong), 0.1)
        with pytest.raises((RuntimeError, SystemExit)):
            limits.CheckInPositionLimits(np.zeros(2), -0.1)
        found.append(answers)
    assert found[0] == found[1] and all(type(answer) is bool for answer in found[0])
    assert 0.1 < np.mean(found[0]) < 0.9


@pytest.mark.parametrize("combine", ["__add__", "__sub__", "__mul__", "__truediv__", "__pow__", "atan2"])
def test_derivatives_of_one_and_of_three_variables_do_not_mix(combine):
    """Nor do the three take the one for all; Drake reads what is not there."""
    one, three = sheldrake.AutoDiffXd(1.0, [1.0]), sheldrake.AutoDiffXd(2.0, [1.0, 2.0, 3.0])
    for a, b in ((one, three), (three, one)):
        with pytest.raises(RuntimeError, match="derivatives"):
            getattr(a, combine)(b)


def test_vectors_as_matrices_of_one_column():
    for lib in LIBRARIES:
        symbolic = importlib.import_module(f"{lib.__package__}.symbolic")
        x = lib.Variable("x")
        assert str(symbolic.positive_semidefinite(np.array([x + 0.0]))) == "positive_semidefinite(x)"
        assert str(symbolic.inv(np.array([x + 0.0]))[0, 0]) == "(1 / x)"
        for call in (symbolic.positive_semidefinite, symbolic.inv):
            with pytest.raises(RuntimeError):
                call(np.array([x + 0.0, x + 1.0]))
            with pytest.raises(TypeError):
                call(x + 0.0)


def test_wrapping_to_an_interval_without_length():
    assert np.isnan([lib.wrap_to(0.3, 1.0, 1.0) for lib in LIBRARIES]).all()
