"""A colour with opacity."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch
from sheldrake.common._text import number
from sheldrake.common.value import _register_value_type

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class Rgba:
    """Red, green, blue and opacity, each in [0, 1]; default opaque white."""

    __slots__ = ("_values",)
    _values: tuple[float, float, float, float]
    __hash__ = None  # type: ignore[assignment]
    __fields__ = (SimpleNamespace(name="rgba", type=np.ndarray),)

    def __init__(self, r: float = 1.0, g: float | None = None, b: float | None = None, a: float = 1.0) -> None:
        if r.__class__ is g.__class__ is b.__class__ is a.__class__ is float:
            self._set(r, g, b, a)  # type: ignore[arg-type]  # none of them is None
            return
        if g is None and b is None and isinstance(r, (int, float)) and r == 1.0 and a == 1.0:
            g = b = 1.0
        if g is None or b is None:
            raise TypeError("Rgba(): give r, g and b (and optionally a), or nothing; use set() for an array.")
        self.set(r, g, b, a)

    @property
    def rgba(self) -> np.ndarray:
        """The four values, shape (4,)."""
        return np.array(self._values)

    @rgba.setter
    def rgba(self, value: ArrayLike) -> None:
        self.set(value)

    def r(self) -> float:
        """Red."""
        return self._values[0]

    def g(self) -> float:
        """Green."""
        return self._values[1]

    def b(self) -> float:
        """Blue."""
        return self._values[2]

    def a(self) -> float:
        """Opacity."""
        return self._values[3]

    @checked
    def set(self, *args: ArrayLike, **kwargs: Any) -> None:
        """Sets all values: `set(r, g, b, a=1)` or `set(rgba)` with three or four values.

        Raises:
            RuntimeError: a value outside [0, 1], or an array of another length.
        """
        if "rgba" in kwargs or (len(args) == 1 and not kwargs):
            values = np.array(kwargs.pop("rgba", args[0] if args else None), dtype=float).reshape(-1).tolist()
            if len(values) not in (3, 4):
                raise RuntimeError(f"Rgba must contain either 3 or 4 elements (given [{len(values)}])")
        else:
            values = [_number(x) for x in _ordered(*args, **kwargs)]  # type: ignore[arg-type]  # of one form or the other
        self._set(*values)

    def _set(self, r: float, g: float, b: float, a: float = 1.0) -> None:
        """`set` of floats."""
        if not (0.0 <= r <= 1.0 and 0.0 <= g <= 1.0 and 0.0 <= b <= 1.0 and 0.0 <= a <= 1.0):
            given = ", ".join(f"{c}={number(x)}" for c, x in zip("rgba", (r, g, b, a)))
            raise RuntimeError(f"Rgba values must be within the range [0, 1]. Values provided: ({given})")
        self._values = r, g, b, a

    def update(
        self, r: float | None = None, g: float | None = None, b: float | None = None, a: float | None = None
    ) -> None:
        """Changes the given values and keeps the others."""
        self.set(*[old if new is None else new for new, old in zip((r, g, b, a), self._values)])

    def scale_rgb(self, scale: float) -> Rgba:
        """This colour with red, green and blue times `scale`, clamped to [0, 1]; the opacity stays."""
        r, g, b = (min(max(x * float(scale), 0.0), 1.0) for x in self._values[:3])
        return Rgba(r, g, b, self._values[3])

    def __mul__(self, other: Rgba) -> Rgba:
        if not isinstance(other, Rgba):
            return NotImplemented
        return Rgba(*[x * y for x, y in zip(self._values, other._values)])

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Rgba):
            return NotImplemented
        return self._values == other._values

    def __copy__(self) -> Rgba:
        return Rgba(*self._values)

    def __deepcopy__(self, memo: dict) -> Rgba:
        return Rgba(*self._values)

    def __getstate__(self) -> list[float]:
        return list(self._values)

    def __setstate__(self, state: list[float]) -> None:
        self._set(*state)

    def __repr__(self) -> str:
        return f"Rgba(r={self.r()}, g={self.g()}, b={self.b()}, a={self.a()})"


_register_value_type(Rgba)


def _ordered(r: float, g: float, b: float, a: float = 1.0) -> list[float]:
    return [r, g, b, a]


def _number(value: float) -> float:
    if isinstance(value, str):
        raise Mismatch(f"Rgba.set(): incompatible function arguments: expected numbers, got {value!r}.")
    return float(value)
