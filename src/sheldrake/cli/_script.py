"""What commands on a script have in common; those that write what it would simulate run it until that begins."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from sheldrake.cli._output import add_json, reporting, say_written

if TYPE_CHECKING:
    from sheldrake.systems.analysis._simulator import Simulator
    from sheldrake.systems.framework._diagram import Diagram
    from sheldrake.systems.framework._diagram_builder import DiagramBuilder


class _Written(BaseException):
    """What was wanted is there: the script need not go on."""


def add_script(parser: argparse.ArgumentParser, told: str, name: str = "SCRIPT", what: str = "the script") -> None:
    """Declares the script, called by a name in the help, and its arguments; `--json` tells of `told`."""
    add_json(parser, told)
    parser.add_argument("-m", dest="is_module", action="store_true", help=f"{name} is the name of a module")
    parser.add_argument("script", metavar=name, help=what)
    parser.add_argument(
        "arguments", nargs=argparse.REMAINDER, metavar="ARG", help="arguments of the script; behind -- all are"
    )


def script_name(options: argparse.Namespace) -> str:
    """Name of the script without its ending."""
    return os.path.splitext(os.path.basename(options.script))[0]


def run_script(options: argparse.Namespace) -> int:
    """Runs the script; its exit status."""
    from sheldrake.cli import _run

    try:
        return _run.run(options)
    except SystemExit as end:
        return _status_of(end.code)


def _status_of(code: Any) -> int:
    """The exit status of a script that ends with sys.exit(code)."""
    if code is None or isinstance(code, int):
        return int(code or 0)
    print(code, file=sys.stderr)
    return 1


def have_states_logged() -> None:
    """Has the state of every plant logged in the diagrams that are built from now on."""
    from sheldrake.systems.framework import DiagramBuilder

    build = DiagramBuilder.Build

    def build_with_logs(self: DiagramBuilder) -> Diagram:
        _log_states(self)
        return build(self)

    DiagramBuilder.Build = build_with_logs  # type: ignore[method-assign]


def _log_states(builder: Any) -> None:
    """Logs the state of every plant in a diagram in the making that is not logged yet."""
    from sheldrake.systems.primitives import LogVectorOutput

    logged = {
        (source, int(j)) for (sink, _), (source, j) in builder.connection_map().items() if hasattr(sink, "FindLog")
    }
    for system in builder.GetSystems():
        if not hasattr(system, "SetPositionsAndVelocities") or not system.is_finalized():
            continue
        port = system.get_state_output_port()
        if (system, int(port.get_index())) not in logged and port.size():
            LogVectorOutput(port, builder).set_name(f"log of {system.get_name()}/state")


def write_first_simulation(options: argparse.Namespace, output: str, write: Callable[[Any], None]) -> int:
    """Has the first simulator that is to advance written; the exit status.

    Args:
        options: With the script.
        output: What is written, as it is told.
        write: Takes the simulator.
    """
    from sheldrake.systems.analysis import Simulator

    def advance_to(self: Simulator, *args: Any, **kwargs: Any) -> Any:
        write(self)
        raise _Written

    Simulator.AdvanceTo = advance_to  # type: ignore[method-assign]
    have_states_logged()
    with reporting(options) as told:
        try:
            status = run_script(options)
        except _Written:
            say_written(output, told)
            return 0
    if status == 0:
        name = options.command
        print(f"sheldrake {name}: the script ran no simulation; there is nothing to write.", file=sys.stderr)
    return status or 1
