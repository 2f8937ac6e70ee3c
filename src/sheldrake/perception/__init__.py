"""Point clouds, and how depth images become them."""

from sheldrake.geometry._point_cloud import BaseField, Concatenate, Fields, PointCloud

from ._depth_image_to_point_cloud import DepthImageToPointCloud

__all__ = ["BaseField", "Concatenate", "DepthImageToPointCloud", "Fields", "PointCloud"]
