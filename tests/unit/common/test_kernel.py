"""Kernels: the same source as Python and as machine code, and what is refused."""

from __future__ import annotations

import os
import subprocess
import sys
import types
from typing import NamedTuple

import numpy as np
import pytest

from sheldrake.common._kernels.generic import sin, sqrt
from sheldrake.common._kernels.vec import load3, rotate, rotation_about, store3
from sheldrake.common._native import store
from sheldrake.common.kernel import IntVector, Matrix, Vector, Vectors, jit_enabled, kernel
from sheldrake.common.rows import call_row

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


def test_plain_python_helper_is_refused():
    def helper(x):
        return x

    @kernel(top=True)
    def entry(x: Vector):
        x[0] = helper(x[0])

    with pytest.raises(TypeError, match="plain Python function"):
        store.fingerprint(entry)


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
    code = "import sys, sheldrake.common.kernel; assert not {'numba', 'llvmlite'} & set(sys.modules)"
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
    from sheldrake.common._native.words import pack_row

    rng = np.random.default_rng(2)
    slab, model = rng.normal(size=20), rng.normal(size=4)
    starts = np.cumsum([5, *sizes])
    u = tuple(slab[a : a + n].copy() for a, n in zip(starts, sizes))
    expected, direct = np.zeros(1), np.zeros(1)
    weighted_sum(0.5, u, model, expected)
    weighted_sum.native(0.5, u, model, direct)
    np.testing.assert_allclose(direct, expected, rtol=1e-14)
    words = pack_row(weighted_sum, {"u": list(zip(starts, sizes)), "model": model, "out": (1, 1)})
    code = weighted_sum._native[0]
    assert code(0.5, slab.ctypes.data, words.ctypes.data) == 0
    np.testing.assert_allclose(slab[1], expected[0], rtol=1e-14)


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
