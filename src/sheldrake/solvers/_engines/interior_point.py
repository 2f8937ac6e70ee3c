"""A primal-dual interior point method with a filter for nonlinear programs.

After A. Waechter and L. T. Biegler, "On the implementation of an interior-point filter line-search algorithm for
large-scale nonlinear programming" (Mathematical Programming 106, 2006); equation numbers and symbols are theirs.
"""

from __future__ import annotations

import enum
import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from sheldrake.common.record import view_of
from sheldrake.solvers._engines.minimum_degree import minimum_degree
from sheldrake.solvers._engines.nonlinear_form import NonlinearForm
from sheldrake.solvers._kernels import barrier, ldl
from sheldrake.solvers._kernels.barrier import Iterate, Progress, System

_MOST_GRADIENT = 100.0  # Costs and rows with larger gradients at the start are scaled down to it.
_GIVE = 1e-10  # By which bounds are moved out, relative to those above one.
_SHIFT = 1e-8  # What factors have more on their diagonal, which is about one.
_PENALTY = 1e3  # Of what is left of constraints while they are restored.


_Now: Any = view_of(Progress)


class Ending(enum.Enum):
    """Why iterations ended."""

    CONVERGED = enum.auto()
    INFEASIBLE = enum.auto()
    STUCK = enum.auto()
    ITERATIONS = enum.auto()
    STOPPED = enum.auto()  # by who called


class Found(NamedTuple):
    """The last point, its multipliers of the rows, and why it is the last; how many iterations there were."""

    z: np.ndarray
    multipliers: np.ndarray
    ending: Ending
    iterations: int


class Slacked:
    """min f(z), c(z) = 0, lower <= z <= upper, of a form: its free variables and a slack for each inequality, scaled.

    Args:
        form: The program.
        start: Where gradients are taken for scaling.
    """

    def __init__(self, form: NonlinearForm, start: np.ndarray):
        self._form = form
        free = form.x_lower < form.x_upper
        self._free, self._fixed = np.flatnonzero(free), np.where(free, 0.0, form.x_lower)
        nf = len(self._free)
        equal = form.lower == form.upper
        self._slack_rows = np.flatnonzero(~equal)
        ns, self.m = len(self._slack_rows), form.num_rows
        self.n = nf + ns
        place = np.full(form.num_vars, -1)
        place[self._free] = np.arange(nf)
        row, col = form.functions.row, form.functions.col
        self._J_kept = np.flatnonzero((row > 0) & (place[col] >= 0))
        self.J_rows = np.concatenate((row[self._J_kept] - 1, self._slack_rows))
        self.J_cols = np.concatenate((place[col[self._J_kept]], nf + np.arange(ns)))
        self._H_kept = np.flatnonzero((place[form.H_rows] >= 0) & (place[form.H_cols] >= 0))
        self.H_rows, self.H_cols = place[form.H_rows[self._H_kept]], place[form.H_cols[self._H_kept]]
        _, entries, J = form.functions.slopes(start)
        gradient = J[0]
        self.cost_scale = _scale_of(np.abs(gradient[self._free]).max(initial=0.0))
        largest = np.zeros(self.m)
        np.maximum.at(largest, self.J_rows[: len(self._J_kept)], np.abs(entries[self._J_kept]))
        self.row_scale = _scale_of(largest)
        lower, upper = form.lower * self.row_scale, form.upper * self.row_scale
        self._target = np.where(equal, lower, 0.0)
        self.lower = np.concatenate((form.x_lower[self._free], lower[self._slack_rows]))
        self.upper = np.concatenate((form.x_upper[self._free], upper[self._slack_rows]))
        self._J_scale = self.row_scale[self.J_rows[: len(self._J_kept)]]
        self._minus_ones = np.full(ns, -1.0)
        self._known: tuple[bytes, tuple[float, np.ndarray, np.ndarray, np.ndarray]] | None = None

    def first(self, y: np.ndarray) -> np.ndarray:
        """z of a point of the form, slacks being what rows are."""
        rows = self._form.values(y)[1] * self.row_scale
        return np.concatenate((y[self._free], rows[self._slack_rows]))

    def point(self, z: np.ndarray) -> np.ndarray:
        """The point of the form."""
        y = self._fixed.copy()
        y[self._free] = z[: len(self._free)]
        return y

    def _residual(self, rows: np.ndarray, z: np.ndarray) -> np.ndarray:
        c = rows * self.row_scale - self._target
        c[self._slack_rows] -= z[len(self._free) :]
        return c

    def values(self, z: np.ndarray) -> tuple[float, np.ndarray]:
        """f and c."""
        cost, rows = self._form.values(self.point(z))
        return cost * self.cost_scale, self._residual(rows, z)

    def slopes(self, z: np.ndarray) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
        """f, its gradient, c, and the entries of its Jacobian; nobody changes these arrays."""
        key = z.tobytes()
        if self._known is None or self._known[0] != key:
            self._known = key, self._slopes_at(z)
        return self._known[1]

    def _slopes_at(self, z: np.ndarray) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
        y = self.point(z)
        rows, entries, gradient = self._form.functions.slopes(y)
        g = np.zeros(self.n)
        g[: len(self._free)] = gradient[0, self._free] * self.cost_scale
        J = np.concatenate((entries[self._J_kept] * self._J_scale, self._minus_ones))
        return rows.item(0) * self.cost_scale, g, self._residual(rows[1:], z), J

    def hessian(self, z: np.ndarray, multipliers: np.ndarray) -> np.ndarray:
        """Entries of the Hessian of f + multipliers' c."""
        found = self._form.hessian(self.point(z), self.cost_scale, multipliers * self.row_scale)
        return found[self._H_kept]

    def violation(self, c: np.ndarray) -> float:
        """The largest residual, not scaled."""
        return float(np.abs(c / self.row_scale).max(initial=0.0))

    def show(self, z: np.ndarray) -> None:
        """Calls the visualization callbacks."""
        self._form.show(self.point(z))


