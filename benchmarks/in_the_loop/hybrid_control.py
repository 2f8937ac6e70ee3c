"""An arm presses on a table: force along z, place along x and y, in Python from poses, Jacobians and gravity."""

import _robots as robots
import numpy as np
from _controllers import HybridForcePosition
from pydrake.all import AddMultibodyPlantSceneGraph, DiagramBuilder, MultibodyPlant, Parser, Simulator

START = np.array([0.0, 0.6, 0.0, -1.5, 0.0, 1.0, 0.0])


def program():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.001)
    parser = Parser(plant)
    (arm,) = parser.AddModelsFromString(robots.arm(), "urdf")
    parser.AddModelsFromString(robots.table(), "urdf")
    plant.Finalize()
    controlled = MultibodyPlant(0.0)
    Parser(controlled).AddModelsFromString(robots.arm(False), "urdf")
    controlled.Finalize()
    controller = builder.AddSystem(
        HybridForcePosition(controlled, controlled.GetBodyByName("link7"), -10.0, np.array([0.4, 0.1, 0.0]))
    )
    builder.Connect(plant.get_state_output_port(arm), controller.get_input_port())
    builder.Connect(controller.get_output_port(), plant.get_actuation_input_port(arm))
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    plant_context = plant.GetMyMutableContextFromRoot(context)
    plant.SetPositions(plant_context, arm, START)
    forces = []
    port = plant.get_contact_results_output_port()
    for t in np.arange(0.02, 0.5, 0.02):
        simulator.AdvanceTo(t)
        results = port.Eval(plant_context)
        forces.append(
            sum(
                (results.point_pair_contact_info(i).contact_force() for i in range(results.num_point_pair_contacts())),
                np.zeros(3),
            )
        )


for _ in range(3):
    program()
