"""How the search for close pairs grows: 10 to 10,000 bodies at constant density, every pair against cells.

    python benchmarks/broad_phase.py

Half the bodies are spheres, half boxes, in a cube that grows with their number; between two searches all move a little,
as in a step. Times are of one search with all contacts found, CPU time.
"""

from __future__ import annotations

import pathlib
import sys
import time

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "src")]

from sheldrake.common.chain import Chain  # noqa: E402
from sheldrake.geometry import (  # noqa: E402
    AddContactMaterial,
    Box,
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from sheldrake.geometry._compiled.search import family_kernels  # noqa: E402
from sheldrake.geometry._kernels.contacts import place_geometries  # noqa: E402
from sheldrake.geometry._kernels.model import BodyPose, BodyPoses, contact_table  # noqa: E402
from sheldrake.geometry._kernels.spatial_hash import make_cells  # noqa: E402
from sheldrake.math import RigidTransform  # noqa: E402
from sheldrake.multibody.plant import CoulombFriction  # noqa: E402

MOST_LISTED = 3000


def scene(n: int) -> tuple:
    """A SceneGraph with n bodies, and the body of each frame."""
    scene_graph = SceneGraph()
    source = scene_graph.RegisterSource("bodies")
    properties, bodies = ProximityProperties(), {}
    AddContactMaterial(None, None, CoulombFriction(0.5, 0.5), properties)
    for k in range(n):
        frame = scene_graph.RegisterFrame(source, GeometryFrame(f"body{k}"))
        shape = Sphere(0.05) if k % 2 else Box(0.08, 0.07, 0.06)
        geometry = scene_graph.RegisterGeometry(source, frame, GeometryInstance(RigidTransform(), shape, "solid"))
        scene_graph.AssignRole(source, geometry, properties)
        bodies[frame] = k
    return scene_graph, bodies


def search_time(scene_graph: SceneGraph, bodies: dict, cells: bool) -> tuple[float, int]:
    """Seconds for a search, and contacts found."""
    n = len(bodies)
    model, _ = scene_graph._compile_proximity(bodies, cells=cells)
    rng = np.random.default_rng(3)
    X_WB = np.zeros((n, BodyPose.SIZE))
    X_WB[:, [0, 4, 8]] = 1.0
    X_WB[:, BodyPose.p_WB.columns] = rng.uniform(0.0, 0.1 * n ** (1.0 / 3.0), (n, 3))
    table = contact_table(model)
    run = Chain([place_geometries, *family_kernels(model)]).bind(
        geometry_model=model, bodies=BodyPoses(X_WB), table=table, cells=make_cells(model)
    )
    run()
    assert table.status == 0, "too many contacts"
    times = []
    for _ in range(20):
        X_WB[:, BodyPose.p_WB.columns] += rng.normal(scale=1e-3, size=(n, 3))
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return float(np.median(times)), int(table.num_contacts)


def main() -> None:
    print(f"{'bodies':>8s}{'contacts':>10s}{'every pair [us]':>18s}{'cells [us]':>12s}{'cells, ns a body':>18s}")
    sizes, times = [10, 30, 100, 300, 1000, 3000, 10000], []
    for n in sizes:
        scene_graph, bodies = scene(n)
        every = search_time(scene_graph, bodies, False)[0] if n <= MOST_LISTED else float("nan")
        found, contacts = search_time(scene_graph, bodies, True)
        times.append(found)
        print(f"{n:8d}{contacts:10d}{every * 1e6:18.1f}{found * 1e6:12.1f}{found / n * 1e9:18.0f}", flush=True)
    slope = np.polyfit(np.log(sizes[3:]), np.log(times[3:]), 1)[0]
    print(f"from {sizes[3]} bodies on, the cost with cells grows like n^{slope:.2f}")


if __name__ == "__main__":
    main()
