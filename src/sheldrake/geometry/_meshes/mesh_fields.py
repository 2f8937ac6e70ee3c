"""Linear fields on the faces of surface meshes."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._no_constructor import no_constructor
from sheldrake.common._scalars import scalar_types
from sheldrake.common.cpp_template import TemplateClass
from sheldrake.geometry._numbers import as_numbers, plain

from .polygon_mesh import PolygonSurfaceMesh, _index
from .triangle_mesh import TriangleSurfaceMesh

if TYPE_CHECKING:
    from typing_extensions import Self

    from sheldrake.common._types import Scalars


@no_constructor("Fields come with a ContactSurface.")
class _FieldLinear:
    """A number per vertex of a mesh, linear on every face."""

    _mesh: Any
    _values: np.ndarray
    _gradients: Any

    @classmethod
    def _make(cls, mesh: Any, values: np.ndarray, gradients: np.ndarray | None = None) -> Self:
        new = object.__new__(cls)
        new._mesh, new._values, new._gradients = mesh, values, gradients
        return new

    def EvaluateAtVertex(self, v: int) -> float:
        """The value at a vertex."""
        return plain(self._values[_index("EvaluateAtVertex", v, self._values)])


class PolygonSurfaceMeshFieldLinear(_FieldLinear):
    """A linear field on a mesh of polygons, with its gradient."""

    _mesh: PolygonSurfaceMesh

    def EvaluateCartesian(self, e: int, p_MQ: Scalars) -> float:
        """The value at point Q, in M [m], of the linear function of face `e`."""
        first = self._mesh._faces[_index("EvaluateCartesian", e, self._mesh._faces)][0]
        offset = as_numbers(p_MQ).reshape(3) - self._mesh._vertices[first]
        return plain(self._values[first] + self._gradients[e] @ offset)

    def EvaluateGradient(self, e: int) -> np.ndarray:
        """Gradient on face `e`, in M, shape (3,)."""
        return self._gradients[_index("EvaluateGradient", e, self._gradients)].copy()


class TriangleSurfaceMeshFieldLinear(_FieldLinear):
    """A linear field on a mesh of triangles."""

    _mesh: TriangleSurfaceMesh

    def Evaluate(self, e: int, b: Scalars) -> float:
        """The value at barycentric coordinates, shape (3,), of triangle `e`."""
        corners = self._mesh._triangles[_index("Evaluate", e, self._mesh._triangles)]
        return plain(as_numbers(b).reshape(3) @ self._values[corners])

    def EvaluateCartesian(self, e: int, p_MQ: Scalars) -> float:
        """The value on triangle `e` at the projection of point Q, in M [m], into its plane."""
        _index("EvaluateCartesian", e, self._mesh._triangles)
        return self.Evaluate(e, self._mesh.CalcBarycentric(p_MQ, e))


class _FieldTemplate(TemplateClass):
    """`Field_[T, T]`: one class for all scalars, as the scalar belongs to the numbers."""

    def __init__(self, name: str, cls: type) -> None:
        super().__init__(name, scope=sys.modules[__package__ or ""])
        self._class = cls
        self.add_instantiation((float, float), cls, skip_rename=True)
        self.__doc__ = f"The class {cls.__name__} for each pair of scalar types."

    def get_instantiation(self, param: Any = None, throw_error: bool = True) -> tuple[Any, tuple]:
        """See `TemplateBase.get_instantiation`."""
        if isinstance(param, tuple) and len(param) == 2 and param[0] is param[1]:
            if param not in self._instantiation_map and param[0] in scalar_types()[:2]:
                self.add_instantiation(param, self._class, skip_rename=True)
        return super().get_instantiation(param, throw_error)


def field_template(name: str, cls: type) -> TemplateClass:
    """The family of a field class, indexed by the scalars of its values and of its mesh."""
    return _FieldTemplate(name, cls)
