"""Regions of attraction: level sets within which a Lyapunov function decreases, and which are no larger."""

import numpy as np
import pytest

from sheldrake.symbolic import Evaluate, Expression, MakeVectorContinuousVariable, Variable, sin
from sheldrake.systems.analysis import RegionOfAttraction, RegionOfAttractionOptions
from sheldrake.systems.primitives import Gain, SymbolicVectorSystem

x = MakeVectorContinuousVariable(2, "x")
VAN_DER_POL = [-x[1], x[0] + (x[0] ** 2 - 1) * x[1]]
"""Backwards in time: the limit cycle is the boundary of what 0 attracts."""


def region(state, dynamics, fixed_point, **options):
    system = SymbolicVectorSystem(state=list(state), dynamics=list(dynamics), output=[state[0]])
    context = system.CreateDefaultContext()
    context.SetContinuousState(np.asarray(fixed_point, float))
    chosen = RegionOfAttractionOptions()
    for name, value in options.items():
        setattr(chosen, name, value)
    return RegionOfAttraction(system, context, chosen)


def on_boundary(V, names, angles):
    """Points with V = 1, by bisection along rays."""
    points = []
    for a in angles:
        ray, lo, hi = np.array([np.cos(a), np.sin(a)]), 0.0, 10.0
        for _ in range(60):
            middle = 0.5 * (lo + hi)
            inside = V.Evaluate(dict(zip(names, middle * ray))) < 1.0
            lo, hi = (middle, hi) if inside else (lo, middle)
        points.append(lo * ray)
    return np.array(points)


@pytest.mark.parametrize("implicit", [False, True])
@pytest.mark.parametrize("point", [0.0, 1.0])
def test_cubic_line(point, implicit):
    """x' = -x + x**3 attracts |x| < 1."""
    y = Variable("y")
    V = region([y], [-(y - point) + (y - point) ** 3], [point], state_variables=np.array([y]),
               use_implicit_dynamics=implicit)  # fmt: skip
    for d in (-1.0, 0.5, 1.0):
        assert V.Evaluate({y: point + d}) == pytest.approx(d**2, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("candidate", [0, 1.5 * x[0] ** 2 - x[0] * x[1] + x[1] ** 2 + 0.1 * x[0] ** 4])
def test_decreases_within_and_touches_where_it_does_not(candidate):
    V = region(x, VAN_DER_POL, [0, 0], state_variables=x, lyapunov_candidate=Expression(candidate))
    rate = sum(V.Jacobian(x).ravel() * VAN_DER_POL)
    rim = on_boundary(V, x, np.linspace(0, 2 * np.pi, 721))
    rates = np.array([Evaluate(np.array([rate]), dict(zip(x, p))).item() for p in rim])
    assert -1e-2 < rates.max() < 1e-4, "just touches"
    for scale in (0.1, 0.5, 0.9, 0.99):
        inside = [Evaluate(np.array([rate]), dict(zip(x, scale * p))).item() for p in rim[::20]]
        assert max(inside) < 0.0


def test_errors_name_what_is_wrong():
    y = Variable("y")
    with pytest.raises(RuntimeError, match=r"not a fixed point.*is 1"):
        region([y], [1 - y], [0.0])
    with pytest.raises(RuntimeError, match="not stable"):
        region([y], [y], [0.0])
    with pytest.raises(RuntimeError, match="all states are attracted"):
        region([y], [-y - y**3], [0.0])
    with pytest.raises(RuntimeError, match="1 state_variables, the system has 2"):
        region(x, VAN_DER_POL, [0, 0], state_variables=x[:1])
    with pytest.raises(RuntimeError, match="not shown to be positive"):
        region(x, VAN_DER_POL, [0, 0], state_variables=x, lyapunov_candidate=-(x[0] ** 2) - x[1] ** 2)
    with pytest.raises(RuntimeError, match="not among the state_variables"):
        region(x, VAN_DER_POL, [0, 0], lyapunov_candidate=x[0] ** 2 + x[1] ** 2)
    with pytest.raises(RuntimeError, match="free of the indeterminates"):
        region([y], [-sin(y)], [0.0])
    gain = Gain(1.0, 1)
    with pytest.raises(RuntimeError, match="must have continuous state"):
        RegionOfAttraction(gain, gain.CreateDefaultContext())


CASES = {
    "van der Pol": {},
    "implicit": {"use_implicit_dynamics": True},
    "quartic": {"lyapunov_candidate": lambda x: 1.5 * x[0] ** 2 - x[0] * x[1] + x[1] ** 2 + 0.1 * x[0] ** 4},
}


def values(name, case):
    """V of the oscillator at some points, by a library."""
    import importlib

    lib = importlib.import_module(f"{name}.all")
    x = lib.MakeVectorContinuousVariable(2, "x")
    system = lib.SymbolicVectorSystem(state=list(x), dynamics=[-x[1], x[0] + (x[0] ** 2 - 1) * x[1]], output=[x[0]])
    options = lib.RegionOfAttractionOptions()
    options.state_variables = x
    for key, value in CASES[case].items():
        setattr(options, key, value(x) if callable(value) else value)
    V = lib.RegionOfAttraction(system=system, context=system.CreateDefaultContext(), options=options)
    return [V.Evaluate(dict(zip(x, p))) for p in np.random.default_rng(0).normal(size=(10, 2))]


@pytest.mark.peer
@pytest.mark.parametrize("case", CASES)
def test_equals_pydrakes(case):
    pytest.importorskip("pydrake")
    np.testing.assert_allclose(values("sheldrake", case), values("pydrake", case), rtol=1e-6)


def test_a_certificate_must_hold_to_the_tolerance_asked_for():
    y = Variable("y")
    line = ([y], [-y + y**3], [0.0])
    assert region(*line, certificate_tolerance=1e-3, state_variables=np.array([y])).GetVariables().size() == 1
    with pytest.raises(RuntimeError, match=r"misses .* by more than certificate_tolerance = 1e-16"):
        region(*line, certificate_tolerance=1e-16)
    for wrong in (-1.0, np.inf, np.nan):
        with pytest.raises(RuntimeError, match="finite and not negative"):
            region(*line, certificate_tolerance=wrong)
