"""What bodies, frames, joints, actuators and force elements have in common.

An element knows its *owner*, the parts of its plant, once it is added (see `_owner`). What a context holds of it, it
reads and writes through these.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from sheldrake.common._overloads import Mismatch
from sheldrake.multibody.tree._index import ModelInstanceIndex
from sheldrake.multibody.tree._owner import Owner
from sheldrake.multibody.tree._scoped_name import ScopedName

if TYPE_CHECKING:
    from sheldrake.common._types import Scalars
    from sheldrake.math import RigidTransform
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree._multibody_forces import MultibodyForces

_FLOAT64 = np.dtype(np.float64)
_FLOATS = frozenset((float, np.float64))
_PLAIN = frozenset((float, int, bool, np.float64, np.float32, np.int64, np.int32, np.bool_))


class Element:
    """A part of a plant."""

    _index_type: ClassVar[type]

    def __init__(self, model_instance: ModelInstanceIndex | None = None):
        self._owner: Owner | None = None
        self._index: Any = None
        self._instance: Any = model_instance
        self._group = -1
        self._ephemeral = False

    def _adopt(self, owner: Owner, index: int, model_instance: ModelInstanceIndex | None = None) -> None:
        if self._owner is not None:
            raise RuntimeError(f"{self!r} is already part of a MultibodyPlant; an element is added once.")
        self._owner, self._index = owner, self._index_type(index)
        if model_instance is not None:
            self._instance = model_instance

    def _abandon(self) -> None:
        """It is taken out of its plant."""
        self._owner = self._index = None

    def _required_owner(self, call: str) -> Owner:
        if self._owner is None:
            raise RuntimeError(f"{type(self).__name__}.{call}(): {self!r} is not part of a MultibodyPlant yet.")
        return self._owner

    def _finalized(self, call: str) -> Owner:
        """The owner, after Finalize()."""
        owner = self._owner or self._required_owner(call)
        owner.elements.require_finalized(call)
        return owner

    def _fitting(self, call: str, forces: MultibodyForces) -> MultibodyForces:
        """Forces, after Finalize(), that are of the size of the plant's."""
        owner = self._owner or self._required_owner(call)
        model = owner.elements.model(call)
        forces.require_fitting(call, len(model.row_bodies), model.nv)
        return forces

    def index(self) -> Any:
        """Number of the element among its kind; invalid before it is added."""
        return self._index_type() if self._index is None else self._index

    def model_instance(self) -> ModelInstanceIndex:
        """The model instance it belongs to."""
        return ModelInstanceIndex() if self._instance is None else self._instance

    def is_ephemeral(self) -> bool:
        """Whether Finalize() made it, rather than the user."""
        return self._ephemeral

    def GetParentPlant(self) -> MultibodyPlant:
        """The MultibodyPlant it belongs to.

        Raises:
            RuntimeError: it has not been added to one.
        """
        return self._required_owner("GetParentPlant").plant

    @property
    def _scalar(self) -> type:
        """The scalar type of the plant it belongs to."""
        return float if self._owner is None else self._owner.plant._scalar

    def __repr__(self) -> str:
        family = type(self).__name__ + ("" if self._scalar is float else f"_[{self._scalar.__name__}]")
        name = f"name={self.name()!r} " if hasattr(self, "name") else ""
        return f"<{family} {name}index={int(self.index())} model_instance={int(self.model_instance())}>"


class NamedElement(Element):
    """An element with a name that is unique among its kind in its model instance."""

    def __init__(self, name: str, model_instance: ModelInstanceIndex | None = None):
        super().__init__(model_instance)
        if not isinstance(name, str):
            raise Mismatch(
                f"{type(self).__name__}(): incompatible constructor arguments. name must be a str, not {name!r}."
            )
        self._name = name

    def name(self) -> str:
        """Its name, without the model instance."""
        return self._name

    def scoped_name(self) -> ScopedName:
        """Its name with that of its model instance, `model::name`."""
        plant = self._required_owner("scoped_name").plant
        return ScopedName(plant.GetModelInstanceName(self.model_instance()), self._name)


