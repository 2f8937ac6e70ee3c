"""Trajectories by optimization, by the laws they must satisfy."""

import numpy as np
import pytest

from sheldrake.autodiffutils import ExtractGradient, InitializeAutoDiff
from sheldrake.examples import PendulumPlant
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import PrismaticJoint, RevoluteJoint, SpatialInertia
from sheldrake.planning import (
    DirectCollocation,
    DirectCollocationConstraint,
    DirectTranscription,
    KinematicTrajectoryOptimization,
    MultipleShooting,
    RobotDiagramBuilder,
)
from sheldrake.planning._dynamics import Dynamics
from sheldrake.solvers import Solve
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import InputPortSelection, LeafSystem_
from sheldrake.systems.primitives import LinearSystem
from sheldrake.systems.scalar_conversion import TemplateSystem
from sheldrake.trajectories import PiecewisePolynomial

pytest.importorskip("clarabel")


def test_a_pendulum_follows_its_dynamics_between_samples():
    system = PendulumPlant()
    context = system.CreateDefaultContext()
    t = DirectCollocation(system, context, 9, 0.1, 0.1)
    prog = t.prog()
    prog.AddBoundingBoxConstraint([0.3, 0], [0.3, 0], t.initial_state())
    t.AddConstraintToAllKnotPoints(t.input()[0] == 0)
    prog.SetInitialGuessForAllVariables(np.full(prog.num_vars(), 0.1))
    result = Solve(prog)
    assert result.is_success()
    x = t.ReconstructStateTrajectory(result)
    simulator = Simulator(system)
    mine = simulator.get_mutable_context()
    mine.SetContinuousState([0.3, 0.0])
    system.get_input_port().FixValue(mine, [0.0])
    for time in (0.35, 0.8):
        simulator.AdvanceTo(time)
        np.testing.assert_allclose(x.value(time).ravel(), mine.get_continuous_state_vector().CopyToVector(), atol=2e-4)


def test_slopes_at_points_do_not_depend_on_the_points_before_them():
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("link", SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.2, 0.3))
    plant.AddJointActuator(
        "motor", plant.AddJoint(RevoluteJoint("hinge", plant.world_frame(), body.body_frame(), [0, 1, 0]))
    )
    plant.Finalize()
    dynamics = Dynamics(plant, plant.CreateDefaultContext(), plant.get_actuation_input_port().get_index(), False)
    points = np.random.default_rng(2).normal(size=(6, 3))
    dynamics.at_points(points, True)
    f, J = dynamics.at_points(points, True)
    assert dynamics.at_points(points[:1], False)[1].size == 0
    for k in range(6):
        alone = dynamics.at_points(points[k : k + 1], True)
        np.testing.assert_array_equal(alone[0][0], f[k])
        np.testing.assert_array_equal(alone[1][0], J[k])


def test_time_at_a_knot_is_the_sum_of_the_steps_before_it():
    system = PendulumPlant()
    t = DirectCollocation(system, system.CreateDefaultContext(), 4, 0.1, 0.3)
    bindings = t.AddConstraintToAllKnotPoints(t.time()[0] + t.state()[0] <= 2.0)
    assert [len(b.variables()) for b in bindings] == [1, 2, 3, 4]
    bindings = t.AddConstraintToAllKnotPoints(t.state()[0] <= 2.0)
    assert [b.variables()[0] for b in bindings] == [t.state(k)[0] for k in range(4)]


def test_least_effort_is_a_cubic():
    """min of the integral of u² from rest to rest in time T: x = 1 - 3 s² + 2 s³, u linear."""
    system = LinearSystem(np.array([[0, 1.0], [0, 0]]), np.array([[0], [1.0]]), np.eye(2), np.zeros((2, 1)))
    t = DirectCollocation(system, system.CreateDefaultContext(), 11, 0.2, 0.2)
    t.prog().AddBoundingBoxConstraint([1, 0], [1, 0], t.initial_state())
    t.prog().AddBoundingBoxConstraint([0, 0], [0, 0], t.final_state())
    t.AddRunningCost(t.input()[0] ** 2)
    t.prog().SetInitialGuessForAllVariables(np.full(t.prog().num_vars(), 0.2))
    result = Solve(t.prog())
    assert result.is_success()
    x = t.ReconstructStateTrajectory(result)
    s = 0.3 / 2.0
    assert x.value(0.3)[0, 0] == pytest.approx(1 - 3 * s**2 + 2 * s**3, abs=2e-3)  # the cost is summed by trapezoids
    assert t.GetSampleTimes(result)[-1] == pytest.approx(2.0)


