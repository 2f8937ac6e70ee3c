"""The rows that held at the last solution of a small quadratic program, tried first for the next one."""

import numpy as np
import pytest

from sheldrake.solvers._kernels.active_set import INFEASIBLE, make_quadratic, solve_by_rows, solve_quadratic


def some_program(rng, rows=9, n=4):
    program = make_quadratic(rows, n)
    A = rng.normal(size=(n, n))
    program.Q[:], program.q[:] = A @ A.T + 0.1 * np.eye(n), rng.normal(size=n) * 3.0
    program.A[:], program.b[:] = rng.normal(size=(rows, n)), rng.uniform(0.1, 1.0, rows)
    return program


def solved(program):
    count = solve_quadratic(program, 0)
    return count, program.x.copy(), sorted(program.active[:count].tolist())


@pytest.mark.parametrize("change", [1e-3, 0.5])
def test_they_give_the_solution_or_say_that_they_do_not_hold(change):
    rng, kept, left = np.random.default_rng(5), 0, 0
    for _ in range(40):
        program = some_program(rng)
        count, _, before = solved(program)
        assert count >= 0
        program.b[:] += rng.normal(size=9) * change * 0.1
        program.q[:] += rng.normal(size=4) * change
        found = solve_by_rows(program, 0, count)
        x = program.x.copy()
        _, wanted, now = solved(program)
        assert (found == INFEASIBLE) == (before != now)
        if found == INFEASIBLE:
            left += 1
        else:
            kept += 1
            np.testing.assert_allclose(x, wanted, rtol=1e-9, atol=1e-11)
    assert kept > 3 and (left > 3 or change < 0.1)
