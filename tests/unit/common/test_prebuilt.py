"""The three tiers of a kernel: the wheel's library, the user's cache, a fresh compile. Same bits, nothing stale."""

from __future__ import annotations

import json
import os
import pathlib
import shutil
import subprocess
import sys
import time

import pytest

from sheldrake.common._native import build, builtin, duals, elf, instances, methods, prebuilt, source
from sheldrake.common._native.target import Target
from sheldrake.common.kernel import MISFIT, jit_enabled

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not jit_enabled(), reason="asks about machine code; SHELDRAKE_JIT=0 switches it off"),
    pytest.mark.skipif(shutil.which("cc") is None, reason="building a library needs a linker, `cc`"),
]

SCRIPT = """
import sys, json
import numpy as np
from sheldrake.common._native import store
from sheldrake.common._kernels.probe import probe
x = np.linspace(0.0, 3.0, 7)
status = probe.native(0.3, x)
compiler = "sheldrake.common._native.compiler.module"
loaded = [name in sys.modules for name in (compiler, "llvmlite.binding")]
print(json.dumps([x.tobytes().hex(), status, list(store.TIERS.values()), *loaded]))
"""
PROBE = '''
"""A kernel of the test."""
from sheldrake.common._kernels.generic import exp, sin
from sheldrake.common.kernel import Vector, kernel

FACTOR = 1.5


@kernel(top=True)
def probe(a: float, x: Vector) -> int:
    for i in range(x.shape[0]):
        x[i] = FACTOR * sin(a * x[i]) + exp(-x[i]) * x[i] / 3.0
    return 4
'''


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """A copy of the library with one more kernel, whose library is built."""
    root = tmp_path_factory.mktemp("copy")
    package = root / "src" / "sheldrake"
    shutil.copytree(source.PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__", "_prebuilt"))
    (package / "common" / "_kernels" / "probe.py").write_text(PROBE)
    out = root / "built"
    build = [sys.executable, "-m", "sheldrake.common._native.build", str(out), "--only", "probe"]
    subprocess.run(build, check=True, env=environment(root), cwd=root)
    (folder,) = out.iterdir()
    shutil.copytree(folder, package / "_prebuilt")
    return root


def environment(root, **more):
    kept = {k: v for k, v in os.environ.items() if not k.startswith("SHELDRAKE_")}
    return {**kept, "PYTHONPATH": str(root / "src"), "SHELDRAKE_CACHE_DIR": str(root / "cache"), **more}


def probe(root, **more):
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        env=environment(root, **more),
        capture_output=True,
        text=True,
        check=True,
        cwd=root,
    )
    bits, status, tiers, compiler, llvmlite = json.loads(done.stdout)
    assert status == 4
    return bits, tiers[-1], compiler, llvmlite


def test_every_tier_gives_the_same_bits_and_imports_no_more_than_it_needs(tree):
    first = probe(tree)
    assert first[1:] == ("prebuilt", False, False)
    second = probe(tree, SHELDRAKE_PREBUILT="0")
    assert second[1:] == ("compiled", True, True)
    third = probe(tree, SHELDRAKE_PREBUILT="0")
    assert third[1:] == ("cache", False, not elf.is_understood())
    assert first[0] == second[0] == third[0]


def test_an_edit_is_seen_at_once_in_every_tier(tree):
    file = tree / "src" / "sheldrake" / "common" / "_kernels" / "probe.py"
    before = probe(tree)[0]
    file.write_text(PROBE.replace("1.5", "1.25"))
    try:
        edited, tier, *_ = probe(tree)
        assert tier == "compiled" and edited != before
        again, tier, *_ = probe(tree)
        assert tier == "cache" and again == edited
    finally:
        file.write_text(PROBE)
    assert probe(tree)[:2] == (before, "prebuilt")


def test_a_second_build_compiles_nothing_again(tree):
    def compiled():
        return {path.name: path.stat().st_ino for path in (tree / "cache").rglob("k_probe-text-*")}

    before = compiled()
    assert len(before) >= len(build.PLATFORMS[build.host_platform()].levels)
    out = tree / "built again"
    command = [sys.executable, "-m", "sheldrake.common._native.build", str(out), "--only", "probe"]
    subprocess.run(command, check=True, env=environment(tree), cwd=tree)
    assert compiled() == before  # a file that is written anew is another one
    names = [path.relative_to(out) for path in out.glob("*/*")]
    assert len(names) >= 2 and all((out / n).read_bytes() == (tree / "built" / n).read_bytes() for n in names)


