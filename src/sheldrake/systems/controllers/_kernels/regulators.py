"""Regulators whose gains are trajectories."""

from __future__ import annotations

from sheldrake.common.kernel import Vector, Vectors, kernel
from sheldrake.systems.primitives._kernels.paths import Pieces, add_product, add_vector


@kernel(top=True, strict=True)
def regulate(
    t: float,
    u: Vectors,
    x0_model: Pieces,
    u0_model: Pieces,
    K_model: Pieces,
    k0_model: Pieces,
    work: Vector,
    y: Vector,
) -> None:
    """u0(t) - K(t) (x - x0(t)) - k0(t), where x is the only input."""
    for i in range(work.shape[0]):
        work[i] = u[0][i]
    add_vector(x0_model, t, -1.0, work)
    for i in range(y.shape[0]):
        y[i] = 0.0
    add_vector(u0_model, t, 1.0, y)
    add_product(K_model, t, -1.0, work, y)
    add_vector(k0_model, t, -1.0, y)
