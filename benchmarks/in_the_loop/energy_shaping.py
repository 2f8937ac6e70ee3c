"""An acrobot that pumps energy and a pendulum that is swung up, by controllers that ask models for their energies."""

import numpy as np
from pydrake.all import (
    DiagramBuilder,
    LeafSystem,
    Linearize,
    LinearQuadraticRegulator,
    LogVectorOutput,
    Saturation,
    Simulator,
    VectorSystem,
    WrapToSystem,
)
from pydrake.examples import AcrobotInput, AcrobotPlant, AcrobotState, PendulumPlant


class SwingUp(VectorSystem):
    """Energy shaping far from the top, a linear regulator near it."""

    def __init__(self, pendulum):
        VectorSystem.__init__(self, 2, 1, True)
        context = pendulum.CreateDefaultContext()
        pendulum.get_input_port(0).FixValue(context, [0.0])
        context.SetContinuousState([np.pi, 0.0])
        self.pendulum, self.context = pendulum, context
        self.wanted = self.energy()
        linear = Linearize(pendulum, context)
        self.K, self.S = LinearQuadraticRegulator(linear.A(), linear.B(), np.diag([10.0, 1.0]), [1.0])
        self.damping = context.get_numeric_parameter(0)[2]

    def energy(self):
        return self.pendulum.EvalPotentialEnergy(self.context) + self.pendulum.EvalKineticEnergy(self.context)

    def DoCalcVectorOutput(self, context, u, x, y):
        angle, speed = u
        error = np.array([angle % (2.0 * np.pi) - np.pi, speed])
        if error @ self.S @ error < 2.0:
            y[:] = -self.K @ error
        else:
            self.context.SetContinuousState(u)
            y[:] = self.damping * speed - 0.5 * speed * (self.energy() - self.wanted)


class Pump(LeafSystem):
    """Holds the elbow and pushes it along with the shoulder while energy is missing."""

    def __init__(self, acrobot):
        super().__init__()
        self.DeclareVectorInputPort("x", AcrobotState())
        self.DeclareVectorOutputPort("u", AcrobotInput(), self.calc)
        self.acrobot, self.context = acrobot, acrobot.CreateDefaultContext()

    def calc(self, context, output):
        x = self.get_input_port(0).Eval(context)
        self.context.get_mutable_continuous_state_vector().SetFromVector(x)
        energy = self.acrobot.EvalKineticEnergy(self.context) + self.acrobot.EvalPotentialEnergy(self.context)
        torque = -5.0 * x[1] - x[3] + 0.05 * (20.0 - energy) * x[2]
        output.SetAtIndex(0, float(np.clip(torque, -8.0, 8.0)))


def pendulum():
    builder = DiagramBuilder()
    plant = builder.AddSystem(PendulumPlant())
    wrap = builder.AddSystem(WrapToSystem(2))
    wrap.set_interval(0, 0.0, 2.0 * np.pi)
    controller = builder.AddSystem(SwingUp(PendulumPlant()))
    saturation = builder.AddSystem(Saturation([-3.0], [3.0]))
    builder.Connect(plant.get_output_port(0), wrap.get_input_port(0))
    builder.Connect(wrap.get_output_port(0), controller.get_input_port(0))
    builder.Connect(controller.get_output_port(0), saturation.get_input_port(0))
    builder.Connect(saturation.get_output_port(0), plant.get_input_port(0))
    log = LogVectorOutput(plant.get_output_port(0), builder, 0.05)
    simulator = Simulator(builder.Build())
    simulator.get_mutable_context().SetContinuousState([0.1, 0.5])
    simulator.get_mutable_integrator().set_target_accuracy(1e-7)
    simulator.AdvanceTo(4.0)
    return log.FindLog(simulator.get_context()).data()


def acrobot():
    builder = DiagramBuilder()
    plant, controller = builder.AddSystem(AcrobotPlant()), builder.AddSystem(Pump(AcrobotPlant()))
    builder.Connect(plant.get_output_port(0), controller.get_input_port(0))
    builder.Connect(controller.get_output_port(0), plant.get_input_port(0))
    log = LogVectorOutput(plant.get_output_port(0), builder, 0.05)
    simulator = Simulator(builder.Build())
    simulator.get_mutable_context().SetContinuousState([0.1, 0.0, 0.0, 0.0])
    simulator.get_mutable_integrator().set_target_accuracy(1e-8)
    simulator.AdvanceTo(2.0)
    return log.FindLog(simulator.get_context()).data()


def program():
    return pendulum(), acrobot()


for _ in range(3):
    program()
