"""Point clouds, how depth images become them, and how other processes get them."""

from sheldrake.common._names import show_as_own
from sheldrake.geometry._point_cloud import BaseField, Concatenate, Fields, PointCloud

from ._depth_image_to_point_cloud import DepthImageToPointCloud
from ._point_cloud_to_lcm import PointCloudToLcm

__all__ = ["BaseField", "Concatenate", "DepthImageToPointCloud", "Fields", "PointCloud", "PointCloudToLcm"]

show_as_own(globals())
