"""A cone, read from SDFormat: it stands on its base, lies where it is put on its side, and is seen by all queries."""

from __future__ import annotations

import numpy as np

from sheldrake.geometry import CalcObb, CalcVolume, Cone
from sheldrake.math import RigidTransform, RotationMatrix
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.multibody.tree import CalcSpatialInertia
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder

MODEL = """
<sdf version="1.12">
  <world name="floor">
    <model name="ground"><static>true</static>
      <link name="ground">
        <collision name="plane"><geometry><plane/></geometry></collision>
      </link>
    </model>
    <model name="cone"><pose>0 0 0.21 0 0 0</pose>
      <link name="cone">
        <inertial><pose>0 0 -0.1 0 0 0</pose><mass>1</mass></inertial>
        <collision name="cone"><geometry><cone><radius>0.1</radius><length>0.4</length></cone></geometry></collision>
      </link>
    </model>
  </world>
</sdf>
"""
cone = Cone(0.1, 0.4)

# Solid geometry: mass against the sum over many thin discs.
M = CalcSpatialInertia(cone, 1000.0)
z = (np.arange(2000) + 0.5) / 2000 * 0.4 - 0.2
disc = 1000.0 * np.pi * (0.1 * (0.2 - z) / 0.4) ** 2 * 0.4 / 2000
np.testing.assert_allclose(M.get_mass(), disc.sum(), rtol=1e-6)
np.testing.assert_allclose(M.get_com(), [0.0, 0.0, disc @ z / disc.sum()], atol=1e-7)
I_zz = M.CalcRotationalInertia().CopyToFullMatrix3()[2, 2]
np.testing.assert_allclose(I_zz, 0.5 * disc @ (0.1 * (0.2 - z) / 0.4) ** 2, rtol=1e-6)
assert CalcVolume(cone) == M.get_mass() / 1000.0
np.testing.assert_array_equal(CalcObb(cone).half_width(), [0.1, 0.1, 0.2])

# It falls a centimetre and stands.
builder = DiagramBuilder()
plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
Parser(plant).AddModelsFromString(MODEL, "sdf")
plant.Finalize()
diagram = builder.Build()
simulator = Simulator(diagram)
simulator.AdvanceTo(1.0)
context = plant.GetMyContextFromRoot(simulator.get_context())
X_WB = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName("cone"))
np.testing.assert_allclose(X_WB.translation(), [0.0, 0.0, 0.2], atol=1e-4)
np.testing.assert_allclose(X_WB.rotation().matrix(), np.eye(3), atol=1e-6)

# Queries see it: over the tip, beside the slope, under it, and along a ray.
query = scene_graph.get_query_output_port().Eval(scene_graph.GetMyContextFromRoot(simulator.get_context()))
cone_id = plant.GetCollisionGeometriesForBody(plant.GetBodyByName("cone"))[0]
X_WG = query.GetPoseInWorld(cone_id)
out = np.array([0.4, 0.0, 0.1]) / np.hypot(0.4, 0.1)
for p_GQ, distance in (
    ([0.0, 0.0, 0.25], 0.05),
    ([0.05, 0.0, 0.0] + 0.03 * out, 0.03),
    ([0.05, 0.0, 0.0] - 0.01 * out, -0.01),
):
    found = {d.id_G: d.distance for d in query.ComputeSignedDistanceToPoint(X_WG @ np.asarray(p_GQ))}
    np.testing.assert_allclose(found[cone_id], distance, atol=1e-6)
hits = query.ComputeRayIntersections([1.0, 0.0, 0.2], [-1.0, 0.0, 0.0])
assert hits.id_G == [cone_id]
np.testing.assert_allclose(hits.distance, 0.95, atol=1e-4)

# Upside down, its tip a centimetre in the ground: that is where it touches.
upside_down = RigidTransform(RotationMatrix.MakeXRotation(np.pi), [0.0, 0.0, 0.19])
root = diagram.CreateDefaultContext()
plant.SetFreeBodyPose(plant.GetMyMutableContextFromRoot(root), plant.GetBodyByName("cone"), upside_down)
query = scene_graph.get_query_output_port().Eval(scene_graph.GetMyContextFromRoot(root))
contacts = query.ComputePointPairPenetration()
assert len(contacts) == 1
contact = contacts[0]
np.testing.assert_allclose(contact.depth, 0.01, atol=1e-12)
np.testing.assert_allclose([contact.p_WCa[:2], contact.p_WCb[:2]], np.zeros((2, 2)), atol=1e-12)
print("ok")
