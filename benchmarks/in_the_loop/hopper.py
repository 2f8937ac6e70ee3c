"""Spring-loaded hopper: flight and stance by witnesses with an abstract mode; apex map and fixed point by Newton."""

import numpy as np
from pydrake.all import (
    AbstractValue,
    LeafSystem,
    Simulator,
    UnrestrictedUpdateEvent,
    WitnessFunctionDirection,
)


class SLIP(LeafSystem):
    m, k, l0, g = 80.0, 15000.0, 1.0, 9.81

    def __init__(self, touchdown):
        super().__init__()
        self.touchdown_angle = touchdown
        self.DeclareContinuousState(2, 2, 0)
        self.mode = self.DeclareAbstractState(AbstractValue.Make("flight"))
        self.foot = self.DeclareDiscreteState(1)
        self.DeclareAbstractOutputPort(
            "mode", lambda: AbstractValue.Make(""), lambda c, o: o.set_value(c.get_abstract_state(0).get_value())
        )
        self.touch = self.MakeWitnessFunction(
            "touchdown",
            WitnessFunctionDirection.kPositiveThenNonPositive,
            self.height,
            UnrestrictedUpdateEvent(system_callback=self.land),
        )
        self.lift = self.MakeWitnessFunction(
            "liftoff",
            WitnessFunctionDirection.kPositiveThenNonPositive,
            self.compression,
            UnrestrictedUpdateEvent(system_callback=self.leave),
        )
        self.top = self.MakeWitnessFunction(
            "apex",
            WitnessFunctionDirection.kPositiveThenNonPositive,
            self.vertical,
            UnrestrictedUpdateEvent(system_callback=self.apex),
        )
        self.apices = []

    def DoGetWitnessFunctions(self, context):
        if context.get_abstract_state(0).get_value() == "flight":
            return [self.touch, self.top]
        return [self.lift]

    def x(self, context):
        return context.get_continuous_state_vector().CopyToVector()

    def height(self, context):
        return self.x(context)[1] - self.l0 * np.cos(self.touchdown_angle)

    def vertical(self, context):
        return self.x(context)[3]

    def compression(self, context):
        x = self.x(context)
        return self.l0 - np.hypot(x[0] - context.get_discrete_state(0).GetAtIndex(0), x[1])

    def land(self, system, context, event, state):
        state.get_mutable_abstract_state().get_mutable_value(0).set_value("stance")
        x = self.x(context)
        state.get_mutable_discrete_state(0).SetAtIndex(0, x[0] + self.l0 * np.sin(self.touchdown_angle))
        return None

    def leave(self, system, context, event, state):
        state.get_mutable_abstract_state().get_mutable_value(0).set_value("flight")

    def apex(self, system, context, event, state):
        self.apices.append((context.get_time(), *self.x(context)))

    def DoCalcTimeDerivatives(self, context, derivatives):
        x = self.x(context)
        a = np.array([0, -self.g])
        if context.get_abstract_state(0).get_value() == "stance":
            r = x[:2] - [context.get_discrete_state(0).GetAtIndex(0), 0]
            l = np.linalg.norm(r)
            a = a + self.k / self.m * (self.l0 - l) * r / l
        derivatives.get_mutable_vector().SetFromVector(np.r_[x[2:], a])


def apex_map(y, speed, angle, hops=1):
    slip = SLIP(angle)
    simulator = Simulator(slip)
    context = simulator.get_mutable_context()
    context.SetContinuousState([0, y, speed, -1e-9])
    simulator.get_mutable_integrator().set_target_accuracy(1e-7)
    simulator.get_mutable_integrator().set_maximum_step_size(0.02)
    context.SetAccuracy(1e-7)
    simulator.Initialize()
    simulator.AdvanceTo(0.75 * hops)
    return slip.apices


def program():
    angle = 0.4
    y = 1.1
    energy = 9.81 * 1.1 + 0.5 * 5.0**2
    out = []
    for _ in range(4):

        def f(y):
            return apex_map(y, np.sqrt(2 * (energy - 9.81 * y)), angle)[0][2] - y

        e = 1e-3
        d = (f(y + e) - f(y - e)) / (2 * e)
        y = y - f(y) / (d if abs(d) > 1e-3 else -1)
        y = min(max(y, 0.95), 1.4)
        out.append([y, d])
    out.append(apex_map(1.1, 5.0, angle, 3))
    return out


for _ in range(2):
    program()
