"""Computed torque of an arm: a controller written in Python at 1 kHz."""

import _robots as robots
import numpy as np
from pydrake.all import (
    AbstractValue,
    AddMultibodyPlantSceneGraph,
    DiagramBuilder,
    EventStatus,
    LeafSystem,
    LogVectorOutput,
    MultibodyPlant,
    Parser,
    RigidTransform,
    Simulator,
)


class Controller(LeafSystem):
    def __init__(self, plant):
        super().__init__()
        self.plant = plant
        self.context = plant.CreateDefaultContext()
        n = plant.num_positions()
        self.DeclareVectorInputPort("state", 2 * n)
        self.DeclareVectorOutputPort("torque", n, self.CalcTorque)
        self.DeclarePeriodicDiscreteUpdateEvent(0.001, 0.0, self.Update)
        self.DeclareDiscreteState(n)
        self.kp = 100
        self.kd = 20

    def Update(self, context, discrete):
        x = self.get_input_port(0).Eval(context)
        discrete.get_mutable_vector().SetFromVector(
            0.99 * context.get_discrete_state_vector().CopyToVector() + 0.01 * x[: len(x) // 2]
        )

    def CalcTorque(self, context, output):
        plant = self.plant
        x = self.get_input_port(0).Eval(context)
        n = plant.num_positions()
        plant.SetPositionsAndVelocities(self.context, x)
        M = plant.CalcMassMatrix(self.context)
        C = plant.CalcBiasTerm(self.context)
        g = plant.CalcGravityGeneralizedForces(self.context)
        t = context.get_time()
        qd = 0.3 * np.sin(t + np.arange(n))
        vd = 0.3 * np.cos(t + np.arange(n))
        ad = -qd
        u = M @ (ad + self.kp * (qd - x[:n]) + self.kd * (vd - x[n:])) + C - g
        output.SetFromVector(u)


class Monitor(LeafSystem):
    def __init__(self, plant):
        super().__init__()
        self.plant = plant
        self.DeclareAbstractInputPort("poses", AbstractValue.Make([RigidTransform()]))
        self.DeclarePeriodicPublishEvent(0.01, 0.0, self.Pub)
        self.seen = []

    def Pub(self, context):
        X = self.get_input_port(0).Eval(context)
        self.seen.append(X[-1].translation())


def program():
    builder = DiagramBuilder()
    plant, _sg = AddMultibodyPlantSceneGraph(builder, 0.001)
    Parser(plant).AddModelsFromString(robots.arm(), "urdf")
    plant.Finalize()
    alone = MultibodyPlant(0.0)
    Parser(alone).AddModelsFromString(robots.arm(), "urdf")
    alone.Finalize()
    c = builder.AddSystem(Controller(alone))
    m = builder.AddSystem(Monitor(plant))
    builder.Connect(plant.get_state_output_port(), c.get_input_port(0))
    builder.Connect(c.get_output_port(0), plant.get_actuation_input_port())
    builder.Connect(plant.get_body_poses_output_port(), m.get_input_port(0))
    logger = LogVectorOutput(plant.get_state_output_port(), builder, 0.01)
    diagram = builder.Build()
    simulator = Simulator(diagram)

    def monitor(root):
        pc = plant.GetMyContextFromRoot(root)
        if abs(plant.GetPositions(pc)[0]) > 10:
            return EventStatus.ReachedTermination(diagram, "x")
        return EventStatus.DidNothing()

    simulator.set_monitor(monitor)
    simulator.Initialize()
    simulator.AdvanceTo(0.5)
    log = logger.FindLog(simulator.get_context())
    return log.data()[:, -1].sum(), m.seen[-1]


for _ in range(3):
    program()
