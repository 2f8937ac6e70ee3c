"""Systems, diagrams, contexts, ports, events: the framework that models are built in."""

from sheldrake.common._names import show_as_own
from sheldrake.systems.framework._cache import CacheEntry, CacheEntryValue, ValueProducer
from sheldrake.systems.framework._context.base import ContextBase
from sheldrake.systems.framework._context.context import Context, LeafContext
from sheldrake.systems.framework._context.saving import LoadContext, SaveContext
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
from sheldrake.systems.framework._port_values import BusValue, SystemOutput
from sheldrake.systems.framework._scalar_conversion import SystemScalarConverter
from sheldrake.systems.framework._state import Parameters, State
from sheldrake.systems.framework._system import System, SystemVisitor
from sheldrake.systems.framework._system_base import SystemBase
from sheldrake.systems.framework._templates import SystemTemplate
from sheldrake.systems.framework._values import AbstractValues, ContinuousState, DiscreteValues
from sheldrake.systems.framework._vector import BasicVector, Subvector, Supervector, VectorBase
from sheldrake.systems.framework._vector_system import VectorSystem

LeafSystem_ = SystemTemplate("LeafSystem_", LeafSystem, scope=__name__, own=True)
BasicVector_ = SystemTemplate("BasicVector_", BasicVector, scope=__name__, own=True)
Context_ = SystemTemplate("Context_", Context, scope=__name__)
ContinuousState_ = SystemTemplate("ContinuousState_", ContinuousState, scope=__name__)
Diagram_ = SystemTemplate("Diagram_", Diagram, scope=__name__, own=True)
DiagramBuilder_ = SystemTemplate("DiagramBuilder_", DiagramBuilder, scope=__name__, own=True)
DiscreteUpdateEvent_ = SystemTemplate("DiscreteUpdateEvent_", DiscreteUpdateEvent, scope=__name__)
DiscreteValues_ = SystemTemplate("DiscreteValues_", DiscreteValues, scope=__name__)
Event_ = SystemTemplate("Event_", Event, scope=__name__)
InputPort_ = SystemTemplate("InputPort_", InputPort, scope=__name__)
LeafContext_ = SystemTemplate("LeafContext_", LeafContext, scope=__name__)
LeafOutputPort_ = SystemTemplate("LeafOutputPort_", LeafOutputPort, scope=__name__)
OutputPort_ = SystemTemplate("OutputPort_", OutputPort, scope=__name__)
Parameters_ = SystemTemplate("Parameters_", Parameters, scope=__name__)
PublishEvent_ = SystemTemplate("PublishEvent_", PublishEvent, scope=__name__)
State_ = SystemTemplate("State_", State, scope=__name__)
Subvector_ = SystemTemplate("Subvector_", Subvector, scope=__name__)
Supervector_ = SystemTemplate("Supervector_", Supervector, scope=__name__)
System_ = SystemTemplate("System_", System, scope=__name__)
SystemOutput_ = SystemTemplate("SystemOutput_", SystemOutput, scope=__name__)
SystemVisitor_ = SystemTemplate("SystemVisitor_", SystemVisitor, scope=__name__)
UnrestrictedUpdateEvent_ = SystemTemplate("UnrestrictedUpdateEvent_", UnrestrictedUpdateEvent, scope=__name__)
VectorBase_ = SystemTemplate("VectorBase_", VectorBase, scope=__name__)
VectorSystem_ = SystemTemplate("VectorSystem_", VectorSystem, scope=__name__, own=True, base=LeafSystem_)
WitnessFunction_ = SystemTemplate("WitnessFunction_", WitnessFunction, scope=__name__)

__all__ = [
    "AbstractParameterIndex",
    "AbstractStateIndex",
    "AbstractValues",
    "BasicVector",
    "BasicVector_",
    "BusValue",
    "CacheEntry",
    "CacheEntryValue",
    "CacheIndex",
    "Context",
    "ContextBase",
    "Context_",
    "ContinuousState",
    "ContinuousStateIndex",
    "ContinuousState_",
    "DependencyTicket",
    "Diagram",
    "DiagramBuilder",
    "DiagramBuilder_",
    "Diagram_",
    "DiscreteStateIndex",
    "DiscreteUpdateEvent",
    "DiscreteUpdateEvent_",
    "DiscreteValues",
    "DiscreteValues_",
    "Event",
    "EventStatus",
    "Event_",
    "FixedInputPortValue",
    "InputPort",
    "InputPortIndex",
    "InputPortSelection",
    "InputPort_",
    "LeafContext",
    "LeafContext_",
    "LeafOutputPort",
    "LeafOutputPort_",
    "LeafSystem",
    "LeafSystem_",
    "LoadContext",
    "NumericParameterIndex",
    "OutputPort",
    "OutputPortIndex",
    "OutputPortSelection",
    "OutputPort_",
    "Parameters",
    "Parameters_",
    "PeriodicEventData",
    "PortDataType",
    "PublishEvent",
    "PublishEvent_",
    "SaveContext",
    "State",
    "State_",
    "SubsystemIndex",
    "Subvector",
    "Subvector_",
    "Supervector",
    "Supervector_",
    "System",
    "SystemBase",
    "SystemConstraintIndex",
    "SystemOutput",
    "SystemOutput_",
    "SystemScalarConverter",
    "SystemVisitor",
    "SystemVisitor_",
    "System_",
    "TriggerType",
    "UnrestrictedUpdateEvent",
    "UnrestrictedUpdateEvent_",
    "UseDefaultName",
    "ValueProducer",
    "VectorBase",
    "VectorBase_",
    "VectorSystem",
    "VectorSystem_",
    "WitnessFunction",
    "WitnessFunctionDirection",
    "WitnessFunction_",
    "kUseDefaultName",
]

show_as_own(globals())
