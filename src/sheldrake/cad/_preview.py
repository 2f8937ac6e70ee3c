"""A page that shows a description: its shapes, its frame and its centre of mass."""

from __future__ import annotations

import contextlib
import io
import logging
from html import escape
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ._units import size_text

_CAPTION = (
    '<header style="position: absolute; z-index: 2; padding: 12px 16px; font: 14px system-ui, sans-serif">'
    '<h1 style="margin: 0 0 4px; font-size: 18px">{}</h1>{}'
)


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
        name = ElementTree.fromstring(model.urdf).get("name")
        shapes = f"/drake/illustration/{name}/{name}/{name}"  # and not the frame, which lies beside them
        meshcat.SetProperty(shapes, "modulated_opacity", 0.4)  # what is inside is to be seen
        centre = np.asarray(model.p_BoBcm_B)
        meshcat.SetCameraPose(centre + np.max(size) * np.array([1.2, -1.5, 0.9]), centre)
        html = meshcat.StaticHtml()
        meshcat._finalizer()
    finally:
        logger.setLevel(level)
    title = f"{model.path.stem}: {size_text(size)}, {model.mass:.4g} kg"
    legend = "red, green, blue: x, y, z of the body; dark ball: centre of mass"
    html = html.replace("<title>sheldrake</title>", f"<title>{escape(title)}</title>", 1)
    html = html.replace('<header class="unseen"><h1>sheldrake</h1>', _CAPTION.format(escape(title), legend), 1)
    path.write_text(html, encoding="utf-8")
