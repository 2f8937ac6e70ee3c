"""Every system of the library: copies, and what it does on AutoDiffXd and Expression, as in pydrake."""

from __future__ import annotations

import functools
import gc
import importlib

import numpy as np
import pytest

pytest.importorskip("pydrake")

from all_systems import SYSTEMS, Library

pytestmark = pytest.mark.peer
OURS, DRAKE = Library("sheldrake"), Library("pydrake")
MORE = {"WrapToSystem", "LinearTransformDensity", "AcrobotSpongController"}
"""Those that convert to more scalars here."""


@functools.cache
def made(name):
    return SYSTEMS[name](OURS), SYSTEMS[name](DRAKE)


def can(call):
    try:
        return call() is not None
    except RuntimeError:
        return False


@pytest.mark.parametrize("name", SYSTEMS)
def test_what_can_be_done_with_it(name):
    ours, theirs = ([can(s.Clone), can(s.ToAutoDiffXdMaybe), can(s.ToSymbolicMaybe)] for s in made(name))
    assert ours == theirs or (name in MORE and all(a >= b for a, b in zip(ours, theirs)))


def ports_of(system):
    if "Image" in type(system).__name__:  # their own get_input_port() takes other arguments
        return [("images", "kAbstractValued", 0)]
    inputs = [system.get_input_port(i) for i in range(system.num_input_ports())]
    outputs = [system.get_output_port(i) for i in range(system.num_output_ports())]
    return [(p.get_name(), p.get_data_type().name, p.size()) for p in [*inputs, *outputs]]


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_copy_is_complete(name):
    """It outlives the first, and its contexts go the same way."""
    system = SYSTEMS[name](OURS)
    if not can(system.Clone):
        return
    clone = system.Clone()
    assert ports_of(clone) == ports_of(system) and clone.get_name() == system.get_name()
    expected = results(OURS, system, float) if only_vectors(system) else None
    del system
    gc.collect()
    clone.AllocateContext()
    if expected is not None:
        found = results(OURS, clone, float)
        for a, b in zip(found, expected):
            np.testing.assert_array_equal(a, b)


def only_vectors(system):
    return all(kind == "kVectorValued" for _, kind, _ in ports_of(system))


def input_sizes(system):
    return [system.get_input_port(i).size() for i in range(system.num_input_ports())]


def some_numbers(system, context):
    """As many as continuous states and inputs."""
    count = context.num_continuous_states() + sum(input_sizes(system))
    return np.random.default_rng(3).uniform(-0.7, 0.9, count)


def outputs_and_derivatives(system, context, z):
    """Vector outputs and time derivatives at some continuous states and inputs, in this order in z."""
    n = at = context.num_continuous_states()
    context.SetTime(0.5)
    if n:
        context.SetContinuousState(z[:n])
    for i, size in enumerate(input_sizes(system)):
        system.get_input_port(i).FixValue(context, z[at : at + size])
        at += size
    out = [system.get_output_port(i).Eval(context) for i in range(system.num_output_ports())]
    return [*out, system.EvalTimeDerivatives(context).CopyToVector()] if n else out


def results(lib, system, scalar):
    """Vector outputs, time derivatives and periodic updates at some inputs, state and time."""
    ad = importlib.import_module(f"{lib.package}.autodiffutils")
    context = system.CreateDefaultContext()
    z = some_numbers(system, context)
    out = outputs_and_derivatives(system, context, z if scalar is float else ad.InitializeAutoDiff(z).ravel())
    if system.IsDifferenceEquationSystem()[0]:
        out.append(system.EvalUniquePeriodicDiscreteUpdate(context).get_vector(0).CopyToVector())
    return [np.array(v) for v in out]


RANDOM = {"RandomSource"}
"""Their numbers are others than Drake's from the start."""


OTHER_SIGN = {"RimlessWheel"}
"""Drake's wheel says that it moves backward while its position goes forward; here velocity is the rate of position."""


