"""A figure that notebooks show once. Imported where a figure is made, since it needs matplotlib."""

from __future__ import annotations

import matplotlib.pyplot as plt
from matplotlib.figure import Figure


class NotebookFigure(Figure):
    """A Figure that is shown once, also when it is the value of a cell's last line.

    The inline backend shows at the end of a cell what pyplot holds open. A figure that the cell has shown by then,
    being its value, must not be among them; any other must, or `figure = PlotLog(log)` would show nothing.
    """

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict:
        """Hears that the figure is being shown; the picture is made by the formats the notebook is set to."""
        if "inline" in plt.get_backend():
            plt.close(self)
        return {}
