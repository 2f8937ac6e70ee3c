"""A dog plays a gait: joint targets from Python at each step of a loop, poses and contact forces read back."""

import _robots as robots
import numpy as np
from pydrake.all import (
    AddMultibodyPlantSceneGraph,
    ConstantVectorSource,
    DiagramBuilder,
    Parser,
    PidController,
    RigidTransform,
    Simulator,
)


def program():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.002)
    parser = Parser(plant)
    (dog,) = parser.AddModelsFromString(robots.dog(), "urdf")
    parser.AddModelsFromString(robots.table(), "urdf")
    plant.SetDefaultFloatingBaseBodyPose(plant.GetBodyByName("trunk"), RigidTransform([0, 0, 0.2]))
    plant.Finalize()
    n = plant.num_actuators()
    S = plant.MakeStateSelectorMatrix(
        [plant.get_joint_actuator(i).joint().index() for i in plant.GetJointActuatorIndices()]
    )
    pid = builder.AddSystem(
        PidController(S, plant.MakeActuationMatrix().T[:, 6:], np.full(n, 5.0), np.zeros(n), np.full(n, 0.05))
    )
    builder.Connect(plant.get_state_output_port(), pid.get_input_port_estimated_state())
    builder.Connect(pid.get_output_port_control(), plant.get_actuation_input_port())
    target = builder.AddSystem(ConstantVectorSource(np.zeros(2 * n)))
    builder.Connect(target.get_output_port(), pid.get_input_port_desired_state())
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    plant_context = plant.GetMyMutableContextFromRoot(context)
    source = target.get_mutable_source_value(target.GetMyMutableContextFromRoot(context))
    trunk, joints = plant.GetBodyByName("trunk"), plant.GetJointIndices(dog)
    heights, angles = [], []
    for t in np.arange(0.01, 1.0, 0.01):
        swing = 0.3 * np.sin(2 * np.pi * 2.0 * t + np.pi * np.array([0, 1, 1, 0]))
        command = np.zeros(2 * n)
        command[:n] = np.array([np.zeros(4), 0.5 + swing, -1.0 + np.maximum(swing, 0)]).T.reshape(-1)
        source.SetFromVector(command)
        simulator.AdvanceTo(t)
        heights.append(plant.EvalBodyPoseInWorld(plant_context, trunk).translation()[2])
        angles.append([plant.get_joint(i).name() for i in joints])
        plant.CalcCenterOfMassPositionInWorld(plant_context)


for _ in range(3):
    program()
