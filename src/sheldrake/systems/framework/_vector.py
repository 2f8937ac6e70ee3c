"""Vectors of numbers: named views of memory that announce what is written through them."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, SupportsIndex

import numpy as np

from sheldrake.common._copies import Cloned
from sheldrake.common._kinds import LARGEST_COUNT
from sheldrake.common._names import pretty_class_name
from sheldrake.common._no_constructor import no_constructor
from sheldrake.common._overloads import Mismatch, expect
from sheldrake.common.value import _register_value_type

if TYPE_CHECKING:
    from numpy.typing import DTypeLike
    from typing_extensions import Self

    from sheldrake.common._types import Scalar, Scalars, Symbolics

_FLOAT = np.dtype(float)


def _filled(v: np.ndarray, values: list) -> bool:
    """Copies a list of numbers into an array of its length; False, with nothing written, if NumPy cannot."""
    try:
        if len(values) == 1:
            v[0] = values[0]
        else:
            v[:] = values
    except (TypeError, ValueError):
        return False
    return True


_FLOAT64 = np.dtype(np.float64)
_PLAIN = frozenset((float, int, np.float64))


def as_vector(value: Scalars | Symbolics | VectorBase, dtype: DTypeLike | None = None) -> np.ndarray:
    """`value` as a fresh 1-D array of floats, or of objects where it holds other scalars.

    Raises:
        TypeError: it cannot be read as numbers.
    """
    if type(value) is np.ndarray and value.dtype is _FLOAT64 and value.ndim == 1 and dtype is None:
        return value.copy()
    if isinstance(value, VectorBase):
        return value.CopyToVector()
    if type(value) is list and dtype is None and value and _PLAIN.issuperset(map(type, value)):
        return np.array(value, float)
    try:
        a = np.asarray(value)
        kinds = set(map(type, a.ravel().tolist())) if a.dtype == object else None  # of many numbers, few
        if np.iscomplexobj(a) or (kinds is not None and not all(map(_is_scalar, kinds))):
            raise TypeError
        if kinds is None or (dtype is None and all(issubclass(kind, (int, float, np.number)) for kind in kinds)):
            a = a.astype(float)
        if dtype is not None and a.dtype != dtype:
            a = a.astype(dtype)
    except (TypeError, ValueError):
        raise Mismatch(f"incompatible function arguments: expected a vector of numbers, got {value!r}") from None
    if a.ndim == 0:
        a = a.reshape(1)
    if a.ndim == 2 and 1 in a.shape:
        a = a.reshape(-1)
    if a.ndim != 1:
        raise Mismatch(f"incompatible function arguments: expected a vector, got an array of shape {a.shape}")
    return np.array(a)


def _is_scalar(kind: type) -> bool:
    """Whether objects of a class are numbers: duals, expressions or variables, or what Python takes for one."""
    return (hasattr(kind, "__float__") or hasattr(kind, "__radd__")) and not issubclass(kind, np.ndarray)


def is_size(value: object) -> bool:
    """Whether `value` is an integer, not an array or a bool."""
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool)


def as_size(value: Any, what: str) -> int:
    """A size that a caller gave; a TypeError for 2.5, nan and None, which are none, and for negative ones."""
    try:
        n = operator.index(value)
    except TypeError:
        raise Mismatch(f"{what}: a size must be an int, not {value!r}.") from None
    if n < 0:
        raise Mismatch(f"{what}: a size must not be negative, got {n}.")
    if n > LARGEST_COUNT:
        raise Mismatch(f"{what}: a size must be at most {LARGEST_COUNT}, got {n}.")
    return n


def plain(x: Any) -> Any:
    """An AutoDiffXd's value, an Expression's if it is constant; a float as it is."""
    return x.value() if hasattr(x, "value") else x.Evaluate() if hasattr(x, "Evaluate") else x


def lifted(values: np.ndarray, scalar: type) -> np.ndarray:
    """`values` as an array of numbers of type `scalar`; of float64 where that is float."""
    if scalar is float:
        return values
    new = np.empty(len(values), object)
    if values.dtype != float:
        new[:] = [x if type(x) is scalar else scalar(x) for x in values.tolist()]
        return new
    bits = values.view(np.int64)  # -0.0 is not 0.0
    new[:] = scalar(0.0)  # numbers are never changed in place: one serves all
    made: dict[int, Any] = {}
    for i in np.flatnonzero(bits).tolist():
        bit = bits.item(i)
        if bit not in made:
            made[bit] = scalar(values.item(i))
        new[i] = made[bit]
    return new


@no_constructor()
class VectorBase:
    """A vector with `size()`, indexing and element access. Memory is an array, owned or a view of a context's slab."""

    _v: np.ndarray
    _on_write: Callable[[], None] | None = None

    @classmethod
    def _view(cls, memory: np.ndarray, on_write: Callable[[], None] | None = None) -> Self:
        vector = object.__new__(cls)
        vector._v, vector._on_write = memory, on_write
        return vector

    def _wrote(self) -> None:
        if self._on_write is not None:
            self._on_write()

    def _describe(self) -> str:
        return f"this {type(self).__name__}"

    def _checked(self, value: Any) -> np.ndarray:
        a = value
        if self._v.dtype == object:
            a = lifted(as_vector(value), self._number_type())
        elif type(a) is not np.ndarray or a.ndim != 1 or a.dtype != self._v.dtype:
            a = as_vector(value, self._v.dtype)
        if a.shape != self._v.shape:
            if np.ndim(value) == 0 and not isinstance(value, VectorBase):
                raise Mismatch(f"incompatible function arguments: expected a vector, got {value!r}")
            raise IndexError(f"Operand vector size {a.size} does not match {self._describe()} size {self._v.size}")
        return a

    def _number(self, value: Any) -> Any:
        """A value as one of the numbers in memory."""
        if self._v.dtype == object:
            return value if isinstance(value, self._number_type()) else self._number_type()(value)
        try:
            return value.__float__()
        except (AttributeError, TypeError, ValueError):
            raise Mismatch(f"incompatible function arguments: expected a number, got {value!r}") from None

    def _number_type(self) -> type:
        """Type of the numbers in memory of objects."""
        return type(self._v[0]) if self._v.size else float

    def _index(self, index: SupportsIndex) -> int:
        i = operator.index(index)
        if not 0 <= i < self._v.size:
            raise IndexError(f"Index {i} is not within [0, {self._v.size}) while accessing {self._describe()}.")
        return i

    def size(self) -> int:
        """Number of elements."""
        return self._v.size

    def CopyToVector(self) -> np.ndarray:
        """The elements, shape (size,), as the caller's own array."""
        return self._v.copy()

    def SetFromVector(self, value: Any) -> None:
        """Sets all elements.

        Raises:
            IndexError: `value` has another size.
        """
        v, kind = self._v, type(value)
        if self._on_write is not None:
            self._on_write()  # first: it refuses other threads
        if kind is np.ndarray and value.dtype is v.dtype is _FLOAT and value.shape == v.shape:
            v[...] = value
        elif not (kind is list and v.dtype is _FLOAT and len(value) == v.size and _filled(v, value)):
            v[:] = self._checked(value)

    def SetFrom(self, value: VectorBase) -> None:
        """Copies the elements of another vector of the same size."""
        self.SetFromVector(expect("SetFrom", value, VectorBase)._v)

    def SetZero(self) -> None:
        """Sets all elements to zero."""
        self._wrote()
        self._v[:] = self._number_type()(0.0) if self._v.dtype == object else 0.0

    def GetAtIndex(self, index: int) -> Any:
        """Element `index`, counted from 0."""
        return self._item(self._v[self._index(index)])

    def SetAtIndex(self, index: int, value: Scalar) -> None:
        """Sets element `index`."""
        self[index] = value

    def PlusEqScaled(self, scale: Scalar, rhs: VectorBase) -> VectorBase:
        """Adds `scale * rhs` in place."""
        self._v += scale * self._checked(expect("PlusEqScaled", rhs, VectorBase)._v)
        self._wrote()
        return self

    @staticmethod
    def _item(value: Any) -> Any:
        return float(value) if isinstance(value, np.floating) else value

    def __getitem__(self, index: SupportsIndex | slice) -> Any:
        if type(index) is int and index >= 0:
            try:
                return self._v.item(index)
            except IndexError:
                pass
        elif isinstance(index, slice):
            return self._v[index].copy()
        return self._item(self._v[self._index(index)])

    def __setitem__(self, index: SupportsIndex | slice, value: Any) -> None:
        if isinstance(index, slice):
            if self._v.dtype == object:
                value = self._number(value) if np.ndim(value) == 0 else lifted(as_vector(value), self._number_type())
            self._v[index] = value
        else:
            if type(value) is not float or self._v.dtype == object:
                value = self._number(value)
            self._v[self._index(index)] = value
        if self._on_write is not None:
            self._on_write()

    def __len__(self) -> int:
        return self._v.size

    def __iter__(self) -> Iterator[Any]:
        return iter(self._v.tolist())

    def __str__(self) -> str:
        return str(self._v.tolist())

    def __repr__(self) -> str:
        name = pretty_class_name(type(self))
        if self._v.dtype == object and "[" not in name:
            name += f"_[{self._number_type().__name__}]"
        return f"{name}({self._v.tolist()})"


