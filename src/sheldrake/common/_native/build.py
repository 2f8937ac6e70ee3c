"""Builds the library of all entry kernels, for this machine or for every platform from one machine.

    python -m sheldrake.common._native.build OUT [PLATFORM ...] [--only ENTRY,...]

Each entry is lowered once; LLVM then makes one object a platform and level, in as many processes as there are
processors; zig (PyPI's ziglang) links them, or the system's `cc` for this machine when there is no ziglang. Objects are
kept in the user's cache by what they are made from, so that a second build compiles what has changed. The manifest
beside a library names its entries, its levels, the hash of the sources and of the library itself.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib
import importlib.util
import json
import os
import pathlib
import platform
import shutil
import subprocess
import sys
import time
from collections.abc import Iterable
from concurrent.futures import Future, ProcessPoolExecutor
from typing import NamedTuple

from sheldrake.common._native import builtin, duals, instances, lower, methods, prebuilt, store, wasm
from sheldrake.common._native.source import PACKAGE, source_hashes
from sheldrake.common._native.target import X86_LEVELS, Target
from sheldrake.common.kernel import ComplexKernel, Kernel, LaneKernel


class Platform(NamedTuple):
    """A kind of computer a wheel is made for."""

    triple: str
    zig: str
    ending: str
    wheel_tag: str
    levels: dict[int, str]


PLATFORMS = {
    "linux-x86_64": Platform(
        "x86_64-unknown-linux-gnu", "x86_64-linux-gnu.2.17", ".so", "manylinux_2_17_x86_64", X86_LEVELS
    ),
    "linux-aarch64": Platform(
        "aarch64-unknown-linux-gnu", "aarch64-linux-gnu.2.17", ".so", "manylinux_2_17_aarch64", {1: "generic"}
    ),
    "macos-arm64": Platform(
        "arm64-apple-macosx11.0", "aarch64-macos.11.0", ".dylib", "macosx_11_0_arm64", {1: "apple-m1"}
    ),
    "macos-x86_64": Platform(
        "x86_64-apple-macosx11.0", "x86_64-macos.11.0", ".dylib", "macosx_11_0_x86_64", X86_LEVELS
    ),
    "windows-x86_64": Platform("x86_64-pc-windows-gnu", "x86_64-windows-gnu", ".dll", "win_amd64", X86_LEVELS),
}

Objects = dict[str, "Future[bytes]"]
"""Object files by name, in the making."""

ON_COMPLEX = (
    "sheldrake.multibody.tree._kernels.",
    "sheldrake.multibody.plant._kernels.derivatives",
    "sheldrake.common._kernels.only_stages",
    "sheldrake.common._kernels.poses",
    "sheldrake.multibody.math._kernels.spatial",
)
"""Modules, by how their names begin, whose entries are there on complex numbers too, as plants and poses of AutoDiffXd
ask them."""

CPU_LEVEL = """
; Which level may this process use? cpuid and xgetbv: 3 when AVX2, FMA, BMI1/2 are there and the system saves AVX state.
define i32 @sheldrake_cpu_level() {
  %one = call {i32,i32,i32,i32} asm "cpuid", "={ax},={bx},={cx},={dx},{ax},{cx},~{dirflag},~{fpsr},~{flags}"(i32 1, i32 0)
  %c = extractvalue {i32,i32,i32,i32} %one, 2
  %wanted = and i32 %c, 943726592        ; FMA 12, MOVBE 22, OSXSAVE 27, AVX 28, F16C 29
  %has = icmp eq i32 %wanted, 943726592
  br i1 %has, label %system, label %low
system:
  %x = call {i32,i32} asm "xgetbv", "={ax},={dx},{cx},~{dirflag},~{fpsr},~{flags}"(i32 0)
  %xa = extractvalue {i32,i32} %x, 0
  %saved = and i32 %xa, 6
  %saves = icmp eq i32 %saved, 6
  br i1 %saves, label %leaf7, label %low
leaf7:
  %seven = call {i32,i32,i32,i32} asm "cpuid", "={ax},={bx},={cx},={dx},{ax},{cx},~{dirflag},~{fpsr},~{flags}"(i32 7, i32 0)
  %b = extractvalue {i32,i32,i32,i32} %seven, 1
  %w7 = and i32 %b, 296                  ; BMI1 3, AVX2 5, BMI2 8
  %k7 = icmp eq i32 %w7, 296
  br i1 %k7, label %high, label %low
high:
  ret i32 3
low:
  ret i32 1
}
"""  # noqa: E501


def entries() -> dict[str, Kernel]:
    """Every entry kernel of the library by its symbol.

    Raises:
        ImportError: if a module with kernels cannot be imported: a library without them would be of no use.
        RuntimeError: if two entries have the same name.
    """
    found: dict[str, Kernel] = {}
    for path in sorted(PACKAGE.rglob("_kernels/*.py")):
        name = ".".join(["sheldrake", *path.relative_to(PACKAGE).with_suffix("").parts])
        loaded = importlib.import_module(name.removesuffix(".__init__"))
        for value in vars(loaded).values():
            if isinstance(value, Kernel) and value.top and value.__module__ == name:
                symbol = f"k_{value.__name__}"
                if symbol in found:
                    raise RuntimeError(f"two entry kernels are called {value.__name__}: {found[symbol]!r}, {value!r}.")
                found[symbol] = value
                if value.lanes is not None:
                    found[f"{symbol}_on_lanes"] = value.on_lanes
                if name.startswith(ON_COMPLEX):
                    found[f"{symbol}_on_complex"] = value.on_complex
    return found


def host_platform() -> str:
    """The name in PLATFORMS of this computer.

    Raises:
        RuntimeError: if kernels are not prebuilt for it.
    """
    system = {"darwin": "macos", "win32": "windows"}.get(sys.platform, "linux")
    machine = platform.machine().lower()
    machine = {"amd64": "x86_64", "arm64": "arm64" if system == "macos" else "aarch64"}.get(machine, machine)
    name = f"{system}-{machine}"
    if name not in PLATFORMS:
        raise RuntimeError(f"kernels are not prebuilt for {name}; there are {', '.join(PLATFORMS)}.")
    return name


def build(out: pathlib.Path, names: Iterable[str], only: str = "", say=print) -> None:
    """Writes OUT/<platform>/kernels.<ending> and kernels.json for each platform, and beside them, where zig is there,
    the same kernels as WebAssembly for pages.

    Args:
        out: folder, made when missing.
        names: keys of PLATFORMS.
        only: build just the entries of these names, with commas between; the others are then compiled at first use.
        say: what tells the progress.

    Raises:
        RuntimeError: if there is no linker, or linking fails; the message has the linker's words.
    """
    with ProcessPoolExecutor() as pool:
        try:
            _build(pool, out, list(names), only, say)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)  # what went wrong is told now, not when all is compiled
            raise


def _build(pool: ProcessPoolExecutor, out: pathlib.Path, names: list[str], only: str, say) -> None:
    start = time.perf_counter()
    kernels = {s: k for s, k in entries().items() if not only or k.__name__ in only.split(",")}
    has_zig = importlib.util.find_spec("ziglang") is not None
    objects: dict[str, Objects] = {name: {} for name in [*([wasm.FILE] if has_zig else []), *names]}
    for i, (symbol, kernel) in enumerate(kernels.items(), 1):
        code = lower.lower(kernel, symbol)
        for name, found in objects.items():
            if name != wasm.FILE or not isinstance(
                kernel, (LaneKernel, ComplexKernel)
            ):  # a page has one world, of numbers
                found |= _started(pool, code, symbol, name)
        say(f"lowered {i}/{len(kernels)} {kernel.__name__}", flush=True)
    pages = {name: made.result() for name, made in objects.pop(wasm.FILE, {}).items()}
    if has_zig:
        pages[wasm.LIBM_FILE] = wasm.made_libm()
        say(f"wasm32: {len(kernels)} entries, {time.perf_counter() - start:.1f} s", flush=True)
    for name, found in objects.items():
        library = _build_one(out / name, PLATFORMS[name], name, found)
        manifest = {
            "platform": name,
            "sources": source_hashes(),
            "sha256": hashlib.sha256(library.read_bytes()).hexdigest(),
            "levels": sorted(PLATFORMS[name].levels),
            "entries": {prebuilt.qualified(k): symbol for symbol, k in kernels.items()},
        }
        (out / name / "kernels.json").write_text(json.dumps(manifest, indent=1), encoding="utf-8")
        if pages:
            wasm.pack(out / name / wasm.FILE, pages)
        size = library.stat().st_size / 1e3
        say(f"{name}: {len(kernels)} entries, {size:.0f} kB, {time.perf_counter() - start:.1f} s", flush=True)


def _started(pool: ProcessPoolExecutor, code: lower.Lowered, symbol: str, name: str) -> Objects:
    """The objects of an entry for a platform, or for pages, by the names under which they are kept; in the making."""
    if name == wasm.FILE:
        made = pool.submit(store.code_of_text, code.text, symbol, code.short_loops, wasm.WASM)
        return {wasm.member(code.text, code.short_loops): made}
    found = {}
    for level, cpu in PLATFORMS[name].levels.items():
        target, title = Target(PLATFORMS[name].triple, level, cpu), f"{symbol}_{level}"
        found[title] = pool.submit(store.code_of_text, code.text, symbol, code.short_loops, target, title)
    return found


def _build_one(folder: pathlib.Path, target: Platform, name: str, made: Objects) -> pathlib.Path:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    codes = {title: future.result() for title, future in made.items()}
    if "x86_64" in target.triple:
        codes["cpu_level"] = builtin.assemble(CPU_LEVEL, Target(target.triple, 1, "x86-64"))
    texts = {"call": builtin.CODE, "instance": instances.CODE, "method": methods.CODE, "duals": duals.CODE}
    for title, text in texts.items():
        codes[title] = builtin.assemble(text, Target(target.triple, 1, target.levels[1]))
    objects = [folder / f"{title}.o" for title in codes]
    for path, code in zip(objects, codes.values()):
        path.write_bytes(code)
    library = folder / f"kernels{target.ending}"
    _link(library, target, name, [str(path) for path in objects])
    for path in objects:
        path.unlink()
    return library


def _link(library: pathlib.Path, target: Platform, name: str, objects: list[str]) -> None:
    windows = target.ending == ".dll"
    options = ["-shared", "-o", str(library), *objects]
    options += ["-Wl,--export-all-symbols"] if windows else ["-lm"]
    options += [] if target.ending == ".dylib" else ["-s"]
    if importlib.util.find_spec("ziglang") is not None:
        command = [sys.executable, "-m", "ziglang", "cc", "-target", target.zig, *options]
    elif name == host_platform() and shutil.which("cc"):
        command = ["cc", *options]
    else:
        raise RuntimeError(f"linking for {name} needs ziglang (pip install ziglang).")
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"linking {library.name} for {name} failed: {done.stderr.strip()[:2000]}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("platform", nargs="*", help=f"of {', '.join(PLATFORMS)}; default: this machine")
    parser.add_argument("--only", default="", help="the names of the entries to build, with commas")
    options = parser.parse_args()
    os.environ.setdefault("SHELDRAKE_QUIET", "1")  # a line for each object of each platform tells nobody anything
    build(options.out, options.platform or [host_platform()], options.only)
