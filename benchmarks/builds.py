"""Robots that programs build again and again, stage by stage, against Drake: CPU time in milliseconds.

    python benchmarks/builds.py [ROBOT ...] [--rounds 5] [--first]

Robots: arm (seven joints), cart-pole (SDFormat), quadruped, chain (made by calls, no file), and, with
example-robot-data or SHELDRAKE_ROBOTS, panda and romeo (59 bodies), whose meshes are replaced by their hulls; pendulums
of 1, 7 and 30 joints made by calls, without geometry and without a diagram (bare1, ...); rows of 1, 10 and 100 gains
and integrators (blocks1, ...). Both libraries take turns in one process; the mean of a turn counts, and the best turn.
`--first` shows the first build of a process instead, with kernels and Python's bytecode made before: the import of
`....all`, what comes after it, and both ("process"); the best of some processes.
"""

from __future__ import annotations

import argparse
import importlib
import json
import logging
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src"), str(ROOT / "benchmarks" / "in_the_loop")]

from benchmarks.turns import machine, take_turns  # noqa: E402

SECONDS_A_TURN = 0.15
LIBRARIES = ("sheldrake", "pydrake")
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


Build = Callable[[Any], Iterator[str]]
"""What a program builds with a library, in stages: gives the name of each when it has ended."""


def builds(folder: pathlib.Path) -> dict[str, Build]:
    """The programs by name."""
    from _robots import arm
    from benchmarks.real_robots import robots_folder, with_hulls

    (folder / "arm.urdf").write_text(arm())
    (folder / "cart_pole.sdf").write_text(CART_POLE)
    found: dict[str, Build] = {
        "arm": partial(robot, folder / "arm.urdf"),
        "cart-pole": partial(robot, folder / "cart_pole.sdf"),
        "quadruped": partial(robot, ROOT / "src/sheldrake/models/quadruped/quadruped.urdf"),
        "chain": partial(robot, None),
        **{f"bare{joints}": partial(bare, joints) for joints in (1, 7, 30)},
        **{f"blocks{count}": partial(blocks, count) for count in (1, 10, 100)},
    }
    robots = robots_folder()
    if robots is not None:
        for name, file in (
            ("panda", "panda_description/urdf/panda.urdf"),
            ("romeo", "romeo_description/urdf/romeo_small.urdf"),
        ):
            found[name] = partial(robot, with_hulls(robots / file, folder, visuals=True))
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


def robot(path: pathlib.Path | None, lib: Any) -> Iterator[str]:
    """A robot of a file, or the chain, on a table of shapes; and inverse kinematics of it."""
    builder = lib.DiagramBuilder()
    plant, _ = lib.AddMultibodyPlantSceneGraph(builder, 0.001)
    yield "new plant"
    if path is None:
        add_chain(lib, plant)
    else:
        lib.Parser(plant).AddModels(str(path))
    yield "parse"
    plant.Finalize()
    yield "Finalize"
    diagram = builder.Build()
    yield "Build"
    context = diagram.CreateDefaultContext()
    yield "context"
    yield from run(lib, diagram, context)
    posture = plant.GetMyContextFromRoot(context)
    lib.InverseKinematics(plant, posture)
    yield "InverseKin."


def run(lib: Any, system: Any, context: Any) -> Iterator[str]:
    """What follows a context: a copy, and a simulator's first step."""
    context.Clone()
    yield "Clone"
    simulator = lib.Simulator(system, context)
    simulator.Initialize()
    yield "Simulator"
    simulator.AdvanceTo(0.001)
    yield "first step"


def with_duals(system: Any) -> Iterator[str]:
    """The system on another scalar, and a context of that."""
    system = system.ToAutoDiffXd()
    yield "ToAutoDiff"
    system.CreateDefaultContext()
    yield "its context"


def bare(joints: int, lib: Any) -> Iterator[str]:
    """A pendulum of so many links, of which other scalars and their contexts are wanted too."""
    plant = lib.MultibodyPlant(0.001)
    yield "new plant"
    parent = plant.world_body()
    for k in range(joints):
        body = plant.AddRigidBody(f"link{k}", lib.SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 0.5 + 0.01 * k))
        plant.AddJoint(
            lib.RevoluteJoint(f"joint{k}", parent.body_frame(), body.body_frame(), np.array([0.0, 1.0, 0.0]))
        )
        parent = body
    yield "elements"
    plant.Finalize()
    yield "Finalize"
    context = plant.CreateDefaultContext()
    yield "context"
    plant.CalcMassMatrix(context)
    yield "mass matrix"
    yield from run(lib, plant, context)
    yield from with_duals(plant)


