"""Worlds of a batch are what they would be alone, bit by bit, whatever their number, their order and the threads."""

import gc
import os
import pathlib
import resource
import signal
import sys
import threading
import weakref

import numpy as np
import pytest
from tests.scenes.scene import drop, library

import sheldrake
from sheldrake.common import Parallelism, RandomDistribution, RandomGenerator
from sheldrake.common.kernel import jit_enabled
from sheldrake.examples import PendulumPlant
from sheldrake.systems.analysis import (
    ApplySimulatorConfig,
    BatchSimulator,
    MonteCarloSimulation,
    Simulator,
    SimulatorConfig,
    WorldsFailed,
)
from sheldrake.systems.framework import DiagramBuilder, EventStatus, LeafSystem
from sheldrake.systems.primitives import Gain, Integrator, LinearSystem, LogVectorOutput, RandomSource

threads = pytest.mark.parametrize("num_threads", [1, 2, 3, 8])
compiled = pytest.mark.skipif(
    not jit_enabled(), reason="takes minutes as Python; smaller scenes run without a compiler"
)
NUM_WORLDS = 12


def block():
    """The falling block with its log: diagram, plant, log."""
    urdf = sheldrake.model_path("two_hole_block/two_hole_block.urdf")
    simulator, log, plant, _ = drop(library("sheldrake"), urdf, height=0.02)
    return simulator.get_system(), plant, log


class Halver(LeafSystem):
    """x+ = x / 2 + u each 0.1 s in Python, and y = x."""

    def __init__(self):
        super().__init__()
        self.DeclareVectorInputPort("u", 1)
        state = self.DeclareDiscreteState(1)
        self.DeclareStateOutputPort("x", state)
        self.DeclarePeriodicDiscreteUpdateEvent(0.1, 0.0, self.halve)

    def halve(self, context, state):
        x = context.get_discrete_state_vector()[0]
        if x > 1e3:
            raise ArithmeticError(f"{x} is too large")
        state.set_value([0.5 * x + self.get_input_port().Eval(context)[0]])


def halvers():
    """A diagram with a Python system between kernels: diagram, Halver, log."""
    builder = DiagramBuilder()
    halver = builder.AddSystem(Halver())
    gain = builder.AddSystem(Gain(2.0, 1))
    builder.Connect(halver.get_output_port(), gain.get_input_port())
    log = LogVectorOutput(gain.get_output_port(), builder, 0.1)
    builder.ExportInput(halver.get_input_port(), "u")
    builder.ExportOutput(gain.get_output_port(), "y")
    return builder.Build(), halver, log


def alone(diagram, x0, T, log=None):
    """Memory, and a log, after each of these states (of the whole diagram) went on alone."""
    slabs, samples = [], []
    for x in x0:
        context = diagram.CreateDefaultContext()
        context._store.S[1 : 1 + len(x)] = x
        context._store.out_of_date()
        Simulator(diagram, context).AdvanceTo(T)
        slabs.append(context._store.S.copy())
        if log is not None:
            samples.append(log.FindLog(context).data().copy())
    return np.array(slabs), samples


def heights(batch):
    """States that differ from world to world."""
    x = np.tile(batch.states()[0], (batch.num_worlds(), 1))
    x[:, 6] += 0.01 * np.arange(batch.num_worlds())
    x[:, 10] = 0.1 * np.arange(batch.num_worlds())
    return x


@compiled
@threads
def test_worlds_of_kernels_have_the_bits_they_have_alone(num_threads):
    diagram, _, log = block()
    batch = BatchSimulator(diagram, NUM_WORLDS, num_threads=num_threads)
    x0 = heights(batch)
    slabs, samples = alone(diagram, x0, 0.4, log)
    batch.states()[:] = x0
    batch.AdvanceTo(0.1)
    batch.AdvanceTo(0.4)
    for w in range(NUM_WORLDS):
        assert batch.context(w)._store.S.tobytes() == slabs[w].tobytes()
        np.testing.assert_array_equal(log.FindLog(batch.context(w)).data(), samples[w])
    assert samples[0].shape[1] > 256  # so that logs had to grow


