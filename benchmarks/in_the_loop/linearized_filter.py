"""EKF by AutoDiff of a plant's step and of an own LeafSystem template."""

import _robots as robots
import numpy as np
from pydrake.all import (
    ExtractGradient,
    ExtractValue,
    FirstOrderTaylorApproximation,
    InitializeAutoDiff,
    LeafSystem_,
    Linearize,
    LinearQuadraticRegulator,
    MultibodyPlant,
    Parser,
    TemplateSystem,
)


@TemplateSystem.define("Pend_")
def Pend_(T):
    class Impl(LeafSystem_[T]):
        def _construct(self, converter=None):
            LeafSystem_[T].__init__(self, converter)
            self.DeclareVectorInputPort("u", 1)
            self.DeclareContinuousState(1, 1, 0)
            self.DeclareVectorOutputPort("y", 2, self.out)

        def _construct_copy(self, other, converter=None):
            Impl._construct(self, converter=converter)

        def DoCalcTimeDerivatives(self, context, derivatives):
            x = context.get_continuous_state_vector().CopyToVector()
            u = self.get_input_port(0).Eval(context)
            derivatives.get_mutable_vector().SetFromVector([x[1], u[0] - 9.81 * np.sin(x[0]) - 0.1 * x[1]])

        def out(self, context, output):
            output.SetFromVector(context.get_continuous_state_vector().CopyToVector())

    return Impl


Pend = Pend_[None]
plant = MultibodyPlant(0.0)
Parser(plant).AddModelsFromString(robots.cart_pole(), "urdf")
plant.Finalize()


def program():
    # plants
    ad = plant.ToAutoDiffXd()
    ac = ad.CreateDefaultContext()
    n = plant.num_multibody_states()
    nu = plant.num_actuators()
    x = np.array([0.1, 0.2, 0, 0])
    P = np.eye(n)
    Q = 0.01 * np.eye(n)
    h = 0.01
    for _ in range(100):
        z = np.hstack([x, np.zeros(nu)])
        zz = InitializeAutoDiff(z).ravel()
        ac.SetContinuousState(zz[:n])
        ad.get_actuation_input_port().FixValue(ac, zz[n:])
        xdot = ad.EvalTimeDerivatives(ac).CopyToVector()
        A = ExtractGradient(xdot)[:, :n]
        x = x + h * ExtractValue(xdot).ravel()
        F = np.eye(n) + h * A
        P = F @ P @ F.T + Q
    A = np.eye(2)
    p = Pend()
    pa = p.ToAutoDiffXd()
    pc = pa.CreateDefaultContext()
    y = np.array([0.3, 0.0])
    for _ in range(100):
        zz = InitializeAutoDiff(np.hstack([y, [0.0]])).ravel()
        pc.SetContinuousState(zz[:2])
        pa.get_input_port(0).FixValue(pc, zz[2:])
        xdot = pa.EvalTimeDerivatives(pc).CopyToVector()
        A = ExtractGradient(xdot)
        y = y + h * ExtractValue(xdot).ravel()
    c = p.CreateDefaultContext()
    p.get_input_port(0).FixValue(c, [0.0])
    for k in range(10):
        c.SetContinuousState([np.pi + 0.1 * k * 0, 0])
        lin = FirstOrderTaylorApproximation(p, c)
        _K, _S = LinearQuadraticRegulator(lin.A(), lin.B(), np.eye(2), np.eye(1))
    pcx = plant.CreateDefaultContext()
    plant.get_actuation_input_port().FixValue(pcx, [0.0])
    pcx.SetContinuousState([0, np.pi, 0, 0])
    for _ in range(10):
        lin = Linearize(
            plant,
            pcx,
            plant.get_actuation_input_port().get_index(),
            plant.get_state_output_port().get_index(),
            equilibrium_check_tolerance=1e3,
        )
    return A, y, x


for _ in range(3):
    program()
