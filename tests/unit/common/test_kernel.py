"""Kernels: the same source as Python and as machine code, and what is refused."""

from __future__ import annotations

import ast
import enum
import linecache
import math
import os
import subprocess
import sys
import types
from typing import NamedTuple

import numpy as np
import pytest

import sheldrake.math
from sheldrake.common._kernels import generic
from sheldrake.common._kernels.generic import sin, sqrt
from sheldrake.common._kernels.vec import load3, rotate, rotation_about, store3
from sheldrake.common._native import store
from sheldrake.common._native.compiler.module import text_of
from sheldrake.common._native.compiler.source import source_of
from sheldrake.common.kernel import IntVector, Matrix, Vector, Vectors, jit_enabled, kernel
from sheldrake.common.record import Record, array, number
from sheldrake.common.rows import call_row, prefetch

native_only = pytest.mark.skipif(not jit_enabled(), reason="asks about machine code; SHELDRAKE_JIT=0 switches it off")


class Points(NamedTuple):
    p: Matrix
    kind: IntVector


@kernel
def turned(p, angle):
    return rotate(rotation_about((0.0, 0.0, 1.0), angle), p)


@kernel(outline=True)
def turn_row(points, i, angle):
    store3(points.p, i, turned(load3(points.p, i), angle))


@kernel(top=True)
def turn_all(t: float, points: Points, angle: float, first: int, u: Vectors, out: Vector) -> int:
    for i in range(first, points.p.shape[0]):
        turn_row(points, i, angle)
    out[0] = sqrt(t) + sin(angle)
    for k in range(len(u)):
        out[0] += u[k][0]
    points.kind[0] += 1
    return 7


@kernel(top=True)
def double_first(model: Vector, x: Vector):
    x[0] = 2.0 * x[0] + model[0]


@kernel(top=True, strict=True)
def run_rows(rows: IntVector, slab: Vector, words: IntVector, n: int) -> int:
    status = 0
    for _ in range(n):
        status += call_row(rows, 0, 0.0, slab, words, 2)
    return status


@kernel(top=True)
def ask_for_rows(points: Points, out: Vector):
    for i in range(points.p.shape[0]):
        prefetch(points.p, i, 2)
        prefetch(out, 0)
        out[0] += points.p[i, 2]


def arguments():
    rng = np.random.default_rng(1)
    points = Points(rng.normal(size=(4, 3)), np.zeros(1, np.int64))
    return 4.0, points, 0.3, 1, (np.ones(2), np.full(1, 5.0)), np.zeros(1)


def test_native_and_python_agree():
    plain, bound = arguments(), arguments()
    assert turn_all(*plain) == 7
    assert turn_all.bind(*bound)() == 7
    np.testing.assert_allclose(bound[1].p, plain[1].p, rtol=1e-15)
    assert bound[1].kind[0] == plain[1].kind[0] == 1
    np.testing.assert_allclose(bound[5], 2.0 + np.sin(0.3) + 6.0, rtol=1e-15)


def test_asking_for_memory_changes_nothing():
    points, plain, bound = arguments()[1], np.zeros(1), np.zeros(1)
    ask_for_rows(points, plain)
    ask_for_rows.bind(points, bound)()
    assert plain[0] == bound[0] == sum(points.p[:, 2])
    assert text_of(ask_for_rows, "k").partition("define")[2].count("@llvm.prefetch.p0(ptr") == 2


def test_bound_scalars_can_be_changed():
    args = arguments()
    before = args[1].p.copy()
    call = turn_all.bind(*args)
    call.set("angle", 0.0)
    call.set("first", 4)
    call()
    np.testing.assert_array_equal(args[1].p, before)


