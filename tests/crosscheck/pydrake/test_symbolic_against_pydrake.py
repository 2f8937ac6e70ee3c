"""Random expressions made with the same operations in both libraries print the same, and have the same values."""

import importlib
import math
import pathlib
import re

import numpy as np
import pytest
from tests.crosscheck.pydrake import lines

from sheldrake import symbolic as ours

pytestmark = pytest.mark.peer
theirs = pytest.importorskip("pydrake.symbolic")

UNARY = "sin cos tan exp atan sinh cosh tanh abs ceil floor".split()


def grow(rng, m, leaves, depth):
    """An expression of library `m`; the same random numbers give the same one in each library."""
    if depth == 0 or rng.random() < 0.15:
        pick = rng.integers(len(leaves) + 2)
        return leaves[pick] * 1 if pick < len(leaves) else m.Expression(float(rng.integers(-3, 4)))
    kind = rng.integers(9)
    a = grow(rng, m, leaves, depth - 1)
    if kind == 0:
        return getattr(m, UNARY[rng.integers(len(UNARY))])(a)
    if kind == 1:
        return a ** int(rng.integers(0, 4))
    if kind == 2:
        return -a
    b = grow(rng, m, leaves, depth - 1)
    if kind in (3, 4):
        return a + b
    if kind == 5:
        return a - b
    if kind == 6:
        return m.min(a, b)
    if kind == 7:
        return a / (b * b + 1)
    return a * b


def pairs(count, depth):
    for seed in range(count):
        out = []
        for m in (ours, theirs):
            leaves = [m.Variable(name) for name in "xyz"]
            out.append((grow(np.random.default_rng(seed), m, leaves, depth), leaves))
        yield seed, *out


def value(e, leaves, at):
    try:
        return e.Evaluate(dict(zip(leaves, at)))
    except (RuntimeError, ValueError):
        return math.nan


def text(e):
    """Without the sign of zero, which Drake keeps and we drop."""
    return re.sub(r"-0(?![.\d])", "0", str(e))


def test_text_is_the_same():
    different = [
        (seed, str(mine), str(peer)) for seed, (mine, _), (peer, _) in pairs(600, 4) if text(mine) != text(peer)
    ]
    # Terms that differ in nothing but the sign of a zero are one term here and two in Drake.
    different = [d for d in different if "-0 /" not in d[2]]
    assert not different, different[:3]


SUBSTITUTIONS = (
    lambda e, x, y, z, other: e.Substitute({x: 2.0}),
    lambda e, x, y, z, other: e.Substitute({x: 0.5, y: -1.0}),
    lambda e, x, y, z, other: e.Substitute(x, other),
    lambda e, x, y, z, other: e.Substitute({x: y * 1, y: x * 1, z: x + y}),
    lambda e, x, y, z, other: e.Substitute({x: -y, z: y / x}),
    lambda e, x, y, z, other: e.EvaluatePartial({y: 1.5}),
)


def test_substitutions_give_the_same_text():
    different, count = [], 0
    for seed, (mine, my_leaves), (peer, peer_leaves) in pairs(300, 4):
        others = [
            grow(np.random.default_rng(seed + 10**6), m, leaves, 2)
            for m, leaves in ((ours, my_leaves), (theirs, peer_leaves))
        ]
        for i, substitute in enumerate(SUBSTITUTIONS):
            a, b = substitute(mine, *my_leaves, others[0]), substitute(peer, *peer_leaves, others[1])
            count += 1
            if text(a) != text(b) and "-0 /" not in str(b):
                different.append((seed, i, str(mine), str(a), str(b)))
    assert not different, (len(different), count, different[:3])


def test_derivatives_expansions_and_polynomials_have_the_same_text():
    different, count = [], 0
    for seed, (mine, my_leaves), (peer, peer_leaves) in pairs(300, 4):
        for ask in (
            lambda m, e, x: e.Differentiate(x),
            lambda m, e, x: e.Expand(),
            lambda m, e, x: m.Polynomial(e, m.Variables([x])),
            lambda m, e, x: m.Polynomial(e.Expand(), m.Variables([x])).ToExpression(),
        ):
            try:
                b = ask(theirs, peer, peer_leaves[0])
            except RuntimeError:
                with pytest.raises(RuntimeError):
                    ask(ours, mine, my_leaves[0])
                continue
            a = ask(ours, mine, my_leaves[0])
            count += 1
            # A term that is nothing over something stays in Drake's sums, and is left out of ours.
            if text(a) != text(b) and "(0 /" not in text(a) + text(b):
                different.append((seed, str(mine), str(a), str(b)))
    assert count > 750
    assert not different, (len(different), count, different[:3])


@pytest.mark.parametrize("function", "log abs exp sqrt sin cos tan asin acos atan sinh cosh tanh".split())
def test_derivatives_of_functions_have_the_same_text(function):
    for inner in ("x", "2 * x", "x * y", "y / x", "x + y", "-x", "x / (y + 1)", "x**2"):
        for outer in ("{}", "z * {}", "-{} * (z + 1)"):
            texts = []
            for m in (ours, theirs):
                space = {name: m.Variable(name) for name in "xyz"}
                e = eval(outer.format(f"f({inner})"), {"f": getattr(m, function), **space})
                texts.append(str(e.Differentiate(space["x"])))
            assert texts[0] == texts[1], (function, inner, outer)


def test_derivatives_and_expansions_have_the_same_values():
    at = (0.37, -1.21, 0.83)
    for seed, (mine, my_leaves), (peer, peer_leaves) in pairs(200, 3):
        for operate in (
            lambda e, v: e.Differentiate(v[0]),
            lambda e, v: e.Expand(),
            lambda e, v: e.Substitute({v[0]: v[1] + v[2]}),
        ):
            a, b = (value(operate(e, v), v, at) for e, v in ((mine, my_leaves), (peer, peer_leaves)))
            if not math.isnan(b):
                assert a == pytest.approx(b, rel=1e-9, abs=1e-9), (seed, str(mine))


def test_the_comparison_sees_another_expression():
    x = theirs.Variable("x")
    assert str(theirs.sin(x) + 1) != str(ours.sin(ours.Variable("x")) + 2)


def test_public_names():
    missing = {n for n in dir(theirs) if not n.startswith("_") and n[0].isascii()} - set(dir(ours))
    module = importlib.import_module("sheldrake.symbolic")
    assert not missing & set(module.__all__)


SETUP = """
x, y, z = (Variable(name) for name in "xyz")
ex, ey, ez = (Expression(v) for v in (x, y, z))
b, bi = Variable("b", Variable.Type.BOOLEAN), Variable("bi", Variable.Type.BINARY)
"""


def test_every_line_gives_the_same():
    path = pathlib.Path(__file__).with_name("symbolic_lines.txt")
    different = lines.differences(path, ["symbolic"], SETUP)
    assert not different, dict(list(different.items())[:5])
