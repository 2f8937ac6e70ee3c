"""Vectors as messages, for programs that plot them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sheldrake.common._checked import checked
from sheldrake.common.value import AbstractValue
from sheldrake.lcm._messages import lcmt_scope
from sheldrake.systems.framework import LeafSystem, OutputPort
from sheldrake.systems.lcm._serializer import PySerializer
from sheldrake.systems.lcm._systems import LcmPublisherSystem

if TYPE_CHECKING:
    from sheldrake.lcm import DrakeLcmInterface
    from sheldrake.systems.framework import Context, DiagramBuilder


@checked
class LcmScopeSystem(LeafSystem):
    """Makes an `lcmt_scope` message of a vector.

    Args:
        size: Size of the vector.
    """

    def __init__(self, size: int):
        super().__init__()
        self.DeclareVectorInputPort("input", size)
        self.DeclareAbstractOutputPort("output", lambda: AbstractValue.Make(lcmt_scope()), self._calc)

    def _calc(self, context: Context, output: AbstractValue) -> None:
        value = self.get_input_port().Eval(context)
        time = int(context.get_time() * 1e6)
        output.set_value(lcmt_scope(utime=time, size=len(value), value=value.tolist()))

    @staticmethod
    def AddToBuilder(
        builder: DiagramBuilder, lcm: DrakeLcmInterface, signal: OutputPort, channel: str, publish_period: float
    ) -> list:
        """Publishes an output port's vector.

        Args:
            builder: Where its system is.
            lcm: The connection.
            signal: The output port.
            channel: The channel.
            publish_period: [s]; 0: in every step.

        Returns:
            The LcmScopeSystem and the LcmPublisherSystem.
        """
        scope = builder.AddSystem(LcmScopeSystem(signal.size()))
        publisher = builder.AddSystem(
            LcmPublisherSystem(channel, PySerializer(lcmt_scope), lcm, publish_period=publish_period)
        )
        builder.Connect(signal, scope.get_input_port())
        builder.Connect(scope.get_output_port(), publisher.get_input_port())
        return [scope, publisher]