class BasicVector(VectorBase, Cloned):
    """The vector that ports, states and parameters hold.

    Args:
        data: its elements; or
        size: how many, each not-a-number until set.
    """

    _scalar: type = float
    _any_scalar = False
    """Whether a derived class is one of this name for other scalars too, where a context has these."""

    def __init__(self, data: Any = None, *, size: int | None = None):
        if data is None and size is None:
            raise Mismatch("BasicVector(): incompatible constructor arguments: give data or size.")
        if size is None and (isinstance(data, (int, np.integer)) and not isinstance(data, bool)):
            data, size = None, int(data)
        if size is not None:
            if size < 0:
                raise TypeError(f"BasicVector(): size must not be negative, got {size}.")
            numbers = np.empty(size)
            numbers.fill(np.nan)
            self._v = lifted(numbers, self._scalar)
        else:
            self._v = lifted(as_vector(data), self._scalar)

    def value(self) -> np.ndarray:
        """The elements, shape (size,), as a read-only view."""
        view = self._v.view()
        view.flags.writeable = False
        return view

    get_value = value

    def get_mutable_value(self) -> np.ndarray:
        """The elements, shape (size,), as a view to write through."""
        self._wrote()
        return self._v

    def set_value(self, value: Scalars | VectorBase) -> None:
        """Sets all elements; an IndexError if the size differs."""
        self.SetFromVector(value)

    def _on_memory(self, memory: np.ndarray, on_write: Callable[[], None] | None = None) -> Self:
        """This vector's class and attributes, on other memory."""
        T = type(self)
        if T is BasicVector:
            return T._view(memory, on_write)
        new = object.__new__(type(self))
        new.__dict__.update(self.__dict__)
        new._v, new._on_write = memory, on_write
        return new

    def _on_scalar(self, scalar: type) -> BasicVector:
        """A vector of the same numbers on a scalar type."""
        return self if scalar is float else self._on_objects(lifted(self._v, scalar), None, scalar)

    def _on_objects(self, memory: np.ndarray, on_write: Callable[[], None] | None, scalar: type) -> BasicVector:
        """A vector on memory of another scalar."""
        if not self._any_scalar:
            return BasicVector._view(memory, on_write)
        own: Any = type(self)
        return _of_scalar(own, scalar)._view(memory, on_write)

    def Clone(self) -> Self:
        """A copy with its own memory."""
        return self._on_memory(self._v.copy())

    def _assign_from(self, other: BasicVector) -> None:
        self.SetFromVector(other._v)


