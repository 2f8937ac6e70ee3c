"""Where the time of a step goes: the share of each of its stages, for the robots of `real_robots`.

    python benchmarks/stages.py [name ...] [--seconds 0.3] [--write table.json]
    python benchmarks/stages.py [name ...] --before table.json --figure stages.png

Needs `pip install "sheldrake[kernels,robots]"`.

Each robot falls as in `real_robots`. Between the event loop and every kernel of the step stands a function that reads
the cycle counter before and after it. A fall is the same each time, to the bit, so of every step the least of several
falls counts: what other processes take does not. What reading the counter costs is measured by an empty stage and
taken off. Geometry is placed within the motion, and pairs that are far are left out within "pairs".
"""

from __future__ import annotations

import argparse
import ctypes
import json
import pathlib
import sys
import tempfile
import time
import warnings

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from benchmarks.real_robots import DT, add_ground, exclude_neighbours, with_hulls  # noqa: E402
from benchmarks.turns import machine  # noqa: E402
from tests.crosscheck.robots.real_robots import robot_files  # noqa: E402

FALLS = 7
STAGES = {
    "smooth_motion": "motion",
    "half_space_pairs": "ground",
    "list_near_pairs": "pairs",
    "sphere_pairs": "pairs",
    "box_pairs": "pairs",
    "convex_pairs": "pairs",
    "sort_contacts": "pairs",
    "contact_constraints": "rows",
    "joint_constraints": "rows",
    "prepare_hunt_crossley_contacts": "solve",
    "solve": "solve",
    "solve_to_rest": "solve",
    "next_state": "next",
    "next_state_with_momentum": "next",
}
"""What each kernel of a step is counted as."""
NAMES = tuple(dict.fromkeys(STAGES.values()))
_CLOCKED = """
declare i64 @llvm.readcyclecounter()
define i64 @clocked(double %t, ptr %slab, ptr %words) {{
  %begin = call i64 @llvm.readcyclecounter()
  %status = call i64 inttoptr (i64 {address} to ptr)(double %t, ptr %slab, ptr %words)
  %end = call i64 @llvm.readcyclecounter()
  %spent = sub i64 %end, %begin
  %at = load i64, ptr inttoptr (i64 {count} to ptr)
  %place = getelementptr i64, ptr inttoptr (i64 {times} to ptr), i64 %at
  store i64 %spent, ptr %place
  %next = add i64 %at, 1
  store i64 %next, ptr inttoptr (i64 {count} to ptr)
  ret i64 %status
}}
"""
_NOTHING = "define i64 @nothing(double %t, ptr %slab, ptr %words) { ret i64 0 }"
_NOW = """
declare i64 @llvm.readcyclecounter()
define i64 @now(double %t, ptr %slab, ptr %words) {
  %now = call i64 @llvm.readcyclecounter()
  ret i64 %now
}
"""
_ABI = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p)
_engines: list = []


