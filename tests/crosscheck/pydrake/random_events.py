"""Diagrams of chance whose systems have events of all kinds, and what happens in them, in order."""

from __future__ import annotations

import importlib
import re
from typing import Any

import numpy as np

KINDS = ["Publish", "DiscreteUpdate", "UnrestrictedUpdate"]
TRIGGERS = ["Periodic", "PerStep", "Initialization", "Forced"]
PERIODS = [0.0625, 0.125, 0.1875, 0.1, 0.25]
OFFSETS = [0.0, 0.0, 0.125, 0.0625, 0.1]


def make_leaf_class(m: Any) -> type:
    """A system of a library that notes each of its events, and whose updates give other numbers in another order."""

    witness_of_failure = m.Adder(1, 1)  # in AdvanceTo, pydrake crashes where it has to name a class of Python
    witness_of_failure.set_name("failure")

    class Noisy(m.LeafSystem):
        def __init__(self, name: str, told: list, rng: np.random.Generator, ends: float):
            super().__init__()
            self.set_name(name)
            self.told, self.calls, self.witnesses = told, 0, []
            self.DeclareDiscreteState(1)
            self.DeclareAbstractState(m.Value(0))
            if rng.random() < 0.5:
                self.DeclareContinuousState(1)
                self.DeclareVectorOutputPort("y", 1, lambda context, y: y.SetFromVector(self.all_of(context)[:1]))
            for k in range(rng.integers(1, 5)):
                self.declare(m, rng, k, ends)

        def declare(self, m: Any, rng: np.random.Generator, k: int, ends: float) -> None:
            kind, which = KINDS[rng.integers(3)], rng.random()
            answer = ["none", "none", "did nothing", "succeeded"][rng.integers(4)]
            if rng.random() < ends:
                answer = ["terminates", "fails", "raises"][rng.integers(3)]
            handle = self.handler(m, kind, f"{k} {kind}", answer, int(rng.integers(0, 8)), bool(rng.random() < 0.1))
            if which < 0.15 and kind != "DiscreteUpdate":  # pydrake makes no such events
                self.add_witness(m, rng, k, kind, handle)
            elif which < 0.55:
                period, offset = PERIODS[rng.integers(5)], OFFSETS[rng.integers(5)]
                getattr(self, f"DeclarePeriodic{kind}Event")(period, offset, handle)
            else:
                trigger = TRIGGERS[rng.integers(1, 4)]
                getattr(self, f"Declare{trigger}{kind}Event")(handle)

        def add_witness(self, m: Any, rng: np.random.Generator, k: int, kind: str, handle: Any) -> None:
            at, direction = rng.integers(1, 8) / 16 + 0.01, list(m.WitnessFunctionDirection.__members__.values())
            event = getattr(m, f"{kind}Event")(callback=lambda context, event, *target: handle(context, *target))
            where = direction[rng.integers(1, 4)]
            self.witnesses.append(
                self.MakeWitnessFunction(f"w{k}", where, lambda context: context.get_time() - at, event)
            )

        def DoGetWitnessFunctions(self, context: Any) -> list:
            return self.witnesses

        def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
            if self.num_continuous_states():
                derivatives.get_mutable_vector().SetFromVector([1.0])

        def all_of(self, context: Any) -> list[float]:
            xc, xd = context.get_continuous_state_vector().CopyToVector(), context.get_discrete_state_vector().value()
            return [round(float(x), 7) for x in (*xd, *xc, context.get_abstract_state(0).get_value())]

        def handler(self, m: Any, kind: str, label: str, answer: str, spared: int, meddles: bool) -> Any:
            statuses = {
                "none": lambda: None,
                "did nothing": m.EventStatus.DidNothing,
                "succeeded": m.EventStatus.Succeeded,
                "terminates": lambda: m.EventStatus.ReachedTermination(self, label),
                "fails": lambda: m.EventStatus.Failed(witness_of_failure, label),
            }
            factor = 1.0 + len(label) + sum(map(ord, label)) % 7

            def handle(context: Any, *target: Any) -> Any:
                self.told.append((self.get_name(), label, round(context.get_time(), 7), *self.all_of(context)))
                self.calls += 1
                for state in target:
                    values = state if kind == "DiscreteUpdate" else state.get_mutable_discrete_state()
                    vector = values.get_mutable_vector()
                    vector.SetAtIndex(0, (3 * vector.GetAtIndex(0) + factor) % 101)
                    if kind == "UnrestrictedUpdate":
                        value = state.get_mutable_abstract_state().get_mutable_value(0)
                        value.set_value((2 * value.get_value() + int(factor)) % 97)
                if meddles:  # whatever acts after it must see this
                    context.SetDiscreteState([(context.get_discrete_state_vector().GetAtIndex(0) + 7) % 89])
                ends = answer in ("terminates", "fails", "raises")
                if ends and self.calls <= spared:
                    return None
                if answer == "raises":
                    raise ValueError(f"{self.get_name()} {label}")
                return statuses[answer]()

            return handle

    return Noisy


