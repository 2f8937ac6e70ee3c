"""Diagrams that send and receive messages (LCM)."""

from sheldrake.common._names import show_as_own
from sheldrake.systems.lcm._buses import ApplyLcmBusConfig, LcmBuses
from sheldrake.systems.lcm._scope import LcmScopeSystem
from sheldrake.systems.lcm._serializer import PySerializer, SerializerInterface
from sheldrake.systems.lcm._systems import LcmInterfaceSystem, LcmPublisherSystem, LcmSubscriberSystem

__all__ = [
    "ApplyLcmBusConfig",
    "LcmBuses",
    "LcmInterfaceSystem",
    "LcmPublisherSystem",
    "LcmScopeSystem",
    "LcmSubscriberSystem",
    "PySerializer",
    "SerializerInterface",
]

show_as_own(globals())
