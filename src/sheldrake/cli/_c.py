"""`sheldrake c`: what a script simulates as a C library: header, source, kernels, an example and a Makefile.

Runs the script as `sheldrake run` does until its first simulation is about to begin, writes the library of that
simulation, and ends there. What is Python in the diagram is refused, by name.

  sheldrake c simulate.py -o folder
  sheldrake c --target thumbv7em-none-eabihf controller.py
"""

from __future__ import annotations

import argparse
import os

from sheldrake.cli._output import take_options_behind
from sheldrake.cli._script import add_script, script_name, write_first_simulation


def _add_options(parser: argparse.ArgumentParser) -> None:
    """Declares its own options."""
    parser.add_argument("-o", "--output", metavar="FOLDER", help="where to (default: the script's name)")
    parser.add_argument("--target", default="x86_64-linux", help="what it runs on (default: x86_64-linux)")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares what `sheldrake c` takes."""
    _add_options(parser)
    add_script(parser, "what is written")


def run(options: argparse.Namespace) -> int:
    """Writes the library; the exit status is 0, or the script's, or 1 when it simulates nothing."""
    from sheldrake.export._objects import require_compiler

    take_options_behind(options, _add_options)
    require_compiler("This command")  # before the script runs
    output = options.output or script_name(options)
    folder = os.path.abspath(output)  # the script may go elsewhere

    def write(simulator: object) -> None:
        from sheldrake.export import SaveC

        SaveC(simulator, folder, target=options.target, name=script_name(options))

    return write_first_simulation(options, output, write)
