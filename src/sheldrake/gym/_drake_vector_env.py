"""`DrakeVectorEnv`: many worlds of one diagram behind the interface of Gymnasium's vector environments."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from sheldrake.gym._drake_gym_env import _all_vectors, _input_port, _output_port
from sheldrake.gym._streams import Streams
from sheldrake.systems.analysis import BatchSimulator
from sheldrake.systems.framework import InputPort, OutputPort, System

if TYPE_CHECKING:
    from sheldrake.systems.framework._context.context import Context


class DrakeVectorEnv(VectorEnv):
    """Environments that are the worlds of a BatchSimulator.

    An action is the value of an input port, kept for some periods of the system's only clock; an observation is the
    value of an output port. Rewards, ends and new beginnings are computed for all environments at once, from the
    batch's arrays. An episode is truncated after `max_episode_steps`, and when its world fails: the batch's `failures`
    say why, and the observation is that of the last good state.

    Args:
        system: The system; usually a Diagram.
        num_envs: How many environments.
        reward: `reward(batch, actions)` gives the rewards after a step, shape (num_envs,).
        reset_state: `reset_state(batch, worlds, streams)` writes the states (and parameters) with which these worlds
            (numbers) begin an episode; they are as at first when it is called. Streams have each world's own random
            numbers.
        terminated: `terminated(batch)` tells in which environments the episode has ended, shape (num_envs,); in none if
            not given.
        steps_per_action: Periods of the system's clock in a step.
        max_episode_steps: Episodes are truncated after as many steps; None: never.
        action_space: Of one environment; None for any vector of the action port's size.
        observation_space: Likewise for the observation port.
        action_port_id: An input port of the system: the port, its index or name; None for the first.
        observation_port_id: An output port: its index or name; None for the first.
        autoreset_mode: What happens when an episode is over, see `gymnasium.vector.AutoresetMode`. With DISABLED,
            `reset(options={"reset_mask": mask})` begins new ones.
        context: What worlds are like at first, see BatchSimulator.
        num_threads: How many threads, see BatchSimulator.

    Attributes:
        batch: The BatchSimulator.

    Raises:
        ValueError: a number is not positive.
        gymnasium.error.Error: the system lacks a port.
    """

    def __init__(
        self,
        system: System,
        num_envs: int,
        *,
        reward: Callable[[BatchSimulator, np.ndarray], np.ndarray],
        reset_state: Callable[[BatchSimulator, np.ndarray, Streams], None],
        terminated: Callable[[BatchSimulator], np.ndarray] | None = None,
        steps_per_action: int = 1,
        max_episode_steps: int | None = None,
        action_space: gymnasium.spaces.Space | None = None,
        observation_space: gymnasium.spaces.Space | None = None,
        action_port_id: InputPort | int | str | None = None,
        observation_port_id: OutputPort | int | str | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        context: Context | None = None,
        num_threads: int | None = None,
    ):
        if steps_per_action < 1 or (max_episode_steps is not None and max_episode_steps < 1):
            raise ValueError(
                f"DrakeVectorEnv(): steps_per_action ({steps_per_action}) and max_episode_steps ({max_episode_steps}) "
                "must be at least 1."
            )
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {"autoreset_mode": self.autoreset_mode, "render_modes": []}
        self.num_envs = int(num_envs)
        self.batch = BatchSimulator(system, self.num_envs, context, num_threads=num_threads, raise_failures=False)
        ports = _input_port(system, action_port_id), _output_port(system, observation_port_id)
        for name, port in zip(("action", "observation"), ports):
            if port is None:
                raise gymnasium.error.Error(f"DrakeVectorEnv: {system.get_name()} has no port for the {name}.")
        self._observed, self._inputs = ports[1], self.batch.inputs(ports[0])
        self.single_action_space = action_space or _all_vectors("action", ports[0])
        self.single_observation_space = observation_space or _all_vectors("observation", ports[1])
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self._reward, self._reset_state, self._terminated = reward, reset_state, terminated
        self._steps_per_action, self._most_steps = int(steps_per_action), max_episode_steps
        self._ages = np.zeros(self.num_envs, np.int64)
        self._over = np.ones(self.num_envs, bool)  # nobody has begun yet
        self._streams: Streams | None = None

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begins episodes.

        Args:
            seed: Of the random numbers; environment i gets seed + i, or the i-th of several, where None goes on with
                those there are. None goes on with all; at first it stands for any.
            options: "reset_mask" tells in which environments, a bool array, shape (num_envs,); in all if not given.

        Returns:
            Observations of all environments, information.

        Raises:
            ValueError: another option, or something of a wrong shape.
        """
        others = dict(options or {})
        mask = np.asarray(others.pop("reset_mask", np.ones(self.num_envs, bool)))
        if others or mask.shape != (self.num_envs,) or mask.dtype != bool or not mask.any():
            raise ValueError(
                f"DrakeVectorEnv.reset(): options may have a 'reset_mask' of {self.num_envs} bools, some of them True; "
                f"got {options!r}."
            )
        self._seed(seed, mask)
        self._begin(np.flatnonzero(mask))
        return self._observe(), {}

    def _seed(self, seed: int | Sequence[int | None] | None, mask: np.ndarray) -> None:
        if self._streams is None:
            first = int(np.random.SeedSequence().generate_state(1)[0])
            self._streams = Streams(range(first, first + self.num_envs))
        if seed is None:
            return
        seeds = [seed + i for i in range(self.num_envs)] if isinstance(seed, (int, np.integer)) else list(seed)
        if len(seeds) != self.num_envs:
            raise ValueError(f"DrakeVectorEnv.reset(): {len(seeds)} seeds for {self.num_envs} environments.")
        who = np.array([i for i in np.flatnonzero(mask).tolist() if seeds[i] is not None], np.int64)
        self._streams.seed(who, [int(seeds[i]) for i in who])  # type: ignore[arg-type]

    def _begin(self, who: np.ndarray) -> None:
        """Begins episodes in these environments."""
        if len(who):
            self.batch.Reset(who)
            assert self._streams is not None
            self._reset_state(self.batch, who, self._streams)
            self._ages[who], self._over[who] = 0, False

    def _observe(self) -> np.ndarray:
        """A copy of all observations."""
        found = self.batch.EvalOutputs(self._observed)
        return np.array(found, self.single_observation_space.dtype)

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Keeps actions for `steps_per_action` periods.

        With NEXT_STEP, environments whose episode is over begin a new one instead: their action does not count and
        their reward is 0. With SAME_STEP they have begun already in the step that ended the episode, whose last
        observation is in `infos["final_obs"]`, where the mask `infos["_final_obs"]` is True.

        Args:
            actions: Shape (num_envs, size).

        Returns:
            Observations, rewards, which episodes have ended, which were truncated, information.

        Raises:
            RuntimeError: `reset` was not called; with DISABLED, an episode is over.
        """
        mode, batch = self.autoreset_mode, self.batch
        if self._streams is None or (self._over.any() and mode is not AutoresetMode.NEXT_STEP):
            over = "reset() was not called" if self._streams is None else f"{np.flatnonzero(self._over)} are over"
            raise RuntimeError(f"DrakeVectorEnv.step(): {over}; call reset() first.")
        goes_on = ~self._over
        self._begin(np.flatnonzero(self._over))
        self._inputs[:] = actions
        batch.AdvanceSteps(self._steps_per_action, goes_on)
        self._ages += goes_on
        observations = self._observe()
        rewards = np.array(self._reward(batch, actions), np.float64)
        ended = np.zeros(self.num_envs, bool)
        if self._terminated is not None:
            ended[:] = self._terminated(batch)
        truncated = batch.failed
        rewards[~goes_on | truncated] = 0.0
        if self._most_steps is not None:
            truncated |= self._ages >= self._most_steps
        ended &= goes_on
        truncated &= goes_on & ~ended
        self._over = ended | truncated
        infos: dict[str, Any] = {}
        if mode is AutoresetMode.SAME_STEP and self._over.any():
            infos = {"final_obs": observations.copy(), "_final_obs": self._over.copy()}
            self._begin(np.flatnonzero(self._over))
            observations = self._observe()
        return observations, rewards, ended, truncated, infos
