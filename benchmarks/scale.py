"""How scenes grow: CPU time and memory of building and of a step, from 100 to 5,000 bodies.

    python benchmarks/scale.py [rubble boxes belt net springs] [--bodies 100 1000 5000] [--seconds 0.6]

Scenes: spheres and boxes that fall into a bin, four layers deep and as wide as they need; boxes that stand apart from
each other; boxes on a conveyor belt; spheres joined to a square net by distance constraints, or by springs, which falls
on the ground. Each scene of each size has a process of its own, which counts its memory [MB]. Building is told by
stages [s], up to the second step; steps are timed over the last quarter of the time [us], with what one contact took
[ns], where there are any, and what one body took.
"""

from __future__ import annotations

import argparse
import json
import pathlib
import resource
import subprocess
import sys
import time
import warnings
from collections.abc import Callable

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from benchmarks.turns import machine  # noqa: E402

DT = 1e-3
BODIES = (100, 1000, 5000)
STAGES = ("add", "Finalize", "Build", "context", "poses", "1st step", "2nd step")


class Grown:
    """A scene with n bodies."""

    def __init__(self, name: str, n: int):
        import sheldrake.all as lib

        self.lib, self.n, self.side = lib, n, int(np.ceil(np.sqrt(n)))
        self.builder = lib.DiagramBuilder()
        self.plant, _ = lib.AddMultibodyPlantSceneGraph(self.builder, DT)
        self.friction = lib.CoulombFriction(0.5, 0.5)
        self.bodies: list = []
        self.poses: list = []
        self.speed: float | None = None
        SCENES[name](self)

    def _fixed(self, shape, name: str, p=(0.0, 0.0, 0.0), rpy=(0.0, 0.0, 0.0)) -> None:
        X = self.lib.RigidTransform(self.lib.RollPitchYaw(*rpy), p)
        self.plant.RegisterCollisionGeometry(self.plant.world_body(), X, shape, name, self.friction)

    def _add(self, shape, inertia, X) -> None:
        k = len(self.bodies)
        body = self.plant.AddRigidBody(f"body{k}", inertia)
        self.plant.RegisterCollisionGeometry(body, self.lib.RigidTransform(), shape, f"shape{k}", self.friction)
        self.bodies.append(body)
        self.poses.append(X)

    def _box(self, size: tuple, X) -> None:
        self._add(self.lib.Box(*size), self.lib.SpatialInertia.SolidBoxWithMass(0.3, *size), X)

    def _sphere(self, radius: float, X, mass: float = 0.3) -> None:
        inertia = self.lib.SpatialInertia.SolidSphereWithMass(mass, radius)
        self._add(self.lib.Sphere(radius), inertia, X)

    def rubble(self) -> None:
        lib, rng, turn = self.lib, np.random.default_rng(1), 0.5 * np.pi
        side = int(np.ceil(np.sqrt(self.n / 4)))
        low, high = -0.06, 0.11 * side - 0.05
        self._fixed(lib.HalfSpace(), "ground")
        walls = (((low, 0, 0), (0, turn, 0)), ((high, 0, 0), (0, -turn, 0)),
                 ((0, low, 0), (-turn, 0, 0)), ((0, high, 0), (turn, 0, 0)))  # fmt: skip
        for k, (p, rpy) in enumerate(walls):
            self._fixed(lib.HalfSpace(), f"wall{k}", p, rpy)
        for k in range(self.n):
            layer, j = divmod(k, side * side)
            p = np.array([0.11 * (j % side), 0.11 * (j // side), 0.06 + 0.11 * layer]) + rng.uniform(-0.01, 0.01, 3)
            X = lib.RigidTransform(lib.RollPitchYaw(*rng.uniform(-1.0, 1.0, 3)), p)
            if k % 2:
                self._sphere(0.045, X)
            else:
                self._box((0.08, 0.07, 0.06), X)

    def boxes(self) -> None:
        self._fixed(self.lib.HalfSpace(), "ground")
        for k in range(self.n):
            p = [0.3 * (k % self.side), 0.3 * (k // self.side), 0.0501]
            self._box((0.1, 0.1, 0.1), self.lib.RigidTransform(p))

    def belt(self) -> None:
        lib, plant, length = self.lib, self.plant, 0.2 * self.n + 4.0
        belt = plant.AddRigidBody("belt", lib.SpatialInertia.SolidBoxWithMass(20.0, length, 0.5, 0.2))
        shape = lib.Box(length, 0.5, 0.2)
        plant.RegisterCollisionGeometry(belt, lib.RigidTransform(), shape, "belt", self.friction)
        X_WB = lib.RigidTransform([0.5 * length - 1.0, 0.0, -0.1])
        plant.WeldFrames(plant.world_frame(), belt.body_frame(), X_WB)
        plant.SetSurfaceVelocityAxis(belt, [0, 1, 0])
        self.speed = 0.5
        for k in range(self.n):
            self._box((0.1, 0.1, 0.1), lib.RigidTransform([0.2 * k, 0.0, 0.0501]))

    def _net(self, join: Callable) -> None:
        self._fixed(self.lib.HalfSpace(), "ground")
        for k in range(self.n):
            x, y = k % self.side, k // self.side
            self._sphere(0.02, self.lib.RigidTransform([0.06 * x, 0.06 * y, 0.1]), 0.02)
            for other in [k - 1] * (x > 0) + [k - self.side] * (y > 0):
                join(self.bodies[other], np.zeros(3), self.bodies[k], np.zeros(3), 0.06)

    def net(self) -> None:
        self._net(self.plant.AddDistanceConstraint)

    def springs(self) -> None:
        self._net(lambda *ends: self.plant.AddForceElement(self.lib.LinearSpringDamper(*ends, 200.0, 0.05)))


SCENES = {"rubble": Grown.rubble, "boxes": Grown.boxes, "belt": Grown.belt, "net": Grown.net, "springs": Grown.springs}
"""What puts bodies into each scene."""


def measure(name: str, n: int, seconds: float) -> dict:
    """CPU time of stages [s] and of a step [us], memory [MB], contacts."""
    import sheldrake.all as lib

    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    times = [time.process_time()]

    def done() -> None:
        times.append(time.process_time())

    scene = Grown(name, n)
    plant = scene.plant
    done()
    plant.Finalize()
    done()
    diagram = scene.builder.Build()
    done()
    root = diagram.CreateDefaultContext()
    done()
    context = plant.GetMyMutableContextFromRoot(root)
    for body, X in zip(scene.bodies, scene.poses):
        plant.SetFreeBodyPose(context, body, X)
    if scene.speed is not None:
        speeds = lib.BusValue()
        speeds.Set(plant.GetBodyByName("belt").scoped_name().get_full(), lib.AbstractValue.Make(scene.speed))
        plant.get_surface_speeds_input_port().FixValue(context, speeds)
    done()
    simulator = lib.Simulator(diagram, root)
    simulator.Initialize()
    simulator.AdvanceTo(DT)
    done()
    simulator.AdvanceTo(2 * DT)
    done()
    simulator.AdvanceTo(0.75 * seconds)
    start = time.process_time()
    simulator.AdvanceTo(seconds)
    spent = (time.process_time() - start) / (0.25 * seconds / DT)
    contacts = plant.get_contact_results_output_port().Eval(context).num_point_pair_contacts()
    memory = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    return {"stages": np.diff(times).tolist(), "us": 1e6 * spent, "contacts": contacts, "memory": memory}


def line(name: str, n: int, found: dict) -> str:
    """One scene of one size."""
    stages = "".join(f"{seconds:9.3f}" for seconds in found["stages"])
    each = 1e3 * found["us"] / found["contacts"] if found["contacts"] else float("nan")
    steps = f"{found['us']:11.1f}{found['contacts']:10d}{each:12.0f}{1e3 * found['us'] / n:9.0f}"
    return f"{name:9s}{n:7d}{stages}{found['memory']:8.0f}{steps}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", help=", ".join(SCENES) + "; all without any")
    parser.add_argument("--bodies", type=int, nargs="+", default=BODIES)
    parser.add_argument("--seconds", type=float, default=0.6)
    parser.add_argument("--one", nargs=2, metavar=("SCENE", "BODIES"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    if options.one:
        print(json.dumps(measure(options.one[0], int(options.one[1]), options.seconds)))
        return
    print(machine())
    columns = "".join(f"{stage:>9s}" for stage in STAGES)
    print(f"{'scene':9s}{'bodies':>7s}{columns}{'MB':>8s}{'us a step':>11s}", end="")
    print(f"{'contacts':>10s}{'ns/contact':>12s}{'ns/body':>9s}")
    for name in options.scenes or SCENES:
        for n in options.bodies:
            command = [sys.executable, __file__, "--one", name, str(n), "--seconds", str(options.seconds)]
            done = subprocess.run(command, capture_output=True, text=True, check=True)
            print(line(name, n, json.loads(done.stdout.splitlines()[-1])), flush=True)


if __name__ == "__main__":
    main()
