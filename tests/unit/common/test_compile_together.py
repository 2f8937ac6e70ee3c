"""Several kernels compiled at once: every one of them, once, whoever comes first."""

import os

import pytest

from sheldrake.common._native import parallel, store
from sheldrake.multibody.plant._kernels.step import next_state
from sheldrake.multibody.tree._kernels.dynamics import body_inertias
from sheldrake.multibody.tree._kernels.kinematics import body_velocities

KERNELS = [next_state, body_velocities, body_inertias]


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty cache, and no prebuilt kernels."""
    for name, value in (("CACHE_DIR", str(tmp_path)), ("PREBUILT", "0"), ("QUIET", "1")):
        monkeypatch.setenv(f"SHELDRAKE_{name}", value)
    for kernel in KERNELS:
        monkeypatch.delitem(kernel.__dict__, "_native", raising=False)
    return tmp_path


def objects(cache):
    return sorted(p.name.split("-")[0] for p in cache.rglob("*.o"))


@pytest.mark.parametrize("processors", [1, 3])
def test_all_kernels_are_there_and_each_was_compiled_once(cache, monkeypatch, processors):
    monkeypatch.setattr(os, "cpu_count", lambda: processors)
    here = []
    make = store.make
    monkeypatch.setattr(store, "make", lambda kernel, tell=True: here.append(kernel.__name__) or make(kernel, tell))
    parallel.prepare(KERNELS)
    assert all(store.is_ready(k) for k in KERNELS)
    assert objects(cache) == sorted(k.__name__ for k in KERNELS)
    assert len(here) == len(set(here)) and (processors > 1 or len(here) == 3)
    times = [p.stat().st_mtime_ns for p in cache.rglob("*.o")]
    parallel.prepare(KERNELS)
    assert [p.stat().st_mtime_ns for p in cache.rglob("*.o")] == times


def test_a_queue_gives_each_item_to_one_process():
    items = [f"item {i}" for i in range(300)]
    queue = parallel._queue(len(items))
    first, second = parallel._next(items, queue), parallel._next(items, queue)
    taken = [next(first), next(second), next(second), *first, *second]
    os.close(queue)
    assert taken == items


def test_a_worker_that_dies_leaves_its_kernel_to_whoever_uses_it(cache, monkeypatch):
    class Dead:
        def wait(self):
            return 1

    def start(kernels, queue):
        next(parallel._next(kernels, queue))  # takes one and dies
        return Dead()

    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    monkeypatch.setattr(parallel, "_start", start)
    parallel.prepare(KERNELS)
    missing = [k for k in KERNELS if not store.is_ready(k)]
    assert len(missing) == 1 and len(objects(cache)) == 2
    assert missing[0].address != 0 and objects(cache) == sorted(k.__name__ for k in KERNELS)
