"""The acrobot as a MultibodyPlant: two links, a motor at the elbow."""

from __future__ import annotations

from sheldrake.geometry import Cylinder, SceneGraph, Sphere
from sheldrake.math import RigidTransform
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import FixedOffsetFrame, RevoluteJoint, RigidBody, SpatialInertia, UnitInertia

__all__ = ["AcrobotParameters", "MakeAcrobotPlant"]


class AcrobotParameters:
    """Numbers of the acrobot: each link hangs down from its joint; its mass lies on its middle line."""

    def __init__(self) -> None:
        self._masses = 1.0, 1.0  # [kg]
        self._lengths = 1.0, 2.0  # [m]
        self._com_distances = 0.5, 1.0  # from the joints [m]
        self._central_moments = 0.083, 0.33  # across the links [kg m²]
        self._radii = 0.035, 0.07  # of the drawing [m]


def MakeAcrobotPlant(
    default_parameters: AcrobotParameters, finalize: bool, scene_graph: SceneGraph | None = None
) -> MultibodyPlant:
    """Returns a continuous plant of an acrobot that turns about the y-axis; both angles are zero when it hangs down.

    Args:
        default_parameters: Its numbers.
        finalize: Whether the plant is finalized.
        scene_graph: Where the links are drawn, if given.
    """
    plant = MultibodyPlant(0.0)
    if scene_graph is not None:
        plant.RegisterAsSourceForSceneGraph(scene_graph)
    upper, lower = (_add_link(plant, f"Link{i + 1}", default_parameters, i) for i in range(2))
    if scene_graph is not None:
        plant.RegisterVisualGeometry(plant.world_body(), RigidTransform(), Sphere(0.125), "visual")
    axis = [0.0, 1.0, 0.0]
    plant.AddJoint(RevoluteJoint("ShoulderJoint", plant.world_frame(), upper.body_frame(), axis))
    end = RigidTransform([0.0, 0.0, -default_parameters._lengths[0]])
    elbow_frame = plant.AddFrame(FixedOffsetFrame("ElbowJoint_parent", upper.body_frame(), end))
    elbow = plant.AddJoint(RevoluteJoint("ElbowJoint", elbow_frame, lower.body_frame(), axis))
    plant.AddJointActuator("ElbowActuator", elbow)
    if finalize:
        plant.Finalize()
    return plant


def _add_link(plant: MultibodyPlant, name: str, parameters: AcrobotParameters, i: int) -> RigidBody:
    mass, length, distance = parameters._masses[i], parameters._lengths[i], parameters._com_distances[i]
    across = parameters._central_moments[i] / mass + distance**2
    inertia = SpatialInertia(mass, [0.0, 0.0, -distance], UnitInertia(across, across, 0.0))
    link = plant.AddRigidBody(name, inertia)
    if plant.geometry_source_is_registered():
        X_BG = RigidTransform([0.0, 0.0, -0.5 * length])
        plant.RegisterVisualGeometry(link, X_BG, Cylinder(parameters._radii[i], length), "visual")
    return link
