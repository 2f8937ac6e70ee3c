"""Diagrams of chance whose outputs name what they are computed from; contexts of theirs are written and asked."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any

import numpy as np

VECTOR = 0
Source = tuple[Any, Callable[[Any], float]]
"""A ticket, and a number that is there."""


def total_of(vector: Any) -> float:
    """The sum of a vector's numbers."""
    return float(vector.CopyToVector().sum())


def make_leaf_class(m: Any, rng: np.random.Generator) -> type:
    """A system with state, parameters and inputs of chance, and outputs and a cache entry of some of them."""

    class Leaf(m.LeafSystem):
        def __init__(self, name: str):
            super().__init__()
            self.set_name(name)
            self.inputs = [int(rng.random() < 0.25) for _ in range(rng.integers(0, 3))]  # kinds: vector or abstract
            for i, kind in enumerate(self.inputs):
                if kind == VECTOR:
                    self.DeclareVectorInputPort(f"u{i}", 2)
                else:
                    self.DeclareAbstractInputPort(f"u{i}", m.Value(0.0))
            sources = [*self.make_state(), *self.make_parameters(), *self.sources_of_inputs()]
            if rng.random() < 0.5:
                sources.append(self.make_cache_entry(sources))
            self.outputs = [self.make_output(j, sources) for j in range(rng.integers(1, 3))]  # kinds

        def make_state(self) -> list[Source]:
            found: list[Source] = [
                (self.time_ticket(), lambda c: c.get_time()),
                (self.accuracy_ticket(), lambda c: c.get_accuracy() or 0.0),
            ]
            self.num_groups, self.is_continuous = int(rng.integers(0, 3)), rng.random() < 0.5
            self.has_abstract = rng.random() < 0.4
            for i in range(self.num_groups):
                self.DeclareDiscreteState([1.0 + i, 2.0])
                ticket = self.discrete_state_ticket(m.DiscreteStateIndex(i))
                found.append((ticket, lambda c, i=i: c.get_discrete_state(i).value().sum()))
            if self.is_continuous:
                self.DeclareContinuousState(*[(2,), (1, 1, 1)][rng.integers(2)])
                found += [
                    (self.xc_ticket(), lambda c: c.get_continuous_state_vector().CopyToVector().sum()),
                    (
                        self.q_ticket(),
                        lambda c: c.get_continuous_state().get_generalized_position().CopyToVector().sum(),
                    ),
                    (
                        self.v_ticket(),
                        lambda c: c.get_continuous_state().get_generalized_velocity().CopyToVector().sum(),
                    ),
                ]
            if self.has_abstract:
                self.DeclareAbstractState(m.Value(5.0))
                ticket = self.abstract_state_ticket(m.AbstractStateIndex(0))
                found.append((ticket, lambda c: c.get_abstract_state(0).get_value()))
            return found

        def make_parameters(self) -> list[Source]:
            self.num_parameters, found = int(rng.integers(0, 3)), []
            self.has_abstract_parameter = rng.random() < 0.3
            for i in range(self.num_parameters):
                self.DeclareNumericParameter(m.BasicVector([3.0 + i]))
                ticket = self.numeric_parameter_ticket(m.NumericParameterIndex(i))
                found.append((ticket, lambda c, i=i: c.get_numeric_parameter(i).value()[0]))
            if self.has_abstract_parameter:
                self.DeclareAbstractParameter(m.Value(7.0))
                ticket = self.abstract_parameter_ticket(m.AbstractParameterIndex(0))
                found.append((ticket, lambda c: c.get_abstract_parameter(0).get_value()))
            return found

        def sources_of_inputs(self) -> list[Source]:
            def read(i: int, context: Any) -> float:
                port = self.get_input_port(i)
                return float(np.sum(port.Eval(context))) if port.HasValue(context) else -1.0

            tickets = [self.input_port_ticket(m.InputPortIndex(i)) for i in range(len(self.inputs))]
            return [(ticket, lambda c, i=i: read(i, c)) for i, ticket in enumerate(tickets)]

        def some_of(self, sources: list[Source]) -> tuple[set, Callable[[Any], float]]:
            some = [s for s in sources if rng.random() < 0.5]
            tickets = {ticket for ticket, _ in some} or {self.nothing_ticket()}
            return tickets, lambda c: float(sum((k + 1) * read(c) for k, (_, read) in enumerate(some)))

        def make_cache_entry(self, sources: list[Source]) -> Source:
            tickets, total = self.some_of(sources)
            producer = m.ValueProducer(m.Value(0.0).Clone, lambda c, out: out.set_value(total(c)))
            entry = self.DeclareCacheEntry("entry", producer, tickets)
            return entry.ticket(), entry.Eval

        def make_output(self, j: int, sources: list[Source]) -> int:
            tickets, total = self.some_of(sources)
            named = (tickets,) if rng.random() < 0.8 else ()
            if rng.random() < 0.7:
                vector = lambda c, out: out.SetFromVector([total(c), 2.0])  # noqa: E731
                port, kind = self.DeclareVectorOutputPort(f"y{j}", 2, vector, *named), VECTOR
            else:
                number = lambda c, out: out.set_value(total(c))  # noqa: E731
                port, kind = self.DeclareAbstractOutputPort(f"y{j}", m.Value(0.0).Clone, number, *named), 1
            if rng.random() < 0.1:
                port.disable_caching_by_default()
            return kind

    return Leaf


