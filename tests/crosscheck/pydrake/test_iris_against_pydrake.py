"""Regions without obstacles, pieces of sets with angles, and files of regions: the same in both libraries."""

import importlib
import math

import numpy as np
import pytest

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")
pytest.importorskip("clarabel")

OURS, THEIRS = (importlib.import_module(f"{name}.geometry.optimization") for name in ("sheldrake", "pydrake"))


def scene(o):
    obstacles = [
        o.VPolytope(np.array([[0.2, 0.5, 0.4], [0.3, 0.2, 0.6]])),
        o.Hyperellipsoid.MakeHypersphere(0.3, [1.5, 1.2]),
        o.HPolyhedron.MakeBox([0, 1.5], [0.6, 1.8]),
        o.MinkowskiSum(o.Point([1.2, 0.1]), o.Hyperellipsoid.MakeHypersphere(0.2, [0, 0])),
    ]
    return obstacles, o.HPolyhedron.MakeBox([0, 0], [2, 2])


@pytest.mark.parametrize(
    "fields",
    [{}, {"iteration_limit": 1}, {"iteration_limit": 2}, {"require_sample_point_is_contained": True}],
    ids=str,
)
@pytest.mark.parametrize("sample", [(0.9, 0.9), (0.1, 0.1), (1.8, 1.8)])
def test_regions(fields, sample):
    found = []
    for o in (OURS, THEIRS):
        obstacles, domain = scene(o)
        region = o.Iris(obstacles, sample, domain, o.IrisOptions(**fields))
        found.append((region.A(), region.b(), region.MaximumVolumeInscribedEllipsoid().CalcVolume()))
    (A, b, volume), (A2, b2, volume2) = found
    assert A.shape == A2.shape
    np.testing.assert_allclose(A, A2, atol=2e-4)
    np.testing.assert_allclose(b, b2, atol=2e-4)
    np.testing.assert_allclose(volume, volume2, rtol=1e-4)


def test_regions_avoid_obstacles():
    obstacles, domain = scene(OURS)
    region = OURS.Iris(obstacles, [0.9, 0.9], domain)
    inner = region.Scale(0.998)
    assert not any(inner.IntersectsWith(s) for s in obstacles)
    with pytest.raises(RuntimeError, match="bounded"):
        OURS.Iris(obstacles, [0.9, 0.9], OURS.HPolyhedron(np.eye(2), np.ones(2)))


def test_bounding_regions_and_first_ellipsoids():
    volumes = []
    for o in (OURS, THEIRS):
        obstacles, domain = scene(o)
        options = o.IrisOptions()
        options.bounding_region = o.HPolyhedron.MakeBox([0.5, 0.5], [1.3, 1.9])
        options.starting_ellipse = o.Hyperellipsoid.MakeAxisAligned([0.01, 0.3], [0.9, 0.9])
        region = o.Iris(obstacles, [0.9, 0.9], domain, options)
        volumes.append(region.MaximumVolumeInscribedEllipsoid().CalcVolume())
    np.testing.assert_allclose(*volumes, rtol=1e-4)


@pytest.mark.parametrize("width", [1, 3.1415926, 3.2, 6.5, 9.5])
def test_pieces(width):
    found = []
    for o in (OURS, THEIRS):
        whole = o.HPolyhedron.MakeBox([0.5, 0, 0], [0.5 + width, 1, 4])
        pieces = o.PartitionConvexSet(whole, [0, 2], 1e-3)
        boxes = [o.Hyperrectangle.MaybeCalcAxisAlignedBoundingBox(p) for p in pieces]
        rows = sorted(tuple(np.concatenate((b.lb(), b.ub())).round(6) + 0.0) for b in boxes)
        found.append((o.CheckIfSatisfiesConvexityRadius(whole, [0]), rows))
    assert found[0][0] == found[1][0]
    np.testing.assert_allclose(found[0][1], found[1][1], atol=1e-5)


def test_what_is_refused():
    for o in (OURS, THEIRS):
        box = o.HPolyhedron.MakeBox([0, 0], [1, 1])
        for joints in ([0, 0], [2]):
            with pytest.raises(RuntimeError, match="continuous_revolute_joints"):
                o.PartitionConvexSet(box, joints)
        with pytest.raises(RuntimeError, match="bound"):
            o.PartitionConvexSet(o.HPolyhedron(np.eye(2), [1, 1]), [0])


def test_pairs_that_meet():
    found = []
    for o in (OURS, THEIRS):
        intervals = [(0, 2), (1.5, 3), (2 * math.pi + 1, 2 * math.pi + 1.6), (-4, -3), (10, 12)]
        sets = [o.HPolyhedron.MakeBox([a, 0], [b, 1]) for a, b in intervals]
        rows = [o.ComputePairwiseIntersections(sets, [0]), o.ComputePairwiseIntersections(sets, [])]
        rows += [o.ComputePairwiseIntersections(sets[:2], sets[1:], [0])]
        rows += [o.ComputePairwiseIntersections(convex_sets=sets, continuous_revolute_joints=[0])]
        found.append(rows)
    for mine, other in zip(*found):
        assert mine[0] == other[0]
        np.testing.assert_allclose(mine[1], other[1], atol=1e-12)


def test_files_of_regions(tmp_path):
    texts = []
    for o in (OURS, THEIRS):
        regions = {"b": o.HPolyhedron(np.array([[1, 0.3]]), [2.0]), "a": o.HPolyhedron.MakeBox([0, 0], [1, 2.5])}
        for child in (None, "regions"):
            path = tmp_path / "regions.yaml"
            o.SaveIrisRegionsYamlFile(path, regions, child_name=child)
            texts.append((o, path.read_text()))
            for reader in (OURS, THEIRS):
                back = reader.LoadIrisRegionsYamlFile(path, child_name=child)
                assert sorted(back) == ["a", "b"] and np.array_equal(back["b"].A(), [[1, 0.3]])
    assert [t for o, t in texts if o is OURS] == [t for o, t in texts if o is THEIRS]


def test_graphs_that_grow():
    found = []
    for o in (OURS, THEIRS):
        graph = o.GraphOfConvexSets()
        vertices = [graph.AddVertex(o.Point([float(i)]), f"p{i}") for i in range(5)]
        for i, j in ((0, 1), (1, 2), (2, 0), (3, 4)):
            graph.AddEdge(vertices[i], vertices[j], f"{i}{j}")
        implicit = o.ImplicitGraphOfConvexSetsFromExplicit(graph)
        start = implicit.ImplicitVertexFromExplicit(vertices[0])
        first = [e.name() for e in implicit.Successors(start)]
        implicit.ExpandRecursively(start)
        found.append((first, implicit.gcs().num_vertices(), implicit.gcs().num_edges()))
    assert found[0] == found[1] == (["01"], 3, 3)


def test_a_planted_fault_is_seen():
    obstacles, domain = scene(OURS)
    obstacles[1] = OURS.Hyperellipsoid.MakeHypersphere(0.303, [1.5, 1.2])
    region = OURS.Iris(obstacles, [0.9, 0.9], domain)
    theirs, their_domain = scene(THEIRS)
    other = THEIRS.Iris(theirs, [0.9, 0.9], their_domain)
    assert np.abs(region.b() - other.b()).max() > 1e-3