def _scale_of(largest: Any) -> Any:
    return np.clip(_MOST_GRADIENT / np.maximum(largest, _MOST_GRADIENT), 1e-8, 1.0)


class Restoration:
    """The least violation near a point: min PENALTY sum(p + n) + zeta/2 |D (z - z_R)|^2, c(z) = p - n, p, n >= 0.

    Eq. (30). Variables are (z, p, n).
    """

    def __init__(self, program: Any, z: np.ndarray, mu: float):
        self._program, self._z = program, z
        self.m = program.m
        self.n = program.n + 2 * self.m
        self._weights = np.sqrt(mu) * np.minimum(1.0, 1.0 / np.maximum(np.abs(z), 1e-300)) ** 2
        k, rows = program.n, np.arange(self.m)
        self.lower = np.concatenate((program.lower, np.zeros(2 * self.m)))
        self.upper = np.concatenate((program.upper, np.full(2 * self.m, np.inf)))
        self.J_rows = np.concatenate((program.J_rows, rows, rows))
        self.J_cols = np.concatenate((program.J_cols, k + rows, k + self.m + rows))
        self.H_rows = np.concatenate((program.H_rows, np.arange(k)))
        self.H_cols = np.concatenate((program.H_cols, np.arange(k)))

    def first(self, mu: float) -> np.ndarray:
        """The reference point with the p and n that are best for it, eq. (33)."""
        c = self._program.values(self._z)[1]
        half = (mu - _PENALTY * c) / (2.0 * _PENALTY)
        n = half + np.sqrt(half * half + mu * c / (2.0 * _PENALTY))
        return np.concatenate((self._z, c + n, n))

    def _split(self, z: np.ndarray) -> list[np.ndarray]:
        return np.split(z, [self._program.n, self._program.n + self.m])

    def _cost(self, own: np.ndarray, p: np.ndarray, n: np.ndarray) -> float:
        return float(_PENALTY * (p.sum() + n.sum()) + 0.5 * self._weights @ (own - self._z) ** 2)

    def values(self, z: np.ndarray) -> tuple[float, np.ndarray]:
        own, p, n = self._split(z)
        return self._cost(own, p, n), self._program.values(own)[1] - p + n

    def slopes(self, z: np.ndarray) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
        own, p, n = self._split(z)
        _, _, c, J = self._program.slopes(own)
        gradient = np.concatenate((self._weights * (own - self._z), np.full(2 * self.m, _PENALTY)))
        ones = np.ones(self.m)
        return self._cost(own, p, n), gradient, c - p + n, np.concatenate((J, -ones, ones))

    def hessian(self, z: np.ndarray, multipliers: np.ndarray) -> np.ndarray:
        own = z[: self._program.n]
        with_cost = self._program.hessian(own, multipliers)
        return np.concatenate((with_cost - self._program.hessian(own, 0.0 * multipliers), self._weights))

    def violation(self, c: np.ndarray) -> float:
        return float(np.abs(c).max(initial=0.0))

    def show(self, z: np.ndarray) -> None:
        self._program.show(z[: self._program.n])


