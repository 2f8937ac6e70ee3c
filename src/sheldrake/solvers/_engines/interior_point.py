"""A primal-dual interior point method with a filter for nonlinear programs.

After A. Waechter and L. T. Biegler, "On the implementation of an interior-point filter line-search algorithm for
large-scale nonlinear programming" (Mathematical Programming 106, 2006); equation numbers and symbols are theirs.
"""

from __future__ import annotations

import enum
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from sheldrake.solvers._engines.nonlinear_form import NonlinearForm
from sheldrake.solvers._kernels import ldl

_MOST_GRADIENT = 100.0  # Costs and rows with larger gradients at the start are scaled down to it.
_SMALLEST_MU = 1e-11
_FIRST_REGULARIZATION, _LARGEST_REGULARIZATION = 1e-4, 1e20
_GIVE = 1e-10  # By which bounds are moved out, relative to those above one.
_SHIFT = 1e-8  # What factors have more on their diagonal, which is about one.
_PENALTY = 1e3  # Of what is left of constraints while they are restored.


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
        self._J_kept = np.flatnonzero(place[form.J_cols] >= 0)
        self.J_rows = np.concatenate((form.J_rows[self._J_kept], self._slack_rows))
        self.J_cols = np.concatenate((place[form.J_cols[self._J_kept]], nf + np.arange(ns)))
        self._H_kept = np.flatnonzero((place[form.H_rows] >= 0) & (place[form.H_cols] >= 0))
        self.H_rows, self.H_cols = place[form.H_rows[self._H_kept]], place[form.H_cols[self._H_kept]]
        gradient, entries = form.cost(start)[1], form.constraints(start)[1]
        self.cost_scale = _scale_of(np.abs(gradient[self._free]).max(initial=0.0))
        largest = np.zeros(self.m)
        np.maximum.at(largest, self.J_rows[: len(self._J_kept)], np.abs(entries[self._J_kept]))
        self.row_scale = _scale_of(largest)
        lower, upper = form.lower * self.row_scale, form.upper * self.row_scale
        self._target = np.where(equal, lower, 0.0)
        self.lower = np.concatenate((form.x_lower[self._free], lower[self._slack_rows]))
        self.upper = np.concatenate((form.x_upper[self._free], upper[self._slack_rows]))

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
        """f, its gradient, c, and the entries of its Jacobian."""
        y = self.point(z)
        (cost, gradient), (rows, entries) = self._form.cost(y), self._form.constraints(y)
        g = np.zeros(self.n)
        g[: len(self._free)] = gradient[self._free] * self.cost_scale
        own = entries[self._J_kept] * self.row_scale[self.J_rows[: len(self._J_kept)]]
        J = np.concatenate((own, np.full(len(self._slack_rows), -1.0)))
        return cost * self.cost_scale, g, self._residual(rows, z), J

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


