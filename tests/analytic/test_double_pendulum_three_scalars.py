"""One double pendulum in three scalars, against the textbook and against each other."""

import numpy as np
import pytest

from sheldrake.autodiffutils import ExtractGradient, InitializeAutoDiff
from sheldrake.math import RigidTransform
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.symbolic import Evaluate, Jacobian, MakeVectorContinuousVariable, cos, sin

M1, M2, L1, LC1, LC2, I1, I2, G = 1.0, 1.5, 1.2, 0.5, 0.7, 0.083, 0.33, 9.81

LINK = """<link name="{name}"><inertial><origin xyz="0 0 {z}"/><mass value="{mass}"/>
  <inertia ixx="{i}" iyy="{i}" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="{name}" type="continuous"><parent link="{parent}"/><child link="{child}"/>
  <origin xyz="0 0 {z}"/><axis xyz="0 1 0"/></joint>"""
URDF = (
    '<robot name="double"><link name="base"/>'
    + LINK.format(name="upper", z=-LC1, mass=M1, i=I1)
    + LINK.format(name="lower", z=-LC2, mass=M2, i=I2)
    + JOINT.format(name="shoulder", parent="base", child="upper", z=0.0)
    + JOINT.format(name="elbow", parent="upper", child="lower", z=-L1)
    + "</robot>"
)


@pytest.fixture(scope="module")
def plant():
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(URDF, "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"), RigidTransform())
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, -G])
    plant.Finalize()
    return plant


def quantities(plant, state):
    """Mass matrix, bias, gravity forces, stacked as columns, shape (2, 4)."""
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, state)
    parts = [plant.CalcMassMatrix(context), plant.CalcBiasTerm(context), plant.CalcGravityGeneralizedForces(context)]
    return np.column_stack(parts)


def test_symbols_give_the_textbook(plant):
    """Spong, Swing up control of the acrobot (1994), equations 3 and 4, in these angles."""
    x = MakeVectorContinuousVariable(4, "x")
    q1, q2, v1, v2 = x
    found = quantities(plant.ToSymbolic(), x * 1)
    c2 = cos(q2)
    m12 = I2 + M2 * LC2**2 + M2 * L1 * LC2 * c2
    m11 = I1 + M1 * LC1**2 + M2 * (L1**2 + 2 * L1 * LC2 * c2) + M2 * LC2**2 + I2
    h = M2 * L1 * LC2 * sin(q2)
    g2 = -M2 * G * LC2 * sin(q1 + q2)
    g1 = -(M1 * LC1 + M2 * L1) * G * sin(q1) + g2
    textbook = np.array(
        [[m11, m12, -h * (2 * v1 * v2 + v2**2), g1], [m12, I2 + M2 * LC2**2, h * v1**2, g2]], dtype=object
    )
    for seed in range(5):
        values = dict(zip(x, np.random.default_rng(seed).uniform(-2, 2, 4)))
        np.testing.assert_allclose(Evaluate(found, values), Evaluate(textbook * 1.0, values), rtol=1e-11, atol=1e-11)


def test_floats_duals_and_symbols_agree(plant):
    x = MakeVectorContinuousVariable(4, "x")
    symbolic = quantities(plant.ToSymbolic(), x * 1)
    gradient = Jacobian(symbolic.ravel(order="F"), x)
    autodiff = plant.ToAutoDiffXd()
    for seed in range(3):
        state = np.random.default_rng(seed).uniform(-2, 2, 4)
        values = dict(zip(x, state))
        duals = quantities(autodiff, InitializeAutoDiff(state).ravel())
        np.testing.assert_allclose(Evaluate(symbolic, values), quantities(plant, state), rtol=1e-11, atol=1e-11)
        np.testing.assert_allclose(ExtractGradient(duals), Evaluate(gradient, values), rtol=1e-9, atol=1e-9)


def test_the_comparison_sees_a_slightly_longer_link(plant):
    state = np.array([0.3, 0.4, 0.5, 0.6])
    other = MultibodyPlant(0.0)
    Parser(other).AddModelsFromString(URDF.replace(f'xyz="0 0 {-L1}"', f'xyz="0 0 {-L1 * (1 + 1e-9)}"'), "urdf")
    other.WeldFrames(other.world_frame(), other.GetFrameByName("base"), RigidTransform())
    other.Finalize()
    difference = np.abs(quantities(plant, state) - quantities(other, state)).max()
    assert 1e-11 < difference < 1e-6


def test_symbols_give_accelerations_too(plant):
    """Time derivatives as expressions, at random states, against numbers: pivots of the mass matrix are symbols."""
    dual = plant.ToSymbolic()
    x = MakeVectorContinuousVariable(4, "x")
    context = dual.CreateDefaultContext()
    dual.SetPositionsAndVelocities(context, x * 1)
    expressions = dual.EvalTimeDerivatives(context).CopyToVector()
    numbers = plant.CreateDefaultContext()
    for state in np.random.default_rng(3).uniform(-2, 2, (5, 4)):
        plant.SetPositionsAndVelocities(numbers, state)
        expected = plant.EvalTimeDerivatives(numbers).CopyToVector()
        found = Evaluate(expressions, dict(zip(x, state)))
        np.testing.assert_allclose(np.ravel(found), expected, rtol=1e-11, atol=1e-11)
