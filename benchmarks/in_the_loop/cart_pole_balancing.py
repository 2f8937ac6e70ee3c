"""A cart-pole under a linear-quadratic regulator of its linearization, from many starts, with logs."""

import _robots as robots
import numpy as np
from pydrake.all import (
    AddMultibodyPlantSceneGraph,
    DiagramBuilder,
    Linearize,
    LinearQuadraticRegulator,
    LogVectorOutput,
    Parser,
    Saturation,
    Simulator,
    WrapToSystem,
)


def program():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    Parser(plant).AddModelsFromString(robots.cart_pole(), "urdf")
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.get_actuation_input_port().FixValue(context, [0.0])
    plant.SetPositionsAndVelocities(context, [0, np.pi, 0, 0])
    port = plant.get_actuation_input_port().get_index()
    Linearize(plant, context, port, plant.get_state_output_port().get_index())
    regulator = builder.AddSystem(
        LinearQuadraticRegulator(plant, context, np.diag([10, 10, 1, 1]), np.eye(1), input_port_index=port)
    )
    wrap = builder.AddSystem(WrapToSystem(4))
    wrap.set_interval(1, 0, 2 * np.pi)
    limit = builder.AddSystem(Saturation([-100.0], [100.0]))
    builder.Connect(plant.get_state_output_port(), wrap.get_input_port())
    builder.Connect(wrap.get_output_port(), regulator.get_input_port())
    builder.Connect(regulator.get_output_port(), limit.get_input_port())
    builder.Connect(limit.get_output_port(), plant.get_actuation_input_port())
    log = LogVectorOutput(plant.get_state_output_port(), builder)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    generator = np.random.default_rng(1)
    for _ in range(5):
        context.SetTime(0.0)
        start = np.array([0, np.pi, 0, 0]) + 0.1 * generator.standard_normal(4)
        context.SetContinuousState(start)
        log.FindMutableLog(context).Clear()
        simulator.Initialize()
        for t in np.arange(0.1, 3.0, 0.1):
            simulator.AdvanceTo(t)
        log.FindLog(context).data()


for _ in range(3):
    program()
