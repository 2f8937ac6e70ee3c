"""PPO of stable-baselines3 learns to swing up a pole on a cart; a page shows what it has learnt.

Run it: python examples/worlds/learn_with_stable_baselines.py      (a minute; pip install 'sheldrake[rl]')

The simulations of 64 carts are one vector environment. Of the page learnt_swing_up.html is left, which opens without a
network.
"""

import pathlib
import time

import gymnasium
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

import sheldrake.gym
from sheldrake.all import Box, Capsule, Meshcat, Rgba, RigidTransform, RotationMatrix

TASK = "sheldrake/CartPoleSwingUp-v0"
PERIOD = 0.02  # of the task's actions [s]
POLE = 0.6  # [m]


class Seen(BaseFeaturesExtractor):
    """What the networks see of (cart [m], pole [rad], and their rates): an angle as a point of the circle."""

    def __init__(self, space):
        super().__init__(space, features_dim=5)

    def forward(self, x):
        return torch.stack([x[:, 0], x[:, 1].sin(), x[:, 1].cos(), 0.3 * x[:, 2], 0.15 * x[:, 3]], dim=1)


def learn(steps, seed):
    """A policy that has taken so many steps, of 64 carts together."""
    torch.set_num_threads(1)  # these networks are too small to share among threads
    envs = gymnasium.make_vec(TASK, num_envs=64, autoreset_mode="SameStep")
    networks = {"features_extractor_class": Seen, "net_arch": [64, 64], "log_std_init": -0.5}
    model = PPO(
        "MlpPolicy",
        sheldrake.gym.StableBaselinesVecEnv(envs),
        n_steps=128,
        batch_size=1024,
        n_epochs=10,
        learning_rate=1e-3,
        policy_kwargs=networks,
        seed=seed,
        device="cpu",
    )
    return model.learn(steps)


def episode(model, seed):
    """States of one episode, shape (n, 4), and the sum of its rewards."""
    env = gymnasium.make(TASK)
    x, _ = env.reset(seed=seed)
    states, total, is_over = [x], 0.0, False
    while not is_over:
        x, reward, ended, truncated, _ = env.step(model.predict(x, deterministic=True)[0])
        states.append(x)
        total, is_over = total + reward, ended or truncated
    return states, total


def replay(states):
    """A page that shows the motion, as text."""
    meshcat = Meshcat()
    meshcat.SetObject("rail", Box(5.0, 0.02, 0.02), Rgba(0.6, 0.6, 0.6))
    meshcat.SetObject("cart", Box(0.3, 0.2, 0.1), Rgba(0.2, 0.4, 0.7))
    meshcat.SetObject("cart/hinge/pole", Capsule(0.015, POLE), Rgba(1.0, 0.5, 0.2))
    meshcat.SetTransform("cart/hinge/pole", RigidTransform([0.0, -0.12, -POLE / 2]))
    meshcat.SetCameraPose([0.0, -3.5, 0.8], [0.0, 0.0, 0.0])
    meshcat.StartRecording(frames_per_second=1.0 / PERIOD)
    for i, x in enumerate(states):
        meshcat.SetTransform("cart", RigidTransform([x[0], 0.0, 0.0]), i * PERIOD)
        meshcat.SetTransform("cart/hinge", RigidTransform(RotationMatrix.MakeYRotation(x[1]), [0, 0, 0]), i * PERIOD)
    meshcat.PublishRecording()
    return meshcat.StaticHtml()


def main(steps=250_000, seed=0):
    start = time.perf_counter()
    model = learn(steps, seed)
    print(f"learnt from {model.num_timesteps} steps in {time.perf_counter() - start:.0f} s")
    tried = [episode(model, 10_000 + i) for i in range(10)]  # from beginnings that it has not seen
    worst = min(total for _, total in tried)
    print(f"an episode returns {worst:.1f} or more; one in which the pole hangs, 0")
    pathlib.Path("learnt_swing_up.html").write_text(replay(tried[0][0]), encoding="utf-8")
    print("open learnt_swing_up.html to see one")
    return worst


if __name__ == "__main__":
    main()
