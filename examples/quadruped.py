"""A four-legged robot stands: twelve joints, each held by a spring and a damper ("PD"), bear its weight.

Run it: python examples/quadruped.py [--headless]
"""

import sys

import numpy as np

from sheldrake import model_path
from sheldrake.all import (
    AddMultibodyPlantSceneGraph,
    ConstantVectorSource,
    CoulombFriction,
    DiagramBuilder,
    HalfSpace,
    JointActuatorIndex,
    MeshcatVisualizer,
    Parser,
    PdControllerGains,
    RigidTransform,
    Simulator,
    StartMeshcat,
)

STANCE = np.tile([0.0, 0.7, -1.4], 4)
"""Roll, pitch and knee of each leg [rad]."""
HEIGHT = 2 * 0.22 * np.cos(0.7) + 0.025
"""Of the trunk's centre, if the joints did not yield [m]: thigh, shank, radius of a foot."""


def add_scene(plant):
    (quadruped,) = Parser(plant).AddModels(model_path("quadruped/quadruped.urdf"))
    ground = plant.world_body(), RigidTransform(), HalfSpace(), "ground"
    plant.RegisterCollisionGeometry(*ground, CoulombFriction(0.8, 0.7))
    plant.RegisterVisualGeometry(*ground, [0.6, 0.65, 0.7, 1.0])
    for i in range(plant.num_actuators()):
        plant.get_joint_actuator(JointActuatorIndex(i)).set_controller_gains(PdControllerGains(p=300.0, d=8.0))
    return quadruped


def main(meshcat=None, seconds=2.0):
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
    quadruped = add_scene(plant)
    plant.Finalize()
    wanted = builder.AddSystem(ConstantVectorSource(np.concatenate([STANCE, np.zeros(12)])))
    builder.Connect(wanted.get_output_port(), plant.get_desired_state_input_port(quadruped))
    if meshcat is not None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    simulator = Simulator(builder.Build())

    plant_context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    trunk = plant.GetBodyByName("trunk")
    plant.SetFreeBodyPose(plant_context, trunk, RigidTransform([0.0, 0.0, HEIGHT + 0.02]))
    for i, angle in enumerate(STANCE):
        plant.get_joint_actuator(JointActuatorIndex(i)).joint().set_angle(plant_context, angle)
    simulator.set_target_realtime_rate(1.0 if meshcat is not None else 0.0)
    simulator.AdvanceTo(seconds)

    contacts = plant.get_contact_results_output_port().Eval(plant_context)
    feet = [contacts.point_pair_contact_info(i).contact_force()[2] for i in range(contacts.num_point_pair_contacts())]
    load, weight = abs(sum(feet)), plant.CalcTotalMass(plant_context) * 9.81
    sag = HEIGHT - plant.EvalBodyPoseInWorld(plant_context, trunk).translation()[2]
    print(f"{len(feet)} feet bear {load:.3f} N of {weight:.3f} N; the trunk sags by {1000 * sag:.1f} mm")
    return load / weight, sag


if __name__ == "__main__":
    main(None if "--headless" in sys.argv else StartMeshcat())