@pytest.mark.parametrize(
    ("place", "wrong", "message"),
    [
        (1, (np.zeros((4, 3)), np.zeros(1, np.int64)), "points must be a Points"),
        (1, Points(np.zeros((3, 4)).T, np.zeros(1, np.int64)), "points.p must be a C-contiguous float64"),
        (1, Points(np.zeros((4, 3)), np.zeros(1)), "points.kind must be a C-contiguous int64"),
        (5, np.zeros((1, 1)), "out must be a C-contiguous float64 array of 1 axes"),
        (4, (np.zeros(1, np.float32),), r"u\[0\]"),
        (3, 0.5, "first must be a whole number of 64 bits, not 0.5"),
        (3, 2**63, "first must be a whole number of 64 bits, not 9223372036854775808"),
    ],
)
def test_wrong_arguments_are_refused(place, wrong, message):
    args = list(arguments())
    args[place] = wrong
    with pytest.raises(TypeError, match=message):
        turn_all.bind(*args)
    with pytest.raises(TypeError, match="takes 6 arguments"):
        turn_all.bind(1.0)


def test_inner_kernel_cannot_be_bound():
    with pytest.raises(TypeError, match="inner kernel"):
        turned.bind((0.0, 0.0, 0.0), 1.0)


def test_unannotated_entry_is_refused():
    @kernel(top=True)
    def bad(x):
        x[0] = 0.0

    with pytest.raises(TypeError, match="parameter 'x' is annotated None"):
        bad.bind(np.zeros(1))


@native_only
def test_rows_are_called_by_address_relative_to_the_slab():
    model, slab = np.array([1.0]), np.array([-1.0, 3.0])
    words = np.array([99, 99, model.ctypes.data, 1, 1, 1], np.int64)  # model: address, size; x: offset 1, size 1
    rows = np.array([double_first.address], np.int64)
    assert run_rows.bind(rows, slab, words, 3)() == 0
    assert slab.tolist() == [-1.0, 31.0]


def test_rows_interpreted():
    x = np.array([3.0])
    assert run_rows([lambda: double_first(np.array([1.0]), x)], None, None, 3) == 0
    assert x[0] == 31.0


@native_only
def test_allocation_is_refused():
    @kernel(top=True)
    def allocates(x: Vector):
        y = np.zeros(3)
        x[0] = y[0]

    with pytest.raises(Exception, match=r"NRT|nrt|allocat"):
        allocates.bind(np.zeros(3))


def test_a_changed_helper_constant_or_annotation_is_another_kernel():
    def make(constant, annotation):
        @kernel
        def helper(x):
            return constant * x

        def entry(x: annotation):
            x[0] = helper(x[0])

        entry.__annotations__ = {"x": annotation}
        return store.fingerprint(kernel(entry, top=True))

    assert make(1.0, Vector) == make(1.0, Vector)
    assert len({make(1.0, Vector), make(2.0, Vector), make(1.0, IntVector)}) == 3


def test_a_changed_docstring_is_the_same_kernel():
    def make(docstring, constant="2.0"):
        text = f"def entry(x: Vector):\n    {docstring}\n    x[0] = {constant} * x[0]\n"
        scope = {"Vector": Vector}
        exec(text, scope)
        return store.fingerprint(kernel(scope["entry"], top=True))

    assert make('"""One."""') == make('"""Another,\n    longer."""')
    assert make('"""One."""') != make('"""One."""', "3.0")


def test_short_loops_are_another_kernel_of_the_same_bits():
    def entry(x: Vector, y: Vector):
        for i in range(x.shape[0]):
            y[i] += sin(x[i]) * x[i]

    plain, short = kernel(entry, top=True), kernel(entry, top=True, short_loops=True)
    assert store.fingerprint(plain) != store.fingerprint(short)
    x = np.linspace(-3.0, 3.0, 37)
    y, z = np.ones(37), np.ones(37)
    plain.native(x, y)
    short.native(x, z)
    assert np.array_equal(y, z)


def test_a_changed_kernel_of_another_module_is_another_kernel():
    def make(constant):
        @kernel
        def helper(x):
            return x * other.FACTOR

        other = types.ModuleType("other")
        other.helper, other.FACTOR = helper, constant

        def entry(x: Vector):
            x[0] = other.helper(x[0])

        return store.fingerprint(kernel(entry, top=True))

    assert make(1.0) == make(1.0)
    assert make(1.0) != make(2.0)


