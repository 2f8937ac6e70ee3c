"""Continuous plants with contact, error-controlled, against Drake: CPU time of a second, and steps taken.

    python benchmarks/continuous.py [quadruped a1 ur5 g1 romeo] [--schemes cenic implicit_euler radau3]
                                    [--accuracy 1e-3] [--seconds 0.2] [--rounds 3]

Quadrupeds land on their feet from a height of 2 cm, the others begin in the posture of zeros, above the ground; every
joint has a torsional spring to the posture it begins in and a damper, so that all schemes integrate the same forces.
All but the first are those of example-robot-data (found there or by SHELDRAKE_ROBOTS), meshes replaced by their hulls,
without contact of the two sides of a joint. "-" is a scheme that a library gives up with.
"""

from __future__ import annotations

import argparse
import importlib
import pathlib
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from benchmarks import quadruped  # noqa: E402
from benchmarks.real_robots import exclude_neighbours, with_hulls  # noqa: E402
from benchmarks.turns import machine, ratio, take_turns  # noqa: E402
from tests.crosscheck.robots.real_robots import robots_folder  # noqa: E402

SCHEMES = ("cenic", "implicit_euler", "radau3")
STIFFNESS, DAMPING = 300.0, 8.0
"""Of each joint [N m/rad, N m s/rad]."""


OTHERS = (
    ("ur5", "ur_description/urdf/ur5_robot.urdf", 1.0),
    ("g1", "g1_description/urdf/g1_29dof_rev_1_0.urdf", 0.8),
    ("romeo", "romeo_description/urdf/romeo_small.urdf", 0.9),
)
"""Robots of example-robot-data that Drake can read and integrate, and the heights of their bases [m]."""


class Robot(NamedTuple):
    """A description, the height of its base above the ground [m], and the angles of its joints [rad] if not zero."""

    urdf: pathlib.Path
    height: float
    angles: np.ndarray | None = None


def robots(folder: pathlib.Path) -> dict[str, Robot]:
    """The robots there are; files made for them go into a folder."""
    standing = quadruped.robots(folder)
    found = {name: Robot(r.urdf, r.height() + 0.02, r.stance()) for name, r in standing.items()}
    others = robots_folder()
    if others is not None:
        for name, file, height in OTHERS:
            found[name] = Robot(with_hulls(others / file, folder), height)
    return found


class Contender:
    """A robot in sheldrake or pydrake, integrated by a scheme."""

    def __init__(self, package: str, robot: Robot, scheme: str, accuracy: float):
        self.lib = lib = importlib.import_module(f"{package}.all")
        builder = lib.DiagramBuilder()
        plant, scene_graph = lib.AddMultibodyPlantSceneGraph(builder, 0.0)
        lib.Parser(plant).AddModels(str(robot.urdf))
        X = lib.RigidTransform([0.0, 0.0, -robot.height])
        plant.RegisterCollisionGeometry(plant.world_body(), X, lib.HalfSpace(), "ground", lib.CoulombFriction(0.8, 0.8))
        joints = [plant.get_joint(i) for i in plant.GetJointIndices()]
        turning = [joint for joint in joints if isinstance(joint, lib.RevoluteJoint)]
        for k, joint in enumerate(turning):
            angle = 0.0 if robot.angles is None else float(robot.angles[k])
            joint.set_default_angle(angle)
            joint.set_default_damping(DAMPING)
            plant.AddForceElement(lib.RevoluteSpring(joint, angle, STIFFNESS))
        plant.Finalize()
        exclude_neighbours(lib, plant, scene_graph)
        self.diagram = builder.Build()
        self.simulator = lib.Simulator(self.diagram)
        self.integrator = lib.ResetIntegratorFromFlags(self.simulator, scheme, 0.01)
        self.integrator.set_fixed_step_mode(False)
        self.integrator.set_target_accuracy(accuracy)

    def turn(self, seconds: float) -> float:
        """CPU time of a simulated second [s]."""
        self.simulator.reset_context(self.diagram.CreateDefaultContext())
        self.simulator.Initialize()
        start = time.process_time()
        self.simulator.AdvanceTo(seconds)
        return (time.process_time() - start) / seconds


def turns_of(package: str, robot: Robot, scheme: str, options: argparse.Namespace) -> Contender | None:
    """A contender that comes to the end, else None."""
    try:
        contender = Contender(package, robot, scheme, options.accuracy)
        contender.turn(options.seconds)
    except (RuntimeError, ValueError) as error:
        print(f"{package}, {scheme}: {str(error)[:100]}", file=sys.stderr)
        return None
    return contender


def compare(name: str, robot: Robot, scheme: str, options: argparse.Namespace) -> None:
    """Prints a line for both libraries."""
    found = {package: turns_of(package, robot, scheme, options) for package in ("sheldrake", "pydrake")}
    turns: dict[str, Callable[[], float]] = {
        package: (lambda c=contender: c.turn(options.seconds)) for package, contender in found.items() if contender
    }
    times = take_turns(turns, options.rounds)
    cells = ""
    for package, contender in found.items():
        took = f"{1e3 * np.median(times[package]):9.1f}" if contender else f"{'-':>9s}"
        steps = f"{contender.integrator.get_num_steps_taken():8d}" if contender else f"{'-':>8s}"
        cells += took + steps
    both = ratio(times, "pydrake", "sheldrake") if len(times) == 2 else "-"
    print(f"{name:11s}{scheme:18s}{cells}{both:>24s}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robots", nargs="*", help="all there are without any")
    parser.add_argument("--schemes", nargs="+", default=SCHEMES)
    parser.add_argument("--accuracy", type=float, default=1e-3)
    parser.add_argument("--seconds", type=float, default=0.2)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    print(machine())
    print(f"{'ms a second, steps':29s}{'sheldrake':>17s}{'Drake':>17s}{'Drake / ours':>24s}")
    with tempfile.TemporaryDirectory() as folder:
        for name, robot in robots(pathlib.Path(folder)).items():
            if not options.robots or name in options.robots:
                for scheme in options.schemes:
                    compare(name, robot, scheme, options)


if __name__ == "__main__":
    main()
