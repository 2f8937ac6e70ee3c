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
    assert sum(findings.differ for findings in found.values()) == 0


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
