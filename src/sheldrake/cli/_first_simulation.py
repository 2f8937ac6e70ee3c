"""Runs a script until its first simulation is about to begin, for the commands that write what it would simulate."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sheldrake.systems.analysis._simulator import Simulator
    from sheldrake.systems.framework._diagram import Diagram
    from sheldrake.systems.framework._diagram_builder import DiagramBuilder

from sheldrake.cli._output import add_json, reporting, say_written


class _Written(BaseException):
    """What was wanted is there: the script need not go on."""


def add_script(parser: argparse.ArgumentParser) -> None:
    """Declares the script and its arguments."""
    add_json(parser, "what is written")
    parser.add_argument("-m", dest="is_module", action="store_true", help="SCRIPT is the name of a module")
    parser.add_argument("script", metavar="SCRIPT", help="the script")
    parser.add_argument(
        "arguments", nargs=argparse.REMAINDER, metavar="ARG", help="arguments of the script; behind -- all are"
    )


def script_name(options: argparse.Namespace) -> str:
    """Name of the script without its ending."""
    return os.path.splitext(os.path.basename(options.script))[0]


def write_first_simulation(options: argparse.Namespace, output: str, write: Callable[[Any], None]) -> int:
    """Has the first simulator that is to advance written; the exit status.

    Args:
        options: With the script.
        output: What is written, as it is told.
        write: Takes the simulator.
    """
    from sheldrake.cli import _run
    from sheldrake.cli._report import log_states, status_of
    from sheldrake.systems.analysis import Simulator
    from sheldrake.systems.framework import DiagramBuilder

    build = DiagramBuilder.Build

    def advance_to(self: Simulator, *args: Any, **kwargs: Any) -> Any:
        write(self)
        raise _Written

    def build_with_logs(self: DiagramBuilder) -> Diagram:
        log_states(self)
        return build(self)

    Simulator.AdvanceTo = advance_to  # type: ignore[method-assign]
    DiagramBuilder.Build = build_with_logs  # type: ignore[method-assign]
    with reporting(options) as told:
        try:
            status = _run.run(options)
        except _Written:
            say_written(output, told)
            return 0
        except SystemExit as end:
            status = status_of(end.code)
    if status == 0:
        name = options.command
        print(f"sheldrake {name}: the script ran no simulation; there is nothing to write.", file=sys.stderr)
    return status or 1
