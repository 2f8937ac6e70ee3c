"""The solvers on random problems that Python writes: optimality, structure, statuses."""

from __future__ import annotations

import numpy as np
import pytest
from tests.unit.multibody.contact_solvers.packed import put_factor

from sheldrake.multibody.contact_solvers import _arrays
from sheldrake.multibody.contact_solvers._kernels import newton
from sheldrake.multibody.contact_solvers._kernels import problem as codes
from sheldrake.multibody.contact_solvers._kernels.problem import ContactLaw, ContactState, DofVectors, Participation
from sheldrake.multibody.contact_solvers._kernels.solve import APPROXIMATIONS
from sheldrake.multibody.contact_solvers._kernels.tamsi import step_limit


def put_material(contact, stiffness, dissipation, relaxation, friction, depth):
    contact.stiffness, contact.dissipation, contact.relaxation = stiffness, dissipation, relaxation
    contact.friction, contact.depth = friction, depth


class RandomProblem:
    """Chains of dofs as trees, contacts between random pairs of them; the last tree stays free."""

    def __init__(
        self, rng, name="lagged", sizes=(3, 4, 2, 5), contacts=6, dt=1e-3, factor=None, to_rest=False, **options
    ):
        nv = sum(sizes)
        first = np.concatenate([[0], np.cumsum(sizes)[:-1]])
        dof = np.zeros((nv, 3), np.int64)
        for f, n in zip(first, sizes):
            for k in range(n):
                dof[f + k] = (f + k - 1 if k else -1), k, 0
        dof[:, 2] = np.concatenate([[0], np.cumsum(dof[:, 1] + 1)[:-1]])
        self.model = _arrays.make_solver_model(
            np.column_stack([first, sizes]), dof, dt, name, to_rest=to_rest, **options
        )
        self.work = _arrays.make_solver_work(self.model, contacts, 4)
        if factor is not None:
            self.work = self.work._replace(factor=self.work.factor._replace(L=np.zeros(factor)))
        self.A = np.zeros((nv, nv))
        for f, n in zip(first, sizes):
            B = rng.normal(size=(n, n))
            self.A[f : f + n, f : f + n] = B @ B.T + n * np.eye(n)
            for k in range(n):
                for j in range(k + 1):
                    self.work.problem.A[dof[f + k, 2] + j] = self.A[f + k, f + j]
        problem = self.work.problem
        problem.L[:] = problem.A
        put_factor(self.model, problem)
        self.v0, self.v_star = rng.normal(0, 0.1, nv), rng.normal(0, 0.1, nv)
        problem.v0[:], problem.v_star[:] = self.v0, self.v_star
        problem.p_star[:] = self.A @ (self.v_star - self.v0)
        self.J = np.zeros((3 * contacts, nv))
        self.touched = set()
        for c in range(contacts):
            pair = sorted(rng.choice(len(sizes) - 1, 2, replace=False)) if len(sizes) > 2 and c else [0]
            self.touched.update(pair)
            dofs = np.concatenate([np.arange(first[t], first[t] + sizes[t]) for t in pair])
            contact = self.work.contacts[c]
            contact.width, contact.tree_a = len(dofs), pair[0]
            contact.tree_b = pair[1] if len(pair) > 1 else -1
            contact.dofs[: len(dofs)] = dofs
            block = rng.normal(size=(3, len(dofs)))
            contact.J[:, : len(dofs)] = block
            self.J[3 * c : 3 * c + 3, dofs] = block
            put_material(contact, 1e5, 10.0, 0.1, 0.5, rng.uniform(0, 1e-3))
        problem.num_contacts = contacts
        self.stages = APPROXIMATIONS[name].to_rest if to_rest else APPROXIMATIONS[name].as_drake

    def solve(self):
        self.prepare()
        return self.stages.solve.native(self.model, *self.work)

    def prepare(self):
        self.stages.prepare.native(self.model, *self.work[:3])

    @property
    def v(self):
        return self.work.problem.v

    def gamma(self):
        return self.work.contacts.state[: self.work.problem.num_contacts, ContactState.gamma.columns].ravel()


@pytest.mark.parametrize("to_rest", [False, True])
@pytest.mark.parametrize("name", ["lagged", "similar", "sap", "tamsi"])
def test_momentum_balance(name, to_rest):
    """A (v - v*) = J^T gamma, with the impulses the solver reports."""
    rng = np.random.default_rng(4)
    for _ in range(20):
        problem = RandomProblem(rng, name, to_rest=to_rest)
        assert problem.solve() == codes.SOLVED
        residual = problem.A @ (problem.v - problem.v_star) - problem.J.T @ problem.gamma()
        if name != "tamsi":  # it may take sub-steps, and reports the forces of the last
            assert np.abs(residual).max() < 1e-7
        elif problem.work.problem.substeps == 1:
            assert np.abs(residual).max() < 1e-3  # it stops on changes of velocity below 1e-6 m/s
        free = slice(9, 14)
        np.testing.assert_array_equal(problem.v[free], problem.v_star[free])
        assert problem.work.problem.tree[:, Participation.active].tolist() == [
            int(t in problem.touched) for t in range(4)
        ]


