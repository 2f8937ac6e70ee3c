"""Implicit integrators against Drake's: the same steps, results and statistics."""

import numpy as np
import pytest

import sheldrake.all as sheldrake
from sheldrake.systems.analysis import _implicit

pydrake = pytest.importorskip("pydrake.all")
pytestmark = pytest.mark.peer

SCHEMES = ("implicit_euler", "radau1", "radau3", "velocity_implicit_euler")
SWING = """<robot name="swing"><link name="a"><inertial><mass value="1"/><origin xyz="0.1 0 -.5"/>
<inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="continuous"><parent link="world"/><child link="a"/><axis xyz="0 1 0"/><dynamics damping="5"/>
</joint></robot>"""


def pendulum(lib):
    plant = lib.MultibodyPlant(0.0)
    lib.Parser(plant).AddModelsFromString(SWING, "urdf")
    plant.Finalize()
    return plant, [1.0, 2.0]


def tumbling_body(lib):
    plant = lib.MultibodyPlant(0.0)
    inertia = lib.SpatialInertia(1.0, [0.1, 0.2, 0.0], lib.UnitInertia(0.3, 0.4, 0.5))
    plant.AddRigidBody("body", inertia)
    plant.Finalize()
    return plant, [1.0, 0.0, 0.0, 0.0, 0.1, 0.2, 0.3, 3.0, 1.0, 0.5, 0.1, 0.2, 0.3]


def oscillator(lib):
    x, v = lib.Variable("x"), lib.Variable("v")
    return lib.SymbolicVectorSystem(state=[x, v], dynamics=[v, 100 * (1 - x * x) * v - x], output=[x]), [2.0, 0.0]


def run(lib, make, scheme, setting, until):
    """Steps [s], the state at the end, and statistics; a setting is an accuracy or "fixed"."""
    system, start = make(lib)
    simulator = lib.Simulator(system)
    integrator = lib.ResetIntegratorFromFlags(simulator, scheme, 0.1)
    integrator.set_fixed_step_mode(setting == "fixed")
    if setting != "fixed":
        integrator.set_target_accuracy(setting)
    context = simulator.get_mutable_context()
    context.SetContinuousState(start)
    times = []
    simulator.set_monitor(lambda context: times.append(context.get_time()))
    simulator.AdvanceTo(until)
    state = context.get_continuous_state_vector().CopyToVector()
    return np.diff(np.unique(times)), state, dict(integrator.GetStatisticsSummary())


CASES = [(pendulum, 1e-3, 1.0), (pendulum, "fixed", 0.95), (tumbling_body, 1e-3, 0.5), (oscillator, 1e-3, 120.0)]


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize(("make", "setting", "until"), CASES)
def test_steps_and_statistics(make, setting, until, scheme):
    steps, state, counts = run(sheldrake, make, scheme, setting, until)
    their_steps, their_state, their_counts = run(pydrake, make, scheme, setting, until)
    np.testing.assert_allclose(steps, their_steps, rtol=1e-4)  # Jacobians by differences are exact to 1e-8
    np.testing.assert_allclose(state, their_state, rtol=1e-6, atol=1e-6)
    assert list(counts) == list(their_counts)
    if scheme == "implicit_euler":  # Drake evaluates once more at each beginning of a step, and does not use it
        tries = len(steps) + counts.get("integrator_num_step_shrinkages_from_error_control", 0)
        for name in ("num_derivative_evaluations", "num_error_estimator_derivative_evaluations"):
            counts[f"integrator_{name}"] += tries
    for name, value in counts.items():
        assert value == pytest.approx(their_counts[name], rel=1e-4 if isinstance(value, float) else 0.0), name


@pytest.mark.parametrize("scheme", SCHEMES)
def test_another_criterion_of_newton_s_method_is_noticed(scheme, monkeypatch):
    monkeypatch.setattr(_implicit, "KAPPA", 0.01)
    with pytest.raises(AssertionError):
        test_steps_and_statistics(pendulum, 1e-3, 1.0, scheme)