def scalar_of(numbers: np.ndarray) -> type:
    """The scalar type of the numbers of a context."""
    return float if numbers.dtype is _FLOAT64 else type(numbers[0])


def of_scalar(value: Any, scalar: type) -> Any:
    """A pose or rotation on a scalar type."""
    return value if value._T is scalar else value.cast[scalar]()


def vector(call: str, name: str, value: Scalars, size: int) -> np.ndarray:
    """`value` as a new array of `size` numbers (floats, or objects of another scalar type).

    Raises:
        TypeError: it is something else.
    """
    if type(value) is np.ndarray and value.dtype is _FLOAT64 and value.shape == (size,):
        return value.copy()
    array = np.asarray(value)
    if array.dtype != object or _PLAIN.issuperset(map(type, array.flat)):
        try:
            array = array.astype(float)
        except (TypeError, ValueError):
            array = np.empty(0, dtype=object)
    if array.shape == (size, 1):
        array = array[:, 0]
    if array.shape != (size,):
        raise Mismatch(
            f"{call}(): incompatible function arguments. {name} must be a vector of {size} numbers, "
            f"not {array.shape or value!r}."
        )
    return array.copy()


def default_values(call: str, name: str, value: Scalars, size: int) -> np.ndarray:
    """`value` as a new array of `size` finite floats.

    Raises:
        TypeError: it is something else.
        RuntimeError: one is infinite or nan.
    """
    array = vector(call, name, value, size)
    if array.dtype == object:
        raise Mismatch(f"{call}(): incompatible function arguments. {name} must be floats, not {value!r}.")
    return finite(call, name, array)


def distributions(call: str, name: str, value: Scalars, size: int) -> list[Any]:
    """What `size` random numbers are drawn from: expressions, or numbers.

    Raises:
        TypeError: it is something else.
    """
    drawn = vector(call, name, value, size).tolist()
    for item in drawn:
        if not (isinstance(item, float) or type(item).__name__ in ("Expression", "Variable")):
            raise Mismatch(f"{call}(): incompatible function arguments. {name} takes expressions, not {item!r}.")
    return drawn


def require_numbers(call: str, values: Iterable[object]) -> None:
    """Makes sure that each value is a number, of whatever type.

    Raises:
        TypeError: one is text, None or a sequence.
    """
    for value in values:
        if value is None or isinstance(value, (str, list, tuple, complex)) or np.ndim(value) > 0:  # type: ignore[arg-type]
            raise Mismatch(f"{call}(): incompatible function arguments. Takes a number, not {value!r}.")


def nonnegative(call: str, **numbers: object) -> None:
    """Makes sure that no number is below zero or nan (duals and symbols pass).

    Raises:
        RuntimeError: one is.
    """
    for name, value in numbers.items():
        if isinstance(value, (int, float)) and not value >= 0.0:
            raise RuntimeError(f"{call}(): {name} must be nonnegative, not {value}.")


def are_finite(values: Any) -> bool:
    """Whether these are floats, none of them infinite or nan; False where that takes a closer look."""
    return _FLOATS.issuperset(map(type, values)) and math.isfinite(sum(values))


def finite_pose(call: str, name: str, X: RigidTransform) -> RigidTransform:
    """`X`, after making sure that none of its numbers is infinite or nan (symbols pass).

    Raises:
        RuntimeError: one is.
    """
    if not (X._T is float and math.isfinite(X._p.sum() + X._R._M.sum())):
        finite(call, name, X.GetAsMatrix34())
    return X


def finite(call: str, name: str, value: Any) -> Any:
    """`value`, after making sure that none of its numbers is infinite or nan (symbols pass).

    Raises:
        RuntimeError: one is.
    """
    array = np.asarray(value)
    if array.dtype == object:
        is_finite = all([x is not None for x in array.ravel().tolist()])  # symbols pass; None is no number
    else:
        is_finite = bool(np.isfinite(array).all())
    if not is_finite:
        raise RuntimeError(f"{call}(): {name} must be finite, not {value}.")
    return value