@pytest.mark.parametrize("name", SYSTEMS)
def test_duals(name):
    if name in RANDOM | OTHER_SIGN or not only_vectors(made(name)[0]) or not can(made(name)[1].ToAutoDiffXdMaybe):
        return
    found = []
    for lib, system in zip((OURS, DRAKE), made(name)):
        ad = importlib.import_module(f"{lib.package}.autodiffutils")
        values = results(lib, system.ToAutoDiffXd(), "duals")
        found.append([(ad.ExtractValue(v), ad.ExtractGradient(v)) for v in values if len(v)])
    for (value, gradient), (value_2, gradient_2) in zip(*found, strict=True):
        np.testing.assert_allclose(value, value_2, rtol=1e-9, atol=1e-12)
        if gradient.size or gradient_2.size:
            full = [g if g.size else np.zeros((len(value), 1)) for g in (gradient, gradient_2)]
            np.testing.assert_allclose(*np.broadcast_arrays(*full), rtol=1e-9, atol=1e-10)


@pytest.mark.parametrize("name", SYSTEMS)
def test_symbols(name):
    """Outputs and derivatives in symbols have the values that numbers give."""
    system = made(name)[0]
    if name in RANDOM or not only_vectors(system) or not can(made(name)[1].ToSymbolicMaybe):
        return
    symbolic = system.ToSymbolic()
    context = symbolic.CreateDefaultContext()
    values = some_numbers(symbolic, context)
    names = OURS.MakeVectorVariable(len(values), "z")
    at = dict(zip(names, values))
    out = outputs_and_derivatives(symbolic, context, names)
    for found, expected in zip(out, results(OURS, system, float)):
        np.testing.assert_allclose([OURS.Expression(e).Evaluate(at) for e in found], expected, rtol=1e-9, atol=1e-12)


ENDS_PROCESS = set(
    "DiscreteDerivative RandomSource StateInterpolatorWithDiscreteDerivative SchunkWsgPositionController CompassGait "
    "RimlessWheel RobotDiagram".split()
) | {"RotaryEncoders with ticks", "Diagram of an arm"}
"""Of which a linear model ends the process in pydrake."""


def linear_model(lib, system):
    """Its matrices about some state and input, or None where there is none."""
    rng, context = np.random.default_rng(5), system.CreateDefaultContext()
    context.SetTime(0.5)
    n = context.num_continuous_states()
    if n:
        context.SetContinuousState(rng.uniform(-0.7, 0.9, n))
    for i in range(system.num_input_ports()):
        system.get_input_port(i).FixValue(context, rng.uniform(-0.7, 0.9, system.get_input_port(i).size()))
    try:
        model = lib.FirstOrderTaylorApproximation(system, context)
    except RuntimeError:
        return None
    return [model.A(), model.B(), model.f0(), model.C(), model.D(), model.y0(), model.time_period()]


@pytest.mark.parametrize("name", sorted(set(SYSTEMS) - ENDS_PROCESS))
def test_linear_models(name):
    ours, theirs = made(name)
    if only_vectors(ours):
        expected = linear_model(DRAKE, theirs)
        if expected is None:
            return
        for a, b in zip(linear_model(OURS, ours), expected):
            np.testing.assert_allclose(np.ravel(a), np.ravel(b), atol=1e-9)


@pytest.mark.parametrize("name", SYSTEMS)
def test_saved_contexts(name, tmp_path):
    """A context that was saved is the same when loaded, for the system and for its copy."""
    system, rng = made(name)[0], np.random.default_rng(7)
    context = system.CreateDefaultContext()
    context.SetTime(0.25)
    if n := context.num_continuous_states():
        context.SetContinuousState(rng.uniform(-1.0, 1.0, n))
    if only_vectors(system):
        for i in range(system.num_input_ports()):
            port = system.get_input_port(i)
            port.FixValue(context, rng.uniform(-1.0, 1.0, port.size()))
    OURS.SaveContext(context, tmp_path / "context.npz")
    for owner in [system, system.Clone()] if can(system.Clone) else [system]:
        loaded = OURS.LoadContext(owner, tmp_path / "context.npz")
        np.testing.assert_array_equal(loaded._store.S, context._store.S)
