"""`sheldrake plot`: a picture of a log.

Takes what VectorLog or LogSet wrote with ToNpz(), ToCsv() or ToParquet(), and files of StreamLogs(), also of a run that
was killed. Without -o the plot is shown, or, where there is no display, written beside the log.

  sheldrake plot log.npz
  sheldrake plot run.log --rpy --degrees --only plant/state -o state.png
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from typing import Any

from sheldrake.cli._output import add_json, add_output, output_file, print_json, reporting, say_written


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares what `sheldrake plot` takes."""
    parser.add_argument("log", metavar="LOG", help="file of a log")
    add_output(parser, "beside, or shown; .png, .svg, .pdf")
    parser.add_argument("--rpy", action="store_true", help="quaternions as roll, pitch, yaw")
    parser.add_argument("--degrees", action="store_true", help="angles in degrees")
    parser.add_argument("--only", metavar="PATTERN", default="", help="logs whose name contains this pattern")
    parser.add_argument("--list", action="store_true", help="only say what is in the file")
    add_json(parser, "the file that is written, or with --list what is in the log")


def run(options: argparse.Namespace) -> int:
    """Plots the log; returns the exit status."""
    from sheldrake.systems.primitives import LogSet, ReadLogs

    try:
        logs = ReadLogs(options.log)
    except FileNotFoundError:
        print(f"sheldrake plot: there is no file '{options.log}'.", file=sys.stderr)
        return 1
    except (OSError, ValueError, ImportError) as error:
        print(f"sheldrake plot: {error}", file=sys.stderr)
        return 1
    if logs.is_complete is False:
        print(f"the run was cut off; {options.log} has what was logged until then", file=sys.stderr)
    chosen = LogSet({title: log for title, log in logs.items() if re.search(options.only, title)})
    if not chosen:
        print(f"sheldrake plot: no log matches '{options.only}'; there are {', '.join(logs)}", file=sys.stderr)
        return 1
    if options.list and options.json:
        print_json([_facts(title, log) for title, log in chosen.items()])
        return 0
    if options.list:
        for title, log in chosen.items():
            times = log.sample_times()
            span = f"{times[0]:g} to {times[-1]:g} s" if len(times) else "no time"
            print(f"{title}: {log.num_samples()} samples of {log.get_input_size()}, {span}")
        return 0
    with reporting(options) as told:
        return _plot(chosen, options, told)


def _facts(title: str, log: Any) -> dict[str, Any]:
    times = log.sample_times()
    return {
        "log": title,
        "samples": log.num_samples(),
        "elements": log.names(),
        "units": log.units(),
        "begin": float(times[0]) if len(times) else None,
        "end": float(times[-1]) if len(times) else None,
    }


def _plot(logs: Any, options: argparse.Namespace, told: dict[str, Any]) -> int:
    import matplotlib

    shown = options.output is None and not options.json and _has_display(matplotlib)
    if not shown:
        matplotlib.use("Agg")
    from sheldrake.visualization import PlotLog

    figure = PlotLog(logs, title=os.path.basename(options.log), rpy=options.rpy, degrees=options.degrees)
    if shown:
        import matplotlib.pyplot as plt

        plt.show()
        return 0
    output = options.output or os.path.splitext(options.log)[0] + ".png"
    try:
        with output_file(output, ".png") as path:
            figure.savefig(path, dpi=120)
    except (OSError, ValueError) as error:
        print(f"sheldrake plot: {error}", file=sys.stderr)
        return 1
    say_written(output, told)
    return 0


def _has_display(matplotlib: Any) -> bool:
    """Whether a window can be shown: matplotlib has a backend for it, and there is a screen."""
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return False
    return matplotlib.get_backend().lower() not in ("agg", "pdf", "svg", "ps", "cairo", "template")
