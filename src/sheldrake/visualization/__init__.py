"""Looking at things: plots of logs, standard visualization of a plant, models in the viewer."""

from sheldrake.visualization._plot_log import PlotLog
from sheldrake.visualization._plotting import plot_sublevelset_quadratic

__all__ = [
    "PlotLog",
    "plot_sublevelset_quadratic",
]
