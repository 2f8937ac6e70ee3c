"""Controllers, estimators, networks and trajectories of the library leave Python, and give the same bits there."""

import importlib.util

import numpy as np
import pytest
from tests.unit.systems.controllers.test_inverse_dynamics import arm

from sheldrake.common import RandomGenerator
from sheldrake.common.eigen_geometry import Quaternion
from sheldrake.common.kernel import jit_enabled
from sheldrake.export import Freeze, FrozenSimulation, SaveC, SaveFmu
from sheldrake.manipulation import SchunkWsgPositionController
from sheldrake.math import BsplineBasis
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.controllers import InverseDynamics, InverseDynamicsController, JointStiffnessController
from sheldrake.systems.estimators import LuenbergerObserver
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import AffineSystem, LogVectorOutput, MultilayerPerceptron, Sine, TrajectorySource
from sheldrake.trajectories import BsplineTrajectory, PiecewisePolynomial, PiecewiseQuaternionSlerp

pytestmark = pytest.mark.skipif(not jit_enabled(), reason="runs machine code; SHELDRAKE_JIT=0 switches it off")
TIMES = [0.0, 0.2, 0.5, 0.7]


def on_a_path(controller, builder, plant):
    """An arm that a controller takes along a spline."""
    builder.AddSystem(plant)
    builder.AddSystem(controller)
    basis = BsplineBasis(4, 6, initial_parameter_value=0.0, final_parameter_value=0.7)
    points = np.random.default_rng(1).normal(size=(2, 6))
    path = builder.AddSystem(TrajectorySource(BsplineTrajectory(basis, points), 1))
    builder.Connect(plant.get_state_output_port(), controller.get_input_port_estimated_state())
    builder.Connect(path.get_output_port(), controller.get_input_port_desired_state())
    builder.Connect(controller.GetOutputPort("actuation"), plant.get_actuation_input_port())
    return plant.get_state_output_port()


def inverse_dynamics(builder):
    plant, ones = arm(), np.ones(2)
    return on_a_path(InverseDynamicsController(plant, 50 * ones, ones, 5 * ones, False), builder, plant)


def stiffness(builder):
    plant, ones = arm(), np.ones(2)
    return on_a_path(JointStiffnessController(plant, 50 * ones, 5 * ones), builder, plant)


def gravity_compensation(builder):
    plant = arm()
    builder.AddSystem(plant)
    held = builder.AddSystem(InverseDynamics(plant, InverseDynamics.kGravityCompensation))
    builder.Connect(plant.get_state_output_port(), held.get_input_port_estimated_state())
    builder.Connect(held.get_output_port(), plant.get_actuation_input_port())
    return held.get_output_port()


def path_of(trajectory):
    return lambda builder: builder.AddSystem(TrajectorySource(trajectory)).get_output_port()


def of_sines(system, builder, size):
    wave = builder.AddSystem(Sine(np.linspace(0.5, 1.0, size), np.linspace(2.0, 3.0, size), np.zeros(size)))
    builder.AddSystem(system)
    builder.Connect(wave.get_output_port(0), system.get_input_port(0))
    return system.get_output_port(0)


def network(builder):
    system = MultilayerPerceptron([3, 16, 2])
    weights = system.CreateDefaultContext()
    system.SetRandomContext(weights, RandomGenerator(4))
    system._pn_models[0].SetFromVector(system.GetParameters(weights))  # the network's defaults
    return of_sines(system, builder, 3)


def observer(period):
    def add(builder):
        A, B, C = np.array([[0.0, 1.0], [-1.0, -0.2]]), np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]])
        A, B = (np.eye(2) + period * A, period * B) if period else (A, B)
        observed = AffineSystem(A, B, [0.1, 0.2], C, [[0.3]], [0.4], period)
        context = observed.CreateDefaultContext()
        system = LuenbergerObserver(observed, context, [[0.5], [0.2]])
        port = of_sines(system, builder, 1)
        wave = builder.AddSystem(Sine(1.0, 1.5, 0.0, 1))
        builder.Connect(wave.get_output_port(0), system.get_input_port(1))
        return port

    return add


