"""What Quaternion, AngleAxis and Isometry3 share: checks of what turns, and turning many vectors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._names import pretty_class_name
from sheldrake.common._overloads import incompatible
from sheldrake.common._scalar_math import sqrt
from sheldrake.common._scalars import Mismatch, any_array, as_array, is_symbolic

if TYPE_CHECKING:
    from sheldrake.common._scalars import ScalarBase
    from sheldrake.common._types import Scalars

TOLERANCE = 1e-5  # how far from a unit quaternion, unit axis or rotation an argument may be, as in pydrake


def check_unit(T: type, numbers: np.ndarray, what: str) -> None:
    """Refuses numbers whose length is not one; of expressions nobody knows.

    Raises:
        RuntimeError: it is not.
    """
    if is_symbolic(T):
        return
    length = sqrt(sum([x * x for x in numbers.tolist()]))
    if abs(length - 1.0) > TOLERANCE:
        raise RuntimeError(f"{what} is not normalized: {numbers.tolist()} has length {length}.")


def check_rotation(T: type, R: np.ndarray) -> None:
    """Refuses matrices that do not turn.

    Raises:
        RuntimeError: R is not orthonormal, or a reflection.
    """
    if is_symbolic(T):
        return
    R = R if T is float else as_array(float, [[x.value() for x in row] for row in R.tolist()], (3, 3))
    if np.abs(R.dot(R.T) - np.eye(3)).max() > TOLERANCE:
        raise RuntimeError(f"Rotation matrix is not orthonormal: {R.tolist()}.")
    if np.linalg.det(R) < 0:
        raise RuntimeError(f"Rotation matrix violates right-hand rule: {R.tolist()} is a reflection.")


def turn(obj: ScalarBase, call: str, name: str, value: Scalars, one: Any) -> np.ndarray:
    """Apply `one` to a vector (3,) or to each column of (3, n), keeping the shape of the input."""
    T = obj._T
    try:
        array = any_array(T, value)
        if array.ndim not in (1, 2) or array.shape[0] != 3:
            raise Mismatch
    except Mismatch:
        where = f"{pretty_class_name(type(obj))}.{call}"
        raise incompatible(
            where,
            [f"(other: {pretty_class_name(type(obj))})", f"({name}: {T.__name__} array of shape (3,) or (3, n))"],
            (value,),
            {},
        ) from None
    if array.ndim == 1:
        return np.array(one(array.tolist()), dtype=array.dtype)
    columns = [one(column) for column in array.T.tolist()]
    return np.array(columns, dtype=array.dtype).reshape(-1, 3).T.copy()


def only_argument(obj: ScalarBase, call: str, names: tuple[str, ...], args: tuple, kwargs: dict) -> Any:
    """The argument of a call that takes one, under one of some names.

    Raises:
        TypeError: there is another number of them, or another name.
    """
    values = [*args, *kwargs.values()]
    if len(values) != 1 or any(name not in names for name in kwargs):
        accepted = [f"({name})" for name in names]
        raise incompatible(f"{pretty_class_name(type(obj))}.{call}", accepted, args, kwargs)
    return values[0]
