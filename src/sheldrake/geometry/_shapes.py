"""The shapes: what a geometry looks like in its own frame G. Lengths in [m]."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch, in_order
from sheldrake.common._scalars import frozen
from sheldrake.common._text import arguments, number
from sheldrake.geometry._meshes.mesh_source import InMemoryMesh, MeshSource

if TYPE_CHECKING:
    from numpy.typing import ArrayLike
    from typing_extensions import Self

    from sheldrake.geometry._bounding import Obb
    from sheldrake.geometry._meshes.polygon_mesh import PolygonSurfaceMesh
    from sheldrake.math import RigidTransform


def _checked(shape: str, minimum_excluded: bool = True, **measures: float) -> tuple[float, ...]:
    """The measures as floats; they must be finite and positive (or not negative)."""
    for name, value in measures.items():
        try:
            value = float(value)
        except (TypeError, ValueError):
            raise TypeError(f"{shape}(): {name} must be a number, got {value!r}.") from None
        if not math.isfinite(value) or value < 0.0 or (minimum_excluded and value == 0.0):
            wanted = "positive" if minimum_excluded else "not negative"
            raise RuntimeError(f"{shape}(): {name} must be finite and {wanted}, got {number(value)}.")
    return tuple(float(value) for value in measures.values())


def _measures(shape: str, names: tuple[str, ...], args: tuple, kwargs: dict) -> dict[str, Any]:
    """Resolves `Shape(a, b, c)`, `Shape(a=..)` and `Shape(measures)`."""
    if "measures" in kwargs and not args and len(kwargs) == 1:
        args, kwargs = (kwargs["measures"],), {}
    if len(args) == 1 and not kwargs and np.ndim(args[0]) >= 1:
        values = np.asarray(args[0], dtype=float).reshape(-1)
        if values.size != len(names):
            raise TypeError(
                f"{shape}(): measures must have {len(names)} values ({', '.join(names)}), got {values.size}."
            )
        return dict(zip(names, values))
    if len(args) > len(names) or set(kwargs) - set(names[len(args) :]):
        raise Mismatch(f"{shape}(): incompatible constructor arguments; expected ({', '.join(names)}) or (measures).")
    given = {**dict(zip(names, args)), **kwargs}
    if len(given) != len(names):
        raise TypeError(f"{shape}(): missing {', '.join(n for n in names if n not in given)}.")
    return {name: given[name] for name in names}


def _given(shape: str, names: tuple[str, ...], args: tuple, kwargs: dict) -> tuple[float, ...]:
    """The measures of `Shape(a, b, c)`, `Shape(a=..)` or `Shape(measures)`, which must be finite and positive."""
    if len(args) == len(names) and not kwargs:  # nearly always
        if all([(type(x) is float or type(x) is int) and 0.0 < x < math.inf for x in args]):
            return tuple(map(float, args))
    return _checked(shape, **_measures(shape, names, args, kwargs))


class Shape:
    """Base of all shapes. Shapes do not change after construction."""

    _names: tuple[str, ...] = ()
    _box: Obb | None = None  # once it was asked for (`_bounding.bounding_box`)

    def Clone(self) -> Shape:
        """A copy."""
        return self.__copy__()

    def type_name(self) -> str:
        """The name of the class, e.g. `Box`."""
        return type(self).__name__

    def to_string(self) -> str:
        """The same as `repr()`."""
        return repr(self)

    def _values(self) -> tuple[float, ...]:
        return tuple(getattr(self, "_" + name) for name in self._names)

    def __copy__(self) -> Shape:
        return type(self)(*self._values())

    def __deepcopy__(self, memo: dict) -> Shape:
        return self.__copy__()

    def __repr__(self) -> str:
        return f"{type(self).__name__}({arguments(**dict(zip(self._names, self._values())))})"

    def __reduce__(self) -> tuple:
        return type(self), self._values()


class Sphere(Shape):
    """A sphere centred at Go; its radius may be zero (a point)."""

    _names = ("radius",)

    def __init__(self, radius: float) -> None:
        (self._radius,) = _checked("Sphere", minimum_excluded=False, radius=radius)

    def radius(self) -> float:
        """Radius [m]."""
        return self._radius


class Box(Shape):
    """A box centred at Go with its edges along the axes of G."""

    _names = ("width", "depth", "height")

    @overload
    def __init__(self, width: float, depth: float, height: float) -> None: ...
    @overload
    def __init__(self, measures: ArrayLike) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any) -> None:
        self._width, self._depth, self._height = _given("Box", self._names, args, kwargs)

    @classmethod
    def MakeCube(cls, edge_size: float) -> Box:
        """A cube with edges of length `edge_size` [m]."""
        return cls(edge_size, edge_size, edge_size)

    def width(self) -> float:
        """Length along Gx [m]."""
        return self._width

    def depth(self) -> float:
        """Length along Gy [m]."""
        return self._depth

    def height(self) -> float:
        """Length along Gz [m]."""
        return self._height

    def size(self) -> np.ndarray:
        """Lengths along Gx, Gy, Gz [m], shape (3,), read-only."""
        return frozen(np.array(self._values()))


class Cylinder(Shape):
    """A cylinder centred at Go with its axis along Gz."""

    _names = ("radius", "length")

    @overload
    def __init__(self, radius: float, length: float) -> None: ...
    @overload
    def __init__(self, measures: ArrayLike) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any) -> None:
        self._radius, self._length = _given("Cylinder", self._names, args, kwargs)

    def radius(self) -> float:
        """Radius [m]."""
        return self._radius

    def length(self) -> float:
        """Length along Gz [m]."""
        return self._length


class Capsule(Shape):
    """A cylinder with half-spherical caps, centred at Go with its axis along Gz."""

    _names = ("radius", "length")

    @overload
    def __init__(self, radius: float, length: float) -> None: ...
    @overload
    def __init__(self, measures: ArrayLike) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any) -> None:
        self._radius, self._length = _given("Capsule", self._names, args, kwargs)

    def radius(self) -> float:
        """Radius [m]."""
        return self._radius

    def length(self) -> float:
        """Length of the cylindrical part [m]; the caps add the radius at either end."""
        return self._length


class Ellipsoid(Shape):
    """An ellipsoid centred at Go with its semi-axes along the axes of G."""

    _names = ("a", "b", "c")

    @overload
    def __init__(self, a: float, b: float, c: float) -> None: ...
    @overload
    def __init__(self, measures: ArrayLike) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any) -> None:
        self._a, self._b, self._c = _given("Ellipsoid", self._names, args, kwargs)

    def a(self) -> float:
        """Semi-axis along Gx [m]."""
        return self._a

    def b(self) -> float:
        """Semi-axis along Gy [m]."""
        return self._b

    def c(self) -> float:
        """Semi-axis along Gz [m]."""
        return self._c


@checked
class HalfSpace(Shape):
    """Everything below the plane z = 0 of G; Gz points out of it."""

    @staticmethod
    def MakePose(Hz_dir_F: ArrayLike, p_FB: ArrayLike) -> RigidTransform:
        """The pose X_FH of a half space whose outward normal and a point on whose boundary are given.

        Args:
            Hz_dir_F: direction of the outward normal in F, any length above 1e-10, shape (3,).
            p_FB: a point on the boundary plane, in F [m], shape (3,).

        Raises:
            RuntimeError: the direction is (nearly) zero.
            TypeError: it is no vector.
        """
        from sheldrake.math import RigidTransform, RotationMatrix

        direction = np.asarray(Hz_dir_F, dtype=float)
        if direction.size != 3:
            raise Mismatch(f"HalfSpace.MakePose(): incompatible function arguments: Hz_dir_F is {Hz_dir_F!r}.")
        direction = direction.reshape(3)
        norm = float(np.linalg.norm(direction))
        if not norm >= 1e-10:
            raise RuntimeError(f"HalfSpace.MakePose(): Hz_dir_F must not be zero, got {direction.tolist()}.")
        Hz_F = direction / norm
        R_FH = RotationMatrix.MakeFromOneVector(Hz_F, 2).multiply(RotationMatrix.MakeZRotation(np.pi))
        return RigidTransform(R_FH, Hz_F * Hz_F.dot(np.asarray(p_FB, dtype=float).reshape(3)))


class MeshcatCone(Shape):
    """A cone for illustration only: apex at Go, axis along Gz, an ellipse (a, b) at z = height."""

    _names = ("height", "a", "b")

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        if "height" in kwargs or (len(args) == 1 and np.ndim(args[0]) == 0) or len(args) == 2:
            kwargs = {**{"a": 1.0, "b": 1.0}, **dict(zip(self._names, args)), **kwargs}
            args = ()
        values = _given("MeshcatCone", self._names, args, kwargs)
        self._height, self._a, self._b = values

    def height(self) -> float:
        """Height [m]."""
        return self._height

    def a(self) -> float:
        """Semi-axis of the base along Gx [m]."""
        return self._a

    def b(self) -> float:
        """Semi-axis of the base along Gy [m]."""
        return self._b


class _MeshShape(Shape):
    """What Mesh and Convex share: a source and a scale along each axis (negative mirrors)."""

    @checked
    def __init__(self, source: object, scale: float | ArrayLike) -> None:
        name = type(self).__name__
        self._source = _mesh_source(name, source)
        self._scale3 = np.broadcast_to(np.asarray(scale, dtype=float).reshape(-1), (3,)).copy()
        if not np.all(np.isfinite(self._scale3)) or np.any(np.abs(self._scale3) < 1e-8):
            given = " ".join(number(s) for s in self._scale3)
            raise RuntimeError(f"{name} |scale| cannot be < 1e-8 on any axis, given [{given}].")
        self._hull: PolygonSurfaceMesh | None = None

    def source(self) -> MeshSource:
        """Where the data comes from."""
        return self._source

    def extension(self) -> str:
        """Lower-case extension of the file, with its dot."""
        return self._source.extension()

    def scale3(self) -> np.ndarray:
        """Scale along each axis of G, shape (3,)."""
        return self._scale3.copy()

    def scale(self) -> float:
        """The scale if it is the same along all axes.

        Raises:
            RuntimeError: the scale differs between axes.
        """
        if not np.all(self._scale3 == self._scale3[0]):
            name = type(self).__name__
            given = " ".join(number(s) for s in self._scale3)
            raise RuntimeError(
                f"{name}::scale() can only be called for uniform scaling. This mesh has scale [{given}]. "
                f"Use {name}::scale3() instead."
            )
        return float(self._scale3[0])

    def GetConvexHull(self) -> PolygonSurfaceMesh:
        """The convex hull of the scaled vertices, computed at the first call.

        Raises:
            RuntimeError: the file is missing, of an unsupported kind, or has no solid hull.
        """
        if self._hull is None:
            from sheldrake.geometry._meshes.convex_hull import make_convex_hull_of_source

            self._hull = make_convex_hull_of_source(self._source, self._scale3)
        return self._hull

    def __copy__(self) -> Self:
        new = object.__new__(type(self))
        new.__dict__.update(self.__dict__)  # nothing of it changes
        return new

    @classmethod
    def _make(cls, source: object, scale: ArrayLike) -> Self:
        new = object.__new__(cls)
        _MeshShape.__init__(new, source, scale)
        return new

    def __reduce__(self) -> tuple:
        return _rebuild, (type(self), self._source, self._scale3)

    def __repr__(self) -> str:
        source = self._source
        data = f"filename={str(source.path())!r}" if source.is_path() else f"mesh_data={source.in_memory()!r}"
        return f"{type(self).__name__}({data}, scale3={self._scale3.tolist()!r})"


def _rebuild(cls: type[_MeshShape], source: MeshSource, scale3: np.ndarray) -> _MeshShape:
    return cls._make(source, scale3)


def _mesh_source(name: str, source: object) -> MeshSource:
    if isinstance(source, (InMemoryMesh, MeshSource)):
        return MeshSource(source)
    if not isinstance(source, (str, os.PathLike)):
        raise TypeError(f"{name}(): expected a file name, an InMemoryMesh or a MeshSource, got {source!r}.")
    if not os.fspath(source):
        raise RuntimeError(f"{name}(): the file name is empty.")
    return MeshSource(Path(source).absolute())


_SOURCE_NAMES = ("filename", "mesh_data", "source")


def _source_and_scale(name: str, args: tuple, kwargs: dict) -> tuple[Any, Any]:
    """Resolves the pydrake overloads (filename | mesh_data | source, scale | scale3)."""
    given = list(args)
    for key in (*_SOURCE_NAMES, "scale", "scale3"):
        if key in kwargs:
            given.append(kwargs[key])
    unknown = set(kwargs) - {*_SOURCE_NAMES, "scale", "scale3"}
    if unknown or not 1 <= len(given) <= 2:
        wanted = "(filename | mesh_data | source, scale=1.0 | scale3)"
        raise Mismatch(f"{name}(): incompatible constructor arguments; expected {wanted}.")
    scale = given[1] if len(given) == 2 else 1.0
    if np.size(scale) not in (1, 3):
        raise TypeError(f"{name}(): scale must be a number or have 3 values, got {np.size(scale)}.")
    return given[0], scale


class Mesh(_MeshShape):
    """A surface or volume mesh from a file. For point contact its convex hull counts."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*_source_and_scale("Mesh", args, kwargs))


