"""Trajectory optimizations built through the same calls in both libraries: same programs, same solutions."""

import re

import numpy as np
import pytest
from tests.libraries import modules_of

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")
pytest.importorskip("clarabel")

MODULES = (
    "planning examples solvers symbolic trajectories autodiffutils systems.primitives multibody.tree multibody.plant"
).split()
KEEP = []  # What pydrake's objects refer to.
OURS, THEIRS = (modules_of(name, *MODULES) for name in ("sheldrake", "pydrake"))


def texts(build):
    out = []
    for L in (OURS, THEIRS):
        KEEP.append(build(L))
        out.append(str(KEEP[-1].prog()))
    return out


def collocation(L, parameters=(1.0, 0.5, 0.1, 9.81)):
    system = L.examples.PendulumPlant()
    KEEP.append(system)
    context = system.CreateDefaultContext()
    context.get_mutable_numeric_parameter(0).SetFromVector(parameters)
    t = L.planning.DirectCollocation(system, context, 4, 0.1, 0.5, input_port_index=system.get_input_port().get_index())
    t.AddEqualTimeIntervalsConstraints()
    t.AddDurationBounds(0.3, 2)
    t.AddTimeIntervalBounds(0.01, 0.4)
    t.AddConstraintToAllKnotPoints(t.input()[0] <= 3)
    t.AddConstraintToAllKnotPoints(np.array([t.state()[0] <= 3, t.state()[1] >= -10]))
    v = t.NewSequentialVariable(2, "v")
    t.AddConstraintToAllKnotPoints(L.solvers.BoundingBoxConstraint([0, 0], [1, 1]), v)
    t.AddConstraintToAllKnotPoints(L.solvers.LinearConstraint([[1, 1.0]], [0], [1]), np.array([t.state()[0], v[1]]))
    t.AddRunningCost(10 * t.input()[0] ** 2 + t.time()[0] * t.state()[0])
    t.AddFinalCost(t.time()[0] + t.state()[0] ** 2)
    return t


def double_integrator(L, period):
    A, B = np.array([[0, 1.0], [0, 0]]), np.array([[0], [1.0]])
    if period:
        A, B = np.eye(2) + period * A, period * B
    return L.primitives.LinearSystem(A, B, np.eye(2), np.zeros((2, 1)), period)


def transcription(L, period):
    system = double_integrator(L, period)
    KEEP.append(system)
    step = () if period else (L.planning.DirectTranscription.TimeStep(0.1),)
    t = L.planning.DirectTranscription(system, system.CreateDefaultContext(), 5, *step)
    t.AddRunningCost(t.state()[0] ** 2 + t.input()[0] ** 2)
    t.AddFinalCost(t.state()[1] ** 2)
    t.AddConstraintToAllKnotPoints(t.input()[0] <= 1)
    return t


def euler(L):
    system = L.examples.PendulumPlant()
    KEEP.append(system)
    step = L.planning.DirectTranscription.TimeStep(0.1)
    return L.planning.DirectTranscription(system, system.CreateDefaultContext(), 3, step)


@pytest.mark.parametrize(
    "build",
    [
        collocation,
        lambda L: transcription(L, 0.1),
        lambda L: transcription(L, 0.0),
        lambda L: euler(L),
    ],
)
def test_programs_are_the_same(build):
    mine, other = texts(build)
    assert rounded(mine) == rounded(other)


def rounded(text):
    """Numbers to twelve digits, and zero without a sign."""
    text = re.sub(r"\d+\.\d+", lambda m: f"{float(m.group()):.12g}", text)
    return text.replace("== -0\n", "== 0\n")


def test_initial_trajectories_are_sampled_the_same():
    found = []
    for L in (OURS, THEIRS):
        t, hold = collocation(L), L.trajectories.PiecewisePolynomial.FirstOrderHold
        x = hold([0, 2.0], np.array([[1, 2.0], [3, 4]]))
        t.SetInitialTrajectory(hold([0, 2.0], np.array([[1, 2.0]])), x)
        first = t.prog().initial_guess()
        t.SetInitialTrajectory(L.trajectories.PiecewisePolynomial(), x)
        found.append(np.concatenate((first, t.prog().initial_guess())))
    np.testing.assert_allclose(*found)


