"""Random numbers, many at once."""

from __future__ import annotations

from sheldrake.common._kernels.twister import next_gaussians, next_uniform
from sheldrake.common.kernel import IntVector, Vector, kernel


@kernel(top=True, strict=True)
def uniforms(key: IntVector, place: IntVector, out: Vector) -> None:
    """Numbers in [0, 1)."""
    for k in range(out.shape[0]):
        out[k] = next_uniform(key, place)


@kernel(top=True, strict=True)
def gaussians(key: IntVector, place: IntVector, out: Vector) -> None:
    """An even number of normal numbers."""
    for k in range(0, out.shape[0], 2):
        out[k], out[k + 1] = next_gaussians(key, place)
