"""Shows models in a page: looks, collisions, inertias and contacts can be switched there, and each joint has a slider.

The page's button "Reload Model Files" reads the files again. "Stop Running" or Escape in the page, or Ctrl-C here,
ends it.

examples:
  sheldrake view robot.urdf                   URDF, SDFormat, MJCF, a mesh, or model directives
  sheldrake view robot.urdf -q 0.1 0.5        with joints at these positions [rad or m]
  sheldrake view part.obj --frames --once     shows it once and ends
"""

from __future__ import annotations

import argparse


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares what `sheldrake view` takes."""
    parser.add_argument("file", nargs="+", help="model or mesh file, or a package:// address")
    parser.add_argument("-q", "--position", type=float, nargs="+", help="positions of all joints to begin with")
    parser.add_argument("--frames", action="store_true", help="draw the frames as axes")
    parser.add_argument("--window", "-w", action="store_true", help="open the page in a browser")
    parser.add_argument("--pyplot", action="store_true", help="draw in a matplotlib figure, too")
    parser.add_argument("--once", action="store_true", help="show the models once and end")


def run(options: argparse.Namespace) -> int:
    """Shows the models; returns the exit status."""
    from sheldrake.visualization.model_visualizer import _show

    return _show(
        options.file,
        options.position,
        options.once,
        visualize_frames=options.frames,
        browser_new=options.window,
        pyplot=options.pyplot,
    )
