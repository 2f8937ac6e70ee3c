"""BatchSimulator: one system in many worlds, each with a context of its own."""

from __future__ import annotations

import functools
import itertools
import operator
import threading
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, SupportsIndex

import numpy as np

from sheldrake.common import RandomGenerator
from sheldrake.common._thread_team import ThreadTeam
from sheldrake.systems.analysis._config import ApplySimulatorConfig, ExtractSimulatorConfig, SimulatorConfig
from sheldrake.systems.analysis._native_worlds import NativeWorlds, slow_rows
from sheldrake.systems.analysis._rollout import RolloutPlan
from sheldrake.systems.analysis._simulated_worlds import SimulatedWorlds
from sheldrake.systems.analysis._simulator import Simulator, first_tick
from sheldrake.systems.analysis._span import failure
from sheldrake.systems.framework import InputPort, OutputPort, System
from sheldrake.systems.framework._declarations import KIND_NAMES, UNRESTRICTED
from sheldrake.systems.framework._engine.worlds import Worlds
from sheldrake.systems.framework._kernels import integrate as _integrate
from sheldrake.systems.framework._kernels import program as _program
from sheldrake.systems.framework._kernels import worlds as tables
from sheldrake.systems.framework._kernels.worlds import Progress

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._engine.memory import Place, Slot
    from sheldrake.systems.framework._engine.store import Store


_TO_GO = np.zeros(Progress.SIZE, np.int64)
_TO_GO[Progress.code] = tables.OPEN
"""`Progress` of a world that has a rollout before it."""


class WorldFailure(NamedTuple):
    """Why a world stopped.

    Attributes:
        world: Its number.
        time: When [s]: the context is as it was after the last good step.
        system: Path of the system that failed; empty where none is known.
        error: What it says.
    """

    world: int
    time: float
    system: str
    error: BaseException


class WorldsFailed(RuntimeError):
    """Some worlds failed while the others went on; `failures` are WorldFailures."""

    def __init__(self, failures: list[WorldFailure]):
        shown = [f"  world {f.world} at t = {f.time} s: {f.error}" for f in failures[:10]]
        more = [f"  and {len(failures) - 10} more"] if len(failures) > 10 else []
        super().__init__("\n".join([f"{len(failures)} of the worlds failed; the others went on.", *shown, *more]))
        self.failures = failures


