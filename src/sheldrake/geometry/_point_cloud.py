"""Point clouds. They are public in sheldrake.perception; the viewer, on this floor, draws them."""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import expect
from sheldrake.common.value import _register_value_type
from sheldrake.geometry._kernels.nearest import DEPTH, divide_points, find_nearest
from sheldrake.geometry._kernels.planes import normals_of_planes

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.common import Parallelism

_PUBLIC = "sheldrake.perception"


class BaseField(enum.IntEnum):
    """What a point cloud tells of its points; combine with `|`."""

    kNone = 0
    kXYZs = 2
    kNormals = 4
    kRGBs = 8

    def __str__(self) -> str:
        return f"BaseField.{self.name}"


@checked
class Fields:
    """A set of BaseFields.

    Args:
        base_fields: BaseFields, combined with `|`.

    Raises:
        RuntimeError: when it is no such combination.
    """

    __hash__ = None  # type: ignore[assignment]

    def __init__(self, base_fields: int):
        value = int(base_fields)
        if not 0 <= value < 16:
            raise RuntimeError(f"Fields(): {value} is no combination of BaseField's kXYZs, kNormals and kRGBs.")
        self._bits = value

    def base_fields(self) -> int:
        """Returns the BaseFields as one number."""
        return self._bits

    def has_base_fields(self) -> bool:
        """Returns whether there are any."""
        return self._bits != 0

    def __or__(self, other: Fields) -> Fields:
        return Fields(self._bits | other._bits) if isinstance(other, Fields) else NotImplemented

    def __and__(self, other: Fields) -> Fields:
        return Fields(self._bits & other._bits) if isinstance(other, Fields) else NotImplemented

    def __eq__(self, other: object) -> bool:
        return self._bits == other._bits if isinstance(other, Fields) else NotImplemented

    def __repr__(self) -> str:
        return f"Fields(base_fields={self._bits})"


_COLUMNS = {BaseField.kXYZs: np.float32, BaseField.kNormals: np.float32, BaseField.kRGBs: np.uint8}
_NAMES = {BaseField.kXYZs: "xyzs", BaseField.kNormals: "normals", BaseField.kRGBs: "rgbs"}


_MOST_NUMBERS = 2**62


def _unset(field: BaseField, size: int) -> np.ndarray:
    """Returns what new points have, shape (size, 3): NaN, or black."""
    dtype = _COLUMNS[field]
    return np.full((size, 3), np.nan if dtype is np.float32 else 0, dtype)


