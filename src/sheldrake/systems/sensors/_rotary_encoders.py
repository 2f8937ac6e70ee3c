"""Encoders at the joints of a robot."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import count, integers
from sheldrake.common._overloads import overload, overloaded
from sheldrake.systems.framework import BasicVector, LeafSystem, LeafSystem_
from sheldrake.systems.framework._templates import SystemTemplate

from ._kernels import encoders

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context


@checked
class RotaryEncoders(LeafSystem):
    """Selects angles [rad] from its input, subtracts calibration offsets, and rounds down to whole ticks.

    Three ways to make one: `(ticks_per_revolution)` for each element of the input; `(input_port_size,
    input_vector_indices)` without rounding; `(input_port_size, input_vector_indices, ticks_per_revolution)`.
    """

    _generic = True

    @overloaded(
        overload(ticks_per_revolution=integers),
        overload(input_port_size=count, input_vector_indices=integers),
        overload(input_port_size=count, input_vector_indices=integers, ticks_per_revolution=integers),
    )
    def __init__(self, *given: Any):
        super().__init__()
        if len(given) == 1:
            (ticks,) = given
            size, indices = len(ticks), list(range(len(ticks)))
        else:
            size, indices, *rest = given
            (ticks,) = rest or ([0] * len(indices),)
        if len(ticks) != len(indices) or any(not 0 <= i < size for i in indices) or any(t < 0 for t in ticks):
            raise RuntimeError(
                f"RotaryEncoders(): indices {indices} must be in [0, {size}), with as many ticks_per_revolution >= 0; "
                f"got {ticks}."
            )
        rows = np.array([indices, [t / (2.0 * math.pi) for t in ticks]], float).T.reshape(-1, encoders.Encoder.SIZE)
        self._model = encoders.Encoders(rows.copy())
        self.DeclareVectorInputPort("u0", size)
        self.DeclareNumericParameter(BasicVector(np.zeros(len(indices))))
        self.DeclareVectorOutputPort("y0", len(indices), encoders.encode)

    def _kernel_models(self, root: Any) -> dict:
        return {"model": self._model}

    def set_calibration_offsets(self, context: Context, calibration_offsets: Any) -> None:
        """Sets what is subtracted from each angle [rad]."""
        self.ValidateContext(context)
        context.get_mutable_numeric_parameter(0).SetFromVector(calibration_offsets)

    def get_calibration_offsets(self, context: Context) -> np.ndarray:
        """What is subtracted from each angle [rad]."""
        self.ValidateContext(context)
        return context.get_numeric_parameter(0).CopyToVector()


RotaryEncoders_ = SystemTemplate(
    "RotaryEncoders_", RotaryEncoders, scope="sheldrake.systems.sensors", own=True, base=LeafSystem_
)
