"""Many contacts against Drake and MuJoCo: CPU time of a 1 ms step, and how deep and how still the bodies are.

    python benchmarks/contact.py [stack clutter20 clutter50 clutter200 pile] [--rounds 3]

Scenes: a stack of ten boxes; a bin of 20, 50, 200 spheres and boxes; thirty boxes heaped in a narrow bin. The
engines take turns; a turn starts a scene anew, lets the bodies fall for some seconds, then times the steps that follow.
"""

from __future__ import annotations

import argparse
import importlib
import pathlib
import statistics
import sys
import time

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "src")]

FRICTION = 0.5
FLOOR = ((0.0, 0.0, 1.0), 0.0)
SCENES = {
    "stack": (1.0, 1.0),
    "clutter20": (2.0, 1.0),
    "clutter50": (2.0, 1.0),
    "clutter200": (2.0, 0.3),
    "pile": (5.0, 1.0),
}
"""Seconds to settle and seconds to time."""


def walls(half: float) -> list:
    """Floor and four walls of a bin of this half width [m]."""
    return [FLOOR, *(((x, y, 0.0), -half) for x, y in ((-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)))]


class Scene:
    """Half spaces (normal, offset), and free bodies: half sizes or radius, mass, roll-pitch-yaw, position."""

    def __init__(self, name: str):
        self.planes, self.bodies = [FLOOR], []
        rng = np.random.default_rng(1)
        if name == "stack":
            for i in range(10):
                self.bodies.append(((0.05, 0.05, 0.05), 0.3, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0501 + 0.1 * i)))
        elif name == "pile":
            self.planes = walls(0.12)
            for i in range(30):
                p = (rng.uniform(-0.06, 0.06), rng.uniform(-0.06, 0.06), 0.08 + 0.11 * i)
                self.bodies.append(((0.04, 0.035, 0.03), 0.3, tuple(rng.uniform(-1.0, 1.0, 3)), p))
        else:
            self.planes = walls(0.25)
            for i in range(int(name.removeprefix("clutter"))):
                layer, j = divmod(i, 9)
                p = np.array([(j % 3 - 1) * 0.13, (j // 3 - 1) * 0.13, 0.10 + 0.13 * layer])
                p += rng.uniform(-0.01, 0.01, 3)
                shape = 0.045 if i % 2 == 0 else (0.04, 0.035, 0.03)
                self.bodies.append((shape, 0.3, tuple(rng.uniform(-1.0, 1.0, 3)), tuple(p)))


class DrakeLike:
    """A scene in sheldrake or pydrake."""

    def __init__(self, package: str):
        self.lib = importlib.import_module(f"{package}.all")

    def start(self, scene: Scene) -> None:
        lib = self.lib
        builder = lib.DiagramBuilder()
        plant, _ = lib.AddMultibodyPlantSceneGraph(builder, 1e-3)
        friction = lib.CoulombFriction(FRICTION, FRICTION)
        for k, (normal, offset) in enumerate(scene.planes):
            X = lib.HalfSpace.MakePose(np.array(normal), np.array(normal) * offset)
            plant.RegisterCollisionGeometry(plant.world_body(), X, lib.HalfSpace(), f"plane{k}", friction)
        poses = []
        for k, (shape, mass, rpy, p) in enumerate(scene.bodies):
            if isinstance(shape, float):
                inertia, solid = lib.SpatialInertia.SolidSphereWithMass(mass, shape), lib.Sphere(shape)
            else:
                size = [2.0 * s for s in shape]
                inertia, solid = lib.SpatialInertia.SolidBoxWithMass(mass, *size), lib.Box(*size)
            body = plant.AddRigidBody(f"body{k}", inertia)
            plant.RegisterCollisionGeometry(body, lib.RigidTransform(), solid, f"solid{k}", friction)
            poses.append((body, lib.RigidTransform(lib.RollPitchYaw(*rpy), p)))
        plant.Finalize()
        diagram = builder.Build()
        self.simulator = lib.Simulator(diagram)
        self.plant, self.context = plant, plant.GetMyContextFromRoot(self.simulator.get_context())
        for body, X in poses:
            plant.SetFreeBodyPose(self.context, body, X)
        self.simulator.Initialize()

    def advance(self, seconds: float) -> None:
        self.simulator.AdvanceTo(self.simulator.get_context().get_time() + seconds)

    def speeds(self) -> np.ndarray:
        return np.abs(self.plant.GetVelocities(self.context).reshape(-1, 6)[:, 3:]).max(axis=1)

    def depth_and_contacts(self) -> tuple[float, int]:
        results = self.plant.get_contact_results_output_port().Eval(self.context)
        n = results.num_point_pair_contacts()
        return max((results.point_pair_contact_info(k).point_pair().depth for k in range(n)), default=0.0), n


class MuJoCo:
    """A scene in MuJoCo, with planes as walls."""

    def __init__(self, cone: str):
        import mujoco

        self.mujoco, self.cone = mujoco, cone

    def start(self, scene: Scene) -> None:
        from pydrake.math import RollPitchYaw

        xml = [f'<mujoco><option timestep="0.001" cone="{self.cone}"/><size memory="200M"/><worldbody>']
        grip = f'friction="{FRICTION} 0 0"'
        for normal, offset in scene.planes:
            at, axis = np.array(normal) * offset, np.array(normal)
            xml.append(f'<geom type="plane" size="0 0 1" pos="{_text(at)}" zaxis="{_text(axis)}" {grip}/>')
        for shape, mass, rpy, p in scene.bodies:
            kind, size = ("sphere", (shape,)) if isinstance(shape, float) else ("box", shape)
            quat = RollPitchYaw(*rpy).ToQuaternion().wxyz()
            xml.append(f'<body pos="{_text(p)}" quat="{_text(quat)}"><freejoint/>')
            xml.append(f'<geom type="{kind}" size="{_text(size)}" mass="{mass}" {grip}/></body>')
        self.model = self.mujoco.MjModel.from_xml_string("".join(xml) + "</worldbody></mujoco>")
        self.data = self.mujoco.MjData(self.model)

    def advance(self, seconds: float) -> None:
        for _ in range(round(seconds * 10)):
            self.mujoco.mj_step(self.model, self.data, 100)

    def speeds(self) -> np.ndarray:
        return np.abs(self.data.qvel.reshape(-1, 6)[:, :3]).max(axis=1)

    def depth_and_contacts(self) -> tuple[float, int]:
        distances = [contact.dist for contact in self.data.contact]
        return -min([*distances, 0.0]), len(distances)


def _text(numbers) -> str:
    return " ".join(repr(float(x)) for x in numbers)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=list(SCENES), help=", ".join(SCENES))
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--without", action="append", default=[], help="drake or mujoco; may be said twice")
    options = parser.parse_args()
    engines: dict[str, object] = {"sheldrake": DrakeLike("sheldrake")}
    if "mujoco" not in options.without:
        engines |= {"MuJoCo": MuJoCo("pyramidal"), "MuJoCo elliptic": MuJoCo("elliptic")}
    if "drake" not in options.without:
        engines["Drake"] = DrakeLike("pydrake")
    print(
        f"{'scene':12s}{'engine':18s}{'us a step':>11s}{'ratio':>8s}{'depth [mm]':>12s}{'contacts':>10s}"
        f"{'median |v|':>12s}{'max |v|':>10s}"
    )
    for name in options.scenes:
        settle, seconds = SCENES[name]
        times: dict[str, list[float]] = {engine: [] for engine in engines}
        for _ in range(options.rounds):
            for engine, contender in engines.items():
                contender.start(Scene(name))
                contender.advance(settle)
                start = time.process_time()
                contender.advance(seconds)
                times[engine].append((time.process_time() - start) / seconds * 1e3)
        for engine, contender in engines.items():
            ratio = statistics.median(b / a for a, b in zip(times["sheldrake"], times[engine]))
            depth, contacts = contender.depth_and_contacts()
            v = contender.speeds()
            print(
                f"{name:12s}{engine:18s}{statistics.median(times[engine]):11.1f}{ratio:8.1f}{depth * 1e3:12.4f}"
                f"{contacts:10d}{np.median(v):12.1e}{v.max():10.1e}",
                flush=True,
            )


if __name__ == "__main__":
    main()
