"""Kernels on four worlds at once give each the bits that it gets alone, or say that the worlds do not agree."""

import math
from fractions import Fraction

import numpy as np
import pytest

from sheldrake.common._kernels.generic import atan2, clip, cos, floor, in_any, is_finite, mul_add, sin, sqrt, whole
from sheldrake.common._kernels.vec import add3, cross3, dot3, magnitude, read3, write3
from sheldrake.common._native.target import host
from sheldrake.common.kernel import DISAGREEMENT, IntVector, Matrix, Vector, Vectors, jit_enabled, kernel
from sheldrake.common.rows import into_lanes, out_of_lanes

pytestmark = pytest.mark.skipif(not jit_enabled(), reason="lanes are machine code")
WORLDS = 4


@kernel
def ends(x):
    """Sums of products in several forms, across calls."""
    a, b = read3(x, 0), read3(x, 3)
    return add3(cross3(a, b), (dot3(a, b), a[0] * b[0] - a[1] * b[1], a[2] - a[0] * b[2]))


@kernel(top=True)
def numbers(x: Vector, y: Vector, model: Vector) -> None:
    """All that lanes can do."""
    write3(y, 0, ends(x))
    y[3] = sin(x[0]) * cos(x[1]) + atan2(x[2], x[3])
    y[4] = sqrt(abs(x[4])) + floor(x[5]) - magnitude(x[0])
    y[5] = min(x[0], x[1]) + max(x[2], 0.5) + clip(x[3], -0.5, 0.5)
    y[6] = mul_add(x[0], x[1], -x[2]) / (1.0 + x[3] ** 2)
    total = 0.0
    for k in range(model.shape[0]):
        total += model[k] * x[k]
    y[7] = total
    low = x[0] if x[0] < x[1] else 2 * x[1]
    y[8] = low if x[2] > 0.0 else 0.0


@kernel(top=True)
def words(x: Vector, n: IntVector, M: Matrix, u: Vectors) -> int:
    """Integers are those of all worlds; where it goes may depend on what all worlds agree on."""
    n[1] = n[0] + 1
    for k in range(n[0]):
        M[k, 1] = x[k] + u[1][0]
    if x[0] > 0.0 and not is_finite(x[1]):
        return 3
    if x[2] < 0.0:
        M[0, 0] = 7.0
    decided = x[3] == 0.0
    if decided:
        return 0
    return 4


@kernel
def product(a, b):
    return a * b


@kernel(top=True)
def sums(x: Vector, y: Vector) -> None:
    a, b, c, d = x[0], x[1], x[2], x[3]
    y[0] = product(a, b) + c
    y[1] = c - product(a, b)
    y[2] = product(a, b) - c
    y[3] = product(a, b) + c * d
    y[4] = a * b - product(c, d)


@pytest.mark.skipif(jit_enabled() and host().level < 3, reason="this processor has no instruction for it")
def test_which_sums_are_rounded_once_is_told_by_the_source():
    def rounded(*parts):
        return float(sum(Fraction(part) for part in parts))

    rng, y = np.random.default_rng(2), np.zeros(5)
    for _ in range(100):
        a, b, c, d = x = rng.normal(size=4)
        sums.native(x, y)
        ab, cd = Fraction(a) * Fraction(b), Fraction(c) * Fraction(d)
        expected = [rounded(ab, c), rounded(c, -ab), rounded(ab, -c), rounded(a * b, cd), rounded(a * b, -cd)]
        assert y.tolist() == expected


