"""Pictures of systems by matplotlib, from Graphviz text."""

from __future__ import annotations

from io import BytesIO
from typing import Any

__all__ = ["plot_graphviz", "plot_system_graphviz"]


def plot_graphviz(dot_text: str) -> Any:
    """Draws Graphviz text with matplotlib; gives the image.

    Raises:
        ImportError: pydot is not installed.
    """
    try:
        import pydot
    except ImportError:
        raise ImportError(
            "plot_graphviz() needs pydot and Graphviz's `dot`: pip install pydot. System.GetGraphvizString() gives the "
            "text, which any Graphviz viewer draws."
        ) from None
    import matplotlib.pyplot as plt

    graphs: Any = pydot.graph_from_dot_data(dot_text)
    image = plt.imread(BytesIO(graphs[0].create_png(prog=["dot", "-Gdpi=300"])))
    plt.axis("off")
    return plt.imshow(image, aspect="equal")


def plot_system_graphviz(system: Any, **kwargs: Any) -> Any:
    """Draws a system with matplotlib; keyword arguments go to `System.GetGraphvizString`."""
    return plot_graphviz(system.GetGraphvizString(**kwargs))
