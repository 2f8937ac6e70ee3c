"""Rimless wheel: a hybrid system with a witness and a reset, its Poincare map and the basin of standing."""

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import (
    DiagramBuilder,
    LeafSystem,
    UnrestrictedUpdateEvent,
    WitnessFunctionDirection,
)
from pydrake.systems.primitives import LogVectorOutput


class RimlessWheel(LeafSystem):
    def __init__(self, slope=0.08, alpha=np.pi / 8, length=1.0, gravity=9.81):
        LeafSystem.__init__(self)
        self.slope, self.alpha, self.length, self.g = slope, alpha, length, gravity
        self.DeclareContinuousState(2)
        self.steps = self.DeclareDiscreteState([0.0])
        self.DeclareVectorOutputPort("state", 2, self.out)
        self.forward = self.MakeWitnessFunction(
            "forward",
            WitnessFunctionDirection.kPositiveThenNonPositive,
            lambda c: self.slope + self.alpha - c.get_continuous_state_vector()[0],
            UnrestrictedUpdateEvent(system_callback=self.step_forward),
        )
        self.backward = self.MakeWitnessFunction(
            "backward",
            WitnessFunctionDirection.kPositiveThenNonPositive,
            lambda c: c.get_continuous_state_vector()[0] - self.slope + self.alpha,
            UnrestrictedUpdateEvent(system_callback=self.step_back),
        )

    def DoGetWitnessFunctions(self, context):
        return [self.forward, self.backward]

    def out(self, context, output):
        output.SetFromVector(context.get_continuous_state_vector().CopyToVector())

    def DoCalcTimeDerivatives(self, context, derivatives):
        theta, rate = context.get_continuous_state_vector().CopyToVector()
        derivatives.get_mutable_vector().SetFromVector([rate, self.g / self.length * np.sin(theta)])

    def reset(self, context, state, sign):
        x = state.get_mutable_continuous_state().get_mutable_vector()
        theta, rate = x.CopyToVector()
        x.SetFromVector([theta - sign * 2 * self.alpha, rate * np.cos(2 * self.alpha)])
        d = state.get_mutable_discrete_state(0)
        d.SetAtIndex(0, d.GetAtIndex(0) + sign)

    def step_forward(self, system, context, event, state):
        self.reset(context, state, 1)

    def step_back(self, system, context, event, state):
        self.reset(context, state, -1)


def program():
    builder = DiagramBuilder()
    wheel = builder.AddSystem(RimlessWheel())
    log = LogVectorOutput(wheel.get_output_port(0), builder, 0.05)
    diagram = builder.Build()
    out = []
    for rate in (0.2, 0.8, 1.2, 2.5):
        simulator = Simulator(diagram)
        simulator.get_mutable_integrator().set_target_accuracy(1e-8)
        simulator.get_mutable_integrator().set_maximum_step_size(0.01)
        root = simulator.get_mutable_context()
        context = wheel.GetMyMutableContextFromRoot(root)
        context.SetContinuousState([0.0, rate])
        root.SetAccuracy(1e-8)
        simulator.Initialize()
        simulator.AdvanceTo(5.0)
        out.append(
            np.r_[
                context.get_continuous_state_vector().CopyToVector(), context.get_discrete_state_vector().CopyToVector()
            ]
        )
        out.append(log.FindLog(root).data()[:, ::10])
    return out


for _ in range(2):
    program()
