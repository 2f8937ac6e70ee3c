"""Equations of motion whose masses are symbols: what lumped parameters are made of."""

import numpy as np
import pytest

from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia, UnitInertia
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import FixedOffsetFrame, MultibodyForces, MultibodyForces_, PrismaticJoint, RevoluteJoint
from sheldrake.symbolic import DecomposeLumpedParameters, Expression, Variable


@pytest.fixture
def cart_pole():
    plant = MultibodyPlant(0.0)
    cart, pole = (
        plant.AddRigidBody(name, SpatialInertia(mass, [0, 0, 0], UnitInertia(0, 0, 0)))
        for name, mass in (("cart", 2.0), ("pole", 0.5))
    )
    plant.AddJoint(PrismaticJoint("x", plant.world_frame(), cart.body_frame(), [1, 0, 0]))
    pivot = plant.AddFrame(FixedOffsetFrame("pivot", pole.body_frame(), RigidTransform([0.0, 0.0, 0.8])))
    plant.AddJoint(RevoluteJoint("theta", cart.body_frame(), pivot, [0, -1, 0]))
    plant.Finalize()
    return plant


def inverse_dynamics(plant, context, vdot, Forces):
    forces = Forces(plant)
    plant.CalcForceElementsContribution(context, forces)
    return plant.CalcInverseDynamics(context, vdot, forces)


def test_forces_are_linear_in_a_mass_that_is_a_variable(cart_pole):
    symbolic = cart_pole.ToSymbolic()
    context = symbolic.CreateDefaultContext()
    m, angle, rate = Variable("m"), Variable("angle"), Variable("rate")
    symbolic.GetBodyByName("pole").SetMass(context, m)
    symbolic.SetPositions(context, [0.0, angle])
    symbolic.SetVelocities(context, [0.0, rate])
    tau = inverse_dynamics(symbolic, context, [1.0, -0.5], MultibodyForces_[Expression])
    env = {m: 0.7, angle: 0.3, rate: 2.0}

    there = cart_pole.CreateDefaultContext()
    cart_pole.GetBodyByName("pole").SetMass(there, 0.7)
    cart_pole.SetPositions(there, [0.0, 0.3])
    cart_pole.SetVelocities(there, [0.0, 2.0])
    expected = inverse_dynamics(cart_pole, there, [1.0, -0.5], MultibodyForces)
    np.testing.assert_allclose([e.Evaluate(env) for e in tau], expected, rtol=1e-12)
    W, lumped, rest = DecomposeLumpedParameters(tau, [m])
    assert [str(e) for e in lumped] == ["m"]
    found = [(w[0] * m + r).Evaluate(env) for w, r in zip(W, rest)]
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_the_centre_of_mass_with_a_mass_that_is_a_variable(cart_pole):
    symbolic = cart_pole.ToSymbolic()
    context = symbolic.CreateDefaultContext()
    m = Variable("m")
    symbolic.GetBodyByName("pole").SetMass(context, m)
    z = symbolic.CalcCenterOfMassPositionInWorld(context)[2]
    assert z.Evaluate({m: 0.7}) == pytest.approx(-0.8 * 0.7 / 2.7, rel=1e-12)


@pytest.mark.parametrize("limit", [3.0, np.inf])
def test_actuation_that_is_a_variable_is_clamped_to_its_effort_limit(limit):
    plant = MultibodyPlant(0.0)
    cart = plant.AddRigidBody("cart", SpatialInertia(2.0, [0, 0, 0], UnitInertia(1, 1, 1)))
    plant.AddJointActuator(
        "push", plant.AddJoint(PrismaticJoint("x", plant.world_frame(), cart.body_frame(), [1, 0, 0])), limit
    )
    plant.Finalize()
    symbolic, u = plant.ToSymbolic(), Variable("u")
    context = symbolic.CreateDefaultContext()
    symbolic.get_actuation_input_port().FixValue(context, [Expression(u)])
    acceleration = symbolic.EvalTimeDerivatives(context).CopyToVector()[1]
    for effort in (-5.0, -1.0, 3.0, 4.0):
        assert acceleration.Evaluate({u: effort}) == np.clip(effort, -limit, limit) / 2.0
