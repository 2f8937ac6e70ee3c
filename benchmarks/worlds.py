"""Many worlds of one model: CPU time of a world's step, against one simulator and MuJoCo's batches, in one run.

    python benchmarks/worlds.py [--worlds 1 16 256 4096] [--scenes block arm quadruped clutter] [--rounds 3]
                                [--steps-at-a-time 0] [--threads 1 2]

All worlds begin alike but for random velocities and take the same number of 1 ms steps, from the same beginning in each
turn. "simulator" is a Simulator's native span on one of these worlds, the mean of some. MuJoCo runs as `mujoco.batch`
and as `mujoco.rollout`. Times are the CPU's, of all threads together; speed-ups of threads are of the clock, and mean
nothing on a machine that others use. `--steps-at-a-time 4` calls each engine anew after four steps, as environments do;
`--environments 256` measures a vector environment of quadrupeds, on one thread in time of the processor and on each
number of `--threads` (all processors that this process may use, if none are given) by the clock.
"""

from __future__ import annotations

import argparse
import gc
import os
import pathlib
import resource
import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from benchmarks import arm, contact, drop_the_block, engines, quadruped  # noqa: E402
from benchmarks.turns import machine, ratio, take_turns  # noqa: E402

from sheldrake.systems.analysis import BatchSimulator, Simulator  # noqa: E402
from sheldrake.systems.primitives import VectorLogSink  # noqa: E402

OURS, ALONE = "sheldrake", "simulator"
CPU_SECONDS = {"block": 0.5, "arm": 0.5, "quadruped": 1.0, "clutter": 2.0}
"""What a turn of ours is to take, about."""
STEP = {"block": 0.9e-6, "arm": 1.3e-6, "quadruped": 6e-6, "clutter": 60e-6}
"""What a step takes, about [s]."""
MOST_ALONE = 16
"""Worlds that have a simulator."""


