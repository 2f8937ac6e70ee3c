"""A logged run that somebody else ends: its samples are the real time at which they were taken.

The last of these times is also in a small mapped file: what the run had reached when it was ended.
"""

import mmap
import sys
import time

import numpy as np

import sheldrake
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import BasicVector, DiagramBuilder, LeafSystem
from sheldrake.systems.primitives import LogVectorOutput, StreamLogs


class Clock(LeafSystem):
    """Tells the real time [s]."""

    def __init__(self, work, reached):
        super().__init__()
        self._work, self._reached = work, reached
        self.DeclarePeriodicDiscreteUpdateEvent(1e-3, 0.0, lambda context, state: None)
        self.DeclareVectorOutputPort("real_time", BasicVector(1), self._tell, {self.time_ticket()})

    def _tell(self, context, output):
        time.sleep(self._work)
        now = np.array([time.monotonic()])
        output.SetFromVector(now)
        self._reached[:8] = now.tobytes()


def add_block(builder):
    """A block that lies on the ground, and its logged state."""
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    Parser(plant).AddModels(sheldrake.model_path("two_hole_block/two_hole_block.urdf"))
    plant.Finalize()
    LogVectorOutput(plant.get_state_output_port(), builder)


if __name__ == "__main__":
    path, rate, work, with_block = sys.argv[1], float(sys.argv[2]), float(sys.argv[3]), sys.argv[4] == "block"
    builder = DiagramBuilder()
    with open(path + ".reached", "w+b") as file:
        file.write(bytes(8))
        file.flush()
        reached = mmap.mmap(file.fileno(), 8)
    if with_block:
        add_block(builder)
    clock = builder.AddNamedSystem("clock", Clock(work, reached))
    LogVectorOutput(clock.get_output_port(), builder)
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    simulator.set_target_realtime_rate(rate)
    StreamLogs(simulator, path)
    print("running", flush=True)
    simulator.AdvanceTo(60.0 if rate else 1e9)
    print("over", flush=True)