def test_collocation_constraints_have_the_same_values_and_gradients():
    found = []
    for L in (OURS, THEIRS):
        t = collocation(L)
        c = t.prog().generic_constraints()[0].evaluator()
        x = np.linspace(0.1, 0.9, c.num_vars())
        y = c.Eval(L.autodiffutils.InitializeAutoDiff(x)[:, 0])
        found.append((c.Eval(x), L.autodiffutils.ExtractGradient(y)))
    for mine, other in zip(*found):
        np.testing.assert_allclose(mine, other, atol=1e-12)


@pytest.mark.parametrize("period", [0.1, 0.0])
def test_a_double_integrator_comes_to_rest_the_same_way(period):
    found = []
    for L in (OURS, THEIRS):
        t = transcription(L, period)
        t.prog().AddBoundingBoxConstraint([1, 0], [1, 0], t.initial_state())
        result = L.solvers.Solve(t.prog())
        x, u = t.ReconstructStateTrajectory(result), t.ReconstructInputTrajectory(result)
        found.append([x.value(0.25).ravel(), u.value(0.25).ravel(), t.GetStateSamples(result).ravel()])
    for mine, other in zip(*found):
        np.testing.assert_allclose(mine, other, atol=1e-6)


def test_collocation_finds_the_same_minimum():
    found = []
    for L in (OURS, THEIRS):
        system = double_integrator(L, 0.0)
        t = L.planning.DirectCollocation(system, system.CreateDefaultContext(), 6, 0.3, 0.3)
        t.prog().AddBoundingBoxConstraint([1, 0], [1, 0], t.initial_state())
        t.prog().AddBoundingBoxConstraint([0, 0], [0, 0], t.final_state())
        t.AddRunningCost(t.input()[0] ** 2)
        t.prog().SetInitialGuessForAllVariables(np.full(t.prog().num_vars(), 0.1))
        result = L.solvers.Solve(t.prog())
        assert result.is_success()
        x = t.ReconstructStateTrajectory(result)
        found.append([result.get_optimal_cost(), *x.value(0.4).ravel(), *x.EvalDerivative(0.4).ravel()])
    np.testing.assert_allclose(*found, atol=1e-5)


def kinematic(L):
    k = L.planning.KinematicTrajectoryOptimization(2, 6, 4, 2.0)
    s = L.solvers
    k.AddDurationCost(2)
    k.AddDurationConstraint(0.5, 3)
    k.AddPathLengthCost(2, True)
    k.AddPathLengthCost()
    k.AddPathEnergyCost(3)
    k.AddPositionBounds([-1, -2], [1, 2])
    k.AddVelocityBounds([-1, -2], [1, 2])
    k.AddAccelerationBounds([-1, -2], [1, 2])
    k.AddJerkBounds([-1, -2], [1, 2])
    k.AddPathPositionConstraint([0, 1], [1, 2], 0.3)
    k.AddPathVelocityConstraint([0, 1], [1, 2], 0.3)
    k.AddPathAccelerationConstraint([0, 1], [1, 2], 0.3)
    k.AddPathPositionConstraint(s.LorentzConeConstraint(np.eye(2), [1, 2.0]), 0.4)
    k.AddVelocityConstraintAtNormalizedTime(s.QuadraticConstraint(np.eye(4), np.ones(4), 0, 1), 0.4)
    qdot = s.Binding[s.LinearConstraint](s.LinearConstraint([[1, 2.0]], [0], [1]), k.qdot())
    k.AddVelocityConstraintAtNormalizedTime(qdot, 0.4)
    return k


