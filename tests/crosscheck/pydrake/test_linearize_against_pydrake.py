"""Linear models of plants about an equilibrium equal pydrake's."""

import importlib

import numpy as np
import pytest

pytest.importorskip("pydrake")

from random_plants import pydrake, sheldrake

pytestmark = pytest.mark.peer

LINK = """<link name="l{k}"><inertial><origin xyz="0.01 0.02 {z}"/><mass value="{m}"/>
  <inertia ixx="0.1" iyy="0.12" izz="0.05" ixy="0.001" ixz="0.002" iyz="-0.003"/></inertial></link>
  <joint name="j{k}" type="{kind}"><parent link="{parent}"/>
  <child link="l{k}"/><origin xyz="0 0.1 {z}" rpy="0.1 0.2 0"/>
  <axis xyz="{axis}"/><limit lower="-9" upper="9" effort="500"/><dynamics damping="0.{k}"/></joint>
  <transmission name="t{k}"><type>SimpleTransmission</type><joint name="j{k}"/><actuator name="m{k}"/></transmission>"""
AXES = ["0 0 1", "0 1 0", "1 0 0", "0.6 0 0.8"]


def urdf(mass=1.0):
    links = [
        LINK.format(k=k, z=0.2, m=mass + 0.3 * k, axis=AXES[k], parent=f"l{k - 1}" if k else "base",
                    kind="prismatic" if k == 2 else "revolute")
        for k in range(4)
    ]  # fmt: skip
    return f'<robot name="arm"><link name="base"/>{"".join(links)}</robot>'


CART_POLE = """<robot name="cart_pole"><link name="rail"/>
  <link name="cart"><inertial><mass value="10"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  </link><joint name="x" type="prismatic"><parent link="rail"/><child link="cart"/><axis xyz="1 0 0"/>
  <limit lower="-9" upper="9" effort="500"/></joint>
  <link name="pole"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/>
  <inertia ixx="0.01" iyy="0.01" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="theta" type="continuous"><parent link="cart"/><child link="pole"/><axis xyz="0 -1 0"/></joint>
  <transmission name="t"><type>SimpleTransmission</type><joint name="x"/><actuator name="force"/></transmission>
</robot>"""


def arm(joints=7):
    """An arm of revolute joints."""
    links = [
        LINK.format(k=k, z=0.2, m=1.0 + 0.3 * k, axis=AXES[k % 4], parent=f"l{k - 1}" if k else "base", kind="revolute")
        for k in range(joints)
    ]
    return f'<robot name="arm"><link name="base"/>{"".join(links)}</robot>'


def upright(library, name):
    """A, B, C, D of a classic at its unstable equilibrium."""
    examples = importlib.import_module(f"{library}.examples")
    primitives = importlib.import_module(f"{library}.systems.primitives")
    if name == "pendulum":
        system, x0 = examples.PendulumPlant(), [np.pi, 0.0]
    elif name == "acrobot":
        system, x0 = examples.AcrobotPlant(), [np.pi, 0.0, 0.0, 0.0]
    else:
        plants = importlib.import_module(f"{library}.multibody.plant")
        parsing = importlib.import_module(f"{library}.multibody.parsing")
        system, x0 = plants.MultibodyPlant(0.0), [0.0, np.pi, 0.0, 0.0]
        parsing.Parser(system).AddModelsFromString(CART_POLE, "urdf")
        system.WeldFrames(system.world_frame(), system.GetFrameByName("rail"))
        system.Finalize()
    context = system.CreateDefaultContext()
    port = system.get_actuation_input_port() if name == "cart-pole" else system.get_input_port(0)
    port.FixValue(context, np.zeros(port.size()))
    context.SetContinuousState(x0)
    output = system.get_state_output_port() if name != "acrobot" else system.get_output_port(0)
    model = primitives.Linearize(system, context, port.get_index(), output.get_index())
    return [np.asarray(getattr(model, letter)()) for letter in "ABCD"]


@pytest.mark.parametrize("name", ["pendulum", "acrobot", "cart-pole"])
def test_classics_upright(name):
    for ours, theirs in zip(upright("sheldrake", name), upright("pydrake", name)):
        assert ours.shape == theirs.shape
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9 * max(1.0, np.abs(theirs).max(initial=0.0)))


def linear_model(lib, time_step, text):
    """A, B, C, D from actuation to state, held against gravity at an odd posture."""
    primitives = importlib.import_module(f"{lib.library}.systems.primitives")
    parsing = importlib.import_module(f"{lib.library}.multibody.parsing")
    plant = lib.MultibodyPlant(time_step)
    parsing.Parser(plant).AddModelsFromString(text, "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    if time_step:
        plant.SetUseSampledOutputPorts(False)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, np.resize([0.3, -0.4, 0.1, 0.7], plant.num_positions()))
    hold = -plant.CalcGravityGeneralizedForces(context)
    plant.get_actuation_input_port().FixValue(context, hold)
    ports = plant.get_actuation_input_port().get_index(), plant.get_state_output_port().get_index()
    model = primitives.Linearize(plant, context, *ports)
    return [np.asarray(getattr(model, name)()) for name in "ABCD"]


@pytest.mark.parametrize("model", [urdf, arm])
@pytest.mark.parametrize("time_step", [0.0, 1e-2])
def test_linear_models_are_the_same(time_step, model):
    for ours, theirs in zip(*(linear_model(lib(), time_step, model()) for lib in (sheldrake, pydrake))):
        assert ours.shape == theirs.shape
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9 * max(1.0, np.abs(theirs).max()))


def test_the_comparison_sees_a_slightly_heavier_link():
    ours, theirs = linear_model(sheldrake(), 0.0, urdf(1.0 + 1e-7))[0], linear_model(pydrake(), 0.0, urdf())[0]
    assert np.abs(ours - theirs).max() > 1e-9 * np.abs(theirs).max()
