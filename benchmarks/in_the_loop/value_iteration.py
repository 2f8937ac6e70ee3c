"""Transitions of a grid by a simulator: one AdvanceTo for each state and action, as in dynamic programming."""

import _robots as robots
import numpy as np
from pydrake.all import MultibodyPlant, Parser, Simulator
from pydrake.examples import PendulumPlant


def transitions(system, port, states, actions, dt):
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    found = np.zeros((len(states), len(actions), states.shape[1]))
    for i, x in enumerate(states):
        for j, u in enumerate(actions):
            context.SetTime(0.0)
            context.SetContinuousState(x)
            port.FixValue(context, [u])
            simulator.Initialize()
            simulator.AdvanceTo(dt)
            found[i, j] = context.get_continuous_state_vector().CopyToVector()
    return found


def transitions_of_steps(plant, states, actions, dt):
    simulator = Simulator(plant)
    context = simulator.get_mutable_context()
    port = plant.get_actuation_input_port()
    found = np.zeros((len(states), len(actions), states.shape[1]))
    for i, x in enumerate(states):
        for j, u in enumerate(actions):
            context.SetTime(0.0)
            plant.SetPositionsAndVelocities(context, x)
            port.FixValue(context, [u])
            simulator.Initialize()
            simulator.AdvanceTo(dt)
            found[i, j] = plant.GetPositionsAndVelocities(context)
    return found


def program():
    angles, rates = np.linspace(0, 2 * np.pi, 15), np.linspace(-8, 8, 15)
    states = np.array([(a, r) for a in angles for r in rates])
    pendulum = PendulumPlant()
    transitions(pendulum, pendulum.get_input_port(), states, [-1.0, 0.0, 1.0], 0.025)
    for time_step in (0.0, 0.005):
        plant = MultibodyPlant(time_step)
        Parser(plant).AddModelsFromString(robots.cart_pole(), "urdf")
        plant.Finalize()
        four = np.array([(0.0, a, 0.1, r) for a, r in states[::2]])
        if time_step:
            transitions_of_steps(plant, four, [-5.0, 5.0], 0.025)
        else:
            transitions(plant, plant.get_actuation_input_port(), four, [-5.0, 5.0], 0.025)


for _ in range(3):
    program()
