"""A colour with opacity."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._text import number
from sheldrake.common.value import _register_value_type

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class Rgba:
    """Red, green, blue and opacity, each in [0, 1]; default opaque white."""

    __slots__ = ("_rgba",)
    __hash__ = None  # type: ignore[assignment]
    __fields__ = (SimpleNamespace(name="rgba", type=np.ndarray),)

    def __init__(self, r: float = 1.0, g: float | None = None, b: float | None = None, a: float = 1.0) -> None:
        if g is None and b is None and isinstance(r, (int, float)) and r == 1.0 and a == 1.0:
            g = b = 1.0
        if g is None or b is None:
            raise TypeError("Rgba(): give r, g and b (and optionally a), or nothing; use set() for an array.")
        self.set(r, g, b, a)

    @property
    def rgba(self) -> np.ndarray:
        """The four values, shape (4,)."""
        return self._rgba.copy()

    @rgba.setter
    def rgba(self, value: ArrayLike) -> None:
        self.set(value)

    def r(self) -> float:
        """Red."""
        return float(self._rgba[0])

    def g(self) -> float:
        """Green."""
        return float(self._rgba[1])

    def b(self) -> float:
        """Blue."""
        return float(self._rgba[2])

    def a(self) -> float:
        """Opacity."""
        return float(self._rgba[3])

    @checked
    def set(self, *args: ArrayLike, **kwargs: Any) -> None:
        """Sets all values: `set(r, g, b, a=1)` or `set(rgba)` with three or four values.

        Raises:
            RuntimeError: a value outside [0, 1], or an array of another length.
        """
        if "rgba" in kwargs or (len(args) == 1 and not kwargs):
            values: Any = np.array(kwargs.pop("rgba", args[0] if args else None), dtype=float).reshape(-1)
            if values.size not in (3, 4):
                raise RuntimeError(f"Rgba must contain either 3 or 4 elements (given [{values.size}])")
            values = list(values) + [1.0] * (4 - values.size)
        else:
            values = _ordered(*args, **kwargs)  # type: ignore[arg-type]  # numbers, of one form or the other
        rgba = np.array(values, dtype=float)
        if not np.all((rgba >= 0.0) & (rgba <= 1.0)):
            given = ", ".join(f"{c}={number(x)}" for c, x in zip("rgba", rgba))
            raise RuntimeError(f"Rgba values must be within the range [0, 1]. Values provided: ({given})")
        self._rgba = rgba

    def update(
        self, r: float | None = None, g: float | None = None, b: float | None = None, a: float | None = None
    ) -> None:
        """Changes the given values and keeps the others."""
        self.set(*(old if new is None else new for new, old in zip((r, g, b, a), self._rgba)))

    def scale_rgb(self, scale: float) -> Rgba:
        """This colour with red, green and blue times `scale`, clamped to [0, 1]; the opacity stays."""
        red, green, blue = np.clip(self._rgba[:3] * scale, 0.0, 1.0)
        return Rgba(red, green, blue, self.a())

    def __mul__(self, other: Rgba) -> Rgba:
        if not isinstance(other, Rgba):
            return NotImplemented
        return Rgba(*(self._rgba * other._rgba))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Rgba):
            return NotImplemented
        return bool(np.all(self._rgba == other._rgba))

    def __copy__(self) -> Rgba:
        return Rgba(*self._rgba)

    def __deepcopy__(self, memo: dict) -> Rgba:
        return Rgba(*self._rgba)

    def __getstate__(self) -> list[float]:
        return self._rgba.tolist()

    def __setstate__(self, state: list[float]) -> None:
        self._rgba = np.array(state)

    def __repr__(self) -> str:
        return f"Rgba(r={self.r()}, g={self.g()}, b={self.b()}, a={self.a()})"


_register_value_type(Rgba)


def _ordered(r: float, g: float, b: float, a: float = 1.0) -> list[float]:
    return [r, g, b, a]
