"""The chain rule for numbers that are a value and a vector of partial derivatives."""

from __future__ import annotations

from sheldrake.common.kernel import Vector, kernel


@kernel(top=True, strict=True)
def chain(x: float, dx: Vector, value: float, slope: float, y: Vector, dy: Vector) -> None:
    """y(x): its value, and slope dx."""
    y[0] = value
    for i in range(len(dy)):
        dy[i] = dx[i] * slope


@kernel(top=True, strict=True)
def combine(
    a: float, da: Vector, b: float, db: Vector, value: float, by_a: float, by_b: float, y: Vector, dy: Vector
) -> None:
    """y(a, b): its value, and by_a da + by_b db."""
    y[0] = value
    for i in range(len(dy)):
        dy[i] = da[i] * by_a + db[i] * by_b
