"""Threads that share work out among themselves."""

from __future__ import annotations

import concurrent.futures
import operator
import signal
import threading
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from sheldrake.common._parallelism import Parallelism

Item = TypeVar("Item")
Result = TypeVar("Result")
_LOOK = 0.05
"""How often the calling thread looks for Ctrl-C while it waits for the others [s]."""


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
        self._pool: concurrent.futures.ThreadPoolExecutor | None = None

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

        with _CtrlC(self) as ctrl_c:
            others = [self._threads().submit(take, k) for k in range(1, min(self.num_threads, parts))]
            take(0)
            while others:
                others = list(concurrent.futures.wait(others, timeout=_LOOK).not_done)
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

    def _threads(self) -> concurrent.futures.ThreadPoolExecutor:
        if self._pool is None:
            self._pool = concurrent.futures.ThreadPoolExecutor(self.num_threads - 1, "sheldrake")
        return self._pool


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
