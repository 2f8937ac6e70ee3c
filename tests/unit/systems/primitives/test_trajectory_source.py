"""A source that follows a trajectory: by a kernel where it can be, to the last bit of what Python computes."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.common.kernel import Kernel
from sheldrake.math import BsplineBasis, RollPitchYaw
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import Integrator, LogVectorOutput, TrajectorySource
from sheldrake.trajectories import (
    BezierCurve,
    BsplineTrajectory,
    CompositeTrajectory,
    ExponentialPlusPiecewisePolynomial,
    FunctionHandleTrajectory,
    PiecewisePolynomial,
    PiecewiseQuaternionSlerp,
    StackedTrajectory,
)


def stacked(*parts):
    out = StackedTrajectory()
    for part in parts:
        out.Append(part)
    return out


def spline(r, order=4):
    basis = BsplineBasis(order, 8, initial_parameter_value=0.0, final_parameter_value=3.0)
    return BsplineTrajectory(basis, r.normal(size=(2, 8)))


def cubic(r, rows=3, breaks=(0.0, 1.0, 2.5, 3.0)):
    return PiecewisePolynomial.CubicShapePreserving(list(breaks), r.normal(size=(rows, len(breaks))))


EXACT = {
    "cubic": cubic,
    "steps": lambda r: PiecewisePolynomial.ZeroOrderHold([0.0, 1.0, 2.0], r.normal(size=(2, 3))),
    "lines": lambda r: PiecewisePolynomial.FirstOrderHold([0.0, 1.0, 2.0], r.normal(size=(2, 3))),
    "constant": lambda r: PiecewisePolynomial(r.normal(size=(2, 1))),
    "composed": lambda r: CompositeTrajectory([cubic(r), cubic(r, 3, [3.0, 3.2, 4.0, 4.5])]),
    "stacked": lambda r: stacked(cubic(r), cubic(r, 1)),
    "derivative of a composition": lambda r: CompositeTrajectory([cubic(r)]).MakeDerivative(1),
}
CLOSE = {  # to round-off
    "B-spline": spline,
    "B-spline of order 1": lambda r: spline(r, 1),
    "Bézier": lambda r: BezierCurve(0.5, 2.0, r.normal(size=(3, 5))),
    "long Bézier": lambda r: BezierCurve(0.0, 3.0, r.normal(size=(2, 14))),
    "stacked of several breaks": lambda r: stacked(cubic(r), cubic(r, 2, [0.0, 0.4, 2.0, 3.0]), spline(r)),
}
PYTHON = {
    "function": lambda r: FunctionHandleTrajectory(lambda t: np.array([[np.sin(t)]]), 1, 1, 0.0, 1.0),
    "exponential": lambda r: ExponentialPlusPiecewisePolynomial(
        np.eye(1), np.eye(1), np.ones((1, 1)), PiecewisePolynomial.FirstOrderHold([0.0, 1.0], r.normal(size=(1, 2)))
    ),
}


def expected_at(path, order, zero_beyond, t):
    inside = path.start_time() <= t <= path.end_time()
    parts = [path.value(t), *(path.MakeDerivative(k).value(t) for k in range(1, order + 1))]
    return np.concatenate([p.ravel() * (inside or not zero_beyond or k == 0) for k, p in enumerate(parts)])


def times_of(path, generator):
    ends = [x for x in (path.start_time(), path.end_time()) if np.isfinite(x)]
    return [*generator.uniform(-1.0, 4.0, 100), *ends, *np.arange(4.0)]


def is_native(source):
    return isinstance(source._outputs[0].calc, Kernel)


@pytest.mark.parametrize("zero_beyond", [True, False])
@pytest.mark.parametrize("name", [*EXACT, *CLOSE])
def test_it_gives_what_the_trajectory_and_its_derivatives_give(name, zero_beyond):
    generator = np.random.default_rng(1)
    path = (EXACT | CLOSE)[name](generator)
    source = TrajectorySource(path, 2, zero_beyond)
    assert is_native(source)
    context = source.CreateDefaultContext()
    for t in times_of(path, generator):
        context.SetTime(t)
        found, expected = source.get_output_port().Eval(context), expected_at(path, 2, zero_beyond, t)
        if name in EXACT:
            np.testing.assert_array_equal(found, expected)
        else:  # second derivatives here are up to 600
            np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-11)


def test_quaternions_between_breaks():
    generator = np.random.default_rng(2)
    turns = [RollPitchYaw(generator.normal(size=3)).ToQuaternion() for _ in range(3)]
    path = PiecewiseQuaternionSlerp([0.0, 1.0, 1.5, 4.0], [*turns, turns[-1]])  # the last piece stands still
    source = TrajectorySource(path)
    assert is_native(source)
    context = source.CreateDefaultContext()
    for t in times_of(path, generator):
        context.SetTime(t)
        found = source.get_output_port().Eval(context)
        np.testing.assert_allclose(found, path.value(t).ravel(), rtol=0, atol=1e-15)


@pytest.mark.parametrize("name", PYTHON)
def test_what_python_alone_can_compute(name):
    path = PYTHON[name](np.random.default_rng(3))
    source = TrajectorySource(path)
    assert not is_native(source)
    context = source.CreateDefaultContext()
    context.SetTime(0.25)
    np.testing.assert_array_equal(source.get_output_port().Eval(context), path.value(0.25).ravel())


@pytest.mark.parametrize("name", [*EXACT, *CLOSE, *PYTHON])
def test_derivatives_with_respect_to_time(name):
    path = (EXACT | CLOSE | PYTHON)[name](np.random.default_rng(4))
    if not path.has_derivative():
        return
    source = TrajectorySource(path).ToAutoDiffXd()
    context = source.CreateDefaultContext()
    context.SetTime(AutoDiffXd(0.7, [2.0]))
    found = source.get_output_port().Eval(context)
    np.testing.assert_allclose([y.value() for y in found], path.value(0.7).ravel(), rtol=1e-14)
    slopes = [y.derivatives()[0] for y in found]
    np.testing.assert_allclose(slopes, 2.0 * path.EvalDerivative(0.7).ravel(), rtol=1e-12, atol=1e-12)
    back = TrajectorySource(path).ToAutoDiffXd().Clone()
    assert not is_native(back)


PATHS = {  # breaks, for the same source
    "of the same form": lambda r: cubic(r),
    "of more pieces": lambda r: cubic(r, 3, [0.0, 0.3, 0.6, 1.0, 2.0, 3.0]),
    "of Python": lambda r: FunctionHandleTrajectory(lambda t: np.full((3, 1), 2.0 * t), 3, 1, 0.0, 9.0),
    "constant": lambda r: PiecewisePolynomial(r.normal(size=(3, 1))),
}


@pytest.mark.parametrize("name", PATHS)
@pytest.mark.parametrize("first", PATHS)
def test_contexts_that_there_are_follow_another_trajectory(first, name):
    generator = np.random.default_rng(5)
    old, new = PATHS[first](generator), PATHS[name](generator)
    source = TrajectorySource(old)
    other = source.Clone()
    contexts = [source.CreateDefaultContext() for _ in range(2)]
    contexts.append(contexts[0].Clone())
    kept = other.CreateDefaultContext()
    for context in (*contexts, kept):
        context.SetTime(0.5)
        np.testing.assert_allclose(source.get_output_port().Eval(contexts[0]), old.value(0.5).ravel(), rtol=1e-15)
    source.UpdateTrajectory(new)
    for context in (*contexts, source.CreateDefaultContext()):
        context.SetTime(0.75)
        np.testing.assert_allclose(source.get_output_port().Eval(context), new.value(0.75).ravel(), rtol=1e-15)
    kept.SetTime(0.75)
    np.testing.assert_allclose(other.get_output_port().Eval(kept), old.value(0.75).ravel(), rtol=1e-15)


@pytest.mark.parametrize("name", PATHS)
def test_a_simulation_follows_another_trajectory_from_when_it_is_told(name):
    generator = np.random.default_rng(6)
    old, new = cubic(generator), PATHS[name](generator)
    builder = DiagramBuilder()
    source = builder.AddSystem(TrajectorySource(old))
    integrator = builder.AddSystem(Integrator(3))
    builder.Connect(source.get_output_port(), integrator.get_input_port())
    log = LogVectorOutput(source.get_output_port(), builder, 0.125)
    simulator = Simulator(builder.Build())
    told = []

    def monitor(context):
        if context.get_time() >= 1.0 and not told:
            told.append(context.get_time())
            source.UpdateTrajectory(new)

    simulator.set_monitor(monitor)
    simulator.AdvanceTo(2.0)
    found = log.FindLog(simulator.get_context())
    for t, values in zip(found.sample_times(), found.data().T):
        followed = old if t <= told[0] else new
        np.testing.assert_allclose(values, followed.value(t).ravel(), rtol=1e-15)
    assert told and told[0] < 1.5


def test_a_trajectory_that_is_changed_afterwards_changes_nothing():
    path = PiecewisePolynomial.FirstOrderHold([0.0, 1.0], [[0.0, 1.0]])
    source = TrajectorySource(path)
    path.AppendFirstOrderSegment(2.0, [[5.0]])
    context = source.CreateDefaultContext()
    context.SetTime(1.5)
    assert source.get_output_port().Eval(context) == [1.0]
