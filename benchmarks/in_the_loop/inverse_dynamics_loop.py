"""An arm under an inverse dynamics controller that follows what a Python system wants, which samples a trajectory."""

import _robots as robots
import numpy as np
from pydrake.all import (
    AddMultibodyPlantSceneGraph,
    DiagramBuilder,
    InverseDynamicsController,
    LeafSystem,
    LogVectorOutput,
    MultibodyPlant,
    Parser,
    PiecewisePolynomial,
    Simulator,
)


class Wanted(LeafSystem):
    def __init__(self, path):
        super().__init__()
        self.path, self.rate = path, path.MakeDerivative()
        self.DeclareVectorOutputPort("x", 2 * path.rows(), self.calc)

    def calc(self, context, output):
        t = context.get_time()
        output.SetFromVector(np.concatenate([self.path.value(t), self.rate.value(t)]).ravel())


class Error(LeafSystem):
    def __init__(self, n):
        super().__init__()
        self.DeclareVectorInputPort("x", 2 * n)
        self.DeclareVectorInputPort("wanted", 2 * n)
        self.DeclareDiscreteState(1)
        self.DeclarePeriodicDiscreteUpdateEvent(0.01, 0.0, self.update)

    def update(self, context, state):
        e = self.get_input_port(0).Eval(context) - self.get_input_port(1).Eval(context)
        worst = context.get_discrete_state_vector().GetAtIndex(0)
        state.get_mutable_vector().SetAtIndex(0, max(worst, float(np.abs(e).max())))


def program():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.001)
    Parser(plant).AddModelsFromString(robots.arm(False), "urdf")
    plant.Finalize()
    alone = MultibodyPlant(0.0)
    Parser(alone).AddModelsFromString(robots.arm(False), "urdf")
    alone.Finalize()
    n = plant.num_positions()
    knots = np.array([np.zeros(n), np.full(n, 0.4), np.full(n, -0.2)]).T
    path = PiecewisePolynomial.CubicShapePreserving([0.0, 0.3, 0.6], knots, True)
    controller = builder.AddSystem(
        InverseDynamicsController(alone, np.full(n, 100.0), np.full(n, 1.0), np.full(n, 20.0), False)
    )
    wanted, error = builder.AddSystem(Wanted(path)), builder.AddSystem(Error(n))
    builder.Connect(wanted.get_output_port(), controller.get_input_port_desired_state())
    builder.Connect(plant.get_state_output_port(), controller.get_input_port_estimated_state())
    builder.Connect(controller.get_output_port_control(), plant.get_actuation_input_port())
    builder.Connect(plant.get_state_output_port(), error.get_input_port(0))
    builder.Connect(wanted.get_output_port(), error.get_input_port(1))
    log = LogVectorOutput(controller.get_output_port_control(), builder, 0.01)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.Initialize()
    simulator.AdvanceTo(0.6)
    return log.FindLog(simulator.get_context()).data()[:, -1]


for _ in range(3):
    program()
