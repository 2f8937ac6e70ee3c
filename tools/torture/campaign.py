"""A campaign: numbered trials, each with chance of its own, in processes of their own.

A trial ends well when it returns. AssertionError is a promise that was broken without a word ("silent"); any other
exception is an error that no user should see ("unclear"). A process that dies is a crash of the trial it was at; one
that takes longer than the campaign's limit is ended by a signal that Python does not handle, so that machine code
cannot hold it up: a hang. The campaign goes on with the next trial in a new process.
"""

from __future__ import annotations

import json
import mmap
import os
import pathlib
import random
import resource
import signal
import struct
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from typing import NamedTuple

ROOT = pathlib.Path(__file__).parents[2]
MEMORY = 8 << 30  # [bytes] of addresses a process may have
WORST = 10  # failures of one campaign that are told in full, and after which it ends


class Campaign(NamedTuple):
    """What is tried.

    Attributes:
        name: As in the table.
        trial: Takes its chance and its number.
        trials: How many a whole run has.
        limit: A trial takes less processor time than this [s]; and less than ten times as much of the clock's.
        says: What holds, in the words of the table.
        environment: Of its processes, beside what there is.
        each: A trial is so many, as the table counts.
    """

    name: str
    trial: Callable[[random.Random, int], None]
    trials: int
    limit: float
    says: str
    environment: dict[str, str] = {}
    each: int = 1


class Failure(NamedTuple):
    """A trial that went wrong: "crash", "hang", "silent" or "unclear"."""

    number: int
    kind: str
    text: str


class Outcome(NamedTuple):
    """What a campaign found; `seconds` of the clock, `cpu` of its processes' time."""

    campaign: Campaign
    trials: int
    failures: list[Failure]
    seconds: float
    cpu: float

    def count(self, kind: str) -> int:
        """Failures of a kind."""
        return sum(f.kind == kind for f in self.failures)


def work(campaign: Campaign, seed: int, first: int, end: int, seconds: float, path: str) -> None:
    """Runs trials, in a process of its own; the file has the number of the trial at hand and how many are done."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    start, wrong = time.monotonic(), 0
    with open(path, "r+b") as file, mmap.mmap(file.fileno(), 16) as shared:
        for number in range(first, end):
            if time.monotonic() - start > seconds or wrong >= WORST:
                break
            struct.pack_into("qq", shared, 0, number, number - first)
            signal.setitimer(signal.ITIMER_PROF, campaign.limit)
            signal.setitimer(signal.ITIMER_REAL, 10 * campaign.limit)
            try:
                campaign.trial(random.Random(f"{campaign.name} {seed} {number}"), number)
            except AssertionError:
                tell(number, "silent")
                wrong += 1
            except Exception:
                tell(number, "unclear")
                wrong += 1
            struct.pack_into("qq", shared, 0, number + 1, number - first + 1)
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def tell(number: int, kind: str) -> None:
    """Writes a failure for the process that started this one."""
    print(json.dumps([number, kind, traceback.format_exc(limit=-6)]), file=sys.stderr, flush=True)


def run(campaign: Campaign, trials: int, seconds: float, seed: int) -> Outcome:
    """Runs a campaign.

    Args:
        campaign: What is tried.
        trials: How many.
        seconds: Ends it early [s].
        seed: Of all its chance.
    """
    start, number, done, failures = time.monotonic(), 0, 0, []
    before = _cpu_of_children()
    path = os.pathsep.join(os.path.abspath(p) for p in sys.path)
    environment = {**os.environ, "PYTHONPATH": path, "PYTHONFAULTHANDLER": "1", "SHELDRAKE_QUIET": "1"}
    environment |= campaign.environment
    while number < trials and (left := seconds - (time.monotonic() - start)) > 0 and len(failures) < WORST:
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder, "progress")
            path.write_bytes(struct.pack("qq", number, 0))
            trial = f"{campaign.trial.__module__}:{campaign.trial.__name__}"
            words = [
                campaign.name,
                trial,
                str(campaign.limit),
                str(seed),
                str(number),
                str(trials),
                str(left),
                str(path),
            ]
            command = [sys.executable, "-m", "tools.torture.child", *words]
            found = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
            number, count = struct.unpack("qq", path.read_bytes())
        done += count
        lines = found.stderr.splitlines()
        failures += [Failure(*json.loads(line)) for line in lines if line.startswith("[")]
        if found.returncode == 0:
            break
        is_hang = -found.returncode in (signal.SIGPROF, signal.SIGALRM)
        failures.append(
            Failure(number, "hang" if is_hang else "crash", f"status {found.returncode}\n" + "\n".join(lines[-30:]))
        )
        number, done = number + 1, done + 1
    return Outcome(campaign, done, failures, time.monotonic() - start, _cpu_of_children() - before)


def _cpu_of_children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
