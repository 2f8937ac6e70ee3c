"""Plants made from a configuration, and together with a SceneGraph."""

from __future__ import annotations

from typing import Any, NamedTuple

from sheldrake.common._checked import checked
from sheldrake.common._kinds import instance_of
from sheldrake.common._options import Options
from sheldrake.common._overloads import Mismatch, overload, overloaded
from sheldrake.geometry import HydroelasticContactRepresentation, SceneGraph, SceneGraphConfig
from sheldrake.multibody.plant._enums import ContactModel, DiscreteContactApproximation
from sheldrake.multibody.plant._multibody_plant import MultibodyPlant
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.framework._templates import on_scalar_of

_CONTACT_MODELS = {
    "point": ContactModel.kPoint,
    "hydroelastic": ContactModel.kHydroelastic,
    "hydroelastic_with_fallback": ContactModel.kHydroelasticWithFallback,
}
_APPROXIMATIONS = {kind._made_of.name: kind for kind in DiscreteContactApproximation}
_REPRESENTATIONS = {
    "triangle": HydroelasticContactRepresentation.kTriangle,
    "polygon": HydroelasticContactRepresentation.kPolygon,
}


class MultibodyPlantConfig(Options):
    """What can be configured of a plant.

    Attributes:
        time_step: Period of the discrete update [s], 0 for continuous state.
        use_sampled_output_ports: Whether ports that depend on forces report the last step.
        penetration_allowance: Penetration under a body's weight, where geometry says no stiffness [m].
        stiction_tolerance: Slip below which friction counts as sticking [m/s].
        contact_model: "point", "hydroelastic" or "hydroelastic_with_fallback".
        discrete_contact_approximation: "tamsi", "sap", "similar" or "lagged"; empty is "lagged".
        sap_near_rigid_threshold: How stiff contact may be before kSap softens it.
        contact_surface_representation: "triangle" or "polygon".
        adjacent_bodies_collision_filters: Whether neighbours in the tree may not touch.
    """

    time_step: float = 0.001
    use_sampled_output_ports: bool = True
    penetration_allowance: float = 0.001
    stiction_tolerance: float = 0.0001
    contact_model: str = "hydroelastic_with_fallback"
    discrete_contact_approximation: str = "lagged"
    sap_near_rigid_threshold: float = 1.0
    contact_surface_representation: str = "polygon"
    adjacent_bodies_collision_filters: bool = True


def _choice(what: str, choices: dict[str, Any], value: str) -> Any:
    if value not in choices:
        raise RuntimeError(f"Unknown {what}: '{value}'; it is one of {', '.join(repr(c) for c in choices)}.")
    return choices[value]


@checked
def ApplyMultibodyPlantConfig(config: MultibodyPlantConfig, plant: MultibodyPlant) -> None:
    """Configures a plant, except for its time_step, which must agree.

    Raises:
        RuntimeError: the time step differs, a value is unknown, or the plant is finalized.
    """
    if config.time_step != plant.time_step():
        raise RuntimeError(
            f"ApplyMultibodyPlantConfig(): the plant's time_step is {plant.time_step()}, the configuration's "
            f"{config.time_step}; the time step is given to the constructor."
        )
    plant._parts.elements.require_not_finalized("ApplyMultibodyPlantConfig")
    model = _choice("contact_model", _CONTACT_MODELS, config.contact_model)
    kind = config.discrete_contact_approximation or MultibodyPlantConfig.discrete_contact_approximation
    approximation = _choice("discrete_contact_approximation", _APPROXIMATIONS, kind)
    surface = _choice("contact_surface_representation", _REPRESENTATIONS, config.contact_surface_representation)
    plant.set_penetration_allowance(config.penetration_allowance)
    plant.set_stiction_tolerance(config.stiction_tolerance)
    plant.set_contact_model(model)
    plant.set_sap_near_rigid_threshold(config.sap_near_rigid_threshold)
    plant.set_contact_surface_representation(surface)
    plant.set_adjacent_bodies_collision_filters(config.adjacent_bodies_collision_filters)
    if plant.is_discrete():
        plant.set_discrete_contact_approximation(approximation)
        plant.SetUseSampledOutputPorts(config.use_sampled_output_ports)


class PlantAndSceneGraph(NamedTuple):
    """A plant and the SceneGraph that it is connected with; unpacks to both."""

    plant: MultibodyPlant
    scene_graph: SceneGraph


@checked
def AddMultibodyPlantSceneGraph(
    builder: Any,
    plant: Any = None,
    scene_graph: Any = None,
    *,
    time_step: float | None = None,
) -> PlantAndSceneGraph:
    """Adds a plant and a SceneGraph to a diagram and connects them.

    Args:
        builder: The DiagramBuilder.
        plant: A new MultibodyPlant, or the time step [s] of the one to make.
        scene_graph: A new SceneGraph; made when left out.
        time_step: The time step [s] of the plant to make, by name.

    Returns:
        (plant, scene_graph), also by name.
    """
    from sheldrake.geometry import SceneGraph_

    if plant is None:
        plant = time_step
    if not isinstance(plant, MultibodyPlant):
        if plant is None:
            raise Mismatch(
                "AddMultibodyPlantSceneGraph(): incompatible function arguments. Takes (builder, plant: "
                "MultibodyPlant, scene_graph=None) or (builder, time_step: float, scene_graph=None)."
            )
        plant = on_scalar_of(builder, MultibodyPlant)(plant)
    if scene_graph is None:
        scene_graph = SceneGraph_[builder._scalar]()
    for system, name in ((plant, "plant"), (scene_graph, "scene_graph")):
        if not system.get_name():
            system.set_name(name)
    builder.AddSystem(plant)
    builder.AddSystem(scene_graph)
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    builder.Connect(plant.get_geometry_pose_output_port(), scene_graph.get_source_pose_port(plant.get_source_id()))
    builder.Connect(
        plant.get_deformable_body_configuration_output_port(),
        scene_graph.get_source_configuration_port(plant.get_source_id()),
    )
    builder.Connect(scene_graph.get_query_output_port(), plant.get_geometry_query_input_port())
    return PlantAndSceneGraph(plant, scene_graph)


def _with_default_geometry(config: MultibodyPlantConfig, builder: DiagramBuilder) -> PlantAndSceneGraph:
    return AddMultibodyPlant(config, SceneGraphConfig(), builder)


@overloaded(
    overload(
        _with_default_geometry,
        config=instance_of(MultibodyPlantConfig),
        builder=instance_of(DiagramBuilder),
    ),
    overload(
        plant_config=instance_of(MultibodyPlantConfig),
        scene_graph_config=instance_of(SceneGraphConfig),
        builder=instance_of(DiagramBuilder),
    ),
)
def AddMultibodyPlant(
    config: MultibodyPlantConfig, scene_graph_config: SceneGraphConfig, builder: DiagramBuilder
) -> PlantAndSceneGraph:
    """Adds a plant and a SceneGraph as configured: `(config, builder)` or `(plant_config, scene_graph_config,
    builder)`.

    Returns:
        (plant, scene_graph), also by name.
    """
    plant = MultibodyPlant(config.time_step)
    ApplyMultibodyPlantConfig(config, plant)
    return AddMultibodyPlantSceneGraph(builder, plant, SceneGraph(scene_graph_config))
