"""Options of Meshcat and of the visualizers that draw into it."""

from __future__ import annotations

import numpy as np

from sheldrake.common._options import Options, Vector3
from sheldrake.geometry._rgba import Rgba
from sheldrake.geometry._roles import Role


class MeshcatPropertyTuple(Options):
    """One property that a new Meshcat sets before anybody looks.

    Attributes:
        path: Path in the scene, for example "/Background".
        property: Name of the property, for example "visible".
        value: The value: a number, a bool, a string or a list of numbers.
    """

    path: str = ""
    property: str = ""
    value: list[float] | str | bool | float = []


class MeshcatParams(Options):
    """How a Meshcat listens and what its page shows first.

    Attributes:
        host: Name or address to listen on. The default, "localhost", lets only this machine in;
            "*" listens on every interface.
        port: Port to listen on. None takes the first free one from 7000 on, 0 any free one.
        web_url_pattern: What web_url() reports, with {host} and {port} filled in.
        initial_properties: Properties set before anybody looks.
        show_stats_plot: Whether the panel shows time and realtime rate.
        realtime_rate_period: Least wall-clock time between two reports of the realtime rate [s].
    """

    host: str = "localhost"
    port: int | None = None
    web_url_pattern: str = "http://{host}:{port}"
    initial_properties: list[MeshcatPropertyTuple] = []
    show_stats_plot: bool = True
    realtime_rate_period: float = 0.25

    PropertyTuple = MeshcatPropertyTuple


class MeshcatVisualizerSurfaceVelocityData(Options):
    """What a MeshcatVisualizer is told of a body whose surface runs, as a belt does.

    Attributes:
        displacement_signal_name: Name of the body's signal in the bus of surface displacements.
        axis_B: Axis around which the surface runs, in the body's frame.
    """

    displacement_signal_name: str = ""
    axis_B: Vector3 = np.zeros(3)


class MeshcatVisualizerParams(Options):
    """What a MeshcatVisualizer draws, where and how often.

    Attributes:
        publish_period: Simulated time between two publishes [s]; 1/64 is exact in binary. With zero only what asks for
            publishes, as the start of a simulation does, draws.
        role: Which role of the geometries is drawn.
        default_color: Color of geometries that name none.
        prefix: Path under which everything is drawn; relative to "/drake" unless it starts with "/".
        delete_on_initialization_event: Whether an initialization clears what was drawn before.
        enable_alpha_slider: Whether the panel gets a slider for opacity.
        initial_alpha_slider_value: Where that slider starts, in [0, 1].
        visible_by_default: Whether the prefix starts visible.
        show_hydroelastic: Whether proximity geometries are drawn by their contact meshes.
        include_unspecified_accepting: Whether geometries are drawn that do not name the
            visualizers they want, in the property ("meshcat", "accepting").
    """

    publish_period: float = 1 / 64.0
    role: Role = Role.kIllustration
    default_color: Rgba = Rgba(0.9, 0.9, 0.9, 1.0)
    prefix: str = "visualizer"
    delete_on_initialization_event: bool = True
    enable_alpha_slider: bool = False
    initial_alpha_slider_value: float = 1.0
    visible_by_default: bool = True
    show_hydroelastic: bool = False
    include_unspecified_accepting: bool = True
