"""What takes minutes: `python dev.py endure`. Not part of the ordinary tests."""

import numpy as np
from tests.unit.systems.primitives.killed_runs import kill_at_moments

AT_ONCE = 5  # runs side by side: they keep in step with real time on two processors


def test_a_logged_minute_killed_twenty_times(tmp_path):
    """At any moment of a run of 60 s: the file opens, and lacks less than a second."""
    moments = np.random.default_rng(60).uniform(0.0, 59.0, 20)
    lost = []
    for number, some in enumerate(moments.reshape(-1, AT_ONCE)):
        folder = tmp_path / str(number)
        folder.mkdir()
        lost += kill_at_moments(folder, some.tolist(), scene="block")
    for moment, seconds in sorted(zip(moments.tolist(), lost)):
        print(f"killed after {moment:5.2f} s: {1e3 * seconds:6.1f} ms lost")
    assert max(lost) < 1.0, lost
