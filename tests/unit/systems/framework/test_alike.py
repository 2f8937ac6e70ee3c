"""Diagrams that declare alike share where everything is, and nothing else."""

import gc
import types
import weakref

import numpy as np
import pytest

from sheldrake.common._native.binding import HERE, Relocation, Words
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import RevoluteJoint, SpatialInertia, UnitInertia
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import BasicVector, DiagramBuilder, LeafSystem
from sheldrake.systems.framework._engine import alike
from sheldrake.systems.primitives import ConstantVectorSource, Gain, Integrator, LogVectorOutput


class Scaled(LeafSystem):
    """What it is given times a number that its function knows, every so often."""

    def __init__(self, factor, period=0.1, size=1):
        super().__init__()
        self.DeclareVectorInputPort("u", size)
        self.DeclareStateOutputPort("x", self.DeclareDiscreteState(np.full(size, factor)))
        self.DeclareVectorOutputPort("y", size, self.calc)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self.update)
        self.factor = factor

    def calc(self, context, y):
        y.SetFromVector(self.factor * self.EvalVectorInput(context, 0).get_value())

    def update(self, context, x):
        x.set_value(self.factor + context.get_discrete_state(0).get_value())


def layout_of(diagram):
    return diagram.CreateDefaultContext()._store.layout


def diagram(gain=2.0, factor=3.0, rate=1.0, **options):
    builder = DiagramBuilder()
    source, block = builder.AddSystem(ConstantVectorSource([rate])), builder.AddSystem(Gain(gain, 1))
    integrator, scaled = builder.AddSystem(Integrator(1)), builder.AddSystem(Scaled(factor, **options))
    builder.Cascade(source, block)
    builder.Cascade(block, integrator)
    builder.Connect(integrator.get_output_port(), scaled.get_input_port())
    sink = LogVectorOutput(scaled.GetOutputPort("y"), builder, 0.25)
    return builder.Build(), scaled, sink


def test_each_has_its_own_numbers_and_functions():
    known = set()
    for gain, factor, rate in [(2.0, 3.0, 1.0), (-1.0, 0.5, 4.0), (2.0, -7.0, 0.25)]:
        system, scaled, sink = diagram(gain, factor, rate)
        simulator = Simulator(system)
        simulator.AdvanceTo(0.5)
        context = scaled.GetMyContextFromRoot(simulator.get_context())
        known.add(id(simulator.get_context()._store.layout.made))
        assert scaled.GetOutputPort("y").Eval(context) == pytest.approx([factor * gain * rate * 0.5], rel=1e-12)
        assert context.get_discrete_state(0).value() == pytest.approx([factor * 6], rel=1e-12)  # at 0, 0.1, ... 0.4
        expected = factor * gain * rate * np.array([0.0, 0.25, 0.5])
        assert sink.FindLog(simulator.get_context()).data()[0] == pytest.approx(expected, rel=1e-12)
    assert len(known) == 1


def test_another_declaration_is_another_layout():
    one, (slower, _, _), (larger, scaled, _) = diagram()[0], diagram(period=0.2), diagram()
    scaled.DeclareNumericParameter(BasicVector([1.0]))
    assert layout_of(one).made is layout_of(diagram()[0]).made
    assert layout_of(one).made is not layout_of(slower).made
    assert layout_of(one).made is not layout_of(larger).made


def test_scratch_and_arrays_of_other_shapes_are_other_words():
    for n in (1, 2, 1):
        builder = DiagramBuilder()
        gain = builder.AddSystem(Gain(np.arange(1.0, n + 1.0)))
        integrator = builder.AddSystem(Integrator(n))
        builder.Connect(gain.get_output_port(), integrator.get_input_port())
        builder.Connect(integrator.get_output_port(), gain.get_input_port())
        simulator = Simulator(builder.Build())
        simulator.get_mutable_context().SetContinuousState(np.ones(n))
        simulator.AdvanceTo(0.1)
        x = simulator.get_context().get_continuous_state_vector().CopyToVector()
        assert x == pytest.approx(np.exp(0.1 * np.arange(1.0, n + 1.0)), rel=1e-4)  # RK3's accuracy


def pendulum(length):
    plant = MultibodyPlant(0.001)
    body = plant.AddRigidBody("rod", SpatialInertia(1.0, [0.0, 0.0, length], UnitInertia(1.0, 1.0, 0.1)))
    plant.AddJoint(RevoluteJoint("pin", plant.world_frame(), body.body_frame(), [0.0, 1.0, 0.0]))
    plant.Finalize()
    return plant


def bits(length):
    plant = pendulum(length)
    simulator = Simulator(plant)
    plant.SetPositions(simulator.get_mutable_context(), [0.3])
    simulator.AdvanceTo(0.05)
    return plant.GetPositionsAndVelocities(simulator.get_context()).tobytes()


def test_steps_have_the_bits_of_a_plant_that_is_the_first_of_its_kind():
    lengths, first = (0.5, 0.7), []
    for length in lengths:
        alike._families.clear()
        first.append(bits(length))
    assert [bits(length) for length in (*lengths, *lengths)] == [*first, *first]
    assert first[0] != first[1]


def test_addresses_are_those_of_each_array_where_one_stands_in_two_places():
    templates = alike.Templates()

    def placed(*arrays, **numbers):
        models = {"first_model": arrays[:2], "second_model": [arrays[2], *numbers.values()]}
        relocations = tuple(Relocation(k, array, k != 1) for k, array in enumerate(arrays))
        row = types.SimpleNamespace(models=models)
        words, _ = templates.placed([row, row], lambda: (Words(np.zeros(4, np.int64), relocations), [0, 3]))
        assert words.tolist() == [HERE.place(arrays[0]), HERE.place(arrays[1]) >> 3, HERE.place(arrays[2]), 0]

    a, b, c = (np.zeros(3) for _ in range(3))
    for arrays in ((a, b, c), (a, a, b), (b, a, a), (c, b, c), (b, c, a), (a, a, a), (a, b, a)):
        placed(*arrays)
        placed(*arrays, x=0.5)
    assert len(templates._known) == 10  # five ways, with a number and without
    for other in (np.zeros(2), np.zeros(3, np.int64), np.zeros(6)[::2], np.zeros(25, np.int8)[1:].view(float)):
        placed(a, b, other)
    assert len(templates._known) == 14


def test_of_models_a_few_small_tables_are_kept_that_nobody_writes():
    def look_at(size, writeable=False):
        array = np.zeros(size)
        array.flags.writeable = writeable
        alike._look_at((array,))
        return weakref.ref(array)

    small = [look_at(3) for _ in range(100)]
    assert small[-1]() is not None
    assert sum(one() is not None for one in small) == len(alike._seen) == 64
    assert look_at(1 << 14)() is None
    assert look_at(3, True)() is None


def test_what_is_kept_holds_no_system():
    builder = DiagramBuilder()
    systems = [builder.AddSystem(Scaled(1.0, size=3)), builder.AddSystem(pendulum(0.3))]
    built = builder.Build()
    layout_of(built)
    alive = [weakref.ref(thing) for thing in (*systems, built)]
    del builder, systems, built
    gc.collect()
    assert not any(ref() for ref in alive)
