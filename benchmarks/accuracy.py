"""How far contact is from answers that are known: sheldrake, Drake and MuJoCo, measured in one run.

    python benchmarks/accuracy.py [--write docs/accuracy.md] [--quick]

Scenes and answers are those of `contact_answers.py`, which the tests use too. MuJoCo's number is the better of its two
cones'. Scenes that take Drake minutes are run with its default approximation only; with --quick, none is that takes it
more than seconds.
"""

from __future__ import annotations

import argparse
import pathlib
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from benchmarks.contact_answers import LONG, QUICK, ROWS  # noqa: E402
from benchmarks.engines import DrakeLike, MuJoCo  # noqa: E402
from benchmarks.tables import number, replace_table  # noqa: E402

APPROXIMATIONS = ("lagged", "similar", "sap", "tamsi")
TOO_LONG = {
    "similar": ("stack of 30", "drops"),
    "sap": ("stack of 30", "drops"),
    "tamsi": ("drops", "balls"),
}
"""Scenes for which Drake takes minutes, by approximation: of these the table has its default's alone."""


def measure(quick: bool) -> dict[str, dict[str, float]]:
    """Deviations by column of the table and row."""
    columns: dict[str, dict[str, float]] = {}
    for package, title in (("sheldrake", ""), ("pydrake", "Drake ")):
        for approximation in APPROXIMATIONS:
            scenes = QUICK if quick else QUICK | LONG
            too_long = TOO_LONG.get(approximation, ()) if package == "pydrake" else ()
            scenes = {name: scene for name, scene in scenes.items() if name not in too_long}
            engine = DrakeLike(package, approximation)
            columns[f"{title}{approximation}"] = run(engine, scenes, f"{package} {approximation}")
    cones = [
        run(MuJoCo(cone), QUICK if quick else QUICK | LONG, f"MuJoCo {cone}") for cone in ("pyramidal", "elliptic")
    ]
    columns["MuJoCo"] = {row: min(cone[row] for cone in cones) for row in cones[0]}
    columns["MuJoCo"].pop("spin_patch")  # it has no patches
    return columns


def run(engine, scenes: dict, name: str) -> dict[str, float]:
    """Deviations by row."""
    rows: dict[str, float] = {}
    for scene, function in scenes.items():
        start = time.perf_counter()
        rows |= function(engine)
        print(f"{name}: {scene}, {time.perf_counter() - start:.1f} s", file=sys.stderr, flush=True)
    return rows


def table(columns: dict[str, dict[str, float]]) -> str:
    """Markdown."""
    lines = ["| deviation | " + " | ".join(columns) + " |", "|---" * (len(columns) + 1) + "|"]
    for row, (what, unit) in ROWS.items():
        cells = [number(column.get(row)) for column in columns.values()]
        lines.append(f"| {what}{f' [{unit}]' if unit else ''} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=pathlib.Path, help="the page whose table is replaced")
    parser.add_argument("--quick", action="store_true", help="without the scenes that take Drake long")
    options = parser.parse_args()
    text = table(measure(options.quick))
    print(text)
    if options.write:
        replace_table(options.write, "accuracy", text)


if __name__ == "__main__":
    main()
