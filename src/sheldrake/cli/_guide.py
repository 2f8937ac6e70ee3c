"""`sheldrake guide`: what to import, ten idioms, how to read errors, what differs from pydrake and MuJoCo.

The text is the file GUIDE.md in the installed package, for people in a hurry and for programs that write programs.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import sheldrake

GUIDE = Path(sheldrake.__file__).with_name("GUIDE.md")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares what `sheldrake guide` takes."""
    parser.add_argument("--path", action="store_true", help="say only where the file is")


def run(options: argparse.Namespace) -> int:
    """Prints the guide, or where it is."""
    print(GUIDE if options.path else GUIDE.read_text(encoding="utf-8").rstrip())
    return 0
