"""VectorSystem: a system of one vector in, one vector out, and at most one kind of vector state."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.systems.framework._index import PortDataType, Ticket
from sheldrake.systems.framework._leaf_system import LeafSystem

if TYPE_CHECKING:
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._values import ContinuousState, DiscreteValues
    from sheldrake.systems.framework._vector import BasicVector


class VectorSystem(LeafSystem):
    """A system seen as functions of arrays: override `DoCalcVector...`.

    Args:
        input_size: Size of the input port; none if 0.
        output_size: Size of the output port; none if 0.
        direct_feedthrough: Whether the output depends on the input directly.
    """

    @checked
    def __init__(self, input_size: int, output_size: int, direct_feedthrough: bool | None = None):
        super().__init__()
        if input_size > 0:
            self.DeclareInputPort("u0", PortDataType.kVectorValued, input_size)
        if output_size > 0:
            prerequisites = {Ticket.ALL_SOURCES_EXCEPT_INPUTS} if direct_feedthrough is False else None
            self._feeds_through = direct_feedthrough is not False
            self.DeclareVectorOutputPort("y0", output_size, self._calc_output, prerequisites)

    def _vector_input(self, context: Context) -> np.ndarray:
        return self.get_input_port(0).Eval(context) if self._inputs else np.empty(0)

    def _vector_state(self, context: Context) -> np.ndarray:
        if self._xd_models:
            return context.get_discrete_state_vector().CopyToVector()
        return context.get_continuous_state_vector().CopyToVector() if self._xc_model.size() else np.empty(0)

    def _calc_output(self, context: Context, output: BasicVector) -> None:
        read = context._reads.get(0)
        u = np.empty(0) if not self._feeds_through else self._vector_input(context) if read is None else read()
        y = np.zeros(output._v.size) if self._scalar is float else np.zeros_like(output._v)
        self.DoCalcVectorOutput(context, u, self._vector_state(context), y)
        output.SetFromVector(y)

    def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
        xdot = _zeros_like(derivatives.get_vector()._v)
        self.DoCalcVectorTimeDerivatives(context, self._vector_input(context), self._vector_state(context), xdot)
        derivatives.SetFromVector(xdot)

    def DoCalcDiscreteVariableUpdates(self, context: Context, events: list, discrete_state: DiscreteValues) -> None:
        overridden = type(self).DoCalcVectorDiscreteVariableUpdates
        if overridden is VectorSystem.DoCalcVectorDiscreteVariableUpdates and any(e._has_callback() for e in events):
            super().DoCalcDiscreteVariableUpdates(context, events, discrete_state)
            return
        if not discrete_state.num_groups():
            return
        x_next = _zeros_like(discrete_state.get_vector()._v)
        u, x = self._vector_input(context), self._vector_state(context)
        self.DoCalcVectorDiscreteVariableUpdates(context, u, x, x_next)
        discrete_state.set_value(x_next)

    def DoCalcVectorOutput(self, context: Context, u: np.ndarray, x: np.ndarray, y: np.ndarray) -> None:
        """Computes the output from input and state, into `y`; to be overridden."""
        raise NotImplementedError(f"{self._describe()} must override DoCalcVectorOutput(context, u, x, y).")

    def DoCalcVectorTimeDerivatives(self, context: Context, u: np.ndarray, x: np.ndarray, xdot: np.ndarray) -> None:
        """Computes derivatives of continuous state, into `xdot`; to be overridden."""
        raise NotImplementedError(f"{self._describe()} must override DoCalcVectorTimeDerivatives(context, u, x, xdot).")

    def DoCalcVectorDiscreteVariableUpdates(
        self, context: Context, u: np.ndarray, x: np.ndarray, x_next: np.ndarray
    ) -> None:
        """Computes the next discrete state, into `x_next`; to be overridden, or the update declared with a function."""
        raise NotImplementedError(
            f"{self._describe()} must override DoCalcVectorDiscreteVariableUpdates(context, u, x, x_next)."
        )


def _zeros_like(vector: np.ndarray) -> np.ndarray:
    return np.zeros(vector.size) if vector.dtype == float else np.zeros_like(vector)
