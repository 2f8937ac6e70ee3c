"""Shapes, their roles and properties, and the SceneGraph that knows where they are and which of them touch."""

from sheldrake.common._names import show_as_own
from sheldrake.systems.framework import LeafSystem_
from sheldrake.systems.framework._templates import SystemTemplate

from ._bounding import (
    Aabb,
    CalcObb,
    ComputeAabbForTriangleMesh,
    ComputeAabbForVolumeMesh,
    ComputeObbForTriangleMesh,
    ComputeObbForVolumeMesh,
    Obb,
    Plane,
)
from ._drake_visualizer import DrakeVisualizer, DrakeVisualizerParams
from ._frame_pose_vector import FramePoseVector, GeometryConfigurationVector
from ._ids import FilterId, FrameId, GeometryId, SourceId
from ._mass_properties import CalcVolume
from ._meshcat.animation import MeshcatAnimation
from ._meshcat.meshcat import Meshcat, StartMeshcat
from ._meshcat.params import MeshcatParams, MeshcatVisualizerParams, MeshcatVisualizerSurfaceVelocityData
from ._meshcat.point_cloud_visualizer import MeshcatPointCloudVisualizer
from ._meshcat.visualizer import MeshcatVisualizer
from ._meshes.mesh_fields import PolygonSurfaceMeshFieldLinear, TriangleSurfaceMeshFieldLinear, field_template
from ._meshes.mesh_source import InMemoryMesh, MeshSource
from ._meshes.polygon_mesh import PolygonSurfaceMesh, SurfacePolygon
from ._meshes.refine_mesh import RefineVolumeMesh, RefineVolumeMeshIntoVtkFileContents
from ._meshes.triangle_mesh import ReadObjToTriangleSurfaceMesh, SurfaceTriangle, TriangleSurfaceMesh
from ._meshes.volume_mesh import ConvertVolumeToSurfaceMesh, VolumeElement, VolumeMesh
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
from ._query.contact_surface import ContactSurface
from ._query.query_object import QueryObject
from ._query.results import PenetrationAsPointPair, RayIntersections, SignedDistancePair, SignedDistanceToPoint
from ._render.camera import ClippingRange, ColorRenderCamera, DepthRange, DepthRenderCamera, RenderCameraCore
from ._render.engine import RenderEngine
from ._render.label import RenderLabel
from ._render.make import (
    MakeRenderEngineGl,
    MakeRenderEngineGltfClient,
    MakeRenderEngineVtk,
    kHasRenderEngineGl,
    kHasRenderEngineGltfClient,
    kHasRenderEngineVtk,
)
from ._render.params import (
    EnvironmentMap,
    EquirectangularMap,
    GltfExtension,
    LightParameter,
    NullTexture,
    RenderEngineGlParams,
    RenderEngineGltfClientParams,
    RenderEngineVtkParams,
    SsaoParameter,
)
from ._rgba import Rgba
from ._roles import CollisionFilterScope, HydroelasticContactRepresentation, Role, RoleAssign
from ._scene_graph import SceneGraph
from ._shapes import Box, Capsule, Convex, Cylinder, Ellipsoid, HalfSpace, Mesh, MeshcatCone, Shape, Sphere
from ._state.collision_filter import CollisionFilterDeclaration, CollisionFilterManager
from ._state.config import DefaultProximityProperties, SceneGraphConfig
from ._state.geometry_set import GeometrySet
from ._state.inspector import SceneGraphInspector
from ._state.instance import GeometryFrame, GeometryInstance
from ._state.records import GeometryVersion

ContactSurface_ = SystemTemplate("ContactSurface_", ContactSurface, scope=__name__)
FramePoseVector_ = SystemTemplate("FramePoseVector_", FramePoseVector, scope=__name__)
GeometryConfigurationVector_ = SystemTemplate(
    "GeometryConfigurationVector_", GeometryConfigurationVector, scope=__name__
)
DrakeVisualizer_ = SystemTemplate("DrakeVisualizer_", DrakeVisualizer, scope=__name__, own=True, base=LeafSystem_)
MeshcatPointCloudVisualizer_ = SystemTemplate(
    "MeshcatPointCloudVisualizer_", MeshcatPointCloudVisualizer, scope=__name__, own=True, base=LeafSystem_
)
MeshcatVisualizer_ = SystemTemplate("MeshcatVisualizer_", MeshcatVisualizer, scope=__name__, own=True, base=LeafSystem_)
PenetrationAsPointPair_ = SystemTemplate("PenetrationAsPointPair_", PenetrationAsPointPair, scope=__name__)
Plane_ = SystemTemplate("Plane_", Plane, scope=__name__)
PolygonSurfaceMesh_ = SystemTemplate("PolygonSurfaceMesh_", PolygonSurfaceMesh, scope=__name__)
PolygonSurfaceMeshFieldLinear_ = field_template("PolygonSurfaceMeshFieldLinear_", PolygonSurfaceMeshFieldLinear)
QueryObject_ = SystemTemplate("QueryObject_", QueryObject, scope=__name__)
SceneGraphInspector_ = SystemTemplate("SceneGraphInspector_", SceneGraphInspector, scope=__name__)
SignedDistancePair_ = SystemTemplate("SignedDistancePair_", SignedDistancePair, scope=__name__)
SignedDistanceToPoint_ = SystemTemplate("SignedDistanceToPoint_", SignedDistanceToPoint, scope=__name__)
TriangleSurfaceMesh_ = SystemTemplate("TriangleSurfaceMesh_", TriangleSurfaceMesh, scope=__name__)
TriangleSurfaceMeshFieldLinear_ = field_template("TriangleSurfaceMeshFieldLinear_", TriangleSurfaceMeshFieldLinear)
VolumeMesh_ = SystemTemplate("VolumeMesh_", VolumeMesh, scope=__name__)
SceneGraph_ = SystemTemplate("SceneGraph_", SceneGraph, scope=__name__, own=True, base=LeafSystem_)

