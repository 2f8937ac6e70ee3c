"""Rotary encoders."""

import numpy as np

from sheldrake.common._kernels.generic import floor
from sheldrake.common.kernel import Matrix, Vector, Vectors, kernel

INDEX, TICKS_PER_RADIAN = np.int64(0), np.int64(1)


@kernel(top=True)
def encode(model: Matrix, p: Vector, u: Vectors, y: Vector) -> None:
    """The chosen inputs less their offsets, rounded down to whole ticks; no ticks per radian (0): not rounded."""
    for i in range(y.shape[0]):
        angle = u[0][int(model[i, INDEX])] - p[i]
        ticks = model[i, TICKS_PER_RADIAN]
        if ticks > 0.0:
            angle = floor(angle * ticks) / ticks
        y[i] = angle