def test_an_edited_docstring_or_comment_changes_nothing(tree):
    file = tree / "src" / "sheldrake" / "common" / "_kernels" / "probe.py"
    before = probe(tree)
    assert before[1] == "prebuilt"
    assert probe(tree, SHELDRAKE_PREBUILT="0")[1] in ("compiled", "cache")
    told = PROBE.replace("-> int:\n", '-> int:\n    """One line.\n\n    And another.\n    """\n    # Why.\n')
    try:
        for text in (told, told.replace("One", "Some").replace("Why", "Why not"), PROBE.replace("A kernel", "Kernels")):
            file.write_text(text)
            assert probe(tree) == before
        file.write_text(told.replace("3.0", "4.0"))
        assert probe(tree)[1] == "compiled"
    finally:
        file.write_text(PROBE)


def test_a_damaged_library_is_not_used(tree):
    file = tree / "src" / "sheldrake" / "_prebuilt" / f"kernels{prebuilt.ENDING}"
    good = file.read_bytes()
    before = probe(tree)[0]
    file.write_bytes(good[: len(good) // 2])
    try:
        bits, tier, *_ = probe(tree)
        assert tier in ("compiled", "cache") and bits == before
    finally:
        file.write_bytes(good)


def test_a_library_that_was_found_whole_is_asked_again_when_a_file_has_changed(tree):
    code = """
from sheldrake.common._native import prebuilt
asked = []
whole = prebuilt.is_made_from
prebuilt.is_made_from = lambda sources: asked.append(1) or whole(sources)
print(prebuilt.library()[1], len(asked))
"""

    def found():
        command = [sys.executable, "-c", code]
        done = subprocess.run(command, env=environment(tree), capture_output=True, text=True, check=True, cwd=tree)
        return done.stdout.strip()

    probe(tree)
    assert found() == "in use 0"
    file = tree / "src" / "sheldrake" / "_prebuilt" / f"kernels{prebuilt.ENDING}"
    good, times = file.read_bytes(), (file.stat().st_atime, file.stat().st_mtime)
    file.write_bytes(good[:-1] + bytes([good[-1] ^ 1]))
    os.utime(file, times)
    try:
        assert found() == f"{file.name} is damaged 1"
    finally:
        file.write_bytes(good)
    assert [found(), found()] == ["in use 1", "in use 0"]


def test_fingerprints_are_kept_until_a_file_changes(tree):
    """Of files that are two seconds older than the process: what it imported is what is there."""
    code = SCRIPT + "print(store._parts.cache_info().currsize)"
    env = environment(tree, SHELDRAKE_PREBUILT="0")
    file = tree / "src" / "sheldrake" / "common" / "_kernels" / "probe.py"

    def hashed():
        done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, cwd=tree)
        return int(done.stdout.splitlines()[-1])

    file.write_text(PROBE)
    os.utime(file, (time.time() + 1000.0,) * 2)  # however slowly processes start
    assert [hashed() > 0, hashed() > 0] == [True, True]  # it is too young
    file.write_text(PROBE)
    time.sleep(2.1)
    assert [hashed() > 0, hashed() > 0] == [True, False]
    file.write_text(PROBE + "\n")
    assert hashed() > 0
    file.write_text(PROBE)


def test_a_cache_that_cannot_be_written_is_only_slower(tree):
    bits, tier, *_ = probe(tree, SHELDRAKE_PREBUILT="0", SHELDRAKE_CACHE_DIR=os.devnull + "/none")
    assert tier == "compiled" and bits == probe(tree)[0]


def test_without_a_compiler_what_is_not_prebuilt_says_what_to_install(tree):
    hidden = """
import sys
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] == "llvmlite":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Hidden())
"""
    env = environment(tree, SHELDRAKE_PREBUILT="0", SHELDRAKE_CACHE_DIR=str(tree / "none"))
    done = subprocess.run([sys.executable, "-c", hidden + SCRIPT], env=env, capture_output=True, text=True, cwd=tree)
    assert done.returncode == 1
    assert "which needs llvmlite: pip install 'sheldrake[kernels]'" in done.stderr.splitlines()[-1]


def test_what_nobody_used_for_months_is_removed(tree):
    cache = tree / "pruned"
    old, other, recent = (cache / folder for folder in ("abi1-python3.9/old.o", "abi2/other.o", "abi2/recent.o"))
    for file in (old, other, recent):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(b"code")
    for file in (old, other):
        os.utime(file, (0, 0))
    assert probe(tree, SHELDRAKE_PREBUILT="0", SHELDRAKE_CACHE_DIR=str(cache))[1] == "compiled"
    assert sorted(p.name for p in cache.glob("abi*/*") if p.suffix == ".o" and "probe" not in p.name) == ["recent.o"]
    assert not old.parent.exists()


def test_two_processes_may_compile_at_once(tree):
    env = environment(tree, SHELDRAKE_PREBUILT="0", SHELDRAKE_CACHE_DIR=str(tree / "race"))
    run = [sys.executable, "-c", SCRIPT]
    both = [subprocess.Popen(run, env=env, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) for _ in "ab"]
    answers = [json.loads(p.communicate()[0])[0] for p in both]
    assert answers[0] == answers[1] == probe(tree)[0]


def test_the_hash_covers_every_kernel_file():
    files = {p.relative_to(source.PACKAGE).as_posix() for p in source.source_files()}
    kernels = {
        p.relative_to(source.PACKAGE).as_posix()
        for p in pathlib.Path(source.PACKAGE).rglob("*.py")
        if "\n@kernel" in p.read_text(encoding="utf-8")
    }
    assert kernels <= files, f"kernels outside of _kernels folders: {sorted(kernels - files)}"


def test_wheels_have_what_derivatives_of_continuous_plants_are_made_of():
    """On numbers, and on complex ones for plants of AutoDiffXd: as Python they take fifty times as long."""
    names = {"smooth_forces", "contact_forces", "surface_forces", "run_surfaces", "plant_derivatives"}
    found = build.entries().keys()
    assert {f"k_{name}{kind}" for name in names for kind in ("", "_on_complex")} <= found


def test_queries_are_builtin_functions_without_a_compiler(tree):
    code = """
import json, sys
import numpy as np
from sheldrake.common._kernels.probe import probe
from sheldrake.common._native import builtin
from sheldrake.common.calls import Calls
ask = Calls(np.zeros(1, np.int64)).query(probe, 2.0, np.zeros(3), given=("x",))
given = np.ones(3)
print(json.dumps([builtin.available(), ask(given), ask(np.ones(4)), bool(given[0] != 1.0), "llvmlite" in sys.modules]))
"""
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, env=environment(tree), capture_output=True, text=True, check=True, cwd=tree)
    assert json.loads(done.stdout) == [True, 4, MISFIT, True, False]


