"""Robots that programs build again and again, stage by stage, against Drake: CPU time in milliseconds.

    python benchmarks/builds.py [ROBOT ...] [--rounds 5] [--first]

Robots: arm (seven joints), cart-pole (SDFormat), quadruped, chain (made by calls, no file), and, with
example-robot-data or SHELDRAKE_ROBOTS, panda and romeo (59 bodies), whose meshes are replaced by their hulls. Both
libraries take turns in one process; the mean of a turn counts, and the best turn. `--first` shows the first build of a
process instead, with kernels and Python's bytecode made before: the import of `....all`, what comes after it, and both
("process"); the best of some processes.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src"), str(ROOT / "benchmarks" / "in_the_loop")]

from benchmarks.turns import machine, take_turns  # noqa: E402

SECONDS_A_TURN = 0.15
LIBRARIES = ("sheldrake", "pydrake")
STAGES = (
    "new plant",
    "parse",
    "Finalize",
    "Build",
    "context",
    "Clone",
    "Simulator",
    "first step",
    "all",
    "InverseKin.",
)

CART_POLE = """<sdf version="1.7"><model name="cart_pole">
  <link name="cart"><inertial><mass>10</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial>
    <visual name="v"><geometry><box><size>0.24 0.12 0.12</size></box></geometry></visual>
    <collision name="c"><geometry><box><size>0.24 0.12 0.12</size></box></geometry></collision></link>
  <link name="pole"><pose>0 0 -0.5 0 0 0</pose><inertial><mass>1</mass>
    <inertia><ixx>0.01</ixx><iyy>0.01</iyy><izz>0.01</izz></inertia></inertial>
    <visual name="ball"><geometry><sphere><radius>0.05</radius></sphere></geometry></visual>
    <visual name="rod"><geometry><cylinder><radius>0.02</radius><length>0.5</length></cylinder></geometry></visual>
  </link>
  <joint name="slide" type="prismatic"><parent>world</parent><child>cart</child>
    <axis><xyz>1 0 0</xyz><limit><effort>100</effort></limit></axis></joint>
  <joint name="swing" type="revolute"><parent>cart</parent><child>pole</child><pose>0 0 0.5 0 0 0</pose>
    <axis><xyz>0 1 0</xyz><limit><effort>0</effort></limit></axis></joint>