def test_a_changed_kernel_in_a_tuple_is_another_kernel():
    def make(constant):
        @kernel
        def helper(x):
            return constant * x

        class Law(NamedTuple):
            force: object
            order: int

        laws = ((helper, 1.0), Law(helper, 2))

        def entry(x: Vector):
            x[0] = laws[0][0](x[0])

        return kernel(entry, top=True)

    assert store.fingerprint(make(1.0)) == store.fingerprint(make(1.0))
    assert store.fingerprint(make(1.0)) != store.fingerprint(make(2.0))


def test_a_changed_constant_of_a_class_or_an_object_is_another_kernel():
    def make(of_class, of_object, of_member):
        class Gains:
            K = of_class

        class Mode(enum.Enum):
            FAST = of_member

        limits = types.SimpleNamespace(torque=types.SimpleNamespace(largest=of_object))

        def entry(x: Vector):
            x[0] = Gains.K * x[0] + limits.torque.largest + Mode.FAST.value

        return store.fingerprint(kernel(entry, top=True))

    assert make(1.0, 2.0, 3.0) == make(1.0, 2.0, 3.0)
    assert len({make(1.0, 2.0, 3.0), make(4.0, 2.0, 3.0), make(1.0, 4.0, 3.0), make(1.0, 2.0, 4.0)}) == 4


@native_only
def test_a_name_that_has_no_value_yet_is_refused_where_it_stands():
    def entry(x: Vector):
        x[0] = later

    entry_kernel = kernel(entry, top=True)
    assert store.fingerprint(entry_kernel)
    with pytest.raises(TypeError, match="`later` has no value here"):
        entry_kernel.bind(np.zeros(3))
    later = 1.0


def test_an_array_at_an_odd_address_is_refused():
    def entry(x: Vector):
        x[0] = 1.0

    odd = np.zeros(17, np.uint8)[1:].view(np.float64)
    with pytest.raises(TypeError, match="not float64 array of shape \\(2,\\) at an odd address"):
        kernel(entry, top=True).bind(odd)


def test_plain_python_helper_is_refused():
    def helper(x):
        return x

    @kernel(top=True)
    def entry(x: Vector):
        x[0] = helper(x[0])

    with pytest.raises(TypeError, match=r"(?s)test_kernel.py:\d+:16: .* not 'helper': make it a @kernel\n.*helper\(x"):
        text_of(entry, "entry")


@kernel
def odd_numbers(n):
    """For loops: the odd numbers below n, each with its place; none of an n that is negative."""
    if n < 0:
        return
    place = 0
    for i in range(n):
        if i % 2 == 0:
            continue
        yield place, i
        place += 1


@kernel(top=True)
def loop_over_odd_numbers(n: int, out: Vector) -> int:
    total = 0
    for place, i in odd_numbers(n):
        out[place] = i
        for _, j in odd_numbers(i):  # within itself
            if j == 5:
                continue
            if j > 7:
                break
            total += j
        if i == 21:
            return -1
    return total


@pytest.mark.parametrize("n", [-1, 0, 1, 8, 20, 40])
def test_loops_over_a_kernel_that_yields(n):
    native, plain = np.zeros(20), np.zeros(20)
    assert loop_over_odd_numbers.native(n, native) == loop_over_odd_numbers(n, plain)
    np.testing.assert_array_equal(native, plain)


@kernel
def down_from(x):
    """For loops: the numbers before the end of x, the last one first."""
    yield from range(len(x) - 1, -1, -1)


@kernel(top=True)
def reverse(x: Vector, out: Vector) -> int:
    place = 0
    for i in down_from(x):
        out[place] = x[i]
        place += 1
    return place


def test_a_kernel_may_yield_from_another_loop():
    out = np.zeros(3)
    assert reverse.native(np.array([1.0, 2.0, 3.0]), out) == 3
    np.testing.assert_array_equal(out, [3.0, 2.0, 1.0])


@kernel
def sums(x):
    """For loops: sums of the first numbers of x, then of more of them."""
    total = 0.0
    for i in range(len(x)):
        total += x[i]
        yield total


@kernel(top=True)
def sum_of_sums(x: Vector) -> int:
    total = 0.0
    for s in sums(x):
        total += s
    x[0] = total
    return 0


@native_only
def test_variables_of_a_kernel_that_yields_become_complex():
    x = np.array([1.0 + 2.0j, 3.0, 4.0j])
    sum_of_sums.on_complex.native(x)
    assert x[0] == 9.0 + 10.0j


