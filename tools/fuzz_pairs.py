"""Random pairs of all shapes against what is certain about their distance: `python tools/fuzz_pairs.py --pairs 1000`.

The signed distance of convex shapes is the largest separation s(n) = min over a, b of n . (a - b) of any direction n.
Whatever an algorithm answers, the answer can be checked: s of its normal is a lower bound; the distance of two points
of the shapes is an upper one, if they are apart. If they overlap, all normals of faces and all products of edges are
tried for shapes with faces alone, which is exact, and thousands of directions for the others. Nothing here is shared
with the kernels but the numbers of the shapes.

With `--memory` contacts are sought with what was remembered of the same pairs a little elsewhere, and are the same
bits as without, but for last digits where two formulas say the same, for which of two sides of a curved shape it is
where both are equally deep to EPA's accuracy, and for contacts that are so little deep. How many searches differ, and
how, is printed; any other difference is wrong.

Prints for each pair of kinds how many queries there were, how many had the wrong sign, and the largest errors relative
to the size of the pair; ends with status 1 if one is larger than `accuracy_of` states. A million queries take 4 min.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
import time
from typing import NamedTuple

import numpy as np

from sheldrake import geometry as g
from sheldrake.geometry._compiled.points import _by_family, compile_proximity
from sheldrake.geometry._compiled.search import find_contacts
from sheldrake.geometry._kernels import model as columns
from sheldrake.geometry._kernels.model import (
    BodyPose,
    BodyPoses,
    ContactPair,
    ContactPoint,
    ContactTable,
    Geometry,
    GeometryModel,
    Size,
    contact_table,
)
from sheldrake.geometry._kernels.pair_distance import find_distances
from sheldrake.geometry._state.state import WORLD_FRAME_ID, GeometryState
from sheldrake.math import RigidTransform, RollPitchYaw, RotationMatrix

KINDS = ("sphere", "box", "cylinder", "capsule", "ellipsoid", "hull", "half_space")
PAIRS = [p for p in itertools.combinations_with_replacement(KINDS, 2) if p != ("half_space", "half_space")]
REGIMES = ("anywhere", "touching", "aligned", "deep", "far")
"""How two shapes lie: at random, a hair apart or in one another, with parallel faces, centre in centre, far away."""

ALIKE = ("the same bits", "other last digits", "as deep", "wrong")
"""How much the contacts of a pair with memory are those without."""
DIGITS = 1e-12
"""Relative to the size: depths that differ by no more have other last digits."""
PLACE = 1e-9
"""The same of points, which slide along edges that are nearly parallel, and of normals."""
GAP = 1e-6
"""The same of the depths of curved shapes, of which EPA knows no more. As deep is another side, or a mere touch."""
TURNED = 1e-3
"""Normals that differ by more are of other sides."""

CURVED = {"cylinder", "ellipsoid"}
NEAR = 0.01
"""Relative to the size: pairs no deeper in one another, or farther apart, are what simulations see."""


def accuracy_of(kinds: tuple[str, str]) -> tuple[float, float]:
    """Stated accuracy relative to the sum of the radii of the bounding spheres: of near pairs, and of all others."""
    if "half_space" in kinds or kinds[0] == "sphere":
        return 1e-11, 1e-11
    return (1e-5, 2e-3) if CURVED & set(kinds) else (1e-7, 1e-7)


class Library(NamedTuple):
    """Shapes to choose from.

    Attributes:
        model: their geometry, one body each.
        rows: rows of the model by kind.
        vertices: vertices of polytopes and ends of segments in G, the first repeated, shape (n, most, 3).
        normals: normals of faces, both ways, shape (n, most, 3); zero where there are fewer.
        edges: directions of edges, shape (n, most, 3); zero where there are fewer.
    """

    model: GeometryModel
    rows: dict[str, np.ndarray]
    vertices: np.ndarray
    normals: np.ndarray
    edges: np.ndarray


def random_shapes(rng: np.random.Generator, count: int) -> dict[str, list[g.Shape]]:
    """Shapes of 1 cm to 1 m, some of them needles and plates."""

    def sizes(n: int) -> np.ndarray:
        slender = 10.0 ** rng.uniform(-2.5 if rng.random() < 0.2 else -0.5, 0.0, n)
        return 10.0 ** rng.uniform(-1.5, 0.0) * slender

    def hull() -> g.Convex:
        points = rng.normal(size=(int(rng.integers(4, 14)), 3)) * np.maximum(sizes(3), 1e-3)
        return g.Convex(points.T, "hull")

    return {
        "sphere": [g.Sphere(*sizes(1)) for _ in range(count)],
        "box": [g.Box(*sizes(3)) for _ in range(count)],
        "cylinder": [g.Cylinder(*sizes(2)) for _ in range(count)],
        "capsule": [g.Capsule(*sizes(2)) for _ in range(count)],
        "ellipsoid": [g.Ellipsoid(*sizes(3)) for _ in range(count)],
        "hull": [hull() for _ in range(count)],
        "half_space": [g.HalfSpace()],
    }


def make_library(rng: np.random.Generator, count: int = 60) -> Library:
    """A library with `count` shapes of each kind."""
    state = GeometryState()
    source = state.register_source("fuzz")
    frames = {WORLD_FRAME_ID: 0}
    rows, polytopes = {}, []
    for kind, shapes in random_shapes(rng, count).items():
        rows[kind] = np.arange(len(frames) - 1, len(frames) - 1 + len(shapes))
        for shape in shapes:
            frame = state.register_frame(source, WORLD_FRAME_ID, g.GeometryFrame(f"frame{len(frames)}"))
            frames[frame] = len(frames)
            instance = g.GeometryInstance(RigidTransform(), shape, f"shape{len(frames)}")
            instance.set_proximity_properties(g.ProximityProperties())
            state.register_geometry(source, frame, instance)
            polytopes.append(polytope_of(shape))
    state.apply_proximity_defaults(g.DefaultProximityProperties())
    model, _ = compile_proximity(state, frames)
    vertices, normals, edges = (padded([p[k] for p in polytopes], k == 0) for k in range(3))
    return Library(model, rows, vertices, normals, edges)


def polytope_of(shape: g.Shape) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, unit normals (and their opposites) and directions of edges of a shape's core, as far as it has some."""
    z = np.array([[0.0, 0.0, 1.0]])
    if isinstance(shape, g.Box):
        corners = np.array(list(itertools.product((-0.5, 0.5), repeat=3))) * shape.size()
        return corners, np.concatenate([np.eye(3), -np.eye(3)]), np.eye(3)
    if isinstance(shape, g.Convex):
        mesh = shape.GetConvexHull()
        edges = {tuple(sorted(e)) for f in mesh._faces for e in zip(f, (*f[1:], f[0]))}
        lines = np.array([mesh._vertices[a] - mesh._vertices[b] for a, b in edges])
        normals = np.array(mesh._normals)
        return mesh._vertices, np.concatenate([normals, -normals]), lines / np.linalg.norm(lines, axis=1)[:, None]
    if isinstance(shape, (g.Cylinder, g.Capsule)):
        return shape.length() / 2 * np.concatenate([z, -z]), np.concatenate([z, -z]), z
    return np.zeros((1, 3)), np.zeros((1, 3)), np.zeros((1, 3))