def gripper(builder):
    system = builder.AddSystem(SchunkWsgPositionController())
    for port, size in ((system.get_desired_position_input_port(), 1), (system.GetInputPort("state"), 4)):
        wave = builder.AddSystem(Sine(np.full(size, 0.05), np.full(size, 4.0), np.arange(size) / 2.0))
        builder.Connect(wave.get_output_port(0), port)
    return system.GetOutputPort("generalized_force")


POINTS = np.random.default_rng(5).normal(size=(4, 4))
TURNS = [Quaternion(q / np.linalg.norm(q)) for q in POINTS]


@pytest.mark.parametrize(
    "add",
    [
        inverse_dynamics,
        stiffness,
        gravity_compensation,
        network,
        observer(0.0),
        observer(0.1),
        gripper,
        path_of(PiecewisePolynomial.CubicShapePreserving(TIMES, POINTS, True)),
        path_of(PiecewiseQuaternionSlerp(TIMES, TURNS)),
    ],
    ids=[
        "inverse dynamics",
        "stiffness",
        "gravity",
        "network",
        "observer",
        "sampled observer",
        "gripper",
        "path",
        "turns",
    ],
)
def test_it_leaves_with_the_same_bits(add):
    builder = DiagramBuilder()
    port = add(builder)
    sink = LogVectorOutput(port, builder, 0.05)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    frozen = Freeze(simulator)
    assert frozen.ToBytes() == Freeze(simulator).ToBytes()
    simulation = FrozenSimulation(frozen)
    simulation.AdvanceTo(0.7)
    simulator.AdvanceTo(0.7)
    log = sink.FindLog(simulator.get_context())
    (name,) = frozen.log_names()
    times, values = simulation.FindLog(name)
    np.testing.assert_array_equal(times, log.sample_times())
    np.testing.assert_array_equal(values, log.data())
    assert np.ptp(values) > 0.01  # it moves


@pytest.mark.parametrize("period", [0.0, 0.1])
@pytest.mark.parametrize("inputs", [0, 1])
def test_an_observer_of_an_affine_system_follows_its_formula(period, inputs):
    r = np.random.default_rng(6)
    A, B, f0, C = r.normal(size=(3, 3)), r.normal(size=(3, inputs)), r.normal(size=3), r.normal(size=(2, 3))
    D, y0, L, x = r.normal(size=(2, inputs)), r.normal(size=2), r.normal(size=(3, 2)), r.normal(size=3)
    observed = AffineSystem(A, B, f0, C, D, y0, period)
    system = LuenbergerObserver(observed, observed.CreateDefaultContext(), L)
    y, u = r.normal(size=2), r.normal(size=inputs)
    context = system.CreateDefaultContext()
    system.get_input_port(0).FixValue(context, y)
    if inputs:
        system.get_input_port(1).FixValue(context, u)
    if period:
        context.SetDiscreteState(x)
        found = system.EvalUniquePeriodicDiscreteUpdate(context).value()
    else:
        context.SetContinuousState(x)
        found = system.EvalTimeDerivatives(context).CopyToVector()
    np.testing.assert_allclose(found, A @ x + B @ u + f0 + L @ (y - C @ x - D @ u - y0), rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("missing", ["llvmlite", "ziglang"])
@pytest.mark.parametrize("save", [SaveC, SaveFmu])
def test_without_a_compiler_it_is_said_what_to_install(tmp_path, monkeypatch, save, missing):
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == missing else find(name))
    builder = DiagramBuilder()
    builder.AddSystem(Sine(1.0, 1.0, 0.0, 1))
    with pytest.raises(ModuleNotFoundError, match=rf"{save.__name__}\(\) needs .*'sheldrake\[export\]'"):
        save(Simulator(builder.Build()), tmp_path / "out")
    assert not (tmp_path / "out").exists()
