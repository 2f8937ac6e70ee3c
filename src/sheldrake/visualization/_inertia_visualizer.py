"""InertiaVisualizer: bodies' inertias as ellipsoids of water."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common.value import AbstractValue
from sheldrake.geometry import (
    Ellipsoid,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    IllustrationProperties,
    Rgba,
    SceneGraph,
)
from sheldrake.math import RigidTransform
from sheldrake.multibody.tree import BodyIndex
from sheldrake.systems.framework import DiagramBuilder, LeafSystem

if TYPE_CHECKING:
    from sheldrake.geometry._ids import SourceId
    from sheldrake.multibody.math._spatial_inertia import SpatialInertia
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.systems.framework import Context

PREFIX = "inertia"  # of the MeshcatVisualizer that draws them
_DENSITY = 1000.0  # [kg/m^3]
_FLATTEST = 100.0  # no half axis is shorter than the longest by more than this factor
_NO_MASS_RADIUS = 1e-3  # [m]


def ellipsoid_of(M_BBo_B: SpatialInertia) -> tuple[Any, RigidTransform]:
    """Returns an ellipsoid of water with a body's mass and with its inertia's proportions, and its pose in B.

    A body of no mass is a sphere of 1 mm. The ellipsoid is never flatter than 1:100.
    """
    mass = float(M_BBo_B.get_mass())
    if mass == 0.0:
        return Ellipsoid(_NO_MASS_RADIUS, _NO_MASS_RADIUS, _NO_MASS_RADIUS), RigidTransform()
    half_axes, X_BE = M_BBo_B.CalcPrincipalSemiDiametersAndPoseForSolidEllipsoid()
    longest = half_axes.max()
    shape = np.maximum(half_axes / longest, 1.0 / _FLATTEST) if longest > 0 else np.ones(3)
    volume = mass / _DENSITY
    return Ellipsoid(*(shape * np.cbrt(volume / (4.0 / 3.0 * np.pi * shape.prod())))), X_BE


class InertiaVisualizer(LeafSystem):
    """Adds an ellipsoid to a SceneGraph for each body of a plant, which moves with the body.

    The ellipsoid has the density of water, the body's mass and the axes of its inertia: one much larger than the
    body shows an inertia, or a unit of length, gone wrong. Ports: input "plant_geometry_pose", output "geometry_pose".
    Only MeshcatVisualizers with the prefix "inertia" draw the ellipsoids.

    Args:
        plant: The finalized plant, registered with the SceneGraph.
        scene_graph: Where the ellipsoids go.
    """

    def __init__(self, plant: MultibodyPlant, scene_graph: SceneGraph):
        super().__init__()
        source = self._source_id = scene_graph.RegisterSource("inertia_visualizer")
        self._items: list[tuple[Any, Any, RigidTransform]] = []
        for index in map(BodyIndex, range(1, plant.num_bodies())):
            body = plant.get_body(index)
            if plant.GetBodyFrameIdIfExists(index) is None:
                continue
            shape, X_BE = ellipsoid_of(body.default_spatial_inertia())
            name = f"InertiaVisualizer::{body.scoped_name()}"
            frame = scene_graph.RegisterFrame(source, GeometryFrame(name))
            instance = GeometryInstance(RigidTransform(), shape, f"$inertia({int(index)})")
            properties = IllustrationProperties()
            properties.AddProperty("phong", "diffuse", Rgba(0.0, 0.0, 1.0, 1.0))
            properties.AddProperty("meshcat", "accepting", PREFIX)
            instance.set_illustration_properties(properties)
            scene_graph.RegisterGeometry(source, frame, instance)
            self._items.append((plant.GetBodyFrameIdOrThrow(index), frame, X_BE))
        self.DeclareAbstractInputPort("plant_geometry_pose", AbstractValue.Make(FramePoseVector()))
        self.DeclareAbstractOutputPort("geometry_pose", lambda: AbstractValue.Make(FramePoseVector()), self._calc)

    @staticmethod
    def AddToBuilder(builder: DiagramBuilder, plant: MultibodyPlant, scene_graph: SceneGraph) -> InertiaVisualizer:
        """Adds the system to a diagram, between the plant and its SceneGraph, and returns it."""
        visualizer = builder.AddSystem(InertiaVisualizer(plant, scene_graph))
        if not builder.HasSubsystemNamed("inertia_visualizer"):
            visualizer.set_name("inertia_visualizer")
        builder.Connect(plant.get_geometry_pose_output_port(), visualizer.get_input_port(0))
        builder.Connect(visualizer.get_output_port(0), scene_graph.get_source_pose_port(visualizer.source_id()))
        return visualizer

    def source_id(self) -> SourceId:
        """Returns the SceneGraph's number for this system."""
        return self._source_id

    def _calc(self, context: Context, output: AbstractValue) -> None:
        given = self.get_input_port(0).Eval(context)
        poses = FramePoseVector()
        for body_frame, frame, X_BE in self._items:
            poses.set_value(frame, given.value(body_frame) @ X_BE)
        output.set_value(poses)