def make_diagram(m: Any, rng: np.random.Generator, told: list, ends: float) -> Any:
    """Some of the systems, of which some are in diagrams within the diagram."""
    leaf, made = make_leaf_class(m), []

    def fill(builder: Any, depth: int) -> None:
        for _ in range(rng.integers(1, 4)):
            if depth < 2 and rng.random() < 0.3:
                inner = m.DiagramBuilder()
                fill(inner, depth + 1)
                builder.AddSystem(inner.Build())
            else:
                made.append(builder.AddSystem(leaf(f"s{len(made)}", told, rng, ends)))
                if made[-1].num_output_ports() and rng.random() < 0.3:
                    port = made[-1].get_output_port(0)
                    made.append(builder.AddSystem(m.ZeroOrderHold(PERIODS[rng.integers(5)], 1)))
                    builder.Connect(port, made[-1].get_input_port())
                if made[-1].num_output_ports() and rng.random() < 0.5:
                    log = m.LogVectorOutput(made[-1].get_output_port(0), builder, [0.125, 0.0][rng.integers(2)])
                    made.append(log)

    builder = m.DiagramBuilder()
    fill(builder, 0)
    return builder.Build(), made


def run(library: str, seed: int, ends: float) -> list:
    """What happens in a diagram of chance, and what calls of its simulator return."""
    m, rng, told = importlib.import_module(f"{library}.all"), np.random.default_rng(seed), []
    diagram, made = make_diagram(m, rng, told, ends)
    simulator = m.Simulator(diagram)
    context = simulator.get_mutable_context()
    if rng.random() < 0.7:
        m.ResetIntegratorFromFlags(simulator, ["explicit_euler", "runge_kutta2"][rng.integers(2)], 0.0625)
        if rng.random() < 0.5:
            context.SetAccuracy(0.01)
    else:
        context.SetAccuracy(0.01)
        m.ResetIntegratorFromFlags(simulator, "runge_kutta3", 0.125)
    context.SetTime([0.0, 0.0, 0.125, 0.3][rng.integers(4)])
    simulator.set_publish_every_time_step(bool(rng.random() < 0.2))
    simulator.set_publish_at_initialization(bool(rng.random() < 0.2))
    if rng.random() < 0.3:
        simulator.set_monitor(lambda context: told.append(("monitor", round(context.get_time(), 7))))
    t0 = context.get_time()
    calls: list[tuple] = [(simulator.Initialize,)] if rng.random() < 0.5 else []
    for t in sorted(t0 + rng.integers(0, 12, rng.integers(1, 4)) / 16):
        calls.append((simulator.AdvanceTo, t))
        if rng.random() < 0.3:
            calls.append((simulator.AdvancePendingEvents,))
        if rng.random() < 0.2:
            calls.append((diagram.ForcedPublish, context))
    for call, *arguments in calls:
        told.append(call.__name__)
        try:
            status = call(*arguments)
        except Exception as e:  # both libraries must fail in the same way
            told.append((type(e).__name__, re.sub(r"\S*Adder\S*", "Adder", str(e))))
            break
        if status is not None:
            told.append((status.reason().name, status.message(), status.system() and status.system().get_name()))
        what = ("publishes", "discrete_updates", "unrestricted_updates")
        counts = [getattr(simulator, f"get_num_{x}")() for x in what]
        told.append((round(context.get_time(), 7), simulator.get_num_steps_taken(), *counts))
        if status is not None and not status.succeeded() and not simulator.get_num_steps_taken():
            break  # where initialization has ended a run, pydrake forgets what happens in every step
    for system in made:
        if isinstance(system, m.VectorLogSink):
            log = system.FindLog(context)
            told.append((log.sample_times().round(7).tolist(), log.data().tolist()))
        elif not isinstance(system, m.ZeroOrderHold):
            told.append(system.all_of(system.GetMyContextFromRoot(context)))
    return told
