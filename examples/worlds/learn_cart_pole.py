"""A cart learns to swing up its pole: 256 small networks at a time drive as many carts, and the best are mixed.

Run it: python examples/worlds/learn_cart_pole.py      (half a minute; needs gymnasium)

The cross-entropy method (Rubinstein 1999): weights are drawn from a normal distribution, which is fitted to the eighth
of them that got the most reward, over and over.
"""

import gymnasium
import numpy as np

import sheldrake.gym  # noqa: F401 (registers the task)

HIDDEN = 12
WEIGHTS = 7 * HIDDEN


def actions(weights, x):
    """Each network's action in its own world, shape (n, 1); x = (cart [m], pole [rad], and their rates)."""
    seen = np.stack([x[:, 0], np.sin(x[:, 1]), np.cos(x[:, 1]), 0.3 * x[:, 2], 0.15 * x[:, 3], np.ones(len(x))], axis=1)
    hidden = np.tanh(np.einsum("ni,nij->nj", seen, weights[:, : 6 * HIDDEN].reshape(-1, 6, HIDDEN)))
    return np.tanh(np.sum(hidden * weights[:, 6 * HIDDEN :], axis=1, keepdims=True))


def returns(env, weights, seeds):
    """Sums of rewards of one episode in each world, which begins as its seed says."""
    x, _ = env.reset(seed=list(seeds))
    total, going = np.zeros(env.num_envs), np.ones(env.num_envs, bool)
    while going.any():
        x, rewards, ended, truncated, _ = env.step(actions(weights, x))
        total += np.where(going, rewards, 0.0)
        going &= ~(ended | truncated)
    return total


def learn(env, generations, rng):
    """Mean weights of the best networks of the last generation."""
    mean, spread = np.zeros(WEIGHTS), np.full(WEIGHTS, 1.5)
    for generation in range(generations):
        weights = mean + spread * rng.normal(size=(env.num_envs, WEIGHTS))
        best = np.argsort(-returns(env, weights, [generation] * env.num_envs))[: env.num_envs // 8]
        mean, spread = weights[best].mean(axis=0), 0.9 * weights[best].std(axis=0) + 0.02
    return mean


def main(generations=40, seed=0):
    env = gymnasium.make_vec("sheldrake/CartPoleSwingUp-v0", num_envs=256)
    weights = np.tile(learn(env, generations, np.random.default_rng(seed)), (256, 1))
    worst = returns(env, weights, range(10_000, 10_256)).min()  # from beginnings that it has not seen
    print(f"after {generations} generations an episode returns {worst:.1f} or more; one in which the pole hangs, 0")
    return worst


if __name__ == "__main__":
    main()
