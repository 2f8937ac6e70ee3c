"""An unscented and an extended Kalman filter by hand on a pendulum, discrete-time updates in Python."""

import numpy as np
from pydrake.common import RandomDistribution
from pydrake.examples import PendulumParams, PendulumPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import BasicVector, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput, RandomSource


class UKF(LeafSystem):
    def __init__(self, h=0.02):
        LeafSystem.__init__(self)
        self.h = h
        self.DeclareVectorInputPort("y", BasicVector(1))
        self.DeclareVectorInputPort("u", 1)
        self.x = self.DeclareDiscreteState(np.array([0.8, 0.0]))
        self.P = self.DeclareDiscreteState(np.eye(2).ravel() * 0.1)
        self.DeclarePeriodicDiscreteUpdateEvent(h, 0.0, self.update)
        self.DeclareStateOutputPort("xhat", self.x)
        self.DeclareVectorOutputPort("trace", 1, self.trace, {self.discrete_state_ticket(self.P)})

    def trace(self, context, out):
        out[0] = context.get_discrete_state(self.P).value().reshape(2, 2).trace()

    def f(self, x, u):
        p = PendulumParams()
        for _ in range(2):
            a = (u - p.damping() * x[1] - p.mass() * p.gravity() * p.length() * np.sin(x[0])) / (
                p.mass() * p.length() ** 2
            )
            x = x + 0.5 * self.h * np.array([x[1], a])
        return x

    def update(self, context, discrete):
        x = context.get_discrete_state(self.x).get_value()
        P = context.get_discrete_state(self.P).get_value().reshape(2, 2)
        y = self.get_input_port(0).Eval(context)[0]
        u = self.EvalVectorInput(context, 1).get_value()[0]
        n, kappa = 2, 1.0
        S = np.linalg.cholesky((n + kappa) * P)
        sigma = np.array([x] + [x + S[:, i] for i in range(n)] + [x - S[:, i] for i in range(n)])
        w = np.r_[kappa / (n + kappa), np.full(2 * n, 0.5 / (n + kappa))]
        pred = np.array([self.f(s, u) for s in sigma])
        m = w @ pred
        C = (pred - m).T @ np.diag(w) @ (pred - m) + np.diag([1e-5, 1e-3])
        ys = np.sin(pred[:, 0])
        ym = w @ ys
        Pyy = w @ (ys - ym) ** 2 + 1e-2
        Pxy = (pred - m).T @ (w * (ys - ym))
        K = Pxy / Pyy
        discrete.get_mutable_vector(self.x).SetFromVector(m + K * (y - ym))
        discrete.set_value(int(self.P), (C - np.outer(K, K) * Pyy).ravel())


class Sensor(LeafSystem):
    def __init__(self):
        super().__init__()
        self.DeclareVectorInputPort("x", BasicVector(2))
        self.DeclareVectorInputPort("w", BasicVector(1))
        self.DeclareVectorOutputPort("y", BasicVector(1), self.out)

    def out(self, context, output):
        output.SetAtIndex(
            0, np.sin(self.get_input_port(0).Eval(context)[0]) + 0.1 * self.get_input_port(1).Eval(context)[0]
        )


def program():
    b = DiagramBuilder()
    plant = b.AddSystem(PendulumPlant())
    torque = b.AddSystem(ConstantVectorSource([0.2]))
    noise = b.AddSystem(RandomSource(RandomDistribution.kGaussian, 1, 0.02))
    sensor = b.AddSystem(Sensor())
    ukf = b.AddSystem(UKF())
    b.Connect(torque.get_output_port(), plant.get_input_port())
    b.Connect(torque.get_output_port(), ukf.get_input_port(1))
    b.Connect(plant.get_state_output_port(), sensor.get_input_port(0))
    b.Connect(noise.get_output_port(0), sensor.GetInputPort("w"))
    b.Connect(sensor.get_output_port(), ukf.GetInputPort("y"))
    logs = [
        LogVectorOutput(p, b, 0.05)
        for p in (plant.get_state_output_port(), ukf.GetOutputPort("xhat"), ukf.GetOutputPort("trace"))
    ]
    diagram = b.Build()
    s = Simulator(diagram)
    c = s.get_mutable_context()
    plant.GetMyMutableContextFromRoot(c).SetContinuousState([1.0, 0.3])
    noise.GetMyMutableContextFromRoot(c)
    s.AdvanceTo(5.0)
    return [l.FindLog(c).data() for l in logs][2]  # the noise differs by library: only the trace's size


for _ in range(3):
    program()
