"""A source that follows a piecewise polynomial evaluates it and its derivatives together, to the last bit."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.systems.primitives import TrajectorySource
from sheldrake.trajectories import PiecewisePolynomial

PATHS = {
    "cubic": lambda r: PiecewisePolynomial.CubicShapePreserving([0.0, 1.0, 2.5, 3.0], r.normal(size=(3, 4))),
    "steps": lambda r: PiecewisePolynomial.ZeroOrderHold([0.0, 1.0, 2.0], r.normal(size=(2, 3))),
    "lines": lambda r: PiecewisePolynomial.FirstOrderHold([0.0, 1.0, 2.0], r.normal(size=(2, 3))),
    "constant": lambda r: PiecewisePolynomial(r.normal(size=(2, 1))),
}


@pytest.mark.parametrize("zero_beyond", [True, False])
@pytest.mark.parametrize("name", PATHS)
def test_it_gives_what_the_trajectory_and_its_derivatives_give(name, zero_beyond):
    generator = np.random.default_rng(1)
    path = PATHS[name](generator)
    source = TrajectorySource(path, 2, zero_beyond)
    context = source.CreateDefaultContext()
    for t in np.r_[generator.uniform(-1.0, 4.0, 100), path.get_segment_times()]:
        if not np.isfinite(t):
            continue
        context.SetTime(t)
        inside = path.start_time() <= t <= path.end_time()
        parts = [path.value(t), *(path.MakeDerivative(k).value(t) for k in (1, 2))]
        expected = [p.ravel() * (1.0 if inside or not zero_beyond or k == 0 else 0.0) for k, p in enumerate(parts)]
        np.testing.assert_array_equal(source.get_output_port().Eval(context), np.concatenate(expected))
