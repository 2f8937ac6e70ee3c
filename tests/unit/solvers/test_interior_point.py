"""The interior point method on problems of Hock and Schittkowski (1981), whose minima are known."""

import numpy as np
import pytest

from sheldrake.solvers import MathematicalProgram, SnoptSolver, SolutionResult
from sheldrake.symbolic import cos, exp, log, sin, sqrt


def hs6(p, x):
    p.AddCost((1 - x[0]) ** 2)
    p.AddConstraint(10 * (x[1] - x[0] ** 2) == 0)
    return [-1.2, 1], 0.0


def hs7(p, x):
    p.AddCost(log(1 + x[0] ** 2) - x[1])
    p.AddConstraint((1 + x[0] ** 2) ** 2 + x[1] ** 2 == 4)
    return [2, 2], -np.sqrt(3)


def hs12(p, x):
    p.AddCost(0.5 * x[0] ** 2 + x[1] ** 2 - x[0] * x[1] - 7 * x[0] - 7 * x[1])
    p.AddConstraint(4 * x[0] ** 2 + x[1] ** 2 <= 25)
    return [0, 0], -30.0


def hs13_is_degenerate(p, x):
    p.AddCost((x[0] - 2) ** 2 + x[1] ** 2)
    p.AddConstraint((1 - x[0]) ** 3 - x[1] >= 0)
    p.AddBoundingBoxConstraint(0, np.inf, x)
    return [-2, -2], 1.0


def hs26(p, x):
    y = p.NewContinuousVariables(1, "y")[0]
    p.AddCost((x[0] - x[1]) ** 2 + (x[1] - y) ** 4)
    p.AddConstraint((1 + x[1] ** 2) * x[0] + y**4 == 3)
    return [-2.6, 2, 2], 0.0


def hs39(p, x):
    y = p.NewContinuousVariables(2, "y")
    p.AddCost(-x[0])
    p.AddConstraint(x[1] - x[0] ** 3 - y[0] ** 2 == 0)
    p.AddConstraint(x[0] ** 2 - x[1] - y[1] ** 2 == 0)
    return [2, 2, 2, 2], -1.0


def hs60(p, x):
    y = p.NewContinuousVariables(1, "y")[0]
    p.AddCost((x[0] - 1) ** 2 + (x[0] - x[1]) ** 2 + (x[1] - y) ** 4)
    p.AddConstraint(x[0] * (1 + x[1] ** 2) + y**4 == 4 + 3 * np.sqrt(2))
    p.AddBoundingBoxConstraint(-10, 10, p.decision_variables())
    return [2, 2, 2], 0.03256820025


def hs65(p, x):
    y = p.NewContinuousVariables(1, "y")[0]
    p.AddCost((x[0] - x[1]) ** 2 + (x[0] + x[1] - 10) ** 2 / 9 + (y - 5) ** 2)
    p.AddConstraint(x[0] ** 2 + x[1] ** 2 + y**2 <= 48)
    p.AddBoundingBoxConstraint([-4.5, -4.5, -5], [4.5, 4.5, 5], p.decision_variables())
    return [-5, 5, 0], 0.9535288567


def hs71(p, x):
    y = p.NewContinuousVariables(2, "y")
    p.AddCost(x[0] * y[1] * (x[0] + x[1] + y[0]) + y[0])
    p.AddConstraint(x[0] * x[1] * y[0] * y[1] >= 25)
    p.AddConstraint(x.dot(x) + y.dot(y) == 40)
    p.AddBoundingBoxConstraint(1, 5, p.decision_variables())
    return [1, 5, 5, 1], 17.0140173


def hs78(p, x):
    y = p.NewContinuousVariables(3, "y")
    z = p.decision_variables()
    p.AddCost(z[0] * z[1] * z[2] * z[3] * z[4])
    p.AddConstraint(z.dot(z) == 10)
    p.AddConstraint(z[1] * z[2] == 5 * z[3] * z[4])
    p.AddConstraint(z[0] ** 3 + z[1] ** 3 == -1)
    return [-2, 1.5, 2, -1, -1], -2.91970041 + 0 * len(y)


@pytest.mark.parametrize("build", [hs6, hs7, hs12, hs26, hs39, hs60, hs65, hs71, hs78])
def test_known_minima_are_found(build):
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2, "x")
    start, minimum = build(prog, x)
    result = SnoptSolver().Solve(prog, np.array(start, dtype=float))
    assert result.is_success()
    assert result.get_optimal_cost() == pytest.approx(minimum, abs=2e-6)
    assert result.GetInfeasibleConstraints(prog, 2e-6) == []


def test_a_minimum_without_multipliers_is_come_near():
    prog = MathematicalProgram()
    start, minimum = hs13_is_degenerate(prog, prog.NewContinuousVariables(2, "x"))
    result = SnoptSolver().Solve(prog, np.array(start, dtype=float))
    assert result.get_optimal_cost() == pytest.approx(minimum, abs=0.05)


def test_contradictions_end_where_violations_are_least():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2, "x")
    prog.AddConstraint(sin(x[0]) + x[1] ** 2 <= -1.5)
    prog.AddCost(exp(x[1]) + cos(x[0]))
    result = SnoptSolver().Solve(prog, [0.3, 1.0])
    assert result.get_solution_result() is SolutionResult.kInfeasibleConstraints
    assert np.sin(result.get_x_val()[0]) == pytest.approx(-1, abs=1e-5)


def test_the_limit_of_iterations_is_kept():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2, "x")
    prog.AddCost(sqrt(1 + (x[0] - 3) ** 2) + (x[1] - x[0] ** 2) ** 2)
    prog.SetSolverOption(SnoptSolver.id(), "Major iterations limit", 2)
    assert SnoptSolver().Solve(prog, [-5.0, 4.0]).get_solution_result() is SolutionResult.kIterationLimit


def pendulum_program():
    from sheldrake.examples import PendulumPlant
    from sheldrake.planning import DirectCollocation
    from sheldrake.trajectories import PiecewisePolynomial

    plant = PendulumPlant()
    swing = DirectCollocation(plant, plant.CreateDefaultContext(), 21, 0.05, 0.5)
    program = swing.prog()
    swing.AddEqualTimeIntervalsConstraints()
    u = swing.input()[0]
    swing.AddConstraintToAllKnotPoints(u >= -3.0)
    swing.AddConstraintToAllKnotPoints(u <= 3.0)
    program.AddBoundingBoxConstraint([0.0, 0.0], [0.0, 0.0], swing.initial_state())
    program.AddBoundingBoxConstraint([np.pi, 0.0], [np.pi, 0.0], swing.final_state())
    swing.AddRunningCost(10.0 * u**2)
    guess = PiecewisePolynomial.FirstOrderHold([0.0, 4.0], [[0.0, np.pi], [0.0, 0.0]])
    swing.SetInitialTrajectory(PiecewisePolynomial(), guess)
    return program


def test_a_pendulum_swings_up_with_a_weak_motor():
    """The cost is Drake's with SNOPT."""
    seen = []
    program = pendulum_program()
    program.AddVisualizationCallback(lambda x: seen.append(1), program.decision_variables())
    result = SnoptSolver().Solve(program)
    assert result.is_success()
    assert result.get_optimal_cost() == pytest.approx(69.23349, abs=1e-4)
    assert len(seen) < 100