class Scene:
    """A scene in both engines.

    Args:
        name: One of `STEP`.
    """

    def __init__(self, name: str):
        self.ctrl: Any = np.zeros(0)
        if name == "block":
            lib = drop_the_block.library("sheldrake")
            simulator, _, self.plant, _ = drop_the_block.drop(lib, str(drop_the_block.URDF))
            self.model = drop_the_block.MuJoCo().model
        elif name == "arm":
            ours = arm.DrakeLike("sheldrake", motors=False)
            simulator, self.plant = ours.simulator, ours.plant
            self.model, self.ctrl = arm.MuJoCo().model, arm.GOAL
        elif name == "quadruped":
            standing = quadruped.DrakeLike("sheldrake", 0.0)
            standing.turn(0.2)
            simulator, self.plant = standing.simulator, standing.plant
            theirs = quadruped.MuJoCo(0.0)
            theirs.turn(0.2)
            self.model, self.ctrl, self.qpos = theirs.model, quadruped.QUADRUPED.stance(), theirs.data.qpos.copy()
        else:
            bin_of_20 = contact.scene("clutter20")
            clutter, rival = engines.DrakeLike("sheldrake"), engines.MuJoCo()
            for engine in (clutter, rival):
                engine.start(bin_of_20)
                engine.advance(0.5)  # in a heap
            simulator, self.plant = clutter.simulator, clutter.plant
            self.model, self.qpos = rival.model, rival.data.qpos.copy()
        self.diagram, self.context = simulator.get_system(), simulator.get_context()

    def ours(self, count: int, num_threads: int) -> tuple[Any, np.ndarray]:
        """A batch and the states it begins with, those of the whole system."""
        batch = BatchSimulator(self.diagram, count, self.context, num_threads=num_threads)
        x0 = batch.states().copy()
        rng = np.random.default_rng(count)
        plant = slice(self.columns(batch)[0] + self.plant.num_positions(), self.columns(batch)[1])
        x0[:, plant] += 0.05 * rng.normal(size=(count, plant.stop - plant.start))
        return batch, x0

    def columns(self, batch: Any) -> tuple[int, int]:
        """Where the plant's state is among the whole system's."""
        whole, part = batch.states(), batch.states(self.plant)
        first = (part.__array_interface__["data"][0] - whole.__array_interface__["data"][0]) // 8
        return first, first + part.shape[1]

    def theirs(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Positions and velocities with which MuJoCo's worlds begin."""
        qpos = np.tile(getattr(self, "qpos", self.model.qpos0), (count, 1))
        if len(self.ctrl) == 7:
            qpos[:] = arm.START
        return qpos, 0.05 * np.random.default_rng(count).normal(size=(count, self.model.nv))


def again(turn: Callable[[], float]) -> Callable[[], float]:
    """A turn's time at its second time in a row: caches hold what it uses itself, whoever's turn was before."""

    def second() -> float:
        turn()
        return turn()

    return second


def timed(work: Callable[[], Any], steps: int, clock: Callable[[], float]) -> float:
    """Time of a world's step [us]."""
    start = clock()
    work()
    return (clock() - start) / steps * 1e6


def contenders(scene: Scene, count: int, steps: int, at_a_time: int, threads: int, clock: Any) -> dict[str, Any]:
    """Turns of everybody: each begins anew and gives the time of a world's step [us]."""
    import mujoco
    import mujoco.batch
    import mujoco.rollout

    batch, x0 = scene.ours(count, threads)
    parts = [at_a_time] * (steps // at_a_time)

    def ours() -> float:
        batch.Reset()
        batch.states()[:] = x0
        batch.Initialize()
        return timed(lambda: [batch.AdvanceSteps(n) for n in parts], count * steps, clock)

    simulators = [Simulator(scene.diagram, scene.context.Clone()) for _ in range(max(1, min(count, MOST_ALONE)))]
    logs = [system for system in scene.diagram.GetSystems() if isinstance(system, VectorLogSink)]

    def alone() -> float:
        """Several worlds, one after the other, each with logs of its own as in a batch."""
        spent = 0.0
        for simulator, start in zip(simulators, x0):
            context = simulator.get_mutable_context()
            context._store.S[1 : 1 + start.size] = start
            context.SetTime(scene.context.get_time())
            context._store.out_of_date()
            for log in logs:
                log.FindMutableLog(context).Clear()
            simulator.Initialize()
            until = context.get_time() + steps * 1e-3
            spent += timed(lambda s=simulator, t=until: s.AdvanceTo(t), len(simulators) * steps, clock)
        return spent

    model = scene.model
    qpos, qvel = scene.theirs(count)
    rival = mujoco.batch.Batch(model, nsim=count, nthread=threads)
    state = rival.bind("qpos"), rival.bind("qvel")

    def mujoco_batch() -> float:
        rival.reset()
        state[0][:], state[1][:] = qpos, qvel
        if len(scene.ctrl):
            rival.ctrl = np.tile(scene.ctrl, (count, 1))
        return timed(lambda: [rival.step(nstep=n) for n in parts], count * steps, clock)

    data = [mujoco.MjData(model) for _ in range(threads)]
    full = mujoco.mjtState.mjSTATE_FULLPHYSICS
    initial = np.zeros((count, mujoco.mj_stateSize(model, full)))
    for w in range(count):
        data[0].qpos[:], data[0].qvel[:] = qpos[w], qvel[w]
        mujoco.mj_getState(model, data[0], initial[w], full)
    control = np.broadcast_to(scene.ctrl, (count, at_a_time, len(scene.ctrl))).copy() if len(scene.ctrl) else None
    pool = mujoco.rollout.Rollout(nthread=threads if threads > 1 else 0)

    def mujoco_rollout() -> float:
        def work() -> None:
            now = initial
            for n in parts:
                found, _ = pool.rollout(model, data, now, control, nstep=n)
                now = found[:, -1].copy()

        return timed(work, count * steps, clock)

    turns = {OURS: ours, ALONE: alone, "mujoco.batch": mujoco_batch, "mujoco.rollout": mujoco_rollout}
    return {name: again(turn) for name, turn in turns.items()}


def made(scene: Scene, count: int) -> str:
    """How long many contexts take to be made, and their memory."""
    gc.collect()
    before, start = _resident(), time.process_time()
    batch = BatchSimulator(scene.diagram, count)
    seconds, memory = time.process_time() - start, _resident() - before
    slabs = count * scene.context._store.S.nbytes / 2**20
    start = time.perf_counter()
    batch.parameters()[:, 0] = np.arange(count)
    assign = time.perf_counter() - start
    batch.parameters()[:, 0] = batch.parameters()[0, 0]
    text = f"{count} contexts made in {seconds:.2f} s of the CPU, {memory:.0f} MiB; slabs {slabs:.0f} MiB"
    return f"{text}; a parameter of all set in {assign * 1e3:.2f} ms"


def _resident() -> float:
    """Memory of this process [MiB]."""
    if sys.platform == "linux":
        pages = int(pathlib.Path("/proc/self/statm").read_text().split()[1])
        return pages * resource.getpagesize() / 2**20
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20


def environments(count: int, rounds: int, num_threads: int, clock: Callable[[], float]) -> str:
    """What is said of `count` quadrupeds in a vector environment, 4 ms of 1 ms steps an action."""
    from sheldrake.gym._tasks import QuadrupedStand

    env = QuadrupedStand(count, num_threads=num_threads)
    native, random, spent = env.batch._native, np.random.default_rng(0), [0.0]

    def watched(work: Callable[..., None]) -> Callable[..., None]:
        def watching(*args: Any) -> None:
            begin = clock()
            work(*args)
            spent[0] += clock() - begin

        return watching

    native.roll_out, native.call_each = watched(native.roll_out), watched(native.call_each)  # type: ignore[method-assign]
    actions = random.uniform(-0.3, 0.3, (50, count, 12))
    env.reset(seed=0)
    found = []
    for _ in range(rounds):
        begin, spent[0] = clock(), 0.0
        for action in actions:
            env.step(action)
        total = clock() - begin
        found.append((total, 1.0 - spent[0] / total))
    total, outside = min(found)
    rate = len(actions) * count / total
    by = "of one processor" if clock is time.process_time else f"by the clock on {num_threads} threads"
    return (
        f"environments: {count} quadrupeds, 4 steps an action: {rate:,.0f} env-steps a second {by}, "
        f"{100 * outside:.1f} % of it outside native code"
    )


def processors() -> int:
    """How many this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--worlds", type=int, nargs="*", default=[1, 16, 256, 4096])
    parser.add_argument("--scenes", nargs="*", default=list(STEP))
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--steps-at-a-time", type=int, default=0)
    parser.add_argument("--threads", type=int, nargs="*", default=[])
    parser.add_argument("--environments", type=int, metavar="N", help="N quadrupeds in a vector environment, alone")
    options = parser.parse_args()
    print(machine())
    if options.environments:
        print(environments(options.environments, options.rounds, 1, time.process_time), flush=True)
        for threads in options.threads or [processors()]:
            print(environments(options.environments, options.rounds, threads, time.perf_counter), flush=True)
        return
    options.threads = options.threads or [1]
    print(f"{'scene':11s}{'worlds':>7s}{'steps':>7s}{'threads':>8s}{'us a step':>10s}   others / sheldrake", flush=True)
    for name in options.scenes:
        scene = Scene(name)
        if name == "quadruped":
            print(f"{name:11s}{made(scene, 10_000)}")
        for count in options.worlds:
            steps = int(np.clip(CPU_SECONDS[name] / STEP[name] / count, 20, 5000)) // 20 * 20
            walls = {}
            for threads in options.threads:
                at_a_time = options.steps_at_a_time or steps
                turns = contenders(scene, count, steps, at_a_time, threads, time.process_time)
                times = take_turns(turns, options.rounds)
                others = ", ".join(f"{n} {ratio(times, n, OURS)}" for n in times if n != OURS)
                us = statistics.median(times[OURS])
                print(f"{name:11s}{count:7d}{steps:7d}{threads:8d}{us:10.3f}   {others}", flush=True)
                turns = contenders(scene, count, steps, at_a_time, threads, time.perf_counter)
                walls[threads] = min(take_turns({OURS: turns[OURS]}, options.rounds)[OURS])
            for threads in options.threads[1:]:
                print(f"{'':11s}{threads} threads give {walls[options.threads[0]] / walls[threads]:.2f} times as many")


if __name__ == "__main__":
    main()
