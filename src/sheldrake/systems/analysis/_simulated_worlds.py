"""Worlds that need Python while they advance: each has a simulator."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from sheldrake.common._thread_team import ThreadTeam
from sheldrake.systems.analysis._rollout import RolloutPlan
from sheldrake.systems.analysis._simulator import Simulator
from sheldrake.systems.analysis._status import SimulatorStatus
from sheldrake.systems.framework._engine.worlds import Worlds
from sheldrake.systems.framework._kernels import program as _program
from sheldrake.systems.framework._kernels.worlds import OUTPUTS, Progress

_TERMINATED = SimulatorStatus.ReturnReason.kReachedTerminationCondition


class SimulatedWorlds:
    """Advances worlds by a Simulator each, on threads that take turns where they run Python.

    Args:
        worlds: Their memory.
        team: Threads.
        make: Gives the simulator of a store.
        errors: What worlds raised is put here, by number.
    """

    def __init__(
        self, worlds: Worlds, team: ThreadTeam, make: Callable[[Any], Simulator], errors: dict[int, BaseException]
    ):
        self._worlds, self._team, self._make, self._errors = worlds, team, make, errors
        self._simulators: dict[int, Simulator] = {}

    def simulator(self, w: int) -> Simulator:
        """The simulator of world `w`, made when first asked for."""
        if w not in self._simulators:
            self._simulators[w] = self._make(self._worlds.store(w))
        return self._simulators[w]

    def roll_out(self, plan: RolloutPlan, count: int, samples: int) -> None:
        """Takes the first `count` worlds of a plan through its samples; their codes say how it went."""

        def work(_: int, part: int) -> None:
            self._guarded(int(plan.rollout.who[part]), self._roll_out, plan, part, samples)

        self._team.run(work, count)

    def call_each(self, plan: RolloutPlan, count: int, callee: int) -> None:
        """Begins the first `count` worlds of a plan, or computes its outputs."""

        def work(_: int, part: int) -> None:
            w = int(plan.rollout.who[part])
            self._guarded(w, self._compute if callee == OUTPUTS else self._begin, w, plan)

        self._team.run(work, count)

    def _guarded(self, w: int, do: Callable[..., int], *args: object) -> None:
        """Does something with a world and notes how it went."""
        try:
            code = do(*args)
        except Exception as error:
            self._errors[w], code = error, _program.ERROR
        self._worlds.progress[w, Progress.code] = code

    def _begin(self, w: int, _: RolloutPlan) -> int:
        self._worlds.store(w).out_of_date()
        self.simulator(w)._initialize_anew()
        return _program.DONE

    def _compute(self, w: int, plan: RolloutPlan) -> int:
        store = self._worlds.store(w)
        store.out_of_date()
        for r in plan.rows:
            store.pull(r)
        return _program.DONE

    def _roll_out(self, plan: RolloutPlan, j: int, samples: int) -> int:
        rollout, w = plan.rollout, int(plan.rollout.who[j])
        simulator, store = self.simulator(w), self._worlds.store(w)
        if len(rollout.state):
            self._worlds.set_back(rollout.who[j : j + 1])
            store.S[1 : 1 + rollout.state.shape[1]] = rollout.state[j]
        a, b, c, d = rollout.time[j].tolist()
        for k in range(samples):
            store.S[rollout.inputs_at] = rollout.inputs[j * samples + k] if len(rollout.inputs_at) else ()
            store.out_of_date()
            if k == 0 and len(rollout.state):
                simulator._initialize_anew()
            status = simulator.AdvanceTo(a + b * (c + d * k))
            if status.reason() is _TERMINATED:
                return _program.TERMINATED
            for r in plan.rows:
                store.pull(r)
            if len(rollout.outputs_at):
                rollout.outputs[j * samples + k] = store.S[rollout.outputs_at]
            self._worlds.progress[w, Progress.sample] = k + 1
        return _program.DONE
