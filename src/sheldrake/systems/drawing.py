"""Pictures of diagrams."""

from __future__ import annotations

import io
import shutil
import subprocess
from typing import Any

__all__ = ["plot_graphviz", "plot_system_graphviz"]


def _png_of(dot_text: str) -> bytes:
    """A picture of a graph in DOT, by Graphviz's own program, or else by pygraphviz."""
    program = shutil.which("dot")
    if program is not None:
        return subprocess.run([program, "-Tpng"], input=dot_text.encode(), stdout=subprocess.PIPE, check=True).stdout
    try:
        import pygraphviz
    except ImportError:
        raise ImportError(
            "plot_graphviz(): drawing needs Graphviz: its program `dot`, or the Python package pygraphviz. "
            "System.GetGraphvizString() gives the graph as text without it."
        ) from None
    return pygraphviz.AGraph(dot_text).draw(format="png", prog="dot")


def plot_graphviz(dot_text: str) -> Any:
    """Draws a graph in the current axes of matplotlib and returns the image.

    Args:
        dot_text: The graph, in Graphviz's language DOT.

    Raises:
        ImportError: Graphviz is not installed.
    """
    picture = _png_of(dot_text)
    import matplotlib.image
    import matplotlib.pyplot as plt

    plt.axis("off")
    return plt.imshow(matplotlib.image.imread(io.BytesIO(picture), format="png"), aspect="equal")


def plot_system_graphviz(system: Any, **kwargs: Any) -> Any:
    """Draws a system, with its subsystems, in the current axes of matplotlib and returns the image.

    Args:
        system: The system.
        **kwargs: Passed to `System.GetGraphvizString`, such as `max_depth`.

    Raises:
        ImportError: Graphviz is not installed.
    """
    return plot_graphviz(system.GetGraphvizString(**kwargs))