def test_kinematic_trajectory_optimizations_have_the_same_parts():
    found = []
    for L in (OURS, THEIRS):
        k = kinematic(L)
        p = k.prog()
        x = np.linspace(0.3, 1.4, p.num_vars())
        bindings = p.GetAllCosts() + p.GetAllConstraints()
        found.append(
            (
                [(b.evaluator().get_description(), [str(v) for v in b.variables()]) for b in bindings],
                [p.EvalBinding(b, x) for b in bindings],
                [np.stack((b.evaluator().lower_bound(), b.evaluator().upper_bound())) for b in p.GetAllConstraints()],
                [
                    L.autodiffutils.ExtractGradient(
                        b.evaluator().Eval(L.autodiffutils.InitializeAutoDiff(p.GetBindingVariableValues(b, x))[:, 0])
                    )
                    for b in bindings
                ],
            )
        )
    assert found[0][0] == found[1][0]
    for part in (1, 2, 3):
        for mine, other in zip(found[0][part], found[1][part]):
            np.testing.assert_allclose(mine, other, atol=1e-9)


def test_a_fastest_path_is_the_same():
    found = []
    for L in (OURS, THEIRS):
        k = L.planning.KinematicTrajectoryOptimization(2, 5, 4, 2.0)
        k.AddPathPositionConstraint([0, 1], [0, 1], 0)
        k.AddPathPositionConstraint([1, 0], [1, 0], 1)
        k.AddDurationConstraint(1, 2)
        k.AddDurationCost()
        k.AddVelocityBounds([-0.8, -0.8], [0.8, 0.8])
        result = L.solvers.Solve(k.prog())
        t = k.ReconstructTrajectory(result)
        found.append([result.get_optimal_cost(), t.end_time(), *t.value(t.end_time()).ravel()])
    np.testing.assert_allclose(*found, atol=1e-6)


def test_robot_diagrams_have_the_same_ports():
    found = []
    for L in (OURS, THEIRS):
        builder = L.planning.RobotDiagramBuilder(0.0)
        plant = builder.plant()
        diagram = builder.Build()
        assert diagram.plant() is plant and plant.is_finalized() and builder.IsDiagramBuilt()
        with pytest.raises(RuntimeError, match="may no longer be used"):
            builder.plant()
        found.append({diagram.get_input_port(i).get_name() for i in range(diagram.num_input_ports())})
        assert {"plant_state", "scene_graph_query"} <= {
            diagram.get_output_port(i).get_name() for i in range(diagram.num_output_ports())
        }
        context = diagram.CreateDefaultContext()
        assert diagram.plant_context(context) is plant.GetMyContextFromRoot(context)
    assert found[0] - {"plant_surface_speeds"} <= found[1]  # Drake has surface velocities since 1.58 at the latest


def test_angles_without_limits():
    found = []
    for L in (OURS, THEIRS):
        tree, plant = L.tree, L.plant.MultibodyPlant(0.0)
        bodies = [plant.AddRigidBody(n, tree.SpatialInertia.SolidCubeWithDensity(1, 1)) for n in "abcde"]
        W, frames = plant.world_frame(), [b.body_frame() for b in bodies]
        plant.AddJoint(tree.RevoluteJoint("r", W, frames[0], [0, 0, 1]))
        plant.AddJoint(tree.PlanarJoint("p", W, frames[1]))
        plant.AddJoint(tree.UniversalJoint("u", W, frames[2]))
        plant.AddJoint(tree.RpyFloatingJoint("f", W, frames[3]))
        plant.AddJoint(tree.RevoluteJoint("s", W, frames[4], [0, 0, 1], -1, 1))
        plant.Finalize()
        found.append(L.planning.GetContinuousRevoluteJointIndices(plant))
    assert found[0] == found[1]


def test_a_planted_fault_is_seen():
    all_three = collocation(OURS), collocation(OURS, (1.0, 0.5, 0.2, 9.81)), collocation(THEIRS)
    KEEP.append(all_three)
    right, wrong, theirs = (each.prog().generic_constraints()[0].evaluator() for each in all_three)
    x = np.linspace(0.1, 0.9, theirs.num_vars())
    np.testing.assert_allclose(right.Eval(x), theirs.Eval(x), rtol=1e-12)
    assert np.abs(wrong.Eval(x) - theirs.Eval(x)).max() > 1e-3