def test_discrete_transcription_is_the_system_itself():
    A, B = np.array([[1, 0.1], [0, 1]]), np.array([[0], [0.1]])
    system = LinearSystem(A, B, np.eye(2), np.zeros((2, 1)), 0.1)
    t = DirectTranscription(system, system.CreateDefaultContext(), 6)
    t.prog().AddBoundingBoxConstraint([1, 0], [1, 0], t.initial_state())
    t.AddRunningCost(t.state()[0] ** 2 + 0.1 * t.input()[0] ** 2)
    result = Solve(t.prog())
    x, u = t.GetStateSamples(result), t.GetInputSamples(result)
    np.testing.assert_allclose(x[:, 1:], A @ x[:, :-1] + B @ u[:, :-1], atol=1e-7)
    with pytest.raises(RuntimeError, match="fixed"):
        t.time_step(0)


def test_callbacks_see_times_states_and_inputs():
    system = PendulumPlant()
    t = DirectCollocation(system, system.CreateDefaultContext(), 4, 0.1, 0.2)
    seen = []
    t.AddCompleteTrajectoryCallback(lambda *parts: seen.append([np.shape(p) for p in parts[:3]]), [])
    t.prog().AddBoundingBoxConstraint([0.3, 0], [0.3, 0], t.initial_state())
    t.prog().SetInitialGuessForAllVariables(np.full(t.prog().num_vars(), 0.1))
    Solve(t.prog())
    assert seen and seen[0] == [(4,), (2, 4), (1, 4)]


def test_wrong_uses_are_named():
    system = PendulumPlant()
    context = system.CreateDefaultContext()
    with pytest.raises(RuntimeError, match="discrete-time"):
        DirectTranscription(system, context, 4)
    with pytest.raises(TypeError, match="No constructor"):
        MultipleShooting()
    t = DirectCollocation(system, context, 4, 0.1, 0.2)
    with pytest.raises(RuntimeError, match="no sequential variable 'w'"):
        t.GetSequentialVariableAtIndex("w", 0)
    with pytest.raises(RuntimeError, match="from 0 to 1"):
        KinematicTrajectoryOptimization(1, 5).AddPathPositionConstraint([0], [1], 1.5)


def test_velocity_bounds_hold_everywhere():
    k = KinematicTrajectoryOptimization(2, 8)
    k.AddPathPositionConstraint([0, 0], [0, 0], 0)
    k.AddPathPositionConstraint([1, -0.5], [1, -0.5], 1)
    k.AddVelocityBounds([-0.7, -0.7], [0.7, 0.7])
    k.AddAccelerationBounds([-2, -2], [2, 2])
    k.AddPathVelocityConstraint([0, 0], [0, 0], 0)
    k.AddPathVelocityConstraint([0, 0], [0, 0], 1)
    k.AddDurationCost()
    k.AddDurationConstraint(0.1, 10)
    result = Solve(k.prog())
    assert result.is_success()
    q = k.ReconstructTrajectory(result)
    for order, limit in ((1, 0.7), (2, 2.0)):
        values = np.hstack([q.EvalDerivative(t, order) for t in np.linspace(0, q.end_time(), 50)])
        assert np.abs(values).max() <= limit + 1e-4


def test_efforts_are_mass_times_acceleration_minus_gravity():
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("body", SpatialInertia.SolidCubeWithDensity(1000, 0.1))
    joint = plant.AddJoint(PrismaticJoint("lift", plant.world_frame(), body.body_frame(), [0, 0, 1]))
    plant.AddJointActuator("motor", joint, 100.0)
    plant.Finalize()
    k = KinematicTrajectoryOptimization(1, 6)
    c = k.AddEffortBoundsAtNormalizedTimes(plant, [0.4])[0].evaluator()
    x = np.array([2.0, 0.1, 0.4, -0.3, 0.8, 1.0, 0.2])
    weights = k.AddPathAccelerationConstraint([0], [0], 0.4)
    places = [int(str(v).split(",")[1][:-1]) for v in weights.variables()]
    qddot = weights.evaluator().GetDenseA()[0] @ x[1:][places] / 4.0
    assert c.Eval(x)[0] == pytest.approx(1.0 * (qddot + 9.81), rel=1e-9)
    J = ExtractGradient(c.Eval(InitializeAutoDiff(x)[:, 0]))
    h = 1e-6
    columns = [(c.Eval(x + h * e) - c.Eval(x - h * e)) / (2 * h) for e in np.eye(7)]
    np.testing.assert_allclose(J, np.stack(columns, axis=1), atol=1e-6)
    np.testing.assert_allclose((c.lower_bound(), c.upper_bound()), [[-100], [100]])


