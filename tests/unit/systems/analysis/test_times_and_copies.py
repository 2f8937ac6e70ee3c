"""Times at which a run cannot go on, and copies that a simulator does not give."""

import copy
import pickle

import numpy as np
import pytest

from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import ConstantVectorSource, Integrator, LogVectorOutput


def simulator(period, continuous):
    builder = DiagramBuilder()
    source = builder.AddSystem(ConstantVectorSource([1.0]))
    if continuous:
        integrator = builder.AddSystem(Integrator(1))
        builder.Connect(source.get_output_port(), integrator.get_input_port())
    LogVectorOutput(source.get_output_port(), builder, period)
    return Simulator(builder.Build())


@pytest.mark.parametrize(("period", "continuous"), [(0.1, False), (0.1, True), (0.0, True)])
@pytest.mark.parametrize("t", [1e17, 1e300, -1e17, np.inf, -np.inf, np.nan])
def test_times_from_which_no_step_leads_away(t, period, continuous):
    found = simulator(period, continuous)
    found.get_mutable_context().SetTime(t)
    with pytest.raises(RuntimeError, match=r"Simulator.Initialize\(\): .*(must be finite|time would stand still)"):
        found.AdvanceTo(t)


@pytest.mark.parametrize("t", [-np.inf, -1e300, -1e17])
def test_a_callback_may_not_set_a_time_from_which_no_step_leads_away(t):
    found = simulator(0.1, True)
    context = found.get_mutable_context()
    found.set_monitor(lambda _: context.SetTime(t) if context.get_time() > 0.25 else None)
    with pytest.raises(RuntimeError, match=r"Simulator.AdvanceTo\(\): .*(must be finite|time would stand still)"):
        found.AdvanceTo(1.0)


def test_large_times_that_can_be_told_apart():
    found = simulator(0.1, True)
    found.get_mutable_context().SetTime(1e13)
    found.AdvanceTo(1e13 + 1.0)
    assert found.get_context().get_time() == 1e13 + 1.0


@pytest.mark.parametrize("call", [copy.copy, copy.deepcopy, pickle.dumps])
def test_a_simulator_is_not_copied(call):
    with pytest.raises(TypeError, match=r"Simulator\(system, context.Clone\(\)\)"):
        call(simulator(0.1, True))
