"""Threads that share work out among themselves."""

from __future__ import annotations

import atexit
import operator
import os
import queue
import signal
import threading
import weakref
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from sheldrake.common._parallelism import Parallelism

Item = TypeVar("Item")
Result = TypeVar("Result")
_LOOK = 0.05
"""How often the calling thread looks for Ctrl-C while it waits for the others [s]."""
_PATIENCE = 1.0
"""How long the end of the process waits for a thread whose part has no end of its own [s]."""


class ThreadTeam:
    """Threads of which each takes the next part of the work when it is done with one; the caller's is one of them.

    Args:
        num_threads: How many; None for as many as this process may use (see `Parallelism`).

    Attributes:
        stopped: Nobody takes another part: one failed, or Ctrl-C was pressed.
    """

    def __init__(self, num_threads: int | None = None):
        try:
            self.num_threads = Parallelism.Max().num_threads() if num_threads is None else operator.index(num_threads)
        except TypeError:
            raise TypeError(f"num_threads must be a whole number, not {num_threads!r}.") from None
        if self.num_threads < 1:
            raise ValueError(f"num_threads must be at least 1, not {num_threads}.")
        self.stopped = False
        self._forget_threads()
        _teams.add(self)

    def run(self, work: Callable[[int, int], None], parts: int) -> None:
        """Calls `work(thread, part)` once for each part below `parts`, on up to `num_threads` threads.

        Args:
            work: Its first argument numbers the threads from 0.
            parts: How many parts there are.

        Raises:
            KeyboardInterrupt: Ctrl-C was pressed; parts that had begun have ended, but for the one of a single thread.
            BaseException: what the first part that failed raised, when the others that had begun have ended.
        """
        self.stopped = False
        if min(self.num_threads, parts) <= 1:
            for part in range(parts):
                work(0, part)
            return
        todo, errors, lock = iter(range(parts)), [], threading.Lock()

        def take(thread: int) -> None:
            try:
                while not self.stopped:
                    with lock:
                        part = next(todo, None)
                    if part is None:
                        return
                    work(thread, part)
            except BaseException as error:
                errors.append(error)
                self.stopped = True

        others, ended = min(self.num_threads, parts) - 1, threading.Semaphore(0)
        self._hire(others)
        with _CtrlC(self) as ctrl_c:
            for k in range(1, others + 1):
                self._jobs.put((take, k, ended))
            take(0)
            for _ in range(others):
                while not ended.acquire(timeout=_LOOK):
                    pass
        if ctrl_c.pressed:
            raise KeyboardInterrupt
        if errors:
            raise errors[0]

    def check(self) -> None:
        """For long parts, to be called now and then.

        Raises:
            KeyboardInterrupt: nobody wants their result any more.
        """
        if self.stopped:
            raise KeyboardInterrupt

    def _forget_threads(self) -> None:
        self._jobs: queue.SimpleQueue = queue.SimpleQueue()
        self._hired: list[threading.Thread] = []
        weakref.finalize(self, _dismiss, self._jobs, self._hired).atexit = False

    def _hire(self, number: int) -> None:
        while len(self._hired) < number:
            name = f"sheldrake_{len(self._hired)}"
            thread = threading.Thread(target=_serve, args=(self._jobs,), name=name, daemon=True)
            thread.start()
            self._hired.append(thread)


_teams: weakref.WeakSet[ThreadTeam] = weakref.WeakSet()


def _serve(jobs: queue.SimpleQueue) -> None:
    """A thread of a team: does jobs until it is dismissed. It keeps nothing of them while it waits."""
    while (job := jobs.get()) is not None:
        take, k, ended = job
        take(k)
        del job, take
        ended.release()


def _dismiss(jobs: queue.SimpleQueue, hired: list[threading.Thread]) -> None:
    for _ in hired:
        jobs.put(None)


def _stop_all() -> None:
    """At the end of the process nobody waits for a result: threads end while there is memory to work on."""
    teams = list(_teams)
    for team in teams:
        team.stopped = True
        _dismiss(team._jobs, team._hired)
    for team in teams:
        for thread in team._hired:
            thread.join(_PATIENCE)


def _forget_all() -> None:
    """A forked process has but the thread that forked it."""
    for team in list(_teams):
        team._forget_threads()


atexit.register(_stop_all)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_all)


class _CtrlC:
    """While it is entered, Ctrl-C stops a team instead of leaving other threads at work on what nobody waits for."""

    def __init__(self, team: ThreadTeam):
        self._team, self.pressed = team, False

    def __enter__(self) -> _CtrlC:
        here = threading.current_thread() is threading.main_thread()
        self._ours = here and signal.getsignal(signal.SIGINT) is signal.default_int_handler
        if self._ours:
            signal.signal(signal.SIGINT, self._press)
        return self

    def _press(self, *_: object) -> None:
        self.pressed = self._team.stopped = True

    def __exit__(self, *_: object) -> None:
        if self._ours:
            signal.signal(signal.SIGINT, signal.default_int_handler)


def in_parallel(function: Callable[[Item], Result], items: Iterable[Item], num_threads: int | None) -> list[Result]:
    """`[function(x) for x in items]`, on threads; which error is raised, if several fail, is not said."""
    given = list(items)
    found: list[Any] = [None] * len(given)

    def work(_: int, part: int) -> None:
        found[part] = function(given[part])

    ThreadTeam(num_threads).run(work, len(given))
    return found


def threads_of(given: Parallelism | int | bool | None, unless_given: bool) -> int:
    """How many threads a caller wants: a number, a Parallelism, True for as many as there are, False for one."""
    wanted = unless_given if given is None else given
    return (wanted if isinstance(wanted, Parallelism) else Parallelism(wanted)).num_threads()
