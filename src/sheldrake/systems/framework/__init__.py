"""Systems, diagrams, contexts, ports, events: the framework that models are built in."""

from sheldrake.systems.framework._cache import CacheEntry, CacheEntryValue, ValueProducer
from sheldrake.systems.framework._context import Context, ContextBase, LeafContext
from sheldrake.systems.framework._diagram import Diagram
from sheldrake.systems.framework._diagram_builder import DiagramBuilder
from sheldrake.systems.framework._event import (
    DiscreteUpdateEvent,
    Event,
    EventStatus,
    PeriodicEventData,
    PublishEvent,
    TriggerType,
    UnrestrictedUpdateEvent,
    WitnessFunction,
    WitnessFunctionDirection,
)
from sheldrake.systems.framework._index import (
    AbstractParameterIndex,
    AbstractStateIndex,
    CacheIndex,
    ContinuousStateIndex,
    DependencyTicket,
    DiscreteStateIndex,
    InputPortIndex,
    InputPortSelection,
    NumericParameterIndex,
    OutputPortIndex,
    OutputPortSelection,
    PortDataType,
    SubsystemIndex,
    SystemConstraintIndex,
    UseDefaultName,
    kUseDefaultName,
)
from sheldrake.systems.framework._leaf_system import LeafSystem
from sheldrake.systems.framework._port import FixedInputPortValue, InputPort, LeafOutputPort, OutputPort
from sheldrake.systems.framework._scalar_conversion import SystemScalarConverter
from sheldrake.systems.framework._system import System, SystemVisitor
from sheldrake.systems.framework._system_base import SystemBase
from sheldrake.systems.framework._values import (
    AbstractValues,
    BusValue,
    ContinuousState,
    DiscreteValues,
    Parameters,
    State,
    SystemOutput,
)
from sheldrake.systems.framework._vector import BasicVector, Subvector, Supervector, VectorBase
from sheldrake.systems.framework._vector_system import VectorSystem

__all__ = [
    "AbstractParameterIndex",
    "AbstractStateIndex",
    "AbstractValues",
    "BasicVector",
    "BusValue",
    "CacheEntry",
    "CacheEntryValue",
    "CacheIndex",
    "Context",
    "ContextBase",
    "ContinuousState",
    "ContinuousStateIndex",
    "DependencyTicket",
    "Diagram",
    "DiagramBuilder",
    "DiscreteStateIndex",
    "DiscreteUpdateEvent",
    "DiscreteValues",
    "Event",
    "EventStatus",
    "FixedInputPortValue",
    "InputPort",
    "InputPortIndex",
    "InputPortSelection",
    "LeafContext",
    "LeafOutputPort",
    "LeafSystem",
    "NumericParameterIndex",
    "OutputPort",
    "OutputPortIndex",
    "OutputPortSelection",
    "Parameters",
    "PeriodicEventData",
    "PortDataType",
    "PublishEvent",
    "State",
    "SubsystemIndex",
    "Subvector",
    "Supervector",
    "System",
    "SystemBase",
    "SystemConstraintIndex",
    "SystemOutput",
    "SystemScalarConverter",
    "SystemVisitor",
    "TriggerType",
    "UnrestrictedUpdateEvent",
    "UseDefaultName",
    "ValueProducer",
    "VectorBase",
    "VectorSystem",
    "WitnessFunction",
    "WitnessFunctionDirection",
    "kUseDefaultName",
]
