"""What a search for contacts remembers makes no difference to what it finds, however often it is forgotten."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from tests.unit.geometry.proximity_scenes import Scene, row_of

from sheldrake.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    Sphere,
)
from sheldrake.geometry._compiled.search import find_contacts
from sheldrake.geometry._kernels import separation
from sheldrake.geometry._kernels.convex import face_along, slot_at
from sheldrake.geometry._kernels.epa import make_convex, set_face
from sheldrake.geometry._kernels.memory import SEPARATED
from sheldrake.geometry._kernels.model import (
    FACE,
    SIMPLEX,
    SLOT_FACES,
    SLOT_VERTICES,
    BodyPoses,
    Found,
    Margins,
    Remembered,
    Slot,
    contact_table,
    is_watched,
)
from sheldrake.geometry._kernels.pair_distance import find_distances
from sheldrake.geometry._kernels.separation import search as search_pair
from sheldrake.geometry._kernels.support import best_face
from sheldrake.geometry._kernels.tracking import ALIKE, face_holds_ball
from sheldrake.math import RigidTransform, RollPitchYaw

MEMORY = ("near_count", "remembered", "separating", "slot", "kept_vertex", "kept_point", "kept_link")


def points_of(table):
    n = int(table.count[Found.num_contacts])
    return table.pair[:n].tobytes() + table.point[:n].tobytes()


def forget(table):
    for name in MEMORY:
        getattr(table, name)[:] = 0


def hull(rng, n):
    points = rng.normal(size=(n, 3)) * rng.uniform(0.05, 0.2, 3)
    return Convex(points.T, "random")


def bodies(rng):
    return [
        hull(rng, 8),
        hull(rng, 20),
        hull(rng, 60),
        hull(rng, 200),
        Box(0.2, 0.3, 0.1),
        Capsule(0.05, 0.3),
        Cylinder(0.1, 0.2),
        Ellipsoid(0.1, 0.2, 0.05),
        Sphere(0.1),
    ]


def motion(rng, n, speed):
    """Poses of the world and n bodies that turn and shake about places in one another, a function of time [s]."""
    p, angles = rng.uniform(-0.15, 0.15, (n, 3)), rng.uniform(-3.0, 3.0, (n, 3))
    rate, phase = speed * rng.normal(size=(n, 6)), rng.uniform(0.0, 6.0, (n, 6))

    def at(t):
        swing = np.sin(phase + rate * t)
        bodies = [RigidTransform(RollPitchYaw(angles[k] + swing[k, :3]), p[k] + 0.05 * swing[k, 3:]) for k in range(n)]
        return np.array([row_of(X) for X in [RigidTransform(), *bodies]])

    return at


def search(model, X_WB, table):
    assert find_contacts(model, X_WB, table) == 0
    return points_of(table)


@pytest.mark.parametrize("algorithm", ["multi_point", "single_point"])
@pytest.mark.parametrize("speed", [0.3, 10.0])
def test_contacts_are_the_same_bits_however_often_memory_is_lost(algorithm, speed):
    rng = np.random.default_rng(5)
    scene = Scene(bodies(rng), algorithm)
    at = motion(rng, 9, speed)
    fresh, kept, mixed = (contact_table(scene.model) for _ in range(3))
    followed = 0
    for step in range(150):
        X_WB = at(1e-3 * step)
        forget(fresh)
        if rng.random() < 0.1:
            forget(mixed)
        before = [row.tobytes() for row in kept.slot if row[Slot.owner] > 0]
        found = search(scene.model, X_WB, fresh)
        assert search(scene.model, X_WB, kept) == found
        assert search(scene.model, X_WB, mixed) == found
        followed += sum(row.tobytes() in before for row in kept.slot if row[Slot.owner] > 0)
    assert followed > 150  # polytopes were used again: the test has seen what it is about


def test_a_pair_that_was_apart_is_found_when_it_meets():
    scene = Scene([hull(np.random.default_rng(1), 30), Cylinder(0.1, 0.2)])
    table = scene.table
    far, near = ([RigidTransform(), RigidTransform([0.45 * s, 0.3 * s, 0.0])] for s in (1.0, 0.1))
    X_WB = [np.array([row_of(X) for X in [RigidTransform(), *poses]]) for poses in (far, near)]
    assert table.num_contacts == 0
    for _ in range(2):
        search(scene.model, X_WB[0], table)
        assert table.num_contacts == 0
        search(scene.model, X_WB[1], table)
        assert table.num_contacts > 0


def test_a_pair_that_is_apart_is_not_measured_before_it_may_have_come_near():
    """A gap that is remembered wrongly hides a contact until the second shape has moved by as much."""
    scene = Scene([Cylinder(0.1, 0.2), Cylinder(0.1, 0.2)])

    def contacts_at(d):
        poses = [RigidTransform(), RigidTransform(), RigidTransform([d, d, 0.0])]
        assert find_contacts(scene.model, np.array([row_of(X) for X in poses]), scene.table) == 0
        return scene.table.num_contacts

    kept = scene.table.separators[0]
    assert contacts_at(0.16) == 0  # boxes overlap
    assert scene.table.memories[0].how == SEPARATED
    assert contacts_at(0.16) == 0
    gap = kept.gap
    assert gap == pytest.approx(0.16 * np.sqrt(2.0) - 0.2)
    assert contacts_at(0.155) == 0
    assert kept.gap == gap  # not measured
    kept.gap = 0.05
    assert contacts_at(0.14) == 0
    kept.gap = 0.02
    assert contacts_at(0.14) > 0


def distance_to_triangle(corners):
    """Of the origin from a triangle: from its plane if it is above it, else from an edge."""
    ends = np.roll(corners, -1, axis=0) - corners
    n = np.cross(ends[0], ends[1])
    inside = np.einsum("ki,ki->k", np.cross(n, ends), -corners) >= 0.0
    if inside.all() and n @ n > 1e-20:
        return abs(n @ corners[0]) / np.linalg.norm(n)
    t = np.clip(-np.einsum("ki,ki->k", corners, ends) / np.einsum("ki,ki->k", ends, ends), 0.0, 1.0)
    return np.linalg.norm(corners + t[:, None] * ends, axis=1).min()


@pytest.mark.parametrize("speed", [0.3, 3.0])
def test_faces_of_polytopes_are_never_nearer_than_remembered(speed):
    """Level less path is less than how far a triangle is, however long ago that was measured.

    One that was alike is so until the path is its level.
    """
    rng = np.random.default_rng(8)
    scene = Scene(bodies(rng))
    at, table = motion(rng, 9, speed), scene.table
    seen = left_alone = 0
    for step in range(150):
        search(scene.model, at(1e-3 * step), table)
        for s, slot in enumerate(table.slot if step % 10 == 9 else ()):
            memory, tracked = Slot.view(slot), table.tracks[s]
            if memory.owner == 0 or memory.num_vertices == 0:
                continue
            pair = scene.model.pairs[scene.model.convex_pairs + memory.owner - 1]
            b = max(pair.a, pair.b, key=lambda g: (scene.model[g].kind, g))
            R = np.reshape(tracked.R_AB, (3, 3))
            p = np.array(tracked.p_AB) - R @ scene.model[b].centre_G
            points = table.kept_point[s * SLOT_VERTICES :][: memory.num_vertices]
            D = points[:, :3] - p - points[:, 3:] @ R.T
            corners = table.kept_link[s * SLOT_FACES :][: memory.num_faces, :3]
            levels = np.array(tracked.level[: memory.num_faces])
            distances = np.array([distance_to_triangle(D[c]) for c in corners])
            assert ((levels < 0.0) | (levels >= 1e299) | (levels - tracked.path <= distances + 1e-9)).all()
            seen += tracked.path > 0.0
            for c in corners[(levels < 0.0) & (tracked.path < -levels)]:
                n = np.cross(D[c[1]] - D[c[0]], D[c[2]] - D[c[0]])
                assert n @ tracked.out_A >= (1.0 - ALIKE) * np.linalg.norm(n)
                left_alone += 1
    assert seen > 50  # polytopes that had moved
    assert left_alone > 100  # faces inside of curved surfaces


def test_python_source_remembers_as_machine_code_does():
    """The same but for the order of a facet's corners: which of two is farther can be a matter of the last digit."""
    rng = np.random.default_rng(2)
    scene = Scene([hull(rng, 12), hull(rng, 12)], "single_point")
    at = motion(rng, 2, 0.5)
    tables = contact_table(scene.model), contact_table(scene.model)
    for step in range(4):
        for native, table in enumerate(tables):
            assert find_contacts(scene.model, at(1e-3 * step), table, bool(native)) == 0
    np.testing.assert_array_equal(tables[0].remembered, tables[1].remembered)
    slots = [np.column_stack((table.slot[:, :6], np.sort(table.slot[:, 6:], axis=1))) for table in tables]
    np.testing.assert_array_equal(*slots)
    np.testing.assert_allclose(*(t.point[: t.num_contacts] for t in tables), rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("rubbish", [-7, 5, 10**9])
def test_rubbish_in_the_memory_is_not_believed(rubbish):
    rng = np.random.default_rng(9)
    scene = Scene(bodies(rng))
    X_WB = motion(rng, 9, 1.0)(0.0)
    table, fresh = contact_table(scene.model), contact_table(scene.model)
    search(scene.model, X_WB, table)
    table.kept_vertex[:] = rubbish
    assert search(scene.model, X_WB, table) == search(scene.model, X_WB, fresh)
    table.remembered[:, Remembered.how] = rubbish
    assert search(scene.model, X_WB, table) == points_of(fresh)


def test_far_pairs_are_not_looked_at_until_something_has_moved_far():
    rng = np.random.default_rng(4)
    scene = Scene([Sphere(0.1) if k % 2 else Cylinder(0.1, 0.2) for k in range(14)])
    assert is_watched(scene.model)
    table, fresh = contact_table(scene.model), contact_table(scene.model)
    p, v = rng.uniform(-0.5, 0.5, (14, 3)), rng.uniform(-1.0, 1.0, (14, 3))
    lists, touching = set(), set()
    for step in range(200):
        together = np.array([5.0, 0.0, -1.0]) * step * 1e-3  # what all move by brings no two nearer
        poses = [RigidTransform(together + p[k] + v[k] * step * 1e-3) for k in range(14)]
        X_WB = np.array([row_of(X) for X in [RigidTransform(), *poses]])
        forget(fresh)
        found = search(scene.model, X_WB, fresh)
        assert search(scene.model, X_WB, table) == found
        lists.add(table.seen.tobytes())
        touching.update(map(tuple, fresh.pair[: fresh.num_contacts, :2].tolist()))
    assert len(touching) > 3
    assert 3 < len(lists) < 100


def test_the_skin_is_thicker_while_bodies_are_fast():
    rng = np.random.default_rng(6)
    scene = Scene([Sphere(0.1) if k % 2 else Cylinder(0.1, 0.2) for k in range(40)])
    table, fresh = contact_table(scene.model), contact_table(scene.model)
    p, rate = rng.uniform(-1.0, 1.0, (40, 3)), rng.uniform(-60.0, 60.0, (40, 3))
    doublings, lists = [], []
    for step in range(500):
        t = 1e-3 * (min(step, 60) + 1e-3 * max(step - 60, 0))  # fast, then slow
        X_WB = np.array([row_of(RigidTransform(x)) for x in [np.zeros(3), *(p + 0.5 * np.sin(rate * t))]])
        forget(fresh)
        assert search(scene.model, X_WB, table) == search(scene.model, X_WB, fresh)
        doublings.append(table.near_doublings)
        lists.append(table.near_held == 1)
    assert doublings[60] > 0 and sum(lists[30:60]) < 25  # with a thin skin a list a step
    assert doublings[-1] < doublings[60] and sum(lists[150:]) < 9


def test_a_polytope_that_has_swallowed_vertices_is_kept():
    rng = np.random.default_rng(3)
    scene = Scene([Cylinder(0.05, 0.2), Cylinder(0.06, 0.2)])
    slots = []
    for _ in range(100):
        poses = [RigidTransform(RollPitchYaw(rng.uniform(-3.0, 3.0, 3)), rng.uniform(-0.03, 0.03, 3)) for _ in range(2)]
        table = contact_table(scene.model)
        search(scene.model, np.array([row_of(X) for X in [RigidTransform(), *poses]]), table)
        slots += [table.slots[0]] if table.slots[0].owner > 0 else []
    assert len(slots) > 80
    assert sum(slot.num_vertices > 0 for slot in slots) > 0.9 * len(slots)
    assert all(slot.num_faces == 2 * slot.num_vertices - 4 for slot in slots if slot.num_vertices > 0)


def test_what_met_tells_the_same_faces_as_a_search():
    rng = np.random.default_rng(8)
    scene = Scene([hull(rng, 30), hull(rng, 50)])
    at = motion(rng, 2, 0.5)
    seen = 0
    for step in range(100):
        search(scene.model, at(1e-3 * step), scene.table)
        s = slot_at(scene.table, 0)
        for c in range(scene.table.num_contacts):
            for side, sign in ((0, -1.0), (1, 1.0)):
                nhat = tuple(sign * np.array(scene.table[c].nhat_BA_W))
                face = face_along(scene.model, scene.table, side, side, nhat, s)
                assert face == best_face(scene.model, scene.table, side, nhat)
                seen += s >= 0
    assert seen > 100


def test_a_list_of_near_pairs_that_is_wrong_hides_contacts():
    """What a fault of that kind would do: the test above can fail."""
    scene = Scene([Sphere(0.1) for _ in range(11)])
    table = contact_table(scene.model)
    far = [RigidTransform([0.5 * k, 0.0, 0.0]) for k in range(11)]
    near = [RigidTransform([0.15 * k, 0.0, 0.0]) for k in range(11)]
    X_far, X_near = (np.array([row_of(X) for X in [RigidTransform(), *poses]]) for poses in (far, near))
    search(scene.model, X_far, table)
    table.seen[:] = X_near[1:, 9:12]  # as if they had been seen here
    search(scene.model, X_near, table)
    assert table.num_contacts == 0
    forget(table)
    search(scene.model, X_near, table)
    assert table.num_contacts == 10


@pytest.mark.parametrize("other", [Cylinder(0.1, 0.3), Capsule(0.1, 0.3)], ids=["cores overlap", "cores are apart"])
def test_curved_shapes_that_meet_are_not_searched_anew(other, monkeypatch):
    """Of two shapes that turn about each other all steps but the first follow from the one before."""
    scene = Scene([Cylinder(0.1, 0.4), other])
    table, fresh = contact_table(scene.model), contact_table(scene.model)
    searched = []
    monkeypatch.setattr(separation, "search", lambda *args: searched.append(args) or search_pair(*args))
    for step in range(6):
        at = RigidTransform(RollPitchYaw(0.5 + 1e-3 * step, 0.0, 1e-3 * step), [0.18, 0.02, 0.05])
        X_WB = np.array([row_of(X) for X in [RigidTransform(), RigidTransform(), at]])
        assert find_contacts(scene.model, X_WB, table, False) == 0
        assert len(searched) == 1
        forget(fresh)
        assert find_contacts(scene.model, X_WB, fresh, False) == 0
        assert points_of(table) == points_of(fresh) and table.num_contacts > 0
        searched[:] = searched[:1]


def nearly_touching(scene, turned, gap):
    """Poses of the world, of a body at the origin, and of another that is so far from it [m]."""
    X_WB = np.array([row_of(X) for X in [RigidTransform(), RigidTransform(), RigidTransform(turned, [0.4, 0.1, 0.05])]])
    assert find_distances.native(scene.model, BodyPoses(X_WB), np.inf, scene.table) == 0
    point = scene.table[0]
    X_WB[2, 9:] += (-point.depth - gap) * np.array(point.nhat_BA_W)
    return X_WB


@pytest.mark.parametrize("shapes", [(20, 60), (60, 0), (200, 200)], ids=str)
def test_flat_faces_that_hardly_touch_are_not_searched_anew(shapes, monkeypatch):
    """Of two shapes that roll a little on each other, sometimes apart, most steps need no search.

    Directions are differences of nearest points, and known the less exactly the nearer these are.
    """

    def same(found, expected):
        np.testing.assert_allclose(found[:, [0, 1, 2, 3, 4, 5, 9]], expected[:, [0, 1, 2, 3, 4, 5, 9]], 0.0, 1e-13)
        rounding = 1e-13 + 3e-17 / np.abs(expected[:, 9:]).min()
        np.testing.assert_allclose(found[:, 6:9], expected[:, 6:9], rtol=0.0, atol=rounding)

    rng = np.random.default_rng(7)
    scene = Scene([hull(rng, n) if n else Box(0.2, 0.3, 0.1) for n in shapes])
    scene.model.margin[Margins.several_margin] = 1e-4
    kept, mixed, fresh = (contact_table(scene.model) for _ in range(3))
    first, steps = rng.uniform(-3.0, 3.0, 3), []
    for step in range(30):
        turned = RollPitchYaw(first + 2e-5 * step * np.array([1.0, -1.0, 2.0]))
        X_WB = nearly_touching(scene, turned, 9e-5 * np.cos(step))
        forget(fresh)
        search(scene.model, X_WB, fresh)
        steps.append((X_WB, fresh.point[: fresh.num_contacts].copy()))
        if rng.random() < 0.2:
            forget(mixed)
        search(scene.model, X_WB, mixed)
        assert mixed.num_contacts == fresh.num_contacts
        same(mixed.point[: mixed.num_contacts], steps[-1][1])
    searched = []
    monkeypatch.setattr(separation, "search", lambda *args: searched.append(args) or search_pair(*args))
    for X_WB, points in steps:
        assert find_contacts(scene.model, X_WB, kept, False) == 0
        assert kept.num_contacts == len(points) > 0
        same(kept.point[: kept.num_contacts], points)
    assert 10 < sum(points[:, 9].max() < 0.0 for _, points in steps) < 20
    assert len(searched) < 12


def flat_roof():
    """A block of twelve corners whose upper side is two faces that fall by a hundredth of a radian from their ridge."""
    turns = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    x, y = 0.3 * np.cos(turns), 0.2 * np.sin(turns)
    top = np.array([x, y, 0.1 - 5e-3 * np.abs(y)])
    return Convex(np.hstack((top, [x, y, np.full(12, -0.1)])), "roof")


def test_what_rolls_to_a_feature_beside_that_which_met_is_not_searched_anew(monkeypatch):
    """An edge rocks on two faces that are nearly one: a vertex, the next, or the edge meets."""
    scene = Scene([flat_roof(), Box(0.2, 0.15, 0.1)])
    table, fresh = contact_table(scene.model), contact_table(scene.model)
    searched, met = [], set()
    monkeypatch.setattr(separation, "search", lambda *args: searched.append(args) or search_pair(*args))
    for step in range(40):
        rock = RollPitchYaw(np.pi / 4 + 3e-3 * np.sin(1.7 * step), 3e-3 * np.cos(2.3 * step), 0.4 + 2e-3 * step)
        at = RigidTransform(rock, [0.02, 5e-3 * np.sin(0.7 * step), 0.155])
        X_WB = np.array([row_of(X) for X in [RigidTransform(), RigidTransform(), at]])
        assert find_contacts(scene.model, X_WB, table, False) == 0
        assert len(searched) == 1
        met.add((table.slots[0].feature, *table.slots[0].who))
        forget(fresh)
        assert find_contacts(scene.model, X_WB, fresh, False) == 0
        assert points_of(table) == points_of(fresh) and table.num_contacts > 0
        searched[:] = searched[:1]
    assert len(met) == 3


def put_surface(table, points, corners):
    """A closed surface of triangles, seen from outside, where EPA keeps its polytope."""
    starts = {(c[k], c[(k + 1) % 3]): f for f, c in enumerate(corners) for k in range(3)}
    for v, w in enumerate(points):
        table.vertices[SIMPLEX + v].w = tuple(w)
    for f, c in enumerate(corners):
        set_face(table, f, tuple(c))
        table.links[f].neighbours = tuple(starts[c[(k + 1) % 3], c[k]] for k in range(3))


def outward(points, corners):
    return [c if np.linalg.det(points[c]) > 0.0 else c[::-1] for c in corners.tolist()]


@pytest.mark.parametrize("moved", [0.05, 0.15, 0.3])
def test_a_surface_whose_vertices_moved_becomes_the_hull_of_them(moved):
    """Also where some have come inside: of those it is rid, if it is convex in the end."""
    rng = np.random.default_rng(4)
    table = contact_table(Scene([Sphere(0.1), Sphere(0.1)]).model)
    done = mended = swallowed = 0
    for _ in range(60):
        half = rng.normal(size=(7, 3))
        points = np.vstack((half, -half)) / np.linalg.norm(np.vstack((half, half)), axis=1)[:, None]
        corners = outward(points, ConvexHull(points).simplices)
        points *= 1.0 + moved * rng.uniform(-1.0, 1.0, (14, 1))
        put_surface(table, points, corners)
        if any(table.polytope[FACE + f].offset <= 0.0 for f in range(24)):
            continue  # the origin is outside
        done += 1
        if not make_convex(table, 24, 1e-13):
            continue
        mended += 1
        left = {frozenset(table.links[f].corners) for f in range(24) if table.polytope[FACE + f].exists > 0.0}
        hull_now = ConvexHull(points)
        assert left == {frozenset(c) for c in hull_now.simplices.tolist()}
        swallowed += len(hull_now.vertices) < 14
        for f in range(24):
            if table.polytope[FACE + f].exists > 0.0:
                c, across = table.links[f].corners, table.links[f].neighbours
                assert all({c[k], c[(k + 1) % 3]} <= set(table.links[across[k]].corners) for k in range(3))
                assert all(table.polytope[FACE + g].exists > 0.0 for g in across)
    assert done > 40
    assert mended == done
    assert swallowed > 10 or moved < 0.1


def test_a_facet_that_does_not_hold_the_ball_is_not_believed():
    """A vertex deep under one face of a box, and less deep under the next: what met once is not the answer."""
    scene = Scene([Box(0.2, 0.2, 0.2), hull(np.random.default_rng(12), 20)])
    model, table = scene.model, scene.table
    table.poses[0].R_WG = table.poses[1].R_WG = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    for x, y, best in ((0.099, 0.0, True), (0.099, 0.0995, False)):
        table.poses[1].p_WG = (x + 0.3, y, 0.0)
        p, n = (x, y, 0.0), (1.0, 0.0, 0.0)
        assert face_holds_ball(model, table, 0, 1, 1, n, p, 0.1 - x, 0.4) == best


def test_parallel_cylinders_touch_in_the_middle_of_where_they_lie_side_by_side():
    scene = Scene([Cylinder(0.1, 0.4), Cylinder(0.2, 0.4)], "single_point")
    at = RigidTransform(RollPitchYaw(0.0, 0.0, 0.3), [0.0, 0.29, 0.1])
    ((_a, _b, *points),) = scene.contacts(RigidTransform(), at)
    np.testing.assert_allclose(points, [0.0, 0.1, 0.05, 0.0, 0.09, 0.05, 0.0, -1.0, 0.0, 0.01], atol=1e-15)


def test_a_rim_on_the_side_of_a_nearly_parallel_cylinder_is_not_searched_anew(monkeypatch):
    """As links that are cylinders do in the posture of zeros: their axes are parallel but for a little motion."""
    scene = Scene([Cylinder(0.07, 0.14), Cylinder(0.055, 0.14)])
    table, fresh = contact_table(scene.model), contact_table(scene.model)
    searched = []
    monkeypatch.setattr(separation, "search", lambda *args: searched.append(args) or search_pair(*args))
    for step in range(4):
        at = RigidTransform(RollPitchYaw(0.0, -4e-5 * (step + 1), 0.0), [0.088, 0.08, -0.05])
        X_WB = np.array([row_of(X) for X in [RigidTransform(), RigidTransform(), at]])
        assert find_contacts(scene.model, X_WB, table, False) == 0
        assert len(searched) == 1
        forget(fresh)
        assert find_contacts(scene.model, X_WB, fresh, False) == 0
        assert points_of(table) == points_of(fresh) and table.num_contacts > 0
        searched[:] = searched[:1]
