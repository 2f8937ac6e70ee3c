"""Compiling several kernels at once, one process a processor: Python runs one thread at a time.

The kernels stand in a queue, the largest first, and each process takes the next one when it has time: a pipe of their
numbers, which all of them read.

Another process knows this one's path and imports this module; the folder that it starts in is on that path only if it
is on this one's.
"""

from __future__ import annotations

import importlib
import itertools
import os
import sys
import time
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from sheldrake.common._native import prebuilt, store
from sheldrake.common.kernel import Kernel, jit_enabled

if TYPE_CHECKING:
    import subprocess

MAX_PROCESSES = 4
NUMBER = 2  # bytes of a number in the queue


def prepare(kernels: Iterable[Kernel]) -> None:
    """Makes sure that the cache holds these kernels, as far as it can hold anything; says what takes time."""
    missing = [k for k in dict.fromkeys(kernels) if not store.is_ready(k)] if jit_enabled() else []
    if len(missing) < 2 or not store.is_writable():
        return
    start = time.perf_counter()
    ours = [k for k in missing if k.__module__.startswith("sheldrake.")]  # a user's may be of a script: not importable
    ours.sort(key=store.amount_of_code, reverse=True)
    names = ", ".join(k.__name__ for k in missing)
    store.say(f"sheldrake: compiling {len(missing)} kernels, once on this machine ({names}) ...", end="")
    queue = _queue(len(ours))
    workers = [_start(ours, queue) for _ in range(min(os.cpu_count() or 1, MAX_PROCESSES, len(ours)) - 1)]
    for kernel in itertools.chain(_next(ours, queue), (k for k in missing if k not in ours)):
        store.make(kernel, tell=False)
    os.close(queue)
    for worker in workers:
        worker.wait()  # what a worker could not compile is compiled, and complained of, where it is used
    store.say(f" {time.perf_counter() - start:.1f} s")


def _queue(size: int) -> int:
    """A pipe that holds the numbers below `size`, once each."""
    read, write = os.pipe()
    os.write(write, b"".join(i.to_bytes(NUMBER, "big") for i in range(size)))
    os.close(write)
    return read


def _next(items: list[Any], queue: int) -> Iterator[Any]:
    """The items whose numbers this process takes from the queue."""
    while number := os.read(queue, NUMBER):
        yield items[int.from_bytes(number, "big")]


def _start(kernels: list[Kernel], queue: int) -> subprocess.Popen[bytes]:
    import subprocess  # not above: most processes have nothing to compile

    path = [os.path.abspath(p) for p in sys.path if p]
    code = f"import sys; sys.path[:] = {path!r}; from {__name__} import work; work(sys.argv[1:])"
    command = [sys.executable, "-I", "-c", code, *(prebuilt.qualified(k) for k in kernels)]
    environment = {**os.environ, "SHELDRAKE_QUIET": "1"}
    quiet = subprocess.DEVNULL
    return subprocess.Popen(command, env=environment, stdin=queue, stdout=quiet, stderr=quiet)


def work(names: list[str]) -> None:
    """Fills the cache with those of these kernels, MODULE:KERNEL, whose numbers standard input gives."""
    for argument in _next(names, 0):
        module, name = argument.split(":")
        store.make(getattr(importlib.import_module(module), name))