@checked
class PointCloud:
    """Points with positions, normals and colors, as far as its fields say. New points are NaN, and black.

    Either `PointCloud(new_size=0, fields=Fields(BaseField.kXYZs))` or `PointCloud(other)`, a copy.

    Args:
        new_size: Number of points.
        fields: What it tells of them.
        other: A cloud to copy.

    Raises:
        RuntimeError: when the size is negative or there are no fields.
        TypeError: when the arguments are of other types.
    """

    T: ClassVar[type] = np.float32
    D: ClassVar[type] = np.float32
    C: ClassVar[type] = np.uint8
    kDefaultValue: ClassVar[float] = float("nan")

    def __init__(self, *args: Any, **kwargs: Any):
        names = ["other"] if "other" in kwargs or (args and isinstance(args[0], PointCloud)) else ["new_size", "fields"]
        given = {**dict(zip([n for n in names if n not in kwargs], args)), **kwargs}
        other, size = given.get("other"), given.get("new_size", 0)
        fields = given.get("fields", Fields(BaseField.kXYZs)) if other is None else other.fields()
        right = len(args) + len(kwargs) == len(given) and set(given) <= set(names) and isinstance(fields, Fields)
        if not right or isinstance(size, bool) or not isinstance(size, (int, np.integer)):
            found = ", ".join(type(value).__name__ for value in (*args, *kwargs.values()))
            raise TypeError(f"PointCloud(): expected (new_size, fields) or (other), got {found}.")
        if not fields.has_base_fields():
            raise RuntimeError("PointCloud(): Cannot construct a PointCloud without fields")
        self._size = 0 if other is None else other._size
        # Stored by point, shown by column: columns are then contiguous, as in Drake.
        self._data: dict[BaseField, np.ndarray] = {}
        for field in _COLUMNS:
            if int(field) & fields.base_fields():
                self._data[field] = _unset(field, 0) if other is None else other._data[field].copy()
        self._bits = fields.base_fields()
        if other is None:
            self.resize(int(size))

    @staticmethod
    def IsDefaultValue(value: float) -> bool:
        """Returns whether a number is that of a new point: NaN."""
        return bool(np.isnan(value))

    @staticmethod
    def IsInvalidValue(value: float) -> bool:
        """Returns whether a number is no place: NaN or infinite."""
        return not np.isfinite(value)

    def fields(self) -> Fields:
        """Returns what it tells of its points."""
        return Fields(self._bits)

    def size(self) -> int:
        """Returns the number of points."""
        return self._size

    def resize(self, new_size: int) -> None:
        """Changes the number of points; those that stay keep their values.

        Raises:
            RuntimeError: when the size is negative.
        """
        if new_size < 0:
            raise RuntimeError(f"PointCloud.resize(): the size must not be negative, got {new_size}.")
        for field, data in self._data.items():
            kept = data[:new_size]
            self._data[field] = np.concatenate([kept, _unset(field, new_size - len(kept))])
        self._size = int(new_size)

    def SetFields(self, new_fields: Fields, skip_initialize: bool = False) -> None:
        """Changes what it tells of its points; fields that stay keep their values.

        Raises:
            RuntimeError: when there are no fields.
        """
        if not expect("SetFields", new_fields, Fields).has_base_fields():
            raise RuntimeError("PointCloud.SetFields(): Cannot construct a PointCloud without fields")
        self._bits = new_fields.base_fields()
        wanted = [field for field in _COLUMNS if int(field) & self._bits]
        self._data = {f: self._data[f] if f in self._data else _unset(f, self._size) for f in wanted}

    def SetFrom(self, other: PointCloud) -> None:
        """Makes it a copy of another cloud."""
        self._size, self._bits = expect("SetFrom", other, PointCloud)._size, other._bits
        self._data = {field: data.copy() for field, data in other._data.items()}

    def _of(self, call: str, field: BaseField, writable: bool = False) -> np.ndarray:
        if field not in self._data:
            raise RuntimeError(f"PointCloud.{call}(): it has no {_NAMES[field]}; its fields are {self.fields()}.")
        view = self._data[field].T.view()
        view.flags.writeable = writable
        return view

    def _at(self, call: str, field: BaseField, i: int, writable: bool = False) -> np.ndarray:
        if not 0 <= i < self._size:
            raise RuntimeError(f"PointCloud.{call}(): point {i} is not one of {self._size}.")
        column = self._of(call, field, writable)[:, i]
        return column if writable else column.copy()

    def has_xyzs(self) -> bool:
        """Returns whether points have positions."""
        return BaseField.kXYZs in self._data

    def xyzs(self) -> np.ndarray:
        """Returns the positions [m], shape (3, n), a view to read."""
        return self._of("xyzs", BaseField.kXYZs)

    def mutable_xyzs(self) -> np.ndarray:
        """Returns the positions [m], shape (3, n), a view to write through."""
        return self._of("mutable_xyzs", BaseField.kXYZs, True)

    def xyz(self, i: int) -> np.ndarray:
        """Returns the position of point i [m], shape (3,), a copy."""
        return self._at("xyz", BaseField.kXYZs, i)

    def mutable_xyz(self, i: int) -> np.ndarray:
        """Returns the position of point i [m], shape (3,), a view to write through."""
        return self._at("mutable_xyz", BaseField.kXYZs, i, True)

    def has_normals(self) -> bool:
        """Returns whether points have normals."""
        return BaseField.kNormals in self._data

    def normals(self) -> np.ndarray:
        """Returns the normals, shape (3, n), a view to read."""
        return self._of("normals", BaseField.kNormals)

    def mutable_normals(self) -> np.ndarray:
        """Returns the normals, shape (3, n), a view to write through."""
        return self._of("mutable_normals", BaseField.kNormals, True)

    def normal(self, i: int) -> np.ndarray:
        """Returns the normal of point i, shape (3,), a copy."""
        return self._at("normal", BaseField.kNormals, i)

    def mutable_normal(self, i: int) -> np.ndarray:
        """Returns the normal of point i, shape (3,), a view to write through."""
        return self._at("mutable_normal", BaseField.kNormals, i, True)

    def has_rgbs(self) -> bool:
        """Returns whether points have colors."""
        return BaseField.kRGBs in self._data

    def rgbs(self) -> np.ndarray:
        """Returns red, green and blue in 0..255, shape (3, n), a view to read."""
        return self._of("rgbs", BaseField.kRGBs)

    def mutable_rgbs(self) -> np.ndarray:
        """Returns red, green and blue in 0..255, shape (3, n), a view to write through."""
        return self._of("mutable_rgbs", BaseField.kRGBs, True)

    def rgb(self, i: int) -> np.ndarray:
        """Returns red, green and blue of point i in 0..255, shape (3,), a copy."""
        return self._at("rgb", BaseField.kRGBs, i)

    def mutable_rgb(self, i: int) -> np.ndarray:
        """Returns red, green and blue of point i in 0..255, shape (3,), a view to write through."""
        return self._at("mutable_rgb", BaseField.kRGBs, i, True)

    def Crop(self, lower_xyz: ArrayLike, upper_xyz: ArrayLike) -> PointCloud:
        """Returns the points inside a box, its faces included.

        Args:
            lower_xyz: Lower corner [m], shape (3,).
            upper_xyz: Upper corner [m], shape (3,).

        Raises:
            RuntimeError: when points have no positions, or a lower limit is above the upper one.
        """
        if not self.has_xyzs():
            raise RuntimeError("PointCloud.Crop(): PointCloud must have xyzs in order to Crop")
        lower, upper = (np.asarray(corner, np.float32).reshape(3) for corner in (lower_xyz, upper_xyz))
        if not (lower <= upper).all():
            raise RuntimeError(f"PointCloud.Crop(): lower_xyz {lower} is not below upper_xyz {upper}.")
        xyz = self._data[BaseField.kXYZs]
        return self._selected(np.all((xyz >= lower) & (xyz <= upper), axis=1))

    def _selected(self, mask: np.ndarray) -> PointCloud:
        new = PointCloud(0, self.fields())
        new._data = {field: data[mask] for field, data in self._data.items()}
        new._size = int(mask.sum())
        return new

    def FlipNormalsTowardPoint(self, p_CP: ArrayLike) -> None:
        """Turns normals around that point away from a point P [m], shape (3,), in the frame of the positions.

        Raises:
            RuntimeError: when points have no positions or no normals.
        """
        xyz, normals = self.xyzs().T, self.mutable_normals().T
        toward = np.asarray(p_CP, np.float32).reshape(3) - xyz
        normals[np.einsum("ij,ij->i", toward, normals) < 0] *= -1

    def VoxelizedDownSample(self, voxel_size: float, parallelize: Parallelism | bool | int = False) -> PointCloud:
        """Returns a cloud with one point for each cube of a grid that holds any: their mean, also of the other fields.

        Points that are not finite do not count.

        Args:
            voxel_size: Edge length of the cubes [m].
            parallelize: Makes no difference here.

        Raises:
            RuntimeError: when points have no positions, or the size is not positive.
        """
        if not self.has_xyzs():
            raise RuntimeError("PointCloud.VoxelizedDownSample(): the cloud has no xyzs.")
        if not voxel_size > 0:
            raise RuntimeError(f"PointCloud.VoxelizedDownSample(): voxel_size must be positive, got {voxel_size}.")
        finite = _finite_rows(self._data[BaseField.kXYZs])
        cells = np.floor(self._data[BaseField.kXYZs][finite] / voxel_size).astype(np.int64)
        cell, number_of_cells = np.zeros(len(cells), np.int64), 1
        for column in cells.T:
            offset = column - column.min(initial=0)
            width = int(offset.max(initial=0)) + 1
            if number_of_cells * width > _MOST_NUMBERS:  # in a large grid only what holds points has a number
                cell, offset = (np.unique(of, return_inverse=True)[1] for of in (cell, offset))
                number_of_cells = width = len(cell)
            cell, number_of_cells = cell * width + offset, number_of_cells * width
        cell = np.unique(cell, return_inverse=True)[1]
        count = int(cell.max(initial=-1)) + 1
        new = PointCloud(count, self.fields())
        for field, data in self._data.items():
            mean = _mean_by(cell, data[finite], count)
            if field == BaseField.kNormals:
                mean /= np.linalg.norm(mean, axis=1, keepdims=True)
            new._data[field][...] = mean
        return new

    def EstimateNormals(self, radius: float, num_closest: int, parallelize: Parallelism | bool | int = False) -> bool:
        """Sets normals from planes fitted to each point and its neighbours.

        A point with two neighbours, itself included, gets a normal across the line of both; one with fewer gets NaN.

        Args:
            radius: How far neighbours may be [m].
            num_closest: How many count at most.
            parallelize: Makes no difference here.

        Returns:
            Whether every point had three neighbours, itself included.

        Raises:
            RuntimeError: when points have no positions, the radius is not positive or num_closest is below 3.
        """
        if not radius > 0 or num_closest < 3:
            raise RuntimeError(
                "PointCloud.EstimateNormals(): radius must be positive and num_closest at least 3, got "
                f"{radius} and {num_closest}."
            )
        points = self.xyzs().T.astype(float)
        if not self.has_normals():
            self.SetFields(self.fields() | Fields(BaseField.kNormals))
        normals, complete = fitted_normals(points, float(radius), int(num_closest))
        self._data[BaseField.kNormals][...] = normals
        return complete

    def __copy__(self) -> PointCloud:
        return PointCloud(self)

    def __deepcopy__(self, memo: dict) -> PointCloud:
        return PointCloud(self)


