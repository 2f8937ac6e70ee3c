"""Convex sets, and programs about them."""

from sheldrake.common._names import show_as_own
from sheldrake.geometry.optimization._affine_subspace import AffineSubspace
from sheldrake.geometry.optimization._angles import (
    CheckIfSatisfiesConvexityRadius,
    ComputePairwiseIntersections,
    PartitionConvexSet,
)
from sheldrake.geometry.optimization._composed_sets import CartesianProduct, ConvexHull, Intersection, MinkowskiSum
from sheldrake.geometry.optimization._convex_set import ConvexSet, SampledVolume
from sheldrake.geometry.optimization._cspace_certificates import (
    SeparationCertificateProgramBase,
    SeparationCertificateResultBase,
)
from sheldrake.geometry.optimization._cspace_free_polytope import (
    CspaceFreePolytope,
    CspaceFreePolytopeBase,
    FindSeparationCertificateOptions,
)
from sheldrake.geometry.optimization._cspace_geometries import (
    CIrisCollisionGeometry,
    CIrisGeometryType,
    CSpaceSeparatingPlane,
    CSpaceSeparatingPlane_,
    PlaneSide,
    SeparatingPlaneOrder,
)
from sheldrake.geometry.optimization._ellipsoids import AffineBall, Hyperellipsoid
from sheldrake.geometry.optimization._graph_of_convex_sets import (
    GcsGraphvizOptions,
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
)
from sheldrake.geometry.optimization._hpolyhedron import HPolyhedron
from sheldrake.geometry.optimization._hyperrectangle import Hyperrectangle
from sheldrake.geometry.optimization._implicit_graph import (
    ImplicitGraphOfConvexSets,
    ImplicitGraphOfConvexSetsFromExplicit,
)
from sheldrake.geometry.optimization._iris import Iris, IrisOptions, MakeIrisObstacles
from sheldrake.geometry.optimization._iris_np import IrisNp
from sheldrake.geometry.optimization._point import Point
from sheldrake.geometry.optimization._regions_yaml import LoadIrisRegionsYamlFile, SaveIrisRegionsYamlFile
from sheldrake.geometry.optimization._spectrahedron import Spectrahedron
from sheldrake.geometry.optimization._vpolytope import VPolytope

__all__ = [
    "AffineBall",
    "AffineSubspace",
    "CIrisCollisionGeometry",
    "CIrisGeometryType",
    "CSpaceSeparatingPlane",
    "CSpaceSeparatingPlane_",
    "CartesianProduct",
    "CheckIfSatisfiesConvexityRadius",
    "ComputePairwiseIntersections",
    "ConvexHull",
    "ConvexSet",
    "CspaceFreePolytope",
    "CspaceFreePolytopeBase",
    "FindSeparationCertificateOptions",
    "GcsGraphvizOptions",
    "GraphOfConvexSets",
    "GraphOfConvexSetsOptions",
    "HPolyhedron",
    "Hyperellipsoid",
    "Hyperrectangle",
    "ImplicitGraphOfConvexSets",
    "ImplicitGraphOfConvexSetsFromExplicit",
    "Intersection",
    "Iris",
    "IrisNp",
    "IrisOptions",
    "LoadIrisRegionsYamlFile",
    "MakeIrisObstacles",
    "MinkowskiSum",
    "PartitionConvexSet",
    "PlaneSide",
    "Point",
    "SampledVolume",
    "SaveIrisRegionsYamlFile",
    "SeparatingPlaneOrder",
    "SeparationCertificateProgramBase",
    "SeparationCertificateResultBase",
    "Spectrahedron",
    "VPolytope",
]

show_as_own(globals())
