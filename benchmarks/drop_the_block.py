"""The falling block against Drake and MuJoCo: CPU time of a 1 ms step with a log of every state, in one run.

    python dev.py bench            or    python benchmarks/drop_the_block.py [--rounds 7] [--seconds 15]

The three take turns, so that a slow moment of the machine hits all of them; ratios are formed turn by turn. Once the
block rests, sheldrake's steps change nothing and are not computed again: how long those take that are computed, the
first 0.2 s tell.
Compiling and set-up are timed apart. All start from the same tilted pose on the same ground.
"""

from __future__ import annotations

import argparse
import pathlib
import platform
import resource
import statistics
import subprocess
import sys
import time
import warnings

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from tests.scenes.scene import drop, library  # noqa: E402

URDF = ROOT / "src" / "sheldrake" / "models" / "two_hole_block" / "two_hole_block.urdf"
MJCF = """
<mujoco>
  <option timestep="0.001"/>
  <asset><mesh name="block" file="{obj}" scale="0.001 0.001 0.001"/></asset>
  <worldbody>
    <geom type="plane" size="1 1 0.1" friction="0.5"/>
    <body name="body" pos="0 0 0.1" quat="{quat}">
      <freejoint/>
      <inertial pos="{com}" mass="{mass}" diaginertia="{inertia}"/>
      <geom type="mesh" mesh="block" friction="0.5"/>
    </body>
  </worldbody>
</mujoco>
"""

BEFORE_REST = 0.2
"""In which the block falls, lands and comes to rest [s]."""


class DrakeLike:
    """The scene in sheldrake or pydrake; `turn` runs it once from the start."""

    def __init__(self, package: str, **options):
        self.lib, self.options = library(package), options

    def turn(self, seconds: float) -> float:
        simulator, *_ = drop(self.lib, str(URDF), **self.options)
        simulator.AdvanceTo(0.001)  # what happens once: first context, first native call
        start = time.process_time()
        simulator.AdvanceTo(seconds)
        return (time.process_time() - start) / (seconds * 1000 - 1) * 1e6


class MuJoCo:
    """The scene in MuJoCo's own compiled loop over steps, which also records every state."""

    def __init__(self):
        from xml.etree import ElementTree

        import mujoco
        import mujoco.rollout

        from sheldrake.math import RigidTransform, RollPitchYaw

        inertial = ElementTree.parse(URDF).getroot().find("link/inertial")
        inertia = inertial.find("inertia").attrib
        quat = RigidTransform(RollPitchYaw(0.3, 0.2, 0.1), [0, 0, 0]).rotation().ToQuaternion().wxyz()
        xml = MJCF.format(
            obj=URDF.with_suffix(".obj"),
            quat=" ".join(map(repr, quat.tolist())),
            com=inertial.find("origin").get("xyz"),
            mass=inertial.find("mass").get("value"),
            inertia=" ".join(inertia[k] for k in ("ixx", "iyy", "izz")),
        )
        self.mujoco, self.model = mujoco, mujoco.MjModel.from_xml_string(xml)
        self.data = mujoco.MjData(self.model)

    def turn(self, seconds: float) -> float:
        mujoco = self.mujoco
        steps = round(seconds * 1000)
        mujoco.mj_resetData(self.model, self.data)
        size = mujoco.mj_stateSize(self.model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        state = np.zeros((1, size))
        mujoco.mj_getState(self.model, self.data, state[0], mujoco.mjtState.mjSTATE_FULLPHYSICS)
        start = time.process_time()
        mujoco.rollout.rollout(self.model, self.data, state, nstep=steps)
        return (time.process_time() - start) / steps * 1e6


PEAK = """
import sys
if sys.platform == "linux":  # ru_maxrss would count what the parent used before exec
    print(next(int(line.split()[1]) / 1024 for line in open("/proc/self/status") if line.startswith("VmHWM")))
else:
    import resource
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6)
"""


def whole_process(code: str) -> tuple[float, float]:
    """Wall time [s] and peak memory [MB] of a fresh Python that runs `code`."""
    start = time.perf_counter()
    command = [sys.executable, "-W", "ignore", "-c", code + PEAK]
    out = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return time.perf_counter() - start, float(out.stdout.split()[-1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--seconds", type=float, default=15.0)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    print(f"{platform.processor() or platform.machine()}, Python {platform.python_version()}")

    start = time.perf_counter()
    contenders: dict[str, object] = {
        "sheldrake multi_point": DrakeLike("sheldrake"),
        "sheldrake single_point": DrakeLike("sheldrake", algorithm="single_point"),
    }
    contenders["sheldrake multi_point"].turn(0.2)
    print(f"first scene in this process, imports and compiling included: {time.perf_counter() - start:.2f} s")
    for name, make in (("Drake kLagged", lambda: DrakeLike("pydrake")), ("MuJoCo", MuJoCo)):
        try:
            contenders[name] = make()
        except ImportError as error:
            print(f"without {name}: {error}")

    times: dict[str, list[float]] = {name: [] for name in contenders}
    moving: dict[str, list[float]] = {name: [] for name in contenders}
    for _ in range(options.rounds):
        for name, contender in contenders.items():
            times[name].append(contender.turn(options.seconds))
            moving[name].append(min(contender.turn(BEFORE_REST) for _ in range(5)))
    for title, table in ((f"{options.seconds} s", times), (f"{BEFORE_REST} s", moving)):
        print(f"\n{f'us a step (CPU), {title}':28s}{'median':>9s}{'min':>9s}{'max':>9s}")
        for name, t in table.items():
            print(f"{name:28s}{statistics.median(t):9.3f}{min(t):9.3f}{max(t):9.3f}")
        for rival in ("Drake kLagged", "MuJoCo"):
            for name in (n for n in table if n.startswith("sheldrake") and rival in table):
                ratio = [b / a for a, b in zip(table[name], table[rival])]
                print(f"{rival} / {name}: {statistics.median(ratio):.1f}  ({min(ratio):.1f} to {max(ratio):.1f})")
    print(
        f"\npeak memory of this process: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB (all three)"
    )
    path = "import sys; sys.path[:0] = ['.', 'src']\n"
    scene = path + "from tests.scenes.scene import *; drop(library('sheldrake'), {!r})[0].AdvanceTo({})"
    empty = min(whole_process("pass")[0] for _ in range(5))
    for title, code in (
        ("import sheldrake.all", path + "import sheldrake.all; sheldrake.all.Simulator"),
        ("import sheldrake", path + "import sheldrake"),
        ("scene, one step, warm cache", scene.format(str(URDF), 0.001)),
        ("scene, 15 s", scene.format(str(URDF), 15.0)),
    ):
        runs = [whole_process(code) for _ in range(5)]
        wall = statistics.median(r[0] for r in runs)
        print(f"{title:32s}{wall - empty:7.2f} s more than an empty Python ({empty:.2f} s), {runs[0][1]:.0f} MB")


if __name__ == "__main__":
    main()
