"""How long a step takes: `python tools/step_times.py`, and `--against before.json` for how much less than before.

    python tools/step_times.py > before.json           {scene: CPU time of a step [us]}, the best of five turns
    python tools/step_times.py --against before.json   before divided by now, for each scene

Scenes and turns are those of the benchmarks, without rivals: use them to say how fast a step is, and this to see
whether a change makes it faster. The best of the turns is what another process on the machine disturbs least.
"""

from __future__ import annotations

import argparse
import json
import pathlib
import sys
import time
import warnings
from collections.abc import Callable

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from benchmarks import arm, contact, drop_the_block, hydroelastic, quadruped  # noqa: E402
from benchmarks.engines import DrakeLike  # noqa: E402

OURS = "sheldrake"
Turn = Callable[[], float]
"""Runs a scene once; the CPU time of a step [us]."""


def drop() -> Turn:
    """The falling block, each state logged."""
    block = drop_the_block.DrakeLike(OURS)
    return lambda: block.turn(5.0)


def arm_with_pid() -> Turn:
    """A seven-joint arm and its controller."""
    made = arm.DrakeLike(OURS, motors=False)
    return lambda: made.turn(3.0)


def arm_with_motors() -> Turn:
    """A seven-joint arm whose gains are implicit."""
    made = arm.DrakeLike(OURS, motors=True)
    return lambda: made.turn(3.0)


def standing() -> Turn:
    """The quadruped, at rest on its feet."""
    made = quadruped.DrakeLike(OURS, settle=1.0)
    return lambda: made.turn(2.0)


def many(name: str) -> Turn:
    """A scene of many contacts, after it has settled."""
    engine = DrakeLike(OURS)
    settle, seconds = contact.SCENES[name]
    solids = contact.scene(name)

    def turn() -> float:
        engine.start(solids)
        engine.advance(settle)
        start = time.process_time()
        engine.advance(seconds)
        return (time.process_time() - start) / round(seconds / solids.time_step) * 1e6

    return turn


def hydroelastic_ball() -> Turn:
    """A compliant ball on rigid ground."""
    lib = hydroelastic.library(OURS)
    return lambda: hydroelastic.turn(hydroelastic.ball_on_ground, lib, 500)


SCENES: dict[str, Callable[[], Turn]] = {
    "drop_the_block": drop,
    "arm_pid": arm_with_pid,
    "arm_motors": arm_with_motors,
    "quadruped_standing": standing,
    "clutter20": lambda: many("clutter20"),
    "clutter50": lambda: many("clutter50"),
    "stack": lambda: many("stack"),
    "pile": lambda: many("pile"),
    "hydroelastic_ball": hydroelastic_ball,
}


def main() -> None:
    """Prints times, or ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", default="", metavar="SUBSTRING", help="only scenes with this in their names")
    parser.add_argument("--against", type=pathlib.Path, metavar="FILE", help="what was printed before")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    before = json.loads(options.against.read_text(encoding="utf-8")) if options.against else {}
    turns = {name: make() for name, make in SCENES.items() if options.only in name}
    for turn in turns.values():
        turn()  # loads and compiles
    best = dict.fromkeys(turns, float("inf"))
    for _ in range(options.rounds):
        for name, turn in turns.items():
            best[name] = min(best[name], turn())
    if not options.against:
        print(json.dumps({name: round(t, 3) for name, t in best.items()}, indent=1))
        return
    print(f"{'us a step':24}{'before':>10}{'now':>10}{'before/now':>12}")
    for name, t in best.items():
        was = before.get(name, float("nan"))
        print(f"{name:24}{was:10.2f}{t:10.2f}{was / t:12.2f}")


if __name__ == "__main__":
    main()