def test_a_world_that_begins_anew_steps_as_the_first_time():
    batch, ends = BatchSimulator(LinearSystem(A=[[0.0, 1.0], [-9.0, 0.0]]), 2), []
    for _ in range(2):
        batch.SetTime(0.0)
        batch.states()[:] = [1.0, 0.0]
        batch.AdvanceTo(0.5)
        ends.append(batch.states().copy())
    np.testing.assert_array_equal(*ends)


@threads
def test_python_systems_take_part(num_threads):
    diagram, halver, log = halvers()
    batch = BatchSimulator(diagram, NUM_WORLDS, num_threads=num_threads)
    assert not batch.is_native() and "halver" in batch.Explain().lower() and "Python" in batch.Explain()
    batch.states(halver)[:, 0] = np.arange(NUM_WORLDS)
    batch.inputs(diagram.get_input_port())[:, 0] = 1.0
    batch.AdvanceTo(0.45)
    expected = np.arange(NUM_WORLDS)
    for _ in range(5):
        expected = 0.5 * expected + 1.0
    np.testing.assert_array_equal(batch.states(halver)[:, 0], expected)
    np.testing.assert_array_equal(batch.EvalOutputs(diagram.get_output_port())[:, 0], 2.0 * expected)
    assert log.FindLog(batch.context(3)).num_samples() == 5


@threads
def test_continuous_worlds_have_step_sizes_of_their_own(num_threads):
    pendulum = PendulumPlant()
    config = SimulatorConfig(accuracy=1e-6)
    batch = BatchSimulator(pendulum, NUM_WORLDS, config=config, num_threads=num_threads)
    batch.inputs(pendulum.get_input_port())[:] = 0.0
    x0 = np.column_stack([np.linspace(0.0, 3.0, NUM_WORLDS), np.zeros(NUM_WORLDS)])
    batch.states()[:] = x0
    batch.AdvanceTo(2.0)
    for w in range(NUM_WORLDS):
        simulator = Simulator(pendulum)
        ApplySimulatorConfig(config, simulator)
        context = simulator.get_mutable_context()
        pendulum.get_input_port().FixValue(context, [0.0])
        context.SetContinuousState(x0[w])
        simulator.AdvanceTo(2.0)
        assert batch.states()[w].tobytes() == context.get_continuous_state_vector().CopyToVector().tobytes()


