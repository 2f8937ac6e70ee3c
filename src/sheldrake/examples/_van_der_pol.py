"""The oscillator of van der Pol."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.systems.framework import BasicVector, LeafSystem
from sheldrake.systems.framework._port_getters import output_port

from ._kernels import plants

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context


class VanDerPolOscillator(LeafSystem):
    """q'' + mu (q^2 - 1) q' + q = 0; the parameter is mu = 1.

    Ports: outputs "y0", the position, and "y1", the state (q, q').
    """

    _generic = True

    _complex_rows = True

    def __init__(self) -> None:
        super().__init__()
        state = self.DeclareContinuousState(1, 1, 0)
        self.DeclareVectorOutputPort("y0", 1, self._copy_position, {self.q_ticket()})
        self.DeclareStateOutputPort("y1", state)
        self.DeclareNumericParameter(BasicVector([1.0]))
        self.DeclareTimeDerivatives(plants.van_der_pol)

    @staticmethod
    def _copy_position(context: Context, output: BasicVector) -> None:
        output.SetAtIndex(0, context.get_continuous_state_vector()[0])

    get_position_output_port = output_port(0, "The port of the position.")
    get_full_state_output_port = output_port(1, "The port of the state.")

    @staticmethod
    def CalcLimitCycle() -> np.ndarray:
        """The limit cycle for mu = 1: states (q, q') at the steps of a simulation once around, shape (2, n)."""
        from sheldrake.systems.analysis import Simulator
        from sheldrake.systems.framework import DiagramBuilder
        from sheldrake.systems.primitives import LogVectorOutput

        builder = DiagramBuilder()
        system = builder.AddSystem(VanDerPolOscillator())
        logger = LogVectorOutput(system.get_output_port(1), builder)
        simulator = Simulator(builder.Build())
        context = simulator.get_mutable_context()
        context.SetContinuousState([-0.1144, 2.0578])  # A point of the cycle, which attracts.
        simulator.AdvanceTo(6.667)
        return logger.FindLog(context).data().copy()
