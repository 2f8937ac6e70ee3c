"""The linker of pages: the bits of wasm-ld's module, errors in words; and pages from a wheel without compilers."""

import json
import shutil
import subprocess
import sys

import pytest
from tests.unit.export.exported_pages import falling_block

from sheldrake.common._native import store, wasm
from sheldrake.common.kernel import jit_enabled
from sheldrake.export import Freeze, SavePage
from sheldrake.export._wasm_linker import link

pytest.importorskip("ziglang")
pytestmark = pytest.mark.skipif(not jit_enabled(), reason="runs machine code; SHELDRAKE_JIT=0 switches it off")

C = """
#include <math.h>
#include <string.h>
static const double table[3] = {1.5, -2.0, 0.25};
static double more[4];
static double twice(double x) { return 2 * x; }
static double half(double x) { return 0.5 * x; }
static double (*const ways[2])(double) = {twice, half};
static const double *const far_end = &table[2];
__attribute__((noinline)) double sum(volatile const double *x, int n) { double s = 0; while (n--) s += x[n]; return s; }
double run(int way, double x) {
  volatile double local[64];
  for (int i = 0; i < 64; ++i) local[i] = i;
  more[way] += 1;
  return ways[way](x) + table[way] + *far_end + sin(x) + pow(x, 0.3) + more[way] + sum(local, 64);
}
"""
RUN = """
import fs from "fs";
for (const file of process.argv.slice(2)) {
  const { instance: { exports } } = await WebAssembly.instantiate(fs.readFileSync(file), {});
  const found = [0, 1, 1].map((way) => exports.run(way, 0.7));
  console.log(JSON.stringify([found, exports.__heap_base.value % 16]));
}
"""


def compiled(folder, name, text):
    (folder / f"{name}.c").write_text(text)
    options = ["-target", "wasm32-wasi", "-O2", "-c", folder / f"{name}.c", "-o", folder / f"{name}.o"]
    subprocess.run([sys.executable, "-m", "ziglang", "cc", *map(str, options)], check=True)
    return (folder / f"{name}.o").read_bytes()


def test_data_tables_of_functions_the_stack_and_libm_are_those_of_wasm_ld(tmp_path):
    if shutil.which("node") is None:
        pytest.skip("there is no node")
    code = compiled(tmp_path, "run", C)
    (tmp_path / "own.wasm").write_bytes(link([code, wasm.libm()], ["run"]))
    options = ["-target", "wasm32-wasi", "-mexec-model=reactor", "-nostartfiles", "-O2", "-Wl,--no-entry"]
    options += ["-Wl,--export=run", "-Wl,--export=__heap_base", str(tmp_path / "run.o"), "-lm"]
    subprocess.run([sys.executable, "-m", "ziglang", "cc", *options, "-o", tmp_path / "zig.wasm"], check=True)
    (tmp_path / "run.mjs").write_text(RUN)
    files = [str(tmp_path / name) for name in ("run.mjs", "own.wasm", "zig.wasm")]
    done = subprocess.run(["node", *files], capture_output=True, text=True, check=True)
    own, reference = map(json.loads, done.stdout.splitlines())
    assert own == reference
    assert own[1] == 0 and len(set(own[0])) == 3


def test_what_is_not_reached_is_left_out(tmp_path):
    code = compiled(tmp_path, "run", C)
    small = link([compiled(tmp_path, "alone", "int run(void) { return 1; }"), wasm.libm()], ["run"])
    assert len(small) < 300 < 3000 < len(link([code, wasm.libm()], ["run"])) < 30_000


def test_what_is_missing_or_there_twice_is_named(tmp_path):
    calls = compiled(tmp_path, "calls", "int puts(const char *); int run(void) { return puts(0); }")
    with pytest.raises(RuntimeError, match=r"'puts' is defined nowhere: a kernel calls libm"):
        link([calls, wasm.libm()], ["run"])
    with pytest.raises(RuntimeError, match=r"'other' is defined nowhere"):
        link([wasm.libm()], ["other"])
    one = compiled(tmp_path, "one", "int run(void) { return 1; }")
    with pytest.raises(RuntimeError, match=r"'run' is defined twice"):
        link([one, one], ["run"])
    with pytest.raises(RuntimeError, match=r"is no WebAssembly"):
        link([b"\x7fELF....."], ["run"])


@pytest.fixture
def fresh():
    wasm._brought.cache_clear()
    yield
    wasm._brought.cache_clear()


def test_a_wheel_makes_pages_without_compilers_and_they_are_the_same(tmp_path, monkeypatch, fresh):
    simulator = falling_block()
    SavePage(simulator, tmp_path / "compiled.html")
    SavePage(simulator, tmp_path / "twice.html")
    assert (tmp_path / "twice.html").read_bytes() == (tmp_path / "compiled.html").read_bytes()
    functions = Freeze(simulator).description["functions"]
    kernels = {*(f["symbol"] for f in functions), "k_position_kinematics", "k_calc_generalized_forces"}
    objects = {}
    code = store.code_of_text

    def noted(text, symbol, short_loops, target, rename=""):
        assert symbol in kernels
        objects[wasm.member(text, short_loops)] = code(text, symbol, short_loops, target, rename)
        return objects[wasm.member(text, short_loops)]

    monkeypatch.setattr(store, "code_of_text", noted)
    SavePage(simulator, tmp_path / "again.html")
    wasm.pack(tmp_path / wasm.FILE, {**objects, wasm.LIBM_FILE: wasm.libm()})
    wasm.pack(tmp_path / "twice.zip", {wasm.LIBM_FILE: wasm.libm(), **objects})
    assert (tmp_path / wasm.FILE).read_bytes() == (tmp_path / "twice.zip").read_bytes()

    monkeypatch.setattr(store, "code_of_text", lambda *_: pytest.fail("compiled"))
    monkeypatch.setattr(store, "kept", lambda *_: pytest.fail("compiled"))
    monkeypatch.setattr(store, "can_compile", lambda: False)
    monkeypatch.setattr(wasm, "FOLDER", tmp_path)
    wasm._brought.cache_clear()
    SavePage(simulator, tmp_path / "brought.html")
    assert (tmp_path / "brought.html").read_bytes() == (tmp_path / "compiled.html").read_bytes()

    (tmp_path / wasm.FILE).write_bytes((tmp_path / wasm.FILE).read_bytes()[:-40])  # damaged: as if it were not there
    wasm._brought.cache_clear()
    with pytest.raises(ModuleNotFoundError, match=r"k_\w+: WebAssembly of kernels that the wheel does not bring"):
        SavePage(simulator, tmp_path / "none.html")
    assert not (tmp_path / "none.html").exists()


def test_libm_without_zig_says_what_to_install(tmp_path, monkeypatch, fresh):
    monkeypatch.setattr(wasm, "FOLDER", tmp_path)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(ModuleNotFoundError, match=r"libm: .*pip install 'sheldrake\[export\]'"):
        wasm.libm()
