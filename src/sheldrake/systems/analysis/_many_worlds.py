"""More worlds than one machine, or one memory, has room for: in chunks, by engines that exist."""

from __future__ import annotations

import hashlib
import sys
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.systems.analysis._batch_simulator import BatchSimulator

if TYPE_CHECKING:
    from types import ModuleType

    from sheldrake.systems.framework import System

Job = Callable[[BatchSimulator, np.ndarray], Any]
_ENGINES = ("here", "joblib", "ray")
_BUILT: dict[str, tuple[Any, Job]] = {}
"""Of a worker: the last system and job that it was sent, by their hash."""


class WorldsProgress(NamedTuple):
    """How far `SimulateWorlds` is.

    Attributes:
        done: Worlds that are done.
        total: Of so many.
        seconds: Since the beginning.
    """

    done: int
    total: int
    seconds: float

    @property
    def rate(self) -> float:
        """Worlds a second."""
        return self.done / self.seconds if self.seconds > 0.0 else 0.0

    @property
    def seconds_left(self) -> float:
        """At this rate [s]."""
        return (self.total - self.done) / self.rate if self.rate > 0.0 else float("inf")


class _Plan(NamedTuple):
    """What all chunks have in common."""

    num_threads: int
    seed: int


def SimulateWorlds(
    make_system: Any,
    job: Job,
    num_worlds: int,
    *,
    chunk_size: int = 256,
    engine: str = "here",
    address: str | None = None,
    num_threads: int | None = None,
    retries: int = 3,
    seed: int = 0,
    progress: bool | Callable[[WorldsProgress], None] = False,
) -> Any:
    """Runs a job on many worlds, in chunks that are BatchSimulators of their own, here or on other machines.

    Results do not depend on engine, chunks and threads, if the job looks at each world by itself.

    Args:
        make_system: A function without arguments that makes the system: each worker calls it once. With engine "here"
            it may be the system. Systems do not travel: functions do, of modules that workers find, or of a script.
        job: `job(batch, worlds)` gives an array whose first axis is that of the chunk's worlds, or a tuple or dict of
            such. `worlds` are their numbers among all; `batch.generator(i)` is that of the i-th of them, by its number
            among all.
        num_worlds: How many worlds there are.
        chunk_size: How many of them a BatchSimulator has.
        engine: "here", in this process; "joblib", by the backend that `joblib.parallel_config` has chosen (threads,
            loky, Dask); "ray", as Ray's tasks.
        address: Of a running Ray cluster; one is started on this machine if not given, unless Ray is connected already.
        num_threads: Of each chunk; as many as this process may use "here", 1 elsewhere, if not given.
        retries: How often Ray runs a chunk again whose worker has died.
        seed: Of the worlds' generators.
        progress: Whether to print how far it is; or a function that is told so after each chunk.

    Returns:
        What the job gives, the arrays of all chunks joined in the order of the worlds.

    Raises:
        ValueError: a number is less than one, the engine is unknown, or the job gave something else.
        TypeError: a system is to travel.
        ModuleNotFoundError: the engine is not installed.
    """
    if min(num_worlds, chunk_size) < 1 or retries < 0:
        raise ValueError(
            f"SimulateWorlds(): num_worlds ({num_worlds}) and chunk_size ({chunk_size}) must be at least 1, and "
            f"retries ({retries}) not negative."
        )
    if engine not in _ENGINES:
        raise ValueError(f"SimulateWorlds(): engine is {engine!r}; there are {', '.join(map(repr, _ENGINES))}.")
    if engine != "here" and not callable(make_system):
        raise TypeError(
            f"SimulateWorlds(): engine {engine!r} needs a function that makes the system, in each worker; systems do "
            f"not travel, such as {make_system!r}."
        )
    parts = [(first, min(chunk_size, num_worlds - first)) for first in range(0, num_worlds, chunk_size)]
    plan = _Plan(num_threads or (0 if engine == "here" else 1), seed)
    if engine == "here":
        system = _system_of(make_system)
        found: Iterator = ((k, _chunk(system, job, plan, *part)) for k, part in enumerate(parts))
    elif engine == "joblib":
        found = _by_joblib(make_system, job, plan, parts)
    else:
        found = _by_ray(make_system, job, plan, parts, address, retries)
    return _joined(_told(found, parts, num_worlds, progress), len(parts))


def _system_of(make_system: Callable[[], System] | System) -> Any:
    return make_system() if callable(make_system) else make_system


