"""What integers and floats do at their edges, as `docs/kernels.md` says; nothing is undefined."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.unit.common.compiler.sources import module_of, run, value_of

from sheldrake.common._native.store import can_compile

pytestmark = pytest.mark.skipif(not can_compile(), reason="compiles kernels: needs llvmlite")
LOW, HIGH, INF, NAN = -(2**63), 2**63 - 1, math.inf, math.nan


def same(a, b):
    return type(a) is type(b) and ((a != a and b != b) or (a == b and math.copysign(1, a) == math.copysign(1, b)))


@pytest.mark.parametrize(
    ("expression", "ints", "value"),
    [
        ("n[0] + n[1]", (HIGH, 1), LOW),
        ("n[0] - n[1]", (LOW, 1), HIGH),
        ("n[0] * n[1]", (HIGH, 2), -2),
        ("-n[0]", (LOW,), LOW),
        ("abs(n[0])", (LOW,), LOW),
        ("n[0] // n[1]", (7, 0), 0),
        ("n[0] % n[1]", (7, 0), 0),
        ("n[0] // n[1]", (LOW, -1), LOW),
        ("n[0] % n[1]", (LOW, -1), 0),
        ("n[0] // n[1]", (-7, 2), -4),
        ("n[0] % n[1]", (-7, 2), 1),
        ("n[0] % n[1]", (7, -2), -1),
        ("n[0] // 2", (-7,), -4),
        ("n[0] % 8", (-1,), 7),
        ("n[0] // 3", (LOW,), LOW // 3),
        ("n[0] % 3", (LOW,), LOW % 3),
        ("n[0] // -3", (LOW,), LOW // -3),
        ("n[0] // -1", (LOW,), LOW),
        ("n[0] // 0", (LOW,), 0),
        ("n[0] % 0", (LOW,), 0),
        ("n[0] << n[1]", (1, 63), LOW),
        ("n[0] << n[1]", (1, 64), 0),
        ("n[0] << n[1]", (1, -1), 0),
        ("n[0] >> n[1]", (-5, 64), -1),
        ("n[0] >> n[1]", (-5, -1), -1),
        ("n[0] >> n[1]", (5, 1000), 0),
        ("n[0] << 64", (1,), 0),
        ("n[0] >> 64", (-1,), -1),
        ("n[0] << -1", (1,), 0),
        ("n[0] ** 3", (2**30,), 0),
        ("n[0] ** 0", (0,), 1),
        ("n[0] ** 64", (2,), 0),
        ("-9223372036854775808", (), LOW),
        ("~n[0]", (0,), -1),
        ("min(n[0], n[1])", (3, -3), -3),
        ("(n[0] > 0) + (n[1] > 0)", (1, 1), 2),
        ("~(n[0] > 0)", (1,), -2),
        ("+(n[0] > 0)", (1,), 1),
        ("(n[0] and n[1]) + 0", (5, 7), 1),
        ("int(n[0] or 1 // n[1])", (5, 0), 1),
    ],
)
@pytest.mark.parametrize("strict", [True, False])
def test_integers(expression, ints, value, strict):
    assert same(value_of(expression, ints=ints, strict=strict), value)


@pytest.mark.parametrize(
    ("expression", "floats", "value"),
    [
        ("int(x[0])", (1e300,), HIGH),
        ("int(x[0])", (-1e300,), LOW),
        ("int(x[0])", (INF,), HIGH),
        ("int(x[0])", (NAN,), 0),
        ("int(x[0])", (-2.7,), -2),
        ("int(x[0])", (2.0**63,), HIGH),
        ("int(1e300)", (), HIGH),
        ("int(-1e300)", (), LOW),
        ("math.floor(x[0])", (-2.5,), -3),
        ("math.floor(x[0])", (NAN,), 0),
        ("whole(x[0])", (INF,), HIGH),
        ("np.floor(x[0])", (-0.0,), -0.0),
        ("floor(x[0])", (-0.0,), 0.0),
        ("floor(x[0])", (INF,), INF),
        ("x[0] / x[1]", (1.0, 0.0), INF),
        ("x[0] / x[1]", (1.0, -0.0), -INF),
        ("x[0] / x[1]", (0.0, 0.0), NAN),
        ("x[0] // x[1]", (1.0, 0.0), INF),
        ("x[0] // x[1]", (-7.0, 2.0), -4.0),
        ("x[0] // x[1]", (INF, 2.0), NAN),
        ("x[0] // x[1]", (-1.0, INF), -1.0),
        ("x[0] // x[1]", (-0.0, 2.0), -0.0),
        ("x[0] % x[1]", (-7.0, 2.0), 1.0),
        ("x[0] % x[1]", (7.0, 0.0), NAN),
        ("x[0] % x[1]", (-1.0, INF), INF),
        ("x[0] % x[1]", (4.0, -2.0), -0.0),
        ("x[0] ** x[1]", (-8.0, 1.0 / 3.0), NAN),
        ("x[0] ** x[1]", (0.0, -1.0), INF),
        ("x[0] ** x[1]", (NAN, 0.0), 1.0),
        ("x[0] ** 0", (NAN,), 1.0),
        ("x[0] ** 3", (3.0,), 27.0),
        ("math.sqrt(x[0])", (-1.0,), NAN),
        ("log(x[0])", (0.0,), -INF),
        ("exp(x[0])", (1000.0,), INF),
        ("min(x[0], x[1])", (NAN, 1.0), NAN),
        ("min(x[0], x[1])", (1.0, NAN), 1.0),
        ("max(x[0], x[1])", (NAN, 1.0), NAN),
        ("max(x[0], x[1], 3)", (1.0, NAN), 3.0),
        ("min(x[0], x[1])", (0.0, -0.0), 0.0),
        ("min(x[0], x[1])", (-0.0, 0.0), -0.0),
        ("clip(x[0], -1.0, 1.0)", (NAN,), NAN),
        ("-x[0]", (0.0,), -0.0),
        ("0.0 - x[0]", (0.0,), 0.0),
        ("5e-324 * x[0]", (0.5,), 0.0),
        ("1 if x[0] else 0", (NAN,), 1),
        ("int(x[0] == x[0])", (NAN,), 0),
        ("int(x[0] != x[0])", (NAN,), 1),
        ("int(not x[0] < 1.0)", (NAN,), 1),
        ("int(not x[0])", (-0.0,), 1),
        ("int(is_finite(x[0]))", (-INF,), 0),
        ("int(is_finite(x[0]))", (NAN,), 0),
        ("1 / 0 + x[0]", (0.0,), INF),
    ],
)
def test_floats(expression, floats, value):
    module = "from sheldrake.common._kernels.generic import *; import math"
    names: dict = {}
    exec(module, names)
    text = f"@kernel(top=True, strict=True)\ndef entry(x: Vector, N: IntVector, X: Vector):\n    {{}} = {expression}\n"
    where = "N[0]" if isinstance(value, int) else "X[0]"
    N, X = np.zeros(1, np.int64), np.zeros(1)
    assert run(module_of(text.format(where), **names)["entry"], np.array([*floats, 0.0]), N, X) == 0
    assert same(int(N[0]) if isinstance(value, int) else float(X[0]), value)


def test_an_int_beside_a_float_becomes_a_float_first():
    assert value_of("n[0] == x[0]", ints=(2**53 + 1,), floats=(2.0**53,)) == 1
    assert value_of("n[0] / n[1]", ints=(HIGH, 1)) == float(HIGH)


@pytest.mark.parametrize(
    ("bounds", "items"),
    [
        ("-9223372036854775808, 9223372036854775807, 4611686018427387904", [LOW, -(2**62), 0, 2**62]),
        ("9223372036854775807, -9223372036854775808, -4611686018427387904", [HIGH, 2**62 - 1, -1, -(2**62) - 1]),
        ("9223372036854775805, 9223372036854775807", [HIGH - 2, HIGH - 1]),
        ("-9223372036854775806, -9223372036854775808, -1", [LOW + 2, LOW + 1]),
        ("9223372036854775800, 9223372036854775807, 3", [HIGH - 7, HIGH - 4, HIGH - 1]),
        ("-9223372036854775808, 9223372036854775807, 2", [LOW, LOW + 2, LOW + 4, LOW + 6, LOW + 8]),
        ("9223372036854775807, -9223372036854775808, -2", [HIGH, HIGH - 2, HIGH - 4, HIGH - 6, HIGH - 8]),
        ("5, 5", []),
        ("5, 4, 2", []),
        ("4, 5, -3", []),
        ("0, 9223372036854775807, -9223372036854775808", []),
        ("0, -9223372036854775808, -9223372036854775808", [0]),
        ("-9223372036854775808, 9223372036854775807, 9223372036854775807", [LOW, -1, HIGH - 1]),
        ("7, -3, -4", [7, 3, -1]),
        ("2 > 1, 3", [1, 2]),
    ],
)
def test_ranges_to_the_ends_of_64_bits(bounds, items):
    text = f"""@kernel(top=True)