@pytest.mark.parametrize("name", ["lagged", "similar", "sap"])
def test_full_steps_and_line_searches_find_the_same_minimum(name):
    for seed in range(10):
        results = []
        for to_rest in (False, True):
            problem = RandomProblem(np.random.default_rng(seed), name, relative_tolerance=1e-12, to_rest=to_rest)
            if name == "sap":  # to rest, its problem is another one where something slides: nothing does
                problem.model.stiction = 1e6
            problem.prepare()
            assert problem.stages.solve.native(problem.model, *problem.work) == codes.SOLVED
            results.append(problem.v.copy())
        np.testing.assert_allclose(results[0], results[1], atol=1e-9)


@pytest.mark.parametrize("name", ["lagged", "similar", "sap"])
def test_steps_that_go_too_far_are_shortened_until_the_slope_is_small(name, monkeypatch):
    found, original = [], newton.shorten

    def shorten(model, problem, contacts, rows, slope, slope_there, size):
        back, status = original(model, problem, contacts, rows, slope, slope_there, size)
        of_constraints, _ = newton.constraint_slope(model, problem, contacts, rows, back)
        of_momentum, curvature = newton.momentum_along_direction(model, problem)
        found.append((of_constraints + of_momentum + back * curvature) / slope)
        assert status == 1 and -1.0 < back < 0.0 and slope < 0.0 < slope_there
        return back, status

    monkeypatch.setattr(newton, "shorten", shorten)
    for seed in range(60):
        problem = RandomProblem(np.random.default_rng(seed), name, sizes=(9, 5), to_rest=True)
        problem.prepare()
        assert (problem.stages.solve(problem.model, *problem.work) or 0) == codes.SOLVED
    assert len(found) > 2
    assert np.abs(found).max() <= 1e-2


def sliding_problem(seed, name, to_rest):
    """Free bodies that slide fast at first, and hardly at all in the end."""
    problem = RandomProblem(
        np.random.default_rng(seed), name, sizes=(6,) * 12, contacts=40, to_rest=to_rest, relative_tolerance=1e-9
    )
    smooth = problem.work.problem
    smooth.v_star[:] *= 1e-3
    smooth.p_star[:] = problem.A @ (smooth.v_star - problem.v0)
    problem.work.contacts.law[:40, ContactLaw.depth] = 1e-2
    assert problem.solve() == codes.SOLVED
    return problem


@pytest.mark.parametrize("name", ["lagged", "similar"])
def test_friction_duals_save_iterations_and_change_no_solution(name):
    """Less than two thirds of the iterations of Newton's method with a line search, for the same velocities."""
    iterations = {False: 0, True: 0}
    for seed in range(10):
        found = {to_rest: sliding_problem(seed, name, to_rest) for to_rest in iterations}
        for to_rest, problem in found.items():
            iterations[to_rest] += problem.work.problem.iterations
        np.testing.assert_allclose(found[True].v, found[False].v, atol=1e-6)
    assert iterations[True] < 0.67 * iterations[False]


def test_to_rest_sap_expects_the_slip_it_ends_with():
    """A mass that slides on the spring that carries it: Drake's lifts off at mu vt, ours stays."""
    for to_rest, rises in ((True, 0.0), (False, 0.5)):
        problem = RandomProblem(np.random.default_rng(1), "sap", sizes=(3, 1), contacts=1, to_rest=to_rest)
        work, dt, g, k = problem.work, 1e-3, 10.0, 1e5
        work.problem.A[:6] = [1.0, 0.0, 1.0, 0.0, 0.0, 1.0]
        work.problem.x[:] = 0.0
        work.problem.v0[0] = 1.0
        work.problem.v_star[:3] = [1.0, 0.0, -g * dt]
        work.problem.p_star[2] = -g * dt
        work.contacts[0].J[:, :3] = np.eye(3)
        put_material(work.contacts[0], k, 0.0, 0.2, 0.5, g / k)
        assert problem.solve() == codes.SOLVED
        assert problem.v[2] == pytest.approx(rises, abs=2e-4 if to_rest else 0.15)
        assert not to_rest or problem.v[0] == pytest.approx(1.0 - 0.5 * g * dt, abs=0.05 * g * dt)


@pytest.mark.parametrize("name", ["lagged", "similar", "sap", "tamsi"])
def test_islands_move_as_if_they_were_alone(name):
    """Two pairs of trees, which one solve holds: bit for bit what two solves give."""
    rng = np.random.default_rng(2)
    both = RandomProblem(rng, name, sizes=(6, 6, 6, 6), contacts=6, to_rest=True)
    contacts, x = both.work.contacts, both.work.problem.x
    for c in range(6):
        first = 2 * (c % 2)
        contact = contacts[c]
        contact.width, contact.tree_a, contact.tree_b = 12, first, first + 1
        contact.dofs[:] = np.arange(6 * first, 6 * first + 12)
        contact.J[:] = rng.normal(size=(3, 12))
    assert both.solve() == codes.SOLVED
    found = both.v.copy()
    for k in range(2):
        alone = RandomProblem(np.random.default_rng(2), name, sizes=(6, 6, 6, 6), contacts=6, to_rest=True)
        alone.work.problem.num_contacts = 3
        for own, other in zip(alone.work.contacts[:1] + alone.work.contacts[2:3], contacts[:1] + contacts[2:3]):
            own[:3] = other[k::2]
        alone.work.contacts.J[:] = 0.0
        alone.work.contacts.J[:9] = contacts.J.reshape(6, 3, 12)[k::2].reshape(9, 12)
        start = [DofVectors.v0.at, DofVectors.v_star.at]
        alone.work.problem.x[start] = x[start]
        assert alone.solve() == codes.SOLVED
        np.testing.assert_array_equal(alone.v[12 * k : 12 * k + 12], found[12 * k : 12 * k + 12])


