"""A quadruped walks without having learnt how: each 20 ms it tries 48 ways to move its legs, and mixes the best.

Run it: python examples/worlds/quadruped_mppi.py

Model predictive path integral control (Williams et al. 2017): weights of the samples are exp(-cost / temperature).
"""

import pathlib
import sys

import numpy as np

from sheldrake.all import AddMultibodyPlantSceneGraph, BatchSimulator, DiagramBuilder

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1]))
from quadruped import HEIGHT, STANCE, add_scene

ROLLOUTS, SAMPLES, KNOTS, PERIOD = 48, 15, 4, 0.02
GOAL = 0.3
"""Where the trunk is to be: so far ahead [m]."""


def robot():
    """The quadruped whose input is the desired state of its joints, and whose output is its state."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
    quadruped = add_scene(plant)
    plant.Finalize()
    builder.ExportInput(plant.get_desired_state_input_port(quadruped), "wanted")
    builder.ExportOutput(plant.get_state_output_port(), "state")
    return builder.Build()


def wanted(offsets):
    """Desired states of the joints, at rest, from offsets of their angles [rad]."""
    return np.concatenate([STANCE + offsets, np.zeros(offsets.shape)], axis=-1)


def costs(x, offsets):
    """Of each rollout: to be far from the goal, off the line, tilted, too low, and to move the legs much."""
    tilt = 2.0 * (x[..., 1] ** 2 + x[..., 2] ** 2)
    place = 4.0 * np.abs(x[..., 4] - GOAL) + 4.0 * np.abs(x[..., 5]) + 20.0 * (x[..., 6] - HEIGHT) ** 2
    effort = 0.02 * (offsets**2).sum(axis=-1) + 0.01 * (x[..., 22:25] ** 2).sum(axis=-1)
    each = place + 10.0 * tilt + effort
    return each.sum(axis=1) + SAMPLES * each[:, -1]


def main(seconds=0.8, seed=0):
    diagram, rng = robot(), np.random.default_rng(seed)
    tried, real = BatchSimulator(diagram, ROLLOUTS), BatchSimulator(diagram, 1)
    x, plan = np.zeros(37), np.zeros((SAMPLES, 12))
    x[0], x[6], x[7:19] = 1.0, HEIGHT, STANCE
    knots, places = np.linspace(0, SAMPLES - 1, KNOTS), np.arange(SAMPLES)
    smooth = np.transpose([np.interp(places, knots, hat) for hat in np.eye(KNOTS)])
    for _ in range(round(seconds / PERIOD)):
        noise = rng.normal(0.0, 0.2, (ROLLOUTS, KNOTS, 12))
        noise[0] = 0.0
        offsets = plan + smooth @ noise
        cost = costs(tried.Rollout(x, wanted(offsets), time_step=PERIOD), offsets)
        weights = np.exp(-(cost - cost.min()) / (0.1 * cost.std()))
        plan = np.tensordot(weights / weights.sum(), offsets, axes=1)
        x = real.Rollout(x, wanted(plan[:1]), time_step=PERIOD)[0, 0].copy()
        plan = np.concatenate([plan[1:], 0.9 * plan[-1:]])
    upright = 1.0 - 2.0 * (x[1] ** 2 + x[2] ** 2)
    print(f"after {seconds} s the trunk is {x[4]:.3f} m ahead and {x[5]:.3f} m aside, cos(tilt) = {upright:.3f}")
    return x[4], upright


if __name__ == "__main__":
    main()
