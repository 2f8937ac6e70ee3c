"""Linear programs about polyhedra."""

import numpy as np
import pytest

from sheldrake.geometry.optimization import ConvexSet, HPolyhedron, Hyperrectangle, Point
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
    monkeypatch.setattr(programs, "maximize", None)
    assert programs.largest(A, b, direction) == pytest.approx(by_program[0], abs=1e-9)
    x = programs.point(A, b)
    assert (x is None) == by_program[1]
    assert x is None or np.all(A @ x <= b + 1e-9)


@pytest.mark.parametrize("seed", range(40))
def test_sets_known_by_their_faces_meet_where_the_program_says_so(seed, monkeypatch):
    rng = np.random.default_rng(seed)

    def some_set():
        kind, low = rng.integers(0, 4), rng.uniform(-1.0, 1.0, 2)
        if kind == 0:
            return Point(low)
        if kind == 1:
            return Hyperrectangle(low, low + rng.uniform(0.0, 1.0, 2))
        if kind == 2:
            return HPolyhedron.MakeBox(low, low + rng.uniform(0.0, 1.0, 2))
        directions = rng.normal(size=(4, 2))
        return HPolyhedron(np.vstack((directions, np.eye(2), -np.eye(2))), np.append(directions @ low + 0.3, 4 * [2.0]))

    a, b = some_set(), some_set()
    found = a.IntersectsWith(b), b.IntersectsWith(a)
    for cls in (Point, Hyperrectangle, HPolyhedron):
        monkeypatch.setattr(cls, "_faces", ConvexSet._faces)
    assert found == (a.IntersectsWith(b), b.IntersectsWith(a))


def test_sets_that_only_touch_meet():
    box = HPolyhedron.MakeBox([0.0, 0.0], [0.1 + 0.2, 1.0])
    assert box.IntersectsWith(Hyperrectangle([0.3, 1.0], [1.0, 2.0]))
    assert box.IntersectsWith(Point([0.3, 0.5])) and not box.IntersectsWith(Point([0.31, 0.5]))
