"""`sheldrake page`: one HTML file that simulates what a script simulates, in any browser, without Python.

Runs the script as `sheldrake run` does until its first simulation is about to begin, with the state of every plant
logged; writes the page of that simulation, and ends there. What is Python in the diagram is refused, by name.

  sheldrake page simulate.py -o fall.html
  sheldrake page simulate.py --height 2         other arguments behind the script are the script's; behind -- all are
"""

from __future__ import annotations

import argparse

from sheldrake.cli._output import add_output, output_file, take_options_behind
from sheldrake.cli._script import add_script, script_name, write_first_simulation


def _add_options(parser: argparse.ArgumentParser) -> None:
    """Declares its own options."""
    add_output(parser, "beside, ending with .html")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares what `sheldrake page` takes."""
    _add_options(parser)
    add_script(parser, "what is written")


def run(options: argparse.Namespace) -> int:
    """Writes the page; the exit status is 0, or the script's, or 1 when it simulates nothing."""
    take_options_behind(options, _add_options)
    output = options.output or f"{script_name(options)}.html"
    with output_file(output, ".html") as path:

        def write(simulator: object) -> None:
            from sheldrake.export import SavePage

            SavePage(simulator, path, title=script_name(options))

        return write_first_simulation(options, output, write)
