"""VectorLogSink: a system that keeps a log of its input."""

from __future__ import annotations

from typing import Any

from sheldrake.systems.framework import LeafSystem, TriggerType
from sheldrake.systems.framework._declarations import PUBLISH
from sheldrake.systems.framework._templates import on_scalar_of
from sheldrake.systems.primitives._vector_log import VectorLog, _ContextLog

_SUPPORTED = (TriggerType.kForced, TriggerType.kPerStep, TriggerType.kPeriodic)


class VectorLogSink(LeafSystem):
    """Logs its vector input: after every step, or with a period; and whenever a publish is forced.

    The log is memory of the context, not state: it must not influence the simulation.

    Args:
        input_size: Size of the input.
        publish_triggers: When to log: a set of TriggerType kForced, kPerStep, kPeriodic.
        publish_period: Period [s]; 0 logs after every step.
    """

    _generic = True

    def __init__(self, input_size: int, publish_triggers: Any = None, publish_period: float = 0.0):
        super().__init__()
        if isinstance(publish_triggers, (int, float)):
            publish_triggers, publish_period = None, publish_triggers
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
        self._size = int(input_size)
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

    def _log(self, context: Any) -> VectorLog:
        store = context._store
        n = store.layout.node_of.get(self._system_id)
        if n is None or (context._node != 0 and context._node != n):
            raise RuntimeError(
                f"VectorLogSink.FindLog(): the Context, of {context._system._describe()}, contains no "
                f"{self._describe()}."
            )
        return _ContextLog(store, store.layout.log_of[n], self._size, self._source_names(store, n))

    def _source_names(self, store: Any, n: int) -> list[str] | None:
        kind, m, j = store.layout.sources[n, 0]
        if kind != "out":
            return None
        names = getattr(store.systems[m], "_output_names", None)
        return None if names is None else names(j)

    def FindLog(self, context: Any) -> VectorLog:
        """This sink's log in a root context."""
        return self._log(context)

    def FindMutableLog(self, context: Any) -> VectorLog:
        """This sink's log in a root context, to be changed."""
        return self._log(context)

    def GetLog(self, context: Any) -> VectorLog:
        """The log in this sink's own context."""
        self.ValidateContext(context)
        return self._log(context)

    def GetMutableLog(self, context: Any) -> VectorLog:
        """The log in this sink's own context, to be changed."""
        return self.GetLog(context)


def LogVectorOutput(src: Any, builder: Any, publish_triggers: Any = None, publish_period: float = 0.0) -> VectorLogSink:
    """Adds a VectorLogSink to `builder`, connected to the output port `src`; its arguments as there."""
    sink = builder.AddSystem(on_scalar_of(builder, VectorLogSink)(src.size(), publish_triggers, publish_period))
    builder.Connect(src, sink.get_input_port())
    return sink
