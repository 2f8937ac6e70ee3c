"""How far motions of multibody plants are from answers that are known: sheldrake and Drake, measured in one run.

    python benchmarks/motions.py [--write docs/motions.md]

Motions and answers are those of `motion_answers.py`, which the tests use too.
"""

from __future__ import annotations

import argparse
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from benchmarks.motion_answers import ROWS, measure  # noqa: E402
from benchmarks.tables import number, replace_table  # noqa: E402


def table() -> str:
    """Markdown."""
    lines = ["| motion: deviation | integrated by | step [ms] | deviation | order | Drake |", "|---" * 6 + "|"]
    for row in ROWS.values():
        ours, order = measure(row, "sheldrake")
        theirs, _ = measure(row, "pydrake")
        exact = "exact" if order is None else f"{order:.2f}"
        step = f"{1e3 * row.steps[-1]:g}"
        lines.append(f"| {row.what} | {row.scheme} | {step} | {number(ours)} | {exact} | {number(theirs)} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=pathlib.Path, help="the page whose table is replaced")
    options = parser.parse_args()
    text = table()
    print(text)
    if options.write:
        replace_table(options.write, "motions", text)


if __name__ == "__main__":
    main()
