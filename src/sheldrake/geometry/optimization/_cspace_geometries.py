"""Collision geometries and the planes that separate them, as C-IRIS sees them."""

from __future__ import annotations

import itertools
import sys
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._enums import BoundEnum
from sheldrake.common._no_constructor import no_constructor
from sheldrake.common.cpp_template import TemplateClass
from sheldrake.geometry import Box, Capsule, Convex, Cylinder, GeometryId, Mesh, Shape, Sphere
from sheldrake.geometry.optimization._vpolytope import VPolytope
from sheldrake.math import RigidTransform
from sheldrake.symbolic import Variable

if TYPE_CHECKING:
    from sheldrake.multibody.tree import BodyIndex


class PlaneSide(BoundEnum):
    """On which side of a plane a geometry is: where a x + b is positive, or negative."""

    kPositive = 0
    kNegative = 1


class SeparatingPlaneOrder(BoundEnum):
    """How the plane a x + b = 0 depends on s: a and b are affine in it."""

    kAffine = 1


class CIrisGeometryType(BoundEnum):
    """Kinds of collision geometries; boxes, convex hulls and meshes are polytopes."""

    kSphere = 0
    kPolytope = 1
    kCylinder = 2
    kCapsule = 3


class Condition(NamedTuple):
    """What holds for a geometry with a x + b positive: a point is above a margin, or above a cone.

    Attributes:
        p_G: The point, in the geometry's frame [m].
        arms_G: With no arms, a p + b >= 1; else a p + b >= |a arms|, shape (3, k) [m].
    """

    p_G: np.ndarray
    arms_G: np.ndarray


_NO_ARMS = np.zeros((3, 0))
_AXIS = np.array([0.0, 0.0, 1.0])


def _conditions(shape: Shape) -> tuple[CIrisGeometryType, list[Condition]]:
    if isinstance(shape, (Box, Convex, Mesh)):
        return CIrisGeometryType.kPolytope, [Condition(v, _NO_ARMS) for v in _vertices(shape)]
    above = Condition(np.zeros(3), _NO_ARMS)
    if isinstance(shape, Sphere):
        return CIrisGeometryType.kSphere, [Condition(np.zeros(3), shape.radius() * np.eye(3)), above]
    if isinstance(shape, (Capsule, Cylinder)):
        arms = shape.radius() * np.eye(3)[:, : 3 if isinstance(shape, Capsule) else 2]
        ends = [Condition(sign * 0.5 * shape.length() * _AXIS, arms) for sign in (1.0, -1.0)]
        kind = CIrisGeometryType.kCapsule if isinstance(shape, Capsule) else CIrisGeometryType.kCylinder
        return kind, [*ends, above]
    raise RuntimeError(
        f"CspaceFreePolytope(): shape {shape!r} is not supported; Box, Capsule, Convex, Cylinder, Mesh and Sphere are."
    )


def _vertices(shape: Any) -> np.ndarray:
    if isinstance(shape, Box):
        return np.array(list(itertools.product((-0.5, 0.5), repeat=3))) * shape.size()
    hull = shape.GetConvexHull()
    return (
        VPolytope(np.array([hull.vertex(i) for i in range(hull.num_vertices())]).T)
        .GetMinimalRepresentation()
        .vertices()
        .T
    )


@no_constructor()
class CIrisCollisionGeometry:
    """A collision geometry of a body; `CspaceFreePolytope` makes them."""

    @classmethod
    def _of(cls, shape: Shape, body_index: BodyIndex, id: GeometryId, X_BG: RigidTransform) -> CIrisCollisionGeometry:
        out = object.__new__(cls)
        out._shape, out._body, out._id, out._X_BG = shape, body_index, id, X_BG
        out._type, out._conditions = _conditions(shape)
        return out

    _shape: Shape
    _body: Any
    _id: GeometryId
    _X_BG: RigidTransform
    _type: CIrisGeometryType
    _conditions: list[Condition]

    def type(self) -> CIrisGeometryType:
        """Returns its kind."""
        return self._type

    def geometry(self) -> Shape:
        """Returns its shape."""
        return self._shape

    def body_index(self) -> BodyIndex:
        """Returns the body it is fixed to."""
        return self._body

    def id(self) -> GeometryId:
        """Returns its id."""
        return self._id

    def X_BG(self) -> RigidTransform:
        """Returns its pose on the body."""
        return self._X_BG

    def num_rationals(self) -> int:
        """Returns how many rational functions are not negative where it is on its side of a plane."""
        return len(self._conditions)


@no_constructor()
class CSpaceSeparatingPlane:
    """A plane a x + b = 0 that is to separate two geometries; `CspaceFreePolytope` makes them.

    Attributes:
        a: Polynomials in s with decision variables as coefficients, shape (3,).
        b: A polynomial of the same kind.
        positive_side_geometry: The geometry where a x + b is positive.
        negative_side_geometry: The other one.
        expressed_body: The body in whose frame x is.
        plane_degree: Degree of a and b.
        decision_variables: The coefficients.
    """

    a: np.ndarray
    b: Any
    positive_side_geometry: CIrisCollisionGeometry
    negative_side_geometry: CIrisCollisionGeometry
    expressed_body: Any
    plane_degree: int
    decision_variables: np.ndarray


class _PlaneOfVariables(CSpaceSeparatingPlane):
    """A plane whose coefficients are decision variables."""


CSpaceSeparatingPlane_ = TemplateClass("CSpaceSeparatingPlane_", scope=sys.modules["sheldrake.geometry.optimization"])
CSpaceSeparatingPlane_.add_instantiation(float, CSpaceSeparatingPlane, skip_rename=True)
CSpaceSeparatingPlane_.add_instantiation(Variable, _PlaneOfVariables)
CSpaceSeparatingPlane_.__doc__ = "A separating plane with numbers or variables as coefficients."