def test_robot_diagrams_know_their_plant_on_every_scalar():
    builder = RobotDiagramBuilder(0.0)
    builder.plant().AddRigidBody("body", SpatialInertia.SolidCubeWithDensity(1, 1))
    diagram = builder.Build()
    duals = diagram.ToAutoDiffXd()
    assert type(duals).__name__.startswith("RobotDiagram_") and duals.plant().num_bodies() == 2
    assert diagram.plant_context(diagram.CreateDefaultContext()).num_continuous_states() == 13


def double_integrator(samples):
    system = LinearSystem([[0.0, 1.0], [0.0, 0.0]], [[0.0], [1.0]], np.eye(2), np.zeros((2, 1)))
    return DirectCollocation(system, system.CreateDefaultContext(), samples, 0.1, 0.3)


def of_samples(trajopt, values):
    """Steps, states and inputs among the values of all variables."""
    prog, samples = trajopt.prog(), range(5)
    at = [prog.FindDecisionVariableIndices(trajopt.state(i)) for i in samples]
    u = [prog.FindDecisionVariableIndices(trajopt.input(i)) for i in samples]
    h = [prog.FindDecisionVariableIndices(trajopt.time_step(i))[0] for i in samples if i < len(samples) - 1]
    return values[h], values[np.array(at)], values[np.array(u)]


@pytest.mark.parametrize("with_time", [False, True])
def test_a_running_cost_is_that_of_each_sample_and_its_steps(with_time):
    trajopt = double_integrator(5)
    x, u, t = trajopt.state(), trajopt.input(), trajopt.time()
    trajopt.AddRunningCost(x[0] * u[0] ** 2 + 3.0 * x[1] + (t[0] if with_time else 0.0))
    costs = trajopt.prog().GetAllCosts()
    values = np.random.default_rng(4).uniform(0.1, 0.3, trajopt.prog().num_vars())
    h, states, inputs = of_samples(trajopt, values)
    times = np.concatenate(([0.0], np.cumsum(h)))
    g = states[:, 0] * inputs[:, 0] ** 2 + 3.0 * states[:, 1] + (times if with_time else 0.0)
    expected = 0.5 * g * (np.append(h, 0.0) + np.append(0.0, h))
    found = [trajopt.prog().EvalBinding(c, values)[0] for c in costs]
    np.testing.assert_allclose(found, expected, rtol=1e-13)
    for cost in costs:
        assert [v.get_id() for v in cost.variables()] == sorted(v.get_id() for v in cost.variables())
        evaluator = cost.evaluator()
        assert [v.get_id() for v in evaluator.vars()] == [v.get_id() for v in cost.variables()]
        symbols = evaluator.Eval(cost.variables())[0]
        env = dict(zip(trajopt.prog().decision_variables(), values))
        assert symbols.Evaluate(env) == pytest.approx(trajopt.prog().EvalBinding(cost, values)[0], rel=1e-13)


