"""Parts of an island that move alone, all others being held, between two steps of all."""

import numpy as np
import pytest
from tests.unit.multibody.contact_solvers.test_factor import Island
from tests.unit.multibody.contact_solvers.test_solver import RandomProblem

import sheldrake.all as lib
from sheldrake.common.kernel import IntVector, kernel
from sheldrake.multibody.contact_solvers._kernels import newton
from sheldrake.multibody.contact_solvers._kernels.cost import newton_direction
from sheldrake.multibody.contact_solvers._kernels.factor import symbolic_factor
from sheldrake.multibody.contact_solvers._kernels.newton import block_of_tree, narrow_to_part, order_island_again
from sheldrake.multibody.contact_solvers._kernels.problem import (
    Block,
    Contacts,
    Factor,
    Participation,
    Problem,
    Rows,
    SolverModel,
)


@kernel(top=True)
def direction_of_part(
    solver_model: SolverModel, problem: Problem, contacts: Contacts, rows: Rows, factor: Factor, held: IntVector
) -> int:
    """dv of the trees that are not held; 1 without room, 2 when their matrix is not positive."""
    if symbolic_factor(solver_model, problem, contacts, rows, factor) != 0:
        return 1
    for t in range(len(held)):
        block_of_tree(factor, t).held = held[t]
    trees_end, contacts_end = problem.trees_end, problem.contacts_end
    narrow_to_part(solver_model, problem, contacts, factor)
    status = newton_direction(solver_model, problem, contacts, rows, factor, 1)
    problem.trees_end, problem.contacts_end = trees_end, contacts_end
    order_island_again(problem, contacts, factor)
    return 0 if status == 0 else 2


@pytest.mark.parametrize("native", [True, False], ids=["native", "twin"])
def test_what_is_held_has_no_part_in_the_matrix(native):
    rng = np.random.default_rng(3)
    for seed in range(20 if native else 2):
        n = int(rng.integers(3, 14))
        sizes = rng.choice([6, 6, 6, 3], n)
        pairs = [tuple(rng.choice(n, 2, replace=False)) for _ in range(2 * n)] + [(0, -1)]
        island = Island(sizes, pairs, seed=seed)
        problem = island.work.problem
        problem.tree[:, Participation.active] = 1
        problem.num_contacts = len(pairs)
        held = np.array(rng.integers(0, 2, n), np.int64)
        held[rng.integers(n)] = 0
        problem.dv[:] = np.nan
        arguments = (island.model, *island.work, held)
        assert (direction_of_part.native(*arguments) if native else direction_of_part(*arguments)) == 0
        moves = np.repeat(held == 0, sizes)
        expected = -np.linalg.solve(island.H[np.ix_(moves, moves)], problem.gradient[moves])
        np.testing.assert_allclose(problem.dv[moves], expected, rtol=1e-9, atol=1e-12)
        beside = {t for pair in pairs if any(u >= 0 and held[u] == 0 for u in pair) for t in pair if t >= 0}
        for t in beside:
            if held[t]:
                first = sum(sizes[:t])
                assert not problem.dv[first : first + sizes[t]].any()
        np.testing.assert_array_equal(problem.tree[:, Participation.order], np.arange(n))
        assert [island.work.contacts[c].order for c in range(len(pairs))] == list(range(len(pairs)))
        assert not island.work.factor.block[:n, Block.held].any()


def solved(seed):
    """Velocities and number of iterations of all of a random problem, solved as Python."""
    random = RandomProblem(np.random.default_rng(seed), sizes=(6,) * 9, contacts=16, to_rest=True)
    random.prepare()
    assert random.stages.solve(random.model, *random.work) == 0
    return random.work.problem.v.copy(), random.work.problem.iterations


@pytest.mark.parametrize("seed", range(4))
def test_the_solution_is_that_without_parts(seed, monkeypatch):
    v, iterations = solved(seed)
    moved = []
    move_part = newton.move_part

    def move(model, problem, *arguments):
        moved.append(problem.trees_end - problem.trees_begin)
        status = move_part(model, problem, *arguments)
        return status

    monkeypatch.setattr(newton, "MANY_TREES", 4)
    monkeypatch.setattr(newton, "FAR_OFF", 1.0)
    monkeypatch.setattr(newton, "LARGEST_PART", 0.95)
    monkeypatch.setattr(newton, "move_part", move)
    v_parts, _ = solved(seed)
    assert iterations > 2 and moved and max(moved) < 8
    np.testing.assert_allclose(v_parts, v, rtol=0.0, atol=1e-8 * np.abs(v).max())


def test_a_heap_of_many_is_in_balance_after_each_step():
    """Balls in a sheet that push each other apart, some much harder: A (v - v*) = J^T gamma, from the contacts."""
    side, r = 19, 0.05
    assert side * side >= newton.MANY_TREES
    builder = lib.DiagramBuilder()
    plant, _ = lib.AddMultibodyPlantSceneGraph(builder, 1e-3)
    rng = np.random.default_rng(4)
    balls = []
    for k in range(side * side):
        ball = plant.AddRigidBody(f"ball{k}", lib.SpatialInertia.SolidSphereWithMass(0.3, r))
        plant.RegisterCollisionGeometry(
            ball, lib.RigidTransform(), lib.Sphere(r), f"b{k}", lib.CoulombFriction(0.5, 0.5)
        )
        balls.append(ball)
    plant.Finalize()
    diagram = builder.Build()
    simulator = lib.Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    for k, ball in enumerate(balls):
        p = 1.96 * r * np.array([k % side, k // side, 0.0]) + rng.uniform(-2e-4, 2e-4, 3)
        plant.SetFreeBodyPose(context, ball, lib.RigidTransform(p))
        plant.SetFreeBodySpatialVelocity(context, ball, lib.SpatialVelocity(rng.normal(0.0, 0.1, 6)))
    for step in range(1, 11):
        simulator.AdvanceTo(1e-3 * step)
        work = context._store.scratch(context._node)
        problem, contacts = work.problem, work.contacts
        assert problem.trees_end - problem.trees_begin == side * side  # one island
        pushed = np.zeros(6 * side * side)
        for c in range(problem.num_contacts):
            contact = contacts[c]
            n = contact.width
            pushed[np.array(contact.dofs[:n])] += np.asarray(contact.J)[:, :n].T @ contact.gamma
        off = np.asarray(problem.p) - np.asarray(problem.p_star) - pushed
        size = max(
            np.linalg.norm(problem.p * np.sqrt(problem.mobility)), np.linalg.norm(pushed * np.sqrt(problem.mobility))
        )
        assert np.linalg.norm(off * np.sqrt(problem.mobility)) <= 1.01e-9 * size
        np.testing.assert_array_equal(
            [contacts[c].order for c in range(problem.num_contacts)], np.arange(problem.num_contacts)
        )
        np.testing.assert_array_equal(problem.tree[:, Participation.order], np.arange(side * side))
