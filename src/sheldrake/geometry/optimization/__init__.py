"""Convex sets, and programs about them."""

from sheldrake.geometry.optimization._affine_subspace import AffineSubspace
from sheldrake.geometry.optimization._composed_sets import CartesianProduct, ConvexHull, Intersection, MinkowskiSum
from sheldrake.geometry.optimization._convex_set import ConvexSet, SampledVolume
from sheldrake.geometry.optimization._ellipsoids import AffineBall, Hyperellipsoid
from sheldrake.geometry.optimization._hpolyhedron import HPolyhedron
from sheldrake.geometry.optimization._hyperrectangle import Hyperrectangle
from sheldrake.geometry.optimization._point import Point
from sheldrake.geometry.optimization._spectrahedron import Spectrahedron
from sheldrake.geometry.optimization._vpolytope import VPolytope

__all__ = [
    "AffineBall",
    "AffineSubspace",
    "CartesianProduct",
    "ConvexHull",
    "ConvexSet",
    "HPolyhedron",
    "Hyperellipsoid",
    "Hyperrectangle",
    "Intersection",
    "MinkowskiSum",
    "Point",
    "SampledVolume",
    "Spectrahedron",
    "VPolytope",
]

for _name in __all__:
    globals()[_name].__module__ = __name__
