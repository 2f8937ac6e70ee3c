"""Queries on fixed arrays: what they take, which stages run, and the three ways in which they are called."""

from __future__ import annotations

import gc
import sys
import tracemalloc
import weakref
from typing import NamedTuple

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.common._native import builtin, instances
from sheldrake.common.calls import Addresses, Calls, CallsInMemory, Memory, object_query
from sheldrake.common.kernel import MISFIT, IntVector, Matrix, Vector, jit_enabled, kernel

pytestmark = pytest.mark.twin


@kernel(top=True)
def square(x: Vector, y: Vector, runs: IntVector) -> int:
    runs[0] += 1
    for k in range(x.shape[0]):
        y[k] = x[k] * x[k]
    return 0 if x[0] == x[0] else 5


@kernel(top=True)
def apply(t: float, A: Matrix, b: Vector, y: Vector, scale: float, out: Vector) -> int:
    for i in range(A.shape[0]):
        out[i] = t
        for j in range(A.shape[1]):
            out[i] += scale * A[i, j] * y[j] * b[j]
    return 7 if b[0] < 0.0 else 0


WAYS = ["builtin", "ctypes", "python"]


@pytest.fixture(params=WAYS)
def way(request, monkeypatch):
    if request.param == "builtin" and not builtin.available():
        pytest.fail("this interpreter has no builtin calls")
    if request.param != "builtin":
        monkeypatch.setattr(builtin, "available", lambda: False)
        monkeypatch.setattr(instances, "available", lambda: False)
    return request.param


class Setup:
    def __init__(self, way: str):
        self.x, self.y, self.runs = np.array([1.0, 2.0, 3.0]), np.zeros(3), np.zeros(1, np.int64)
        self.counter, self.out = np.zeros(1, np.int64), np.zeros(2)
        self.calls = Calls(self.counter, native=way != "python")
        self.bit = self.calls.stage(square, self.x, self.y, self.runs)
        example = (0.5, np.zeros((2, 3)), np.zeros(3), self.y, 2.0, self.out)
        self.ask = self.calls.query(apply, *example, given=("A", "b"), needs=self.bit)


A, B = np.arange(6.0).reshape(2, 3), np.array([1.0, -1.0, 0.5])


def test_numbers_are_given(way):
    s = Setup(way)
    A, b = np.arange(6.0).reshape(2, 3), np.ones(3)
    example = (0.5, A, b, s.y, 2.0, s.out)
    ask = s.calls.query(apply, *example, given=("scale", "b"), needs=s.bit, answer=s.out)
    expected = 0.5 + A @ (b * s.x**2) * 3.0
    for scale in (3.0, np.float64(3.0)):
        np.testing.assert_allclose(ask(scale, b), expected, rtol=1e-15)
    for wrong in (3, "3", None, np.float32(3.0), np.array(3.0), np.ones(3), True):
        assert ask(wrong, b) == MISFIT
    assert ask(b, b) == ask(3.0, 3.0) == ask(3.0) == MISFIT
    np.testing.assert_allclose(ask(-3.0, b), 1.0 - expected, rtol=1e-15)


def test_a_query_takes_given_arrays_and_runs_the_stages_it_needs_once(way):
    s = Setup(way)
    assert s.ask(A, B) == 0
    np.testing.assert_array_equal(s.out, 0.5 + 2.0 * A @ (B * s.y))
    np.testing.assert_array_equal(s.y, [1.0, 4.0, 9.0])
    assert s.ask(A + 1, B + 1) == 0
    np.testing.assert_array_equal(s.out, 0.5 + 2.0 * (A + 1) @ ((B + 1) * s.y))
    assert s.runs[0] == 1


def test_a_stage_that_no_query_needs_is_not_even_compiled(monkeypatch):
    bound = []
    words = Calls._words
    monkeypatch.setattr(Calls, "_words", lambda self, *call: bound.append(call[0]) or words(self, *call))
    x, y, z, runs, counter = np.ones(3), np.zeros(3), np.zeros(3), np.zeros(1, np.int64), np.zeros(1, np.int64)
    calls = Calls(counter)
    first, second = calls.stage(square, x, y, runs), calls.stage(square, y, z, runs)
    ask = calls.stages(first)
    assert ask() == 0 and runs[0] == 1 and bound.count(square) == 1 * jit_enabled()
    assert calls.update(second) == 0 and runs[0] == 2 and bound.count(square) == 2 * jit_enabled()


def test_a_changed_counter_makes_stages_old(way):
    s = Setup(way)
    s.ask(A, B)
    s.x[:] = 2.0
    s.ask(A, B)
    assert s.runs[0] == 1 and s.y[0] == 1.0
    s.counter[0] += 1
    s.ask(A, B)
    assert s.runs[0] == 2 and s.y[0] == 4.0
    assert s.calls.update(s.bit) == 0 and s.runs[0] == 2
    s.calls.outdate()
    assert s.calls.update(s.bit) == 0 and s.runs[0] == 3
    s.ask(A, B)
    assert s.runs[0] == 3


