"""Hydroelastic contact against Drake: CPU time of a 2 ms step, in one run; the two take turns.

    python benchmarks/hydroelastic.py [--rounds 3] [--steps 200]

Scenes: a compliant ball and a compliant box on a rigid ground, two fine compliant balls, and a pile of compliant balls
and rigid boxes in a bin of compliant walls.
"""

from __future__ import annotations

import argparse
import importlib
import statistics
import time
import types
import warnings

import numpy as np

MODULES = ("geometry", "math", "multibody.plant", "multibody.tree", "multibody.math", "systems.framework",
           "systems.analysis")  # fmt: skip


def library(name: str) -> types.SimpleNamespace:
    names: dict = {}
    for module in MODULES:
        loaded = importlib.import_module(f"{name}.{module}")
        names.update({k: getattr(loaded, k) for k in dir(loaded) if not k.startswith("_")})
    return types.SimpleNamespace(**names)


class Scene:
    """A plant under construction."""

    def __init__(self, lib: types.SimpleNamespace):
        self.lib, self.builder = lib, lib.DiagramBuilder()
        self.plant, _ = lib.AddMultibodyPlantSceneGraph(self.builder, 2e-3)
        self.poses: list = []

    def add(self, body, shape, pose, rigid: bool, hint: float = 0.02, modulus: float = 1e6) -> None:
        lib, properties = self.lib, self.lib.ProximityProperties()
        if rigid:
            lib.AddRigidHydroelasticProperties(hint, properties)
        else:
            lib.AddCompliantHydroelasticProperties(hint, modulus, properties)
        lib.AddContactMaterial(dissipation=5.0, friction=lib.CoulombFriction(0.5, 0.5), properties=properties)
        name = f"geometry{len(self.poses)}_{self.plant.num_collision_geometries()}"
        self.plant.RegisterCollisionGeometry(body, pose, shape, name, properties)

    def free(self, shape, p, rigid: bool, **options) -> None:
        inertia = self.lib.SpatialInertia.SolidBoxWithMass(0.5, 0.1, 0.1, 0.1)
        body = self.plant.AddRigidBody(f"body{len(self.poses)}", inertia)
        self.add(body, shape, self.lib.RigidTransform(), rigid, **options)
        self.poses.append((body, p))

    def fixed(self, shape, p, rigid: bool, **options) -> None:
        self.add(self.plant.world_body(), shape, self.lib.RigidTransform(p), rigid, **options)

    def simulator(self):
        self.plant.Finalize()
        diagram = self.builder.Build()
        context = diagram.CreateDefaultContext()
        mine = self.plant.GetMyMutableContextFromRoot(context)
        for k, (body, p) in enumerate(self.poses):
            R = self.lib.RollPitchYaw(0.1 * k, 0.2, 0.3 * k)
            self.plant.SetFreeBodyPose(mine, body, self.lib.RigidTransform(R, p))
        return self.lib.Simulator(diagram, context)


def ball_on_ground(lib):
    scene = Scene(lib)
    scene.fixed(lib.HalfSpace(), [0, 0, 0], True)
    scene.free(lib.Sphere(0.1), [0, 0, 0.099], False, hint=0.02)
    return scene.simulator()


def box_on_table(lib):
    scene = Scene(lib)
    scene.fixed(lib.Box(2, 2, 0.1), [0, 0, -0.05], True)
    scene.free(lib.Box(0.1, 0.1, 0.1), [0, 0, 0.06], False)
    return scene.simulator()


def two_fine_balls(lib):
    scene = Scene(lib)
    scene.fixed(lib.Sphere(0.1), [0, 0, 0], False, hint=0.01)
    scene.free(lib.Sphere(0.1), [0.002, 0.001, 0.198], False, hint=0.01, modulus=2e6)
    return scene.simulator()


def bin_of_bodies(lib):
    scene, rng = Scene(lib), np.random.default_rng(0)
    for x, y in ((0.3, 0), (-0.3, 0), (0, 0.3), (0, -0.3)):
        scene.fixed(lib.Box(0.1 if x else 0.5, 0.1 if y else 0.5, 0.5), [x, y, 0.25], False, modulus=1e7)
    scene.fixed(lib.Box(0.6, 0.6, 0.1), [0, 0, -0.05], False, modulus=1e7)
    for k in range(24):
        p = [*(0.11 * (np.array([k % 4, k // 4 % 3]) - [1.5, 1.0])), 0.08 + 0.12 * (k // 12)]
        p = (np.array(p) + rng.uniform(-0.005, 0.005, 3)).tolist()
        scene.free(*((lib.Sphere(0.05), p, False) if k % 2 else (lib.Box(0.08, 0.08, 0.08), p, True)), hint=0.03)
    return scene.simulator()


def turn(make, lib, steps: int) -> float:
    """CPU time of a step [us]."""
    simulator = make(lib)
    simulator.AdvanceTo(0.002)
    start = time.process_time()
    simulator.AdvanceTo(0.002 * steps)
    return (time.process_time() - start) / (steps - 1) * 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--steps", type=int, default=200)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    ours, drakes = library("sheldrake"), library("pydrake")
    print(f"{'scene':20} {'sheldrake':>10} {'Drake':>10}  ratio   [us a step]")
    for make in (ball_on_ground, box_on_table, two_fine_balls, bin_of_bodies):
        turns = [(turn(make, ours, options.steps), turn(make, drakes, options.steps)) for _ in range(options.rounds)]
        a, b = (statistics.median(t[k] for t in turns) for k in (0, 1))
        print(f"{make.__name__:20} {a:10.1f} {b:10.1f}  {statistics.median(d / s for s, d in turns):5.1f}")


if __name__ == "__main__":
    main()
