"""Seeded random diagrams: an independent oracle, the interpreted loop and the native loop agree bit for bit."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.unit.systems.framework.oracle import Oracle
from tests.unit.systems.framework.random_diagrams import random_diagram

from sheldrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from sheldrake.systems.framework._engine.layout import Layout
from sheldrake.systems.primitives import VectorLogSink

SCHEMES = ("explicit_euler", "runge_kutta2", "runge_kutta3")


def make_simulator(diagram, fixed, scheme, native):
    simulator = Simulator(diagram)
    simulator._native = native
    for i, value in enumerate(fixed):
        diagram.get_input_port(i).FixValue(simulator.get_mutable_context(), value)
    ResetIntegratorFromFlags(simulator, scheme, 0.01)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    return simulator


def compare(seed, ways=(False, True)):
    """Runs one diagram all ways; AssertionError where they differ. Gives the number of samples compared."""
    g = np.random.default_rng(seed)
    diagram = random_diagram(g)
    fixed = [g.normal(size=diagram.get_input_port(i).size()) for i in range(diagram.num_input_ports())]
    stops = np.sort(g.choice([0.0, 0.0, 0.05, 0.1, 0.0333, 0.2, 0.301], 3))
    scheme = SCHEMES[g.integers(3)]
    simulators = [make_simulator(diagram, fixed, scheme, native) for native in ways]
    oracle = Oracle(diagram, fixed, 0.01, scheme)
    samples = 0
    for simulator in simulators:
        simulator.Initialize()
    for stop in stops:
        oracle.advance(stop)
        for simulator in simulators:
            simulator.AdvanceTo(stop)
            samples += compare_state(oracle, simulator.get_context(), (seed, stop, scheme, simulator._native))
    return samples


def compare_state(oracle, root, where):
    samples = 0
    assert root.get_time() == oracle.t, where
    for s in oracle.leaves:
        context = s.GetMyContextFromRoot(root)
        assert np.array_equal(context.get_continuous_state_vector().value(), oracle.xc[s]), (where, s)
        for k, group in enumerate(oracle.xd[s]):
            assert np.array_equal(context.get_discrete_state(k).value(), group), (where, s)
        for j in range(s.num_output_ports()):  # pulled after the span: stamps must be right
            assert np.array_equal(s.get_output_port(j).Eval(context), oracle.output(s, j)), (where, s, j)
        if isinstance(s, VectorLogSink):
            log = s.FindLog(root)
            expected = np.array(oracle.log[s]).reshape(-1, 1 + s.get_input_port().size())
            assert np.array_equal(log.sample_times(), expected[:, 0]), (where, s)
            assert np.array_equal(log.data(), expected[:, 1:].T), (where, s)
            samples += log.num_samples()
    return samples


def test_oracle_interpreted_and_native_agree():
    assert sum(compare(seed) for seed in range(12)) > 500


@pytest.mark.slow
@settings(max_examples=80, deadline=None, derandomize=True)
@given(seed=st.integers(12, 2**32))
def test_oracle_interpreted_and_native_agree_on_many_more(seed):
    compare(seed)


def no_prerequisites(self, rows, original=Layout.prerequisites):
    return []


def all_constant(self, original=Layout._levels):
    return [0] * len(self.rows)


def all_sampled(self, original=Layout._levels):
    return [min(level, 1) for level in original(self)]


def nothing_kept(self, nodes, kind, original=Layout._segments):
    return original(self, nodes, kind)[:-1]


def one_clock(self, original=Layout._make_groups):
    original(self)
    self.clocks = [(0.0, period) for _, period in self.clocks]


@pytest.mark.parametrize(
    ("name", "fault"),
    [
        ("prerequisites", no_prerequisites),
        ("_levels", all_constant),
        ("_levels", all_sampled),
        ("_segments", nothing_kept),
        ("_make_groups", one_clock),
    ],
)
def test_a_planted_fault_is_seen(monkeypatch, name, fault):
    monkeypatch.setattr(Layout, name, fault)
    for seed in itertools.islice(itertools.count(), 30):
        try:
            compare(seed, ways=(True,))
        except AssertionError:
            return
    raise AssertionError(f"{fault.__name__} was not seen in 30 diagrams")
