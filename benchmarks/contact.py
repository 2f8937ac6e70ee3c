"""Many contacts against Drake and MuJoCo: CPU time of a 1 ms step, and how deep and how still the bodies are.

    python benchmarks/contact.py [stack clutter20 clutter50 clutter200 pile] [--rounds 3]
    python benchmarks/contact.py islands [--without drake]

Scenes: a stack of ten boxes; a bin of 20, 50, 200 spheres and boxes; thirty boxes heaped in a narrow bin. The
engines take turns; a turn starts a scene anew, lets the bodies fall for some seconds, then times the steps that follow.
Bodies fall from other places in each round: one heap may have a body that slides long after those of others rest.

"islands" is another table: pairs of boxes, one on the other, apart from each other, 8 to 1,000 contacts; CPU time of a
step and contact while all slide, and when all are at rest.
"""

from __future__ import annotations

import argparse
import pathlib
import statistics
import sys
import time

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from benchmarks.engines import DrakeLike, MuJoCo, Scene, Solid  # noqa: E402

FLOOR = Solid(("half_space",))
SCENES = {
    "stack": (1.0, 1.0),
    "clutter20": (2.0, 1.0),
    "clutter50": (2.0, 1.0),
    "clutter200": (2.0, 0.3),
    "pile": (5.0, 1.0),
}
"""Seconds to settle and seconds to time."""
PAIRS = (1, 4, 16, 64, 125)
"""How many pairs of boxes "islands" has; 8 contacts each."""


def walls(half: float) -> list[Solid]:
    """Floor and four walls of a bin of this half width [m]."""
    turn = 0.5 * np.pi
    tilts = (((-half, 0.0, 0.0), (0.0, turn, 0.0)), ((half, 0.0, 0.0), (0.0, -turn, 0.0)),
             ((0.0, -half, 0.0), (-turn, 0.0, 0.0)), ((0.0, half, 0.0), (turn, 0.0, 0.0)))  # fmt: skip
    return [FLOOR, *(Solid(("half_space",), p=p, rpy=rpy) for p, rpy in tilts)]


def scene(name: str, seed: int = 1) -> Scene:
    """A scene of `SCENES`; where its bodies fall from is drawn."""
    rng = np.random.default_rng(seed)
    if name == "stack":
        boxes = [Solid(("box", 0.1, 0.1, 0.1), 0.3, p=(0.0, 0.0, 0.0501 + 0.1 * i)) for i in range(10)]
        return Scene([FLOOR, *boxes])
    if name == "pile":
        solids = walls(0.12)
        for i in range(30):
            p = (rng.uniform(-0.06, 0.06), rng.uniform(-0.06, 0.06), 0.08 + 0.11 * i)
            solids.append(Solid(("box", 0.08, 0.07, 0.06), 0.3, p=p, rpy=tuple(rng.uniform(-1.0, 1.0, 3))))
        return Scene(solids)
    solids = walls(0.25)
    for i in range(int(name.removeprefix("clutter"))):
        layer, j = divmod(i, 9)
        p = np.array([(j % 3 - 1) * 0.13, (j // 3 - 1) * 0.13, 0.10 + 0.13 * layer]) + rng.uniform(-0.01, 0.01, 3)
        shape = ("sphere", 0.045) if i % 2 == 0 else ("box", 0.08, 0.07, 0.06)
        solids.append(Solid(shape, 0.3, p=tuple(p), rpy=tuple(rng.uniform(-1.0, 1.0, 3))))
    return Scene(solids)


def pairs(n: int) -> Scene:
    """So many pairs of boxes, one on the other, which slide for 0.4 s."""
    side = int(np.ceil(np.sqrt(n)))
    boxes = []
    for i in range(n):
        x, y = 0.4 * (i % side), 0.4 * (i // side)
        for z in (0.05, 0.15):
            boxes.append(Solid(("box", 0.1, 0.1, 0.1), 0.3, p=(x, y, z), v=(2.0, 0.0, 0.0)))
    return Scene([FLOOR, *boxes])


def islands(engines: dict, rounds: int) -> None:
    """Prints what a contact costs among few and among many."""
    print(f"{'contacts':>10s}{'engine':>18s}{'ns a step and contact: sliding':>34s}{'at rest':>10s}")
    for n in PAIRS:
        scene = pairs(n)
        times: dict[str, list[tuple[float, float]]] = {engine: [] for engine in engines}
        for _ in range(rounds):
            for engine, contender in engines.items():
                contender.start(scene)
                contender.advance(0.05)
                steps = 250, max(250, 10_000 // n)
                spent = []
                for count in steps:
                    start = time.process_time()
                    contender.advance(count * scene.time_step)
                    spent.append((time.process_time() - start) / count)
                    contender.advance(0.5)
                times[engine].append((spent[0], spent[1]))
        for engine in engines:
            sliding, resting = np.median(times[engine], axis=0) / (8 * n) * 1e9
            print(f"{8 * n:10d}{engine:>18s}{sliding:34.0f}{resting:10.0f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=list(SCENES), help=", ".join([*SCENES, "islands"]))
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--without", action="append", default=[], help="drake or mujoco; may be said twice")
    options = parser.parse_args()
    engines: dict[str, object] = {"sheldrake": DrakeLike("sheldrake")}
    if "mujoco" not in options.without:
        engines |= {"MuJoCo": MuJoCo("pyramidal"), "MuJoCo elliptic": MuJoCo("elliptic")}
    if "drake" not in options.without:
        engines["Drake"] = DrakeLike("pydrake")
    if options.scenes == ["islands"]:
        islands(engines, options.rounds)
        return
    print(
        f"{'scene':12s}{'engine':18s}{'us a step':>11s}{'ratio':>8s}{'depth [mm]':>12s}{'contacts':>10s}"
        f"{'median |v|':>12s}{'max |v|':>10s}"
    )
    for name in options.scenes:
        settle, seconds = SCENES[name]
        times: dict[str, list[float]] = {engine: [] for engine in engines}
        for seed in range(1, options.rounds + 1):
            for engine, contender in engines.items():
                contender.start(scene(name, seed))
                contender.advance(settle)
                start = time.process_time()
                contender.advance(seconds)
                times[engine].append((time.process_time() - start) / seconds * 1e3)
        for engine, contender in engines.items():
            ratio = statistics.median(b / a for a, b in zip(times["sheldrake"], times[engine]))
            depth, contacts = contender.depth_and_contacts()
            v = np.abs(contender.velocities()[:, 3:]).max(axis=1)
            print(
                f"{name:12s}{engine:18s}{statistics.median(times[engine]):11.1f}{ratio:8.1f}{depth * 1e3:12.4f}"
                f"{contacts:10d}{np.median(v):12.1e}{v.max():10.1e}",
                flush=True,
            )


if __name__ == "__main__":
    main()
