"""A trust-region method with an exact penalty for nonlinear programs, on quadratic programs that Clarabel solves."""

from __future__ import annotations

import importlib.util
from typing import Any, NamedTuple

import numpy as np

from sheldrake.solvers._engines.curvature import Curvature
from sheldrake.solvers._engines.nonlinear_form import NonlinearForm

_LARGEST_PENALTY = 1e9
_SMALLEST_RADIUS = 1e-13


class Step(NamedTuple):
    """The answer of a quadratic program: the step, what is left of violations, and multipliers of rows."""

    d: np.ndarray
    left: float
    dual: np.ndarray


class QuadraticModel:
    """min g'd + 1/2 d'B d + penalty * violation of lower <= c + J d <= upper, |d| <= radius * reach, in bounds."""

    def __init__(self, form: NonlinearForm):
        import clarabel
        from scipy import sparse

        self._clarabel, self._sparse, self._csc = clarabel, sparse, sparse.csc_matrix
        self._form = form
        self._low, self._high = np.isfinite(form.lower), np.isfinite(form.upper)
        self._equal = form.lower == form.upper
        # A variable that may go far, a motor's effort say, must not be held to steps that suit an angle.
        reach = 0.5 * (form.x_upper - form.x_lower)
        self.reach = np.where(np.isfinite(reach), np.clip(reach, 1.0, 1e3), 1.0)

    def solve(
        self, y: np.ndarray, g: np.ndarray, B: np.ndarray, c: np.ndarray, J: np.ndarray, penalty: float, radius: float
    ) -> Step | None:
        """The step from y; None if the quadratic program was not solved."""
        form, n = self._form, len(y)
        equal, low, high = self._equal, self._low & ~self._equal, self._high & ~self._equal
        # Slacks: two of each equation, one of each inequality.
        blocks = [J[equal], J[high], -J[low]]
        limits = [form.upper[equal] - c[equal], form.upper[high] - c[high], c[low] - form.lower[low]]
        m_equal, m_rest = len(blocks[0]), len(blocks[1]) + len(blocks[2])
        slacks = 2 * m_equal + m_rest
        farthest = radius * self.reach
        box_low, box_high = np.maximum(form.x_lower - y, -farthest), np.minimum(form.x_upper - y, farthest)
        A = self._rows(blocks[0], np.vstack(blocks[1:]), n)
        b = np.concatenate((*limits, np.zeros(slacks), box_high, -box_low))
        P = self._csc(np.triu(B))
        P.resize(n + slacks, n + slacks)
        q = np.concatenate((g, np.full(slacks, penalty)))
        found = self._call(P, q, A, b, m_equal)
        if found is None:
            return None
        x, z = found
        d = np.clip(x[:n], box_low, box_high)
        dual = np.zeros(form.num_rows)
        dual[equal] = z[:m_equal]
        dual[high] += z[m_equal : m_equal + len(blocks[1])]
        dual[low] -= z[m_equal + len(blocks[1]) : m_equal + m_rest]
        return Step(d, violation(form, c + J @ d), dual)

    def _rows(self, equations: np.ndarray, rest: np.ndarray, n: int) -> Any:
        """Rows of equations and inequalities with their slacks, of slacks >= 0, and of the box, for (d, slacks)."""
        eye, m, k = self._sparse.identity, len(equations), len(rest)
        csc = self._csc
        if (n + m + k) ** 2 < 250000:  # Small ones are put together faster with zeros.
            slacks = 2 * m + k
            A = np.zeros((m + k + slacks + 2 * n, n + slacks))
            A[:m, :n], A[m : m + k, :n] = equations, rest
            A[:m, n : n + m], A[:m, n + m : n + 2 * m] = np.eye(m), -np.eye(m)
            A[m : m + k, n + 2 * m :] = -np.eye(k)
            A[m + k : m + k + slacks, n:] = -np.eye(slacks)
            A[m + k + slacks :, :n] = np.vstack((np.eye(n), -np.eye(n)))
            return csc(A)
        return self._sparse.bmat(
            [
                [csc(equations), eye(m), -eye(m), csc((m, k))],
                [csc(rest), csc((k, m)), csc((k, m)), -eye(k)],
                [csc((m, n)), -eye(m), None, csc((m, k))],
                [csc((m, n)), None, -eye(m), csc((m, k))],
                [csc((k, n)), csc((k, m)), csc((k, m)), -eye(k)],
                [eye(n), csc((n, m)), csc((n, m)), csc((n, k))],
                [-eye(n), csc((n, m)), csc((n, m)), csc((n, k))],
            ],
            format="csc",
        )

    def _call(self, P: Any, q: Any, A: Any, b: Any, equations: int) -> tuple[np.ndarray, np.ndarray] | None:
        clarabel = self._clarabel
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        cones = [clarabel.ZeroConeT(equations)] if equations else []
        if len(b) > equations:
            cones.append(clarabel.NonnegativeConeT(len(b) - equations))
        size = max(1.0, np.abs(q).max(initial=0.0))
        solver = clarabel.DefaultSolver(P / size, q / size, A, b, cones, settings)
        found = solver.solve()
        if str(found.status) not in ("Solved", "AlmostSolved", "MaxIterations", "InsufficientProgress"):
            return None
        return np.array(found.x), np.array(found.z) * size


def violation(form: NonlinearForm, c: np.ndarray) -> float:
    """The sum of what values of rows are beyond their bounds."""
    return float(np.maximum(form.lower - c, 0.0).sum() + np.maximum(c - form.upper, 0.0).sum())


