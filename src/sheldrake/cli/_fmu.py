"""`sheldrake fmu`: what a script simulates as a Functional Mock-up Unit, for any tool that takes FMI 3.0 or 2.0.

Runs the script as `sheldrake run` does until its first simulation is about to begin, writes the FMU of that simulation,
and ends there. What is Python in the diagram is refused, by name.

  sheldrake fmu simulate.py -o block.fmu
  sheldrake fmu --fmi 2.0 --platform x86_64-linux --platform x86_64-windows simulate.py
"""

from __future__ import annotations

import argparse
import os

from sheldrake.cli._output import take_options_behind
from sheldrake.cli._script import add_script, script_name, write_first_simulation

_PLATFORMS = ("x86_64-linux", "aarch64-linux", "x86_64-windows", "x86_64-darwin", "aarch64-darwin")


def _add_options(parser: argparse.ArgumentParser) -> None:
    """Declares its own options."""
    parser.add_argument("-o", "--output", metavar="FILE", help="file to write (default: beside, ending with .fmu)")
    parser.add_argument("--fmi", choices=("3.0", "2.0"), default="3.0", help="version of FMI (default: 3.0)")
    parser.add_argument(
        "--platform", action="append", choices=_PLATFORMS, help="what it runs on; may be repeated (default: all)"
    )


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares what `sheldrake fmu` takes."""
    _add_options(parser)
    add_script(parser, "what is written")


def run(options: argparse.Namespace) -> int:
    """Writes the FMU; the exit status is 0, or the script's, or 1 when it simulates nothing."""
    from sheldrake.export._objects import require_compiler

    take_options_behind(options, _add_options)
    require_compiler("This command")  # before the script runs
    output = options.output or f"{script_name(options)}.fmu"
    path = os.path.abspath(output)  # the script may go elsewhere

    def write(simulator: object) -> None:
        from sheldrake.export import SaveFmu

        platforms = options.platform or _PLATFORMS
        SaveFmu(simulator, path, fmi_version=options.fmi, platforms=platforms, name=script_name(options))

    return write_first_simulation(options, output, write)
