"""Energies of the examples, asked once and many times, of numbers and of symbols."""

import numpy as np
import pytest

from sheldrake.common.quick import FEW
from sheldrake.examples import AcrobotPlant, PendulumPlant
from sheldrake.symbolic import Evaluate, MakeVectorVariable


@pytest.mark.parametrize("make", [AcrobotPlant, PendulumPlant])
def test_power_is_that_of_damping_and_motor(make):
    """E' = q'^T (tau - b q') along the motion, by differences; for as many calls as a short way wants, and more."""
    plant = make()
    context = plant.CreateDefaultContext()
    plant.get_input_port(0).FixValue(context, [0.7])
    n = context.num_continuous_states() // 2
    damping = np.array([0.1, 0.1][:n])
    rng = np.random.default_rng(3)

    def energy(x):
        context.SetContinuousState(x)
        return plant.EvalKineticEnergy(context) + plant.EvalPotentialEnergy(context)

    for _ in range(FEW):
        x = rng.normal(size=2 * n)
        context.SetContinuousState(x)
        xdot = plant.EvalTimeDerivatives(context).CopyToVector()
        h = 1e-6
        power = (energy(x + h * xdot) - energy(x - h * xdot)) / (2.0 * h)
        motor = 0.7 * x[-1]  # at the last joint
        assert power == pytest.approx(motor - damping @ x[n:] ** 2, abs=1e-7)  # energies are some 10 J, their ulp / h


@pytest.mark.parametrize("make", [AcrobotPlant, PendulumPlant])
def test_symbols_give_the_same_numbers(make):
    plant = make()
    context, symbolic = plant.CreateDefaultContext(), plant.ToSymbolic()
    given = symbolic.CreateDefaultContext()
    x = MakeVectorVariable(context.num_continuous_states(), "x")
    given.SetContinuousState(x)
    expressions = [symbolic.EvalKineticEnergy(given), symbolic.EvalPotentialEnergy(given)]
    numbers = np.random.default_rng(4).normal(size=x.size)
    context.SetContinuousState(numbers)
    for _ in range(FEW + 2):
        energies = [plant.EvalKineticEnergy(context), plant.EvalPotentialEnergy(context)]
    np.testing.assert_allclose(Evaluate(expressions, dict(zip(x, numbers))).ravel(), energies, rtol=1e-13)