def _chunk(system: System, job: Job, plan: _Plan, first: int, count: int) -> Any:
    """What the job gives for some worlds, as checked arrays."""
    threads = plan.num_threads or None
    batch = BatchSimulator(system, count, num_threads=threads, seed=plan.seed, first_world=first)
    found = job(batch, np.arange(first, first + count))
    copies = _mapped(np.array, found)
    for array in _arrays(copies):
        if array.shape[:1] != (count,):
            raise ValueError(
                f"SimulateWorlds(): the job gave an array of shape {array.shape} for {count} worlds; its first axis "
                "must be theirs."
            )
    return copies


def _sent_chunk(sent: bytes, plan: _Plan, first: int, count: int) -> Any:
    """`_chunk` of a worker, which makes the system when it is first sent to it."""
    import pickle

    key = hashlib.sha256(sent).hexdigest()
    built = _BUILT.get(key)
    if built is None:
        make_system, job = pickle.loads(sent)
        built = _system_of(make_system), job
        _BUILT.clear()
        _BUILT[key] = built
    return _chunk(*built, plan, first, count)


def _numbered(k: int, *args: Any) -> tuple[int, Any]:
    return k, _sent_chunk(*args)


def _by_joblib(
    make_system: Callable[[], System] | System, job: Job, plan: _Plan, parts: list
) -> Iterator[tuple[int, Any]]:
    """Chunks as they are done, by joblib."""
    joblib = _needed("joblib", "joblib")
    sent = _needed("cloudpickle", "joblib").dumps((make_system, job))
    calls = (joblib.delayed(_numbered)(k, sent, plan, *part) for k, part in enumerate(parts))
    yield from joblib.Parallel(return_as="generator_unordered")(calls)


def _by_ray(
    make_system: Any, job: Job, plan: _Plan, parts: list, address: str | None, retries: int
) -> Iterator[tuple[int, Any]]:
    """Chunks as they are done, by Ray: each is a task, that is run again where its worker dies."""
    ray = _needed("ray", "ray")
    if not ray.is_initialized():
        ray.init(address=address, log_to_driver=False)
    sent = ray.put(ray.cloudpickle.dumps((make_system, job)))
    task = ray.remote(num_cpus=plan.num_threads, max_retries=retries)(_sent_chunk)
    waiting = {task.remote(sent, plan, *part): k for k, part in enumerate(parts)}
    try:
        while waiting:
            for done in ray.wait(list(waiting))[0]:
                yield waiting.pop(done), ray.get(done)
    finally:
        for left in waiting:
            ray.cancel(left, force=True)


def _needed(name: str, extra: str) -> ModuleType:
    """An engine.

    Raises:
        ModuleNotFoundError: it is not installed.
    """
    import importlib

    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name != name:
            raise
        raise ModuleNotFoundError(
            f"SimulateWorlds(): engine {name!r} needs {name}: pip install 'sheldrake[{extra}]'.", name=name
        ) from error


def _told(found: Iterator, parts: list, total: int, progress: Any) -> Iterator[tuple[int, Any]]:
    """The same chunks; who wants to know hears how far it is."""
    tell = progress if callable(progress) else _print if progress else None
    begin, done = time.perf_counter(), 0
    for k, result in found:
        done += parts[k][1]
        if tell is not None:
            tell(WorldsProgress(done, total, time.perf_counter() - begin))
        yield k, result


def _print(now: WorldsProgress) -> None:
    end = "\n" if now.done == now.total else ""
    text = f"\r{now.done} of {now.total} worlds, {now.rate:.3g} a second, {now.seconds_left:.0f} s left "
    print(text, end=end, file=sys.stderr, flush=True)


def _joined(found: Iterator[tuple[int, Any]], count: int) -> Any:
    """Results of all chunks as one, in order."""
    chunks: list[Any] = [None] * count
    for k, result in found:
        chunks[k] = result
    first = chunks[0]
    if isinstance(first, dict):
        return {name: np.concatenate([chunk[name] for chunk in chunks]) for name in first}
    if isinstance(first, tuple):
        return tuple(map(np.concatenate, zip(*chunks)))
    return np.concatenate(chunks)


def _mapped(function: Callable, found: Any) -> Any:
    """A function on each array of a result."""
    if isinstance(found, dict):
        return {name: function(array) for name, array in found.items()}
    return tuple(map(function, found)) if isinstance(found, tuple) else function(found)


def _arrays(found: Any) -> list[np.ndarray]:
    if isinstance(found, dict):
        return list(found.values())
    return list(found) if isinstance(found, tuple) else [found]
