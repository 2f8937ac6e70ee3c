"""Logs of everything in a diagram."""

from __future__ import annotations

import re
from typing import Any

from sheldrake.systems.framework import PortDataType
from sheldrake.systems.primitives._log_set import LogSet
from sheldrake.systems.primitives._vector_log_sink import LogVectorOutput, VectorLogSink


class AllLogs:
    """The sinks that `LogAll` added.

    Attributes:
        sinks: VectorLogSink by title, such as `plant/state`.
        skipped: Why ports are not logged: text by title.
    """

    def __init__(self) -> None:
        self.sinks: dict[str, VectorLogSink] = {}
        self.skipped: dict[str, str] = {}

    def FindLogs(self, context: Any) -> LogSet:
        """The logs in a root context."""
        return LogSet({title: sink.FindLog(context) for title, sink in self.sinks.items()})

    def __repr__(self) -> str:
        return f"AllLogs({', '.join(self.sinks)})"


def LogAll(builder: Any, publish_triggers: Any = None, publish_period: float = 0.0, *, only: str = "") -> AllLogs:
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


def _why_not(builder: Any, system: Any, port: Any) -> str:
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


def _is_optional(system: Any, i: int) -> bool:
    inputs = getattr(system, "_inputs", ())
    return i < len(inputs) and bool(getattr(inputs[i], "optional", False))