def _mean_by(cell: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    """Returns means, shape (count, 3), of the finite rows of values, shape (n, 3), that share a cell, shape (n,)."""
    if values.dtype.kind == "f":
        finite = _finite_rows(values)
        cell, values = cell[finite], values[finite]
    total = np.stack([np.bincount(cell, column, count) for column in values.T], axis=1)
    with np.errstate(invalid="ignore"):
        return total / np.bincount(cell, minlength=count)[:, None]


def _finite_rows(values: np.ndarray) -> np.ndarray | slice:
    """Where no number of a row is infinite or nan; all of it where that is so everywhere."""
    finite = np.isfinite(values)
    return slice(None) if finite.all() else finite.all(axis=1)


def nearest_neighbours(points: np.ndarray, radius: float, most: int) -> np.ndarray:
    """Returns the numbers of each point's nearest neighbours, itself among them, shape (n, most); n for none.

    Args:
        points: Shape (n, 3) [m], finite.
        radius: How far they are less than [m].
        most: How many at most.
    """
    n = len(points)
    order, axes, waiting = np.arange(n), np.zeros(n, np.int64), np.zeros((DEPTH, 2), np.int64)
    divide_points.native(points, order, axes, waiting)
    near = np.empty((n, most), np.int64)
    find_nearest.native(points, order, axes, float(radius), waiting, np.zeros(DEPTH), np.zeros(most), near)
    return near


def fitted_normals(points: np.ndarray, radius: float, num_closest: int) -> tuple[np.ndarray, bool]:
    """Returns unit normals, shape (n, 3), of planes through each point's neighbours, and whether all had three.

    The normal is the direction in which the neighbours spread least (Hoppe et al. 1992).

    Args:
        points: Shape (n, 3) [m].
        radius: How far neighbours may be [m].
        num_closest: How many count at most.
    """
    normals = np.full(points.shape, np.nan)
    finite = np.flatnonzero(np.isfinite(points).all(axis=1))
    if not len(finite):
        return normals, not len(points)
    known = np.ascontiguousarray(points[finite])
    near = nearest_neighbours(known, np.nextafter(radius, np.inf), num_closest)  # with what is exactly there
    counts, found = np.zeros(len(finite), np.int64), np.full(known.shape, np.nan)
    normals_of_planes.native(known, near, counts, found)
    normals[finite] = found
    return normals, bool(len(finite) == len(points) and (counts >= 3).all())


@checked
def Concatenate(clouds: list[PointCloud]) -> PointCloud:
    """Returns a cloud with the points of all clouds, which must have the same fields.

    Raises:
        RuntimeError: when there are no clouds, or their fields differ.
    """
    clouds = list(clouds)
    if not clouds:
        raise RuntimeError("Concatenate(): at least one cloud is needed.")
    for cloud in clouds[1:]:
        if cloud.fields() != clouds[0].fields():
            raise RuntimeError(
                f"Concatenate(): all clouds must have the same fields, got {clouds[0].fields()} and {cloud.fields()}."
            )
    new = PointCloud(clouds[0])
    new._data = {field: np.concatenate([c._data[field] for c in clouds]) for field in new._data}
    new._size = sum(cloud.size() for cloud in clouds)
    return new


for _public in (BaseField, Fields, PointCloud, Concatenate):
    _public.__module__ = _PUBLIC
_register_value_type(PointCloud)
