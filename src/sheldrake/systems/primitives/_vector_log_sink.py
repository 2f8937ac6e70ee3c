"""VectorLogSink, a system that keeps a log of its input; and logs of everything in a diagram."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.systems.framework import LeafSystem, PortDataType, TriggerType
from sheldrake.systems.framework._declarations import PUBLISH
from sheldrake.systems.framework._templates import on_scalar_of
from sheldrake.systems.framework._vector import as_size
from sheldrake.systems.primitives._log_set import LogSet
from sheldrake.systems.primitives._vector_log import VectorLog, _ContextLog

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sheldrake.systems.framework import Context, DiagramBuilder, System
    from sheldrake.systems.framework._engine.store import Store
    from sheldrake.systems.framework._port import OutputPort


_NOTHING: dict[Any, Any] = {}
_SUPPORTED = (TriggerType.kForced, TriggerType.kPerStep, TriggerType.kPeriodic)


class VectorLogSink(LeafSystem):
    """Logs its vector input: after every step, or with a period; and whenever a publish is forced.

    The log is memory of the context, not state: it must not influence the simulation.

    Args:
        input_size: Size of the input.
        publish_triggers: When to log: a set of TriggerType kForced, kPerStep, kPeriodic; a number is the period.
        publish_period: Period [s]; 0 logs after every step.
    """

    _generic = True

    def __init__(
        self,
        input_size: int,
        publish_triggers: Iterable[TriggerType] | float | None = None,
        publish_period: float = 0.0,
    ):
        super().__init__()
        if isinstance(publish_triggers, (int, float, np.integer, np.floating)):
            publish_period, publish_triggers = publish_triggers, None
        if not publish_period >= 0:
            raise RuntimeError(f"VectorLogSink: publish_period must not be negative, got {publish_period}.")
        if publish_triggers is None:
            timed = TriggerType.kPeriodic if publish_period > 0 else TriggerType.kPerStep
            publish_triggers = {TriggerType.kForced, timed}
        triggers = set(publish_triggers)
        if not triggers or not triggers <= set(_SUPPORTED):
            valid = ", ".join(t.name for t in _SUPPORTED)
            raise RuntimeError(f"VectorLogSink: publish_triggers must be some of {valid}; got {publish_triggers}.")
        if (TriggerType.kPeriodic in triggers) != (publish_period > 0):
            raise RuntimeError(
                f"VectorLogSink: publish_period must be positive if and only if kPeriodic is among the triggers; got "
                f"publish_period={publish_period}."
            )
        self._size = as_size(input_size, "VectorLogSink()")
        self._triggers, self._period = triggers, float(publish_period)
        self.DeclareVectorInputPort("data", self._size)
        self._declare_event(
            PUBLISH, "forced" if triggers == {TriggerType.kForced} else self._main(), "log", self._period
        )
        if TriggerType.kPerStep in triggers and TriggerType.kPeriodic in triggers:
            self._declare_event(PUBLISH, "per_step", "log")
        if TriggerType.kForced in triggers and triggers != {TriggerType.kForced}:
            self._declare_event(PUBLISH, "forced", "log")

    def _main(self) -> str:
        return "periodic" if TriggerType.kPeriodic in self._triggers else "per_step"

    def _log(self, context: Context) -> VectorLog:
        store = context._store
        n = store.layout.node_of.get(self._system_id)
        if n is None or (context._node != 0 and context._node != n):
            raise RuntimeError(
                f"VectorLogSink.FindLog(): the Context, of {context._system._describe()}, contains no "
                f"{self._describe()}."
            )
        return _ContextLog(store, store.layout.log_of[n], self._size, lambda: self._source_names(store, n))

    def _source_names(self, store: Store, n: int) -> list[str] | None:
        kind, m, j = store.layout.sources[n, 0]
        if kind != "out":
            return None
        names = getattr(store.systems[m], "_output_names", None)
        return None if names is None else names(j)

    def FindLog(self, context: Context) -> VectorLog:
        """This sink's log in a root context."""
        known = getattr(context, "_reads", _NOTHING).get(self)
        return self._found(context) if known is None else known

    def FindMutableLog(self, context: Context) -> VectorLog:
        """This sink's log in a root context, to be changed."""
        return self.FindLog(context)

    @checked
    def _found(self, context: Context) -> VectorLog:
        log = context._reads[self] = self._log(context)
        return log

    def GetLog(self, context: Context) -> VectorLog:
        """The log in this sink's own context."""
        self.ValidateContext(context)
        return self._log(context)

    def GetMutableLog(self, context: Context) -> VectorLog:
        """The log in this sink's own context, to be changed."""
        return self.GetLog(context)


