"""A run as a file for Rerun or Foxglove."""

from __future__ import annotations

import os
from typing import Any

from ._run import run_of

ENDINGS = (".rrd", ".mcap")


def SaveRun(simulator: Any, path: str | os.PathLike, *, title: str = "", meshcat: Any = None) -> None:
    """Writes a run for other viewers: the scene, where its bodies were over time, and everything that was logged.

    A file that ends in `.rrd` is for Rerun (`rerun run.rrd`), one that ends in `.mcap` for Foxglove: topics `/scene`
    (foxglove.SceneUpdate), `/tf` (foxglove.FrameTransforms), and one for each log. Times are those of the simulation.

    Poses come from the logged state of the plants (`LogVectorOutput(plant.get_state_output_port(), builder)` or
    `LogAll(builder)` before Build()), at samples of the log, at most 60 in a second; else from what a Meshcat
    recorded; else bodies stay where they are now.

    Args:
        simulator: After AdvanceTo().
        path: The file, which is overwritten.
        title: Of the recording; by default the name of the diagram.
        meshcat: What recorded; by default the Meshcat of the diagram's MeshcatVisualizer.

    Raises:
        ImportError: rerun-sdk or mcap is not installed.
        OSError: The file can not be written.
        RuntimeError: The simulator has no context.
        ValueError: The path ends otherwise.
    """
    ending = os.path.splitext(os.fspath(path))[1].lower()
    if ending not in ENDINGS:
        raise ValueError(f"SaveRun(): '{os.fspath(path)}' must end in .rrd (for Rerun) or .mcap (for Foxglove).")
    if simulator.get_context() is None:
        raise RuntimeError("SaveRun(): the simulator has no context.")
    run = run_of(simulator, title, meshcat)
    if ending == ".rrd":
        from ._rerun import write_rerun

        write_rerun(run, path)
    else:
        from ._foxglove import write_foxglove

        write_foxglove(run, path)
