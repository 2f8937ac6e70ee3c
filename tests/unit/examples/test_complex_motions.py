"""Derivatives of the examples' motion by machine code on complex numbers are those by duals."""

import numpy as np
import pytest

from sheldrake.autodiffutils import _complex_step
from sheldrake.common.kernel import jit_enabled
from sheldrake.examples import (
    AcrobotPlant,
    CompassGait,
    PendulumPlant,
    QuadrotorPlant,
    VanDerPolOscillator,
)
from sheldrake.systems.framework._engine.linear_rows import ByComplexSteps, rows_of_motion

pytestmark = pytest.mark.skipif(not jit_enabled(), reason="asks about machine code; SHELDRAKE_JIT=0 switches it off")


@pytest.mark.parametrize("make", [AcrobotPlant, CompassGait, PendulumPlant, QuadrotorPlant, VanDerPolOscillator])
def test_machine_code_and_duals(make, monkeypatch):
    system, rng, found = make(), np.random.default_rng(3), []
    i = 0 if system.num_input_ports() else None
    for patience in (0, 10**9):
        monkeypatch.setattr(_complex_step, "PATIENCE", patience)
        monkeypatch.setattr(
            "sheldrake.systems.framework._engine.complex_rows.kernel_store.is_ready", lambda kernel: False
        )
        monkeypatch.setattr("sheldrake.systems.framework._engine.complex_rows._calls", {})
        context = system.CreateDefaultContext()
        rng = np.random.default_rng(3)
        n = context.num_continuous_states()
        context.SetContinuousState(rng.uniform(-0.5, 0.5, n))
        if i is not None:
            port = system.get_input_port(0)
            port.FixValue(context, rng.uniform(-1, 1, port.size()))
        rows, seeds, wanted = rows_of_motion(system, context, n, i, None, 0.0)
        assert isinstance(rows, ByComplexSteps) is (patience == 0)
        found.append(rows.evaluate(seeds, wanted))
        if patience == 0:
            numbers = context._store.S[seeds].astype(float)
            for slopes in (True, False):
                values, by_inputs = rows.function(seeds, wanted)(0.0, numbers, slopes)
                np.testing.assert_array_equal(values, found[0][0])
                assert by_inputs.shape == (n, len(seeds) if slopes else 0)
    for quick, slow in zip(*found):
        np.testing.assert_allclose(quick, slow, rtol=1e-12, atol=1e-12)
    assert np.abs(found[0][1]).max() > 0.1