def _compiled(text: str, symbol: str) -> int:
    """Address of a function of the kernels' ABI given as LLVM's text."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    target = llvm.Target.from_default_triple().create_target_machine(opt=2, jit=True)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(text), target)
    engine.finalize_object()
    _engines.append(engine)
    return engine.get_function_address(symbol)


class Clock:
    """Cycles of each call of one kernel, in the order of the calls."""

    def __init__(self, address: int, room: int) -> None:
        self.times, self.count = np.zeros(room, np.int64), np.zeros(1, np.int64)
        where = {"count": self.count.ctypes.data, "times": self.times.ctypes.data}
        self.address = _compiled(_CLOCKED.format(address=address, **where), "clocked")


def cycles_a_microsecond() -> float:
    """Of the counter that `Clock` reads."""
    counter = _ABI(_compiled(_NOW, "now"))
    begin, first = time.perf_counter(), counter(0.0, None, None)
    time.sleep(0.2)
    return (counter(0.0, None, None) - first) / (time.perf_counter() - begin) * 1e-6


def cost_of_reading() -> float:
    """Cycles that a `Clock` on nothing counts."""
    clock = Clock(_compiled(_NOTHING, "nothing"), 1000)
    call = _ABI(clock.address)
    for _ in range(1000):
        call(0.0, None, None)
    return float(np.median(clock.times))


def robot(path: pathlib.Path):
    """A robot above flat ground."""
    import sheldrake.all as lib

    builder = lib.DiagramBuilder()
    plant, scene_graph = lib.AddMultibodyPlantSceneGraph(builder, DT)
    lib.Parser(plant).AddModels(str(path))
    add_ground(lib, plant)
    plant.Finalize()
    exclude_neighbours(lib, plant, scene_graph)
    return builder.Build()


def stages_of(path: pathlib.Path, seconds: float) -> dict[str, float]:
    """Time of each stage of a step [us], the mean over a fall; "loop" is what is between them."""
    import sheldrake.all as lib
    from sheldrake.common._native.binding import HERE

    diagram = robot(path)
    simulator = lib.Simulator(diagram)
    steps = round(seconds / DT)
    reading = cost_of_reading()
    clocks: dict[str, Clock] = {}
    least: dict[str, np.ndarray] = {}
    whole = np.inf
    for fall in range(FALLS):
        simulator.reset_context(diagram.CreateDefaultContext())
        simulator.Initialize()
        if fall < 3:  # the loop as it is
            simulator.AdvanceTo(DT)  # binds
            begin = time.process_time()
            simulator.AdvanceTo(seconds)
            whole = min(whole, (time.process_time() - begin) / (steps - 1) * 1e6)
            continue
        for r, row in enumerate(simulator._span.layout.rows):
            if row.native and row.calc.__name__ in STAGES:
                clock = clocks.setdefault(row.calc.__name__, Clock(HERE.address(row.calc), steps + 10))
                clock.count[0] = 0
                simulator._span.table[r] = clock.address
        simulator.AdvanceTo(seconds)
        for name, clock in clocks.items():
            times = clock.times[: clock.count[0]] - reading
            before = least.get(name, times)
            calls = min(len(before), len(times))  # a robot at rest has a step or two more where Python looked in
            least[name] = np.minimum(before[:calls], times[:calls])
    scale = cycles_a_microsecond()
    found = dict.fromkeys(NAMES, 0.0)
    for name, times in least.items():
        found[STAGES[name]] += float(times.sum()) / scale / steps
    return {**found, "loop": max(0.0, whole - sum(found.values())), "step": whole}


def draw(table: dict, before: dict, path: pathlib.Path) -> None:
    """A bar a robot, before above after, of the parts that its stages take."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(8.0, 0.5 * len(table) + 1.2), dpi=100)
    for k, name in enumerate(table):
        for row, (found, height) in enumerate(((before.get(name), 0.2), (table[name], -0.2))):
            left = 0.0
            for n, stage in enumerate(NAMES if found else ()):
                label = stage if k == 0 and row == 1 else None
                place = k - height
                axes.barh(place, found[stage], 0.36, left, color=f"C{n}", alpha=(0.5, 1.0)[row], label=label)
                left += found[stage]
    axes.set_yticks(range(len(table)), table)
    axes.invert_yaxis()
    axes.set_xlabel("µs a step, before (pale) and now")
    axes.legend(ncol=len(NAMES), loc="lower right", fontsize=8)
    axes.spines[["top", "right"]].set_visible(False)
    figure.tight_layout()
    figure.savefig(path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="parts of paths; all robots without any")
    parser.add_argument("--seconds", type=float, default=0.3)
    parser.add_argument("--write", type=pathlib.Path, metavar="FILE", help="{robot: {stage: us}}, as JSON")
    parser.add_argument("--before", type=pathlib.Path, metavar="FILE", help="what was written before")
    parser.add_argument("--figure", type=pathlib.Path, metavar="FILE", help="where a picture goes")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    print(machine())
    columns = (*NAMES, "loop", "step")
    print(f"{'us a step':44s}" + "".join(f"{name:>9s}" for name in columns))
    table = {}
    with tempfile.TemporaryDirectory() as folder:
        for path in robot_files("urdf"):
            if options.names and not any(name in str(path) for name in options.names):
                continue
            try:
                found = stages_of(with_hulls(path, pathlib.Path(folder)), options.seconds)
            except (RuntimeError, ValueError, OSError):
                continue  # files that the package does not contain
            name = f"{path.parts[-3].removesuffix('_description')} {path.stem}"
            table[name] = found
            print(f"{name:44s}" + "".join(f"{found[column]:9.2f}" for column in columns), flush=True)
    if options.write:
        options.write.write_text(json.dumps(table, indent=1) + "\n")
    if options.figure:
        draw(table, json.loads(options.before.read_text()) if options.before else {}, options.figure)


if __name__ == "__main__":
    main()
