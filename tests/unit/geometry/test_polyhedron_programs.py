"""Linear programs about polyhedra."""

import numpy as np
import pytest
from scipy.optimize import linprog

from sheldrake.geometry.optimization import ConvexSet, HPolyhedron, Hyperellipsoid, Hyperrectangle, Point, VPolytope
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


def some_hull(rng):
    n, count = int(rng.integers(1, 5)), int(rng.integers(1, 15))
    return rng.normal(size=(n, count)) if rng.random() < 0.7 else rng.integers(-1, 2, (n, count)).astype(float)


def distance_by_highs(vertices, x):
    """The least e with |V w - x| <= e in each coordinate, for weights w."""
    n, count = vertices.shape
    ones = np.ones((n, 1))
    A = np.vstack((np.hstack((vertices - x[:, None], -ones)), np.hstack((x[:, None] - vertices, -ones))))
    e = np.eye(count + 1)[-1]
    return linprog(e, A_ub=A, b_ub=np.zeros(2 * n), A_eq=[1.0 - e], b_eq=[1.0], method="highs").fun


@pytest.mark.parametrize("seed", range(40))
def test_distances_to_hulls(seed):
    rng = np.random.default_rng(seed)
    V = some_hull(rng)
    within, corner = V @ rng.dirichlet(np.ones(V.shape[1])), V[:, 0]
    for x in (rng.normal(size=len(V)), within, corner, corner + 1e-3 * rng.normal(size=len(V))):
        distance = programs.distance_to_hull(V, x)
        assert distance == pytest.approx(distance_by_highs(V, x), abs=2e-7)
        assert VPolytope(V).PointInSet(x) == (distance <= 1e-8)
    assert VPolytope(V).PointInSet(within, 1e-14) and VPolytope(V).PointInSet(corner, 1e-14)
    assert not VPolytope(V).PointInSet(V.max(axis=1) + 1.1e-8) and VPolytope(V[:, :1]).PointInSet(corner + 0.9e-8)


@pytest.mark.parametrize("seed", range(40))
def test_hulls_meet_other_sets_where_the_program_says_so(seed, monkeypatch):
    rng = np.random.default_rng(seed)
    V = some_hull(rng)
    n, low = len(V), rng.uniform(-1.5, 1.0, len(V))
    other = [
        VPolytope(rng.normal(size=(n, 4)) + rng.normal(size=(n, 1))),
        HPolyhedron(rng.normal(size=(5, n)), rng.normal(0.3, 1.0, 5)),
        Hyperrectangle(low, low + rng.random(n)),
        Point(V.mean(axis=1)),
    ]
    found = [(VPolytope(V).IntersectsWith(s), s.IntersectsWith(VPolytope(V))) for s in other]
    monkeypatch.setattr(VPolytope, "_corners", lambda self: None)
    assert found == [(VPolytope(V).IntersectsWith(s), s.IntersectsWith(VPolytope(V))) for s in other]


@pytest.mark.parametrize("seed", range(60))
def test_hulls_meet_faces_where_the_linear_program_says_so(seed, monkeypatch):
    rng = np.random.default_rng(seed)
    V = some_hull(rng)
    A = rng.normal(size=(int(rng.integers(1, 9)), len(V)))
    b = A @ V.mean(axis=1) + rng.normal(-0.2, 0.5, len(A))
    found = programs.hull_meets(V, A, b)
    whole = programs.Image(np.eye(len(V)), np.zeros(len(V)), A, b)
    assert found == programs.meet(programs.hull(V), whole)
    monkeypatch.setattr(programs, "_FEASIBLE", np.inf)  # no face is taken for one that tells them apart
    assert found == programs.hull_meets(V, A, b)


def test_hulls_that_only_touch_faces_meet_them():
    V = np.array([[0.1 + 0.2, 1.0, 1.0], [0.0, 0.0, 1.0]])
    assert VPolytope(V).IntersectsWith(HPolyhedron([[1.0, 0.0]], [0.3]))
    assert not VPolytope(V).IntersectsWith(HPolyhedron([[1.0, 0.0]], [0.299999]))
    assert VPolytope(V).IntersectsWith(HPolyhedron([[1.0, 0.0], [-1.0, 0.0], [0.0, -1.0]], [0.8, -0.8, -0.2]))


