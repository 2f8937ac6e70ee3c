"""Every public name of `sheldrake.geometry` and its modules.

Made by tools/make_stubs.py.
"""

from typing import Any

from sheldrake.geometry import *
from sheldrake.geometry.optimization import *

AddSoftHydroelasticProperties: Any
AddSoftHydroelasticPropertiesForHalfSpace: Any
CalcPairwiseIntersections: Any
CameraProperties: Any
ConnectDrakeVisualizer: Any
DepthCameraProperties: Any
IrisInConfigurationSpace: Any
MeshcatPointCloudVisualizerCpp: Any
MeshcatVisualizerCpp: Any
ReadObjToSurfaceMesh: Any
SurfaceFace = SurfaceTriangle
SurfaceMesh = TriangleSurfaceMesh
SurfaceVertex: Any
