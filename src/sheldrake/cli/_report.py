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
from typing import Any

from sheldrake.cli._output import add_output, output_file, reporting, say_written, take_options_behind
from sheldrake.cli._script import add_script, have_states_logged, run_script, script_name

_VIEWERS = (".rrd", ".mcap")
_MODELS = (".urdf", ".sdf", ".xml", ".yaml")


def _add_options(parser: argparse.ArgumentParser) -> None:
    """Declares its own options."""
    add_output(parser, "beside, ending with .html")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares what `sheldrake report` takes."""
    _add_options(parser)
    add_script(parser, "the file that is written", "RUN", "a script, or a file of logs")


def run(options: argparse.Namespace) -> int:
    """Writes the report; returns the script's exit status, or 1 when there is nothing to report."""
    take_options_behind(options, _add_options)
    output = options.output or f"{script_name(options)}.html"
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
    simulators = _watch()
    have_states_logged()
    status = run_script(options)
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


def _watch() -> list[Any]:
    """Has every simulator that is made from now on in a list."""
    from sheldrake.systems.analysis import Simulator

    simulators: list[Any] = []
    make = Simulator.__init__

    def init(self: Any, *args: Any, **kwargs: Any) -> None:
        make(self, *args, **kwargs)
        simulators.append(self)

    Simulator.__init__ = init  # type: ignore[method-assign]
    return simulators
