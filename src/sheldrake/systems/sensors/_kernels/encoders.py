"""Rotary encoders."""

from typing import Annotated, NamedTuple

from sheldrake.common._kernels.generic import floor
from sheldrake.common.kernel import Matrix, Vector, Vectors, kernel
from sheldrake.common.record import Record, number, table


class Encoder(Record):
    """Of one output."""

    index = number("of the input that it measures")
    ticks = number("per radian; 0: not rounded", "1/rad")


@table
class Encoders(NamedTuple):
    """Of all outputs."""

    number: Annotated[Matrix, Encoder]


@kernel(top=True)
def encode(model: Encoders, p: Vector, u: Vectors, y: Vector) -> None:
    """The chosen inputs less their offsets, rounded down to whole ticks; no ticks per radian (0): not rounded."""
    for i in range(y.shape[0]):
        angle = u[0][int(model[i].index)] - p[i]
        ticks = model[i].ticks
        if ticks > 0.0:
            angle = floor(angle * ticks) / ticks
        y[i] = angle
