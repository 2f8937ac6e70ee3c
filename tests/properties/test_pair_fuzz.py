"""A sample of `tools/fuzz_pairs.py`: random, touching, aligned, deep and far pairs of all shapes."""

from __future__ import annotations

import numpy as np
import pytest
from tools import fuzz_pairs


def test_every_distance_is_certain_to_the_stated_accuracy():
    found = fuzz_pairs.fuzz(len(fuzz_pairs.PAIRS) * len(fuzz_pairs.REGIMES) * 60, seed=3)
    assert set(found) == set(fuzz_pairs.PAIRS)
    bad = {kinds: findings for kinds, findings in found.items() if not findings.good(kinds)}
    assert not bad


def test_contacts_with_memory_are_as_certain_and_the_same_bits():
    found = fuzz_pairs.fuzz(len(fuzz_pairs.PAIRS) * len(fuzz_pairs.REGIMES) * 30, seed=6, memory=True)
    assert all(findings.good(kinds) for kinds, findings in found.items())
    same, *others = sum(findings.alike for findings in found.values())
    assert same > 0 and not any(others)


@pytest.mark.parametrize("kinds", [("capsule", "ellipsoid"), ("cylinder", "capsule")], ids="-".join)
def test_aligned_shapes_have_the_same_bits_with_memory(kinds):
    """Directions between them have parts that are 0, which a search may come to from either side."""
    rng = np.random.default_rng(1)
    batch = fuzz_pairs.make_batch(fuzz_pairs.make_library(rng), kinds, "aligned", 1000, rng)
    batch.shake(rng)
    batch.contacts(multi=False)
    assert batch.alike.tolist() == [batch.n, 0, 0, 0]


def test_contacts_that_differ_are_told_apart():
    """Last digits, one of two sides that are as deep, a mere touch, and what is wrong: a depth, a place, a number."""
    place, depth, normal = (
        fuzz_pairs.ContactPoint.p_WCa,
        fuzz_pairs.ContactPoint.depth,
        fuzz_pairs.ContactPoint.nhat_BA_W,
    )
    one = np.zeros((1, fuzz_pairs.ContactPoint.SIZE))
    one[0, normal.columns], one[0, depth] = (0.0, 0.0, 1.0), 0.1

    def changed(columns, by):
        other = one.copy()
        other[0, columns] += by
        return other

    def how(other, curved=False):
        return fuzz_pairs.ALIKE[fuzz_pairs.how_alike(one, other, 1.0, curved)]

    none, elsewhere = one[:0], changed(normal.columns, (0.0, 0.0, -2.0))
    slightly = elsewhere.copy()
    slightly[0, depth] += 1e-8
    assert how(one.copy()) == "the same bits"
    assert how(changed(place.columns, 1e-15)) == "other last digits"
    assert how(elsewhere) == how(slightly, curved=True) == "as deep"
    for other in (changed(depth, 1e-8), changed(place.columns, 1e-3), np.repeat(one, 2, axis=0), slightly, none):
        assert how(other) == "wrong"
    touch = changed(depth, 1e-15 - 0.1)
    assert fuzz_pairs.ALIKE[fuzz_pairs.how_alike(touch, none, 1.0, False)] == "as deep"


@pytest.mark.parametrize("kinds", [("box", "box"), ("cylinder", "ellipsoid"), ("capsule", "hull")], ids="-".join)
@pytest.mark.parametrize("fault", ["depth", "normal", "sign"])
def test_a_planted_fault_is_found(kinds, fault, monkeypatch):
    rng = np.random.default_rng(4)
    library = fuzz_pairs.make_library(rng, count=10)
    batch = fuzz_pairs.make_batch(library, kinds, "anywhere", 200, rng)
    phi, nhat, p_a, p_b = batch.distances()
    if fault == "depth":
        phi = phi + 1e-4 * batch.bound()
    elif fault == "sign":
        phi = -phi
    else:
        nhat = np.roll(nhat, 1, axis=1)
    monkeypatch.setattr(batch, "distances", lambda: (phi, nhat, p_a, p_b))
    errors = fuzz_pairs.check(batch, rng)
    assert np.median((errors.low + errors.high) / batch.bound()) > 0.9e-4
    assert (fault == "sign") == (np.mean(errors.sign) > 0.9)


def test_coaxial_cylinders_leave_by_the_shorter_way():
    """The tetrahedron that GJK hands to EPA has no volume here, and vertices of caps lie inside their plane."""
    rng = np.random.default_rng(5)
    library = fuzz_pairs.make_library(rng)
    for kinds in (("cylinder", "cylinder"), ("box", "cylinder"), ("cylinder", "capsule")):
        batch = fuzz_pairs.make_batch(library, kinds, "aligned", 2000, rng)
        assert fuzz_pairs.check(batch, rng).high == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("kinds", [("box", "box"), ("cylinder", "cylinder"), ("hull", "hull")], ids="-".join)
def test_the_normal_is_known_while_shapes_only_just_touch(kinds):
    """The vector between the shapes is as short as rounding there: along the normal they are as far apart as said."""
    rng = np.random.default_rng(6)
    library = fuzz_pairs.make_library(rng)
    batch = fuzz_pairs.make_batch(library, kinds, "touching", 1000, rng)
    errors = fuzz_pairs.check(batch, rng)
    assert (errors.low / batch.bound()).max() < 1e-12
    assert not errors.sign.any()
