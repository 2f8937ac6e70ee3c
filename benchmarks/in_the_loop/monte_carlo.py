"""Many short simulations: a Simulator each, of contexts that are cloned or set anew, and of diagrams built anew."""

import _robots as robots
import numpy as np
from pydrake.all import (
    AddMultibodyPlantSceneGraph,
    Box,
    ConstantVectorSource,
    CoulombFriction,
    DiagramBuilder,
    LeafSystem,
    Parser,
    RandomGenerator,
    RigidTransform,
    RollPitchYaw,
    Simulator,
    SpatialInertia,
    SpatialVelocity,
)


class Damping(LeafSystem):
    def __init__(self):
        super().__init__()
        self.DeclareVectorInputPort("x", 4)
        self.DeclareVectorOutputPort("u", 1, self.calc)

    def calc(self, context, output):
        x = self.get_input_port(0).Eval(context)
        output.SetAtIndex(0, -2.0 * x[2] - x[0])


def falling_box():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.002)
    body = plant.AddRigidBody("box", SpatialInertia.SolidBoxWithMass(1.0, 0.2, 0.2, 0.2))
    friction = CoulombFriction(0.6, 0.6)
    plant.RegisterCollisionGeometry(body, RigidTransform(), Box(0.2, 0.2, 0.2), "box", friction)
    ground = RigidTransform([0.0, 0.0, -0.5])
    plant.RegisterCollisionGeometry(plant.world_body(), ground, Box(9.0, 9.0, 1.0), "ground", friction)
    plant.Finalize()
    return plant, body, builder.Build()


def cart():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.005)
    Parser(plant).AddModelsFromString(robots.cart_pole(), "urdf")
    plant.Finalize()
    control = builder.AddSystem(Damping())
    builder.AddSystem(ConstantVectorSource([1.0]))
    builder.Connect(plant.get_state_output_port(), control.get_input_port())
    builder.Connect(control.get_output_port(), plant.get_actuation_input_port())
    return plant, builder.Build()


def program():
    plant, body, diagram = falling_box()
    generator, found = np.random.default_rng(3), []
    for _ in range(20):
        context = diagram.CreateDefaultContext()
        mine = plant.GetMyContextFromRoot(context)
        R = RollPitchYaw(generator.uniform(-0.2, 0.2, 3)).ToRotationMatrix()
        plant.SetFreeBodyPose(mine, body, RigidTransform(R, [0.0, 0.0, 0.3]))
        plant.SetFreeBodySpatialVelocity(mine, body, SpatialVelocity(np.zeros(3), [0.1, 0.0, 0.0]))
        simulator = Simulator(diagram, context)
        simulator.AdvanceTo(0.2)
        found.append(plant.GetFreeBodyPose(mine, body).translation())
    plant, diagram = cart()
    kept = diagram.CreateDefaultContext()
    for k in range(20):
        context = kept.Clone()
        plant.SetPositions(plant.GetMyContextFromRoot(context), [0.0, 0.1 * k])
        simulator = Simulator(diagram, context)
        simulator.Initialize()
        simulator.AdvanceTo(0.1)
        found.append(plant.GetPositions(plant.GetMyContextFromRoot(context)))
        diagram.SetRandomContext(context, RandomGenerator(k))
        kept.SetTimeStateAndParametersFrom(context)
        kept.SetTime(0.0)
    for _ in range(3):
        plant, diagram = cart()
        simulator = Simulator(diagram)
        simulator.AdvanceTo(0.05)
        found.append(plant.GetPositions(plant.GetMyContextFromRoot(simulator.get_context())))
    return np.concatenate(found)


for _ in range(3):
    program()