def test_statuses_come_back_and_a_failed_stage_is_tried_again(way):
    s = Setup(way)
    assert s.ask(A, -B) == 7
    s.x[0], s.counter[0] = np.nan, 1
    assert s.ask(A, B) == 5 and s.ask(A, B) == 5
    assert s.runs[0] == 3
    s.x[0] = 1.0
    assert s.ask(A, B) == 0


class Special(np.ndarray):
    pass


WRONG = {
    "too few": (A,),
    "too many": (A, B, B),
    "a list": (A, [1.0, 2.0, 3.0]),
    "a number": (A, 1.0),
    "nothing": (A, None),
    "integers": (A, np.array([1, 2, 3])),
    "single precision": (A, B.astype(np.float32)),
    "another length": (A, np.zeros(4)),
    "another number of axes": (A, np.zeros((3, 1))),
    "another second axis": (np.zeros((2, 4)), B),
    "no axes": (A, np.array(1.0)),
    "strided": (A, np.zeros(6)[::2]),
    "Fortran's order": (np.asfortranarray(A), B),
    "a subclass": (A, B.view(Special)),
    "the other byte order": (A, B.astype(">f8")),
}  # fmt: skip


@pytest.mark.parametrize("arguments", WRONG.values(), ids=WRONG.keys())
def test_arguments_that_do_not_fit_are_refused_and_nothing_runs(way, arguments):
    s = Setup(way)
    assert s.ask(*arguments) == MISFIT
    assert s.runs[0] == 0 and not s.out.any()


def test_arrays_that_are_not_aligned_are_refused():
    raw = np.zeros(40, np.uint8)
    start = (-raw.__array_interface__["data"][0]) % 8 + 1
    crooked = raw[start : start + 24].view(np.float64)
    assert not crooked.flags.aligned and crooked.flags.c_contiguous
    if jit_enabled():
        assert Setup("builtin").ask(A, crooked) == MISFIT


def test_a_query_without_arguments_keeps_its_arrays_alive(way):
    counter = np.zeros(1, np.int64)
    x, y, runs = np.array([3.0]), np.zeros(1), np.zeros(1, np.int64)
    calls = Calls(counter, native=way != "python")
    ask = calls.query(square, x, y, runs)
    alive = weakref.ref(x)
    del x, calls
    gc.collect()
    assert alive() is not None
    assert ask() == 0 and y[0] == 9.0
    del ask
    gc.collect()
    assert alive() is None


def test_the_answer_is_a_copy_that_the_caller_owns(way):
    s = Setup(way)
    example = (0.5, np.zeros((2, 3)), np.zeros(3), s.y, 2.0, s.out)
    ask = s.calls.query(apply, *example, given=("A", "b"), needs=s.bit, answer=s.out)
    first = ask(A, B)
    np.testing.assert_array_equal(first, 0.5 + 2.0 * A @ (B * s.y))
    assert first.flags.owndata and first.flags.writeable
    first[:] = 0.0
    np.testing.assert_array_equal(ask(A, B), 0.5 + 2.0 * A @ (B * s.y))
    assert ask(A, -B) == 7 and ask(A) == MISFIT


def test_a_frozen_answer_cannot_be_written(way):
    s = Setup(way)
    for answer in (s.y, s.y.reshape(3, 1)):
        new = s.calls.stages(s.bit, answer=answer, frozen=True)()
        np.testing.assert_array_equal(new, answer)
        assert new.flags.c_contiguous and not np.shares_memory(new, answer)
        with pytest.raises(ValueError, match="read-only"):
            new[0] = 1.0


class Inner:
    __slots__ = ("numbers",)


class Outer(Inner):  # a slot of a base, one with a value and one that stays empty
    __slots__ = ("__weakref__", "empty", "inner")


def objects_of(s):
    ask = s.calls.stages(s.bit, answer=s.y, frozen=True)
    return object_query(Outer, inner=object_query(Inner, numbers=ask), numbers=ask)


def test_objects_are_made_of_answers(way):
    s = Setup(way)
    make = objects_of(s)
    first, second = make(), make()
    assert type(first) is Outer and type(first.inner) is Inner and gc.is_tracked(first)
    np.testing.assert_array_equal(first.numbers, [1.0, 4.0, 9.0])
    np.testing.assert_array_equal(first.inner.numbers, [1.0, 4.0, 9.0])
    arrays = [first.numbers, first.inner.numbers, second.numbers, second.inner.numbers, s.y]
    assert not any(np.shares_memory(a, b) for i, a in enumerate(arrays) for b in arrays[:i])
    assert not hasattr(first, "empty")
    first.empty = first.inner.numbers  # slots can be written as those of any object
    assert first.empty is first.inner.numbers
    s.x[:], s.counter[0] = 2.0, 1
    np.testing.assert_array_equal(make().numbers, [4.0, 4.0, 4.0])