@pytest.mark.parametrize("seed", range(60))
def test_the_nearest_point_of_a_hull_is_that_of_the_general_program(seed, monkeypatch):
    rng = np.random.default_rng(seed)
    V = some_hull(rng)
    n = len(V)
    A = rng.normal(size=(n, n)) + 2.0 * np.eye(n)
    ellipsoid = Hyperellipsoid(A, V.mean(axis=1) + rng.choice([0.0, 0.1, 3.0]) * rng.normal(size=n))
    found, x = ellipsoid.MinimumUniformScalingToTouch(VPolytope(V))
    short = programs.nearest_of_hull(V, A, ellipsoid.center())
    monkeypatch.setattr(VPolytope, "_least_scaled", lambda *_: None)
    expected, there = ellipsoid.MinimumUniformScalingToTouch(VPolytope(V))
    size = np.abs(A @ (V - ellipsoid.center()[:, None])).max()
    # Clarabel stops at 1e-8 of squares: where a distance is nearly zero, it is known to the root of that.
    assert found == pytest.approx(expected, rel=1e-6, abs=2e-4 * size)
    if short is not None:
        np.testing.assert_array_equal(x, short)
        assert VPolytope(V).PointInSet(x, 1e-9 * size)
        # No vertex is before the plane through x that the scaled ellipsoid touches: nothing is nearer.
        normal = A @ (x - ellipsoid.center())
        assert np.all(normal @ A @ (V - x[:, None]) >= -1e-9 * size**2)
        np.testing.assert_allclose(x, there, atol=2e-3 * size)


def test_the_nearest_point_of_a_hull_is_left_to_the_program_where_it_is_not_outside_or_the_ellipsoid_is_flat():
    V = np.array([[-1.0, 1.0, 0.0], [-1.0, -1.0, 2.0]])
    outside = np.array([0.0, 5.0])
    assert programs.nearest_of_hull(V, np.eye(2), np.zeros(2)) is None
    assert programs.nearest_of_hull(V, np.eye(2), V[:, 0]) is None
    assert programs.nearest_of_hull(V, np.diag([1.0, 0.0]), outside) is None
    assert programs.nearest_of_hull(V, np.ones((1, 2)), outside) is None
    assert programs.nearest_of_hull(np.zeros((2, 0)), np.eye(2), outside) is None
    assert programs.nearest_of_hull(V + np.inf, np.eye(2), outside) is None
    np.testing.assert_allclose(programs.nearest_of_hull(V, np.eye(2), outside), [0.0, 2.0], atol=1e-12)
    assert Hyperellipsoid.MakeUnitBall(2).MinimumUniformScalingToTouch(VPolytope(V))[0] < 1e-4


def test_hulls_of_numbers_that_are_none_are_refused():
    flat = VPolytope([[0.0, 1.0], [0.0, 1.0]])
    with pytest.raises(RuntimeError, match="nan"):
        flat.PointInSet([np.nan, 0.0])
    with pytest.raises(RuntimeError, match="finite"):
        VPolytope([[np.inf, 1.0], [0.0, 1.0]]).IntersectsWith(flat)


@pytest.mark.parametrize("seed", range(60))
def test_polyhedra_are_bounded_if_no_direction_has_an_infinite_extent(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    A = rng.normal(size=(int(rng.integers(1, 4 * n)), n))
    if seed % 4 == 0:
        A = np.vstack((np.eye(n), -np.eye(n)[: int(rng.integers(0, n + 1))]))
    b = rng.normal(1.0, 1.0, len(A))
    ends = [
        linprog(e, A_ub=A, b_ub=b, bounds=(None, None), method="highs", options={"presolve": False}).status
        for e in (*np.eye(n), *-np.eye(n))
    ]
    assert HPolyhedron(A, b).IsBounded() == (3 not in ends)


@pytest.mark.parametrize("seed", range(30))
def test_largest_balls(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 5))
    A = np.vstack((rng.normal(size=(8, n)) * 10.0 ** rng.integers(-3, 3, (8, 1)), np.eye(n), -np.eye(n)))
    b = rng.uniform(-0.2, 2.0, len(A))
    lengths = np.linalg.norm(A, axis=1)
    rows = np.column_stack((A, lengths))
    bounds = [(None, None)] * n + [(0.0, None)]
    wanted = linprog(-np.eye(n + 1)[n], A_ub=rows, b_ub=b, bounds=bounds, method="highs")
    if wanted.status != 0:
        with pytest.raises(RuntimeError, match="there is no point"):
            HPolyhedron(A, b).ChebyshevCenter()
        return
    room = (b - A @ HPolyhedron(A, b).ChebyshevCenter()) / lengths
    assert room.min() == pytest.approx(-wanted.fun, abs=1e-6)


def test_no_largest_ball_in_an_unbounded_polyhedron():
    with pytest.raises(RuntimeError, match="it has no limit"):
        HPolyhedron([[1.0, 0.0]], [1.0]).ChebyshevCenter()


def test_rows_that_are_met_everywhere_or_nowhere():
    triangle = np.array([[1.0, 1.0], [-1.0, 0.5], [0.5, -1.0]])
    b = np.ones(3)
    for i in range(3):
        b[i] = np.inf
        assert not HPolyhedron(triangle, b).IsEmpty() and not HPolyhedron(triangle, b).IsBounded()
        b[i] = -np.inf
        assert HPolyhedron(triangle, b).IsEmpty() and HPolyhedron(triangle, b).IsBounded()
        b[i] = 1.0
    twice = HPolyhedron(np.vstack((triangle, triangle)), [1.0, 1.0, 1.0, np.inf, np.inf, np.inf])
    assert twice.IsBounded() and twice.ReduceInequalities().b().size == 3
    np.testing.assert_allclose(twice.ChebyshevCenter(), HPolyhedron(triangle, b).ChebyshevCenter(), atol=1e-14)
    everything = HPolyhedron(triangle, np.full(3, np.inf))
    assert not everything.IsEmpty() and not everything.IsBounded()
    assert programs.largest(triangle, np.full(3, np.inf), np.ones(2)) == np.inf