class Convex(_MeshShape):
    """The convex hull of the vertices of a mesh file, or of a set of points.

    `Convex(filename | mesh_data | source, scale=1.0 | scale3)` or `Convex(points, label, scale=1.0 | scale3)` with
    points of shape (3, n) [m].
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        points = kwargs.get("points", args[0] if args else None)
        if isinstance(points, (str, os.PathLike, InMemoryMesh, MeshSource)) or points is None:
            super().__init__(*_source_and_scale("Convex", args, kwargs))
        else:
            given = in_order(("points", "label", "scale", "scale3"), args, kwargs, {"scale": 1.0, "scale3": None})
            if given is None or not isinstance(given[1], str):
                wanted = "(points, label: str, scale=1.0 | scale3)"
                raise Mismatch(f"Convex(): incompatible constructor arguments; expected {wanted}.")
            super().__init__(*_points_and_scale(*given))


def _points_and_scale(
    points: ArrayLike, label: str, scale: float | ArrayLike, scale3: ArrayLike | None
) -> tuple[InMemoryMesh, ArrayLike]:
    from sheldrake.common import MemoryFile

    p_GV = np.asarray(points, dtype=float)
    if p_GV.ndim != 2 or p_GV.shape[0] != 3:
        raise TypeError(f"Convex(): points must have shape (3, n), got {p_GV.shape}.")
    lines = "".join(f"v {number(x)} {number(y)} {number(z)}\n" for x, y, z in p_GV.T)
    data = MemoryFile(contents=lines.encode(), extension=".obj", filename_hint=label)
    return InMemoryMesh(mesh_file=data), scale if scale3 is None else scale3