def test_code_alone_has_no_docstrings_and_comments_and_nothing_else_is_gone():
    text = '''"""Module."""
# A line.
WORDS = """not
# a docstring
"""  # why


class C:
    """Class
    of things."""

    def f(self):
        """Of it."""
        return "# no comment", f"{self} # none"  # one
'''
    left = '''WORDS = """not
# a docstring
"""


class C:

    def f(self):
        return "# no comment", f"{self} # none"'''
    assert source.code_alone(text) == left


@pytest.mark.parametrize("name", build.PLATFORMS)
def test_the_code_of_queries_is_made_for_every_platform(name):
    platform = build.PLATFORMS[name]
    for part in (builtin, duals, instances, methods):
        code = builtin.assemble(part.CODE, Target(platform.triple, 1, platform.levels[1]))
        assert part.SYMBOL.encode() in code
        assert not [name for name in (b"chkstk", b"memcpy", b"memset") if name in code]  # it is linked with nothing


SCENES = """
import json
from sheldrake.common._native import store
from tests.unit.export.exported_pages import arm, falling_block, native_state, simulator_of
made = {"block": falling_block, "arm": arm, "cart-pole, continuous": lambda: simulator_of("cart-pole")}
bits = {name: native_state(make(), 0.4).tobytes().hex() for name, make in made.items()}
print(json.dumps([bits, store.TIERS]))
"""