@pytest.mark.parametrize("seed", range(20))
def test_inscribed_ellipsoids_are_those_of_the_program(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 5))
    rows = np.vstack((rng.normal(size=(int(rng.integers(1, 20)), n)), np.eye(n), -np.eye(n)))
    rows /= np.linalg.norm(rows, axis=1)[:, None]
    bounds = rng.uniform(0.5, 2.0, len(rows))
    (B, d), (other_B, other_d) = (
        programs._inscribed_on_cones(rows, bounds),
        programs._inscribed_by_program(rows, bounds),
    )
    np.testing.assert_array_equal(B, B.T)
    assert np.linalg.det(B) == pytest.approx(np.linalg.det(other_B), rel=1e-6)
    # The volume is blunt at its greatest: where it is known to 1e-8, axes and center are to the root of that.
    np.testing.assert_allclose(B, other_B, atol=1e-4)
    np.testing.assert_allclose(d, other_d, atol=1e-4)
    assert np.all(np.linalg.norm(rows @ B, axis=1) + rows @ d <= bounds + 1e-7)


def test_of_what_has_no_inscribed_ellipsoid_the_program_tells():
    for A, b in (([[1.0, 0.0], [-1.0, 0.0]], [0.0, -1.0]), ([[1.0, 0.0], [-1.0, 0.0]], [0.0, 1.0])):
        assert programs._inscribed_on_cones(np.array(A), np.array(b)) is None
        with pytest.raises(RuntimeError, match="unbounded, or without interior"):
            programs.inscribed_ellipsoid(np.array(A), np.array(b))


@pytest.mark.parametrize("seed", range(60))
def test_ellipsoids_touch_each_other_and_faces_where_programs_say_so(seed, monkeypatch):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 5))
    a, b = (
        Hyperellipsoid(rng.normal(size=(n, n)) + np.eye(n), rng.choice([0.3, 2.0]) * rng.normal(size=n))
        for _ in range(2)
    )
    polyhedron = HPolyhedron(
        np.vstack((np.eye(n), -np.eye(n), rng.normal(size=(2, n)))), rng.uniform(0.0, 2.0, 2 * n + 2)
    )
    others = (b, polyhedron, VPolytope(rng.normal(size=(n, 6))), Hyperrectangle(np.zeros(n), np.ones(n)))
    scale, x = a.MinimumUniformScalingToTouch(b)
    meets = [(a.IntersectsWith(s), s.IntersectsWith(a)) for s in others]
    monkeypatch.setattr(Hyperellipsoid, "_least_scaled", lambda *_: None)
    monkeypatch.setattr(Hyperellipsoid, "_meets", lambda *_: None)
    expected, there = a.MinimumUniformScalingToTouch(b)
    assert meets == [(a.IntersectsWith(s), s.IntersectsWith(a)) for s in others]
    # Clarabel stops at 1e-8 of squares.
    assert scale == pytest.approx(expected, rel=1e-5, abs=1e-3)
    assert np.linalg.norm(b.A() @ (x - b.center())) <= 1.0 + 1e-11
    assert scale <= expected * (1.0 + 1e-6) + 1e-12
    if scale > 0.01:
        np.testing.assert_allclose(x, there, atol=5e-3 * (1.0 + np.abs(x).max()))


def test_an_ellipsoid_that_is_flat_or_has_no_end_is_left_to_the_programs():
    line, ball = Hyperellipsoid(np.diag([1.0, 0.0]), [3.0, 0.0]), Hyperellipsoid.MakeUnitBall(2)
    assert line._least_scaled(np.eye(2), np.zeros(2)) is None
    assert Hyperellipsoid(np.ones((1, 2)), np.zeros(2))._least_scaled(np.eye(2), np.zeros(2)) is None
    assert ball.MinimumUniformScalingToTouch(line)[0] == pytest.approx(2.0, abs=1e-5)
    assert not ball.IntersectsWith(line) and Hyperellipsoid.MakeHypersphere(2.0, [0.0, 7.0]).IntersectsWith(line)
    # Along the axis in which the other one has no end nothing is to be won: the point need not move.
    scale, x = line.MinimumUniformScalingToTouch(ball)
    assert scale == pytest.approx(2.0) and x == pytest.approx([1.0, 0.0])
    far = Hyperellipsoid.MakeHypersphere(1.0, [2.0, 0.0])
    assert ball.IntersectsWith(far) and not ball.IntersectsWith(Hyperellipsoid.MakeHypersphere(1.0, [2.0001, 0.0]))