def test_constraints_at_all_samples_are_of_their_own():
    trajopt = double_integrator(5)
    x, u = trajopt.state(), trajopt.input()
    linear = trajopt.AddConstraintToAllKnotPoints(x[0] + 2.0 * u[0] <= 1.0)
    bent = trajopt.AddConstraintToAllKnotPoints(x[0] * u[0] ** 2 <= 1.0)
    for i, (a, b) in enumerate(zip(linear, bent)):
        wanted = [trajopt.state(i)[0], trajopt.input(i)[0]]
        assert [v.get_id() for v in a.variables()] == [v.get_id() for v in wanted]
        (expression,) = b.evaluator().expressions()
        assert {v.get_id() for v in expression.GetVariables()} == {v.get_id() for v in wanted}
    linear[1].evaluator().set_bounds([-2.0], [2.0])
    linear[1].evaluator().set_description("second")
    assert [c.evaluator().upper_bound()[0] for c in linear] == [1.0, 2.0, 1.0, 1.0, 1.0]
    assert [c.evaluator().get_description() for c in linear] == ["", "second", "", "", ""]
    steps = trajopt.AddEqualTimeIntervalsConstraints()
    assert [[v.get_id() for v in c.variables()] for c in steps] == [
        [trajopt.time_step(i + k)[0].get_id() for k in (0, 1)] for i in range(3)
    ]
    assert double_integrator(2).AddEqualTimeIntervalsConstraints() == []


def test_guesses_may_be_rows_or_columns():
    for samples in ([[1.0], [3.0]], [[1.0, 3.0]]):
        trajopt = double_integrator(5)
        both = [np.array(samples), 2.0 * np.array(samples)]
        trajopt.SetInitialTrajectory(PiecewisePolynomial(), PiecewisePolynomial.FirstOrderHold([0.0, 0.8], both))
        guess = trajopt.prog().GetInitialGuess(np.concatenate([trajopt.state(i) for i in range(5)]))
        np.testing.assert_allclose(guess.reshape(5, 2), np.outer(1.0 + np.arange(5) / 4.0, [1.0, 3.0]))


def test_defects_of_segments_that_do_not_follow_each_other():
    plant = PendulumPlant()
    constraint = DirectCollocationConstraint(plant, plant.CreateDefaultContext())
    z = np.random.default_rng(5).uniform(0.1, 0.4, (4, 7))
    weights = np.random.default_rng(6).normal(size=(4, 2))
    defects = constraint._many()
    values, slopes = defects.slopes(z)
    H = defects.hessian(z, weights)
    for s in range(4):
        np.testing.assert_allclose(values[s], constraint.Eval(z[s]), rtol=1e-12)
        for k in range(7):
            ahead, behind = (defects.slopes(z[s : s + 1] + sign * 1e-6 * np.eye(7)[k])[1][0] for sign in (1, -1))
            # Differences of differences: what f is known to by steps of 1e-6 is lost to their curvature.
            np.testing.assert_allclose(H[s, k], weights[s] @ (ahead - behind) / 2e-6, atol=1e-3)
    np.testing.assert_allclose(slopes[0], constraint._eval_with_jacobian(z[0])[1], rtol=1e-12)


def test_steps_of_what_depends_on_time_are_taken_at_their_times():
    @TemplateSystem.define("Rising_")
    def Rising_(T):
        class Impl(LeafSystem_[T]):
            def _construct(self, converter=None):
                LeafSystem_[T].__init__(self, converter)
                self.DeclareContinuousState(1)

            def _construct_copy(self, other, converter=None):
                Impl._construct(self, converter=converter)

            def DoCalcTimeDerivatives(self, context, derivatives):
                derivatives.get_mutable_vector().SetFromVector([2.0 * context.get_time() + 0.0 * self.now(context)])

            def now(self, context):
                return context.get_continuous_state_vector().CopyToVector()[0]

        return Impl

    system = Rising_[None]()
    step = DirectTranscription.TimeStep(0.5)
    trajopt = DirectTranscription(system, system.CreateDefaultContext(), 4, step, InputPortSelection.kNoInput)
    trajopt.prog().AddBoundingBoxConstraint([1.0], [1.0], trajopt.initial_state())
    found = trajopt.GetStateSamples(Solve(trajopt.prog(), np.zeros(4)))
    np.testing.assert_allclose(found, [[1.0, 1.0, 1.5, 2.5]], atol=1e-6)


@pytest.mark.parametrize("steps", [(0.5, 0.1), (0.0, 0.1), (-0.1, 0.1), (0.1, np.inf), (np.nan, 1.0), (0.1, np.nan)])
def test_time_steps_that_cannot_be_are_refused(steps):
    plant = PendulumPlant()
    with pytest.raises(RuntimeError, match="expected 0 < minimum_time_step <= maximum_time_step"):
        DirectCollocation(plant, plant.CreateDefaultContext(), 5, *steps)