</model></sdf>"""


def files(folder: pathlib.Path) -> dict[str, pathlib.Path | None]:
    """The description of each robot; None for one that is made by calls."""
    from _robots import arm
    from benchmarks.real_robots import robots_folder, with_hulls

    (folder / "arm.urdf").write_text(arm())
    (folder / "cart_pole.sdf").write_text(CART_POLE)
    found: dict[str, pathlib.Path | None] = {
        "arm": folder / "arm.urdf",
        "cart-pole": folder / "cart_pole.sdf",
        "quadruped": ROOT / "src/sheldrake/models/quadruped/quadruped.urdf",
        "chain": None,
    }
    robots = robots_folder()
    if robots is not None:
        for name, file in (
            ("panda", "panda_description/urdf/panda.urdf"),
            ("romeo", "romeo_description/urdf/romeo_small.urdf"),
        ):
            found[name] = with_hulls(robots / file, folder, visuals=True)
    return found


def add_chain(lib: Any, plant: Any) -> None:
    """Twenty links, as a program makes them that varies their lengths."""
    friction, parent = lib.CoulombFriction(0.5, 0.5), plant.world_body()
    instance = plant.AddModelInstance("chain")
    for k in range(20):
        length = 0.2 + 0.01 * k
        inertia = lib.SpatialInertia.SolidBoxWithMass(1.0, 0.05, 0.05, length)
        body = plant.AddRigidBody(f"link{k}", instance, inertia)
        at, middle = (lib.RigidTransform([0.0, 0.0, z]) for z in (-length, -0.5 * length))
        joint = lib.RevoluteJoint(
            f"joint{k}",
            plant.AddFrame(lib.FixedOffsetFrame(f"mount{k}", parent.body_frame(), at)),
            body.body_frame(),
            [0.0, 1.0, 0.0],
            0.1,
        )
        plant.AddJointActuator(f"motor{k}", plant.AddJoint(joint), 10.0)
        shape = lib.Box(0.05, 0.05, length)
        plant.RegisterCollisionGeometry(body, middle, shape, f"collision{k}", friction)
        plant.RegisterVisualGeometry(body, middle, shape, f"visual{k}", np.array([0.5, 0.5, 0.5, 1.0]))
        parent = body


def build(lib: Any, path: pathlib.Path | None) -> list[float]:
    """CPU time of each stage of one build [s]."""
    times = [time.process_time()]

    def done() -> None:
        times.append(time.process_time())

    builder = lib.DiagramBuilder()
    plant, _ = lib.AddMultibodyPlantSceneGraph(builder, 0.001)
    done()
    if path is None:
        add_chain(lib, plant)
    else:
        lib.Parser(plant).AddModels(str(path))
    done()
    plant.Finalize()
    done()
    diagram = builder.Build()
    done()
    context = diagram.CreateDefaultContext()
    done()
    context.Clone()
    done()
    simulator = lib.Simulator(diagram, context)
    simulator.Initialize()
    done()
    simulator.AdvanceTo(0.001)
    done()
    total = times[-1] - times[0]
    posture = plant.GetMyContextFromRoot(context)
    start = time.process_time()
    lib.InverseKinematics(plant, posture)
    return [*np.diff(times), total, time.process_time() - start]


def measured(path: pathlib.Path | None, rounds: int) -> dict[str, np.ndarray]:
    """The stages' times in later builds, by library [s]."""
    libraries = {name: importlib.import_module(f"{name}.all") for name in LIBRARIES}
    best: dict[str, np.ndarray] = {}

    def contender(name: str) -> Callable[[], float]:
        build(libraries[name], path)
        once = build(libraries[name], path)[STAGES.index("all")]
        count = max(3, round(SECONDS_A_TURN / once))

        def turn() -> float:
            mean = np.mean([build(libraries[name], path) for _ in range(count)], axis=0)
            best[name] = np.minimum(best.get(name, mean), mean)
            return 0.0

        return turn

    take_turns({name: contender(name) for name in LIBRARIES}, rounds)
    return best


def measured_first(path: pathlib.Path | None, rounds: int) -> dict[str, np.ndarray]:
    """The stages' times in the first build of a process, by library [s]."""
    best: dict[str, np.ndarray] = {}
    with tempfile.TemporaryDirectory() as bytecode:  # as where people run programs again, whatever is set here
        environment = {**os.environ, "PYTHONPYCACHEPREFIX": bytecode, "PYTHONDONTWRITEBYTECODE": ""}
        for name in (*LIBRARIES, *LIBRARIES * rounds):
            command = [sys.executable, __file__, "--one", name, str(path or "")]
            done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
            found = np.array(json.loads(done.stdout.splitlines()[-1]))
            best[name] = np.minimum(best.get(name, found), found)
    return best


def report(robot: str, best: dict[str, np.ndarray], stages: tuple[str, ...]) -> None:
    """Prints a table of a robot's stages."""
    print(f"\n{robot:16s}" + "".join(f"{stage:>12s}" for stage in stages))
    for name in LIBRARIES:
        print(f"{name:16s}" + "".join(f"{1e3 * seconds:12.3f}" for seconds in best[name]))
    ratios = best["sheldrake"] / best["pydrake"]
    print(f"{'ours/Drake':16s}" + "".join(f"{ratio:12.2f}" for ratio in ratios), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robots", nargs="*")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--first", action="store_true", help="the first build of a process")
    parser.add_argument("--one", nargs=2, metavar=("PACKAGE", "FILE"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    if options.one:
        package, path = options.one
        start = time.process_time()
        lib = importlib.import_module(f"{package}.all")
        imported = time.process_time() - start
        times = build(lib, pathlib.Path(path) if path else None)
        print(json.dumps([*times, imported, imported + times[STAGES.index("all")]]))
        return
    print(machine())
    with tempfile.TemporaryDirectory() as folder:
        for robot, path in files(pathlib.Path(folder)).items():
            if not options.robots or robot in options.robots:
                if options.first:
                    report(robot, measured_first(path, options.rounds), (*STAGES, "import", "process"))
                else:
                    report(robot, measured(path, options.rounds), STAGES)


if __name__ == "__main__":
    main()