def is_available() -> bool:
    """Whether there is something to solve the quadratic programs with."""
    return importlib.util.find_spec("clarabel") is not None


def trust_region_sqp(
    form: NonlinearForm, start: np.ndarray, feasibility: float, iterations: int
) -> tuple[np.ndarray, bool, bool]:
    """Sequential quadratic programming with an l1 penalty (Fletcher, Practical Methods of Optimization, 1987, 14.4).

    Steps are inside a box, wider for variables with wider bounds; one that does not reduce the penalty function is
    corrected to second order, and then made shorter. The penalty grows until violations vanish or cannot.

    Returns:
        The last point, whether it is a minimum (of the violation, if that is not zero), and whether iterations ran out.
    """
    model = QuadraticModel(form)
    y, radius, penalty = start.copy(), 1.0, 10.0
    f, g = form.cost(y)
    c, J = form.constraints(y)
    curvature = Curvature(form)
    B = curvature.matrix(np.zeros(form.num_rows), np.zeros((0, len(y))))
    short, lowered = 0, 0
    for _ in range(iterations):
        step = model.solve(y, g, B, c, J, penalty, radius)
        if step is None:
            radius *= 0.25
            if radius < _SMALLEST_RADIUS:
                return y, False, False
            continue
        v = violation(form, c)
        largest = np.abs(step.dual).max(initial=0.0)
        if step.left <= 0.1 * feasibility and 20.0 * largest < penalty and penalty > 10.0 and lowered < 5:
            penalty, lowered = max(10.0, 4.0 * largest), lowered + 1  # Too much penalty makes for small steps.
            continue
        if step.left > 0.1 * feasibility and penalty < _LARGEST_PENALTY:
            # Is it the cost that keeps violations up? Compare with a step that heeds nothing but them.
            best = model.solve(y, 0.0 * g, 1e-6 * np.eye(len(y)), c, J, 1.0, radius)
            if best is not None and v - step.left < 0.5 * (v - best.left) - 0.1 * feasibility:
                penalty *= 10.0
                continue
        predicted = -(g @ step.d + 0.5 * step.d @ B @ step.d) + penalty * (v - step.left)
        if predicted <= 1e-10 * max(1.0, abs(f)) or np.abs(step.d).max(initial=0.0) < 1e-10:
            return y, True, False
        trial, accepted, ratio = _try(form, model, step, y, f, v, g, B, c, J, penalty, radius, predicted)
        length = np.abs(step.d / model.reach).max()
        if accepted:
            f_new, g_new = form.cost(trial)
            c_new, J_new = form.constraints(trial)
            curvature.learn(trial - y)
            active = _held(form, trial, step.dual, J_new, penalty)
            B = curvature.matrix(step.dual, active)
            small = penalty * (v - violation(form, c_new)) + f - f_new < 1e-11 * max(1.0, abs(f))
            short = short + 1 if small else 0
            y, f, g, c, J = trial, f_new, g_new, c_new, J_new
            form.show(y)
            if short >= 5 and violation(form, c) <= feasibility:
                return y, True, False
        if ratio > 0.75 and length > 0.9 * radius:
            radius = min(2.0 * radius, 1e6)
        elif ratio < 0.25:
            radius = 0.5 * radius if accepted else 0.25 * max(length, 0.1 * radius)
        if radius < _SMALLEST_RADIUS:
            return y, violation(form, c) <= feasibility, False
    return y, False, True


def _held(form: NonlinearForm, y: np.ndarray, dual: np.ndarray, J: np.ndarray, penalty: float) -> np.ndarray:
    """Gradients of active rows and bounds, of length one, as rows."""
    size = np.abs(dual)
    rows = np.flatnonzero((size > 1e-7 * max(1.0, size.max(initial=0.0))) & (size < 0.99 * penalty))
    fixed = np.flatnonzero((y <= form.x_lower) | (y >= form.x_upper))
    gradients = J[rows]
    lengths = np.sqrt(np.einsum("ij,ij->i", gradients, gradients))
    return np.vstack((gradients / np.maximum(lengths, 1e-300)[:, None], np.eye(len(y))[fixed]))


def _try(
    form: Any,
    model: QuadraticModel,
    step: Step,
    y: np.ndarray,
    f: float,
    v: float,
    g: np.ndarray,
    B: np.ndarray,
    c: np.ndarray,
    J: np.ndarray,
    penalty: float,
    radius: float,
    predicted: float,
) -> tuple[np.ndarray, bool, float]:
    """The step, or the step corrected for the curvature of the constraints; whether it is good, and how good."""
    trial = form.clip(y + step.d)
    ratio = _ratio(form, trial, f, v, penalty, predicted)
    if ratio > 1e-4:
        return trial, True, ratio
    if form.num_rows:
        corrected = model.solve(y, g, B, form.values(trial)[1] - J @ step.d, J, penalty, radius)
        if corrected is not None:
            second = form.clip(y + corrected.d)
            better = _ratio(form, second, f, v, penalty, predicted)
            if better > 1e-4:
                return second, True, better
    return trial, False, ratio


def _ratio(form: Any, trial: np.ndarray, f: float, v: float, penalty: float, predicted: float) -> float:
    cost, c = form.values(trial)
    reduction = f - cost + penalty * (v - violation(form, c))
    return reduction / predicted if np.isfinite(reduction) else -1.0
