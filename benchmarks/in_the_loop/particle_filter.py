"""A particle filter of a cart and pole: a context for each particle, clones when they are drawn anew."""

import _robots as robots
import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant


def program():
    plant = MultibodyPlant(time_step=0.01)
    Parser(plant).AddModelsFromString(robots.cart_pole(), "urdf")
    plant.SetUseSampledOutputPorts(False)
    plant.Finalize()
    rng = np.random.default_rng(0)
    truth = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(truth, [0.0, 0.9, 0.2, 0.0])
    n = 100
    particles = []
    for _ in range(n):
        c = truth.Clone()
        plant.SetPositionsAndVelocities(c, [0.0, 0.9, 0.2, 0.0] + 0.3 * rng.normal(size=4))
        particles.append(c)
    out = []
    for k in range(30):
        for c in [truth, *particles]:
            x = plant.EvalUniquePeriodicDiscreteUpdate(c)
            noise = rng.normal(size=4) * [0, 0, 0.01, 0.01] if c is not truth else 0
            plant.SetPositionsAndVelocities(c, x.value() + noise)
            c.SetTime(c.get_time() + 0.01)
        if k % 3 == 2:
            y = plant.CalcPointsPositions(truth, plant.GetFrameByName("pole"), [0, 0, -0.5], plant.world_frame())[
                [0, 2], 0
            ] + 0.02 * rng.normal(size=2)
            w = np.empty(n)
            for i, c in enumerate(particles):
                yi = plant.CalcPointsPositions(c, plant.GetFrameByName("pole"), [0, 0, -0.5], plant.world_frame())[
                    [0, 2], 0
                ]
                w[i] = np.exp(-np.sum((y - yi) ** 2) / (2 * 0.05**2))
            w /= w.sum()
            pick = np.searchsorted(np.cumsum(w), (np.arange(n) + rng.uniform()) / n)
            particles = [particles[min(j, n - 1)].Clone() for j in pick]
            out.append(np.mean([plant.GetPositionsAndVelocities(c) for c in particles], axis=0))
    return out, plant.GetPositionsAndVelocities(truth)


for _ in range(3):
    program()
