"""Random initial conditions with RandomGenerator, random parameters, evaluation in a loop."""

import _robots as robots
import numpy as np
from pydrake.all import (
    AddMultibodyPlantSceneGraph,
    DiagramBuilder,
    Gain,
    MonteCarloSimulation,
    Parser,
    RandomDistribution,
    RandomGenerator,
    RandomSource,
    Simulator,
)

builder = DiagramBuilder()
plant, sg = AddMultibodyPlantSceneGraph(builder, 0.002)
Parser(plant).AddModelsFromString(robots.cart_pole(), "urdf")
plant.Finalize()
noise = builder.AddSystem(RandomSource(RandomDistribution.kGaussian, 1, 0.02))
gain = builder.AddSystem(Gain(0.1, 1))
builder.Connect(noise.get_output_port(), gain.get_input_port())
builder.Connect(gain.get_output_port(), plant.get_actuation_input_port())
diagram = builder.Build()


def make(gen):
    sim = Simulator(diagram)
    return sim


def program():
    generator = RandomGenerator(42)
    context = diagram.CreateDefaultContext()
    out = []
    simulator = Simulator(diagram, context)
    for _ in range(50):
        diagram.SetRandomContext(context, generator)
        context.SetTime(0.0)
        pc = plant.GetMyMutableContextFromRoot(context)
        x0 = plant.GetPositionsAndVelocities(pc)
        simulator.Initialize()
        simulator.AdvanceTo(0.1)
        out.append(np.linalg.norm(plant.GetPositionsAndVelocities(pc) - x0))
    MonteCarloSimulation(make, lambda s, c: c.get_time(), 0.05, 10, RandomGenerator(1))
    saved = context.Clone()
    for _ in range(100):
        context.SetTimeStateAndParametersFrom(saved)
        simulator.Initialize()
        simulator.AdvanceTo(saved.get_time() + 0.004)
    return np.array(out).mean()


for _ in range(3):
    program()
