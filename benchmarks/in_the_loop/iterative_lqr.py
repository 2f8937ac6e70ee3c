"""Iterative LQR of a cart and pole: derivatives of its step by AutoDiff, rollouts by asking for the next state."""

import _robots as robots
import numpy as np
from pydrake.all import ExtractGradient, ExtractValue, InitializeAutoDiff, MultibodyPlant, Parser

STEP, HORIZON = 0.02, 40
GOAL = np.array([0.3, 0.0, 0.0, 0.0])
Q, R = np.diag([1.0, 1.0, 0.1, 0.1]), 0.01 * np.eye(1)
Q_END = 100.0 * Q


class Model:
    """The next state of the cart and pole, and its derivatives by state and input."""

    def __init__(self):
        self.plant = MultibodyPlant(STEP)
        Parser(self.plant).AddModelsFromString(robots.cart_pole(), "urdf")
        self.plant.SetUseSampledOutputPorts(False)
        self.plant.Finalize()
        self.context = self.plant.CreateDefaultContext()
        self.duals = self.plant.ToAutoDiffXd()
        self.context_of_duals = self.duals.CreateDefaultContext()

    def step(self, x, u):
        self.context.SetDiscreteState(x)
        self.plant.get_actuation_input_port().FixValue(self.context, u)
        return self.plant.EvalUniquePeriodicDiscreteUpdate(self.context).get_vector(0).value().copy()

    def linearized(self, x, u):
        z = InitializeAutoDiff(np.hstack([x, u])).ravel()
        self.context_of_duals.get_mutable_discrete_state_vector().SetFromVector(z[:4])
        self.duals.get_actuation_input_port().FixValue(self.context_of_duals, z[4:])
        following = self.duals.EvalUniquePeriodicDiscreteUpdate(self.context_of_duals).get_vector()
        slopes = ExtractGradient(following.CopyToVector())
        assert np.allclose(ExtractValue(following.CopyToVector()).ravel(), self.step(x, u))
        return slopes[:, :4], slopes[:, 4:]


def cost(states, inputs):
    along = sum((x - GOAL) @ Q @ (x - GOAL) for x in states[:-1]) + sum(u @ R @ u for u in inputs)
    return along + (states[-1] - GOAL) @ Q_END @ (states[-1] - GOAL)


def gains(model, states, inputs):
    """Feedback and feedforward of each step, by the recursion of Riccati with the slopes of the cost."""
    slope, curvature = 2.0 * Q_END @ (states[-1] - GOAL), 2.0 * Q_END
    found = []
    for x, u in zip(states[-2::-1], inputs[::-1]):
        A, B = model.linearized(x, u)
        by_x, by_u = 2.0 * Q @ (x - GOAL) + A.T @ slope, 2.0 * R @ u + B.T @ slope
        by_xx, by_uu, by_ux = 2.0 * Q + A.T @ curvature @ A, 2.0 * R + B.T @ curvature @ B, B.T @ curvature @ A
        K, k = -np.linalg.solve(by_uu, by_ux), -np.linalg.solve(by_uu, by_u)
        slope = by_x + K.T @ by_uu @ k + K.T @ by_u + by_ux.T @ k
        curvature = by_xx + K.T @ by_uu @ K + K.T @ by_ux + by_ux.T @ K
        found.append((K, k))
    return found[::-1]


def rollout(model, states, inputs, feedback, scale):
    x, new_states, new_inputs = states[0], [states[0]], []
    for old, u, (K, k) in zip(states, inputs, feedback):
        new_inputs.append(u + scale * k + K @ (x - old))
        x = model.step(x, new_inputs[-1])
        new_states.append(x)
    return new_states, new_inputs


def program():
    model = Model()
    inputs = [np.zeros(1)] * HORIZON
    states = [np.zeros(4)]
    for u in inputs:
        states.append(model.step(states[-1], u))
    costs = [cost(states, inputs)]
    for _ in range(6):
        feedback = gains(model, states, inputs)
        for scale in (1.0, 0.5, 0.25):
            tried = rollout(model, states, inputs, feedback, scale)
            if cost(*tried) < costs[-1]:
                states, inputs = tried
                costs.append(cost(states, inputs))
                break
    return costs, np.array(states)


for _ in range(3):
    program()
