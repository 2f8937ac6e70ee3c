"""Collision shapes of bodies, by name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch, describe
from sheldrake.geometry import Shape
from sheldrake.math import RigidTransform

if TYPE_CHECKING:
    from sheldrake.geometry import GeometryId
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.systems.framework import Context


class BodyShapeDescription:
    """A shape and where it is in a body.

    Args:
        shape: The shape; or another description to copy.
        X_BS: Its pose in the body.
        model_instance_name: Of the body.
        body_name: Of the body.
    """

    _shape: Shape
    _X_BS: RigidTransform
    _model_instance_name: str
    _body_name: str

    @checked
    def __init__(
        self,
        shape: Shape | BodyShapeDescription | None = None,
        X_BS: RigidTransform | None = None,
        model_instance_name: str = "",
        body_name: str = "",
        *,
        other: BodyShapeDescription | None = None,
    ):
        source = other if other is not None else shape
        if isinstance(source, BodyShapeDescription):
            X_BS = source._X_BS
            model_instance_name, body_name = source._model_instance_name, source._body_name
            source = source._shape
        if not isinstance(source, Shape):
            raise Mismatch(f"BodyShapeDescription(): the shape must be a Shape, not {describe(source)}.")
        self._shape, self._X_BS = source.Clone(), RigidTransform() if X_BS is None else X_BS
        self._model_instance_name, self._body_name = str(model_instance_name), str(body_name)

    def shape(self) -> Shape:
        """Returns the shape."""
        return self._shape

    def pose_in_body(self) -> RigidTransform:
        """Returns its pose in the body."""
        return self._X_BS

    def model_instance_name(self) -> str:
        """Returns the name of the body's model instance."""
        return self._model_instance_name

    def body_name(self) -> str:
        """Returns the name of the body."""
        return self._body_name


@checked
def MakeBodyShapeDescription(
    plant: MultibodyPlant, plant_context: Context, geometry_id: GeometryId
) -> BodyShapeDescription:
    """Returns the description of a geometry of a plant.

    Args:
        plant: The plant, connected to a SceneGraph.
        plant_context: Its context, part of that of the diagram.
        geometry_id: The geometry.

    Raises:
        RuntimeError: the plant is not connected to a SceneGraph, or the geometry is on no body of it.
    """
    port = plant.get_geometry_query_input_port()
    if not port.HasValue(plant_context):
        raise RuntimeError("MakeBodyShapeDescription(): the plant is not connected to a SceneGraph in a diagram.")
    inspector = port.Eval(plant_context).inspector()
    body = plant.GetBodyFromFrameId(inspector.GetFrameId(geometry_id))
    if body is None:
        raise RuntimeError(f"MakeBodyShapeDescription(): {geometry_id} is on no body of the plant.")
    shape, X_BS = inspector.GetShape(geometry_id), inspector.GetPoseInFrame(geometry_id)
    return BodyShapeDescription(shape, X_BS, plant.GetModelInstanceName(body.model_instance()), body.name())
