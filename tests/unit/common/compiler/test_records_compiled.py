"""Records in machine code: the same memory as Python, on complex numbers too; with bounds checks, never beside it."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
import pytest
from tests.unit.common.compiler.sources import module_of, run
from tools.fuzz_kernels import bounds_checks

from sheldrake.common._native.binding import arguments_in_slab
from sheldrake.common._native.store import can_compile
from sheldrake.common.kernel import INDEX_ERROR, IntMatrix, Matrix, Vector, kernel
from sheldrake.common.record import Each, Items, Record, Stack, array, integer, integers, number, numbers, table, vector

pytestmark = pytest.mark.skipif(not can_compile(), reason="compiles kernels: needs llvmlite")


class Law(Record):
    """A row with one of each."""

    k = number("number")
    V = numbers((3, 3), "tuple of tuples")
    m = numbers((1, 3), "number and tuple")
    w = array((2, 2), "array of two axes")
    s = array(2, "array of one")
    c = number("the same as k", same_as=k)
    rest = array(..., "the rest")


class Tree(Record):
    """Integers."""

    first = integer("integer")
    both = integers(2, "tuple")


class Options(Record):
    """There is one."""

    dt = number("number")
    nodes = array(3, "array")
    pair = numbers(2, "tuple")


class Vecs(Stack):
    """Rows."""

    v = vector("vector")
    dv = vector("vector")


@table
class Things(NamedTuple):
    """All of it."""

    law: Annotated[Matrix, Law]
    J: Annotated[Matrix, Each(3)]
    option: Annotated[Vector, Options]
    tree: Annotated[IntMatrix, Items("trees", Tree)]
    x: Annotated[Matrix, Vecs]


@kernel
def change(row, s):
    row.k += s
    a, b = row.V
    row.V = (b, (a[0] * 2.0, a[1], a[2]))
    m, h = row.m
    row.m = (m + row.c, (h[0], h[1], h[2] * m))
    row.w[1, 0] = row.s[1] * row.w[0, 1]
    for i in range(len(row.rest)):
        row.rest[i] += i


@kernel(top=True, strict=True)
def all_of_it(things: Things, one: Options) -> int:
    for i in range(things.law.shape[0]):
        row = things[i]
        change(row, things.dt)
        row.J[2, 1] = row.c
        row.J[0, 0] += one.dt
    for t in range(len(things.trees)):
        tree = things.trees[t]
        first, second = tree.both
        tree.both = (second, first + tree.first)
        things.dv[t] = things.v[t] * 2.0
    things.dt = 9.0
    things.pair = (things.dv[0], one.nodes[1])
    one.nodes[2] = things.nodes[0]
    return things.trees[1].both[1]


def made(dtype=float):
    rng = np.random.default_rng(1)

    def of(*shape):
        values = rng.normal(size=shape)
        return values if dtype is float else values + 1e-30j * rng.normal(size=shape)

    return Things(of(2, 20), of(6, 2), of(6), rng.integers(9, size=(2, 3)), of(2, 4)), of(6)


def test_the_memory_is_python_s_bit_for_bit():
    (a, one), (b, other) = made(), made()
    assert all_of_it(a, one) == run(all_of_it, b, other)
    for x, y in zip((*a, one), (*b, other)):
        np.testing.assert_array_equal(x, y)


def test_on_complex_numbers_to_first_order():
    """Real parts are the real kernel's; imaginary parts are the difference quotient of the real kernel."""
    (z, one_z), (a, one_a), (h, one_h) = made(complex), made(), made()
    first = [x.copy() for x in (*z, one_z)]
    run(all_of_it.on_complex, z, one_z)
    step = 1e-6
    for x, dx in zip((*a, one_a), first):
        x[...] = dx.real - step * dx.imag * 1e30
    for x, dx in zip((*h, one_h), first):
        x[...] = dx.real + step * dx.imag * 1e30
    run(all_of_it, a, one_a)
    run(all_of_it, h, one_h)
    for w, low, high in zip((*z, one_z), (*a, one_a), (*h, one_h)):
        np.testing.assert_allclose(w.real, (low + high) / 2.0, rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(np.imag(w) * 1e30, (high - low) / (2.0 * step), rtol=1e-8, atol=1e-8)


def test_rows_that_are_longer_than_their_records_are_refused():
    """How long they are is a number in the machine code; the row of a record with an open end may be of any length."""
    a, one = made()
    all_of_it.bind(a._replace(law=np.zeros((2, 25))), one)
    with pytest.raises(TypeError, match=r"things\.tree must be .* of 2 axes, the last of 3, not int64 array of shape"):
        all_of_it.bind(a._replace(tree=np.zeros((2, 4), np.int64)), one)
    places = [(0, *x.shape) for x in a]
    places[3] = (0, 2, 4)
    with pytest.raises(TypeError, match="the last of 3"):
        arguments_in_slab(all_of_it, {"things": places, "one": one})


HEAD = "@kernel(top=True)\ndef entry(things: Things, one: Options, x: Vector, n: IntVector, k: int) -> int:\n"


@pytest.mark.parametrize(
    "line",
    [
        "x[k] = 1.0",
        "things[k].k = 1.0",
        "things.trees[k].first = 1",
        "things[1].J[k, 0] = 1.0",
        "things[1].w[0, k] = 1.0",
        "things[1].s[k] = 1.0",
        "things[1].rest[k] = 1.0",
        "things.nodes[k] = 1.0",
        "one.nodes[k] = 1.0",
        "things.v[k] = 1.0",
        "things.law[0, k] = 1.0",
        "things.law[k, 0] = 1.0",
        "n[0] = (1, 2, 3)[k]",
        "x[0] = (x[0], x[1])[k]",
    ],
)
@pytest.mark.parametrize("k", [-1, 1000, -(2**63), 2**63 - 1, 2**62, (2**64) // 3 + 1, 3 * 2**61])
def test_with_bounds_checks_no_index_leaves_an_array(line, k):
    scope = module_of(f"{HEAD}    {line}\n    n[0] = 7\n    return 3\n", Things=Things, Options=Options)
    things, one = made()
    before = [a.copy() for a in things]
    x, n = np.ones(2), np.zeros(1, np.int64)
    with bounds_checks(True):
        assert run(scope["entry"], things, one, x, n, (k + 2**63) % 2**64 - 2**63) == INDEX_ERROR
    assert n[0] == 0
    for a, b in zip(things, before):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize(
    ("line", "law", "J", "option", "x"),
    [
        ("things[1].k = 1.0", (2, 20), (5, 2), 6, (2, 4)),  # six rows of J are wanted
        ("things[1].V = ((1.0, 2.0, 3.0), (1.0, 2.0, 3.0))", (2, 6), (6, 2), 6, (2, 4)),
        ("things[1].w[0, 0] = 1.0", (2, 14), (6, 2), 6, (2, 4)),
        ("things[1].rest[0] = 1.0", (2, 17), (6, 2), 6, (2, 4)),
        ("x[0] = len(things[1].rest)", (2, 16), (6, 2), 6, (2, 4)),
        ("things.pair = (1.0, 2.0)", (2, 20), (6, 2), 5, (2, 4)),
        ("things.dv[0] = 1.0", (2, 20), (6, 2), 6, (1, 4)),
    ],
)
def test_with_bounds_checks_arrays_too_small_for_their_records_are_found(line, law, J, option, x):
    scope = module_of(f"{HEAD}    {line}\n    return 3\n", Things=Things, Options=Options)
    things = Things(np.ones(law), np.ones(J), np.ones(option), np.ones((2, 3), np.int64), np.ones(x))
    with bounds_checks(True):
        status = run(scope["entry"], things, np.ones(6), np.ones(2), np.zeros(1, np.int64), 0)
    assert status == INDEX_ERROR
    for a in things:
        assert (a == 1).all()


def test_a_status_of_a_kernel_that_was_called_is_not_lost_with_bounds_checks():
    text = """
@kernel(outline=True)
def deep(x, k):
    x[k] += 1.0
    return 5
@kernel
def middle(x, k):
    for i in range(2):
        x[0] += deep(x, k + i)
@kernel(top=True)
def entry(x: Vector, n: IntVector, k: int):
    middle(x, k)
    n[0] = 1
"""
    with bounds_checks(True):
        x, n = np.zeros(3), np.zeros(1, np.int64)
        assert run(module_of(text)["entry"], x, n, 2) == INDEX_ERROR
        assert x.tolist() == [5.0, 0.0, 1.0] and n[0] == 0
        assert run(module_of(text)["entry"], x, n, 1) == 0
        assert x.tolist() == [15.0, 1.0, 2.0] and n[0] == 1
