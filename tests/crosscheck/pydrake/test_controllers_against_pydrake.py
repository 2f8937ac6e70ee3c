"""Gains against pydrake's to 1e-9, and a PID loop's trajectory."""

import importlib

import numpy as np
import pytest
from tests.unit.systems.controllers.test_inverse_dynamics import ARM

from sheldrake.systems import controllers as ours

pytestmark = pytest.mark.peer
theirs = pytest.importorskip("pydrake.systems.controllers")


def gains(m, seed, error=0.0):
    rng = np.random.default_rng(seed)
    A, B = rng.normal(size=(5, 5)), rng.normal(size=(5, 2))
    A[0, 0] += error
    Q, R, N = np.diag(rng.random(5) + 0.1), np.diag(rng.random(2) + 0.1), 0.05 * rng.normal(size=(5, 2))
    out = [m.LinearQuadraticRegulator(A, B, Q, R), m.LinearQuadraticRegulator(A, B, Q, R, N)]
    out += [m.LinearQuadraticRegulator(A, B, Q, R, F=rng.normal(size=(1, 5)))] if seed % 2 else []
    out += [m.DiscreteTimeLinearQuadraticRegulator(A, B, Q, R), m.DiscreteTimeLinearQuadraticRegulator(A, B, Q, R, N)]
    return [matrix for pair in out for matrix in pair]


def worst(a, b):
    return max(float(np.abs(x - y).max() / max(1.0, np.abs(y).max())) for x, y in zip(a, b))


@pytest.mark.parametrize("seed", range(6))
def test_gains(seed):
    assert worst(gains(ours, seed), gains(theirs, seed)) < 1e-9


def test_the_comparison_sees_a_slightly_wrong_system():
    assert worst(gains(ours, 0, error=1e-7), gains(theirs, 0)) > 1e-9


def forces(name):
    """What the controllers of a two-link arm give in a library."""
    parsing, plants, math = (
        importlib.import_module(f"{name}.{m}") for m in ("multibody.parsing", "multibody.plant", "math")
    )
    m = importlib.import_module(f"{name}.systems.controllers")
    plant = plants.MultibodyPlant(0.0)
    parsing.Parser(plant).AddModelsFromString(ARM, "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"), math.RigidTransform())
    plant.Finalize()
    systems = [
        m.InverseDynamics(plant, m.InverseDynamics.kGravityCompensation),
        m.InverseDynamics(plant),
        m.InverseDynamicsController(plant, [1.0, 2.0], [0.1, 0.2], [3.0, 4.0], True),
        m.JointStiffnessController(plant, [1.0, 2.0], [3.0, 4.0]),
    ]
    out = []
    for system in systems:
        context = system.CreateDefaultContext()
        values = {"estimated_state": [0.3, 0.4, 0.5, 0.6], "desired_state": [1.3, 1.4, 0, 0.6]}
        values["desired_acceleration"] = [5.0, 6.0]
        for i in range(system.num_input_ports()):
            system.get_input_port(i).FixValue(context, values[system.get_input_port(i).get_name()])
        out += [system.get_output_port(i).Eval(context) for i in range(system.num_output_ports())]
    return np.array(out)


def test_forces_of_an_arm():
    np.testing.assert_allclose(forces("sheldrake"), forces("pydrake"), rtol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_kalman_gains(seed):
    rng = np.random.default_rng(seed)
    A, C = rng.normal(size=(4, 4)), rng.normal(size=(2, 4))
    W, V = np.diag(rng.random(4) + 0.1), np.diag(rng.random(2) + 0.1)
    mine, peers = (importlib.import_module(f"{name}.systems.estimators") for name in ("sheldrake", "pydrake"))
    for name in ("SteadyStateKalmanFilter", "DiscreteTimeSteadyStateKalmanFilter"):
        assert worst([getattr(mine, name)(A, C, W, V)], [getattr(peers, name)(A, C, W, V)]) < 1e-9


def costs_to_go(name):
    """Of a double integrator on a grid whose points the steps do not hit, discounted, position periodic."""
    m, primitives, analysis = (
        importlib.import_module(f"{name}.systems.{module}") for module in ("controllers", "primitives", "analysis")
    )
    A, B = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]])
    simulator = analysis.Simulator(primitives.LinearSystem(A, B, np.eye(2), np.zeros((2, 1))))
    options = m.DynamicProgrammingOptions()
    options.discount_factor, options.convergence_tol = 0.9, 1e-3
    options.periodic_boundary_conditions = [m.PeriodicBoundaryCondition(0, -2.0, 2.0)]
    grid = [set(np.linspace(-2.0, 2.0, 9)), set(np.linspace(-2.0, 2.0, 9))]

    def cost(context):
        return 0.0 if np.abs(context.get_continuous_state_vector().CopyToVector()).max() < 1e-9 else 1.0

    policy, to_go = m.FittedValueIteration(simulator, cost, grid, [{-1.0, 0.0, 1.0}], 0.1, options)
    return np.vstack([to_go, policy.get_output_values()])


def test_fitted_value_iteration():
    np.testing.assert_allclose(costs_to_go("sheldrake"), costs_to_go("pydrake"), atol=1e-9)
