"""Compiling several kernels at once, one process a processor: numba itself compiles one at a time.

python -m sheldrake.common._native.parallel MODULE:KERNEL ...      fills the cache with these
"""

from __future__ import annotations

import importlib
import os
import sys
import time
from collections.abc import Iterable
from typing import Any

from sheldrake.common._native import prebuilt, store
from sheldrake.common.kernel import Kernel, jit_enabled

MAX_PROCESSES = 4


def prepare(kernels: Iterable[Kernel]) -> None:
    """Makes sure that the cache holds these kernels, as far as it can hold anything; says what takes time."""
    missing = [k for k in dict.fromkeys(kernels) if not store.is_ready(k)] if jit_enabled() else []
    if len(missing) < 2 or not store.is_writable():
        return
    start = time.perf_counter()
    ours = [k for k in missing if k.__module__.startswith("sheldrake.")]
    groups = _balanced(ours, min(os.cpu_count() or 1, MAX_PROCESSES))
    names = ", ".join(k.__name__ for k in missing)
    store.say(f"sheldrake: compiling {len(missing)} kernels, once on this machine ({names}) ...", end="")
    workers = [_start(group) for group in groups[1:] if group]
    for kernel in [*groups[0], *(k for k in missing if k not in ours)]:
        store.make(kernel, tell=False)
    for worker in workers:
        worker.wait()  # what a worker could not compile is compiled, and complained of, where it is used
    store.say(f" {time.perf_counter() - start:.1f} s")


def _balanced(kernels: list[Kernel], number: int) -> list[list[Kernel]]:
    """Groups of about the same work; the first, which the calling process takes, is the lightest."""
    groups: list[list[Kernel]] = [[] for _ in range(max(1, number))]
    work = [0.0] * len(groups)
    for kernel in sorted(kernels, key=store.amount_of_code, reverse=True):
        lightest = work.index(min(work))
        groups[lightest].append(kernel)
        work[lightest] += store.amount_of_code(kernel)
    return [groups[i] for i in sorted(range(len(groups)), key=work.__getitem__)]


def _start(kernels: list[Kernel]) -> Any:
    import subprocess  # not above: most processes have nothing to compile

    command = [sys.executable, "-m", __name__, *(prebuilt.qualified(k) for k in kernels)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p), "SHELDRAKE_QUIET": "1"}
    quiet = subprocess.DEVNULL
    return subprocess.Popen(command, env=environment, stdin=quiet, stdout=quiet, stderr=quiet)


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        module, name = argument.split(":")
        store.make(getattr(importlib.import_module(module), name))