class BatchSimulator:
    """Advances many worlds of one system.

    All worlds' numbers are rows of one array, so that states, parameters, inputs and outputs of all of them are arrays,
    shape (num_worlds, ...), without copies: what is written there is what the worlds have. `context(i)` is world i as
    an ordinary Context. Worlds are advanced by threads, without Python where all systems are kernels; each has the bits
    that it would have alone, however many threads and other worlds there are.

    Args:
        system: The system; usually a Diagram.
        num_worlds: How many worlds.
        context: What they are all like at first: a root context, which is copied, but for what its logs have; a default
            one if not given.
        config: Of the simulators, or a Simulator whose settings they have; a new Simulator's if not given.
        num_threads: How many threads; as many as this process may use if not given.
        seed: Of the random numbers, see `generator`.
        first_world: Number of the first world among all that have a stream of the seed, see `generator`.
        raise_failures: Whether worlds that fail raise WorldsFailed when the others are done; else see `failures`.

    Raises:
        TypeError: the system is none, or what must be a whole number is not.
        ValueError: a number is less than one, or the settings are such as only one simulator can have.
        MemoryError: there is no room for so many worlds.
    """

    def __init__(
        self,
        system: System,
        num_worlds: int,
        context: Context | None = None,
        *,
        config: SimulatorConfig | Simulator | None = None,
        num_threads: int | None = None,
        seed: int = 0,
        first_world: int = 0,
        raise_failures: bool = True,
    ):
        if not isinstance(system, System):
            raise TypeError(f"BatchSimulator(): {system!r} is no System.")
        count = _whole("BatchSimulator()", "num_worlds", num_worlds, 1)
        settings = ExtractSimulatorConfig(config) if isinstance(config, Simulator) else config
        if settings is not None and (settings.target_realtime_rate or settings.publish_every_time_step):
            raise ValueError("BatchSimulator(): worlds have no target_realtime_rate and no publish_every_time_step.")
        self._system, self._count, self._config = system, count, config
        self._seed = _whole("BatchSimulator()", "seed", seed, 0, most=None)
        self._first = _whole("BatchSimulator()", "first_world", first_world, 0)
        self._raises = raise_failures
        self._monitor: Callable[[Any], Any] | None = None
        model = _simulator_of(system, config, system.CreateDefaultContext() if context is None else context.Clone())
        model.get_mutable_integrator().Initialize()
        store = model.get_context()._store
        if store.unsettled:
            store.settle()
        self._layout, self._team = store.layout, ThreadTeam(num_threads)
        self._numbers = model.get_integrator()._numbers
        self._last_instant = model._last_instant(store)
        try:
            self._worlds = Worlds(store, self._count, self._numbers)
        except (MemoryError, OSError, OverflowError, ValueError) as error:
            size = 8 * (store.S.size + store.I.size + store.L.size)
            raise MemoryError(
                f"BatchSimulator(): {self._count} worlds of about {size} bytes each do not fit into memory."
            ) from error
        program, rows = self._layout.program, self._layout.rows
        in_loop = {*program.calls.tolist(), *program.prerequisites.tolist()}
        self._with_inputs = sorted(r for r in in_loop if r >= 0 and rows[r].free)
        self._everybody = _read_only(np.arange(self._count))
        self._begun, self._all_begun = np.zeros(self._count, bool), False
        self._failures: dict[int, WorldFailure] = {}
        self._failed = np.zeros(self._count, bool)
        self._errors: dict[int, BaseException] = {}
        self._terminated, self._some_at_end = np.zeros(self._count, bool), False
        self._in_use = threading.Lock()
        self._plan = RolloutPlan(self._count)
        self._outputs_of: dict[int, RolloutPlan] = {}
        self._plans: dict[tuple, RolloutPlan] = {}
        self._generators: dict[int, RandomGenerator] = {}
        self._simulated = self._with_simulators()
        self._native = None if self._obstacles() else NativeWorlds(self._worlds, self._team)

    def _with_simulators(self) -> SimulatedWorlds:
        make = functools.partial(_simulator_of_world, self._system, self._config, self._monitor, self._team)
        return SimulatedWorlds(self._worlds, self._team, make, self._errors)

    def _obstacles(self) -> list[str]:
        """What keeps worlds from being advanced by machine code alone."""
        layout, systems = self._layout, self._worlds.model.systems
        found = []
        for r in slow_rows(layout):
            row = layout.rows[r]
            if row.node < 0:
                found.append("witness functions")
                continue
            system, what = systems[row.node], KIND_NAMES[row.kind]
            if row.output >= 0:
                what = f"output port {system._outputs[row.output].name!r}"
            found.append(f"{system.GetSystemPathname()}: {what} is Python")
        if self._numbers.scheme == _integrate.PYTHON:
            found.append("the integrator makes its steps in Python")
        if layout.num_abstract and any(kind == UNRESTRICTED for kind, *_ in layout.group_list):
            found.append("unrestricted updates of abstract state")
        if not self._worlds.model.native:
            found.append("kernels run as Python (SHELDRAKE_JIT=0)")
        if self._monitor is not None:
            found.append("the monitor is Python")
        return list(dict.fromkeys(found))

    def is_native(self) -> bool:
        """Whether worlds are advanced by machine code alone; if not, `Explain` says why."""
        return self._native is not None

    def Explain(self) -> str:
        """How the worlds are advanced, and which systems hold the others up."""
        found, threads = self._obstacles(), self._team.num_threads
        if not found:
            rows = len({r for _, _, rows, _ in self._layout.group_list for r in rows})
            return f"{self._count} worlds on {threads} threads: all {rows} rows of the event loop are machine code."
        lines = "\n".join(f"  {line}" for line in found)
        return (
            f"{self._count} worlds on {threads} threads, which take turns where they run Python. These do:\n{lines}\n"
            "Written as kernels (docs/kernels.md) they would leave the threads alone."
        )

    # What there is.

    def get_system(self) -> System:
        """The system."""
        return self._system

    def num_worlds(self) -> int:
        """How many worlds."""
        return self._count

    def num_threads(self) -> int:
        """How many threads, the caller's included."""
        return self._team.num_threads

    def context(self, world: int) -> Context:
        """World number `world` as a root context: whatever takes a context works on it.

        After writing to the batch's arrays ask for it again: what was computed in it is then out of date.

        Raises:
            IndexError: there is no such world.
            TypeError: it is no whole number.
        """
        store = self._worlds.store(self._number("context", world))
        store.out_of_date()
        return store.context(0)

    def generator(self, world: int) -> RandomGenerator:
        """The world's own random numbers: the same whatever the number of worlds and threads is.

        Raises:
            IndexError: there is no such world.
            TypeError: it is no whole number.
        """
        world = self._number("generator", world)
        if world not in self._generators:
            words = np.random.SeedSequence(self._seed, spawn_key=(self._first + world,)).generate_state(1)
            self._generators[world] = RandomGenerator(int(words[0]))
        return self._generators[world]

    def _number(self, call: str, world: SupportsIndex) -> int:
        number = _whole(f"BatchSimulator.{call}()", "world", world, None)
        if not 0 <= number < self._count:
            raise IndexError(f"BatchSimulator.{call}({world}): there are worlds 0 to {self._count - 1}.")
        return number

    # Arrays.

    @property
    def times(self) -> np.ndarray:
        """Times of the worlds [s], shape (num_worlds,); see `SetTime`."""
        return _read_only(self._worlds.S[:, 0])

    def states(self, system: System | None = None) -> np.ndarray:
        """States of a system in all worlds, shape (num_worlds, n), to be read and written.

        Args:
            system: The whole system, if not given: its continuous states, then its discrete ones.

        Raises:
            ValueError: the system is not part of this one, or has both kinds of state, not side by side.
        """
        place = self._place("states", system)
        spans = sorted(span for span in (place.xc, place.xd) if span[1] > span[0])
        if len(spans) == 2 and spans[0][1] != spans[1][0]:
            raise ValueError(
                "BatchSimulator.states(): the system has continuous and discrete states, which are two arrays: use "
                "continuous_states() and discrete_states()."
            )
        return self._worlds.S[:, spans[0][0] : spans[-1][1]] if spans else self._worlds.S[:, :0]

    def continuous_states(self, system: System | None = None) -> np.ndarray:
        """Continuous states of a system (of the whole, if not given), shape (num_worlds, n), to be read and written."""
        return self._columns(self._place("continuous_states", system).xc)

    def discrete_states(self, system: System | None = None) -> np.ndarray:
        """Discrete states of a system (of the whole, if not given), shape (num_worlds, n), to be read and written."""
        return self._columns(self._place("discrete_states", system).xd)

    def parameters(self, system: System | None = None, group: int | None = None) -> np.ndarray:
        """Numeric parameters of a system (of the whole, if not given), shape (num_worlds, n), to be read and written.

        Args:
            system: The system.
            group: One group of them; all in turn if not given.

        Raises:
            IndexError: there is no such group.
        """
        place = self._place("parameters", system)
        if group is None:
            return self._columns(place.p)
        first, last = place.parameters
        if not 0 <= group < last - first:
            raise IndexError(f"BatchSimulator.parameters(): there are {last - first} groups, and no {group}.")
        return self._columns(self._layout.parameter_groups[first + group])

    def inputs(self, port: InputPort) -> np.ndarray:
        """Values of an input port, shape (num_worlds, size), to be read and written; it is fixed in all worlds.

        Raises:
            ValueError: the port is connected, or not of vectors.
        """
        slot = self._free_slot("inputs", port)
        self._worlds.I[:, self._layout.fixed0 + slot.free] = 1
        return self._columns(slot.span)

    def EvalOutputs(self, port: OutputPort) -> np.ndarray | list:
        """Values of an output port, up to date.

        Returns:
            For vectors, an array that is not to be written, shape (num_worlds, size): the worlds' own, which the next
            call may change. For an abstract port, a list of values.
        """
        *_, slot = self._layout.output_slot(self._node("EvalOutputs", port.get_system()), int(port.get_index()))
        if not slot.vector:
            return [port.Eval(self._context_of(port, w)) for w in range(self._count)]
        if slot.row >= 0:
            plan = self._outputs_of.setdefault(
                slot.row, RolloutPlan(self._count, rows=self._layout.pull_list(slot.row))
            )
            plan.rollout.who[:] = range(self._count)
            self._call_each("EvalOutputs", plan, self._count, tables.OUTPUTS)
        return _read_only(self._columns(slot.span))

    def _context_of(self, port: InputPort | OutputPort, w: int) -> Context:
        return port.get_system().GetMyContextFromRoot(self.context(w))

    def _columns(self, span: tuple[int, int]) -> np.ndarray:
        return self._worlds.S[:, slice(*span)]

    def _node(self, call: str, system: System | None) -> int:
        if system is None:
            return 0
        node = self._layout.node_of.get(getattr(system, "_system_id", None))
        if node is None:
            raise ValueError(f"BatchSimulator.{call}(): {system!r} is not part of {self._system._describe()}.")
        return node

    def _place(self, call: str, system: System | None) -> Place:
        return self._layout.places[self._node(call, system)]

    def _free_slot(self, call: str, port: InputPort) -> Slot:
        slot = self._layout.input_slot(self._node(call, port.get_system()), int(port.get_index()))
        if not slot.vector or slot.free < 0:
            why = "connected to an output port" if slot.vector else "not of vectors"
            raise ValueError(f"BatchSimulator.{call}(): {port.GetFullDescription()} is {why}.")
        return slot

    # Who is where.

    @property
    def failures(self) -> list[WorldFailure]:
        """Worlds that failed and were not set back since, by number."""
        return [self._failures[w] for w in sorted(self._failures)]

    @property
    def failed(self) -> np.ndarray:
        """Whether each world failed and was not set back since, shape (num_worlds,)."""
        return self._failed.copy()

    @property
    def terminated(self) -> np.ndarray:
        """Whether each world reached its termination condition and was not set back since, shape (num_worlds,)."""
        return self._terminated.copy()

    def _numbers_of(self, call: str, worlds: ArrayLike | None) -> np.ndarray:
        """Numbers of worlds that are given as a mask, as numbers, or as None for all."""
        if worlds is None:
            return np.arange(self._count)
        given = np.asarray(worlds)
        if given.dtype == bool:
            if given.shape != (self._count,):
                raise ValueError(f"BatchSimulator.{call}(): a mask has shape ({self._count},), not {given.shape}.")
            return np.flatnonzero(given)
        if given.dtype.kind not in "iu" and given.size:
            raise TypeError(f"BatchSimulator.{call}(): worlds are a mask or whole numbers, not {worlds!r}.")
        who = np.atleast_1d(given).astype(np.int64)
        if who.ndim != 1 or np.any(who < 0) or np.any(who >= self._count) or len(np.unique(who)) < len(who):
            raise ValueError(f"BatchSimulator.{call}(): worlds must be different numbers below {self._count}.")
        return who

    def _going(self, call: str, worlds: ArrayLike | None) -> np.ndarray:
        """Those that may advance: of all, those that have not come to an end."""
        if worlds is None:
            return np.flatnonzero(~(self._terminated | self._failed)) if self._some_at_end else self._everybody
        who = self._numbers_of(call, worlds)
        if self._some_at_end and (at_end := (self._terminated | self._failed)[who]).any():
            w = int(who[at_end][0])
            what = f"failed ({self._failures[w].error})" if w in self._failures else "terminated"
            raise RuntimeError(f"BatchSimulator.{call}(): world {w} has {what}; Reset() it first.")
        return who

    # Running.

    def set_monitor(self, monitor: Callable[[Any], Any]) -> None:
        """`monitor(context)` is called for each world after its beginning and every step; it may return an EventStatus.

        It is Python: threads take turns to call it. What can be told from arrays between advances is cheaper there.

        Raises:
            RuntimeError: worlds have been advanced already.
        """
        if self._begun.any():
            raise RuntimeError("BatchSimulator.set_monitor(): worlds have been advanced already; Reset() them first.")
        self._monitor, self._native = monitor, None
        self._simulated = self._with_simulators()

    def SetTime(self, time: Any, worlds: ArrayLike | None = None) -> None:
        """Sets the time of worlds [s]: a number, or one for each; they begin anew when they are advanced.

        Args:
            time: Finite.
            worlds: A mask, shape (num_worlds,), or numbers; all if not given.

        Raises:
            ValueError: a time is not finite, or there are not as many as worlds.
        """
        who = self._numbers_of("SetTime", worlds)
        times = self._times_of("SetTime", time, who)
        if not np.all(np.isfinite(times)):
            raise ValueError(f"BatchSimulator.SetTime(): times must be finite, not {time}.")
        self._worlds.S[who, 0] = times
        self._begun[who] = self._all_begun = False

    def Reset(self, worlds: ArrayLike | None = None) -> None:
        """Sets worlds back to how they were at first: time and state. Parameters and inputs stay; logs are empty.

        Args:
            worlds: A mask, shape (num_worlds,), or numbers; all if not given.
        """
        who = self._numbers_of("Reset", worlds)
        self._alone("Reset", self._worlds.set_back, who)
        self._forget_end(who)

    def _times_of(self, call: str, time: ArrayLike, who: np.ndarray) -> np.ndarray:
        """A time for each of these worlds [s]."""
        times = np.asarray(time, float)
        if times.shape not in ((), (1,), who.shape):
            raise ValueError(
                f"BatchSimulator.{call}(): expected one time, or one for each of {len(who)} worlds; found an array of "
                f"shape {times.shape}."
            )
        return np.broadcast_to(times, who.shape)

    def _too_late(self, t: float) -> str:
        """Why worlds cannot be at this time [s], if numbers lie too far apart there."""
        if not np.isfinite(t) or abs(t) < self._last_instant:
            return ""
        return (
            f": numbers are {np.spacing(abs(t)):g} s apart there, more than the system's steps: time would stand still"
        )

    def _forget_end(self, who: np.ndarray) -> None:
        self._begun[who] = self._all_begun = False
        if self._some_at_end:
            self._terminated[who] = self._failed[who] = False
            self._some_at_end = bool(self._terminated.any() or self._failed.any())
        for w in who.tolist() if self._failures else ():
            self._failures.pop(w, None)

    def SetRandomContexts(self, worlds: ArrayLike | None = None) -> None:
        """Gives worlds random states and parameters, each from its own generator: see `System.SetRandomContext`."""
        for w in self._numbers_of("SetRandomContexts", worlds).tolist():
            self._system.SetRandomContext(self.context(w), self.generator(w))

    def Initialize(self, worlds: ArrayLike | None = None) -> None:
        """Runs initialization events, sets the clocks, and publishes what is due at the beginning.

        Worlds that are new, were set back or got another time are initialized when they are advanced.

        Raises:
            WorldsFailed: some failed.
        """
        self._begin("Initialize", self._going("Initialize", worlds))

    def AdvanceTo(self, boundary_time: ArrayLike, worlds: ArrayLike | None = None) -> None:
        """Advances worlds to a time [s], each as `Simulator.AdvanceTo` would.

        Args:
            boundary_time: A number, or one for each of these worlds.
            worlds: A mask, shape (num_worlds,), or numbers. If not given, all that have neither failed nor terminated.

        Raises:
            ValueError: a time lies in the past.
            RuntimeError: one of these worlds has failed or terminated; another thread advances this batch.
            WorldsFailed: some failed; the others have arrived.
            KeyboardInterrupt: Ctrl-C was pressed; each world is as after any of its steps.
        """
        who = self._going("AdvanceTo", worlds)
        T = self._times_of("AdvanceTo", boundary_time, who)
        late = ~(self._worlds.S[who, 0] <= T) | ~(np.abs(T) < self._last_instant)
        if late.any():
            w = int(who[late][0])
            raise ValueError(
                f"BatchSimulator.AdvanceTo(): world {w} is at t = {self._worlds.S[w, 0]} s and cannot advance to "
                f"{T[late][0]} s{self._too_late(T[late][0])}."
            )
        self._begin("AdvanceTo", who)
        time = self._plan.rollout.time
        time[: len(who)] = 0.0
        time[: len(who), 0] = T
        self._roll_out("AdvanceTo", self._plan, who, 1)

    def AdvanceSteps(self, num_steps: int, worlds: ArrayLike | None = None) -> None:
        """Advances worlds by a number of periods of the system's only clock.

        Args:
            num_steps: At least 1.
            worlds: As in `AdvanceTo`.

        Raises:
            RuntimeError: the system has no clock, or several; and as in `AdvanceTo`.
        """
        _whole("BatchSimulator.AdvanceSteps()", "num_steps", num_steps, 1)
        who = self._going("AdvanceSteps", worlds)
        self._begin("AdvanceSteps", who)
        self._set_ticks("AdvanceSteps", self._plan, self._next_ticks(who), num_steps)
        self._roll_out("AdvanceSteps", self._plan, who, 1)

    def _next_ticks(self, who: np.ndarray) -> np.ndarray:
        """Numbers of the ticks of the system's only clock that come next."""
        return self._worlds.I[self._rows(who), self._layout.k0] if self._layout.clocks else who

    def _rows(self, who: np.ndarray) -> np.ndarray | slice:
        """These worlds' rows of arrays; taking all of them is cheaper than taking each."""
        return slice(None) if who is self._everybody else who

    def _set_ticks(self, call: str, plan: RolloutPlan, next_ticks: np.ndarray, num_steps: int) -> None:
        """Times of a plan: samples are `num_steps` ticks apart."""
        _whole(f"BatchSimulator.{call}()", "steps_per_sample", num_steps, 1)
        clocks = self._layout.clocks
        if len(clocks) != 1:
            raise RuntimeError(
                f"BatchSimulator.{call}(): steps are periods of the system's only clock; {self._system._describe()} "
                f"has {len(clocks)} clocks. Use times instead."
            )
        time = plan.rollout.time[: len(next_ticks)]
        time[:] = *clocks[0], num_steps - 1, num_steps
        time[:, 2] += next_ticks

    def Record(
        self,
        output_ports: OutputPort | Sequence[OutputPort],
        num_samples: int,
        inputs: Any = None,
        *,
        input_port: InputPort | None = None,
        steps_per_sample: int = 1,
        time_step: float | None = None,
        worlds: Any = None,
    ) -> Any:
        """Advances worlds and keeps the values that output ports have on the way.

        Args:
            output_ports: A port of vectors, or several.
            num_samples: How often they are kept.
            inputs: Values of an input port, shape (num_worlds, num_samples, size), or (num_samples, size) for all: each
                is there from one sample to the next.
            input_port: That port; the system's first, if not given.
            steps_per_sample: Periods of the system's only clock from one sample to the next.
            time_step: Time from one sample to the next instead [s].
            worlds: As in `AdvanceTo`.

        Returns:
            Of each port an array, shape (num_worlds, num_samples, size): of the worlds that were advanced, in turn. The
            batch owns it: the next call with the same ports and number of samples writes over it. Samples that a world
            did not reach are NaN.

        Raises:
            ValueError: shapes do not fit, or a port is not one of vectors.
            RuntimeError: as in `AdvanceSteps`.
        """
        who = self._going("Record", worlds)
        plan, ports = self._sampling("Record", output_ports, num_samples, inputs, input_port, None)
        self._begin("Record", who)
        if time_step is None:
            self._set_ticks("Record", plan, self._next_ticks(who), steps_per_sample)
        else:
            self._set_times(plan, self._worlds.S[who, 0], time_step)
        self._put_inputs("Record", plan, len(who), num_samples, inputs)
        return self._sample("Record", plan, who, num_samples, ports)

    def Rollout(
        self,
        x0: Any,
        inputs: Any = None,
        *,
        output_ports: OutputPort | Sequence[OutputPort] | None = None,
        num_samples: int | None = None,
        input_port: InputPort | None = None,
        steps_per_sample: int = 1,
        time_step: float | None = None,
    ) -> Any:
        """What becomes of initial states under sequences of inputs: worlds begin anew and are sampled as by `Record`.

        It is meant to be called again and again: after the first call with the same ports and number of samples nothing
        is allocated.

        Args:
            x0: States, see `states`: shape (n,), or (num_rollouts, n).
            inputs: As in `Record`; their first axes may tell num_rollouts, which is at most num_worlds and num_worlds
                if nothing tells, and num_samples.
            output_ports: The system's first, if not given.
            num_samples: How many samples, if there are no inputs.
            input_port: As in `Record`.
            steps_per_sample: As in `Record`.
            time_step: As in `Record`.

        Returns:
            As `Record`, shape (num_rollouts, num_samples, size).

        Raises:
            ValueError: shapes do not fit.
            RuntimeError: as in `AdvanceSteps`.
        """
        x0 = np.asarray(x0, float)
        shape: tuple[int, ...] = () if inputs is None else np.shape(inputs)
        if num_samples is None:
            if len(shape) < 2:
                raise ValueError(
                    "BatchSimulator.Rollout(): without inputs, shape (..., num_samples, size), num_samples."
                )
            num_samples = shape[-2]
        told: list[int] = [*(x0.shape[:1] if x0.ndim == 2 else ()), *(shape[:1] if len(shape) == 3 else ())]
        count = told[0] if told else self._count
        width = self.states().shape[1]
        if x0.shape[-1:] != (width,) or x0.ndim > 2 or set(told) - {count} or not 1 <= count <= self._count:
            raise ValueError(
                f"BatchSimulator.Rollout(): x0 has shape {x0.shape} and inputs {shape or None}; expected ({width},) or "
                f"(n, {width}), and (n, num_samples, size) with the same n of at most {self._count}."
            )
        outputs = self._system.get_output_port(0) if output_ports is None else output_ports
        plan, ports = self._sampling("Rollout", outputs, num_samples, inputs, input_port, width)
        t0 = float(self._worlds.model.S[0])
        if time_step is None:
            ticks = [first_tick(offset, period, t0) for offset, period in self._layout.clocks]
            there = [a + b * k == t0 for (a, b), k in zip(self._layout.clocks, ticks)]
            self._set_ticks("Rollout", plan, np.full(count, sum(ticks) + sum(there)), steps_per_sample)
        else:
            self._set_times(plan, np.full(count, t0), time_step)
        plan.rollout.state[:count] = x0
        self._put_inputs("Rollout", plan, count, num_samples, inputs)
        return self._sample("Rollout", plan, np.arange(count), num_samples, ports)

    def _set_times(self, plan: RolloutPlan, t0: np.ndarray, time_step: float) -> None:
        """Times of a plan: samples are `time_step` [s] apart."""
        if not 0.0 < time_step < np.inf:
            raise ValueError(f"BatchSimulator: time_step must be positive and finite, not {time_step} s.")
        time = plan.rollout.time[: len(t0)]
        time[:, 0], time[:, 1], time[:, 2:] = t0, time_step, 1.0

    def _sampling(
        self, call: str, outputs: Any, num_samples: int, inputs: Any, input_port: Any, state: int | None
    ) -> tuple[RolloutPlan, list[tuple[int, int]] | None]:
        """The plan for these ports, made once, and where each port's values are in its samples; None: there is one."""
        num_samples = _whole(f"BatchSimulator.{call}()", "num_samples", num_samples, 1)
        ports = [outputs] if isinstance(outputs, OutputPort) else list(outputs)
        slots = [self._output_slot(call, port) for port in ports]
        inputs_at = np.zeros(0, np.int64)
        if inputs is not None:
            port = self._system.get_input_port(0) if input_port is None else input_port
            slot = self._free_slot(call, port)
            self._worlds.I[:, self._layout.fixed0 + slot.free] = 1
            inputs_at = np.arange(*slot.span)
        key = (tuple(slot.span for slot in slots), tuple(inputs_at[:1]), num_samples, state)
        if key not in self._plans:
            rows = [r for slot in slots if slot.row >= 0 for r in self._layout.pull_list(slot.row)]
            outputs_at = np.concatenate([np.arange(*slot.span) for slot in slots])
            self._plans[key] = RolloutPlan(self._count, state, inputs_at, outputs_at, sorted(set(rows)), num_samples)
        ends = np.cumsum([0, *(slot.span[1] - slot.span[0] for slot in slots)]).tolist()
        return self._plans[key], None if isinstance(outputs, OutputPort) else list(itertools.pairwise(ends))

    def _output_slot(self, call: str, port: OutputPort) -> Slot:
        *_, slot = self._layout.output_slot(self._node(call, port.get_system()), int(port.get_index()))
        if not slot.vector:
            raise ValueError(f"BatchSimulator.{call}(): {port.GetFullDescription()} is not of vectors.")
        return slot

    def _put_inputs(self, call: str, plan: RolloutPlan, count: int, num_samples: int, inputs: ArrayLike | None) -> None:
        if inputs is None:
            return
        size, shape = len(plan.rollout.inputs_at), np.shape(inputs)
        if shape not in ((count, num_samples, size), (num_samples, size)):
            raise ValueError(
                f"BatchSimulator.{call}(): inputs must have shape {(count, num_samples, size)} or "
                f"{(num_samples, size)}, not {shape}."
            )
        plan.rollout.inputs[: count * num_samples].reshape(count, num_samples, size)[:] = inputs

    def _sample(
        self, call: str, plan: RolloutPlan, who: np.ndarray, num_samples: int, ports: Any
    ) -> np.ndarray | list[np.ndarray]:
        """Takes worlds through a plan; its outputs."""
        kept = plan.rollout.outputs[: len(who) * num_samples].reshape(len(who), num_samples, -1)
        self._roll_out(call, plan, who, num_samples, kept)
        found = _read_only(kept)
        return found if ports is None else [found[:, :, a:b] for a, b in ports]

    def _begin(self, call: str, who: np.ndarray) -> None:
        """Initializes those of these worlds that have not begun."""
        in_time = np.abs(self._worlds.S[:, 0]) < self._last_instant
        if not in_time.all() and not in_time[who].all():
            w = int(who[~in_time[who]][0])
            t = self._worlds.S[w, 0]
            raise ValueError(f"BatchSimulator.{call}(): world {w} is at t = {t} s{self._too_late(t)}.")
        if self._all_begun:
            return
        new = who[~self._begun[who]]
        self._all_begun = who is self._everybody
        if not len(new):
            return
        self._plan.rollout.who[: len(new)] = new
        self._begun[new] = True
        self._worlds.begin_integrating(new)
        self._call_each(call, self._plan, len(new), tables.BEGIN)

    def _engine_of(self, plan: RolloutPlan) -> NativeWorlds | SimulatedWorlds:
        rows = self._layout.rows
        return self._native if self._native and all(rows[r].native for r in plan.rows) else self._simulated

    def _call_each(self, call: str, plan: RolloutPlan, count: int, callee: int) -> None:
        who = plan.rollout.who[:count]
        self._alone(call, self._call_each_alone, plan, who, callee)
        self._note_outcomes(who)

    def _call_each_alone(self, plan: RolloutPlan, who: np.ndarray, callee: int) -> None:
        self._check_inputs(who, plan.rows)
        self._engine_of(plan).call_each(plan, len(who), callee)

    def _roll_out(
        self, call: str, plan: RolloutPlan, who: np.ndarray, samples: int, kept: np.ndarray | None = None
    ) -> None:
        """Takes worlds through a plan whose times, inputs and states are in place, and its outputs in `kept`."""
        plan.rollout.who[: len(who)] = who
        self._alone(call, self._roll_out_alone, plan, who, samples)
        if kept is not None:
            done = self._worlds.progress[who, Progress.sample]
            for j in np.flatnonzero(done < samples).tolist():
                kept[j, done[j] :] = np.nan
        self._note_outcomes(who)

    def _roll_out_alone(self, plan: RolloutPlan, who: np.ndarray, samples: int) -> None:
        self._check_inputs(who, plan.rows)
        if len(plan.rollout.state):
            self._worlds.forget_past(who)
            self._forget_end(who)
            self._begun[who] = True
        self._worlds.progress[self._rows(who)] = _TO_GO
        self._engine_of(plan).roll_out(plan, len(who), samples)

    def _alone(self, call: str, work: Callable[..., None], *args: Any) -> None:
        """Work on the worlds while which nobody else does any.

        Raises:
            RuntimeError: somebody does already; or the context of a world was given what others have not.
        """
        if not self._in_use.acquire(blocking=False):
            raise RuntimeError(f"BatchSimulator.{call}(): the worlds are being advanced or computed already.")
        try:
            for store in self._worlds.known():
                if store.unsettled:
                    store.settle()
            work(*args)
        finally:
            self._in_use.release()

    def _check_inputs(self, who: np.ndarray, rows: Sequence[int]) -> None:
        """Kernels see all inputs: they must have them.

        Raises:
            RuntimeError: one has none, naming it.
        """
        for r in (*self._with_inputs, *rows):
            row = self._layout.rows[r]
            for free in row.free:
                fixed = self._worlds.I[:, self._layout.fixed0 + free]
                if not fixed.all() and (missing := fixed[who] == 0).any():
                    self._worlds.store(int(who[missing][0])).check_inputs(row)

    def _note_outcomes(self, who: np.ndarray) -> None:
        """What became of these worlds.

        Raises:
            WorldsFailed: some failed.
        """
        codes = self._worlds.progress[self._rows(who), Progress.code]
        if not codes.any():  # all are DONE
            return
        self._some_at_end = True
        self._terminated[who] |= codes == _program.TERMINATED
        new = [self._failure(w) for w in who[codes == _program.ERROR].tolist()]
        for found in new:
            self._failures[found.world], self._failed[found.world] = found, True
        if new and self._raises:
            raise WorldsFailed(new)

    def _failure(self, w: int) -> WorldFailure:
        store = self._worlds.store(w)
        status, r, time = int(store.side.status), int(store.side.row), float(store.S[0])
        store.side.status = 0
        if w in self._errors:
            rows = self._layout.rows
            system = store.systems[rows[r].node] if 0 <= r < len(rows) and rows[r].node >= 0 else None
            error = self._errors.pop(w)
        else:
            error, system, _ = failure(store, self._numbers, status, r)
        return WorldFailure(w, time, "" if system is None else system.GetSystemPathname(), error)