@checked
def LogVectorOutput(
    src: OutputPort,
    builder: DiagramBuilder,
    publish_triggers: Iterable[TriggerType] | float | None = None,
    publish_period: float = 0.0,
) -> VectorLogSink:
    """Adds a VectorLogSink to `builder`, connected to the output port `src`; its arguments as there."""
    sink = builder.AddSystem(on_scalar_of(builder, VectorLogSink)(src.size(), publish_triggers, publish_period))
    builder.Connect(src, sink.get_input_port())
    return sink


class AllLogs:
    """The sinks that `LogAll` added.

    Attributes:
        sinks: VectorLogSink by title, such as `plant/state`.
        skipped: Why ports are not logged: text by title.
    """

    def __init__(self) -> None:
        self.sinks: dict[str, VectorLogSink] = {}
        self.skipped: dict[str, str] = {}

    def FindLogs(self, context: Context) -> LogSet:
        """The logs in a root context."""
        return LogSet({title: sink.FindLog(context) for title, sink in self.sinks.items()})

    def __repr__(self) -> str:
        return f"AllLogs({', '.join(self.sinks)})"


def LogAll(
    builder: DiagramBuilder, publish_triggers: Any = None, publish_period: float = 0.0, *, only: str = ""
) -> AllLogs:
    """Logs every vector output port of the systems in a DiagramBuilder.

    Call it when everything is connected, before Build(). Of a plant the whole state is logged, not the parts of its
    model instances again; of a diagram in the builder, the ports it exports. A port that needs an input that nothing is
    connected to is skipped, and named in `skipped`. A port that is computed in Python, such as the accelerations of a
    plant, costs some 0.1 ms a sample: give a period, or say `only` what you want, where speed counts.

    Args:
        builder: The builder.
        publish_triggers: As of VectorLogSink.
        publish_period: Period [s]; 0 logs after every step.
        only: A regular expression that titles `system/port` must contain.
    """
    found = AllLogs()
    for system in builder.GetSystems():
        if isinstance(system, VectorLogSink):
            continue
        for number in range(system.num_output_ports()):
            port = system.get_output_port(number, warn_deprecated=False)
            title = f"{system.get_name()}/{port.get_name()}"
            if port.get_data_type() != PortDataType.kVectorValued or not re.search(only, title):
                continue
            reason = _why_not(builder, system, port)
            if reason:
                found.skipped[title] = reason
                continue
            sink = LogVectorOutput(port, builder, publish_triggers, publish_period)
            sink.set_name(f"log of {title}")
            found.sinks[title] = sink
    return found


def _why_not(builder: DiagramBuilder, system: System, port: OutputPort) -> str:
    if port.size() == 0:
        return "it is empty"
    if hasattr(system, "GetModelInstanceName") and port.get_name() != "state":
        repeated = ("_state", "_generalized_acceleration", "_net_actuation")
        if port.get_name().endswith(repeated):
            return "it is part of another port"
    for i, j in system.GetDirectFeedthroughs():
        if j != port.get_index() or _is_optional(system, i):
            continue
        if not builder.IsConnectedOrExported(system.get_input_port(i, warn_deprecated=False)):
            name = system.get_input_port(i, warn_deprecated=False).get_name()
            return f"it needs the input '{name}', which is not connected"
    return ""


def _is_optional(system: System, i: int) -> bool:
    inputs = getattr(system, "_inputs", ())
    return i < len(inputs) and bool(getattr(inputs[i], "optional", False))
