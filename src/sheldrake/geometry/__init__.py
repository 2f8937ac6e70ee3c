"""Shapes, their roles and properties, and the SceneGraph that knows where they are and which of them touch."""

from ._collision_filter import CollisionFilterDeclaration, CollisionFilterManager
from ._config import DefaultProximityProperties, SceneGraphConfig
from ._frame_pose_vector import FramePoseVector, GeometryConfigurationVector
from ._geometry_set import GeometrySet
from ._ids import FilterId, FrameId, GeometryId, SourceId
from ._instance import GeometryFrame, GeometryInstance
from ._mass_properties import CalcVolume
from ._mesh_source import InMemoryMesh, MeshSource
from ._meshcat import Meshcat, StartMeshcat
from ._meshcat_animation import MeshcatAnimation
from ._meshcat_params import MeshcatParams, MeshcatVisualizerParams
from ._polygon_mesh import PolygonSurfaceMesh, SurfacePolygon
from ._properties import (
    GeometryProperties,
    IllustrationProperties,
    MakePhongIllustrationProperties,
    PerceptionProperties,
    ProximityProperties,
)
from ._proximity_properties import (
    AddCompliantHydroelasticProperties,
    AddCompliantHydroelasticPropertiesForHalfSpace,
    AddContactMaterial,
    AddRigidHydroelasticProperties,
)
from ._render_label import RenderLabel
from ._rgba import Rgba
from ._roles import CollisionFilterScope, HydroelasticContactRepresentation, Role, RoleAssign
from ._shapes import Box, Capsule, Convex, Cylinder, Ellipsoid, HalfSpace, Mesh, MeshcatCone, Shape, Sphere
from ._triangle_mesh import ReadObjToTriangleSurfaceMesh, SurfaceTriangle, TriangleSurfaceMesh
from ._volume_mesh import ConvertVolumeToSurfaceMesh, VolumeElement, VolumeMesh

__all__ = [
    "AddCompliantHydroelasticProperties",
    "AddCompliantHydroelasticPropertiesForHalfSpace",
    "AddContactMaterial",
    "AddRigidHydroelasticProperties",
    "Box",
    "CalcVolume",
    "Capsule",
    "CollisionFilterDeclaration",
    "CollisionFilterManager",
    "CollisionFilterScope",
    "ConvertVolumeToSurfaceMesh",
    "Convex",
    "Cylinder",
    "DefaultProximityProperties",
    "Ellipsoid",
    "FilterId",
    "FrameId",
    "FramePoseVector",
    "GeometryConfigurationVector",
    "GeometryFrame",
    "GeometryId",
    "GeometryInstance",
    "GeometryProperties",
    "GeometrySet",
    "HalfSpace",
    "HydroelasticContactRepresentation",
    "IllustrationProperties",
    "InMemoryMesh",
    "MakePhongIllustrationProperties",
    "Mesh",
    "MeshSource",
    "Meshcat",
    "MeshcatAnimation",
    "MeshcatCone",
    "MeshcatParams",
    "MeshcatVisualizerParams",
    "PerceptionProperties",
    "PolygonSurfaceMesh",
    "ProximityProperties",
    "ReadObjToTriangleSurfaceMesh",
    "RenderLabel",
    "Rgba",
    "Role",
    "RoleAssign",
    "SceneGraphConfig",
    "Shape",
    "SourceId",
    "Sphere",
    "StartMeshcat",
    "SurfacePolygon",
    "SurfaceTriangle",
    "TriangleSurfaceMesh",
    "VolumeElement",
    "VolumeMesh",
]
