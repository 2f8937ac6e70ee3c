"""Options of a ContactVisualizer."""

from __future__ import annotations

from sheldrake.common._options import Options
from sheldrake.geometry import Rgba


class ContactVisualizerParams(Options):
    """What a ContactVisualizer draws, where, how large and how often.

    Attributes:
        publish_period: Simulated time between two publishes [s]; 1/32 is exact in binary. With zero only what asks for
            publishes draws.
        color: Color of the arrows of point contacts.
        hydro_force_color: Color of the force arrows of contact surfaces.
        hydro_moment_color: Color of the moment arrows of contact surfaces.
        prefix: Path under which everything is drawn; relative to "/drake" unless it starts with "/".
        delete_on_initialization_event: Whether an initialization clears what was drawn before.
        force_threshold: Forces below this are not drawn [N]; positive.
        moment_threshold: Moments below this are not drawn [N m].
        newtons_per_meter: Force that an arrow of one metre stands for [N/m]; none is longer than the scene.
        newton_meters_per_meter: Moment that an arrow of one metre stands for [N m/m]; none is longer than the scene.
        radius: Radius of the arrows' shafts [m].
    """

    publish_period: float = 1 / 32.0
    color: Rgba = Rgba(0, 1, 0, 1)
    hydro_force_color: Rgba = Rgba(1, 0, 0, 1)
    hydro_moment_color: Rgba = Rgba(0, 0, 1, 1)
    prefix: str = "contact_forces"
    delete_on_initialization_event: bool = True
    force_threshold: float = 0.01
    moment_threshold: float = 0.01
    newtons_per_meter: float = 10.0
    newton_meters_per_meter: float = 3.0
    radius: float = 0.002
