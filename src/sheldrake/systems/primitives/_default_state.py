"""The default state of a linear or affine system, continuous or sampled."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sheldrake.common._overloads import Mismatch
from sheldrake.systems.framework import BasicVector, LeafSystem
from sheldrake.systems.framework._vector import as_vector

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


def set_default_state(system: LeafSystem, x0: ArrayLike) -> None:
    """Replaces what contexts made from now on begin with; numbers are of the scalar of the system, or floats.

    Raises:
        RuntimeError: there are more or fewer numbers than states.
        TypeError: they are no numbers, or duals for a system of floats.
    """
    call = f"{type(system).__name__}.configure_default_state()"
    numbers = as_vector(x0)
    if numbers.dtype == object and system._scalar is float:
        raise Mismatch(f"{call}: incompatible function arguments: expected floats, got {type(numbers[0]).__name__}")
    sampled = bool(system._xd_models)
    size = system._xd_models[0].size() if sampled else system._xc_model.size()
    if len(numbers) != size:
        raise RuntimeError(f"{call}: the state has size {size}, got {len(numbers)}.")
    if not size:
        return
    if sampled:
        system._xd_models[0] = BasicVector(numbers)
    else:
        system._xc_model = BasicVector(numbers)
    system._defaults_changed()