@pytest.mark.parametrize("seed", range(5))
def test_to_rest_sap_has_coulombs_law(seed):
    """What slides at vt and is pushed by n neither glides away nor hangs back: v_n = vhat - R_n n, on the cone."""
    problem = RandomProblem(np.random.default_rng(seed), "sap", sizes=(6, 6, 6, 6), contacts=5, to_rest=True)
    law, state = problem.work.contacts.law[:5], problem.work.contacts.state[:5]
    law[:, ContactLaw.friction] = 0.3
    assert problem.solve() == codes.SOLVED
    gamma, vc = state[:, ContactState.gamma.columns], state[:, ContactState.vc.columns]
    v0 = (problem.J @ problem.v0).reshape(5, 3)
    slip = np.hypot(*vc[:, :2].T)
    ahead = (vc[:, :2] * v0[:, :2]).sum(axis=1) / (slip * np.hypot(*v0[:, :2].T))
    vhat = law[:, ContactLaw.depth] / (1e-3 + law[:, ContactLaw.relaxation])
    for c in np.flatnonzero((gamma[:, 2] > 0.0) & (slip > 1e-2) & (ahead > 0.0)):
        assert np.hypot(*gamma[c, :2]) == pytest.approx(0.3 * gamma[c, 2], rel=1e-9)
        lift = 0.3 * slip[c] * (1.0 - ahead[c])  # only slip along that of the start is foreseen
        softer = law[c, ContactLaw.R_n] + 0.3**2 * law[c, ContactLaw.R_t]
        assert vc[c, 2] == pytest.approx(vhat[c] - softer * gamma[c, 2] + lift, abs=1e-4)


def test_more_iterations_than_allowed_are_a_status():
    problem = RandomProblem(np.random.default_rng(1))
    problem.model.max_iterations = 1
    assert problem.solve() == codes.ITERATION_LIMIT


def test_a_small_factor_is_a_status():
    assert RandomProblem(np.random.default_rng(1), factor=5).solve() == codes.FACTOR_CAPACITY
    assert RandomProblem(np.random.default_rng(1), "tamsi", factor=5).solve() == codes.FACTOR_CAPACITY


def test_nan_is_a_status_and_not_an_answer():
    for to_rest in (False, True):
        problem = RandomProblem(np.random.default_rng(1), to_rest=to_rest)
        problem.work.problem.v0[0] = np.nan
        problem.work.problem.p_star[0] = np.nan
        assert problem.solve() != codes.SOLVED


def test_an_unknown_approximation_is_an_error():
    with pytest.raises(ValueError, match="'hertz' is not one of tamsi, sap, similar, lagged"):
        RandomProblem(np.random.default_rng(1), "hertz")


def test_rest_is_exact_where_rest_is_a_solution():
    """A mass on the spring that carries it: a creep below tolerance becomes none."""
    for to_rest, expected in ((True, 0.0), (False, 1e-13)):
        problem = RandomProblem(np.random.default_rng(1), sizes=(3, 1), contacts=1, to_rest=to_rest)
        work, dt, g = problem.work, 1e-3, 10.0
        work.problem.A[:6] = [1.0, 0.0, 1.0, 0.0, 0.0, 1.0]
        work.problem.x[:] = 0.0
        work.problem.v0[2] = 1e-13
        work.problem.v_star[2] = 1e-13 - g * dt
        work.problem.p_star[2] = -g * dt
        work.contacts[0].J[:, :3] = np.eye(3)
        put_material(work.contacts[0], 1e5, 10.0, 0.1, 0.5, g / 1e5)
        assert problem.solve() == codes.SOLVED
        assert problem.v[2] == expected


def test_slip_does_not_jump_over_stiction():
    vs = 1e-4
    assert step_limit((1.0, 0.0), (-2.0, 0.0), vs) == pytest.approx(0.5 - vs / 4)  # lands just beside zero
    assert step_limit((1.0, 0.0), (0.1, 0.0), vs) == 1.0
    assert step_limit((0.5e-6, 0.0), (1.0, 0.0), vs) == pytest.approx(vs / 2)
    alpha = step_limit((1.0, 0.0), (0.0, 5.0), vs)  # would turn by 79 degrees: stopped at 60
    assert np.arctan2(5.0 * alpha, 1.0) == pytest.approx(np.pi / 3)