def test_whole_scenes_have_the_same_bits_in_every_tier(tmp_path):
    """Freshly compiled, from the cache, and prebuilt: a block that lands, an arm, and a plant in continuous time."""
    package = tmp_path / "src" / "sheldrake"
    shutil.copytree(source.PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__", "_prebuilt"))
    paths = os.pathsep.join([str(tmp_path / "src"), str(source.PACKAGE.parents[1])])

    def run(**more):
        environ = {**environment(tmp_path, **more), "PYTHONPATH": paths, "SHELDRAKE_QUIET": "1"}
        command = [sys.executable, "-c", SCENES]
        done = subprocess.run(command, env=environ, capture_output=True, text=True, check=True, cwd=tmp_path)
        bits, tiers = json.loads(done.stdout.splitlines()[-1])
        return bits, tiers, {name.rpartition(":")[2] for name in tiers}

    assert not (tmp_path / "cache").exists()
    compiled, tiers, names = run()
    assert set(tiers.values()) <= {"compiled", "cache"} and len(names) > 12  # other processes compile for the cache
    cached, tiers, _ = run()
    assert set(tiers.values()) == {"cache"}
    out = tmp_path / "built"
    names.add("sweep")  # where derivatives on complex numbers are prebuilt, they are taken at once
    command = [sys.executable, "-m", "sheldrake.common._native.build", str(out), "--only", ",".join(names)]
    subprocess.run(command, check=True, env=environment(tmp_path), cwd=tmp_path, stdout=subprocess.DEVNULL)
    (folder,) = out.iterdir()
    shutil.copytree(folder, package / "_prebuilt")
    prebuilt_, tiers, _ = run(SHELDRAKE_CACHE_DIR=str(tmp_path / "none"))
    assert not [name for name, tier in tiers.items() if tier != "prebuilt"]
    assert compiled == cached == prebuilt_
    assert len(set(compiled.values())) == 3


GRADIENTS = """
import json, sys
if "alone" in sys.argv:
    sys.modules["llvmlite"] = None  # as where it is not installed
import numpy as np
import sheldrake.all as lib
from sheldrake.common._native import store
plant = lib.MultibodyPlant(0.0)
inertia = lib.SpatialInertia.SolidBoxWithMass(2.0, 0.1, 0.2, 0.3)
base, tip = plant.AddRigidBody("base", inertia), plant.AddRigidBody("tip", inertia)
plant.AddJoint(lib.RevoluteJoint("hinge", base.body_frame(), tip.body_frame(), [0.0, 1.0, 0.0]))
plant.Finalize()
plant = plant.ToAutoDiffXd()
context = plant.CreateDefaultContext()
x = np.linspace(0.3, 0.9, plant.num_multibody_states())
plant.SetPositionsAndVelocities(context, lib.InitializeAutoDiff(x).ravel())
W, V = plant.world_frame(), lib.JacobianWrtVariable.kV
ask = {
    "calc_kinetic_energy": lambda: [plant.CalcKineticEnergy(context)],
    "calc_potential_energy": lambda: [plant.CalcPotentialEnergy(context)],
    "calc_momentum": lambda: plant.CalcSpatialMomentumInWorldAboutPoint(context, np.zeros(3)).get_coeffs(),
    "calc_velocity_of_centre": lambda: plant.CalcCenterOfMassTranslationalVelocityInWorld(context),
    "calc_jacobian_of_centre": lambda: plant.CalcJacobianCenterOfMassTranslationalVelocity(context, V, W, W).ravel(),
}
found = {}
for name, call in ask.items():
    for _ in range(200):  # after which machine code is made where it can be
        answer = call()
    found[name] = lib.ExtractGradient(np.array(answer)).tolist()
tiers = {name.partition(":")[2]: tier for name, tier in store.TIERS.items()}
print(json.dumps([found, tiers]))
"""


def test_queries_of_gradients_are_machine_code_without_a_compiler(tmp_path):
    """Energies, momentum and centres of mass of a plant of AutoDiffXd, where llvmlite is not installed."""
    package = tmp_path / "src" / "sheldrake"
    shutil.copytree(source.PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__", "_prebuilt"))

    def run(*words):
        command = [sys.executable, "-c", GRADIENTS, *words]
        environ = environment(tmp_path, SHELDRAKE_QUIET="1")
        done = subprocess.run(command, env=environ, capture_output=True, text=True, check=True, cwd=tmp_path)
        return json.loads(done.stdout.splitlines()[-1])

    compiled, tiers = run()
    names = {name.partition(".")[0] for name in tiers}
    out = tmp_path / "built"
    command = [sys.executable, "-m", "sheldrake.common._native.build", str(out), "--only", ",".join(names)]
    subprocess.run(command, check=True, env=environment(tmp_path), cwd=tmp_path, stdout=subprocess.DEVNULL)
    (folder,) = out.iterdir()
    shutil.copytree(folder, package / "_prebuilt")
    prebuilt_, tiers = run("alone")
    assert {f"{name}.on_complex" for name in compiled} <= tiers.keys()
    assert set(tiers.values()) == {"prebuilt"}
    assert prebuilt_ == compiled
