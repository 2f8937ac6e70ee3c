"""What rows of a run cost: how often they are called, and that measuring changes nothing."""

import time

import numpy as np
import pytest

from sheldrake.common.kernel import jit_enabled
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.analysis._costs import costs_of_run, seconds_in_steps
from sheldrake.systems.analysis._first_calls import MOST
from sheldrake.systems.framework import DiagramBuilder, LeafSystem
from sheldrake.systems.primitives import LinearSystem, LogVectorOutput, Sine

SWING = dict(A=[[0.0, 0.001], [-0.001, 1.0]], B=[[0.0], [0.001]], C=np.eye(2), D=np.zeros((2, 1)), time_period=1e-3)


class Announcer(LeafSystem):
    """Publishes in Python, slowly, and counts."""

    def __init__(self, period=0.01, pause=0.0):
        super().__init__()
        self.set_name("announcer")
        self.count, self.pause = 0, pause
        self.DeclarePeriodicPublishEvent(period, 0.0, self.announce)
        self.DeclareInitializationPublishEvent(self.announce)

    def announce(self, context):
        self.count += 1
        time.sleep(self.pause)


def run(announcer, until=1.0):
    builder = DiagramBuilder()
    builder.AddSystem(announcer)
    wave = builder.AddNamedSystem("wave", Sine(1.0, 3.0, 0.0, 1))
    swing = builder.AddNamedSystem("swing", LinearSystem(**SWING))
    builder.Connect(wave.get_output_port(0), swing.get_input_port())
    LogVectorOutput(swing.get_output_port(), builder).set_name("log")
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(until)
    return simulator


def costs(simulator):
    return costs_of_run(simulator, lambda root, t: root.SetTime(t), [0.25, 0.5, 0.75])


def test_every_row_is_counted_and_nothing_is_called_or_changed():
    announcer = Announcer()
    simulator = run(announcer)
    context = simulator.get_context()
    slab, side, count = context._store.S.copy(), context._store.I.copy(), announcer.count
    found = {(c.system.rpartition("::")[2], c.name): c for c in costs(simulator)}
    assert announcer.count == count
    np.testing.assert_array_equal(context._store.S, slab)
    np.testing.assert_array_equal(context._store.I, side)
    assert found["announcer", "publish in Python"].calls == 101  # 0, 0.01, ... 1
    steps = simulator.get_num_steps_taken()
    if not jit_enabled():
        return
    assert found["log", "log"].calls == steps + 1
    assert {c.calls for (system, name), c in found.items() if system == "swing" and "output" not in name} == {1000}
    assert all(c.kernel and c.each >= 0.0 for (system, _), c in found.items() if system != "announcer")
    assert sum(c.each for c in found.values() if c.kernel) > 0.0


def test_a_slow_publish_is_the_dearest():
    simulator = run(Announcer(period=0.1, pause=0.002))
    dearest = max(costs(simulator), key=lambda cost: cost.each)
    assert dearest.system.endswith("::announcer") and dearest.each >= 0.002
    assert seconds_in_steps(simulator) >= 10 * 0.002


@pytest.mark.parametrize("native", [True, False])
def test_rows_are_timed_at_first_and_then_no_more(native):
    announcer = Announcer()
    builder = DiagramBuilder()
    builder.AddSystem(announcer)
    simulator = Simulator(builder.Build())
    simulator._native = native
    simulator.AdvanceTo(0.3)
    span = simulator._span
    (r,) = [r for r, first in span.first_calls.items() if len(first.seconds) > 1]
    first = span.first_calls[r]
    assert len(first.seconds) == 31 and span.python[r] is first
    simulator.AdvanceTo(1.0)
    assert len(first.seconds) == MOST and span.python[r] is first.run
    assert announcer.count == 101 + 1  # and at initialization


def test_a_simulator_that_never_ran_has_no_costs():
    builder = DiagramBuilder()
    builder.AddSystem(Announcer())
    assert costs(Simulator(builder.Build())) == []
