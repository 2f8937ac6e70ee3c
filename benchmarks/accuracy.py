"""How far contact is from answers that are known: sheldrake, Drake and MuJoCo, measured in one run.

    python benchmarks/accuracy.py [--write docs/accuracy.md] [--quick]

Scenes and answers are those of `contact_answers.py`, which the tests use too. MuJoCo's number is the better of its two
cones'. Scenes that take Drake minutes are run with its default approximation only; with --quick, not at all.
"""

from __future__ import annotations

import argparse
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from benchmarks.contact_answers import LONG, QUICK, ROWS  # noqa: E402
from benchmarks.engines import DrakeLike, MuJoCo  # noqa: E402
from benchmarks.tables import number, replace_table  # noqa: E402

APPROXIMATIONS = ("lagged", "similar", "sap", "tamsi")


def measure(quick: bool) -> dict[str, dict[str, float]]:
    """Deviations by column of the table and row."""
    columns: dict[str, dict[str, float]] = {}
    for approximation in APPROXIMATIONS:
        columns[approximation] = run(DrakeLike("sheldrake", approximation), QUICK, f"sheldrake {approximation}")
        if not quick:
            long = {k: v for k, v in LONG.items() if approximation != "tamsi" or k != "balls"}  # takes kTamsi minutes
            columns[approximation] |= run(DrakeLike("sheldrake", approximation), long, f"sheldrake {approximation}")
    for approximation in APPROXIMATIONS:
        name = f"Drake {approximation}"
        columns[name] = run(DrakeLike("pydrake", approximation), QUICK, name)
        if not quick and approximation == "lagged":
            columns[name] |= run(DrakeLike("pydrake", approximation), LONG, name)
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
        print(f"{name}: {scene}", file=sys.stderr, flush=True)
        rows |= function(engine)
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
    parser.add_argument("--quick", action="store_true", help="without the scenes that take Drake minutes")
    options = parser.parse_args()
    text = table(measure(options.quick))
    print(text)
    if options.write:
        replace_table(options.write, "accuracy", text)


if __name__ == "__main__":
    main()
