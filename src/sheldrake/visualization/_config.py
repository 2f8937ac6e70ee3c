"""Standard visualization of a plant: one call, or a configuration."""

from __future__ import annotations

import copy
import logging
from typing import TYPE_CHECKING, Any

from sheldrake.common._options import Options
from sheldrake.geometry import (
    DrakeVisualizer,
    DrakeVisualizerParams,
    Meshcat,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    Rgba,
    Role,
)
from sheldrake.multibody.meshcat import ContactVisualizer, ContactVisualizerParams, MeshcatMouseSpring
from sheldrake.multibody.plant import ConnectContactResultsToDrakeVisualizer
from sheldrake.systems.lcm import LcmBuses

from ._inertia_visualizer import PREFIX as INERTIA_PREFIX
from ._inertia_visualizer import InertiaVisualizer

if TYPE_CHECKING:
    from sheldrake.geometry._scene_graph import SceneGraph
    from sheldrake.lcm._interface import DrakeLcmInterface
    from sheldrake.multibody.plant._multibody_plant import MultibodyPlant
    from sheldrake.systems.framework._diagram_builder import DiagramBuilder

log = logging.getLogger("drake")


class VisualizationConfig(Options):
    """What to show of a plant and its scene graph.

    Attributes:
        lcm_bus: Name of a message bus; what is shown is published there when buses are given.
        publish_period: Simulated time between two publishes [s].
        publish_illustration: Whether to show what the models look like.
        default_illustration_color: Color of illustration geometry that names none.
        publish_proximity: Whether to show what collides; hidden until switched on in the page.
        default_proximity_color: Color of proximity geometry that names none.
        initial_proximity_alpha: Where the opacity slider of proximity geometry starts, in [0, 1].
        publish_contacts: Whether to show contact forces.
        publish_inertia: Whether to show inertias as ellipsoids; hidden until switched on in the page.
        enable_meshcat_creation: Whether to make a Meshcat where none is given.
        delete_on_initialization_event: Whether an initialization clears what was drawn before.
        enable_alpha_sliders: Whether the page gets opacity sliders.
        mouse_interaction_stiffness: Of the spring by which the mouse pulls bodies in the page, by their mass [1/s²]
            (see `MeshcatMouseSpring`); None for no spring. Drake has 100 where this has None: what is simulated should
            not depend on who looks unless that is wanted.
    """

    lcm_bus: str = "default"
    publish_period: float = 1 / 64.0
    publish_illustration: bool = True
    default_illustration_color: Rgba = Rgba(0.9, 0.9, 0.9)
    publish_proximity: bool = True
    default_proximity_color: Rgba = Rgba(0.8, 0.0, 0.0)
    initial_proximity_alpha: float = 0.5
    publish_contacts: bool = True
    publish_inertia: bool = True
    enable_meshcat_creation: bool = True
    delete_on_initialization_event: bool = True
    enable_alpha_sliders: bool = False
    mouse_interaction_stiffness: float | None = None


def _subsystem(builder: DiagramBuilder, given: Any, name: str) -> Any:
    if given is not None:
        return given
    if not builder.HasSubsystemNamed(name):
        names = sorted(system.get_name() for system in builder.GetSystems())
        raise RuntimeError(
            f"ApplyVisualizationConfig(): the builder has no system named '{name}'; it has "
            f"{', '.join(names) or 'none'}. Call "
            "AddMultibodyPlant() or AddMultibodyPlantSceneGraph() first, or pass the system."
        )
    return builder.GetSubsystemByName(name)


