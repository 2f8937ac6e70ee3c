"""Mistakes that people make: an editor underlines every line that ends with "# wrong", and no other."""

import numpy as np

from sheldrake.all import (
    AddMultibodyPlantSceneGraph,
    Box,
    CoulombFriction,
    DiagramBuilder,
    LogVectorOutput,
    MathematicalProgram,
    Meshcat,
    MultibodyPlant,
    Parser,
    RigidTransform,
    RollPitchYaw,
    RotationMatrix,
    Simulator,
    SpatialInertia,
    VectorLogSink,
)

builder = DiagramBuilder()
plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step="1e-3")  # wrong
models = Parser(plant).AddModel("robot.urdf")  # wrong
model = Parser(plant).AddModels("robot.urdf")[0]
body = plant.AddRigidBody("block", SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 0.1))
plant.AddRigidBody(SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 0.1), "block")  # wrong
plant.RegisterCollisionGeometry(body, RigidTransform(), Box(1, 1), "box", CoulombFriction(1, 1))  # wrong
plant.Finalise()  # wrong
plant.Finalize()
diagram = builder.build()  # wrong
root_diagram = builder.Build()
context = root_diagram.CreateContext()  # wrong
root = root_diagram.CreateDefaultContext()
plant_context = plant.GetMyContextFromRoot(root)
time = root.time()  # wrong
later = root.get_time() + "1"  # wrong
plant.SetFreeBodyPose(plant_context, body, [0, 0, 1])  # wrong
X_WB = plant.EvalBodyPoseInWorld(plant_context, body)
p_WB = X_WB.position()  # wrong
X_BW = X_WB.inverse().inverted()  # wrong
R_WB = (X_WB @ X_WB).rotation().as_matrix()  # wrong
p_WQ: RigidTransform = X_WB @ np.zeros(3)  # wrong
rpy = RollPitchYaw(RotationMatrix()).roll()  # wrong
upright = RollPitchYaw(0, 0)  # wrong
turned = RotationMatrix.MakeXRotation(0.5).Inverse()  # wrong
logger = LogVectorOutput(plant.get_state_output_port(), builder)
data = logger.FindLog(root).data
samples = logger.FindLog(root).samples()  # wrong
simulator = Simulator(root_diagram, root)
simulator.AdvanceTo("2.0")  # wrong
simulator.set_target_realtime_rate(rate=1.0)  # wrong
simulator.get_context().SetTime()  # wrong
Meshcat().SetObject("box")  # wrong
Meshcat().url()  # wrong
finished = MultibodyPlant(0.001).is_finalised()  # wrong
sink = VectorLogSink("two")  # wrong
program = MathematicalProgram()
x = program.NewContinuousVariables(2, name="x")
y = program.NewContinuousVariables(2, named="y")  # wrong
program.AddCost(x.dot(x))
program.AddQuadraticCost(np.eye(2), np.zeros(2), x, convex=True)  # wrong
program.AddQuadraticCost(np.eye(2), np.zeros(2), x, is_convex=True)
program.AddLinearConstraint(x[0] + x[1] <= 1)
program.AddLinearConstraint(np.ones((1, 2)), [0.0])  # wrong
program.AddBoundingBoxConstraint(0, 1, x)