def padded(parts: list[np.ndarray], repeat: bool) -> np.ndarray:
    """Arrays of different lengths as one, filled with the first row or zero."""
    most = max(map(len, parts))
    filled = [np.concatenate([p, np.repeat(p[:1] * repeat, most - len(p), axis=0)]) for p in parts]
    return np.array(filled)


def how_alike(a: np.ndarray, b: np.ndarray, scale: float, curved: bool) -> int:
    """Which of `ALIKE` two tables of a pair's contacts are, relative to `scale` [m]."""
    if a.tobytes() == b.tobytes():
        return 0
    last = np.full(ContactPoint.SIZE, PLACE * scale)
    last[ContactPoint.nhat_BA_W.columns], last[ContactPoint.depth] = PLACE, DIGITS * scale
    if a.shape == b.shape and (np.abs(a - b) <= last).all():
        return 1
    deeper = abs(a[:, ContactPoint.depth].max(initial=0.0) - b[:, ContactPoint.depth].max(initial=0.0)) / scale
    if len(a) == 0 or len(b) == 0:
        elsewhere = True
    else:
        turned = a[0, ContactPoint.nhat_BA_W.columns] - b[0, ContactPoint.nhat_BA_W.columns]
        elsewhere = np.abs(turned).max() > TURNED
    return 2 if elsewhere and deeper <= (GAP if curved else DIGITS) else 3


