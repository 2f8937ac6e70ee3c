"""A logged run that somebody else ends: its samples are the real time at which they were taken.

The last of these times is also in a small mapped file: what the run had reached when it was ended.
"""

import mmap
import sys
import time

import numpy as np

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


if __name__ == "__main__":
    path, rate, work = sys.argv[1], float(sys.argv[2]), float(sys.argv[3])
    builder = DiagramBuilder()
    with open(path + ".reached", "w+b") as file:
        file.write(bytes(8))
        file.flush()
        reached = mmap.mmap(file.fileno(), 8)
    clock = builder.AddNamedSystem("clock", Clock(work, reached))
    LogVectorOutput(clock.get_output_port(), builder)
    simulator = Simulator(builder.Build())
    simulator.set_target_realtime_rate(rate)
    StreamLogs(simulator, path)
    print("running", flush=True)
    simulator.AdvanceTo(60.0 if rate else 1e9)
