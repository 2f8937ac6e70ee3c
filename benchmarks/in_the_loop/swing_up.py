"""A pendulum swung up by its energy and caught by a regulator, both in Python; a monitor watches, a log is read."""

import numpy as np
from pydrake.all import (
    BasicVector,
    DiagramBuilder,
    EventStatus,
    LeafSystem,
    Linearize,
    LinearQuadraticRegulator,
    LogVectorOutput,
    Saturation,
    Simulator,
    WrapToSystem,
)
from pydrake.examples import PendulumPlant


class SwingUp(LeafSystem):
    def __init__(self, pendulum):
        super().__init__()
        self.DeclareVectorInputPort("x", 2)
        self.DeclareVectorOutputPort("u", BasicVector(1), self.calc)
        self.pendulum, self.context = pendulum, pendulum.CreateDefaultContext()
        self.pendulum.get_input_port().FixValue(self.context, [0.0])
        up = [np.pi, 0.0]
        self.context.SetContinuousState(up)
        linear = Linearize(pendulum, self.context)
        self.K, self.S = LinearQuadraticRegulator(linear.A(), linear.B(), np.diag([10.0, 1.0]), np.eye(1))
        self.wanted = self.energy(up)

    def energy(self, x):
        self.context.SetContinuousState(x)
        return self.pendulum.EvalPotentialEnergy(self.context) + self.pendulum.EvalKineticEnergy(self.context)

    def calc(self, context, output):
        x = self.EvalVectorInput(context, 0).CopyToVector()
        error = x - [np.pi, 0.0]
        if error @ self.S @ error < 2.0:
            output.SetFromVector(-self.K @ error)
        else:
            output.SetAtIndex(0, 0.1 * x[1] + x[1] * (self.wanted - self.energy(x)))


def program():
    builder = DiagramBuilder()
    plant = builder.AddSystem(PendulumPlant())
    wrap = builder.AddSystem(WrapToSystem(2))
    wrap.set_interval(0, 0.0, 2.0 * np.pi)
    limit = builder.AddSystem(Saturation(min_value=[-3.0], max_value=[3.0]))
    control = builder.AddSystem(SwingUp(PendulumPlant()))
    builder.Connect(plant.get_output_port(0), wrap.get_input_port(0))
    builder.Connect(wrap.get_output_port(0), control.get_input_port(0))
    builder.Connect(control.get_output_port(0), limit.get_input_port(0))
    builder.Connect(limit.get_output_port(0), plant.get_input_port(0))
    log = LogVectorOutput(plant.get_output_port(0), builder)
    simulator = Simulator(builder.Build())
    context = simulator.get_mutable_context()
    context.SetContinuousState([0.1, 0.2])
    largest = [0.0]

    def watch(root):
        largest[0] = max(largest[0], abs(plant.GetMyContextFromRoot(root).get_continuous_state_vector()[1]))
        return EventStatus.DidNothing()

    simulator.set_monitor(watch)
    simulator.Initialize()
    simulator.AdvanceTo(4.0)
    return log.FindLog(context).data()[:, -1], largest[0]


for _ in range(3):
    program()
