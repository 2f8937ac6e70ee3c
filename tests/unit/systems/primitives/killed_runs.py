"""Runs that are killed, and what their logs lack."""

import os
import pathlib
import subprocess
import sys
import time

import numpy as np

from sheldrake.systems.primitives import ReadLogs

HERE = pathlib.Path(__file__).parent
ROOT = HERE.parents[3]


def start_run(path, rate=1.0, work=0.0, scene="clock"):
    """Starts `stream_run.py` in a process of its own; returns once it runs."""
    words = [sys.executable, str(HERE / "stream_run.py"), str(path), str(rate), str(work), scene]
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src"), "SHELDRAKE_PROGRESS": "0"}
    process = subprocess.Popen(words, env=environment, stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "running\n"
    return process


def lost_by(path):
    """How much of what a run had done its log lacks [s], in real time."""
    logs = ReadLogs(path)
    assert logs.is_complete is False
    for log in logs.values():
        assert log.num_samples() > 0
        assert (np.diff(log.sample_times()) > 0).all()
    clock = next(log for title, log in logs.items() if title.startswith("clock"))
    assert {log.num_samples() - clock.num_samples() for log in logs.values()} <= {-1, 0, 1}
    (reached,) = np.fromfile(f"{path}.reached")
    assert reached >= clock.data()[0, -1]
    return reached - clock.data()[0, -1]


def kill_at_moments(folder, moments, **options):
    """Runs side by side, each killed at its moment [s] after it began; what each of their logs lacks [s]."""
    runs = []
    try:
        for number, moment in enumerate(moments):
            path = folder / f"run{number}.log"
            runs.append((start_run(path, **options), time.monotonic() + moment, path))
        for process, moment, _ in sorted(runs, key=lambda run: run[1]):
            time.sleep(max(0.0, moment - time.monotonic()))
            assert process.poll() is None, "the run was over before it was killed"
            process.kill()
            process.wait()
    finally:
        for process, _, _ in runs:
            process.kill()
            process.wait()
            process.stdout.close()
    return [lost_by(path) for _, _, path in runs]