@compiled
def test_the_memory_that_steps_write_is_asked_for():
    diagram, plant, _ = block()
    batch = BatchSimulator(diagram, 3, num_threads=1)
    used = batch._worlds.tables.used
    assert used[0] == 0
    for height in (1.0, 0.0):  # in the air, then in contact
        batch.states(plant)[:, 6] = height
        for _ in range(2):
            batch.AdvanceSteps(2)
        before = set(used[1 : 1 + used[0]])
    assert all(number // 8 * 8 in before for number in np.flatnonzero(batch._worlds.slab[0]))
    assert len(before) * 8 < 0.2 * batch._worlds.slab.shape[1]


@compiled
def test_states_parameters_and_times_are_the_worlds_memory():
    diagram, plant, _ = block()
    batch = BatchSimulator(diagram, 5)
    context = plant.GetMyContextFromRoot(batch.context(3))
    body = plant.GetBodyByName("body")
    batch.states(plant)[3, 6] = 1.25
    context = plant.GetMyContextFromRoot(batch.context(3))
    assert plant.EvalBodyPoseInWorld(context, body).translation()[2] == 1.25
    body.SetMass(context, 7.0)
    changed = np.argwhere(np.nan_to_num(batch.parameters(plant)) != np.nan_to_num(batch.parameters(plant)[0]))
    assert len(changed) == 1 and batch.parameters(plant)[tuple(changed[0])] == 7.0
    batch.parameters(plant)[:, changed[0][1]] = [1.0, 2.0, 3.0, 4.0, 5.0]
    for w in range(5):
        assert body.get_mass(plant.GetMyContextFromRoot(batch.context(w))) == w + 1.0
    assert not batch.times.flags.writeable


@compiled
def test_masses_of_worlds_count():
    """Per-world parameters give what the same parameter gives alone."""
    diagram, plant, _ = block()
    batch = BatchSimulator(diagram, 3, num_threads=2)
    body, masses = plant.GetBodyByName("body"), [0.5, 1.0, 3.0]
    for w, mass in enumerate(masses):
        body.SetMass(plant.GetMyContextFromRoot(batch.context(w)), mass)
    batch.AdvanceTo(0.2)
    for w, mass in enumerate(masses):
        simulator = Simulator(diagram)
        context = plant.GetMyContextFromRoot(simulator.get_mutable_context())
        body.SetMass(context, mass)
        simulator.AdvanceTo(0.2)
        assert batch.states(plant)[w].tobytes() == plant.GetPositionsAndVelocities(context).tobytes()
    assert len(np.unique(batch.states(plant), axis=0)) == 3


@compiled
def test_a_subset_advances_and_a_mask_sets_back():
    diagram, _, log = block()
    batch = BatchSimulator(diagram, 6, num_threads=2)
    first = batch.states().copy()
    batch.AdvanceTo(0.1, worlds=[1, 4])
    np.testing.assert_array_equal(batch.times, [0, 0.1, 0, 0, 0.1, 0])
    np.testing.assert_array_equal(batch.states()[[0, 2, 3, 5]], first[[0, 2, 3, 5]])
    batch.AdvanceTo([0.2, 0.3, 0.4, 0.5, 0.6, 0.7])
    np.testing.assert_array_equal(batch.times, [0.2, 0.3, 0.4, 0.5, 0.6, 0.7])
    batch.Reset(batch.times > 0.45)
    np.testing.assert_array_equal(batch.times, [0.2, 0.3, 0.4, 0, 0, 0])
    np.testing.assert_array_equal(batch.states()[3:], first[3:])
    assert [log.FindLog(batch.context(w)).num_samples() for w in (2, 3)] == [401, 0]
    batch.AdvanceTo(0.4, worlds=[0, 3])
    assert batch.states()[0].tobytes() == batch.states()[3].tobytes() == batch.states()[2].tobytes()
    assert log.FindLog(batch.context(3)).data().tobytes() == log.FindLog(batch.context(2)).data().tobytes()


@compiled
def test_steps_are_periods():
    diagram, *_ = block()
    batch, steps = BatchSimulator(diagram, 2), BatchSimulator(diagram, 2)
    batch.AdvanceTo(0.1)
    steps.AdvanceSteps(1)
    steps.AdvanceSteps(99)
    np.testing.assert_array_equal(batch.times, steps.times)
    assert batch.states().tobytes() == steps.states().tobytes()
    with pytest.raises(RuntimeError, match="has 0 clocks"):
        BatchSimulator(PendulumPlant(), 2).AdvanceSteps(1)


@compiled
@pytest.mark.parametrize("num_threads", [1, 3])
def test_nan_in_one_world_is_named_and_the_others_finish(num_threads):
    diagram, plant, _ = block()
    batch = BatchSimulator(diagram, 64, num_threads=num_threads)
    batch.AdvanceTo(0.01)
    good = batch.states()[17].copy()
    batch.states(plant)[17, 9] = np.nan
    with pytest.raises(WorldsFailed, match=r"world 17 at t = 0.01 s: .*plant.*\n?.*body") as raised:
        batch.AdvanceTo(0.05)
    (failure,) = raised.value.failures
    assert (failure.world, failure.time, failure.system.split("::")[-1]) == (17, 0.01, "plant")
    assert batch.failed.tolist() == [w == 17 for w in range(64)] and batch.times[17] == 0.01
    np.testing.assert_array_equal(np.delete(batch.times, 17), 0.05)
    np.testing.assert_array_equal(batch.states()[17][:9], good[:9])
    with pytest.raises(RuntimeError, match="world 17 has failed"):
        batch.AdvanceTo(0.06, worlds=[16, 17])
    batch.AdvanceTo(0.06)  # those that can
    batch.Reset([17])
    batch.AdvanceTo(0.06)
    assert batch.failures == [] and batch.states()[17].tobytes() == batch.states()[0].tobytes()


def test_an_error_in_python_is_named_too():
    diagram, *_ = halvers()
    batch = BatchSimulator(diagram, 4, num_threads=2, raise_failures=False)
    batch.inputs(diagram.get_input_port())[:] = [[0.0], [0.0], [2e3], [0.0]]
    batch.AdvanceTo(1.0)
    (failure,) = batch.failures
    assert failure.world == 2 and isinstance(failure.error, ArithmeticError) and "Halver" in failure.system
    assert failure.time == 0.1 and batch.times.tolist() == [1.0, 1.0, 0.1, 1.0]


def test_a_missing_input_is_named():
    with pytest.raises(RuntimeError, match=r"required InputPort\[0\].*is not connected"):
        BatchSimulator(Integrator(2), 2).AdvanceTo(1.0)


def test_a_monitor_ends_worlds():
    pendulum = PendulumPlant()
    batch = BatchSimulator(pendulum, 4, num_threads=2)
    batch.inputs(pendulum.get_input_port())[:] = 0.0
    batch.states()[:, 0] = [0.1, 1.0, 2.0, 3.0]

    def monitor(context):
        fast = abs(context.get_continuous_state_vector()[1]) > 2.0
        return EventStatus.ReachedTermination(pendulum, "fast") if fast else EventStatus.DidNothing()

    batch.set_monitor(monitor)
    batch.AdvanceTo(1.0)
    np.testing.assert_array_equal(batch.terminated, batch.times < 1.0)
    assert batch.terminated.tolist() == [False, True, True, True]


def test_numbers_of_a_world_do_not_depend_on_the_others():
    builder = DiagramBuilder()
    source = builder.AddSystem(RandomSource(RandomDistribution.kGaussian, 3, 0.1))
    diagram = builder.Build()
    found = []
    for count, num_threads in ((3, 1), (7, 2)):
        batch = BatchSimulator(diagram, count, seed=5, num_threads=num_threads)
        batch.SetRandomContexts()
        batch.AdvanceTo(1.05)
        found.append(batch.states(source).copy())
    np.testing.assert_array_equal(found[0], found[1][:3])
    assert len(np.unique(found[1])) == found[1].size


@threads
def test_rollouts_are_simulations(num_threads):
    builder = DiagramBuilder()
    pendulum = builder.AddSystem(PendulumPlant())
    builder.ExportInput(pendulum.get_input_port(), "tau")
    builder.ExportOutput(pendulum.get_state_output_port(), "x")
    diagram = builder.Build()
    batch = BatchSimulator(diagram, 6, num_threads=num_threads)
    rng = np.random.default_rng(3)
    x0, u = rng.normal(size=(5, 2)), rng.normal(size=(5, 4, 1))
    for _ in range(2):  # the second call is warm
        y = batch.Rollout(x0, u, time_step=0.25)
        assert y.shape == (5, 4, 2) and not y.flags.writeable
    for i in range(5):
        simulator = Simulator(diagram)
        context = simulator.get_mutable_context()
        context.SetContinuousState(x0[i])
        for k in range(4):
            diagram.get_input_port().FixValue(context, u[i, k])
            simulator.AdvanceTo(0.25 * (k + 1))
            np.testing.assert_array_equal(y[i, k], diagram.get_output_port().Eval(context))
    again = batch.Rollout(x0[0], u[0], time_step=0.25)
    assert again.shape == (6, 4, 2) and np.array_equal(again[0], again[5])
    with pytest.raises(ValueError, match=r"expected \(2,\)"):
        batch.Rollout(np.zeros(3), u, time_step=0.25)


@compiled
def test_what_a_failed_rollout_did_not_reach_is_nan():
    diagram, plant, _ = block()
    batch = BatchSimulator(diagram, 3, raise_failures=False)
    x0 = np.tile(batch.states()[0], (3, 1))
    x0[1, 6] = np.nan
    y = batch.Rollout(x0, num_samples=5, steps_per_sample=2, output_ports=plant.get_state_output_port())
    assert np.isnan(y[1]).all() and np.isfinite(y[[0, 2]]).all()
    assert [f.world for f in batch.failures] == [1]


@compiled
def test_records_go_on():
    diagram, plant, _ = block()
    port = plant.get_state_output_port()
    batch = BatchSimulator(diagram, 3, num_threads=2)
    batch.AdvanceTo(0.01)
    kept = batch.Record(port, 4, steps_per_sample=5).copy()
    other = BatchSimulator(diagram, 3)
    for k in range(4):
        other.AdvanceTo(0.01 + 0.005 * (k + 1))
        np.testing.assert_allclose(kept[:, k], other.EvalOutputs(port), rtol=0, atol=1e-12)
    assert kept.shape == (3, 4, 13)


@pytest.mark.parametrize("num_threads", [1, 2])
@pytest.mark.parametrize("scene", [pytest.param(block, marks=compiled), halvers])
def test_ctrl_c_leaves_worlds_between_steps(num_threads, scene):
    diagram, *_ = scene()
    batch = BatchSimulator(diagram, 4, num_threads=num_threads)
    if diagram.num_input_ports():
        batch.inputs(diagram.get_input_port())[:] = 1.0
    threading.Timer(0.2, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        batch.AdvanceTo(1e6)
    stopped = batch.times.copy()
    assert stopped[0] > 0.0 and np.all(stopped < 1e6)
    period = 1e-3 if scene is block else 0.1
    np.testing.assert_allclose(stopped / period, np.round(stopped / period), rtol=0, atol=1e-6)
    first = int(np.round(stopped[0] / period))
    batch.AdvanceSteps(3, worlds=[0])
    assert batch.times[0] == (first + 3) * period
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_batches_leave_nothing_behind():
    pendulum = PendulumPlant()

    def one():
        batch = BatchSimulator(pendulum, 3, num_threads=2)
        batch.inputs(pendulum.get_input_port())[:] = 0.0
        batch.AdvanceTo(0.1)
        batch.context(1)
        return weakref.ref(batch), weakref.ref(batch._worlds)

    gc.collect()
    gc.disable()
    try:
        assert [r() for r in one()] == [None, None]  # at once: no cycle keeps a batch's memory
    finally:
        gc.enable()
    gc.collect()
    before, alive = len(gc.get_objects()), threading.active_count()
    for _ in range(1000):
        one()
    gc.collect()
    assert len(gc.get_objects()) - before < 100
    assert threading.active_count() <= alive + 2


@compiled
def test_misuse_is_explained():
    diagram, plant, log = block()
    batch = BatchSimulator(diagram, 2)
    other, *_ = block()
    calls = [
        (ValueError, "at least 1", lambda: BatchSimulator(diagram, 0)),
        (TypeError, "no System", lambda: BatchSimulator(3, 1)),
        (IndexError, "worlds 0 to 1", lambda: batch.context(2)),
        (ValueError, "not part of", lambda: batch.states(other)),
        (ValueError, "not of vectors", lambda: batch.inputs(plant.get_geometry_query_input_port())),
        (ValueError, "connected", lambda: batch.inputs(log.get_input_port())),
        (ValueError, r"shape \(2,\)", lambda: batch.Reset([True, False, True])),
        (ValueError, "cannot advance", lambda: batch.AdvanceTo(-1.0)),
        (ValueError, "finite", lambda: batch.SetTime(np.inf)),
        (IndexError, "groups", lambda: batch.parameters(plant, 10**6)),
        (TypeError, r"num_worlds must be a whole number, not 2.5", lambda: BatchSimulator(diagram, 2.5)),
        (TypeError, r"num_worlds must be a whole number, not nan", lambda: BatchSimulator(diagram, np.nan)),
        (
            ValueError,
            r"num_worlds must be at most \d+, not 18446744073709551616",
            lambda: BatchSimulator(diagram, 2**64),
        ),
        (MemoryError, r"10000000000000 worlds of about \d+ bytes each", lambda: BatchSimulator(diagram, 10**13)),
        (
            TypeError,
            r"num_threads must be a whole number, not 1.5",
            lambda: BatchSimulator(diagram, 1, num_threads=1.5),
        ),
        (ValueError, r"seed must be at least 0, not -1", lambda: BatchSimulator(diagram, 1, seed=-1)),
        (TypeError, r"context\(\): world must be a whole number, not 0.5", lambda: batch.context(0.5)),
        (IndexError, r"generator\(-1\): there are worlds 0 to 1", lambda: batch.generator(-1)),
        (TypeError, r"mask or whole numbers, not \[0.5\]", lambda: batch.Reset([0.5])),
        (TypeError, r"num_steps must be a whole number, not nan", lambda: batch.AdvanceSteps(np.nan)),
        (ValueError, r"num_steps must be at most", lambda: batch.AdvanceSteps(10**20)),
        (ValueError, r"one for each of 2 worlds; found an array of shape \(3,\)", lambda: batch.AdvanceTo(np.ones(3))),
        (ValueError, r"cannot advance to 1e\+300 s: .* time would stand still", lambda: batch.AdvanceTo(1e300)),
        (TypeError, r"num_samples must be a whole number", lambda: batch.Record(plant.get_state_output_port(), 2.5)),
        (
            ValueError,
            r"time_step must be positive and finite, not nan",
            lambda: batch.Record(plant.get_state_output_port(), 2, time_step=np.nan),
        ),
    ]
    for error, message, call in calls:
        with pytest.raises(error, match=message):
            call()


@compiled
def test_time_does_not_stand_still():
    """Where numbers lie further apart than the system's steps, no step would ever end."""
    diagram, plant, _ = block()
    batch = BatchSimulator(diagram, 2)
    batch.SetTime(1e17, worlds=[1])
    for call in (
        lambda: batch.AdvanceSteps(1),
        lambda: batch.AdvanceTo(2e17),
        lambda: batch.Record(plant.get_state_output_port(), 3),
    ):
        with pytest.raises(ValueError, match=r"time would stand still"):
            call()
    batch.AdvanceSteps(1, worlds=[0])
    assert batch.times.tolist() == [1e-3, 1e17]


def test_a_world_keeps_its_layout():
    """What would give one world other memory than the rest is refused, and says what to do."""
    builder = DiagramBuilder()
    gain = builder.AddSystem(Gain(2.0, 1))
    after = builder.AddSystem(Gain(3.0, 1))
    builder.Connect(gain.get_output_port(), after.get_input_port())
    builder.ExportInput(gain.get_input_port())
    batch = BatchSimulator(builder.Build(), 2)
    with pytest.raises(RuntimeError, match="World 1 of a batch"):
        after.get_input_port().FixValue(after.GetMyContextFromRoot(batch.context(1)), [1.0])


def test_a_clone_of_a_world_is_on_its_own():
    pendulum = PendulumPlant()
    batch = BatchSimulator(pendulum, 2)
    context = batch.context(1)
    context.SetContinuousState([0.5, 0.25])
    clone = context.Clone()
    batch.states()[1] = 0.0
    assert clone.get_continuous_state_vector().CopyToVector().tolist() == [0.5, 0.25]
    assert clone._store.world == -1


@pytest.mark.parametrize("at_a_time", [2, 3, Parallelism(8)])
def test_monte_carlo_gives_the_same_samples_on_threads(at_a_time):
    builder = DiagramBuilder()
    builder.AddSystem(RandomSource(RandomDistribution.kGaussian, 1, 0.1))
    diagram = builder.Build()

    def run(**threads):
        def output(system, context):
            return context.get_discrete_state_vector()[0]

        return MonteCarloSimulation(lambda _: Simulator(diagram), output, 1.0, 21, RandomGenerator(7), **threads)

    one, several = run(), run(num_parallel_executions=at_a_time)
    assert [r.output for r in one] == [r.output for r in several] and len({r.output for r in one}) == 21
    assert one[20].generator_snapshot() == several[20].generator_snapshot()
    simulator = Simulator(diagram)
    with pytest.raises(RuntimeError, match="same context twice"):
        MonteCarloSimulation(lambda _: simulator, lambda *_: 0.0, 1.0, 5, num_parallel_executions=2)


def halving(x=8.0):
    """x+ = x / 2 each second, logged: a simulator that begins with x, and its log."""
    builder = DiagramBuilder()
    nothing = np.zeros((1, 0))
    system = builder.AddSystem(LinearSystem([[0.5]], nothing, [[1.0]], nothing, time_period=1.0))
    system.set_name("halver")
    log = LogVectorOutput(system.get_output_port(), builder)
    simulator = Simulator(builder.Build())
    simulator.get_mutable_context().SetDiscreteState([x])
    return simulator, log


def test_worlds_begin_without_the_samples_of_the_context_they_are_made_from():
    simulator, log = halving()
    simulator.AdvanceTo(3.0)
    batch = BatchSimulator(simulator.get_system(), 3, simulator.get_context(), num_threads=1)
    assert log.FindLog(batch.context(1)).num_samples() == 0
    assert log.FindLog(simulator.get_context()).data().tolist() == [[8.0, 4.0, 2.0, 1.0]]
    for _ in range(2):
        batch.AdvanceTo(5.0)
        found = log.FindLog(batch.context(1))
        assert found.sample_times().tolist() == [3.0, 4.0, 5.0] and found.data().tolist() == [[1.0, 0.5, 0.25]]
        batch.Reset()


@pytest.mark.parametrize("again", ["Reset", "Rollout"])
def test_logs_of_worlds_keep_their_room(again):
    simulator, log = halving()
    system = simulator.get_system()
    batch = BatchSimulator(system, 5, num_threads=2)
    places = []
    for x in (1024.0, 2048.0, 4096.0):
        if again == "Reset":
            batch.Reset()
            batch.states()[:] = x
            batch.AdvanceTo(1000.0)
        else:
            port = system.GetSubsystemByName("halver").get_output_port()
            batch.Rollout([x], output_ports=port, num_samples=1, steps_per_sample=1000)
        assert places or not batch._worlds.known()  # so that no advance looks at contexts that nobody has
        for w in range(5):
            found = log.FindLog(batch.context(w))
            assert found.data()[0, :4].tolist() == [x, x / 2, x / 4, x / 8]
        places.append([batch._worlds.store(w).L.ctypes.data for w in range(5)])
    assert places[0] == places[1] == places[2]


@compiled
def test_what_is_set_back_is_as_it_was_to_the_bit():
    """All that steps have written, and zeros of the other sign."""
    diagram, plant, _ = block()
    batch = BatchSimulator(diagram, 3, num_threads=1)
    worlds = batch._worlds
    first = worlds.slab.copy()
    kept = np.zeros(worlds.slab.shape[1], bool)
    kept[slice(*worlds.layout.p)] = True
    batch.AdvanceSteps(100)
    scratch = slice(worlds.layout.p[1] + 1000, worlds.layout.p[1] + 1005)
    worlds.slab[:, scratch] = [-0.0, np.nan, 5e-324, np.inf, -np.nan]
    batch.parameters(plant)[:] *= 2.0
    batch.Reset()
    np.testing.assert_array_equal(worlds.slab[:, ~kept].view(np.int64), first[:, ~kept].view(np.int64))
    np.testing.assert_array_equal(worlds.slab[:, kept], 2.0 * first[:, kept])


@compiled
@pytest.mark.skipif(sys.platform != "linux", reason="asks Linux how much memory there is")
def test_setting_worlds_back_takes_no_memory():
    """Most of a slab is room for contacts that there are not."""
    diagram, *_ = block()
    batch = BatchSimulator(diagram, 300, num_threads=1)
    batch.AdvanceSteps(1)

    def resident():
        return int(pathlib.Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()

    before = resident()
    batch.Reset()
    assert resident() - before < 0.2 * batch._worlds.slab.nbytes


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_process_that_forks_has_worlds_of_its_own():
    simulator, _ = halving()
    batch = BatchSimulator(simulator.get_system(), 2, num_threads=1)
    child = os.fork()
    if child == 0:
        batch.states()[:] = 5.0
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0
    assert np.all(batch.states() == 0.0)
