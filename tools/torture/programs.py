"""Programs of chance against the public API: any call after any other, from callbacks too.

A program runs in two worlds, one stepped natively, one by the interpreted loop. After every call both say the same:
equal numbers bit for bit, or the same error in the same words.
"""

from __future__ import annotations

import copy
import functools
import math
import pathlib
import random
import re
import tempfile
from collections.abc import Callable
from typing import Any

import hypothesis
import numpy as np
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule, run_state_machine_as_test
from tests.unit.systems.framework import random_diagrams
from tools.torture.calls import MODEL as ROBOT

from sheldrake.common.value import Value
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from sheldrake.systems import analysis
from sheldrake.systems import primitives as pr
from sheldrake.systems.framework import DiagramBuilder, LeafSystem, LoadContext, PortDataType, SaveContext

PROGRAMS = 25  # of one trial: hypothesis starts slowly
LONGEST = 0.03  # [s] that a call may advance
FARTHEST = 1e9  # [s]; times from beyond are to be refused
SHORTEST = 2.0**-14  # [s] that error control may go down to: the interpreted loop takes milliseconds a step
CALLS = 15  # of a program, at most
PLACES = ("periodic", "per_step", "discrete", "unrestricted", "output", "derivatives", "monitor")
SCHEMES = (
    "explicit_euler",
    "runge_kutta2",
    "runge_kutta3",
    "semi_explicit_euler",
    "bogacki_shampine3",
    "implicit_euler",
)
NUMBERS = (0.0, -0.0, 0.02, 1.0, -2.5, 1e-12, 1e6, 1e300, 5e-324, math.inf, -math.inf, math.nan)
_MADE_UP = re.compile(r"0x[0-9a-f]{6,}|@[0-9a-f]{8,}|/tmp/[\w/.-]+|\b\d{15}\b")
_OPEN = re.compile(r"InputPort::Eval\(\): required InputPort.* is not connected.*")  # of several, any may be named


class Listener(LeafSystem):
    """Hears of every kind of callback; y = u, xdot = u[0] - x, x+ = x / 2 + u[0]."""

    def __init__(self, hear: Callable[[str], None]) -> None:
        super().__init__()
        self.hear = hear
        self.DeclareVectorInputPort("u", 2)
        self.DeclareContinuousState(1)
        self.DeclareDiscreteState([1.0])
        self.DeclareAbstractState(Value[str]("start"))
        self.DeclareVectorOutputPort("y", 2, self.output)
        self.DeclarePeriodicPublishEvent(1 / 256, 0.0, lambda context: hear("periodic"))
        self.DeclarePerStepPublishEvent(lambda context: hear("per_step"))
        self.DeclarePeriodicDiscreteUpdateEvent(1 / 128, 0.0, self.update)
        self.DeclarePeriodicUnrestrictedUpdateEvent(1 / 64, 0.0, self.update_all)

    def output(self, context: Any, y: Any) -> None:
        self.hear("output")
        y.SetFromVector(self.get_input_port().Eval(context))

    def update(self, context: Any, x: Any) -> None:
        self.hear("discrete")
        x[0] = 0.5 * context.get_discrete_state(0)[0] + self.get_input_port().Eval(context)[0]

    def update_all(self, context: Any, state: Any) -> None:
        self.hear("unrestricted")
        state.get_mutable_abstract_state(0).set_value(f"{context.get_time():.3f}")

    def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
        self.hear("derivatives")
        derivatives[0] = self.get_input_port().Eval(context)[0] - context.get_continuous_state_vector()[0]


def _robot(seed: int) -> Any:
    """A robot of two bodies, in steps or continuous; with geometry, and so with contact, in every third."""
    builder, period = DiagramBuilder(), (0.0, 1 / 256, 1 / 200)[seed % 3]
    plant = MultibodyPlant(period) if seed % 9 >= 3 else AddMultibodyPlantSceneGraph(builder, period)[0]
    Parser(plant).AddModelsFromString(ROBOT, "urdf")
    plant.Finalize()
    if plant.get_source_id() is None:
        return plant
    builder.ExportInput(plant.get_actuation_input_port(), "u")
    builder.ExportOutput(plant.get_state_output_port(), "x")
    return builder.Build()