def blocks(count: int, lib: Any) -> Iterator[str]:
    """Gains and integrators by turns in a row, driven by a sine."""
    builder = lib.DiagramBuilder()
    before = builder.AddSystem(lib.Sine(1.0, 1.0, 0.0, 2))
    for k in range(count):
        block = builder.AddSystem(lib.Integrator(2) if k % 2 else lib.Gain(0.5, 2))
        builder.Connect(before.get_output_port(0), block.get_input_port(0))
        before = block
    yield "systems"
    builder.ExportOutput(before.get_output_port(0))
    diagram = builder.Build()
    yield "Build"
    context = diagram.CreateDefaultContext()
    yield "context"
    yield from run(lib, diagram, context)
    yield from with_duals(diagram)


Times = dict[str, float]
"""CPU time by stage [s]."""


def timed(build: Build, lib: Any) -> Times:
    """The stages of one build, and all up to the first step."""
    times, before = {}, time.process_time()
    for stage in build(lib):
        times[stage] = time.process_time() - before
        if stage == "first step":
            times["all"] = sum(times.values())
        before = time.process_time()
    return times


def at_best(best: Times | None, other: Times) -> Times:
    """The smaller time of each stage."""
    return other if best is None else {stage: min(seconds, other[stage]) for stage, seconds in best.items()}


def measured(build: Build, rounds: int) -> dict[str, Times]:
    """The stages' times in later builds, by library."""
    libraries = {name: importlib.import_module(f"{name}.all") for name in LIBRARIES}
    best: dict[str, Times] = {}

    def contender(name: str) -> Callable[[], float]:
        timed(build, libraries[name])
        once = sum(timed(build, libraries[name]).values())
        count = max(3, round(SECONDS_A_TURN / once))

        def turn() -> float:
            found = [timed(build, libraries[name]) for _ in range(count)]
            mean = {stage: float(np.mean([times[stage] for times in found])) for stage in found[0]}
            best[name] = at_best(best.get(name), mean)
            return 0.0

        return turn

    take_turns({name: contender(name) for name in LIBRARIES}, rounds)
    return best


def measured_first(program: str, rounds: int) -> dict[str, Times]:
    """The stages' times in the first build of a process, by library."""
    best: dict[str, Times] = {}
    with tempfile.TemporaryDirectory() as bytecode:  # as where people run programs again, whatever is set here
        environment = {**os.environ, "PYTHONPYCACHEPREFIX": bytecode, "PYTHONDONTWRITEBYTECODE": ""}
        for name in (*LIBRARIES, *LIBRARIES * rounds):
            command = [sys.executable, __file__, "--one", name, program]
            done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
            best[name] = at_best(best.get(name), json.loads(done.stdout.splitlines()[-1]))
    return best


def report(program: str, best: dict[str, Times]) -> None:
    """Prints a table of the stages of a program."""
    stages = list(best[LIBRARIES[0]])
    print(f"\n{program:16s}" + "".join(f"{stage:>12s}" for stage in stages))
    for name in LIBRARIES:
        print(f"{name:16s}" + "".join(f"{1e3 * best[name][stage]:12.3f}" for stage in stages))
    ours, theirs = (best[name] for name in LIBRARIES)
    print(f"{'ours/Drake':16s}" + "".join(f"{ours[stage] / theirs[stage]:12.2f}" for stage in stages), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", nargs="*")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--first", action="store_true", help="the first build of a process")
    parser.add_argument("--one", nargs=2, metavar=("PACKAGE", "PROGRAM"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    logging.disable()
    with tempfile.TemporaryDirectory() as folder:
        programs = builds(pathlib.Path(folder))
        if options.one:
            package, program = options.one
            start = time.process_time()
            lib = importlib.import_module(f"{package}.all")
            imported = time.process_time() - start
            times = timed(programs[program], lib)
            print(json.dumps({**times, "import": imported, "process": imported + times["all"]}))
            return
        print(machine())
        for program in options.programs or programs:
            if options.first:
                report(program, measured_first(program, options.rounds))
            else:
                report(program, measured(programs[program], options.rounds))


if __name__ == "__main__":
    main()
