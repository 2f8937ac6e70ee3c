"""From positions of a plant to poses of its geometry."""

from ._multibody_position_to_geometry_pose import MultibodyPositionToGeometryPose

__all__ = ["MultibodyPositionToGeometryPose"]
