"""What every system answers at random states: energies, power, feedthrough, motion, outputs, as in pydrake."""

from __future__ import annotations

import functools

import numpy as np
import pytest

pytest.importorskip("pydrake")

from all_systems import SYSTEMS, Library

pytestmark = pytest.mark.peer
OURS, DRAKE = Library("sheldrake"), Library("pydrake")
STEPPING = {"CompassGait", "RimlessWheel"}
"""Their witness functions and unique updates end the process in pydrake."""

DIFFERENT = {
    # Drake's diagrams have no energy, whatever is in them; here it is the sum.
    ("AcrobotWEncoder", "energies"),
    # Drake's wheel says that it moves backward while its position goes forward.
    ("RimlessWheel", "output 1"),
    # Contact forces in continuous time come with everything else here, and so may depend on any input.
    ("MultibodyPlant", "feedthrough"),
    # These numbers are others than Drake's from the start.
    ("RandomSource", "output 0"),
}


@functools.cache
def made(name):
    return SYSTEMS[name](OURS), SYSTEMS[name](DRAKE)


def ports(lib, system, kind):
    """By the base class's method: some systems have one of their own with other arguments."""
    get = getattr(lib.System, f"get_{kind}_port")
    return [get(system, i) for i in range(getattr(system, f"num_{kind}_ports")())]


def at_random(lib, system, seed):
    """A context with random states and vector inputs."""
    rng, context = np.random.default_rng(seed), system.CreateDefaultContext()
    context.SetTime(0.3)
    if n := context.num_continuous_states():
        context.SetContinuousState(rng.uniform(-1.0, 1.0, n))
    for k in range(context.num_discrete_state_groups()):
        context.SetDiscreteState(k, rng.uniform(-1.0, 1.0, context.get_discrete_state(k).size()))
    for port in ports(lib, system, "input"):
        if port.get_data_type().name == "kVectorValued":
            port.FixValue(context, rng.uniform(0.1, 1.0, port.size()))
    return context


def unless_refused(call):
    """What a call gives, or None where it is an error."""
    try:
        return call()
    except (RuntimeError, AttributeError, ValueError):
        return None


def feedthrough(system):
    inputs, outputs = range(system.num_input_ports()), range(system.num_output_ports())
    return [(i, j) for i in inputs for j in outputs if system.HasDirectFeedthrough(i, j)]


def answers(lib, name, system, seed):
    context = at_random(lib, system, seed)
    state = context.get_continuous_state()
    ask = {
        "energies": lambda: [system.EvalKineticEnergy(context), system.EvalPotentialEnergy(context)],
        "energies again": lambda: [system.CalcKineticEnergy(context), system.CalcPotentialEnergy(context)],
        "power": lambda: [system.CalcConservativePower(context), system.CalcNonConservativePower(context)],
        "feedthrough": lambda: feedthrough(system),
        "kinds of state": lambda: [state.num_q(), state.num_v(), state.num_z()],
        "derivatives": lambda: system.EvalTimeDerivatives(context).CopyToVector(),
        "residual": lambda: system.CalcImplicitTimeDerivativesResidual(context, system.EvalTimeDerivatives(context)),
        "equations": lambda: [system.IsDifferentialEquationSystem(), *system.IsDifferenceEquationSystem()],
    }
    if name not in STEPPING:
        ask["witnesses"] = lambda: len(system.GetWitnessFunctions(context))
        ask["update"] = lambda: system.EvalUniquePeriodicDiscreteUpdate(context).get_vector(0).CopyToVector()
    for j, port in enumerate(ports(lib, system, "output")):
        if port.get_data_type().name == "kVectorValued":
            ask[f"output {j}"] = functools.partial(port.Eval, context)
    return {what: unless_refused(call) for what, call in ask.items()}


def assert_same(name, ours, theirs):
    assert ours.keys() == theirs.keys()
    for what, expected in theirs.items():
        if (name, what.removesuffix(" again")) in DIFFERENT:
            continue
        assert (ours[what] is None) == (expected is None), what
        if expected is not None:
            np.testing.assert_allclose(ours[what], expected, rtol=1e-9, atol=1e-12, err_msg=what)


@pytest.mark.parametrize("name", SYSTEMS)
def test_answers(name):
    ours, theirs = made(name)
    for seed in range(3):
        assert_same(name, answers(OURS, name, ours, seed), answers(DRAKE, name, theirs, seed))


def test_a_system_without_energy_is_seen(monkeypatch):
    monkeypatch.delattr(OURS.examples.PendulumPlant, "DoCalcKineticEnergy")
    name = "PendulumPlant"
    ours, theirs = made(name)
    with pytest.raises(AssertionError, match="energies"):
        assert_same(name, answers(OURS, name, ours, 0), answers(DRAKE, name, theirs, 0))
