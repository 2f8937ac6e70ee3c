"""Observers of linear systems, continuous and sampled, and of a pendulum."""

import numpy as np
from pydrake.examples import PendulumPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.estimators import LuenbergerObserver, SteadyStateKalmanFilter
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LinearSystem, LogVectorOutput, Sine, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial


def program():
    out = []
    for h in (0.0, 0.02):
        A = np.array([[0, 1.0], [-1, -0.1]])
        B = np.array([[0], [1.0]])
        C = np.array([[1.0, 0]])
        if h:
            A, B = np.eye(2) + h * A, h * B
        b = DiagramBuilder()
        sys = LinearSystem(A, B, C, np.zeros((1, 1)), h)
        p = b.AddSystem(sys)
        k = (
            b.AddSystem(
                SteadyStateKalmanFilter(
                    LinearSystem(A, B, C, np.zeros((1, 1)), h), np.diag([0.1, 0.1]), np.array([[0.01]])
                )
            )
            if not h
            else None
        )
        u = b.AddSystem(TrajectorySource(PiecewisePolynomial.FirstOrderHold([0, 1, 2, 3], np.array([[0, 1, -1, 0.0]]))))
        if k is None:
            from pydrake.systems.estimators import DiscreteTimeSteadyStateKalmanFilter

            L = DiscreteTimeSteadyStateKalmanFilter(A, C, np.diag([0.1, 0.1]), np.array([[0.01]]))
            LL = L if isinstance(L, np.ndarray) else L[0] if isinstance(L, tuple) else L
            obs = LinearSystem(A, B, C, np.zeros((1, 1)), h)
            k = b.AddSystem(LuenbergerObserver(obs, obs.CreateDefaultContext(), LL))
        b.Connect(u.get_output_port(), p.get_input_port())
        b.Connect(p.get_output_port(), k.get_observed_system_output_input_port())
        b.Connect(u.get_output_port(), k.get_observed_system_input_input_port())
        log = LogVectorOutput(k.get_estimated_state_output_port(), b, 0.1)
        s = Simulator(b.Build())
        c = s.get_mutable_context()
        pc = p.GetMyMutableContextFromRoot(c)
        (pc.SetDiscreteState if h else pc.SetContinuousState)([1.0, -0.5])
        if not h:
            s.get_mutable_integrator().set_target_accuracy(1e-8)
        s.AdvanceTo(3.0)
        out.append(log.FindLog(c).data())
        out.append(k.L())
    pend = PendulumPlant()
    c = pend.CreateDefaultContext()
    pend.get_input_port().FixValue(c, [0.0])
    c.SetContinuousState([0.1, 0])
    b = DiagramBuilder()
    p = b.AddSystem(PendulumPlant())
    o = b.AddSystem(LuenbergerObserver(pend, c, 5 * np.eye(2)))
    u = b.AddSystem(Sine(0.3, 2.0, 0.0, 1))
    b.Connect(u.get_output_port(0), p.get_input_port())
    b.Connect(u.get_output_port(0), o.get_observed_system_input_input_port())
    b.Connect(p.get_output_port(), o.get_observed_system_output_input_port())
    log = LogVectorOutput(o.get_estimated_state_output_port(), b, 0.1)
    s = Simulator(b.Build())
    root = s.get_mutable_context()
    p.GetMyMutableContextFromRoot(root).SetContinuousState([1.0, 0.2])
    s.get_mutable_integrator().set_target_accuracy(1e-8)
    s.AdvanceTo(2.0)
    out.append(log.FindLog(root).data())
    return out


for _ in range(3):
    program()