def test_what_a_kernel_that_yields_must_not():
    @kernel
    def twice(n):
        yield n
        yield n

    @kernel
    def again(n):
        for i in again(n):
            yield i + 1

    @kernel
    def once(n):
        yield n

    @kernel(top=True)
    def loops_twice(n: int) -> int:
        for i in twice(n):
            return i
        return 0

    @kernel(top=True)
    def loops_for_ever(n: int) -> int:
        for i in again(n):
            return i
        return 0

    @kernel(top=True)
    def calls(n: int) -> int:
        return once(n)

    @kernel(top=True)
    def gives_too_much(n: int) -> int:
        for i in once(n, n):
            return i
        return 0

    wrong = {
        loops_twice: "yields in one place",
        loops_for_ever: "again loops over itself",
        calls: "it is for loops, `for x in once",
        gives_too_much: r"once\(n\) takes 1 arguments, not 2",
    }
    for entry, message in wrong.items():
        with pytest.raises(TypeError, match=message):
            text_of(entry, "entry")


@native_only
def test_bounds_are_checked_in_loops_over_kernels(tmp_path):
    script = (
        "import numpy as np\nfrom tests.unit.common.test_kernel import loop_over_odd_numbers\n"
        "from sheldrake.common.kernel import INDEX_ERROR\n"
        "assert loop_over_odd_numbers.native(8, np.zeros(4)) == 9\n"
        "assert loop_over_odd_numbers.native(8, np.zeros(3)) == INDEX_ERROR\n"
    )
    env = {**os.environ, "SHELDRAKE_CACHE_DIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(["src", "."])}
    subprocess.run([sys.executable, "-c", script], env={**env, "SHELDRAKE_BOUNDSCHECK": "1"}, check=True)


@pytest.mark.parametrize("module", [np, math, sheldrake.math, generic], ids=lambda module: module.__name__)
def test_mathematics_is_the_same_from_wherever_it_comes(module):
    names = ["sin", "cos", "tan", "sinh", "tanh", "exp", "log", "sqrt"]
    names += ["arcsin", "arctan"] if module is np else ["asin", "atan"]
    atan2 = module.arctan2 if module is np else module.atan2

    def make(f):
        @kernel(top=True)
        def entry(x: Vector):
            x[0] = f(x[0]) + atan2(x[0], 0.25)

        return entry

    for name in names:
        entry = make(getattr(module, name))
        x, y = np.array([0.5]), np.array([0.5])
        entry(x)
        entry.native(y)
        assert x == pytest.approx(y, rel=4e-16), name
        assert y[0] == pytest.approx(getattr(math, name.replace("arc", "a"))(0.5) + math.atan2(0.5, 0.25), rel=1e-15)


def test_cells_of_notebooks_are_made_statement_by_statement(monkeypatch):
    path = "cell of a notebook"
    text = "import numpy as np\n@kernel(top=True)\ndef entry(x: Vector):\n    x[0] = np.exp(x[0])\n"
    monkeypatch.setitem(linecache.cache, path, (len(text), None, text.splitlines(keepends=True), path))
    names = {"kernel": kernel, "Vector": Vector}
    for statement in ast.parse(text).body:
        exec(compile(ast.Module([statement], []), path, "exec"), names)
    assert "exp" in text_of(names["entry"], "entry")
    changed = text.replace("exp", "sin")
    monkeypatch.setitem(linecache.cache, path, (len(text), None, changed.splitlines(keepends=True), path))
    source_of.cache_clear()
    with pytest.raises(TypeError, match="its source has changed"):
        text_of(names["entry"], "entry")


def test_what_mathematics_there_is_not_is_told():
    hypot = math.hypot

    @kernel(top=True)
    def entry(x: Vector):
        x[0] = hypot(x[0], x[1])

    with pytest.raises(TypeError, match="cannot call 'hypot'; of mathematics it has abs, min, max, len, sin"):
        text_of(entry, "entry")


def test_functions_of_one_name_are_told_apart():
    def make(function):
        @kernel(top=True)
        def entry(x: Vector):
            x[0] = function(x[0])

        return store.fingerprint(entry)

    assert len({make(f) for f in (np.sin, np.cos, math.sin, math.cos)}) == 4


def test_an_array_that_was_given_is_not_replaced():
    @kernel(top=True)
    def entry(x: Vector, y: Vector):
        y = 2.0 * x[0]  # noqa: F841

    with pytest.raises(TypeError, match=r"`y` is array of floats .* the caller gave: store into its items"):
        text_of(entry, "entry")


def test_a_plain_function_may_have_the_name_of_a_field():
    def linear():
        return 0.0

    @kernel(top=True)
    def entry(p: Line, x: Vector):
        x[0] = p.linear * x[0]

    entry.py_func.__globals__["linear"] = linear
    try:
        x = np.array([2.0])
        assert entry.native(np.array([1.0, 3.0]), x) == 0 and x[0] == 6.0
    finally:
        del entry.py_func.__globals__["linear"]


class Line(Record):
    constant = number("offset", "m")
    linear = number("slope")


class Weights(Record):
    total = number("sum", "kg")
    each = array(..., "of the parts", "kg")


@kernel(top=True)
def evaluate(p: Line, x: Vector, y: Line) -> None:
    y.constant = p.constant + p.linear * x[0]
    y.linear = 1.0 * p.linear


@kernel(top=True)
def add_up(y: Weights) -> None:
    y.total = 0.0
    for i in range(len(y.each)):
        y.total += y.each[i]


def test_vectors_that_are_records_have_names():
    for run in (evaluate, evaluate.native):
        y = np.zeros(2)
        run(Line.of(constant=1.0, linear=3.0), np.array([2.0]), y)
        assert y.tolist() == [7.0, 3.0]
    for run in (add_up, add_up.native):
        y = np.array([9.0, 1.0, 2.0, 3.0])
        run(y)
        assert y[0] == 6.0


def test_vectors_that_are_no_such_record_are_refused():
    with pytest.raises(TypeError, match="p is a Line of 2 numbers, not of 3"):
        evaluate.bind(np.zeros(3), np.zeros(1), np.zeros(2))
    with pytest.raises(TypeError, match="y is a Weights of 1 or more numbers, not of 0"):
        add_up.bind(np.zeros(0))
    with pytest.raises(TypeError, match="p must be a C-contiguous float64 array of 1 axes"):
        evaluate.bind([1.0, 2.0], np.zeros(1), np.zeros(2))

    @kernel(top=True)
    def misspelt(p: Line, y: Vector):
        y[0] = p.liner

    with pytest.raises(TypeError, match=r"misspelt: Line has no field 'liner'; it has constant, linear\."):
        text_of(misspelt, "misspelt")
    with pytest.raises(AttributeError, match=r"Line has no field 'liner'; it has constant, linear\."):
        misspelt(np.zeros(2), np.zeros(1))


@native_only
def test_damaged_cache_file_is_rebuilt(tmp_path):
    script = (
        "import numpy as np\nfrom tests.unit.common.test_kernel import double_first\n"
        "x = np.ones(1)\ndouble_first.native(np.ones(1), x)\nassert x[0] == 3.0\n"
    )
    env = {**os.environ, "SHELDRAKE_CACHE_DIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(["src", "."])}

    def run():
        command = [sys.executable, "-c", script]
        return subprocess.run(command, env=env, capture_output=True, text=True, check=True).stderr

    assert "compiling double_first" in run()
    assert run() == ""
    (file,) = tmp_path.rglob("*.o")
    file.write_bytes(file.read_bytes()[:-100])
    assert "compiling double_first" in run()
    assert run() == ""


def test_import_needs_no_compiler():
    code = "import sys, sheldrake.common.kernel; assert 'llvmlite' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True, env={**os.environ, "PYTHONPATH": "src"})


@kernel(top=True)
def weighted_sum(t: float, u: Vectors, model: Vector, out: Vector):
    out[0] = t
    for k in range(len(u)):
        for i in range(u[k].shape[0]):
            out[0] += model[k] * u[k][i]


@native_only
@pytest.mark.parametrize("sizes", [(), (3,), (1, 0, 2, 4)])
def test_one_compiled_kernel_takes_any_number_of_vectors(sizes):
    """In a slab, and directly."""
    from sheldrake.common._native.binding import arguments_in_slab

    rng = np.random.default_rng(2)
    slab, model = rng.normal(size=20), rng.normal(size=4)
    starts = np.cumsum([5, *sizes])
    u = tuple(slab[a : a + n].copy() for a, n in zip(starts, sizes))
    expected, direct = np.zeros(1), np.zeros(1)
    weighted_sum(0.5, u, model, expected)
    weighted_sum.native(0.5, u, model, direct)
    np.testing.assert_allclose(direct, expected, rtol=1e-14)
    words = arguments_in_slab(weighted_sum, {"u": list(zip(starts, sizes)), "model": model, "out": (1, 1)}).placed()
    code = weighted_sum._native[0]
    assert code(0.5, slab.ctypes.data, words.ctypes.data) == 0
    np.testing.assert_allclose(slab[1], expected[0], rtol=1e-14)


class Pair(NamedTuple):
    first: Vector
    second: Matrix


@kernel(top=True)
def from_models(one_model: Pair, many: Vectors, place: Pair, x: float, out: Vector):
    out[0] = one_model.first[0] + one_model.second[0, 0] + place.first[0] + place.second[0, 0] + many[0][0] + x


def test_calls_written_together_have_the_words_of_each():
    """Models and scratch that several calls have in common are written once; who has others has others."""
    from sheldrake.common._native.binding import Words, arguments_in_slab, join, join_in_slab

    models = [Pair(np.array([k, 2.0]), np.full((k + 1, 2), 0.5)) for k in range(2)]
    scratch = [[(3, 2), (5, 2, 1)], [(10, 4), (14, 1, 1)]]
    calls = [
        {
            "one_model": models[m],
            "many": [(20, 1), models[0].first],
            "place": scratch[s],
            "x": 0.25 * m,
            "out": (30 + s, 1),
        }
        for m, s in [(0, 0), (1, 0), (0, 1), (0, 0)]
    ]
    together, at = join_in_slab([(from_models, calls[0]), None, *((from_models, c) for c in calls[1:])])
    empty = Words(np.zeros(0, np.int64), ())
    parts = [arguments_in_slab(from_models, c) for c in calls]
    apart, expected_at = join([parts[0], empty, *parts[1:]])
    assert at == expected_at
    np.testing.assert_array_equal(together.words, apart.words)
    assert [(r.at, id(r.array), r.absolute) for r in together.relocations] == [
        (r.at, id(r.array), r.absolute) for r in apart.relocations
    ]
    np.testing.assert_array_equal(together.placed(), apart.placed())
    call = from_models, calls[0]
    again, at = join_in_slab([call, None, (from_models, calls[1]), call])
    assert at[3] == at[0] < at[2] < at[4], "the same object has its words once"
    assert len(again.words) == 1 + sum(len(part.words) for part in parts[:2])
    wrong = {**calls[0], "one_model": Pair(np.zeros(1), np.zeros(3))}
    with pytest.raises(TypeError, match=r"one_model\.second must be"):
        join_in_slab([(from_models, calls[0]), (from_models, wrong)])


@native_only
def test_bounds_checks_catch_both_ends(tmp_path):
    """Compiled with SHELDRAKE_BOUNDSCHECK=1, an index below zero or past the end is a status, not a crash."""
    script = (
        "import numpy as np\nfrom tests.unit.common.test_kernel import read_at\n"
        "from sheldrake.common.kernel import INDEX_ERROR\n"
        "x, y = np.arange(3.0), np.zeros(1)\n"
        "assert read_at.native(x, 1, y) == 0 and y[0] == 1.0\n"
        "assert read_at.native(x, -1, y) == read_at.native(x, 3, y) == INDEX_ERROR\n"
    )
    env = {**os.environ, "SHELDRAKE_CACHE_DIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(["src", "."])}
    subprocess.run([sys.executable, "-c", script], env={**env, "SHELDRAKE_BOUNDSCHECK": "1"}, check=True)


@kernel(top=True)
def read_at(x: Vector, i: int, out: Vector):
    out[0] = x[i]
