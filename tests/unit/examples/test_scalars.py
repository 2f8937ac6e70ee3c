"""The textbook systems with gradients and symbols."""

import numpy as np
import pytest

from sheldrake import symbolic
from sheldrake.examples import AcrobotPlant, PendulumPlant, VanDerPolOscillator
from sheldrake.systems.primitives import Linearize


def test_pendulum_as_a_textbook_writes_it():
    system = PendulumPlant().ToSymbolic()
    context = system.CreateDefaultContext()
    theta, rate, tau = (symbolic.Variable(name) for name in ("theta", "rate", "tau"))
    context.SetContinuousState([theta, rate])
    system.get_input_port(0).FixValue(context, [tau])
    found = system.EvalTimeDerivatives(context).CopyToVector()
    expected = (tau - 9.81 * 0.5 * symbolic.sin(theta) - 0.1 * rate) / 0.25
    for values in ((0.3, -0.2, 0.7), (2.0, 1.0, -1.0)):
        at = dict(zip((theta, rate, tau), values))
        assert found[1].Evaluate(at) == pytest.approx(expected.Evaluate(at), rel=1e-14)
    assert found[0].EqualTo(symbolic.Expression(rate))


def test_linearized_acrobot_agrees_with_differences():
    plant = AcrobotPlant()
    context = plant.CreateDefaultContext()
    context.SetContinuousState([np.pi, 0, 0, 0])
    plant.get_input_port(0).FixValue(context, [0.0])
    linear = Linearize(plant, context)
    h = 1e-6
    for k in range(4):
        ends = []
        for sign in (-1, 1):
            x = np.array([np.pi, 0, 0, 0])
            x[k] += sign * h
            context.SetContinuousState(x)
            ends.append(plant.EvalTimeDerivatives(context).CopyToVector())
        assert linear.A()[:, k] == pytest.approx((ends[1] - ends[0]) / (2 * h), abs=1e-6)


def test_limit_cycle_closes():
    cycle = VanDerPolOscillator.CalcLimitCycle()
    assert cycle.shape == (2, 171) and cycle.flags.writeable  # Drake's number of steps
    assert np.abs(cycle[:, 0] - cycle[:, -1]).max() < 0.03
    assert np.abs(cycle[0]).max() == pytest.approx(2.009, abs=2e-3)  # amplitude for mu = 1 (Andersen and Geer 1982)


def test_named_vectors_stay_themselves_in_a_context():
    plant = PendulumPlant()
    context = plant.CreateDefaultContext()
    plant.get_mutable_parameters(context).set_mass(2.0)
    plant.get_mutable_state(context).set_theta(0.5)
    copy = context.Clone()
    assert plant.get_parameters(copy).mass() == 2.0 and plant.get_state(copy).with_theta(1.0).theta() == 1.0
    assert plant.get_state(copy).theta() == 0.5