def entry(N: IntVector) -> int:
    count = 0
    for i in range({bounds}):
        if count < 5:
            N[count] = i
        count += 1
        i = 0
        if count == 5:
            break
    return count
"""
    N = np.zeros(5, np.int64)
    assert run(module_of(text)["entry"], N) == len(items)
    assert N.tolist()[: len(items)] == items


def test_a_kernel_may_have_any_name():
    text = """
@kernel
def größe(ω):
    θ = ω * 2.0
    if θ > 0.0:
        return θ
    return -θ
@kernel
def llvm(x):
    y = größe(x[0])
    x[0] = y + 1.0
@kernel
def sin(x):
    llvm(x)
    x[0] += 1.0
@kernel(top=True)
def αβγ(x: Vector):
    sin(x)
"""
    x = np.array([-3.0])
    assert run(module_of(text)["αβγ"], x) == 0
    assert x[0] == 8.0


def test_a_kernel_that_never_ends_by_itself_is_one_without_a_value():
    text = """
@kernel
def forever(x):
    while True:
        x[0] += 1.0
@kernel(top=True)
def entry(x: Vector, k: int) -> int:
    if k:
        forever(x)
    return 3
"""
    assert run(module_of(text)["entry"], np.zeros(1), 0) == 3


def test_what_is_strict_is_not_fused():
    text = "@kernel(top=True, strict=True)\ndef entry(x: Vector):\n    x[0] = mul_add(x[0], x[0], -1.0)\n"
    from sheldrake.common._kernels.generic import mul_add

    x = np.array([1.0 + 2.0**-30])
    expected = x[0] * x[0] - 1.0
    run(module_of(text, mul_add=mul_add)["entry"], x)
    assert x[0] == expected


def test_numbers_of_enumerations_are_numbers():
    import enum

    class Shape(enum.IntEnum):
        BOX = 7

    text = "@kernel(top=True)\ndef entry(k: int) -> int:\n    return Shape.BOX + k\n"
    assert run(module_of(text, Shape=Shape)["entry"], 3) == 10
