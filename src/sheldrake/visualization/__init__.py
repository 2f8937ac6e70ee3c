"""Looking at things: plots of logs, standard visualization of a plant."""

from sheldrake.visualization._config import AddDefaultVisualization, ApplyVisualizationConfig, VisualizationConfig
from sheldrake.visualization._plot_log import PlotLog
from sheldrake.visualization._plotting import plot_sublevelset_quadratic

__all__ = [
    "AddDefaultVisualization",
    "ApplyVisualizationConfig",
    "PlotLog",
    "VisualizationConfig",
    "plot_sublevelset_quadratic",
]
