"""Sequential least squares programming, by SciPy: for programs of no more than some hundred variables."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.common._blas import one_thread
from sheldrake.solvers._engines.nonlinear import Outcome, Settings
from sheldrake.solvers._engines.nonlinear_form import NonlinearForm


def slsqp(form: NonlinearForm, start: np.ndarray, settings: Settings) -> Outcome:
    """Sequential least squares programming (Kraft, 1988)."""
    from scipy.optimize import Bounds, minimize

    equal = form.lower == form.upper
    above, below = ~equal & np.isfinite(form.lower), ~equal & np.isfinite(form.upper)

    def inequality(y: np.ndarray) -> np.ndarray:
        g = form.values(y)[1]
        return np.concatenate((g[above] - form.lower[above], form.upper[below] - g[below]))

    def inequality_slope(y: np.ndarray) -> np.ndarray:
        J = form.dense_constraints(y)[1]
        return np.vstack((J[above], -J[below]))

    constraints: list[dict[str, Any]] = []
    if equal.any():
        constraints.append(
            {
                "type": "eq",
                "fun": lambda y: form.values(y)[1][equal] - form.lower[equal],
                "jac": lambda y: form.dense_constraints(y)[1][equal],
            }
        )
    if above.any() or below.any():
        constraints.append({"type": "ineq", "fun": inequality, "jac": inequality_slope})
    with one_thread():  # also of SciPy, which may be here only now
        found = minimize(
            lambda y: form.values(y)[0],
            start,
            jac=lambda y: form.cost(y)[1],
            method="SLSQP",
            bounds=Bounds(form.x_lower, form.x_upper),
            constraints=constraints,
            callback=form.show if form.has_callbacks else None,
            options={"maxiter": settings.iterations, "ftol": settings.optimality, "disp": settings.prints},
        )
    # Status 8: no descent along the last direction, as happens at the limit of rounding.
    return Outcome("SLSQP", found.x, found.status in (0, 8), found.status == 9)


def restore(form: NonlinearForm, start: np.ndarray) -> np.ndarray:
    """A point near `start` with the least squares of violations, by a trust region (Branch, Coleman and Li, 1999)."""
    from scipy.optimize import least_squares

    free = form.x_lower < form.x_upper
    y = start.copy()

    def at(z: np.ndarray) -> np.ndarray:
        out = y.copy()
        out[free] = z
        return out

    # Its iterates are strictly inside of the bounds.
    low, high = form.x_lower[free], form.x_upper[free]
    inside = np.clip(start[free], np.nextafter(low, high), np.nextafter(high, low))
    found = least_squares(
        lambda z: form.excess(at(z))[0],
        inside,
        jac=lambda z: form.excess(at(z))[1][:, free],
        bounds=(low, high),
        max_nfev=200,
        xtol=1e-12,
        ftol=1e-14,
        gtol=1e-14,
    )
    return at(found.x)


_MOST = 100  # Iterations of one run: where they do not do, another point to start from is a better bet.


def by_slsqp(form: NonlinearForm, start: np.ndarray, settings: Settings) -> Outcome:
    """SLSQP; from a point that satisfies the constraints, if it does not find one."""
    few = settings.iterations <= _MOST
    settings = settings._replace(iterations=min(settings.iterations, _MOST))
    outcome = slsqp(form, start, settings)
    for origin in (outcome.y, start):
        if np.isfinite(outcome.y).all() and form.violation(form.clip(outcome.y)) <= settings.feasibility:
            break
        if not form.num_rows or (few and outcome.iterations_spent):
            return outcome
        y = restore(form, form.clip(np.where(np.isfinite(origin), origin, 0.0)))
        if form.violation(y) > settings.feasibility:
            outcome = Outcome("SLSQP", y, True, False)
            continue
        outcome = slsqp(form, y, settings)
        if form.violation(form.clip(outcome.y)) > settings.feasibility:
            outcome = Outcome("SLSQP", y, False, False)
    return outcome
