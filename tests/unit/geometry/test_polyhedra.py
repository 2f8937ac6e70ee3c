"""Short cuts for half spaces say what the linear programs they save would."""

import numpy as np
import pytest

from sheldrake.geometry.optimization import HPolyhedron, VPolytope
from sheldrake.geometry.optimization import _polyhedron_programs as programs


def random_half_spaces(seed):
    """Some with rows twice, at another scale or farther away, with a box around or empty."""
    rng = np.random.default_rng(seed)
    d, m = int(rng.integers(1, 5)), int(rng.integers(2, 16))
    A, b = rng.normal(size=(m, d)), rng.uniform(0.2, 2.0, m)
    if seed % 3 == 0:
        A, b = np.vstack((A, 2.0 * A[: m // 2])), np.append(b, b[: m // 2] * (2.0 if seed % 2 else 2.4))
    if seed % 4 == 0:
        A, b = np.vstack((A, np.eye(d), -np.eye(d))), np.append(b, np.ones(2 * d))
    return A, b - 0.5 * (seed % 7 == 0)


def test_rows_are_redundant_as_one_linear_program_each_says(monkeypatch):
    problems = [random_half_spaces(seed) for seed in range(40)]
    met = sum(int(programs._met_alone(*problem, 1e-9).sum()) for problem in problems)
    found = [programs.redundant(*problem, 1e-9) for problem in problems]
    monkeypatch.setattr(programs, "_met_alone", lambda A, b, tol: np.zeros(len(b), bool))
    monkeypatch.setattr(programs, "_last_of_equals", lambda A, b: np.ones(len(b), bool))
    assert found == [programs.redundant(*problem, 1e-9) for problem in problems]
    assert met > 100 and sum(map(len, found)) > 50  # both happen


def test_of_equal_rows_the_last_is_kept():
    A, b = np.array([[1.0, 0.0], [2.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), np.array([1.0, 2.0, 1.5, 1.0])
    np.testing.assert_array_equal(programs._last_of_equals(A, b), [False, True, True, True])
    assert programs.redundant(A, b, 1e-9) == [0, 2]


@pytest.mark.parametrize("thickness", [1.0, 1e-3, 1e-8, 0.0])
def test_corners_of_boxes_thick_and_flat(thickness):
    lower, upper = np.array([-1.0, 2.0, 0.5]), np.array([1.0, 3.0, 0.5 + thickness])
    corners = VPolytope(HPolyhedron.MakeBox(lower, upper)).vertices()
    wanted = {(x, y, z) for x in (-1.0, 1.0) for y in (2.0, 3.0) for z in (0.5, 0.5 + thickness)}
    assert len({tuple(np.round(c, 6)) for c in corners.T}) == len({tuple(np.round(c, 6)) for c in wanted})
    assert all(np.abs(corners.T - c).max(axis=1).min() < 1e-7 for c in wanted)
