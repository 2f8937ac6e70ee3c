"""Vector environments as others take them: stable-baselines3, and `gymnasium.make`, which makes one at a time."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv


def StableBaselinesVecEnv(env: VectorEnv) -> Any:
    """A vector environment as stable-baselines3's VecEnv: `PPO("MlpPolicy", StableBaselinesVecEnv(env))`.

    Episodes begin anew in the step that ends them, whose last observation is in `infos[i]["terminal_observation"]`;
    `infos[i]["TimeLimit.truncated"]` tells whether it was cut short.

    Args:
        env: Made with `autoreset_mode="SameStep"`; its observations and actions are arrays.

    Raises:
        ModuleNotFoundError: stable-baselines3 is not installed.
        ValueError: the environment has another autoreset mode.
    """
    mode = env.metadata.get("autoreset_mode")
    if mode is not AutoresetMode.SAME_STEP:
        raise ValueError(
            f"StableBaselinesVecEnv(): the environment's autoreset_mode is {mode}; episodes must begin anew in the "
            "step that ends them. Make it with autoreset_mode='SameStep'."
        )
    return _adapter()(env)


@functools.cache
def _adapter() -> Any:
    """The class; made when somebody asks, because its base is not always there."""
    try:
        from stable_baselines3.common.vec_env import VecEnv
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            "StableBaselinesVecEnv() needs stable-baselines3: pip install stable-baselines3.", name=error.name
        ) from error

    class Adapter(_Steps, VecEnv):
        def __init__(self, env: VectorEnv):
            self.env = env
            VecEnv.__init__(self, env.num_envs, env.single_observation_space, env.single_action_space)

    return Adapter


class _Steps:
    """What a VecEnv does, on a vector environment `env`."""

    env: Any
    num_envs: int
    reset_infos: list[dict]
    _seeds: Any
    _options: Any

    def reset(self) -> np.ndarray:
        """Begins episodes everywhere, with the seeds given since the last time."""
        given = [None if seed is None else int(seed) for seed in self._seeds]
        observations, _ = self.env.reset(seed=None if given == [None] * self.num_envs else given)
        self.reset_infos = [{} for _ in range(self.num_envs)]
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        """Notes actions; `step_wait` takes the step."""
        self._actions = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict]]:
        """Observations, rewards, which episodes are over, information of each environment."""
        observations, rewards, ended, truncated, found = self.env.step(self._actions)
        over = ended | truncated
        infos: list[dict] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(over).tolist():
            infos[i] = {"terminal_observation": found["final_obs"][i], "TimeLimit.truncated": bool(truncated[i])}
        return observations, rewards.astype(np.float32), over, infos

    def close(self) -> None:
        """Closes the vector environment."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: int | Iterable[int] | None = None) -> list[Any]:
        """An attribute of the vector environment, once for each of these environments."""
        return [getattr(self.env, attr_name)] * len(self._numbers(indices))

    def set_attr(self, attr_name: str, value: Any, indices: int | Iterable[int] | None = None) -> None:
        """Sets an attribute of the vector environment, for all of them.

        Raises:
            ValueError: it is to be set for some of them.
        """
        if len(self._numbers(indices)) < self.num_envs:
            raise ValueError(f"set_attr({attr_name!r}): the worlds of a batch have one environment; set it for all.")
        setattr(self.env, attr_name, value)

    def env_method(
        self, method_name: str, *args: object, indices: int | Iterable[int] | None = None, **kwargs: object
    ) -> list[Any]:
        """Calls a method of the vector environment once; its answer, for each of these environments."""
        return [getattr(self.env, method_name)(*args, **kwargs)] * len(self._numbers(indices))

    def env_is_wrapped(self, wrapper_class: type, indices: int | Iterable[int] | None = None) -> list[bool]:
        """Whether each of these environments is inside of a wrapper: none is."""
        return [False] * len(self._numbers(indices))

    def _numbers(self, indices: int | Iterable[int] | None) -> Sequence[int]:
        if indices is None:
            return range(self.num_envs)
        return [indices] if isinstance(indices, int) else list(indices)

    def _reset_seeds(self) -> None:
        self._seeds = [None] * self.num_envs

    def _reset_options(self) -> None:
        self._options = [{} for _ in range(self.num_envs)]


class OneEnv(gymnasium.Env):
    """A vector environment of one world as an ordinary one, for `gymnasium.make`.

    Args:
        task: Makes a vector environment: `task(1, **options)`.
        options: Of it; `render_mode` must be None.

    Raises:
        ValueError: a render mode is given.
    """

    metadata = {"render_modes": []}

    def __init__(self, task: Any, render_mode: Any = None, **options: object):
        if render_mode is not None:
            raise ValueError(f"This task draws nothing: render_mode must be None, not {render_mode!r}.")
        self._env = task(1, **{**options, "autoreset_mode": AutoresetMode.DISABLED})
        self.action_space = self._env.single_action_space
        self.observation_space = self._env.single_observation_space
        self.batch = self._env.batch

    def reset(self, *, seed: int | None = None, options: dict | None = None) -> tuple[np.ndarray, dict]:
        """Begins an episode; see `DrakeVectorEnv.reset`."""
        super().reset(seed=seed)
        observations, infos = self._env.reset(seed=seed, options=options)
        return observations[0], infos

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict]:
        """Takes a step; see `DrakeVectorEnv.step`."""
        observations, rewards, ended, truncated, infos = self._env.step(np.asarray(action)[None])
        return observations[0], float(rewards[0]), bool(ended[0]), bool(truncated[0]), infos