class Four:
    """Memory of four worlds in lanes: arrays of lanes, and what they are in one world."""

    def __init__(self, kernel):
        self.kernel = kernel

    def run(self, worlds):
        """Runs the kernel in lanes on the arguments of four worlds; status, and the arrays of each afterwards."""
        kernel, parameters = self.kernel.on_lanes, self.kernel.parameters
        arrays = [[a for arg in world for a in (arg if isinstance(arg, tuple) else (arg,))] for world in worlds]
        size = sum(a.size for a in arrays[0])
        memory = np.zeros(4 * size + 4)
        begin = -(memory.ctypes.data // 8) % 4  # vectors begin at multiples of 32 bytes
        slab = memory[begin : begin + 4 * size].reshape(size, 4)
        at, places = 0, []
        for i, a in enumerate(arrays[0]):
            for w in range(WORLDS):
                slab[at : at + a.size, w] = np.ascontiguousarray(arrays[w][i]).reshape(-1).view(float)
            places.append((at, *a.shape))
            at += a.size
        status = kernel.function(0.0, slab.ctypes.data, self.words(worlds[0], parameters, places).ctypes.data)
        found = [
            [slab[p[0] : p[0] + a.size, w].copy().view(a.dtype).reshape(a.shape) for p, a in zip(places, arrays[0])]
            for w in range(WORLDS)
        ]
        return status, found

    def words(self, arguments, parameters, places):
        """What the kernel is called with."""
        head, behind, left = [], [], iter(places)
        count = sum(2 if p.kind == "arrays" else 1 + p.fields[0].ndim for p in parameters)
        for parameter, argument in zip(parameters, arguments):
            if parameter.kind == "arrays":
                head += [len(argument), count + len(behind)]
                for _ in argument:
                    behind += next(left)
            elif parameter.fields[0].absolute:
                next(left)
                self.keep = argument
                head += [argument.ctypes.data, *argument.shape]
            else:
                head += next(left)
        return np.array([*head, *behind, 0], np.int64)


def test_each_world_gets_the_bits_it_gets_alone():
    rng, four = np.random.default_rng(0), Four(numbers)
    model = rng.normal(size=6)
    for _ in range(50):
        worlds = [(rng.normal(size=6), np.zeros(9), model) for _ in range(WORLDS)]
        status, found = four.run(worlds)
        assert status == 0
        for world, (_, y, _) in zip(worlds, found):
            numbers.native(*world)
            np.testing.assert_array_equal(y.view(np.int64), world[1].view(np.int64))


def world_of(x, n=2):
    return np.array(x), np.array([n, 0]), np.zeros((3, 2)), (np.zeros(2), np.array([0.5, 9.0]))


def test_integers_tables_and_inputs():
    worlds = [world_of([1.0 + w, 2.0, 3.0, 0.0]) for w in range(WORLDS)]
    status, found = Four(words).run(worlds)
    assert status == 0
    for w, (_, n, M, *_) in enumerate(found):
        assert n.tolist() == [2, 3]
        assert M.tolist() == [[0.0, 1.5 + w], [0.0, 2.5], [0.0, 0.0]]


@pytest.mark.parametrize(
    ("x", "status"),
    [([1.0, math.nan, 3.0, 0.0], 3), ([1.0, 2.0, -3.0, 0.0], 0), ([1.0, 2.0, 3.0, 1.0], 4)],
    ids=["not finite", "negative", "kept"],
)
def test_worlds_that_agree_go_on_and_others_are_told(x, status):
    same = [world_of(x) for _ in range(WORLDS)]
    assert Four(words).run(same)[0] == status == words.native(*same[0])
    one_differs = [world_of(x if w == 2 else [1.0, 2.0, 3.0, 0.0]) for w in range(WORLDS)]
    assert Four(words).run(one_differs)[0] == DISAGREEMENT


@kernel(top=True)
def choices(x: Vector, y: Vector) -> int:
    """Numbers that are known may differ by lane, integers not."""
    y[0], y[1] = (1.0, x[1]) if x[0] > 0.0 else (-1.0, 0.0)
    kind = 10 if x[1] > 0.0 else 20
    if in_any(x[0] > 0.0) and in_any(kind == 10):
        kind += 100
    return kind + whole(x[2])


def test_choices_of_known_numbers_and_of_integers():
    worlds = [(np.array([w - 1.5, 2.0, 3.0 + 0.1 * w]), np.zeros(2)) for w in range(WORLDS)]
    status, found = Four(choices).run(worlds)
    assert status == 113
    assert [y.tolist() for _, y in found] == [[-1.0, 0.0], [-1.0, 0.0], [1.0, 2.0], [1.0, 2.0]]
    for changed in ([0.5, -2.0, 3.0], [0.5, 2.0, 4.0], [0.5, 2.0, math.nan]):
        worlds[2] = np.array(changed), np.zeros(2)
        assert Four(choices).run(worlds)[0] == DISAGREEMENT


@kernel(top=True)
def there_and_back(rows: Matrix, who: IntVector, lanes: Matrix, begin: int, end: int, other: Matrix) -> None:
    into_lanes(rows, who, 1, lanes, begin, end)
    out_of_lanes(other, who, 1, lanes, begin, end)


@pytest.mark.parametrize("span", [(0, 4), (1, 6), (3, 14), (0, 16)])
@pytest.mark.parametrize("way", ["python", "native"])
def test_numbers_of_four_rows_go_into_lanes_and_back(span, way):
    begin, end = span
    rows, who = np.random.default_rng(1).normal(size=(6, 16)), np.array([9, 4, 0, 5, 1])
    lanes, other = np.zeros((16, 4)), np.zeros((6, 16))
    run = there_and_back if way == "python" else there_and_back.native
    run(rows, who, lanes, begin, end, other)
    expected, back = np.zeros((16, 4)), np.zeros((6, 16))
    expected[begin:end] = rows[who[1:], begin:end].T
    back[who[1:], begin:end] = rows[who[1:], begin:end]
    np.testing.assert_array_equal(lanes, expected)
    np.testing.assert_array_equal(other, back)
