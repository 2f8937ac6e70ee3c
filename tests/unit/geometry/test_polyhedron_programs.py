"""Linear programs about polyhedra."""

import numpy as np
import pytest

from sheldrake.geometry.optimization import _polyhedron_programs as programs


@pytest.mark.parametrize("seed", range(25))
def test_boxes_need_no_program_and_give_the_same_as_one(seed, monkeypatch):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    A = np.zeros((int(rng.integers(1, 9)), n))
    A[np.arange(len(A)), rng.integers(0, n, len(A))] = rng.normal(size=len(A))
    A[rng.random(len(A)) < 0.1] = 0.0
    b, direction = rng.normal(0.5, 1.0, len(A)), rng.normal(size=n) * (rng.random(n) < 0.7)
    monkeypatch.setattr(programs, "box_of", lambda *_: None)
    by_program = programs.largest(A, b, direction), programs.point(A, b) is None
    monkeypatch.undo()
    monkeypatch.setattr(programs, "_linear_program", None)
    assert programs.largest(A, b, direction) == pytest.approx(by_program[0], abs=1e-9)
    x = programs.point(A, b)
    assert (x is None) == by_program[1]
    assert x is None or np.all(A @ x <= b + 1e-9)
