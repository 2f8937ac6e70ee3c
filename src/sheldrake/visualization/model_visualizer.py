"""Shows model files in the page: `python -m sheldrake.visualization.model_visualizer robot.urdf`.

The page has a slider for each joint. "Reload Model Files" reads the files again, "Stop Running", Escape in the page, or
Ctrl-C in the terminal ends it. `ModelVisualizer` does the same from a program, `sheldrake view` from the shell.
"""

from __future__ import annotations

import argparse
import sys
from contextlib import AbstractContextManager, nullcontext
from typing import Any

from sheldrake.visualization._model_visualizer import ModelVisualizer

__all__: list[str] = []


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares what the program takes."""
    parser.add_argument(
        "filename", nargs="+", help="URDF, SDFormat, MJCF, mesh or model directives file; or a package:// address"
    )
    parser.add_argument("-w", "--open-window", dest="browser_new", action="store_true", help="open a browser window")
    parser.add_argument("--pyplot", action="store_true", help="draw in a matplotlib figure, too")
    parser.add_argument("--visualize_frames", action="store_true", help="draw the frames as axes")
    parser.add_argument("--show_rgbd_sensor", action="store_true", help="show what a camera would see")
    parser.add_argument("--environment_map", default="", help="an image for reflections")
    parser.add_argument("--no_lights", action="store_true", help="switch off the page's lights")
    parser.add_argument(
        "--compliance_type", default="undefined", help="how what does not say collides: undefined, rigid or compliant"
    )
    for name, default in (("length", 0.3), ("radius", 0.005), ("opacity", 0.9)):
        parser.add_argument(f"--triad_{name}", type=float, default=default, help=f"of the axes (default {default})")
    parser.add_argument(
        "-q", "--position", type=float, nargs="+", default=None, help="positions of all joints to begin with"
    )
    parser.add_argument("--loop_once", action="store_true", help="show the models once and end")


def _show(
    filenames: list[str],
    position: list[float] | None,
    loop_once: bool,
    reading: AbstractContextManager[None] | None = None,
    **options: Any,
) -> int:
    """Shows files with a ModelVisualizer of these options; returns the exit status. `reading` is entered meanwhile."""
    try:
        visualizer = ModelVisualizer(**options)
        with reading or nullcontext():
            visualizer.package_map().PopulateFromRosPackagePath()
            for name in filenames:
                visualizer.AddModels(name)
        visualizer.Finalize(position)
    except (OSError, RuntimeError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    try:
        visualizer.Run(loop_once=loop_once)
    except KeyboardInterrupt:
        print()
    return 0


def _main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    _add_arguments(parser)
    options = vars(parser.parse_args())
    return _show(options.pop("filename"), options.pop("position"), options.pop("loop_once"), **options)


if __name__ == "__main__":
    sys.exit(_main())