class Factors:
    """Solves [[W + diagonal, J'], [J, -gamma]] x = b by sparse factors; everything is laid out once.

    The factors are those of a matrix with a little more on its diagonal, which makes it quasidefinite wherever the
    inertia is right (R. J. Vanderbei, 1995), so that any order of elimination will do; solutions are improved until
    that little does not matter.
    """

    def __init__(self, program: Any):
        n, m = program.n, program.m
        size = n + m
        diagonal, below = np.arange(n), n + np.arange(m)
        rows = np.concatenate((program.H_rows, diagonal, program.J_cols, below))
        cols = np.concatenate((program.H_cols, diagonal, n + program.J_rows, below))
        half = rows <= cols  # the Hessian is given with both its halves
        self._kept = np.flatnonzero(half)
        order = _elimination_order(size, rows[half], cols[half])
        place = np.empty(size, dtype=np.int64)
        place[order] = np.arange(size)
        a, b = place[rows[half]], place[cols[half]]
        keys, self._slots = np.unique(np.maximum(a, b) * size + np.minimum(a, b), return_inverse=True)
        self._order, self._place = order, place
        starts = np.searchsorted(keys // size, np.arange(size + 1)).astype(np.int64)
        indices = (keys % size).astype(np.int64)
        self._entries = np.zeros(len(keys))
        self._rows, self._cols = indices, keys // size
        parent, flag, counts = (np.zeros(size, dtype=np.int64) for _ in range(3))
        ldl.analyze_ldl.native(starts, indices, parent, flag, counts)
        L_starts = np.concatenate(([0], np.cumsum(counts))).astype(np.int64)
        L_rows, L = np.zeros(L_starts[-1], dtype=np.int64), np.zeros(L_starts[-1])
        D, y, filled, pattern = np.zeros(size), np.zeros(size), flag.copy(), flag.copy()
        shift = np.where(order < n, _SHIFT, -_SHIFT)
        matrix = starts, indices, self._entries
        self._b, self._x, self._info = np.zeros(size), np.zeros(size), np.zeros(1)
        self._factor = ldl.factor_ldl.bind(*matrix, shift, parent, L_starts, L_rows, L, D, filled, flag, pattern, y)
        self._solve = ldl.solve_ldl.bind(*matrix, L_starts, L_rows, L, D, self._b, self._x, y, self._info)
        self._m = m

    def factor(self, W: np.ndarray, diagonal: np.ndarray, J: np.ndarray, gamma: float) -> bool:
        """Factors; tells whether the matrix has as many negative eigenvalues as J has rows."""
        entries = np.concatenate((W, diagonal, J, np.full(self._m, -gamma)))[self._kept]
        found = np.bincount(self._slots, entries, len(self._entries))
        # Rows and columns are scaled alike, to largest entries of about one; that leaves the inertia as it is.
        scale = np.ones(len(self._b))
        for _ in range(2):
            largest = np.zeros(len(scale))
            size = np.abs(found) * scale[self._rows] * scale[self._cols]
            np.maximum.at(largest, self._rows, size)
            np.maximum.at(largest, self._cols, size)
            scale /= np.sqrt(np.where(largest > 0.0, largest, 1.0))
        self._scale = scale
        self._entries[:] = found * scale[self._rows] * scale[self._cols]
        return self._factor() == self._m

    def solve(self, b: np.ndarray) -> np.ndarray | None:
        """The solution; None if it is not exact."""
        self._b[:] = b[self._order] * self._scale
        self._solve()
        return (self._x * self._scale)[self._place] if self._info[0] < 1e-6 else None


_SMALL = 40  # Up to this size full factors take less time than looking for an order does.


def _elimination_order(size: int, rows: np.ndarray, cols: np.ndarray) -> np.ndarray:
    """An order that keeps factors sparse: minimum degree, from SuperLU for a matrix of the same pattern."""
    if size <= _SMALL:
        return np.arange(size)
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import splu

    diagonal = np.arange(size)
    both = (np.concatenate((rows, cols, diagonal)), np.concatenate((cols, rows, diagonal)))
    weights = np.concatenate((np.ones(2 * len(rows)), np.full(size, 4.0 * len(rows) + 4.0)))  # needs no pivots
    matrix = csc_matrix((weights, both), shape=(size, size))
    found = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return np.argsort(found.perm_c)


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
        self._mu, self._factors = mu, Factors(program)
        self._has_lower, self._has_upper = np.isfinite(program.lower), np.isfinite(program.upper)
        # Bounds give way a little, so that there is an inside even where equations leave none, section 3.5.
        self._lower = program.lower - _GIVE * np.maximum(1.0, np.abs(np.where(self._has_lower, program.lower, 0.0)))
        self._upper = program.upper + _GIVE * np.maximum(1.0, np.abs(np.where(self._has_upper, program.upper, 0.0)))
        self._z = self._inside(z)
        self._evaluate()
        self._zL, self._zU = np.where(self._has_lower, 1.0, 0.0), np.where(self._has_upper, 1.0, 0.0)
        self._lam = self._least_multipliers()
        self._delta = 0.0
        self._filter: list[tuple[float, float]] = []
        theta = self._theta(self._c)
        self._theta_max, self._theta_min = 1e4 * max(1.0, theta), 1e-4 * max(1.0, theta)

    # The point

    def _inside(self, z: np.ndarray) -> np.ndarray:
        """The point, moved off the bounds, eq. (35)."""
        low, high, width = self._lower, self._upper, self._upper - self._lower
        with np.errstate(invalid="ignore"):
            push_low = np.minimum(
                1e-2 * np.maximum(1.0, np.abs(low)), np.where(np.isfinite(width), 1e-2 * width, np.inf)
            )
            push_high = np.minimum(
                1e-2 * np.maximum(1.0, np.abs(high)), np.where(np.isfinite(width), 1e-2 * width, np.inf)
            )
            z = np.where(self._has_lower, np.maximum(z, low + push_low), z)
            return np.where(self._has_upper, np.minimum(z, high - push_high), z)

    def _evaluate(self) -> None:
        self._f, self._g, self._c, self._J = self._program.slopes(self._z)

    def _times_JT(self, lam: np.ndarray) -> np.ndarray:
        p = self._program
        return np.bincount(p.J_cols, self._J * lam[p.J_rows], p.n)

    def _least_multipliers(self) -> np.ndarray:
        """Multipliers that leave least of the gradient, eq. (36); none if they are very large."""
        p = self._program
        if not p.m:
            return np.zeros(0)
        self._factors.factor(np.zeros(len(p.H_rows)), np.ones(p.n), self._J, 1e-10)
        found = self._factors.solve(np.concatenate((-(self._g - self._zL + self._zU), np.zeros(p.m))))
        if found is None or np.abs(found[p.n :]).max(initial=0.0) > 1e3:
            return np.zeros(p.m)
        return found[p.n :]

    def _gaps(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How far it is to the bounds; 1 where there are none."""
        return np.where(self._has_lower, z - self._lower, 1.0), np.where(self._has_upper, self._upper - z, 1.0)

    @staticmethod
    def _theta(c: np.ndarray) -> float:
        return float(np.abs(c).sum())

    def _barrier(self, f: float, z: np.ndarray) -> float:
        low, high = self._gaps(z)
        return f - self._mu * float(np.log(low).sum() + np.log(high).sum())

    def _error(self, mu: float) -> float:
        """How far from optimal the point is, eq. (5)."""
        p = self._program
        low, high = self._gaps(self._z)
        both = np.abs(self._zL).sum() + np.abs(self._zU).sum()
        s_d = max(100.0, (np.abs(self._lam).sum() + both) / max(1, p.m + p.n)) / 100.0
        s_c = max(100.0, both / max(1, p.n)) / 100.0
        dual = self._g + self._times_JT(self._lam) - self._zL + self._zU
        gaps = np.concatenate((low * self._zL - mu * self._has_lower, high * self._zU - mu * self._has_upper))
        return max(
            float(np.abs(dual).max(initial=0.0)) / s_d,
            float(np.abs(self._c).max(initial=0.0)),
            float(np.abs(gaps).max(initial=0.0)) / s_c,
        )

    # Iterations

    def run(self, iterations: int) -> Found:
        """Iterates."""
        if not np.isfinite(self._f) or not np.isfinite(self._c).all():
            return self._found(Ending.STUCK, 0)
        near = 0
        for k in range(iterations):
            error = self._error(0.0)
            is_feasible = self._program.violation(self._c) <= self._feasibility
            near = near + 1 if is_feasible and error <= 100.0 * self._tolerance else 0
            if (is_feasible and error <= self._tolerance) or near >= 12:
                return self._found(Ending.CONVERGED, k)
            self._lower_barrier()
            step = self._direction()
            if step is None:
                return self._found(Ending.STUCK, k)
            ending = self._advance(*step)
            if ending is not None:
                return self._found(Ending.CONVERGED if self._error(0.0) <= 1e3 * self._tolerance else ending, k + 1)
            self._program.show(self._z)
            if self._stop is not None and self._stop(self._z):
                return self._found(Ending.STOPPED, k + 1)
        return self._found(Ending.ITERATIONS, iterations)

    def _found(self, ending: Ending, iterations: int) -> Found:
        return Found(self._z, self._lam, ending, iterations)

    def _lower_barrier(self) -> None:
        """The next barrier problem, if this one is solved well enough, eq. (7)."""
        while self._mu > _SMALLEST_MU and self._error(self._mu) <= 10.0 * self._mu:
            self._mu = max(min(_SMALLEST_MU, 0.1 * self._tolerance), min(0.2 * self._mu, self._mu**1.5))
            self._filter = []

    def _direction(self) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
        """Steps of z and of the multipliers, eq. (13), with as much regularization as a step of descent takes."""
        p = self._program
        W = p.hessian(self._z, self._lam)
        low, high = self._gaps(self._z)
        sigma = self._zL / low + self._zU / high
        slope = self._g - self._mu * (self._has_lower / low - self._has_upper / high)
        right = -np.concatenate((slope, self._c))  # for multipliers themselves, not their steps
        delta, gamma = 0.0, 0.0
        while delta <= _LARGEST_REGULARIZATION:
            if self._factors.factor(W, sigma + delta, self._J, gamma):
                found = self._factors.solve(right)
                if found is not None:
                    self._delta = delta or self._delta
                    return found[: p.n], found[p.n :] - self._lam, slope
                if not gamma:  # rows that depend on each other
                    gamma = 1e-8 * self._mu**0.25
                    continue
            if delta:
                delta *= 8.0
            else:
                delta = max(1e-20, self._delta / 3.0) if self._delta else _FIRST_REGULARIZATION
        return None

    def _longest(self, d: np.ndarray) -> float:
        """The part of a step that leaves a share of all gaps, eq. (15a)."""
        tau = max(0.99, 1.0 - self._mu)
        low, high = self._gaps(self._z)
        to_low, to_high = self._has_lower & (d < 0.0), self._has_upper & (d > 0.0)
        shares = np.concatenate((-tau * low[to_low] / d[to_low], tau * high[to_high] / d[to_high], np.ones(1)))
        return float(shares.min())

    def _advance(self, d: np.ndarray, d_lam: np.ndarray, slope: np.ndarray) -> Ending | None:
        """The line search, section 2.3 and algorithm A."""
        low, high = self._gaps(self._z)
        d_zL = np.where(self._has_lower, self._mu / low - self._zL - self._zL / low * d, 0.0)
        d_zU = np.where(self._has_upper, self._mu / high - self._zU + self._zU / high * d, 0.0)
        longest = self._longest(d)
        theta, phi, m = self._theta(self._c), self._barrier(self._f, self._z), float(slope @ d)
        if np.abs(d / (1.0 + np.abs(self._z))).max(initial=0.0) < 1e-15:
            alpha, z = longest, self._z + longest * d
        else:
            found = self._search(d, slope, longest, theta, phi, m)
            if found is None:
                return self._restore(theta, phi)
            alpha, z = found
        self._z = z
        self._lam = self._lam + alpha * d_lam
        share = self._longest_dual(d_zL, d_zU)
        self._zL, self._zU = self._zL + share * d_zL, self._zU + share * d_zU
        self._keep_inside()
        self._evaluate()
        self._near_central()
        return None

    def _keep_inside(self) -> None:
        """Moves bounds that rounding has put the point onto, section 3.5."""
        low, high = self._gaps(self._z)
        little = np.finfo(float).eps ** 0.75 * np.maximum(1.0, np.abs(self._z))
        self._lower = np.where(low < 1e-4 * little, self._z - little, self._lower)
        self._upper = np.where(high < 1e-4 * little, self._z + little, self._upper)

    def _near_central(self) -> None:
        """Keeps multipliers of bounds within a factor of those of the barrier, eq. (16)."""
        low, high = self._gaps(self._z)
        far = 1e10
        self._zL = np.where(self._has_lower, np.clip(self._zL, self._mu / low / far, self._mu / low * far), 0.0)
        self._zU = np.where(self._has_upper, np.clip(self._zU, self._mu / high / far, self._mu / high * far), 0.0)

    def _longest_dual(self, d_zL: np.ndarray, d_zU: np.ndarray) -> float:
        tau = max(0.99, 1.0 - self._mu)
        a, b = d_zL < 0.0, d_zU < 0.0
        return float(np.concatenate((-tau * self._zL[a] / d_zL[a], -tau * self._zU[b] / d_zU[b], np.ones(1))).min())

    def _search(
        self, d: np.ndarray, slope: np.ndarray, longest: float, theta: float, phi: float, m: float
    ) -> tuple[float, np.ndarray] | None:
        """A step that the filter takes, and the point it leads to; None if it would be too short."""
        smallest = 1e-5
        if m < 0.0:
            smallest = min(smallest, 1e-5 * theta / -m) if theta else 0.0
            if theta <= self._theta_min:
                smallest = min(smallest, theta**1.1 / (-m) ** 2.3)
        smallest = max(0.05 * smallest, 1e-14)
        alpha = longest
        first = True
        while alpha > smallest:
            z = self._z + alpha * d
            taken, theta_new, c_new = self._takes(z, alpha, theta, phi, m)
            if taken:
                return alpha, z
            if first and theta_new >= theta and np.isfinite(theta_new):
                corrected = self._corrected(slope, alpha, c_new, theta, theta_new, phi, m)
                if corrected is not None:
                    return corrected
            first = False
            alpha *= 0.5
        return None

    def _corrected(
        self,
        slope: np.ndarray,
        alpha: float,
        c_new: np.ndarray,
        theta: float,
        theta_old: float,
        phi: float,
        m: float,
    ) -> tuple[float, np.ndarray] | None:
        """Second-order corrections, eq. (27)."""
        c = alpha * self._c + c_new
        for _ in range(4):
            found = self._factors.solve(-np.concatenate((slope, c)))
            if found is None:
                return None
            d = found[: self._program.n]
            longest = self._longest(d)
            z = self._z + longest * d
            taken, theta_new, c_new = self._takes(z, alpha, theta, phi, m)
            if taken:
                return longest, z
            if not theta_new <= 0.99 * theta_old:
                return None
            theta_old, c = theta_new, longest * c + c_new
        return None

    def _takes(self, z: np.ndarray, alpha: float, theta: float, phi: float, m: float) -> tuple[bool, float, np.ndarray]:
        """Whether a point is good enough, eq. (18) to (20); the filter grows where it takes one for its violation."""
        f, c = self._program.values(z)
        theta_new = self._theta(c)
        if not np.isfinite(f) or not np.isfinite(theta_new) or theta_new > self._theta_max:
            return False, np.inf, c
        phi_new = self._barrier(f, z)
        rounding = 10.0 * np.finfo(float).eps * max(1.0, abs(phi))
        if not self._is_outside(theta_new, phi_new - rounding):
            return False, theta_new, c
        descends = m < 0.0 and alpha * (-m) ** 2.3 > theta**1.1
        armijo = phi_new - phi - rounding <= 1e-8 * alpha * m
        if theta <= self._theta_min and descends:
            return bool(armijo), theta_new, c
        if theta_new <= (1.0 - 1e-5) * theta or phi_new - rounding <= phi - 1e-8 * theta:
            if not (descends and armijo):
                self._filter.append(((1.0 - 1e-5) * theta, phi - 1e-8 * theta))
            return True, theta_new, c
        return False, theta_new, c

    def _is_outside(self, theta: float, phi: float) -> bool:
        return all(theta < t or phi < p for t, p in self._filter)

    def _restore(self, theta: float, phi: float) -> Ending | None:
        """Goes where constraints are violated less, section 3.3."""
        if isinstance(self._program, Restoration) or theta <= self._tolerance:
            return Ending.STUCK
        self._filter.append(((1.0 - 1e-5) * theta, phi - 1e-8 * theta))
        n = self._program.n

        def is_better(z: np.ndarray) -> bool:
            f, c = self._program.values(z[:n])
            new = self._theta(c)
            return new <= 0.9 * theta and self._is_outside(new, self._barrier(f, z[:n]))

        mu = max(self._mu, float(np.abs(self._c).max()))
        restoration = Restoration(self._program, self._z, mu)
        inner = InteriorPoint(restoration, restoration.first(mu), mu, self._tolerance, np.inf, is_better)
        found = inner.run(300)
        self._z = found.z[:n]
        self._evaluate()
        if found.ending is not Ending.STOPPED:
            left = float(np.abs(self._c).max(initial=0.0))
            if left > 1e2 * self._tolerance:
                return Ending.INFEASIBLE if found.ending is Ending.CONVERGED else Ending.STUCK
        low, high = self._gaps(self._z)
        self._zL = np.where(self._has_lower, np.minimum(self._mu / low, 1e3), 0.0)
        self._zU = np.where(self._has_upper, np.minimum(self._mu / high, 1e3), 0.0)
        self._lam = self._least_multipliers()
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
