"""From positions of a plant to poses of its geometry."""

from sheldrake.common._names import show_as_own

from ._multibody_position_to_geometry_pose import MultibodyPositionToGeometryPose

__all__ = ["MultibodyPositionToGeometryPose"]

show_as_own(globals())
