"""The falling block on kernels as they are: compiled, as plain Python, or with bounds checks."""

from __future__ import annotations

import numpy as np
from tests.scenes.scene import drop, library

import sheldrake


def test_a_short_fall_ends_where_free_fall_and_a_touch_put_it():
    """Until it touches, the block falls freely; 20 steps later it has slowed down and not sunk."""
    ours = library("sheldrake")
    block = sheldrake.model_path("two_hole_block/two_hole_block.urdf")
    simulator, sink, *_ = drop(ours, block, height=0.005, rpy=(0.0, 0.0, 0.1))
    simulator.AdvanceTo(0.045)
    log = sink.FindLog(simulator.get_context())
    t, z, vz = log.sample_times(), log.data()[6], log.data()[12]
    flying = t < 0.03
    np.testing.assert_allclose(vz[flying], -9.81 * t[flying], rtol=1e-12, atol=1e-15)
    steps = np.arange(len(t))
    np.testing.assert_allclose(z[flying], (0.005 - 9.81e-6 * steps * (steps + 1) / 2)[flying], atol=1e-15)
    assert abs(vz[-1]) < 0.1 * abs(vz[flying][-1])
    assert -2e-4 < z[-1] < 1e-4
