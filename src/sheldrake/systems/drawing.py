"""Pictures of systems by matplotlib, from Graphviz text."""

from __future__ import annotations

from io import BytesIO
from typing import Any

from sheldrake.common._notebook import in_notebook

__all__ = ["plot_graphviz", "plot_system_graphviz", "running_as_notebook"]


running_as_notebook = in_notebook()


def plot_graphviz(dot_text: str) -> Any:
    """Draws Graphviz text: in a notebook as SVG, else with matplotlib, whose image it gives.

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
    graphs: Any = pydot.graph_from_dot_data(dot_text)
    if running_as_notebook:
        from IPython.display import SVG, display

        return display(SVG(graphs[0].create_svg()))
    import matplotlib.pyplot as plt

    image = plt.imread(BytesIO(graphs[0].create_png(prog=["dot", "-Gdpi=300"])))
    plt.axis("off")
    return plt.imshow(image, aspect="equal")


def plot_system_graphviz(system: Any, **kwargs: Any) -> Any:
    """Draws a system with matplotlib; keyword arguments go to `System.GetGraphvizString`."""
    return plot_graphviz(system.GetGraphvizString(**kwargs))
