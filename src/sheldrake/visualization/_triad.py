"""Frames drawn as three axes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.geometry import Cylinder, GeometryInstance, MakePhongIllustrationProperties
from sheldrake.math import RigidTransform, RotationMatrix

if TYPE_CHECKING:
    from sheldrake.geometry import SceneGraph
    from sheldrake.multibody.plant import MultibodyPlant

_AXES = ("x", "y", "z")
_FIXED_FRAME_BRIGHTNESS = 0.5  # so that they are told from the bodies' own frames


def AddFrameTriadIllustration(
    *,
    scene_graph: SceneGraph,
    body: Any = None,
    frame: Any = None,
    frame_index: Any = None,
    frame_id: Any = None,
    plant: MultibodyPlant | None = None,
    name: str | None = None,
    length: float = 0.3,
    radius: float = 0.005,
    opacity: float = 0.9,
    X_FT: RigidTransform | None = None,
) -> list[Any]:
    """Draws a frame F as three axes, x in red, y in green and z in blue; darker when F is not a body's own frame.

    Exactly one of body, frame, frame_index and frame_id says which frame.

    Args:
        scene_graph: Where the axes are added.
        body: A body, for its own frame.
        frame: A frame of a plant.
        frame_index: Number of a frame of `plant`.
        frame_id: The SceneGraph's number for a body of `plant`.
        plant: The plant, needed with frame_index and frame_id; otherwise it may be left out.
        name: The axes are called "_frames::{name}::x-axis" and so on; by default after the frame.
        length: Length of each axis [m].
        radius: Radius of each axis [m].
        opacity: Between 0 and 1.
        X_FT: Pose of the axes in F; the identity when left out.

    Returns:
        The geometries of the x, y and z axes.

    Raises:
        ValueError: when not exactly one frame is said, the plant is missing or another than the frame's, or a length
            or radius is not positive.
        RuntimeError: when the frame has axes of that name already.
    """
    if sum(given is not None for given in (body, frame, frame_index, frame_id)) != 1:
        raise ValueError(
            "AddFrameTriadIllustration(): Must provide exactly one of body=, frame=, frame_index=, or frame_id="
        )
    for argument, given in (("frame_index", frame_index), ("frame_id", frame_id)):
        if given is not None and plant is None:
            raise ValueError(f"AddFrameTriadIllustration(): When using {argument}=, the plant cannot be None.")
    for argument, given in (("body", body), ("frame", frame)):
        if given is not None and plant is not None and given.GetParentPlant() is not plant:
            raise ValueError(f"AddFrameTriadIllustration(): Mismatched {argument}= and plant=; remove the plant= arg")
    if frame_id is not None and plant is not None:
        body = plant.GetBodyFromFrameId(frame_id)
    if frame_index is not None and plant is not None:
        frame = plant.get_frame(frame_index)
    frame = body.body_frame() if body is not None else frame
    plant = frame.GetParentPlant()
    is_body_frame = frame is frame.body().body_frame()
    X_BT = RigidTransform() if is_body_frame else frame.GetFixedPoseInBodyFrame()
    X_BT = X_BT @ X_FT if X_FT is not None else X_BT
    name = f"{frame.name()}({int(frame.model_instance())})" if name is None else name
    return _add_axes(scene_graph, plant, frame.body(), X_BT, name, length, radius, opacity, is_body_frame)


def _add_axes(
    scene_graph: SceneGraph,
    plant: MultibodyPlant,
    body: Any,
    X_BT: RigidTransform,
    name: str,
    length: float,
    radius: float,
    opacity: float,
    bright: bool,
) -> list[Any]:
    source, owner = plant.get_source_id(), plant.GetBodyFrameIdOrThrow(body.index())
    added = []
    for i, axis in enumerate(_AXES):
        middle = np.zeros(3)
        middle[i] = length / 2
        # A cylinder's axis is its z: turned about y onto x, about x onto y; the z axis is turned for the look only.
        R_TA = [
            RotationMatrix.MakeYRotation(np.pi / 2),
            RotationMatrix.MakeXRotation(np.pi / 2),
            RotationMatrix.MakeZRotation(np.pi / 2),
        ][i]
        color = np.zeros(4)
        color[i] = 1.0 if bright else _FIXED_FRAME_BRIGHTNESS
        color[3] = opacity
        shape = Cylinder(radius, length)
        instance = GeometryInstance(X_BT @ RigidTransform(R_TA, middle), shape, f"_frames::{name}::{axis}-axis")
        instance.set_illustration_properties(MakePhongIllustrationProperties(color))
        added.append(scene_graph.RegisterGeometry(source, owner, instance))
    return added