class Layout(NamedTuple):
    """What in a `System` follows from where the entries of its matrix are."""

    W_slots: np.ndarray
    diagonal_slots: np.ndarray
    J_slots: np.ndarray
    gamma_slots: np.ndarray
    starts: np.ndarray
    rows: np.ndarray
    cols: np.ndarray
    shift: np.ndarray
    parent: np.ndarray
    L_starts: np.ndarray
    order: np.ndarray


def _lay_out(n: int, m: int, *places: bytes) -> Layout:
    """The layout for so many variables and rows, and rows and columns of the entries of the Hessian and Jacobian."""
    H_rows, H_cols, J_rows, J_cols = (np.frombuffer(p, dtype=np.int64) for p in places)
    size = n + m
    diagonal, below = np.arange(n), n + np.arange(m)
    rows = np.concatenate((H_rows, diagonal, J_cols, below))
    cols = np.concatenate((H_cols, diagonal, n + J_rows, below))
    half = rows <= cols  # the Hessian is given with both its halves
    order = minimum_degree(size, rows[half], cols[half]) if size > _SMALL else np.arange(size)
    place = np.empty(size, dtype=np.int64)
    place[order] = np.arange(size)
    i, j = place[rows[half]], place[cols[half]]
    keys, found = np.unique(np.maximum(i, j) * size + np.minimum(i, j), return_inverse=True)
    slots = np.full(len(rows), -1, dtype=np.int64)
    slots[half] = found
    starts = np.searchsorted(keys // size, np.arange(size + 1)).astype(np.int64)
    indices = (keys % size).astype(np.int64)
    parent, flag, counts = (np.zeros(size, dtype=np.int64) for _ in range(3))
    ldl.analyze_ldl.native(starts, indices, parent, flag, counts)
    L_starts = np.concatenate(([0], np.cumsum(counts))).astype(np.int64)
    at = np.cumsum([len(H_rows), n, len(J_rows)])
    W_slots, diagonal_slots, J_slots, gamma_slots = (np.ascontiguousarray(part) for part in np.split(slots, at))
    return Layout(
        W_slots=W_slots, diagonal_slots=diagonal_slots, J_slots=J_slots, gamma_slots=gamma_slots, starts=starts,
        rows=indices, cols=keys // size, shift=np.where(order < n, _SHIFT, -_SHIFT), parent=parent, L_starts=L_starts,
        order=order.astype(np.int64),
    )  # fmt: skip


_known_layout = functools.lru_cache(maxsize=16)(_lay_out)
_MOST_KNOWN = 20_000  # entries of a matrix whose layout is kept for the next program of the same structure


class Factors:
    """What kernels need to solve [[W + diagonal, J'], [J, -gamma]] x = b by sparse factors, laid out once.

    The factors are those of a matrix with a little more on its diagonal, which makes it quasidefinite wherever the
    inertia is right (R. J. Vanderbei, 1995), so that any order of elimination will do; solutions are improved until
    that little does not matter.
    """

    def __init__(self, program: Any):
        places = [a.astype(np.int64) for a in (program.H_rows, program.H_cols, program.J_rows, program.J_cols)]
        lay_out = _known_layout if len(places[0]) + len(places[2]) <= _MOST_KNOWN else _lay_out
        layout = lay_out(program.n, program.m, *(a.tobytes() for a in places))
        size, fill = program.n + program.m, int(layout.L_starts[-1])
        filled, flag, pattern = np.zeros((3, size), dtype=np.int64)
        D, y, scale, largest, b, x = np.zeros((6, size))
        self.system = System(
            **layout._asdict(), entries=np.zeros(len(layout.rows)), L_rows=np.zeros(fill, dtype=np.int64),
            L=np.zeros(fill), D=D, filled=filled, flag=flag, pattern=pattern, y=y, scale=scale, largest=largest, b=b,
            x=x, info=np.zeros(1),
        )  # fmt: skip


_ROUNDING = 10.0 * float(np.finfo(float).eps)  # of a cost, relative to it or 1
_SMALL = 40  # Up to this size full factors take less time than looking for an order does.


class InteriorPoint:
    """The iterations.

    Args:
        program: A Slacked form, or a Restoration.
        z: Where to begin.
        mu: The first barrier parameter.
        tolerance: Of the error of the conditions of optimality, eq. (5).
        feasibility: The largest violation of a constraint.
        stop: Asked after each iteration whether to end.
    """

    def __init__(
        self,
        program: Any,
        z: np.ndarray,
        mu: float = 0.1,
        tolerance: float = 1e-8,
        feasibility: float = 1e-6,
        stop: Callable[[np.ndarray], bool] | None = None,
    ):
        self._program, self._tolerance, self._feasibility, self._stop = program, tolerance, feasibility, stop
        self._factors = Factors(program)
        self._has_lower, self._has_upper = np.isfinite(program.lower), np.isfinite(program.upper)
        # Bounds give way a little, so that there is an inside even where equations leave none, section 3.5.
        lower = program.lower - _GIVE * np.maximum(1.0, np.abs(np.where(self._has_lower, program.lower, 0.0)))
        upper = program.upper + _GIVE * np.maximum(1.0, np.abs(np.where(self._has_upper, program.upper, 0.0)))
        n, m, size = program.n, program.m, program.n + program.m
        self._at = it = Iterate(
            *(np.array(z), np.zeros(n), lower, upper),
            *(np.where(self._has_lower, 1.0, 0.0), np.where(self._has_upper, 1.0, 0.0), np.zeros(m)),
            *(np.zeros(n), np.zeros(m), np.zeros(m), np.zeros(m)),
            *(np.zeros(len(program.J_rows)), program.J_rows.astype(np.int64), program.J_cols.astype(np.int64)),
            *(np.zeros(len(program.H_rows)), np.zeros(n), np.zeros(n)),
            *(np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(n), np.zeros(n)),
        )
        self._numbers = np.zeros(Progress.SIZE)
        self._now = _Now(self._numbers)
        self._now.mu, self._now.tolerance = mu, tolerance
        self._bound = barrier.interior_point_step.bind(
            self._factors.system, it, self._numbers, barrier.OPTIMALITY_ERROR
        )
        it.z[:] = self._inside(it.z)
        self._evaluate()
        self._do(barrier.LEAST_MULTIPLIERS)
        self._filter: list[tuple[float, float]] = []
        theta = float(np.abs(it.c).sum())
        self._theta_max, self._theta_min = 1e4 * max(1.0, theta), 1e-4 * max(1.0, theta)

    def _do(self, what: int) -> int:
        """Runs one of the kernels of `barrier`."""
        self._bound.set("what", what)
        return int(self._bound())

    # The point

    def _inside(self, z: np.ndarray) -> np.ndarray:
        """The point, moved off the bounds, eq. (35)."""
        low, high = self._at.lower, self._at.upper
        with np.errstate(invalid="ignore"):
            width = np.where(np.isfinite(high - low), 1e-2 * (high - low), np.inf)
            push_low = np.minimum(1e-2 * np.maximum(1.0, np.abs(low)), width)
            push_high = np.minimum(1e-2 * np.maximum(1.0, np.abs(high)), width)
            z = np.where(self._has_lower, np.maximum(z, low + push_low), z)
            return np.where(self._has_upper, np.minimum(z, high - push_high), z)

    def _evaluate(self) -> None:
        it = self._at
        self._now.f, it.g[:], it.c[:], it.J[:] = self._program.slopes(it.z)

    def _gaps(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How far it is to the bounds; 1 where there are none."""
        lower, upper = self._at.lower, self._at.upper
        return np.where(self._has_lower, z - lower, 1.0), np.where(self._has_upper, upper - z, 1.0)

    def _barrier(self, f: float, z: np.ndarray) -> float:
        low, high = self._gaps(z)
        return f - self._now.mu * float(np.log(low).sum() + np.log(high).sum())

    # Iterations

    def run(self, iterations: int) -> Found:
        """Iterates."""
        it, now = self._at, self._now
        if not np.isfinite(now.f) or not np.isfinite(it.c).all():
            return self._found(Ending.STUCK, 0)
        near = 0
        for k in range(iterations):
            lowered = self._do(barrier.OPTIMALITY_ERROR)
            error, is_feasible = now.error, self._program.violation(it.c) <= self._feasibility
            near = near + 1 if is_feasible and error <= 100.0 * self._tolerance else 0
            if (is_feasible and error <= self._tolerance) or near >= 12:
                return self._found(Ending.CONVERGED, k)
            if lowered:
                self._filter = []
            it.W[:] = self._program.hessian(it.z, it.lam)
            if self._do(barrier.NEWTON_STEP):
                return self._found(Ending.STUCK, k)
            ending = self._advance()
            if ending is not None:
                self._do(barrier.OPTIMALITY_ERROR)
                return self._found(Ending.CONVERGED if now.error <= 1e3 * self._tolerance else ending, k + 1)
            self._program.show(it.z)
            if self._stop is not None and self._stop(it.z):
                return self._found(Ending.STOPPED, k + 1)
        return self._found(Ending.ITERATIONS, iterations)

    def _found(self, ending: Ending, iterations: int) -> Found:
        return Found(self._at.z.copy(), self._at.lam.copy(), ending, iterations)

    def _advance(self) -> Ending | None:
        """The line search, section 2.3 and algorithm A."""
        now = self._now
        if now.relative < 1e-15:
            now.alpha = now.longest
            self._do(barrier.SET_TRIAL_POINT)
        elif not self._search():
            return self._restore(now.theta, now.phi)
        self._do(barrier.ACCEPT_TRIAL_POINT)
        self._evaluate()
        return None

    def _search(self) -> bool:
        """Finds a trial point that the filter takes; False if the step would be too short."""
        now, theta, m = self._now, self._now.theta, self._now.descent
        smallest = 1e-5
        if m < 0.0:
            smallest = min(smallest, 1e-5 * theta / -m) if theta else 0.0
            if theta <= self._theta_min:
                smallest = min(smallest, theta**1.1 / (-m) ** 2.3)
        smallest = max(0.05 * smallest, 1e-14)
        alpha = now.longest
        first = True
        while alpha > smallest:
            now.alpha = alpha
            self._do(barrier.SET_TRIAL_POINT)
            if self._takes(alpha, first):
                return True
            if first and theta <= now.theta_trial < np.inf and self._corrected(alpha):
                return True
            first = False
            alpha *= 0.5
        return False

    def _corrected(self, alpha: float) -> bool:
        """Second-order corrections, eq. (27); whether one leads to a trial point that the filter takes."""
        it, now = self._at, self._now
        theta_old = now.theta_trial
        it.c_corrected[:] = alpha * it.c + it.c_trial
        for _ in range(4):
            if self._do(barrier.SECOND_ORDER_CORRECTION):
                return False
            longest = now.alpha
            if self._takes(alpha):
                return True
            if not now.theta_trial <= 0.99 * theta_old:
                return False
            theta_old = now.theta_trial
            it.c_corrected[:] = longest * it.c_corrected + it.c_trial
        return False

    def _takes(self, alpha: float, is_likely: bool = False) -> bool:
        """Whether the trial point is good enough, eq. (18) to (20); the filter grows where it takes one for its
        violation.

        Where that is likely, derivatives are computed at once: most of their work is that of the values.
        """
        it, now = self._at, self._now
        theta, phi, m = now.theta, now.phi, now.descent
        if is_likely:
            now.f_trial, _, it.c_trial[:], _ = self._program.slopes(it.trial)
        else:
            now.f_trial, it.c_trial[:] = self._program.values(it.trial)
        self._do(barrier.EVALUATE_TRIAL_POINT)
        theta_new, phi_new = now.theta_trial, now.phi_trial
        if not math.isfinite(now.f_trial) or not theta_new <= self._theta_max:
            now.theta_trial = np.inf
            return False
        rounding = _ROUNDING * max(1.0, abs(phi))
        if not self._is_outside(theta_new, phi_new - rounding):
            return False
        descends = m < 0.0 and alpha * (-m) ** 2.3 > theta**1.1
        armijo = phi_new - phi - rounding <= 1e-8 * alpha * m
        if theta <= self._theta_min and descends:
            return bool(armijo)
        if theta_new <= (1.0 - 1e-5) * theta or phi_new - rounding <= phi - 1e-8 * theta:
            if not (descends and armijo):
                self._filter.append(((1.0 - 1e-5) * theta, phi - 1e-8 * theta))
            return True
        return False

    def _is_outside(self, theta: float, phi: float) -> bool:
        return all(theta < t or phi < p for t, p in self._filter)

    def _restore(self, theta: float, phi: float) -> Ending | None:
        """Goes where constraints are violated less, section 3.3."""
        if isinstance(self._program, Restoration) or theta <= self._tolerance:
            return Ending.STUCK
        self._filter.append(((1.0 - 1e-5) * theta, phi - 1e-8 * theta))
        n, it = self._program.n, self._at

        def is_better(z: np.ndarray) -> bool:
            f, c = self._program.values(z[:n])
            new = float(np.abs(c).sum())
            return new <= 0.9 * theta and self._is_outside(new, self._barrier(f, z[:n]))

        mu = max(self._now.mu, float(np.abs(it.c).max()))
        restoration = Restoration(self._program, it.z.copy(), mu)
        inner = InteriorPoint(restoration, restoration.first(mu), mu, self._tolerance, np.inf, is_better)
        found = inner.run(300)
        it.z[:] = found.z[:n]
        self._evaluate()
        if found.ending is not Ending.STOPPED:
            left = float(np.abs(it.c).max(initial=0.0))
            if left > 1e2 * self._tolerance:
                return Ending.INFEASIBLE if found.ending is Ending.CONVERGED else Ending.STUCK
        low, high = self._gaps(it.z)
        it.zL[:] = np.where(self._has_lower, np.minimum(self._now.mu / low, 1e3), 0.0)
        it.zU[:] = np.where(self._has_upper, np.minimum(self._now.mu / high, 1e3), 0.0)
        self._do(barrier.LEAST_MULTIPLIERS)
        return None


def interior_point(
    form: NonlinearForm, start: np.ndarray, tolerance: float, feasibility: float, iterations: int
) -> tuple[np.ndarray, np.ndarray, Ending]:
    """A local minimum of a form.

    Args:
        form: The program.
        start: Where to begin.
        tolerance: Of the conditions of optimality.
        feasibility: The largest violation of a constraint.
        iterations: No more than these.

    Returns:
        The last point; the derivatives of the cost by the bounds of the rows there; and why it is the last.
    """
    program = Slacked(form, start)
    found = InteriorPoint(program, program.first(start), tolerance=tolerance, feasibility=0.5 * feasibility).run(
        iterations
    )
    dual = -found.multipliers * program.row_scale / program.cost_scale
    return form.clip(program.point(found.z)), dual, found.ending
