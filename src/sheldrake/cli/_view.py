"""Shows models in a page: joints have sliders; looks, collisions and inertias can be switched.

A name in place of a file is looked up in sheldrake's models, in example-robot-data and in robot_descriptions, where
they are installed. What floats stands on the ground and has sliders for its place and its roll, pitch and yaw. The
page's button "Reload Model Files" reads the files again. "Play / Pause" has it move under gravity; then Ctrl and the
left mouse button pull bodies, and "Reset" goes back. "Stop Running" or Escape in the page, or Ctrl-C here, ends it.

examples:
  sheldrake view robot.urdf                   URDF, SDFormat, MJCF, a mesh, or model directives
  sheldrake view go2                          a robot of an installed package
  sheldrake view robot.urdf -q 0.1 0.5        with joints at these positions [rad or m]
  sheldrake view part.obj --frames --once     shows it once and ends
"""

from __future__ import annotations

import argparse
import sys


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares what `sheldrake view` takes."""
    parser.add_argument("file", nargs="+", help="model or mesh file, a package:// address, or the name of a robot")
    parser.add_argument("-q", "--position", type=float, nargs="+", help="positions of all joints to begin with")
    parser.add_argument("--frames", action="store_true", help="draw the frames as axes")
    parser.add_argument("--contacts", action="store_true", help="draw the forces between bodies that overlap")
    parser.add_argument("--weld-base", action="store_true", help="weld what floats to the world")
    parser.add_argument("--window", "-w", action="store_true", help="open the page in a browser")
    parser.add_argument("--pyplot", action="store_true", help="draw in a matplotlib figure, too")
    parser.add_argument("--once", action="store_true", help="show the models once and end")


def run(options: argparse.Namespace) -> int:
    """Shows the models; returns the exit status."""
    import tempfile

    from sheldrake.cli._model_names import find_model

    with tempfile.TemporaryDirectory(prefix="sheldrake-", ignore_cleanup_errors=True) as folder:
        try:
            files = [_viewed(find_model(name), folder) for name in options.file]
        except (ImportError, OSError, ValueError) as error:
            print(f"sheldrake view: {error}", file=sys.stderr)
            return 1
        return _run(files, options)


def _viewed(file: str, folder: str) -> str:
    """A file that the parser reads, or a description of a mesh, in a folder: OBJ is shown as it is, with its looks."""
    from sheldrake.cli._mesh2urdf import part_of

    return file if file.lower().endswith(".obj") else part_of(file, folder)


def _run(files: list[str], options: argparse.Namespace) -> int:
    from sheldrake.cli._warnings import warnings_in_one_line
    from sheldrake.visualization.model_visualizer import _show

    return _show(
        files,
        options.position,
        options.once,
        reading=warnings_in_one_line(*files),
        visualize_frames=options.frames,
        publish_contacts=options.contacts,
        weld_base=options.weld_base,
        simulate=True,
        browser_new=options.window,
        pyplot=options.pyplot,
    )
