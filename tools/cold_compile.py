"""What the first step of a scene costs where nothing is compiled yet: `python tools/cold_compile.py quadruped`.

A fresh Python builds the scene and takes its first step, with an empty folder for compiled kernels and without the
library of the wheel. Prints, as JSON, CPU time of that process and of all it starts, wall time, peak memory of the
largest of them, and what it has left in the folder. Imports are included; with `--again` the same is measured a second
time, when all is compiled, so that the difference is the compiler's.
"""

from __future__ import annotations

import argparse
import json
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
STEP = 1e-3  # of all scenes [s]


def readme() -> None:
    """The program of the README, as far as its first step."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    program = re.findall(r"```python\n(.*?)```", text, re.DOTALL)[0]
    beginning, _, rest = program.partition("simulator.AdvanceTo(")
    assert rest, "the README's program advances no simulator"
    exec(f"{beginning}simulator.AdvanceTo({STEP})", {})


def clutter20() -> None:
    """Twenty spheres and boxes above their bin."""
    from benchmarks import contact
    from benchmarks.engines import DrakeLike

    scene = contact.scene("clutter20")
    assert scene.time_step == STEP
    engine = DrakeLike("sheldrake")
    engine.start(scene)
    engine.advance(STEP)


def quadruped() -> None:
    """A quadruped on its feet."""
    from benchmarks.quadruped import DrakeLike

    DrakeLike("sheldrake", settle=0.0)


SCENES = {"readme": readme, "clutter20": clutter20, "quadruped": quadruped}


def measure(name: str, cache: str) -> dict[str, float]:
    """Costs of a fresh Python that takes the first step of a scene, with this folder for compiled kernels."""
    environment = {**os.environ, "SHELDRAKE_CACHE_DIR": cache, "SHELDRAKE_PREBUILT": "0", "SHELDRAKE_QUIET": "1"}
    before, start = _cpu_of_children(), time.perf_counter()
    subprocess.run([sys.executable, "-W", "ignore", __file__, name, "--here"], cwd=ROOT, env=environment, check=True)
    wall = time.perf_counter() - start
    files = [path for path in pathlib.Path(cache).rglob("*") if path.is_file()]
    return {
        "cpu_s": round(_cpu_of_children() - before, 2),
        "wall_s": round(wall, 2),
        "peak_MB": round(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024, 1),
        "files": len(files),
        "kB": round(sum(path.stat().st_size for path in files) / 1e3, 1),
    }


def _cpu_of_children() -> float:
    """CPU time of all processes that have been started and have ended, and of those that they started [s]."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def main() -> None:
    """Measures one scene, or is what is measured."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", choices=SCENES)
    parser.add_argument("--again", action="store_true", help="measure with all compiled too")
    parser.add_argument("--here", action="store_true", help="only take the step, in this process; measure nothing")
    options = parser.parse_args()
    if options.here:
        sys.path[:0] = [str(ROOT), str(ROOT / "src")]
        SCENES[options.scene]()
        return
    with tempfile.TemporaryDirectory() as cache:
        found: dict[str, object] = {"scene": options.scene, **measure(options.scene, cache)}
        if options.again:
            found["again"] = measure(options.scene, cache)
    if isinstance(again := found.get("again"), dict):
        del again["peak_MB"]  # the largest process so far, which is of the first time
    print(json.dumps(found))


if __name__ == "__main__":
    main()
