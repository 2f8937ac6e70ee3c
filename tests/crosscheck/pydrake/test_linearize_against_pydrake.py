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
    plant.SetPositions(context, [0.3, -0.4, 0.1, 0.7])
    hold = -plant.CalcGravityGeneralizedForces(context)
    plant.get_actuation_input_port().FixValue(context, hold)
    ports = plant.get_actuation_input_port().get_index(), plant.get_state_output_port().get_index()
    model = primitives.Linearize(plant, context, *ports)
    return [np.asarray(getattr(model, name)()) for name in "ABCD"]


@pytest.mark.parametrize("time_step", [0.0, 1e-2])
def test_linear_models_are_the_same(time_step):
    for ours, theirs in zip(linear_model(sheldrake(), time_step, urdf()), linear_model(pydrake(), time_step, urdf())):
        assert ours.shape == theirs.shape
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9 * max(1.0, np.abs(theirs).max()))


def test_the_comparison_sees_a_slightly_heavier_link():
    ours, theirs = linear_model(sheldrake(), 0.0, urdf(1.0 + 1e-7))[0], linear_model(pydrake(), 0.0, urdf())[0]
    assert np.abs(ours - theirs).max() > 1e-9 * np.abs(theirs).max()
