"""`sheldrake doctor`: what is wrong with a robot description, where, and what would put it right.

Finds wrong scale, inertia that does not fit the geometry or the mass, missing meshes, bodies that overlap at rest,
limits that are reversed or absent, names that are there twice, a centre of mass outside the geometry. `--fix` writes
the file with what can be put right and leaves every other byte as it was.

  sheldrake doctor robot.urdf
  sheldrake doctor robot.urdf --fix better.urdf
"""

from __future__ import annotations

import argparse
import sys

from sheldrake.cli._output import add_json, print_json


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares what `sheldrake doctor` takes."""
    parser.add_argument("model", metavar="MODEL", help="URDF, SDFormat or MJCF file")
    parser.add_argument("--fix", metavar="FILE", help="write the model with what can be fixed")
    add_json(parser, "the findings")
    parser.add_argument("--quiet", action="store_true", help="leave out notes")


def run(options: argparse.Namespace) -> int:
    """Prints the findings; returns 1 when there are errors left, 2 when the file can not be looked at."""
    from sheldrake.cad import DiagnoseModel

    try:
        diagnosis = DiagnoseModel(options.model)
        fixed = diagnosis.WriteFixed(options.fix) if options.fix else []
    except (OSError, ValueError) as error:
        print(f"sheldrake doctor: {error}", file=sys.stderr)
        return 2
    shown = [f for f in diagnosis.findings if not (options.quiet and f.severity == "note")]
    left = [finding for finding in diagnosis.errors() if finding not in fixed]
    if options.json:
        print_json([finding.AsDict() for finding in shown])
        return 1 if left else 0
    for finding in shown:
        print(finding)
    counts = {s: sum(f.severity == s for f in diagnosis.findings) for s in ("error", "warning", "note")}
    print(", ".join(f"{n} {s}{'' if n == 1 else 's'}" for s, n in counts.items()) + f" in {options.model}")
    if options.fix:
        print(f"fixed {len(fixed)} of them in {options.fix}")
    elif any(finding.is_fixable for finding in shown):
        print(f"{sum(f.is_fixable for f in shown)} of them can be fixed: sheldrake doctor {options.model} --fix FILE")
    return 1 if left else 0
