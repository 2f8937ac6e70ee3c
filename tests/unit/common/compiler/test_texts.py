"""LLVM's text: the same on every Python, from several threads and processes; objects for other machines."""

from __future__ import annotations

import os
import pathlib
import shutil
import subprocess
import sys
import threading

import numpy as np
import pytest
from tests.unit.common.compiler.sources import module_of
from tools import kernel_texts

from sheldrake.common._native import build, store
from sheldrake.common._native.compiler.module import text_of

native = pytest.mark.skipif(not store.can_compile(), reason="compiles kernels: needs llvmlite")
ROOT = pathlib.Path(__file__).resolve().parents[4]
PYTHONS = [f"python3.{minor}" for minor in range(10, 15)]


@pytest.mark.parametrize("python", PYTHONS)
def test_texts_are_the_same_on_other_pythons(python):
    if python == f"python3.{sys.version_info.minor}":
        pytest.skip("that is this one")
    where = os.environ.get(f"SHELDRAKE_{python.upper().replace('.', '_')}") or shutil.which(python)
    if where is None:
        pytest.skip(f"{python} is not here")
    probe = subprocess.run([where, "-c", "import numpy"], capture_output=True, check=False)
    if probe.returncode:
        pytest.skip(f"{python} has no NumPy")
    assert kernel_texts.hashes_of(where) == kernel_texts.hashes()


TEXT = """
@kernel
def helper(v, w):
    t = v * {factor}
    if t > w:
        t -= w
    return t
@kernel(outline=True)
def stage(x, n):
    for i in range(len(x)):
        x[i] = helper(x[i], {factor}) + helper(i, 2)
        n[i % 2] //= 3
@kernel(top=True)
def entry{number}(x: Vector, n: IntVector):
    stage(x, n)
"""


def in_threads(count, work):
    results, start = [None] * count, threading.Barrier(count)

    def one(i):
        start.wait()
        results[i] = work(i)

    threads = [threading.Thread(target=one, args=(i,)) for i in range(count)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    return results


def test_eight_threads_write_the_same_text_of_one_kernel_and_their_own_of_others():
    one = module_of(TEXT.format(factor=0.5, number=0))["entry0"]
    assert len(set(in_threads(8, lambda i: text_of(one, "k")))) == 1
    own = [module_of(TEXT.format(factor=float(i), number=i))[f"entry{i}"] for i in range(8)]
    together = in_threads(8, lambda i: text_of(own[i], "k"))
    fresh = [module_of(TEXT.format(factor=float(i), number=i))[f"entry{i}"] for i in range(8)]
    assert together == [text_of(k, "k") for k in fresh]


@native
def test_eight_threads_compile_the_same_bytes(tmp_path, monkeypatch):
    monkeypatch.setenv("SHELDRAKE_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv("SHELDRAKE_QUIET", "1")
    kernels = [module_of(TEXT.format(factor=float(i), number=i))[f"entry{i}"] for i in range(4)]
    codes = in_threads(8, lambda i: store.make(kernels[i % 4], tell=False))
    assert codes[:4] == codes[4:] == [store.make(k, tell=False) for k in kernels]
    assert len(list(tmp_path.rglob("*.o"))) == 4
    x = [np.ones(3) for _ in range(8)]
    in_threads(8, lambda i: kernels[i % 4].native(x[i], np.ones(3, np.int64)))
    for i in range(4):
        expected = np.ones(3)
        kernels[i](expected, np.ones(3, np.int64))
        np.testing.assert_allclose(x[i], expected, rtol=1e-15)
        np.testing.assert_array_equal(x[i], x[i + 4])


@native
def test_two_processes_race_for_one_folder(tmp_path):
    file = tmp_path / "racing.py"
    head = "from sheldrake.common.kernel import IntVector, Vector, kernel\n"
    file.write_text(head + "".join(TEXT.format(factor=2.0 + i, number=i) for i in range(3)))
    script = (
        "import racing, numpy as np\n"
        "for i in range(3):\n"
        "    x = np.ones(3)\n"
        "    getattr(racing, f'entry{i}').native(x, np.ones(3, np.int64))\n"
        "    print(x.tobytes().hex())\n"
    )
    path = os.pathsep.join([str(tmp_path), str(ROOT / "src")])
    cache = tmp_path / "cache"
    environment = {**os.environ, "SHELDRAKE_CACHE_DIR": str(cache), "PYTHONPATH": path, "SHELDRAKE_QUIET": "1"}
    environment.pop("SHELDRAKE_JIT", None)
    commands = [[sys.executable, "-c", script]] * 2
    running = [
        subprocess.Popen(c, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for c in commands
    ]
    outputs = [p.communicate(timeout=120) for p in running]
    assert [p.returncode for p in running] == [0, 0], outputs
    assert outputs[0][0] == outputs[1][0] != ""
    assert len(list(cache.rglob("*.o"))) == 3
    assert [f for f in cache.rglob("*") if f.is_file() and f.suffix != ".o"] == []


@native
def test_code_for_webassembly():
    from sheldrake.common._native import lower
    from sheldrake.common._native.target import Target

    entry = module_of(TEXT.format(factor=0.5, number=0))["entry0"]
    code = lower.emit(lower.lower(entry, "k_entry"), "k_entry", Target("wasm32-unknown-unknown", 1, "generic"))
    assert code[:4] == b"\0asm"
    assert b"k_entry" in code


def test_every_text_says_nothing_that_could_be_undefined():
    """No flags that make poison but where addresses and counters are made, and none of the operations that do."""
    texts = [text_of(kernel, "k") for kernel in list(build.entries().values())[:20]]
    texts.append(text_of(module_of(TEXT.format(factor=0.5, number=0))["entry0"], "k"))
    for text in texts:
        for line in text.splitlines():
            words = line.split()
            assert not {"nuw", "exact", "nnan", "ninf", "fast", "poison", "fptosi", "fptoui", "unreachable"} & {*words}
            if "nsw" in words:
                assert words[2] in ("mul", "add")
            if "undef" in words:
                assert "insertvalue" in words
