"""Constraints on a path and its derivatives in time, as functions of control points and duration."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.multibody.tree import MultibodyForces_
from sheldrake.solvers import Constraint, _arrays
from sheldrake.solvers._functions.evaluators import Opaque, WithSlopes

if TYPE_CHECKING:
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.systems.framework import Context


class DerivativeConstraint(Opaque, WithSlopes, Constraint):
    """Bounds on M c / T^order; of (T, c)."""

    def __init__(self, M: np.ndarray, order: int, lower: float, upper: float):
        self._M, self._order = M, order
        self._set_sizes(len(M), M.shape[1] + 1)
        self._set_bounds(np.full(len(M), float(lower)), np.full(len(M), float(upper)))

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return self._M @ x[1:] / x[0] ** self._order

    def _eval_with_jacobian(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        y = self._eval(x)
        return y, np.hstack(((-self._order * y / x[0])[:, None], self._M / x[0] ** self._order))


class PathConstraint(Opaque, WithSlopes, Constraint):
    """A constraint on r(s), a fixed combination of control points."""

    def __init__(self, wrapped: Constraint, weights: np.ndarray):
        self._wrapped, self._weights = wrapped, weights
        n = wrapped.num_vars()
        self._thread_safe = wrapped.is_thread_safe()
        M = np.zeros((n, len(weights), n))
        M[range(n), :, range(n)] = weights
        self._M = M.reshape(n, -1)
        self._set_sizes(wrapped.num_constraints(), self._M.shape[1])
        self._set_bounds(wrapped.lower_bound(), wrapped.upper_bound())

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return self._wrapped._eval(self._M @ x)

    def _eval_with_jacobian(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        y, J = self._wrapped._eval_with_jacobian(self._M @ x)
        return y, J @ self._M


class WrappedVelocityConstraint(Opaque, WithSlopes, Constraint):
    """A constraint on q and qdot = rdot / T; of (T, control points)."""

    def __init__(self, wrapped: Constraint, R: np.ndarray, Rdot: np.ndarray):
        self._wrapped, self._R, self._Rdot = wrapped, R, Rdot
        self._thread_safe = wrapped.is_thread_safe()
        self._set_sizes(wrapped.num_constraints(), R.shape[1] + 1)
        self._set_bounds(wrapped.lower_bound(), wrapped.upper_bound())

    def _inner(self, x: np.ndarray) -> np.ndarray:
        return np.concatenate((self._R @ x[1:], self._Rdot @ x[1:] / x[0]))

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return self._wrapped._eval(self._inner(x))

    def _eval_with_jacobian(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        z = self._inner(x)
        y, J = self._wrapped._eval_with_jacobian(z)
        n = len(self._R)
        inner = np.zeros((2 * n, x.size))
        inner[:n, 1:], inner[n:, 1:], inner[n:, 0] = self._R, self._Rdot / x[0], -z[n:] / x[0]
        return y, J @ inner


class EffortConstraint(Opaque, WithSlopes, Constraint):
    """Bounds on the efforts that a plant needs for q, qdot and qddot; of (T, control points)."""

    _thread_safe = False

    def __init__(self, plant: MultibodyPlant, context: Context, matrices: tuple, lower: np.ndarray, upper: np.ndarray):
        self._plant, self._context, self._matrices = plant, context, matrices
        self._set_sizes(lower.size, matrices[0].shape[1] + 1)
        self._set_bounds(lower, upper)

    def _effort(self, x: np.ndarray) -> np.ndarray:
        T, c = x[0], x[1:]
        q, v, vdot = (M @ c / T**k if k else M @ c for k, M in enumerate(self._matrices))
        self._plant.SetPositions(self._context, q)
        self._plant.SetVelocities(self._context, v)
        forces = MultibodyForces_[AutoDiffXd](self._plant)
        self._plant.CalcForceElementsContribution(self._context, forces)
        return self._plant.CalcInverseDynamics(self._context, vdot, forces)

    def _eval_duals(self, x: np.ndarray) -> np.ndarray:
        return np.asarray(self._effort(x), dtype=object)

    def _eval_with_jacobian(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return _arrays.values_and_gradient(self._eval_duals(_arrays.variables_at(x)))

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return self._eval_with_jacobian(x)[0]
