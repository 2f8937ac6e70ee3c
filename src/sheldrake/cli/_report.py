"""`sheldrake report`: one HTML file about a run: replay, plots in step with it, contacts, block diagram, model.

Of a script, it runs the script as `sheldrake run` does, logs the state of every plant, and reports on the simulation
that took the most steps; a file that ends with .rrd or .mcap is the same run for the Rerun or Foxglove viewer. Of a
file of logs (StreamLogs(), ToNpz(), ToCsv()), it shows the plots.

  sheldrake report simulate.py
  sheldrake report simulate.py -o fall.html
  sheldrake report simulate.py -o fall.rrd --duration 5    other arguments behind the script are the script's;
                                                           behind -- all are
  sheldrake report run.log
"""

from __future__ import annotations

import argparse
import os
import sys
from typing import TYPE_CHECKING, Any

from sheldrake.cli._output import add_json, add_output, output_file, reporting, say_written, take_options_behind

if TYPE_CHECKING:
    from sheldrake.systems.framework._diagram import Diagram
    from sheldrake.systems.framework._diagram_builder import DiagramBuilder

_VIEWERS = (".rrd", ".mcap")
_MODELS = (".urdf", ".sdf", ".xml", ".yaml")


def _add_options(parser: argparse.ArgumentParser) -> None:
    """Declares its own options."""
    add_output(parser, "beside, ending with .html")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares what `sheldrake report` takes."""
    _add_options(parser)
    add_json(parser, "the file that is written")
    parser.add_argument("-m", dest="is_module", action="store_true", help="RUN is the name of a module")
    parser.add_argument("script", metavar="RUN", help="a script, or a file of logs")
    parser.add_argument(
        "arguments", nargs=argparse.REMAINDER, metavar="ARG", help="arguments of the script; behind -- all are"
    )


def run(options: argparse.Namespace) -> int:
    """Writes the report; returns the script's exit status, or 1 when there is nothing to report."""
    take_options_behind(options, _add_options)
    name = os.path.splitext(os.path.basename(options.script))[0]
    output = options.output or f"{name}.html"
    with reporting(options) as told:
        with output_file(output, ".html") as path:
            status = _report(options, path)
            is_written = os.path.exists(path)
        if is_written:
            say_written(output, told)
    return status


def _report(options: argparse.Namespace, output: str) -> int:
    """Writes the report to a path."""
    if options.is_module or options.script.endswith(".py"):
        return _of_script(options, output)
    if options.script.endswith(_MODELS):
        print(
            f"sheldrake report: a report is about a run: give a script or a file of logs; of a model, "
            f"`sheldrake view {options.script}` and `sheldrake doctor {options.script}` tell.",
            file=sys.stderr,
        )
        return 2
    from sheldrake.report import SaveLogReport
    from sheldrake.systems.primitives import ReadLogs

    if output.endswith(_VIEWERS):
        print(f"sheldrake report: {options.script} has no scene; logs become a page (-o FILE.html).", file=sys.stderr)
        return 1
    try:
        SaveLogReport(ReadLogs(options.script), output, title=os.path.basename(options.script))
    except FileNotFoundError:
        print(f"sheldrake report: there is no file '{options.script}'.", file=sys.stderr)
        return 1
    except (OSError, ValueError, ImportError) as error:
        print(f"sheldrake report: {error}", file=sys.stderr)
        return 1
    return 0


def _of_script(options: argparse.Namespace, output: str) -> int:
    from sheldrake.cli import _run

    simulators = _watch()
    try:
        status = _run.run(options)
    except SystemExit as end:
        status = status_of(end.code)
    done = [s for s in simulators if s.get_context() is not None and s.get_num_steps_taken() > 0]
    if not done:
        print("sheldrake report: the script ran no simulation; there is nothing to report.", file=sys.stderr)
        return status or 1
    longest = max(done, key=lambda s: s.get_num_steps_taken())
    if len(done) > 1:
        print(f"the script ran {len(done)} simulations; this is the one with most steps", file=sys.stderr)
    from sheldrake.report import SaveReport, SaveRun

    save = SaveRun if output.endswith(_VIEWERS) else SaveReport
    try:
        save(longest, output, title=os.path.basename(options.script))
    except (ImportError, OSError) as error:
        print(f"sheldrake report: {error}", file=sys.stderr)
        return 1
    return status


def status_of(code: Any) -> int:
    """The exit status of a script that ends with sys.exit(code)."""
    if code is None or isinstance(code, int):
        return int(code or 0)
    print(code, file=sys.stderr)
    return 1


def _watch() -> list[Any]:
    """Has every simulator made from now on in a list, and the state of every plant logged."""
    from sheldrake.systems.analysis import Simulator
    from sheldrake.systems.framework import DiagramBuilder

    simulators: list[Any] = []
    make, build = Simulator.__init__, DiagramBuilder.Build

    def init(self: Any, *args: Any, **kwargs: Any) -> None:
        make(self, *args, **kwargs)
        simulators.append(self)

    def build_with_logs(self: DiagramBuilder) -> Diagram:
        log_states(self)
        return build(self)

    Simulator.__init__ = init  # type: ignore[method-assign]
    DiagramBuilder.Build = build_with_logs  # type: ignore[method-assign]
    return simulators


def log_states(builder: Any) -> None:
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
