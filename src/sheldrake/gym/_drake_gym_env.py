"""`DrakeGymEnv`: a Simulator behind the interface of a Gymnasium environment."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np

from sheldrake.common import RandomGenerator
from sheldrake.systems.analysis import Simulator, SimulatorStatus
from sheldrake.systems.framework import (
    InputPort,
    InputPortIndex,
    OutputPortIndex,
    PortDataType,
)
from sheldrake.systems.sensors import ImageRgba8U

if TYPE_CHECKING:
    from sheldrake.systems.framework._port import OutputPort
    from sheldrake.systems.framework._system import System


class DrakeGymEnv(gymnasium.Env):
    """An environment whose steps are stretches of a simulation.

    An action is the value of an input port, kept for `time_step`; an observation is the value of an output port. An
    episode ends when the simulator's monitor says so, and is cut short when a step raises a RuntimeError.

    Args:
        simulator: A Simulator, or a function that makes one from a RandomGenerator; it is called at each reset.
        time_step: Simulated time of one step [s].
        action_space: A `gymnasium.spaces.Space`; None for any vector of the action port's size.
        observation_space: Likewise for the observation port.
        reward: A function of (system, context), or an output port of one number: its index or name.
        action_port_id: An input port of the simulated system: the port, its index or name; None for the first.
        observation_port_id: An output port: its index or name; None for the first.
        render_rgb_port_id: An output port of ImageRgba8U, for the render mode "rgb_array".
        render_mode: "human" publishes, so that visualizers draw; "rgb_array" gives the picture, shape (height, width,
            4) of bytes; "ansi" gives the context as text.
        reset_handler: A function of (simulator, context, seed) that sets the state of a new episode, which is the
            default one when it is called. Without one the state is random: see `System.SetRandomContext`.
        info_handler: A function of the simulator that gives a dictionary with whatever is of interest.
        hardware: The system is a machine: its state is not set at a reset, other than by `reset_handler`.

    Raises:
        ValueError: something given is not of these kinds, or a space has another shape than its port.
        gymnasium.error.Error: the system lacks a port.
    """

    simulator: Any
    action_port: InputPort
    observation_port: OutputPort
    render_rgb_port: OutputPort | None
    reward: Any
    info_handler: Any
    metadata = {"render_modes": ["human", "ascii", "ansi", "rgb_array"]}

    def __init__(
        self,
        simulator: Simulator | Callable[[RandomGenerator], Simulator],
        time_step: float,
        action_space: Any = None,
        observation_space: Any = None,
        reward: Any = None,
        action_port_id: InputPort | InputPortIndex | str | None = None,
        observation_port_id: OutputPortIndex | str | None = None,
        render_rgb_port_id: OutputPortIndex | str | None = None,
        render_mode: str = "human",
        reset_handler: Callable[[Simulator, Any, int | None], None] | None = None,
        info_handler: Callable[[Simulator], dict] | None = None,
        hardware: bool = False,
    ):
        if isinstance(simulator, Simulator):
            self.simulator, self.make_simulator = simulator, None
        elif callable(simulator):
            self.simulator, self.make_simulator = None, simulator
        else:
            raise ValueError(f"DrakeGymEnv(): simulator must be a Simulator or a function, not {simulator!r}.")
        if not time_step > 0:
            raise ValueError(f"DrakeGymEnv(): time_step must be positive, not {time_step!r} s.")
        if not (callable(reward) or isinstance(reward, (OutputPortIndex, str))):
            raise ValueError(f"DrakeGymEnv(): reward must be a function or an output port, not {reward!r}.")
        if render_mode not in self.metadata["render_modes"]:
            raise ValueError(f"DrakeGymEnv(): render_mode must be one of {self.metadata['render_modes']}.")
        self.time_step, self.render_mode, self.hardware = time_step, render_mode, hardware
        self.action_space, self.observation_space = action_space, observation_space
        self.reward, self._reward_given = None, reward
        self.action_port_id, self.observation_port_id = action_port_id, observation_port_id
        self.render_rgb_port_id = render_rgb_port_id
        self.reset_handler = _function_or_none("reset_handler", reset_handler)
        self.info_handler = _function_or_none("info_handler", info_handler) or (lambda _: {})
        self.generator = RandomGenerator()
        if self.simulator is None:
            if self.action_space is None or self.observation_space is None:
                raise ValueError("DrakeGymEnv(): both spaces must be given with a function that makes simulators.")
        else:
            self._setup()

    def _setup(self) -> None:
        """Finds the ports of the simulator's system."""
        system = self.simulator.get_system()
        self.action_port = _input_port(system, self.action_port_id)
        self.observation_port = _output_port(system, self.observation_port_id)
        for name, port in (("action", self.action_port), ("observation", self.observation_port)):
            if port is None:
                raise gymnasium.error.Error(f"DrakeGymEnv: {system.get_name()} has no port for the {name}.")
            if getattr(self, f"{name}_space") is None:
                setattr(self, f"{name}_space", _all_vectors(name, port))
            shape = getattr(self, f"{name}_space").shape
            if port.get_data_type() == PortDataType.kVectorValued and shape != (port.size(),):
                raise ValueError(
                    f"DrakeGymEnv: the {name}_space has shape {shape}, and port '{port.get_name()}' size {port.size()}."
                )
        self._check_reward(system)
        self.render_rgb_port = None
        if self.render_rgb_port_id is not None:
            self.render_rgb_port = _output_port(system, self.render_rgb_port_id)
            if not isinstance(self.render_rgb_port.Allocate().get_value(), ImageRgba8U):
                raise gymnasium.error.Error("DrakeGymEnv: render_rgb_port_id is not a port of ImageRgba8U.")

    def _check_reward(self, system: System) -> None:
        if callable(self._reward_given):
            self.reward = self._reward_given
            return
        port = _output_port(system, self._reward_given)
        if port.get_data_type() != PortDataType.kVectorValued or port.size() != 1:
            raise ValueError("DrakeGymEnv(): the reward's port must give one number.")
        self.reward = lambda system, context: port.Eval(context)[0]

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict]:
        """Keeps an action for `time_step`.

        Args:
            action: An element of the action space.

        Returns:
            Observation, reward, whether the episode ended, whether it was cut short, information.

        Raises:
            RuntimeError: `reset` was not called.
        """
        if self.simulator is None:
            raise RuntimeError("DrakeGymEnv.step(): call reset() first.")
        system, context = self.simulator.get_system(), self.simulator.get_mutable_context()
        self.action_port.FixValue(context, action)
        before = self.observation_port.Eval(context)
        try:
            status = self.simulator.AdvanceTo(context.get_time() + self.time_step)
        except RuntimeError as error:
            warnings.warn(f"DrakeGymEnv.step(): the episode is cut short: {error}", stacklevel=2)
            return before, 0, False, True, {}
        ended = status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition
        observation = self.observation_port.Eval(context)
        return observation, self.reward(system, context), ended, False, self.info_handler(self.simulator)

    def reset(self, *, seed: int | None = None, options: dict | None = None) -> tuple[Any, dict]:
        """Begins an episode.

        Args:
            seed: Of the random numbers; None goes on with those there are.
            options: There are none.

        Returns:
            Observation, information.

        Raises:
            ValueError: options are given.
        """
        if options:
            raise ValueError(f"DrakeGymEnv.reset(): there are no options, such as {options!r}.")
        super().reset(seed=seed)
        if seed is not None:
            self.generator = RandomGenerator(seed)
        if self.make_simulator is not None:
            self.simulator = self.make_simulator(self.generator)
            self._setup()
        context = self.simulator.get_mutable_context()
        context.SetTime(0)
        self.simulator._initialize_anew()
        if self.reset_handler is not None:
            self.simulator.get_system().SetDefaultContext(context)
            self.reset_handler(self.simulator, context, seed)
        elif not self.hardware:
            self.simulator.get_system().SetRandomContext(context, self.generator)
        return self.observation_port.Eval(context), self.info_handler(self.simulator)

    def render(self) -> Any:
        """Shows the present state as the render mode says; gives the picture or the text, if that is the way.

        Raises:
            RuntimeError: `reset` was not called, or "rgb_array" has no port.
        """
        if self.simulator is None:
            raise RuntimeError("DrakeGymEnv.render(): call reset() first.")
        context = self.simulator.get_context()
        if self.render_mode == "rgb_array":
            if self.render_rgb_port is None:
                raise RuntimeError("DrakeGymEnv.render(): 'rgb_array' needs a render_rgb_port_id.")
            return self.render_rgb_port.Eval(context).data
        if self.render_mode == "human":
            self.simulator.get_system().ForcedPublish(context)
            return None
        return repr(context)


def _function_or_none(name: str, given: Any) -> Any:
    if given is not None and not callable(given):
        raise ValueError(f"DrakeGymEnv(): {name} must be a function, not {given!r}.")
    return given


def _input_port(system: System, wanted: Any) -> Any:
    if isinstance(wanted, InputPort):
        return wanted
    if wanted is None:
        return system.get_input_port(0) if system.num_input_ports() else None
    return system.GetInputPort(wanted) if isinstance(wanted, str) else system.get_input_port(int(wanted))


def _output_port(system: System, wanted: Any) -> Any:
    if wanted is None:
        return system.get_output_port(0) if system.num_output_ports() else None
    return system.GetOutputPort(wanted) if isinstance(wanted, str) else system.get_output_port(int(wanted))


def _all_vectors(name: str, port: InputPort | OutputPort) -> gymnasium.spaces.Box:
    if port.get_data_type() != PortDataType.kVectorValued:
        raise gymnasium.error.Error(f"DrakeGymEnv: the {name} port is not of vectors, so its space must be given.")
    size = (port.size(),)
    return gymnasium.spaces.Box(np.full(size, -np.inf), np.full(size, np.inf), dtype=np.float64)
