"""Coulomb's law of friction between two surfaces."""

from __future__ import annotations

import copy
from typing import Any

from sheldrake.common._checked import checked
from sheldrake.common.value import _register_value_type
from sheldrake.systems.framework._vector import plain


class CoulombFriction:
    """Coefficients of static and dynamic friction, 0 <= dynamic <= static; default frictionless.

    Raises:
        RuntimeError: a negative coefficient, or a dynamic one larger than the static one; or one that depends on the
            value of a variable.
    """

    __slots__ = ("_dynamic", "_static")

    @checked
    def __init__(self, static_friction: float = 0.0, dynamic_friction: float = 0.0) -> None:
        dynamic, static = plain(dynamic_friction), plain(static_friction)
        for name, value in (("dynamic", dynamic), ("static", static)):
            if value != value:
                raise RuntimeError(f"The given {name} friction is not a number: {value:g}")
            if value < 0.0:
                raise RuntimeError(f"The given {name} friction is negative: {value:g}")
        if dynamic > static:
            raise RuntimeError(
                f"The given dynamic friction ({dynamic:g}) is greater than the given static friction "
                f"({static:g}); dynamic friction must be less than or equal to static friction."
            )
        self._static = static_friction
        self._dynamic = dynamic_friction

    def static_friction(self) -> float:
        """Coefficient of static friction [-]."""
        return self._static

    def dynamic_friction(self) -> float:
        """Coefficient of dynamic friction [-]."""
        return self._dynamic

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, CoulombFriction):
            return NotImplemented
        mine, theirs = (self._static, self._dynamic), (other._static, other._dynamic)
        return all(plain(a) == plain(b) for a, b in zip(mine, theirs))

    def __hash__(self) -> int:
        return hash((plain(self._static), plain(self._dynamic)))

    def __copy__(self) -> CoulombFriction:
        return CoulombFriction(self._static, self._dynamic)

    def __deepcopy__(self, memo: dict) -> CoulombFriction:
        return CoulombFriction(copy.deepcopy(self._static, memo), copy.deepcopy(self._dynamic, memo))

    def __reduce__(self) -> tuple[Any, ...]:
        return CoulombFriction, (self._static, self._dynamic)

    def __repr__(self) -> str:
        return f"CoulombFriction(static_friction={self._static}, dynamic_friction={self._dynamic})"


_register_value_type(CoulombFriction)
