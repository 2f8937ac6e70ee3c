"""Regions of free configurations: no smaller than pydrake's, and free where pydrake's checker looks."""

import importlib

import numpy as np
import pytest
from tests.crosscheck.pydrake import test_collision_checker_against_pydrake as robot

pytestmark = [pytest.mark.peer, pytest.mark.slow]
pytest.importorskip("clarabel")

OURS, THEIRS = robot.OURS, robot.THEIRS
for _library, _name in ((OURS, "sheldrake"), (THEIRS, "pydrake")):
    _library.sets = importlib.import_module(f"{_name}.geometry.optimization")
    _library.common = importlib.import_module(f"{_name}.common")
SEED = np.array([0.3, 0.5, -0.2])
LOW, HIGH = np.array([-3.0, -3, -3]), np.array([2.5, 3, 3])


def sampled(L, kind, **fields):
    options = kind()
    common = {"num_particles": 150, "epsilon": 0.1, "delta": 0.2, "max_iterations": 1, "mixing_steps": 20, **fields}
    for name, value in common.items():
        setattr(options.sampled_iris_options, name, value)
    return options


def zero_order(L, checker, ball, domain):
    return L.planning.IrisZo(checker, ball, domain, sampled(L, L.planning.IrisZoOptions))


def greedy(L, checker, ball, domain):
    return L.planning.IrisNp2(checker, ball, domain, sampled(L, L.planning.IrisNp2Options))


def rays(L, checker, ball, domain):
    options = sampled(L, L.planning.IrisNp2Options)
    options.sampling_strategy = "ray"
    return L.planning.IrisNp2(checker, ball, domain, options)


def by_programs(L, checker, ball, domain):
    checker.UpdatePositions(SEED)
    options = L.sets.IrisOptions(iteration_limit=1, num_collision_infeasible_samples=6, starting_ellipse=ball)
    return L.sets.IrisNp(checker.plant(), checker.plant_context(), options)


def spread(region, count):
    """Random points of a region."""
    from sheldrake.planning._sampled_iris import hit_and_run

    mine = OURS.sets.HPolyhedron(region.A(), region.b())
    return hit_and_run(mine, SEED, count, 40, np.random.default_rng(2))


@pytest.mark.parametrize("grow", [zero_order, greedy, rays, by_programs])
def test_regions_are_large_and_free(grow):
    volumes = []
    judge = robot.checker(THEIRS)
    for L in (OURS, THEIRS):
        ball = L.sets.Hyperellipsoid.MakeHypersphere(0.1, SEED)
        region = grow(L, robot.checker(L), ball, L.sets.HPolyhedron.MakeBox(LOW, HIGH))
        assert region.PointInSet(SEED)
        free = judge.CheckConfigsCollisionFree(list(spread(region, 300)))
        assert np.mean(free) > 0.9
        volumes.append(region.MaximumVolumeInscribedEllipsoid().CalcVolume())
    assert volumes[0] > 0.4 * volumes[1], volumes  # more is better where it is as free


def test_visibility_and_cliques():
    found = []
    points = np.random.default_rng(1).uniform(-2, 2, (3, 25))
    for L in (OURS, THEIRS):
        p = L.planning
        graph = p.VisibilityGraph(robot.checker(L, edge_step_size=0.5), points)
        greedy = p.MaxCliqueSolverViaGreedy()
        rows = [graph.toarray().tolist(), greedy.SolveMaxClique(graph).tolist()]
        cover = p.MinCliqueCoverSolverViaGreedy(greedy, 2)
        rows.append(sorted(sorted(c) for c in cover.SolveMinCliqueCover(graph, True)))
        found.append(rows)
        # Without partition each edge is in exactly one clique.
        edges = [(i, j) for c in cover.SolveMinCliqueCover(graph) for i in c for j in c if i < j]
        i, j = np.nonzero(np.triu(graph.toarray(), 1))
        assert sorted(edges) == list(zip(i, j))
    assert found[0] == found[1]


def test_largest_cliques():
    A = np.random.default_rng(3).uniform(size=(12, 12)) < 0.5
    A = A | A.T
    largest = OURS.planning.MaxCliqueSolverViaMip().SolveMaxClique(A)
    members = np.flatnonzero(largest)
    assert all(A[i, j] for i in members for j in members if i != j)
    assert largest.sum() >= OURS.planning.MaxCliqueSolverViaGreedy().SolveMaxClique(A).sum()


def test_a_cover_by_cliques():
    checker = robot.checker(OURS, edge_step_size=0.5)
    options = OURS.planning.IrisFromCliqueCoverOptions()
    options.iris_options = sampled(OURS, OURS.planning.IrisZoOptions)
    options.num_points_per_visibility_round, options.iteration_limit = 15, 1
    options.num_points_per_coverage_check, options.minimum_clique_size = 20, 4
    sets = OURS.planning.IrisInConfigurationSpaceFromCliqueCover(checker, options, OURS.common.RandomGenerator(1), [])
    assert sets
    for region in sets:
        inside = [region.ChebyshevCenter()]
        assert checker.CheckConfigsCollisionFree(inside) == [1]


def test_seeds_in_collision_are_refused():
    o, checker = OURS.sets, robot.checker(OURS)
    q = next(q for q in robot.configurations() if not checker.CheckConfigCollisionFree(q))
    with pytest.raises(RuntimeError, match="in collision"):
        OURS.planning.IrisZo(checker, o.Hyperellipsoid.MakeHypersphere(0.1, q), o.HPolyhedron.MakeBox(LOW, HIGH))
    checker.UpdatePositions(q)
    with pytest.raises(RuntimeError, match="in collision"):
        o.IrisNp(checker.plant(), checker.plant_context())


def test_a_planted_fault_is_seen():
    """A checker that sees nothing gives a region in which there are collisions."""
    checker = robot.checker(OURS)
    blind = checker.Clone()
    blind._is_free = lambda context: True
    ball, box = OURS.sets.Hyperellipsoid.MakeHypersphere(0.1, SEED), OURS.sets.HPolyhedron.MakeBox(LOW, HIGH)
    region = zero_order(OURS, blind, ball, box)
    assert np.mean(checker.CheckConfigsCollisionFree(list(spread(region, 200)))) < 0.9
