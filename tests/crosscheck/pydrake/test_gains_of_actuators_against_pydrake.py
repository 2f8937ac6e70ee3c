"""PD gains of actuators: given, changed and taken away at any time, and in plants of continuous time."""

import importlib

import numpy as np
import pytest

pytest.importorskip("pydrake")
pytestmark = pytest.mark.peer

LIBRARIES = [importlib.import_module(f"{name}.all") for name in ("sheldrake", "pydrake")]


def slider(m, time_step, effort_limit=np.inf):
    plant = m.MultibodyPlant(time_step)
    body = plant.AddRigidBody("body", m.SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    joint = plant.AddJoint(m.PrismaticJoint("joint", plant.world_frame(), body.body_frame(), [1, 0, 0]))
    return plant, plant.AddJointActuator("motor", joint, effort_limit)


def moved(m, plant, effort, desired):
    """State after a quarter of a second, derivatives or nothing, net actuation."""
    simulator = m.Simulator(plant)
    context = simulator.get_mutable_context()
    if desired is not None:
        plant.get_desired_state_input_port(m.default_model_instance()).FixValue(context, desired)
    plant.get_actuation_input_port().FixValue(context, [effort])
    plant.SetPositionsAndVelocities(context, [0.1, -0.3])
    begin = [] if plant.time_step() > 0.0 else plant.EvalTimeDerivatives(context).CopyToVector()
    simulator.AdvanceTo(0.25)
    net = plant.get_net_actuation_output_port().Eval(context)
    return np.concatenate([begin, plant.GetPositionsAndVelocities(context), net])


@pytest.mark.parametrize("gains", [(100.0, 7.0), (0.0, 5.0), (40.0, 0.0), (0.0, 0.0)])
@pytest.mark.parametrize("time_step", [0.0, 0.01])
def test_gains_given_after_finalize_act(time_step, gains):
    found = []
    for m in LIBRARIES:
        plant, motor = slider(m, time_step)
        plant.Finalize()
        assert not motor.has_controller()
        motor.set_controller_gains(m.PdControllerGains(p=gains[0], d=gains[1]))
        found.append([moved(m, plant, 0.5, [1.0, 0.2]), [motor.has_controller()]])
    np.testing.assert_allclose(np.concatenate(found[0]), np.concatenate(found[1]), rtol=1e-6, atol=1e-8)
    assert found[0][1] == [any(gains)]


@pytest.mark.parametrize("desired", [None, [1.0, 0.2]])
@pytest.mark.parametrize("effort_limit", [np.inf, 3.0])
def test_gains_act_in_continuous_time(effort_limit, desired):
    found = []
    for m in LIBRARIES:
        plant, motor = slider(m, 0.0, effort_limit)
        motor.set_controller_gains(m.PdControllerGains(p=10.0, d=2.0))
        plant.Finalize()
        found.append(moved(m, plant, 0.7, desired))
    np.testing.assert_allclose(*found, rtol=1e-6, atol=1e-8)


def test_gains_of_zero_take_the_controller_away():
    for m in LIBRARIES:
        _, motor = slider(m, 0.01)
        motor.set_controller_gains(m.PdControllerGains(p=10.0, d=2.0))
        assert motor.has_controller()
        motor.set_controller_gains(m.PdControllerGains(p=0.0, d=0.0))
        assert not motor.has_controller()


def test_gains_that_change_between_steps_change_the_motion():
    m = LIBRARIES[0]
    plant, motor = slider(m, 0.01)
    motor.set_controller_gains(m.PdControllerGains(p=50.0, d=5.0))
    plant.Finalize()
    simulator = m.Simulator(plant)
    context = simulator.get_mutable_context()
    plant.get_desired_state_input_port(m.default_model_instance()).FixValue(context, [1.0, 0.0])
    plant.get_actuation_input_port().FixValue(context, [0.3])
    simulator.AdvanceTo(0.2)
    v = plant.GetVelocities(context)[0]
    motor.set_controller_gains(m.PdControllerGains(p=0.0, d=0.0))
    simulator.AdvanceTo(0.4)
    assert plant.GetVelocities(context)[0] == pytest.approx(v + 0.2 * 0.3, rel=1e-9)


@pytest.mark.parametrize("gains", [(-1.0, 1.0), (1.0, -1.0), (np.nan, 1.0), (1.0, np.inf)])
def test_impossible_gains_are_refused(gains):
    m = LIBRARIES[0]
    _, motor = slider(m, 0.01)
    with pytest.raises(RuntimeError, match="finite and not negative"):
        motor.set_controller_gains(m.PdControllerGains(p=gains[0], d=gains[1]))
    assert not motor.has_controller()