# ---- many pairs at once


class Batch:
    """Pairs of shapes of a library: A is row 2 k of the model, B row 2 k + 1."""

    def __init__(self, library: Library, shapes: np.ndarray, R: np.ndarray, p: np.ndarray):
        self.library, self.shapes, self.R, self.p = library, shapes, R, p
        self.n = len(shapes)
        model = library.model
        geometry = model.geometry[shapes.ravel()].copy()
        geometry[:, Geometry.body] = np.arange(1, 2 * self.n + 1)
        pair, family = _by_family(np.arange(2 * self.n).reshape(-1, 2), geometry[:, Geometry.kind])
        self.model = model._replace(
            geometry=geometry,
            size=model.size[shapes.ravel()].copy(),
            material=model.material[shapes.ravel()].copy(),
            X_BG=model.X_BG[shapes.ravel()].copy(),
            pair=pair,
            family=family,
        )
        self.kind = geometry[:, Geometry.kind].reshape(-1, 2)
        self.size = self.model.size.reshape(self.n, 2, -1)
        self.table = contact_table(self.model, columns.MAX_POINTS * self.n, self.n)
        self.shaken: np.ndarray | None = None
        """Poses of all bodies that are searched first, so that there is something to remember."""
        self.alike = np.zeros(len(ALIKE), int)
        """How many searches with memory were how much alike those without, for each of `ALIKE`."""

    def X_WB(self) -> np.ndarray:
        """Poses of all bodies, the world first, shape (2 n + 1, 12)."""
        X = np.zeros((2 * self.n + 1, BodyPose.SIZE))
        X[0, [0, 4, 8]] = 1.0
        X[1:, BodyPose.R_WB.columns] = self.R.reshape(-1, 9)
        X[1:, BodyPose.p_WB.columns] = self.p.reshape(-1, 3)
        return X

    def bound(self) -> np.ndarray:
        """Sum of the radii of the bounding spheres [m]; a half space counts for nothing."""
        bounds = self.size[:, :, Size.bound]
        return np.where(np.isfinite(bounds), bounds, 0.0).sum(axis=1)

    def scale(self) -> np.ndarray:
        """What errors are relative to: the size of each pair, and its position, of which 1e-15 is rounding [m]."""
        return self.bound() + 1e-3 * np.abs(self.p).max(axis=(1, 2))

    def distances(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """phi [m], nhat_BA_W, p_WCa, p_WCb of all pairs, by the kernels."""
        assert find_distances.native(self.model, BodyPoses(self.X_WB()), math.inf, self.table) == 0
        assert self.table.num_contacts == self.n
        assert (self.table.pair[: self.n, ContactPair.geometry_A] == np.arange(0, 2 * self.n, 2)).all()
        rows = self.table.point[: self.n].copy()
        fields = ContactPoint.nhat_BA_W, ContactPoint.p_WCa, ContactPoint.p_WCb
        return -rows[:, ContactPoint.depth], *(rows[:, field.columns] for field in fields)

    def contacts(self, multi: bool) -> tuple[np.ndarray, ContactTable]:
        """How many contacts each pair has, by the kernels, and the table of all."""
        self.model.geometry[:, Geometry.multi_point] = multi
        self.forget()
        assert find_contacts(self.model, self.X_WB(), self.table) == 0
        if self.shaken is not None:
            without = self.of_each_pair()
            self.forget()
            assert find_contacts(self.model, self.shaken, self.table) == 0
            assert find_contacts(self.model, self.X_WB(), self.table) == 0
            for a, b, scale in zip(without, self.of_each_pair(), self.scale()):
                self.alike[how_alike(a, b, scale, bool({KINDS[k] for k in self.kind[0]} & CURVED))] += 1
        found = self.table.pair[: self.table.num_contacts, ContactPair.geometry_A]
        return np.bincount(found // 2, minlength=self.n), self.table

    def forget(self) -> None:
        """Empties what is remembered of the pairs."""
        for memory in (self.table.near_count, self.table.remembered, self.table.slot):
            memory[:] = 0

    def of_each_pair(self) -> list[np.ndarray]:
        """The contacts of each pair, shape (contacts, numbers of a contact)."""
        rows = self.table.num_contacts
        ends = np.searchsorted(self.table.pair[:rows, ContactPair.geometry_A], 2 * np.arange(self.n + 1))
        return [self.table.point[a:b].copy() for a, b in itertools.pairwise(ends)]

    def shake(self, rng: np.random.Generator) -> None:
        """From now on pairs are searched first where they were a moment ago."""
        size = 10.0 ** rng.uniform(-9.0, -1.0, (self.n, 2, 1))
        angles = (size * rng.normal(size=(self.n, 2, 3))).reshape(-1, 3)
        turned = [RotationMatrix(RollPitchYaw(*a)).matrix() for a in angles]
        p = self.p + size * self.bound()[:, None, None] * rng.normal(size=(self.n, 2, 3))
        R = self.R @ np.array(turned).reshape(self.n, 2, 3, 3)
        self.shaken = Batch(self.library, self.shapes, R, p).X_WB()

    # ---- what is certain

    def reach(self, side: int, n: np.ndarray, core: bool = False) -> np.ndarray:
        """Largest n . x of shape A or B about its origin, for directions n, shape (pairs, directions, 3)."""
        rows = self.shapes[:, side]
        d = np.einsum("kdi,kij->kdj", n, self.R[:, side])
        kind, size = int(self.kind[0, side]), self.size[:, side, None]
        if kind == columns.BOX:
            return (np.abs(d) * size[..., :3]).sum(axis=-1)
        if kind == columns.HULL:
            return np.einsum("kdj,kvj->kdv", d, self.library.vertices[rows]).max(axis=-1)
        if kind == columns.ELLIPSOID:
            return np.linalg.norm(d * size[..., :3], axis=-1)
        radius = 0.0 if core else size[..., Size.radius] * np.linalg.norm(n, axis=-1)
        if kind == columns.SPHERE:
            return radius + 0.0 * d[..., 0]
        along = size[..., Size.half_length] * np.abs(d[..., 2])
        if kind == columns.CAPSULE:
            return radius + along
        return size[..., Size.radius] * np.hypot(d[..., 0], d[..., 1]) + along  # cylinder

    def separation(self, n: np.ndarray) -> np.ndarray:
        """s(n) of directions n from B to A, shape (pairs, directions, 3) [m]."""
        r = self.p[:, 0] - self.p[:, 1]
        return np.einsum("kdi,ki->kd", n, r) - self.reach(0, -n) - self.reach(1, n)

    def outside(self, side: int, p: np.ndarray) -> np.ndarray:
        """How far points, shape (pairs, 3), are from being in the core of shape A or B; a bound from above [m]."""
        q = np.einsum("ki,kij->kj", p - self.p[:, side], self.R[:, side])
        kind, size = int(self.kind[0, side]), self.size[:, side]
        if kind == columns.BOX:
            return np.maximum(np.abs(q) - size[:, :3], 0.0).sum(axis=-1)
        if kind == columns.HULL:
            normals, vertices = self.library.normals[self.shapes[:, side]], self.library.vertices[self.shapes[:, side]]
            heights = np.einsum("kfj,kvj->kfv", normals, vertices).max(axis=-1)
            return np.maximum((np.einsum("kfj,kj->kf", normals, q) - heights).max(axis=-1), 0.0)
        if kind == columns.ELLIPSOID:
            level = np.linalg.norm(q / size[:, :3], axis=-1)
            return np.maximum(1.0 - 1.0 / np.maximum(level, 1.0), 0.0) * np.linalg.norm(q, axis=-1)
        if kind == columns.SPHERE:
            return np.linalg.norm(q, axis=-1)
        radius = size[:, Size.radius] if kind == columns.CYLINDER else 0.0
        radial = np.maximum(np.hypot(q[:, 0], q[:, 1]) - radius, 0.0)
        return radial + np.maximum(np.abs(q[:, 2]) - size[:, Size.half_length], 0.0)

    def margin(self, side: int) -> np.ndarray:
        """By how much shape A or B is larger than its core [m]."""
        round_ = int(self.kind[0, side]) in (columns.SPHERE, columns.CAPSULE)
        return self.size[:, side, Size.radius] * round_

    def axes(self) -> np.ndarray:
        """Every direction that can be the nearest way out of two polytopes, in W, shape (pairs, directions, 3)."""
        parts, edges = [], []
        for side in range(2):
            rows, R = self.shapes[:, side], self.R[:, side]
            parts.append(np.einsum("kij,kdj->kdi", R, self.library.normals[rows]))
            edges.append(np.einsum("kij,kdj->kdi", R, self.library.edges[rows]))
        crossed = np.cross(edges[0][:, :, None], edges[1][:, None]).reshape(self.n, -1, 3)
        length = np.linalg.norm(crossed, axis=-1, keepdims=True)
        crossed = np.where(length > 1e-6, crossed / np.maximum(length, 1e-6), 0.0)
        return np.concatenate([*parts, crossed, -crossed], axis=1)


def best_direction(batch: Batch, n: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The largest separation among directions, and its direction; zero vectors do not count."""
    length = np.linalg.norm(n, axis=-1)
    s = np.where(length > 0.5, batch.separation(n), -np.inf)
    best = s.argmax(axis=1)
    k = np.arange(len(s))
    return s[k, best], n[k, best]


def sought(batch: Batch, nhat: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The largest separation that a search finds: over the sphere, then about the best, and about nhat [m]."""
    spread = rng.normal(size=(batch.n, 200, 3))
    spread /= np.linalg.norm(spread, axis=-1, keepdims=True)
    most, best = best_direction(batch, np.concatenate([batch.axes(), spread], axis=1))
    answers = [most]
    for centre in (best, nhat):
        width, s = 0.3, batch.separation(centre[:, None])[:, 0]
        for _ in range(20):
            tried = centre[:, None] + width * rng.normal(size=(batch.n, 16, 3))
            tried /= np.linalg.norm(tried, axis=-1, keepdims=True)
            found, direction = best_direction(batch, tried)
            better = found > s
            s, centre = np.where(better, found, s), np.where(better[:, None], direction, centre)
            width *= 0.6
        answers.append(s)
    return np.max(answers, axis=0)


class Errors(NamedTuple):
    """Of every pair of a batch, in metres.

    Attributes:
        phi: the answer.
        low: it differs so much from the separation of its own normal.
        high: so much is uncertain: the nearest points are farther apart, or another direction separates more.
        contact: so much do the contact points differ from the distance.
        sign: whether shapes that are apart are said to overlap or the reverse, by more than 1e-7 of the size.
    """

    phi: np.ndarray
    low: np.ndarray
    high: np.ndarray
    contact: np.ndarray
    sign: np.ndarray

    def relative(self, scale: np.ndarray) -> np.ndarray:
        """The largest errors (low, high, contact) of near pairs and of the others, shape (2, 3)."""
        errors = np.array([self.low, self.high, self.contact]) / scale
        near = np.abs(self.phi) <= NEAR * scale
        return np.array([np.where(part, errors, 0.0).max(axis=1) for part in (near, ~near)])


def check(batch: Batch, rng: np.random.Generator) -> Errors:
    """Asks the kernels about all pairs of a batch and checks the answers."""
    phi, nhat, p_a, p_b = batch.distances()
    finite = np.isfinite(phi) & np.isfinite(nhat).all(axis=1) & np.isfinite(p_a).all(axis=1)
    assert finite.all(), "an answer is not a number"
    assert np.abs(np.linalg.norm(nhat, axis=1) - 1.0).max() < 1e-12
    kinds = batch.kind[0]
    curved = {KINDS[k] for k in kinds} & CURVED
    if kinds[1] == columns.HALF_SPACE:
        out = batch.R[:, 1, :, 2]
        exact = np.einsum("ki,ki->k", out, batch.p[:, 0] - batch.p[:, 1]) - batch.reach(0, -out[:, None])[:, 0]
        low, high, least = np.abs(phi - exact), np.linalg.norm(nhat - out, axis=1), exact
    else:
        least = batch.separation(nhat[:, None])[:, 0]
        low = np.abs(phi - least)
        core = phi + batch.margin(0) + batch.margin(1)
        q_a, q_b = p_a + batch.margin(0)[:, None] * nhat, p_b - batch.margin(1)[:, None] * nhat
        apart = np.linalg.norm(q_a - q_b, axis=1)
        gap = np.abs(apart - np.abs(core)) + batch.outside(0, q_a) + batch.outside(1, q_b)
        high = gap.copy()
        inside = core <= 1e-9 * batch.bound()
        if inside.any():
            part = Batch(batch.library, batch.shapes[inside], batch.R[inside], batch.p[inside])
            if curved:
                most = sought(part, nhat[inside], rng)
            else:
                most = best_direction(part, part.axes())[0]
            high[inside] = np.maximum(np.where(np.isfinite(most), most, -np.inf) - phi[inside], 0.0)
            least[inside] = np.maximum(least[inside], most)
    rounding = 1e-7 * batch.bound() + 1e-15 * np.abs(batch.p).max(axis=(1, 2))
    sign = ((least > rounding) & (phi < -rounding)) | ((least < -rounding) & (phi > rounding))
    return Errors(phi, low, high, contact_errors(batch, phi), sign)


def contact_errors(batch: Batch, phi: np.ndarray) -> np.ndarray:
    """By how much the deepest contact of each pair differs from its distance [m]; infinite where there should be none.

    Two boxes may show a face instead of two edges that are up to 5 % less deep. Several points a pair are those of the
    faces or edges that face each other up to 0.02 rad: as deep as the pair to 1 %, a cap's polygon to 4e-4 of its
    radius, while that is not deep, and then at least half as deep.
    """
    caps = np.where(batch.kind == columns.CYLINDER, batch.size[:, :, Size.radius], 0.0).sum(axis=1)
    errors = np.zeros(batch.n)
    for multi in (False, True):
        count, table = batch.contacts(multi)
        rows = table.num_contacts
        assert np.isfinite(table.point[:rows]).all() and count.max() <= columns.MAX_POINTS
        deepest = np.zeros(batch.n)
        np.maximum.at(deepest, table.pair[:rows, ContactPair.geometry_A] // 2, table.point[:rows, ContactPoint.depth])
        depth = np.maximum(-phi, 0.0)
        slack = 0.06 * depth if (batch.kind[0] == columns.BOX).all() else multi * (0.01 * depth + 4e-4 * caps)
        if multi:
            deepest = np.where((depth > 1e-3 * batch.bound()) & (deepest > 0.5 * depth), depth, deepest)
        errors = np.maximum(errors, np.maximum(np.abs(deepest - depth) - slack, 0.0))
    return errors


# ---- how pairs lie


def random_rotations(rng: np.random.Generator, n: int) -> np.ndarray:
    """Uniformly random rotation matrices, shape (n, 3, 3)."""
    q = rng.normal(size=(n, 4))
    w, x, y, z = (q / np.linalg.norm(q, axis=1)[:, None]).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def cube_rotations(rng: np.random.Generator, n: int) -> np.ndarray:
    """Rotations that take axes to axes."""
    found = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((-1.0, 1.0), repeat=3):
            R = np.zeros((3, 3))
            R[range(3), order] = signs
            if np.linalg.det(R) > 0.0:
                found.append(R)
    return np.array(found)[rng.integers(len(found), size=n)]


def make_batch(library: Library, kinds: tuple[str, str], regime: str, n: int, rng: np.random.Generator) -> Batch:
    """n pairs of two kinds that lie to one another as `regime` says."""
    shapes = np.stack([rng.choice(library.rows[kind], n) for kind in kinds], axis=1)
    R = np.stack([random_rotations(rng, n), random_rotations(rng, n)], axis=1)
    bounds = library.model.size[shapes, Size.bound]
    reach = np.where(np.isfinite(bounds), bounds, 0.0).sum(axis=1)[:, None]
    away = random_rotations(rng, n)[:, 0] * reach
    p = np.stack([rng.uniform(-1.0, 1.0, (n, 3)), np.zeros((n, 3))], axis=1)
    if regime == "aligned":
        half = library.model.size[shapes, :3]
        R[:, 1] = cube_rotations(rng, n) @ np.where(rng.random((n, 1, 1)) < 0.5, np.eye(3), R[:, 1])
        R[:, 0] = R[:, 1] @ cube_rotations(rng, n)
        steps = rng.integers(-1, 2, (n, 2, 3))
        local = np.einsum("kij,kj->ki", np.swapaxes(R[:, 1], 1, 2) @ R[:, 0], half[:, 0] * steps[:, 0])
        away = np.einsum("kij,kj->ki", R[:, 1], local + half[:, 1] * steps[:, 1])
    elif regime == "deep":
        away *= rng.choice([0.0, 1e-14, 1e-8, 1e-3], (n, 1))
    elif regime == "far":
        p[:, 0] *= 10.0 ** rng.uniform(0.0, 4.0, (n, 1))
        away *= 10.0 ** rng.uniform(0.0, 4.0, (n, 1))
    else:
        away *= rng.uniform(0.0, 1.1, (n, 1))
    p[:, 1] = p[:, 0] + away
    batch = Batch(library, shapes, R, p)
    if regime == "touching":
        phi, nhat, _, _ = batch.distances()
        gap = rng.choice([-1.0, 1.0], n) * 10.0 ** rng.uniform(-14.0, -2.0, n) * batch.bound()
        batch.p[:, 1] += (np.where(rng.random(n) < 0.1, 0.0, -gap) + phi)[:, None] * nhat
    return batch


# ---- the report


class Findings(NamedTuple):
    """About one pair of kinds.

    Attributes:
        queries: how many there were.
        signs: how many had the wrong sign.
        alike: how many searches with memory were how much alike those without, for each of `ALIKE`.
        errors: the largest of near pairs and of others, relative to the size, of distance, certainty and contacts.
    """

    queries: int
    signs: int
    alike: np.ndarray
    errors: np.ndarray

    def good(self, kinds: tuple[str, str]) -> bool:
        """Whether everything is as accurate as stated."""
        return self.signs == 0 and self.alike[-1] == 0 and bool((self.errors.max(axis=1) <= accuracy_of(kinds)).all())


def fuzz(pairs: int, seed: int = 1, chunk: int = 2000, memory: bool = False) -> dict[tuple[str, str], Findings]:
    """Runs so many queries, evenly over kinds and the ways they lie; what was found for each pair of kinds."""
    rng = np.random.default_rng(seed)
    found = {}
    each = max(1, round(pairs / (len(PAIRS) * len(REGIMES))))
    library = make_library(rng)
    for kinds in PAIRS:
        most = chunk // 4 if "hull" in kinds else chunk
        total, wrong, alike, worst = 0, 0, np.zeros(len(ALIKE), int), np.zeros((2, 3))
        for regime in REGIMES:
            for start in range(0, each, most):
                batch = make_batch(library, kinds, regime, min(most, each - start), rng)
                if memory:
                    batch.shake(rng)
                errors = check(batch, rng)
                worst = np.maximum(worst, errors.relative(batch.scale()))
                wrong += int(errors.sign.sum())
                alike += batch.alike
                total += batch.n
        found[kinds] = Findings(total, wrong, alike, worst)
    return found


def main(argv: list[str] | None = None) -> int:
    """Runs the queries and prints the findings; 1 if something is less accurate than stated."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--pairs", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--memory", action="store_true", help="contacts with what is remembered of the pairs")
    arguments = parser.parse_args(argv)
    began = time.process_time()
    found = fuzz(arguments.pairs, arguments.seed, memory=arguments.memory)
    print(f"{'':<22} {'':>8} {'wrong':>6} {'near':^29} | {'deep or apart':^29}")
    print(f"{'pair':<22} {'queries':>8} {'signs':>6} " + " | ".join([f"{'own':>9} {'certain':>9} {'contacts':>9}"] * 2))
    for kinds, findings in found.items():
        near, others = (" ".join(f"{e:9.1e}" for e in row) for row in findings.errors)
        mark = "" if findings.good(kinds) else " *"
        print(f"{'-'.join(kinds):<22} {findings.queries:8d} {findings.signs:6d} {near} | {others}{mark}")
    total = sum(findings.queries for findings in found.values())
    if arguments.memory:
        alike = sum(findings.alike for findings in found.values())
        print("searches with memory and without:", ", ".join(f"{n} {how}" for n, how in zip(alike, ALIKE)))
    print(f"{total} queries in {time.process_time() - began:.0f} s of one processor")
    return 0 if all(findings.good(kinds) for kinds, findings in found.items()) else 1


if __name__ == "__main__":
    sys.exit(main())
