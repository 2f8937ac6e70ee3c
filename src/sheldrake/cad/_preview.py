"""A page that shows a description: its shapes, its frame and its centre of mass."""

from __future__ import annotations

import contextlib
import io
import logging
from pathlib import Path
from typing import Any

import numpy as np

from ._units import size_text


def write_preview(model: Any, path: Path) -> None:
    """Writes a page, which needs no network, of a description that was just made and written.

    Args:
        model: A MeshModel with a path.
        path: The HTML file.
    """
    from sheldrake.geometry import Meshcat, Rgba, Sphere
    from sheldrake.math import RigidTransform
    from sheldrake.visualization import ModelVisualizer

    size = np.max([belief.size * belief.metres for belief in model.units], axis=0)
    length = 0.75 * float(np.max(size))
    logger = logging.getLogger("drake")
    level = logger.level
    logger.setLevel(logging.ERROR)  # nobody needs the address of a page that is gone in a moment
    try:
        with contextlib.redirect_stderr(io.StringIO()):
            meshcat = Meshcat()
        visualizer = ModelVisualizer(
            meshcat=meshcat, visualize_frames=True, triad_length=length, triad_radius=0.01 * length, triad_opacity=1.0
        )
        visualizer.AddModels(str(model.path))
        visualizer.Run(loop_once=True)
        meshcat.SetObject("/centre of mass", Sphere(0.03 * length), Rgba(0.1, 0.1, 0.1, 1.0))
        meshcat.SetTransform("/centre of mass", RigidTransform(model.p_BoBcm_B))
        meshcat.SetProperty("/drake/illustration", "modulated_opacity", 0.6)  # what is inside is to be seen
        html = meshcat.StaticHtml()
        meshcat._finalizer()
    finally:
        logger.setLevel(level)
    title = f"{model.path.stem}: {size_text(size)}, {model.mass:.4g} kg"
    path.write_text(html.replace("<title>sheldrake</title>", f"<title>{title}</title>", 1), encoding="utf-8")
