"""A nut on a smooth rod: a cylindrical joint, read from URDF, written again, and let go."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from sheldrake.cad import ConvertModel
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import CylindricalJoint, JacobianWrtVariable
from sheldrake.systems.analysis import Simulator

NUT = """
<robot name="rod">
  <link name="nut">
    <inertial>
      <mass value="2"/> <inertia ixx="0.3" iyy="0.3" izz="0.5" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <drake:joint name="rod" type="cylindrical">
    <parent link="world"/> <child link="nut"/> <axis xyz="0 0 1"/> <dynamics damping="0.25 0"/>
  </drake:joint>
</robot>
"""


def plant_of(urdf: str, time_step: float) -> MultibodyPlant:
    """A finished plant of one model."""
    plant = MultibodyPlant(time_step)
    Parser(plant).AddModelsFromString(urdf, "urdf")
    plant.Finalize()
    return plant


# It falls along the rod as if nothing turned, and its spin decays as if nothing fell.
plant = plant_of(NUT, 0.0)
joint = plant.GetJointByName("rod")
assert isinstance(joint, CylindricalJoint)
assert plant.GetPositionNames() == ["rod_rod_q", "rod_rod_x"]
simulator = Simulator(plant)
context = simulator.get_mutable_context()
plant.SetVelocities(context, [3.0, 1.0])
simulator.AdvanceTo(0.5)
q, v = plant.GetPositions(context), plant.GetVelocities(context)
decay = np.exp(-0.25 / 0.5 * 0.5)
np.testing.assert_allclose(v, [3.0 * decay, 1.0 - 9.81 * 0.5], rtol=1e-4)
np.testing.assert_allclose(q, [3.0 * (1.0 - decay) / 0.5, 0.5 - 9.81 / 8.0], rtol=1e-4)

# The kernels and the class agree on the pose; velocities are what the Jacobian says.
body = plant.GetBodyByName("nut")
assert plant.EvalBodyPoseInWorld(context, body).IsNearlyEqualTo(joint.GetPose(context), 1e-14)
J = plant.CalcJacobianSpatialVelocity(
    context, JacobianWrtVariable.kV, body.body_frame(), np.zeros(3), plant.world_frame(), plant.world_frame()
)
np.testing.assert_allclose(plant.EvalBodySpatialVelocityInWorld(context, body).get_coeffs(), J @ v, atol=1e-14)

# A discrete plant steps by the same kernels; what it writes reads the same.
stepped = plant_of(NUT, 1e-3)
simulator = Simulator(stepped)
stepped.SetVelocities(simulator.get_mutable_context(), [3.0, 1.0])
simulator.AdvanceTo(0.5)
np.testing.assert_allclose(stepped.GetVelocities(simulator.get_context()), v, rtol=1e-3)
with TemporaryDirectory() as folder:
    source, again = Path(folder) / "nut.urdf", Path(folder) / "again.urdf"
    source.write_text(NUT)
    ConvertModel(source, again)
    assert 'type="cylindrical"' in again.read_text()
    assert plant_of(again.read_text(), 0.0).num_positions() == 2
print("ok")