class World:
    """A program's objects. What calls say is plain: numbers, texts, lists of these.

    Args:
        native: Whether its simulators step natively.
        path: Where it saves; there is nothing yet.
    """

    def __init__(self, native: bool, path: pathlib.Path) -> None:
        self.native, self.path = native, path
        path.unlink(missing_ok=True)
        self.builder, self.systems = DiagramBuilder(), []
        self.diagram: Any = None
        self.simulator: Any = None
        self.others: list[Any] = []
        self.hooks: list[list] = []
        self.heard: list[Any] = []
        self.deep = False
        self.until = -math.inf  # [s] where the run under way ends

    def call(self, name: str, *words: Any) -> Any:
        """What a call says: its result, or its error."""
        try:
            return getattr(self, name)(*words)
        except (RuntimeError, ValueError, TypeError, IndexError, KeyError, NotImplementedError) as error:
            assert str(error), f"{name}: a {type(error).__name__} without a word"
            said = _OPEN.sub("an input is not connected", _MADE_UP.sub("#", str(error)))
            return f"{type(error).__name__}: {said}"

    # ---- before there is a diagram

    def add(self, kind: int, seed: int) -> Any:
        g = np.random.default_rng(seed)
        kinds: list[Callable[[], Any]] = [
            lambda: random_diagrams.random_leaf(g),
            lambda: Listener(self.hear),
            lambda: pr.ConstantVectorSource(g.normal(size=2)),
            lambda: random_diagrams.random_diagram(g, int(seed % 4 == 0)),
            lambda: pr.Integrator(2),
            lambda: _robot(seed),
        ]
        self.systems.append(self.builder.AddSystem(kinds[kind % len(kinds)]()))
        return len(self.systems)

    def output_port(self, k: int, j: int) -> Any:
        """An output of a system that there is; one that there is not, where `j` is large."""
        system = self.systems[k % len(self.systems)]
        return system.get_output_port(j if j > 10 else j % max(1, system.num_output_ports()))

    def input_port(self, k: int, i: int) -> Any:
        system = self.systems[k % len(self.systems)]
        return system.get_input_port(i if i > 10 else i % max(1, system.num_input_ports()))

    def connect(self, source: int, output: int, target: int, i: int) -> Any:
        self.builder.Connect(self.output_port(source, output), self.input_port(target, i))
        return "connected"

    def export(self, target: int, i: int) -> Any:
        return int(self.builder.ExportInput(self.input_port(target, i), f"in{target}_{i}"))

    def log(self, source: int, output: int) -> Any:
        pr.LogVectorOutput(self.output_port(source, output), self.builder)
        return "logged"

    def finish(self, free: bool) -> Any:
        """Connects what is open, unless it is to be `free`, and builds."""
        if not free:
            source = {n: self.builder.AddSystem(pr.ConstantVectorSource(np.linspace(0.5, 1.0, n))) for n in (1, 2)}
            for system in self.systems:
                for i in range(system.num_input_ports()):
                    port = system.get_input_port(i)
                    is_vector = port.get_data_type() == PortDataType.kVectorValued
                    if is_vector and not self.builder.IsConnectedOrExported(port) and port.size() in source:
                        self.builder.Connect(source[port.size()].get_output_port(), port)
        self.diagram = self.builder.Build()
        return self.simulate()

    # ---- with one

    def simulate(self) -> Any:
        self._adopt(analysis.Simulator(self.diagram))
        return "a simulator"

    def _adopt(self, simulator: Any) -> None:
        self.simulator = simulator
        simulator._native = self.native
        integrator = simulator.get_mutable_integrator()
        integrator.set_requested_minimum_step_size(SHORTEST)
        integrator.set_throw_on_minimum_step_size_violation(False)
        simulator.set_monitor(lambda context: self.hear("monitor"))

    @property
    def context(self) -> Any:
        return self.simulator.get_mutable_context()

    def leaf(self, k: int) -> tuple[Any, Any]:
        system = self.systems[k % len(self.systems)]
        return system, system.GetMyMutableContextFromRoot(self.context)

    def advance(self, k: int, x: float) -> Any:
        return self.advance_to(k, self.context.get_time() + k / 1024)

    def advance_to(self, k: int, x: float) -> Any:
        if x - self.context.get_time() > LONGEST:
            return "would take too long"
        before, self.until = self.until, x
        try:
            self.simulator.AdvanceTo(x)
        finally:
            self.until = before
        return self.state()

    def initialise(self, k: int, x: float) -> Any:
        self.simulator.Initialize()
        return self.state()

    def pending(self, k: int, x: float) -> Any:
        self.simulator.AdvancePendingEvents()
        return self.state()

    def state(self) -> Any:
        context = self.context
        numbers = [context.get_time(), *context.get_continuous_state_vector().CopyToVector()]
        for n in range(context.num_discrete_state_groups()):
            numbers += context.get_discrete_state(n).value().tolist()
        return np.array(numbers).view(np.int64).tolist()

    def evaluate(self, k: int, x: float) -> Any:
        system, context = self.leaf(k)
        values = [system.get_output_port(j).Eval(context) for j in range(system.num_output_ports())]
        return [v.view(np.int64).tolist() if isinstance(v, np.ndarray) else type(v).__name__ for v in values]

    def derivatives(self, k: int, x: float) -> Any:
        return self.diagram.EvalTimeDerivatives(self.context).CopyToVector().view(np.int64).tolist()

    def updates(self, k: int, x: float) -> Any:
        found = self.diagram.EvalUniquePeriodicDiscreteUpdate(self.context)
        return [found.get_vector(i).value().tolist() for i in range(found.num_groups())]

    def set_time(self, k: int, x: float) -> Any:
        return self.context.SetTime(x)

    def set_continuous(self, k: int, x: float) -> Any:
        return self.context.SetContinuousState(np.full(self.context.num_continuous_states(), x))

    def set_discrete(self, k: int, x: float) -> Any:
        _, context = self.leaf(k)
        group = context.get_mutable_discrete_state(k % 3)
        group.SetFromVector(np.full(group.size(), x))
        return "set"

    def fix(self, k: int, x: float) -> Any:
        system, context = self.leaf(k)
        port = system.get_input_port(k % 2)
        port.FixValue(context, np.full(port.size() if k % 7 else 3, x))
        return "fixed"

    def clone(self, k: int, x: float) -> Any:
        self.others.append(self.context.Clone() if k % 2 else copy.deepcopy(self.context))
        return len(self.others)

    def take(self, k: int, x: float) -> Any:
        self.simulator.reset_context(
            self.others[k % len(self.others)] if self.others else self.diagram.CreateDefaultContext()
        )
        self.others.clear()
        return self.state()

    def copy_state(self, k: int, x: float) -> Any:
        other = self.others[k % len(self.others)] if self.others else self.diagram.CreateDefaultContext()
        return self.context.SetTimeStateAndParametersFrom(other)

    def save(self, k: int, x: float) -> Any:
        SaveContext(self.context, self.path)
        return "saved"

    def load(self, k: int, x: float) -> Any:
        if not self.path.exists():
            return "nothing"
        context = LoadContext(self.diagram, self.path)
        self._adopt(analysis.Simulator(self.diagram, context))
        return self.state()

    def convert(self, k: int, x: float) -> Any:
        system, mine = self.leaf(k)
        other = system.ToAutoDiffXd() if k % 2 else system.ToSymbolic()
        context = other.CreateDefaultContext()
        context.SetTimeStateAndParametersFrom(mine) if k % 3 else None
        return context.num_continuous_states()

    def read_logs(self, k: int, x: float) -> Any:
        logs = [s.FindLog(self.context) for s in self.diagram.GetSystems() if isinstance(s, pr.VectorLogSink)]
        return [(log.sample_times().view(np.int64).tolist(), log.data().view(np.int64).tolist()) for log in logs]

    def fill_logs(self, k: int, x: float) -> Any:
        for s in self.diagram.GetSystems():
            if isinstance(s, pr.VectorLogSink):
                log = s.FindMutableLog(self.context)
                if k % 3 == 0:
                    log.Clear()
                elif k % 3 == 1:
                    log.Reserve(100 * k)
                else:
                    [log.AddData(x, np.zeros(log.data().shape[0])) for _ in range(k)]
        return "filled"

    def publish(self, k: int, x: float) -> Any:
        self.diagram.ForcedPublish(self.context)
        return "published"

    def integrator(self, k: int, x: float) -> Any:
        analysis.ResetIntegratorFromFlags(self.simulator, SCHEMES[k % len(SCHEMES)], 1 / 512)
        self.simulator.get_mutable_integrator().set_fixed_step_mode(True)
        return SCHEMES[k % len(SCHEMES)]

    def caching(self, k: int, x: float) -> Any:
        call = (self.context.DisableCaching, self.context.EnableCaching, self.context.SetAllCacheEntriesOutOfDate)
        return call[k % 3]()

    def accuracy(self, k: int, x: float) -> Any:
        return self.context.SetAccuracy(x)

    def monitor(self, k: int, x: float) -> Any:
        if k % 2:
            return self.simulator.clear_monitor()
        return self.simulator.set_monitor(lambda context: self.hear("monitor"))

    def describe(self, k: int, x: float) -> Any:
        return len(str(self.context)) > 0 and len(self.diagram.GetGraphvizString()) > 0

    # ---- from callbacks

    def hook(self, place: str, name: str, k: int, x: float) -> Any:
        """The next callback of a kind makes a call, and keeps what it says; or lets its error out."""
        self.hooks.append([place, name, k, x])
        return len(self.hooks)

    def hear(self, place: str) -> None:
        """A callback."""
        if self.deep:
            return
        for hook in self.hooks:
            if hook[0] == place:
                self.hooks.remove(hook)
                self.deep = True
                try:
                    if hook[2] % 5 == 0:
                        self.heard.append(getattr(self, hook[1])(*hook[2:]))
                    else:
                        self.heard.append(self.call(*hook[1:]))
                finally:
                    self.deep = False
                if -FARTHEST < self.context.get_time() < self.until - LONGEST:
                    raise RuntimeError("a callback has set the time back: the run would take too long")
                return