class Subvector(VectorBase):
    """Consecutive elements of another vector."""


class Supervector(VectorBase):
    """Several vectors seen as one."""

    def __init__(self, parts: Sequence[VectorBase]):
        self._parts = [p for p in parts if p.size()]
        self._on_write = None

    @property
    def _v(self) -> np.ndarray:  # type: ignore[override]
        return np.concatenate([p._v for p in self._parts]) if self._parts else np.empty(0)

    def SetFromVector(self, value: Scalars | VectorBase) -> None:
        at, a = 0, self._checked(value)
        for part in self._parts:
            part.SetFromVector(a[at : at + part.size()])
            at += part.size()

    def SetZero(self) -> None:
        for part in self._parts:
            part.SetZero()

    def PlusEqScaled(self, scale: Scalar, rhs: VectorBase) -> VectorBase:
        self.SetFromVector(self._v + scale * self._checked(rhs._v))
        return self

    def SetAtIndex(self, index: int, value: Scalar) -> None:
        i = self._index(index)
        for part in self._parts:
            if i < part.size():
                part.SetAtIndex(i, value)
                return
            i -= part.size()

    def __setitem__(self, index: Any, value: Any) -> None:
        if isinstance(index, slice):
            a = self._v
            a[index] = value
            self.SetFromVector(a)
        else:
            self.SetAtIndex(index, value)


def _to_basic_vector(value: Scalars | str) -> BasicVector:
    if isinstance(value, str):
        raise Mismatch(f"set_value(): incompatible function arguments: a BasicVector holds numbers, not {value!r}")
    return BasicVector(as_vector(value))


_register_value_type(BasicVector, coerce=_to_basic_vector)


def converted(values: np.ndarray, scalar: type) -> np.ndarray:
    """Values for a slab of another scalar: floats go in as they are, other scalars give their value."""
    if scalar is float:
        return values if values.dtype is _FLOAT else np.array([plain(x) for x in values], float)
    if values.dtype is not _FLOAT and set(map(type, values.tolist())) == {scalar}:
        return values  # numbers are never changed in place
    return lifted(np.array([x if isinstance(x, scalar) else plain(x) for x in values.tolist()], object), scalar)


@functools.cache
def _of_scalar(cls: type[BasicVector], scalar: type) -> type[BasicVector]:
    return type(cls.__name__, (cls,), {"_scalar": scalar, "__doc__": cls.__doc__, "__module__": cls.__module__})