def ApplyVisualizationConfig(
    config: VisualizationConfig,
    builder: DiagramBuilder,
    lcm_buses: LcmBuses | None = None,
    plant: MultibodyPlant | None = None,
    scene_graph: SceneGraph | None = None,
    meshcat: Meshcat | None = None,
    lcm: DrakeLcmInterface | None = None,
) -> None:
    """Adds the visualizers that a configuration asks for to a diagram.

    Args:
        config: What to show.
        builder: The diagram in the making.
        lcm_buses: Where looks, collision shapes and contacts are published for viewers in other processes, by the
            configuration's `lcm_bus`; nowhere when both this and `lcm` are left out.
        plant: The finalized plant; the system named "plant" when left out.
        scene_graph: Its scene graph; the system named "scene_graph" when left out.
        meshcat: Where to draw; a new one when left out, if the configuration allows.
        lcm: Where they are published, in place of a bus.

    Raises:
        RuntimeError: when a system is missing, the plant is not finalized, or another bus than "default" is named.
    """
    if lcm_buses is None and lcm is None and config.lcm_bus != "default":
        raise RuntimeError(f"ApplyVisualizationConfig(): there is no LCM bus '{config.lcm_bus}' (only 'default').")
    if lcm is None and lcm_buses is not None:
        lcm = lcm_buses.Find("Visualization", config.lcm_bus)
    config = copy.copy(config)
    plant = _subsystem(builder, plant, "plant")
    scene_graph = _subsystem(builder, scene_graph, "scene_graph")
    if not plant.is_finalized():
        raise RuntimeError("ApplyVisualizationConfig(): call plant.Finalize() first.")
    if lcm is not None and lcm.get_lcm_url() != LcmBuses.kLcmUrlMemqNull:
        for told in _messenger_params(config):
            DrakeVisualizer.AddToBuilder(builder, scene_graph, lcm, told)
        if config.publish_contacts:
            ConnectContactResultsToDrakeVisualizer(builder, plant, scene_graph, lcm, config.publish_period)
    if meshcat is None:
        if not config.enable_meshcat_creation:
            return
        meshcat = Meshcat()
    for params in _visualizer_params(config):
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat, params)
    if config.publish_contacts:
        ContactVisualizer.AddToBuilder(
            builder,
            plant.get_contact_results_output_port(),
            scene_graph.get_query_output_port(),
            meshcat,
            ContactVisualizerParams(
                publish_period=config.publish_period,
                delete_on_initialization_event=config.delete_on_initialization_event,
            ),
        )
    if config.mouse_interaction_stiffness is not None:
        _add_mouse_spring(builder, plant, meshcat, config.mouse_interaction_stiffness)
    if config.publish_inertia:
        meshcat._note(INERTIA_PREFIX)
        InertiaVisualizer.AddToBuilder(builder, plant, scene_graph)


def _add_mouse_spring(builder: Any, plant: Any, meshcat: Meshcat, stiffness: float) -> None:
    """Lets the mouse pull bodies, unless something else feeds the port for forces."""
    port = plant.get_applied_spatial_force_input_port()
    if (plant, port.get_index()) in builder.connection_map():
        log.warning(
            "VisualizationConfig: mouse_interaction_stiffness is set, but the port applied_spatial_force of '%s' is "
            "connected already; the mouse pulls nothing.",
            plant.get_name(),
        )
        return
    MeshcatMouseSpring.AddToBuilder(builder, plant, meshcat, stiffness)


def _messenger_params(config: VisualizationConfig) -> list[DrakeVisualizerParams]:
    """Returns the options of what a configuration asks to publish."""
    shared: dict[str, Any] = {"publish_period": config.publish_period, "use_role_channel_suffix": True}
    wanted = []
    if config.publish_illustration:
        color = config.default_illustration_color
        wanted.append(DrakeVisualizerParams(role=Role.kIllustration, default_color=color, **shared))
    if config.publish_proximity:
        color = config.default_proximity_color
        wanted.append(
            DrakeVisualizerParams(role=Role.kProximity, default_color=color, show_hydroelastic=True, **shared)
        )
    return wanted


def _visualizer_params(config: VisualizationConfig) -> list[MeshcatVisualizerParams]:
    """Returns the options of the visualizers which a configuration asks for."""
    shared: dict[str, Any] = {
        "publish_period": config.publish_period,
        "delete_on_initialization_event": config.delete_on_initialization_event,
        "enable_alpha_slider": config.enable_alpha_sliders,
    }
    wanted = []
    if config.publish_illustration:
        color = config.default_illustration_color
        wanted.append(
            MeshcatVisualizerParams(role=Role.kIllustration, prefix="illustration", default_color=color, **shared)
        )
    if config.publish_inertia:
        wanted.append(
            MeshcatVisualizerParams(
                role=Role.kIllustration,
                prefix=INERTIA_PREFIX,
                visible_by_default=False,
                include_unspecified_accepting=False,
                initial_alpha_slider_value=0.5,
                **shared,
            )
        )
    if config.publish_proximity:
        wanted.append(
            MeshcatVisualizerParams(
                role=Role.kProximity,
                prefix="proximity",
                default_color=config.default_proximity_color,
                visible_by_default=False,
                initial_alpha_slider_value=config.initial_proximity_alpha,
                show_hydroelastic=True,
                **shared,
            )
        )
    return wanted


def AddDefaultVisualization(builder: DiagramBuilder, meshcat: Meshcat | None = None) -> None:
    """Shows the plant named "plant" of a diagram, with the default configuration.

    Args:
        builder: The diagram in the making; its plant is finalized.
        meshcat: Where to draw; a new one when left out.

    Raises:
        RuntimeError: when a system is missing or the plant is not finalized.
    """
    ApplyVisualizationConfig(VisualizationConfig(), builder, meshcat=meshcat)