def make_diagram(m: Any, rng: np.random.Generator) -> tuple[Any, list]:
    """Some of the systems, of which some feed others."""
    leaf, builder, systems, sources = make_leaf_class(m, rng), m.DiagramBuilder(), [], []
    for k in range(rng.integers(1, 6)):
        system = builder.AddSystem(leaf(f"s{k}"))
        systems.append(system)
        for i, kind in enumerate(system.inputs):
            fit, chance = [port for port, its in sources if its == kind], rng.random()
            if fit and chance < 0.6:
                builder.Connect(fit[rng.integers(len(fit))], system.get_input_port(i))
            elif chance < 0.8:
                builder.ExportInput(system.get_input_port(i))
        sources += [(system.get_output_port(j), kind) for j, kind in enumerate(system.outputs)]
    return builder.Build(), systems


def run(library: str, seed: int) -> list:
    """What outputs have for values between writes to contexts and copies of these."""
    m, rng = importlib.import_module(f"{library}.all"), np.random.default_rng(seed)
    diagram, systems = make_diagram(m, rng)
    contexts, told = [diagram.CreateDefaultContext()], []
    for _ in range(60):
        context, system = contexts[rng.integers(len(contexts))], systems[rng.integers(len(systems))]
        other, own = contexts[rng.integers(len(contexts))], system.GetMyContextFromRoot(context)
        x, what = float(rng.integers(0, 9)), rng.integers(0, 20)
        if what == 0:
            context.SetTime(x)
        elif what == 1:
            context.SetAccuracy(x + 1.0)
        elif what == 2 and system.num_groups:
            own.SetDiscreteState(int(rng.integers(system.num_groups)), [x, 1.0])
        elif what == 3 and system.num_groups:
            own.get_mutable_discrete_state(int(rng.integers(system.num_groups))).SetAtIndex(0, x)
        elif what == 4 and system.is_continuous:
            own.SetContinuousState([x] * own.num_continuous_states())
        elif what == 5 and system.is_continuous:
            own.get_mutable_continuous_state_vector().SetAtIndex(0, x)
        elif what == 6 and system.num_parameters:
            own.get_mutable_numeric_parameter(0).SetFromVector([x])
        elif what == 7 and system.has_abstract:
            own.SetAbstractState(0, x)
        elif what == 8 and system.has_abstract:
            own.get_mutable_abstract_state(0).set_value(x)
        elif what == 9 and system.has_abstract_parameter:
            own.get_mutable_abstract_parameter(0).set_value(x)
        elif what == 10 and system.inputs:
            i = int(rng.integers(len(system.inputs)))
            system.get_input_port(i).FixValue(own, [x, x] if system.inputs[i] == VECTOR else m.Value(x))
        elif what == 11 and diagram.num_input_ports():
            port = diagram.get_input_port(int(rng.integers(diagram.num_input_ports())))
            port.FixValue(context, [x, x] if int(port.get_data_type()) == VECTOR else m.Value(x))
        elif what == 12 and len(contexts) < 4:
            contexts.append(context.Clone())
        elif what == 13:
            context.SetTimeStateAndParametersFrom(other)
        elif what == 14:
            own.SetStateAndParametersFrom(system.GetMyContextFromRoot(other))
        elif what == 15:
            context.SetTimeAndContinuousState(x, [x] * context.num_continuous_states())
        elif what == 16 and x < 3:
            (context.DisableCaching if x < 2 else context.EnableCaching)()
        else:
            port = system.get_output_port(int(rng.integers(len(system.outputs))))
            told.append((context.get_accuracy(), np.asarray(port.Eval(own)).tolist()))
    return told
