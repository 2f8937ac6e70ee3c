"""What it costs to show bodies and contact forces: without a page, with one, and recorded.

    python benchmarks/viewer.py [NUMBER_OF_BOXES]

Boxes that slide on the ground, with four contacts each; a publish of their poses and of their forces, in milliseconds
of the simulation's own thread, and of all threads. The last line is the time of the wall that 0.3 simulated seconds
take, in which a page must not be waited for. A page needs a Chromium.
"""

from __future__ import annotations

import pathlib
import sys
import time

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from sheldrake.geometry import Box, HalfSpace, Meshcat, MeshcatVisualizer  # noqa: E402
from sheldrake.math import RigidTransform  # noqa: E402
from sheldrake.multibody.meshcat import ContactVisualizer  # noqa: E402
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction  # noqa: E402
from sheldrake.multibody.tree import SpatialInertia  # noqa: E402
from sheldrake.systems.analysis import Simulator  # noqa: E402
from sheldrake.systems.framework import DiagramBuilder  # noqa: E402

ROUNDS, SIZE = 40, 0.1
DRAWN = "Object.keys((window.__viserMutable || {}).nodeRefFromName || {}).some((name) => name.endsWith('/<object>'))"


class Scene:
    """Boxes on the ground.

    Args:
        count: How many.
        height: Of their bottoms above the ground [m].
    """

    def __init__(self, count: int, height: float = -1e-4):
        builder = DiagramBuilder()
        self.plant, scene_graph = plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
        friction, X = CoulombFriction(0.5, 0.5), RigidTransform()
        plant.RegisterCollisionGeometry(plant.world_body(), X, HalfSpace(), "ground", friction)
        inertia = SpatialInertia.SolidBoxWithMass(1.0, SIZE, SIZE, SIZE)
        for k in range(count):
            body = plant.AddRigidBody(f"box{k}", inertia)
            plant.RegisterCollisionGeometry(body, X, Box(SIZE, SIZE, SIZE), "box", friction)
            plant.RegisterVisualGeometry(body, X, Box(SIZE, SIZE, SIZE), "look", [0.3, 0.5, 0.8, 1.0])
        plant.Finalize()
        self.meshcat = Meshcat(port=0)
        self.poses = MeshcatVisualizer.AddToBuilder(builder, scene_graph, self.meshcat)
        self.forces = ContactVisualizer.AddToBuilder(builder, plant, self.meshcat)
        self.simulator = Simulator(builder.Build())
        self.context = self.simulator.get_mutable_context()
        self.own = plant.GetMyMutableContextFromRoot(self.context)
        side = int(np.ceil(np.sqrt(count)))
        for k in range(count):
            place = [1.5 * SIZE * (k % side), 1.5 * SIZE * (k // side), SIZE / 2 + height]
            plant.SetFreeBodyPose(self.own, plant.GetBodyByName(f"box{k}"), RigidTransform(place))
        self.simulator.Initialize()
        self.random = np.random.default_rng(0)

    def publish(self) -> tuple[float, float, float]:
        """Best times of a publish of poses, of one of forces, both in this thread, and of both in all [ms]."""
        spent = np.zeros((ROUNDS, 3))
        for k in range(ROUNDS):
            self.plant.SetVelocities(self.own, 0.1 * self.random.standard_normal(self.plant.num_velocities()))
            self.simulator.AdvanceTo(self.context.get_time() + 2e-3)
            whole = time.process_time()
            for i, system in enumerate((self.poses, self.forces)):
                context, start = system.GetMyContextFromRoot(self.context), time.thread_time()
                system.ForcedPublish(context)
                spent[k, i] = time.thread_time() - start
            time.sleep(1 / 64.0)  # a page takes its share meanwhile
            spent[k, 2] = time.process_time() - whole
        poses, forces, everything = 1e3 * spent.min(axis=0)
        return float(poses), float(forces), float(everything)

    def wall(self, seconds: float) -> float:
        """Time of the wall that a simulated time takes [s]."""
        start = time.perf_counter()
        self.simulator.AdvanceTo(self.context.get_time() + seconds)
        return time.perf_counter() - start


def main(count: int) -> None:
    print(f"{count} boxes{'':16} {'poses':>8} {'forces':>8} {'all threads':>12}   [ms]")

    def say(name: str, scene: Scene) -> None:
        poses, forces, everything = scene.publish()
        print(f"{name:24} {poses:8.3f} {forces:8.3f} {everything:12.3f}", flush=True)

    scene, falling = Scene(count), Scene(count, 0.02)
    alone = falling.wall(0.3)
    say("nobody looks", scene)
    scene.meshcat.StartRecording()
    say("recorded", scene)
    scene.meshcat.StopRecording()
    from tests.browser.chromium import Chromium, executable

    if executable() is None:
        return
    with Chromium() as browser:
        scene, falling = Scene(count), Scene(count, 0.02)
        for shown in (scene, falling):
            page = browser.open(shown.meshcat.web_url())
            page.wait_for(DRAWN)
            if shown is scene:
                say("one page", scene)
                browser.close_page(page)
        print(f"0.3 s of their landing: {alone:.2f} s without a page, {falling.wall(0.3):.2f} s with one")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