def test_objects_are_given_back():
    s = Setup("builtin")
    make = objects_of(s)
    alive = weakref.ref(make())
    assert alive() is None
    classes = sys.getrefcount(Outer), sys.getrefcount(Inner)
    kept = [make() for _ in range(100)]
    kept[0].empty = kept[0]  # a circle, for the collector
    alive = weakref.ref(kept[0])
    del kept
    gc.collect()
    assert alive() is None
    assert (sys.getrefcount(Outer), sys.getrefcount(Inner)) == classes


def test_without_the_code_objects_are_made_by_python(monkeypatch):
    assert instances.available()
    monkeypatch.setattr(instances.INSTANCE, "address", None)
    assert not instances.available.__wrapped__()


def test_a_slot_that_is_not_there_is_an_error_and_leaves_nothing():
    s = Setup("builtin")
    ask = s.calls.query(square, s.x, s.y, s.runs, answer=s.y)
    before = sys.getrefcount(Inner)
    make = object_query(Inner, nowhere=ask)
    with pytest.raises(AttributeError, match="nowhere"):
        make()
    del make
    gc.collect()
    assert sys.getrefcount(Inner) == before


def test_answers_are_given_back():
    """Neither queries nor their answers leave anything behind."""
    s = Setup("builtin")
    ask = s.calls.query(square, s.x, s.y, s.runs, answer=s.y)

    def use():
        for _ in range(10_000):
            ask()

    use()
    gc.collect()
    tracemalloc.start()
    use()
    grown, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert grown < 10_000


class Gains(NamedTuple):
    K: Matrix
    d: Vector


@kernel(top=True)
def gained(model: Gains, x: Vector, y: Vector, side: IntVector) -> int:
    side[3] += 1
    for i in range(y.shape[0]):
        y[i] = model.d[i]
        for k in range(x.shape[0]):
            y[i] += model.K[i, k] * x[k]
    return 0 if x[0] == x[0] else 5


@kernel(top=True)
def scaled(model: Gains, y: Vector, b: Vector, scale: float, out: Vector) -> int:
    for i in range(out.shape[0]):
        out[i] = scale * y[i] + b[i] + model.d[i]
    return 0


@pytest.mark.skipif(not jit_enabled() or not builtin.available(), reason="no builtin functions here")
def test_one_query_serves_many_memories():
    refused = []
    models = [Gains(np.array([[k, 2.0], [3.0, 4.0]]), np.array([0.5, -k])) for k in (1.0, 7.0)]
    addresses = [Addresses.of((*model,), k) for k, model in enumerate(models)]
    like = Memory(np.zeros(3), np.zeros(5, np.int64), np.zeros(6, np.int64), addresses[0])
    calls = CallsInMemory(like, 0, 1, lambda *given: refused.append(given) or "refused")
    x, y, out = like.slab[1:], like.room.view(float)[3:5], np.zeros(2)
    bit = calls.stage(gained, models[0], x, y, like.side)
    example = models[0], y, np.zeros(2), 1.0, out
    ask = calls.query(scaled, *example, given=("b", "scale"), needs=bit, answer=out)
    made = object_query(Inner, numbers=calls.part(bit, y, 2))
    assert addresses[0].form == addresses[1].form and addresses[1].owner == 1
    b, memories = np.array([10.0, 20.0]), []
    for k, slab in enumerate(np.arange(12.0).reshape(4, 3)):
        side, room = np.zeros(5, np.int64), np.zeros(6, np.int64)
        side[0] = 1
        memories.append(Memory(slab, side, room, addresses[k % 2]))
    for _ in range(2):  # by turns
        for memory in memories:
            K, d = models[memory.models.owner]
            y = K @ memory.slab[1:] + d
            np.testing.assert_array_equal(ask(memory, b, 2.0), 2.0 * y + b + d)
            np.testing.assert_array_equal(made(memory).numbers, y)
            np.testing.assert_array_equal(memory.room.view(float)[3:5], y)
            assert memory.room[1] == 1 and memory.room[2] == bit and memory.side[3] == 1
    memory = memories[2]
    assert ask(memory, b) == ask(memory) == ask() == ask(memory, b, b) == MISFIT
    memory.slab[1], memory.side[0] = np.nan, 2
    assert ask(memory, b, 1.0) == "refused" and refused[0][0] is memory.slab and refused[0][1] is memory.models


def test_duals_go_through_python():
    x = np.array([AutoDiffXd(3.0, [1.0])], object)
    y, runs = np.array([0.0], object), np.zeros(1, np.int64)
    ask = Calls(np.zeros(1, np.int64), native=False).query(square, x, y, runs, given=("x",))
    assert ask(x) == 0
    assert y[0].derivatives()[0] == 6.0
    assert ask(np.array([2.0])) == 0 and y[0] == 4.0


def test_no_code_no_builtin_calls(monkeypatch):
    """Where the code cannot be had, or objects look otherwise, calls go through ctypes."""
    monkeypatch.setattr(builtin.QUERY, "address", None)
    assert not builtin.available.__wrapped__()
    monkeypatch.undo()
    monkeypatch.setattr(builtin, "_DTYPE", 48)
    assert not builtin.available.__wrapped__()
