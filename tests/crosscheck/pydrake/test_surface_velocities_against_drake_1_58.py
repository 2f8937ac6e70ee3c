"""Belts as in Drake 1.58: states, forces, slip, derivatives equal numbers that its wheel printed (`belts.py`)."""

from pathlib import Path

import numpy as np
import pytest
from belts import all_numbers

TABLE = Path(__file__).with_name("belt_numbers.txt")


def measured():
    rows = [line.split(":") for line in TABLE.read_text().splitlines() if not line.startswith("#")]
    return {name: np.array(numbers.split(), dtype=float) for name, numbers in rows}


def differing(expected, found):
    """Names of rows that differ by more than rounding; contact is stiff: 1e-16 in a depth is 1e-11 in a force."""
    assert sorted(expected) == sorted(found)
    return [n for n, row in expected.items() if not np.allclose(found[n], row, rtol=1e-10, atol=1e-11)]


def test_numbers_are_those_of_drake_1_58():
    assert differing(measured(), all_numbers("sheldrake")) == []


def test_the_table_tells_a_surface_that_runs_the_other_way(monkeypatch):
    from sheldrake.multibody.plant._step.surface_speeds import SurfaceSpeeds

    speeds = SurfaceSpeeds.speeds
    monkeypatch.setattr(SurfaceSpeeds, "speeds", lambda self, context: speeds(self, context) * [1.0, -1.0])
    assert len(differing(measured(), all_numbers("sheldrake"))) == len(measured())


@pytest.mark.peer
def test_the_table_is_that_of_the_wheel_at_hand():
    pydrake = pytest.importorskip("pydrake")
    if not hasattr(pytest.importorskip("pydrake.multibody.plant").MultibodyPlant, "SetSurfaceVelocityAxis"):
        pytest.skip(f"the Drake at {pydrake.__file__} has no belts")
    assert differing(measured(), all_numbers("pydrake")) == []
