"""What sets answer without a program is what their programs answer."""

import numpy as np
import pytest

from sheldrake.geometry.optimization import AffineBall, AffineSubspace, HPolyhedron, Hyperellipsoid, VPolytope
from sheldrake.geometry.optimization._affine_subspace import _hull_by_programs
from sheldrake.solvers import MathematicalProgram, Solve


def polyhedron(rng, n):
    """One with zero inside, which is bounded."""
    A = np.vstack((rng.normal(size=(2 * n, n)), np.eye(n), -np.eye(n)))
    return HPolyhedron(A, rng.random(len(A)) + 0.2)


def sets(rng, n):
    return (
        polyhedron(rng, n),
        VPolytope(rng.normal(size=(n, n + 4))),
        Hyperellipsoid(rng.normal(size=(n, n)) + 3.0 * np.eye(n), rng.normal(size=n)),
    )


def nearest_by_program(s, p):
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(p.size)
    s.AddPointInSetConstraints(prog, x)
    prog.AddQuadraticErrorCost(np.eye(p.size), p, x)
    return Solve(prog).GetSolution(x)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_projections_are_the_points_that_programs_find(n):
    rng = np.random.default_rng(n)
    for _ in range(5):
        points = 4.0 * rng.normal(size=(n, 6))
        for s in sets(rng, n):
            distances, nearest = s.Projection(points)
            for distance, x, p in zip(distances, nearest.T, points.T):
                assert s.PointInSet(x, 1e-9)
                np.testing.assert_allclose(distance, np.linalg.norm(x - p), rtol=1e-12)
                if not s.PointInSet(p, 0.0):
                    np.testing.assert_allclose(x, nearest_by_program(s, p), atol=2e-4)  # sqrt of Clarabel's tolerance
                    assert distance <= np.linalg.norm(nearest_by_program(s, p) - p) + 1e-7


def test_sets_without_points_have_no_projection():
    empty = HPolyhedron(np.array([[1.0, 0.0], [-1.0, 0.0]]), np.array([-1.0, -1.0]))
    assert empty.Projection(np.zeros((2, 1))) is None


@pytest.mark.parametrize("flat", [False, True])
def test_flats_around_polyhedra_are_those_that_programs_find(flat):
    rng = np.random.default_rng(5)
    for n in (1, 2, 3):
        s = polyhedron(rng, n)
        if flat:
            normal = rng.normal(size=(1, n))
            s = s.Intersection(HPolyhedron(np.vstack((normal, -normal)), np.zeros(2)))
        assert (s._affine_hull(1e-12) is None) == flat
        found, (basis, start) = AffineSubspace(s), _hull_by_programs(s, 1e-12)
        assert found.AffineDimension() == (n - 1 if flat else n)
        np.testing.assert_allclose(found.basis() @ found.basis().T, basis @ basis.T, atol=1e-6)
        np.testing.assert_array_equal(found.translation(), start)


def test_polyhedra_without_bounds_span_all_of_space():
    half = HPolyhedron(np.array([[1.0, 0.0, 0.0]]), np.array([1.0]))
    assert AffineSubspace(half).AffineDimension() == 3
    with pytest.raises(RuntimeError, match="empty"):
        AffineSubspace(HPolyhedron(np.array([[1.0], [-1.0]]), np.array([-1.0, -1.0])))


def test_points_of_balls_are_told_by_the_inverse_as_by_least_squares():
    rng = np.random.default_rng(7)
    answers = []
    for n in (1, 2, 4):
        for scale in (1.0, 1e3, 1e7):  # the last is left to least squares
            B, center = rng.normal(size=(n, n)) + 3.0 * np.eye(n), rng.normal(size=n)
            B[:, 0] *= scale
            ball = AffineBall(B, center)
            assert (ball._inverse is None) == (np.linalg.cond(B) >= 1e6)
            for x in center + (B @ rng.normal(size=(n, 20)) * 0.8).T:
                u = np.linalg.lstsq(B, x - center, rcond=None)[0]
                answers.append(ball.PointInSet(x, 1e-6))
                assert answers[-1] == (np.linalg.norm(u) <= 1.0 + 1e-6)
    assert 20 < sum(answers) < len(answers) - 20
    flat = AffineBall(np.diag([1.0, 0.0]), np.zeros(2))
    assert flat.PointInSet([0.5, 0.0]) and not flat.PointInSet([0.5, 1e-3])


def test_intersections_have_the_rows_of_both_or_those_that_count():
    rng = np.random.default_rng(9)
    one, other = polyhedron(rng, 2), polyhedron(rng, 2)
    both = one.Intersection(other)
    np.testing.assert_array_equal(both.A(), np.vstack((one.A(), other.A())))
    np.testing.assert_array_equal(both.b(), np.concatenate((one.b(), other.b())))
    fewer = one.Intersection(other, check_for_redundancy=True)
    assert len(one.b()) < len(fewer.b()) < len(both.b())
    assert fewer.ContainedIn(both) and both.ContainedIn(fewer)
    np.testing.assert_array_equal(one.Intersection(one, check_for_redundancy=True).A(), one.A())