CALLS_OF_A_WORLD = tuple(
    "advance advance advance advance_to initialise pending evaluate evaluate derivatives updates set_time "
    "set_continuous set_discrete fix fix clone take copy_state save load convert read_logs fill_logs publish "
    "integrator caching accuracy monitor describe simulate_again".split()
)


class Programs(RuleBasedStateMachine):
    """One program: some systems, some wires, then any calls."""

    def __init__(self) -> None:
        super().__init__()
        self.worlds = [World(True, _folder() / "native.npz"), World(False, _folder() / "interpreted.npz")]

    def both(self, *words: Any) -> Any:
        """Makes a call in both worlds, which say the same of it."""
        said = [world.call(*words) for world in self.worlds]
        heard = [world.heard for world in self.worlds]
        assert repr(said[0]) == repr(said[1]), f"{words}: native {said[0]!r}, interpreted {said[1]!r}"
        assert repr(heard[0]) == repr(heard[1]), f"{words}: native {heard[0]!r}, interpreted {heard[1]!r} in callbacks"
        return said[0]

    small = st.integers(0, 12)

    @initialize(
        kinds=st.lists(st.integers(0, 5), max_size=4),
        seed=st.integers(0, 2**32 - 1),
        wires=st.lists(st.tuples(small, small, small, small), max_size=6),
        logged=small,
        end=st.integers(0, 11),
    )
    def begin(self, kinds: list[int], seed: int, wires: list[tuple[int, ...]], logged: int, end: int) -> None:
        """Mostly a diagram with a wire here and there, and a simulator; some are built call by call."""
        for n, kind in enumerate([1, *kinds]):
            self.both("add", kind, seed + n)
        for source, output, sink, i in wires if kinds else ():
            sink = 1 + sink % len(kinds)  # behind its source: what feeds itself cannot be built
            self.both("connect", source % sink, output, sink, i)
        if end < 10:
            self.both("log", logged, seed % 13)
            self.both("finish", seed % 8 == 3)

    @precondition(lambda self: self.worlds[0].diagram is None)
    @rule(source=small, output=small, sink=small, i=small)
    def connect(self, source: int, output: int, sink: int, i: int) -> None:
        self.both("connect", source, output, sink, i)

    @precondition(lambda self: self.worlds[0].diagram is None)
    @rule(source=small, output=small, export=st.booleans())
    def log(self, source: int, output: int, export: bool) -> None:
        self.both("export" if export else "log", source, output)

    @precondition(lambda self: self.worlds[0].diagram is None)
    @rule(free=st.integers(0, 9))
    def finish(self, free: int) -> None:
        self.both("finish", free == 0)

    @precondition(lambda self: self.worlds[0].simulator is not None)
    @rule(name=st.sampled_from(CALLS_OF_A_WORLD), k=small, x=st.sampled_from(NUMBERS))
    def any_call(self, name: str, k: int, x: float) -> None:
        self.both(*(("simulate",) if name == "simulate_again" else (name, k, x)))

    @precondition(lambda self: self.worlds[0].simulator is not None)
    @rule(
        name=st.sampled_from(CALLS_OF_A_WORLD[:-1]), place=st.sampled_from(PLACES), k=small, x=st.sampled_from(NUMBERS)
    )
    def hook(self, place: str, name: str, k: int, x: float) -> None:
        self.both("hook", place, name, k, x)
        self.both("advance", k, 0.0)


@functools.cache
def _folder() -> pathlib.Path:
    return pathlib.Path(tempfile.mkdtemp(prefix="torture-"))


def some_programs(chance: random.Random, number: int) -> None:
    """A batch of programs; hypothesis makes the first that goes wrong as short as it can."""
    machine = hypothesis.seed(chance.getrandbits(64))(type("Batch", (Programs,), {}))
    run_state_machine_as_test(
        machine,
        settings=hypothesis.settings(
            max_examples=PROGRAMS,
            stateful_step_count=CALLS,
            deadline=None,
            database=None,
            suppress_health_check=list(hypothesis.HealthCheck),
            phases=[hypothesis.Phase.generate, hypothesis.Phase.shrink],
        ),
    )