__all__ = [
    "Aabb",
    "AddCompliantHydroelasticProperties",
    "AddCompliantHydroelasticPropertiesForHalfSpace",
    "AddContactMaterial",
    "AddRigidHydroelasticProperties",
    "Box",
    "CalcObb",
    "CalcVolume",
    "Capsule",
    "ClippingRange",
    "CollisionFilterDeclaration",
    "CollisionFilterManager",
    "CollisionFilterScope",
    "ColorRenderCamera",
    "ComputeAabbForTriangleMesh",
    "ComputeAabbForVolumeMesh",
    "ComputeObbForTriangleMesh",
    "ComputeObbForVolumeMesh",
    "ContactSurface",
    "ContactSurface_",
    "ConvertVolumeToSurfaceMesh",
    "Convex",
    "Cylinder",
    "DefaultProximityProperties",
    "DepthRange",
    "DepthRenderCamera",
    "DrakeVisualizer",
    "DrakeVisualizerParams",
    "DrakeVisualizer_",
    "Ellipsoid",
    "EnvironmentMap",
    "EquirectangularMap",
    "FilterId",
    "FrameId",
    "FramePoseVector",
    "FramePoseVector_",
    "GeometryConfigurationVector",
    "GeometryConfigurationVector_",
    "GeometryFrame",
    "GeometryId",
    "GeometryInstance",
    "GeometryProperties",
    "GeometrySet",
    "GeometryVersion",
    "GltfExtension",
    "HalfSpace",
    "HydroelasticContactRepresentation",
    "IllustrationProperties",
    "InMemoryMesh",
    "LightParameter",
    "MakePhongIllustrationProperties",
    "MakeRenderEngineGl",
    "MakeRenderEngineGltfClient",
    "MakeRenderEngineVtk",
    "Mesh",
    "MeshSource",
    "Meshcat",
    "MeshcatAnimation",
    "MeshcatCone",
    "MeshcatParams",
    "MeshcatPointCloudVisualizer",
    "MeshcatPointCloudVisualizer_",
    "MeshcatVisualizer",
    "MeshcatVisualizerParams",
    "MeshcatVisualizerSurfaceVelocityData",
    "MeshcatVisualizer_",
    "NullTexture",
    "Obb",
    "PenetrationAsPointPair",
    "PenetrationAsPointPair_",
    "PerceptionProperties",
    "Plane",
    "Plane_",
    "PolygonSurfaceMesh",
    "PolygonSurfaceMeshFieldLinear",
    "PolygonSurfaceMeshFieldLinear_",
    "PolygonSurfaceMesh_",
    "ProximityProperties",
    "QueryObject",
    "QueryObject_",
    "RayIntersections",
    "ReadObjToTriangleSurfaceMesh",
    "RefineVolumeMesh",
    "RefineVolumeMeshIntoVtkFileContents",
    "RenderCameraCore",
    "RenderEngine",
    "RenderEngineGlParams",
    "RenderEngineGltfClientParams",
    "RenderEngineVtkParams",
    "RenderLabel",
    "Rgba",
    "Role",
    "RoleAssign",
    "SceneGraph",
    "SceneGraphConfig",
    "SceneGraphInspector",
    "SceneGraphInspector_",
    "SceneGraph_",
    "Shape",
    "SignedDistancePair",
    "SignedDistancePair_",
    "SignedDistanceToPoint",
    "SignedDistanceToPoint_",
    "SourceId",
    "Sphere",
    "SsaoParameter",
    "StartMeshcat",
    "SurfacePolygon",
    "SurfaceTriangle",
    "TriangleSurfaceMesh",
    "TriangleSurfaceMeshFieldLinear",
    "TriangleSurfaceMeshFieldLinear_",
    "TriangleSurfaceMesh_",
    "VolumeElement",
    "VolumeMesh",
    "VolumeMesh_",
    "kHasRenderEngineGl",
    "kHasRenderEngineGltfClient",
    "kHasRenderEngineVtk",
]

show_as_own(globals())
