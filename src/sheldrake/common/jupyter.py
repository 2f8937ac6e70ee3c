"""Notebook widgets during a simulation."""

from __future__ import annotations

import asyncio
from typing import Any

__all__ = ["process_ipywidget_events"]


def process_ipywidget_events(num_events_to_process: int = 1) -> None:
    """Let waiting widget events of a Jupyter kernel run now. Without a kernel, nothing happens.

    Args:
        num_events_to_process: At most this many.
    """
    try:
        from IPython import get_ipython
    except ImportError:
        return
    kernel = getattr(get_ipython(), "kernel", None)
    if kernel is None:
        return
    delayed: list[tuple] = []
    handlers = kernel.shell_handlers
    execute = handlers["execute_request"]
    parent = (kernel._parent_ident, kernel._parent_header)
    handlers["execute_request"] = lambda *event: delayed.append(event)  # other cells wait for this one
    try:
        for _ in range(num_events_to_process):
            kernel.set_parent(*parent)
            _shell_stream(kernel).flush(limit=1)
        kernel.set_parent(*parent)
    finally:
        handlers["execute_request"] = execute
    if delayed:
        asyncio.get_event_loop().call_soon(_replay, kernel, delayed)


def _shell_stream(kernel: Any) -> Any:
    if getattr(kernel, "_supports_kernel_subshells", False):
        manager = kernel.shell_channel_thread.manager
        return manager.get_shell_channel_to_subshell_pair(None).to_stream
    return kernel.shell_stream


def _replay(kernel: Any, events: list[tuple]) -> None:
    for stream, ident, parent in events:
        kernel.set_parent(ident, parent)
        kernel.execute_request(stream, ident, parent)
