"""DrakeGymEnv of a cart-pole with reward and termination systems, random actions, resets."""

import _robots as robots
import gymnasium as gym
import numpy as np
from pydrake.all import (
    AddMultibodyPlantSceneGraph,
    DiagramBuilder,
    EventStatus,
    LeafSystem,
    MatrixGain,
    Parser,
    PassThrough,
    Simulator,
)
from pydrake.gym import DrakeGymEnv


class Reward(LeafSystem):
    def __init__(self):
        super().__init__()
        self.DeclareVectorInputPort("x", 4)
        self.DeclareVectorOutputPort("r", 1, self.calc)

    def calc(self, c, o):
        x = self.get_input_port(0).Eval(c)
        o[0] = 1 - 0.1 * x @ x


def make():
    b = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(b, 0.005)
    Parser(plant).AddModelsFromString(robots.cart_pole(), "urdf")
    plant.Finalize()
    plant.set_name("plant")
    u = b.AddSystem(PassThrough(1))

    B = b.AddSystem(MatrixGain(np.ones((1, 1))))
    b.Connect(u.get_output_port(), B.get_input_port())
    b.Connect(B.get_output_port(), plant.get_actuation_input_port())
    r = b.AddSystem(Reward())
    b.Connect(plant.get_state_output_port(), r.get_input_port())
    b.ExportInput(u.get_input_port(), "actions")
    b.ExportOutput(plant.get_state_output_port(), "observations")
    b.ExportOutput(r.get_output_port(), "reward")
    d = b.Build()
    s = Simulator(d)

    def monitor(root):
        x = plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(root))
        if root.get_time() > 2.0:
            return EventStatus.ReachedTermination(d, "time")
        if abs(x[1]) > 0.6:
            return EventStatus.ReachedTermination(d, "fell")
        return EventStatus.Succeeded()

    s.set_monitor(monitor)
    return s, plant, d


def program():
    s, plant, _ = make()

    def reset(simulator, diagram, seed):
        rng = np.random.default_rng(seed)
        plant.SetPositionsAndVelocities(
            plant.GetMyMutableContextFromRoot(simulator.get_mutable_context()), rng.uniform(-0.1, 0.1, 4)
        )

    env = DrakeGymEnv(
        simulator=s,
        time_step=0.02,
        action_space=gym.spaces.Box(-20.0, 20.0, (1,), np.float64),
        observation_space=gym.spaces.Box(-np.inf, np.inf, (4,), np.float64),
        reward="reward",
        action_port_id="actions",
        observation_port_id="observations",
        reset_handler=reset,
    )
    out = []
    for seed in range(4):
        obs, _ = env.reset(seed=seed)
        rng = np.random.default_rng(seed)
        total, steps, term, trunc = 0.0, 0, False, False
        for _ in range(120):
            obs, r, term, trunc, _ = env.step(rng.uniform(-20, 20, 1))
            total, steps = total + r, steps + 1
            if term or trunc:
                break
        out.append([*obs, total, steps, term, trunc])
    return out


for _ in range(3):
    program()
