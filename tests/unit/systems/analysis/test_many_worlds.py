"""Worlds in chunks, here and by other engines: the same numbers, in order."""

import os
import signal
import sys
import time

import numpy as np
import pytest

from sheldrake.examples import PendulumPlant
from sheldrake.systems.analysis import SimulateWorlds
from sheldrake.systems.framework import DiagramBuilder


def make():
    """A pendulum without torque."""
    builder = DiagramBuilder()
    pendulum = builder.AddSystem(PendulumPlant())
    builder.ExportInput(pendulum.get_input_port(), "torque")
    return builder.Build()


def swing(batch, worlds):
    """Random beginnings, of each world's own stream, and where they lead."""
    draws = [batch.generator(i)() for i in range(batch.num_worlds())]
    x = batch.states()
    x[:, 0] = np.array(draws) / 2.0**32
    batch.inputs(batch.get_system().get_input_port(0))[:] = 0.0
    batch.AdvanceTo(0.2)
    return {"world": worlds, "x": x}


def alone(num_worlds=20):
    return SimulateWorlds(make(), swing, num_worlds, chunk_size=num_worlds)


def assert_same(found, expected):
    assert found["world"].tolist() == list(range(len(expected["world"])))
    assert np.array_equal(found["x"], expected["x"]) and found["x"][:, 0].std() > 0.1


@pytest.mark.parametrize("chunk_size", [1, 7, 20, 50])
def test_chunks_change_nothing(chunk_size):
    assert_same(SimulateWorlds(make, swing, 20, chunk_size=chunk_size, num_threads=2), alone())


def test_another_seed_gives_other_worlds():
    assert not np.array_equal(SimulateWorlds(make, swing, 5, seed=1)["x"], alone(5)["x"])


def test_progress_is_told_after_each_chunk(capsys):
    told = []
    SimulateWorlds(make, swing, 20, chunk_size=8, progress=told.append)
    assert [now.done for now in told] == [8, 16, 20]
    assert all(now.total == 20 and now.rate > 0.0 and now.seconds_left >= 0.0 for now in told)
    assert told[-1].seconds_left == 0.0
    SimulateWorlds(make, swing, 20, progress=True)
    assert "20 of 20 worlds" in capsys.readouterr().err


def test_tuples_and_single_arrays_are_joined_too():
    pair = SimulateWorlds(make, lambda batch, worlds: (worlds, 2 * worlds), 5, chunk_size=2)
    assert [part.tolist() for part in pair] == [[0, 1, 2, 3, 4], [0, 2, 4, 6, 8]]
    assert SimulateWorlds(make, lambda batch, worlds: worlds, 5, chunk_size=2).tolist() == [0, 1, 2, 3, 4]


def test_what_cannot_be_is_refused(monkeypatch):
    with pytest.raises(ValueError, match=r"num_worlds \(0\)"):
        SimulateWorlds(make, swing, 0)
    with pytest.raises(ValueError, match="'dask'; there are 'here', 'joblib', 'ray'"):
        SimulateWorlds(make, swing, 3, engine="dask")
    with pytest.raises(TypeError, match="systems do not travel"):
        SimulateWorlds(make(), swing, 3, engine="joblib")
    with pytest.raises(ValueError, match=r"shape \(2,\) for 3 worlds"):
        SimulateWorlds(make, lambda batch, worlds: np.zeros(2), 3)
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(ModuleNotFoundError, match=r"sheldrake\[ray\]"):
        SimulateWorlds(make, swing, 3, engine="ray")


def test_threads_of_joblib():
    joblib = pytest.importorskip("joblib")
    with joblib.parallel_config(backend="threading", n_jobs=2):
        assert_same(SimulateWorlds(make, swing, 20, chunk_size=6, engine="joblib"), alone())


def by_value(cloudpickle):
    """Workers do not find this module: its functions travel as they are, as those of a script do."""
    cloudpickle.register_pickle_by_value(sys.modules[__name__])


@pytest.mark.slow
def test_processes_of_joblib():
    joblib = pytest.importorskip("joblib")
    by_value(pytest.importorskip("cloudpickle"))
    with joblib.parallel_config(backend="loky", n_jobs=2):
        assert_same(SimulateWorlds(make, swing, 20, chunk_size=6, engine="joblib"), alone())


@pytest.mark.slow
def test_a_killed_worker_of_a_cluster_costs_its_chunk_alone(tmp_path):
    """Two nodes; the first worker that begins a chunk after the third is killed there."""
    ray = pytest.importorskip("ray")
    from ray.cluster_utils import Cluster

    by_value(ray.cloudpickle)

    def job(batch, worlds):
        name = f"{worlds[0]:03d}-{os.getpid()}-{time.monotonic_ns()}"
        (tmp_path / name).touch()
        if worlds[0] >= 9:
            try:
                os.close(os.open(tmp_path / "killed", os.O_CREAT | os.O_EXCL))
            except FileExistsError:
                pass
            else:
                os.kill(os.getpid(), signal.SIGKILL)
        return swing(batch, worlds)

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    try:
        cluster.add_node(num_cpus=1)
        found = SimulateWorlds(make, job, 24, chunk_size=3, engine="ray", address=cluster.address)
        assert sum(node["Alive"] for node in ray.nodes()) == 2
    finally:
        ray.shutdown()
        cluster.shutdown()
    assert_same(found, alone(24))
    begun = sorted(path.name[:3] for path in tmp_path.iterdir() if path.name != "killed")
    assert sorted(set(begun)) == [f"{k:03d}" for k in range(0, 24, 3)]
    assert len(begun) == 9, "the chunk whose worker was killed has begun twice, the others once"
