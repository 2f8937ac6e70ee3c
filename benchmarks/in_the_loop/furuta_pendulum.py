"""A Furuta pendulum as a template of systems: linearized, symbolic, observed; balanced through a sample and hold."""

import numpy as np
import pydrake.math as m
from pydrake.symbolic import Expression
from pydrake.systems.analysis import Simulator
from pydrake.systems.controllers import DiscreteTimeLinearQuadraticRegulator, LinearQuadraticRegulator
from pydrake.systems.estimators import DiscreteTimeSteadyStateKalmanFilter, SteadyStateKalmanFilter
from pydrake.systems.framework import DiagramBuilder, LeafSystem_
from pydrake.systems.primitives import (
    AffineSystem,
    ControllabilityMatrix,
    FirstOrderTaylorApproximation,
    IsControllable,
    Linearize,
    LogVectorOutput,
    Saturation,
    ZeroOrderHold,
)
from pydrake.systems.scalar_conversion import TemplateSystem


@TemplateSystem.define("Furuta_")
def Furuta_(T):
    class Impl(LeafSystem_[T]):
        def _construct(self, l=0.3, damping=0.01, converter=None):
            LeafSystem_[T].__init__(self, converter=converter)
            self.l, self.b = l, damping
            self.DeclareContinuousState(2, 2, 0)
            self.DeclareVectorInputPort("u", 1)
            self.DeclareVectorOutputPort(
                "y", 4, lambda c, o: o.SetFromVector(c.get_continuous_state_vector().CopyToVector())
            )

        def _construct_copy(self, other, converter=None):
            Impl._construct(self, other.l, other.b, converter=converter)

        def DoCalcTimeDerivatives(self, context, derivatives):
            x = context.get_continuous_state_vector().CopyToVector()
            u = self.EvalVectorInput(context, 0)[0]
            q, v = x[:2], x[2:]
            c, s = m.cos(q[1]), m.sin(q[1])
            r, l, mm, J, g = 0.2, self.l, 0.1, 0.01, 9.81
            M11 = J + mm * r * r + mm * l * l * s * s
            M12 = mm * r * l * c
            M22 = mm * l * l
            f1 = u - self.b * v[0] - 2 * mm * l * l * s * c * v[0] * v[1] + mm * r * l * s * v[1] * v[1]
            f2 = mm * g * l * s - self.b * v[1] + mm * l * l * s * c * v[0] * v[0]
            det = M11 * M22 - M12 * M12
            a = np.array([(M22 * f1 - M12 * f2) / det, (M11 * f2 - M12 * f1) / det])
            derivatives.get_mutable_vector().SetFromVector(np.concatenate([v, a]))

    return Impl


Furuta = Furuta_[None]


def program():
    out = []
    plant = Furuta(l=0.25)
    c = plant.CreateDefaultContext()
    plant.get_input_port(0).FixValue(c, [0.0])
    lin = Linearize(plant, c)
    out += [lin.A(), lin.B(), IsControllable(lin), ControllabilityMatrix(lin)]
    K, _ = LinearQuadraticRegulator(lin.A(), lin.B(), np.diag([1, 10, 0.1, 0.1]), np.eye(1))
    out.append(K)
    c.SetContinuousState([0.1, 0.5, 0.2, 0.1])
    plant.get_input_port(0).FixValue(c, [0.02])
    aff = FirstOrderTaylorApproximation(plant, c)
    out += [aff.A(), aff.f0()]
    sym = plant.ToSymbolic()
    cs = sym.CreateDefaultContext()
    sym.get_input_port(0).FixValue(cs, [Expression(0.1)])
    cs.SetContinuousState([Expression(v) for v in [0.1, 0.2, 0.3, 0.4]])
    out.append([e.Evaluate() for e in sym.EvalTimeDerivatives(cs).CopyToVector()])
    # sampled: the diagram plant + zoh via discrete approximation by hand
    from scipy.linalg import expm

    h = 0.01
    E = expm(np.block([[lin.A(), lin.B()], [np.zeros((1, 5))]]) * h)
    Ad, Bd = E[:4, :4], E[:4, 4:]
    Kd, _ = DiscreteTimeLinearQuadraticRegulator(Ad, Bd, np.diag([1, 10, 0.1, 0.1]), np.eye(1))
    out.append(Kd)
    C = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0]])
    L = SteadyStateKalmanFilter(lin.A(), C, np.eye(4) * 0.01, np.eye(2) * 0.001)
    Ld = DiscreteTimeSteadyStateKalmanFilter(Ad, C, np.eye(4) * 0.01, np.eye(2) * 0.001)
    out += [L, Ld]
    b = DiagramBuilder()
    p = b.AddSystem(Furuta(l=0.25))
    g = b.AddSystem(AffineSystem(np.zeros((0, 0)), np.zeros((0, 4)), np.zeros(0), np.zeros((1, 0)), -K, np.zeros(1)))
    z = b.AddSystem(ZeroOrderHold(0.01, 1))
    sat = b.AddSystem(Saturation([-2.0], [2.0]))
    b.Connect(p.get_output_port(0), g.get_input_port())
    b.Connect(g.get_output_port(), sat.get_input_port())
    b.Connect(sat.get_output_port(), z.get_input_port())
    b.Connect(z.get_output_port(), p.get_input_port(0))
    log = LogVectorOutput(p.get_output_port(0), b, 0.1)
    d = b.Build()
    for x in ([0, 0.2, 0, 0], [0.3, -0.1, 0, 1.0]):
        s = Simulator(d)
        s.get_mutable_integrator().set_target_accuracy(1e-6)
        p.GetMyMutableContextFromRoot(s.get_mutable_context()).SetContinuousState(x)
        s.AdvanceTo(1.5)
        out.append(log.FindLog(s.get_context()).data())
    return out


for _ in range(3):
    program()
