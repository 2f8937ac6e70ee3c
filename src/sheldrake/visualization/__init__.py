"""Looking at things: models and plants in the page, plots of logs."""

from sheldrake.common._names import show_as_own
from sheldrake.multibody.plant._multibody_plant import draw_plants_with
from sheldrake.systems.framework import Diagram, LeafSystem_
from sheldrake.systems.framework._templates import SystemTemplate
from sheldrake.visualization._block_diagram import DrawDiagram
from sheldrake.visualization._config import AddDefaultVisualization, ApplyVisualizationConfig, VisualizationConfig
from sheldrake.visualization._image_systems import ColorizeDepthImage, ColorizeLabelImage, ConcatenateImages
from sheldrake.visualization._live_plot import AddLivePlot, LivePlot
from sheldrake.visualization._meldis import Meldis
from sheldrake.visualization._model_visualizer import ModelVisualizer
from sheldrake.visualization._plot_log import PlotLog
from sheldrake.visualization._plotting import plot_sublevelset_expression, plot_sublevelset_quadratic
from sheldrake.visualization._pose_sliders import MeshcatPoseSliders
from sheldrake.visualization._topology_picture import DrawTopology
from sheldrake.visualization._triad import AddFrameTriadIllustration
from sheldrake.visualization._video import VideoWriter

MeshcatPoseSliders_ = SystemTemplate(
    "MeshcatPoseSliders_", MeshcatPoseSliders, scope=__name__, own=True, base=LeafSystem_
)
Diagram._picture = DrawDiagram
draw_plants_with(DrawTopology)

__all__ = [
    "AddDefaultVisualization",
    "AddFrameTriadIllustration",
    "AddLivePlot",
    "ApplyVisualizationConfig",
    "ColorizeDepthImage",
    "ColorizeLabelImage",
    "ConcatenateImages",
    "DrawDiagram",
    "DrawTopology",
    "LivePlot",
    "Meldis",
    "MeshcatPoseSliders",
    "MeshcatPoseSliders_",
    "ModelVisualizer",
    "PlotLog",
    "VideoWriter",
    "VisualizationConfig",
    "plot_sublevelset_expression",
    "plot_sublevelset_quadratic",
]

show_as_own(globals())