def _whole(call: str, name: str, number: SupportsIndex, least: int | None, most: int | None = 1 << 53) -> int:
    """A number that must be whole and neither too small nor too large; errors begin with the name of the call.

    Raises:
        TypeError: it is not whole.
        ValueError: it is out of bounds.
    """
    try:
        found = operator.index(number)
    except TypeError:
        raise TypeError(f"{call}: {name} must be a whole number, not {number!r}.") from None
    if least is not None and found < least:
        raise ValueError(f"{call}: {name} must be at least {least}, not {found}.")
    if most is not None and found > most:
        raise ValueError(f"{call}: {name} must be at most {most}, not {found}.")
    return found


def _simulator_of(system: System, config: SimulatorConfig | Simulator | None, context: Context) -> Simulator:
    simulator = Simulator(system, context)
    if isinstance(config, Simulator):
        ApplySimulatorConfig(ExtractSimulatorConfig(config), simulator)
        mine, theirs = simulator.get_mutable_integrator(), config.get_integrator()
        mine.set_requested_minimum_step_size(theirs.get_requested_minimum_step_size())
        mine.set_throw_on_minimum_step_size_violation(theirs.get_throw_on_minimum_step_size_violation())
        first = theirs.get_initial_step_size_target()
        if first == first:  # asked for
            mine.request_initial_step_size_target(first)
    elif config is not None:
        ApplySimulatorConfig(config, simulator)
    simulator.set_progress(False)
    return simulator


def _simulator_of_world(
    system: System, config: SimulatorConfig | Simulator | None, monitor: Any, team: ThreadTeam, store: Store
) -> Simulator:
    """The simulator of a world that needs Python."""
    time = store.S[0]
    simulator = _simulator_of(system, config, store.context(0))
    store.S[0] = time  # the settings have one
    simulator._interrupt = team.check
    if monitor is not None:
        simulator.set_monitor(monitor)
    return simulator


def _read_only(array: np.ndarray) -> np.ndarray:
    view = array.view()
    view.flags.writeable = False
    return view
