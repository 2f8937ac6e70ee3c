"""Costs and constraints of x as ones of (t x, t): zero, or without effect, where t is zero."""

from __future__ import annotations

import numpy as np

from sheldrake.geometry.optimization._affine import Affine, Rows
from sheldrake.solvers import (
    BoundingBoxConstraint,
    Constraint,
    Cost,
    ExponentialConeConstraint,
    L1NormCost,
    L2NormCost,
    LinearConstraint,
    LinearCost,
    LinearEqualityConstraint,
    LinearMatrixInequalityConstraint,
    LInfNormCost,
    LorentzConeConstraint,
    PerspectiveQuadraticCost,
    PositiveSemidefiniteConstraint,
    QuadraticConstraint,
    QuadraticCost,
    RotatedLorentzConeConstraint,
)
from sheldrake.solvers._functions.bindings import BindingBase


def _factor(Q: np.ndarray) -> np.ndarray:
    """R with R'R = Q / 2.

    Raises:
        RuntimeError: Q has a negative eigenvalue.
    """
    values, vectors = np.linalg.eigh(0.25 * (Q + Q.T))
    if values.min(initial=0.0) < -1e-10:
        raise RuntimeError(f"Y is not positive semidefinite. It has an eigenvalue {values.min()}.")
    keep = values > 1e-12 * max(values.max(initial=0.0), 1e-300)
    return np.sqrt(values[keep])[:, None] * vectors[:, keep].T


def _require_not_negative(binding: BindingBase[Cost], Q: np.ndarray, b: np.ndarray, c: float) -> None:
    x, *_ = np.linalg.lstsq(Q, -b, rcond=None)
    least = 0.5 * x @ Q @ x + b @ x + c if np.allclose(Q @ x, -b, atol=1e-8) else -np.inf
    if least < -1e-8:
        raise RuntimeError(
            "In order to prevent negative edge lengths, quadratic costs must be strictly non-negative: "
            f"{str(binding).strip()} obtains a minimum of {least:g}."
        )


def bound_cost(into: Rows, binding: BindingBase[Cost], x: Affine, t: Affine, ell: Affine) -> None:
    """Constrains ell >= t g(x / t) for a cost g.

    Args:
        into: The program.
        binding: The cost.
        x: Its variables times t.
        t: Not negative.
        ell: What is to be no less than the cost.

    Raises:
        RuntimeError: the cost is not convex, can be negative though quadratic, or is of a kind without perspective.
    """
    cost = binding.evaluator()
    free = np.array([-np.inf])
    if isinstance(cost, LinearCost):
        into.linear(free, cost.a().reshape(1, -1) @ x + t.times([cost.b()]) - ell, np.zeros(1))
    elif isinstance(cost, QuadraticCost):
        Q, b, c = np.asarray(cost.Q(), dtype=float), np.asarray(cost.b(), dtype=float), float(cost.c())
        R = _factor(Q)
        _require_not_negative(binding, Q, b, c)
        top = ell - b.reshape(1, -1) @ x - t.times([c])
        into.rotated_lorentz(top.stacked(t).stacked(R @ x))
    elif isinstance(cost, L1NormCost):
        z = cost.A() @ x + t.times(cost.b())
        sizes = into.new(len(z), "l1norm")
        zero, most = np.zeros(len(z)), np.full(len(z), np.inf)
        into.linear(zero, sizes - z, most)
        into.linear(zero, sizes + z, most)
        into.linear(free, np.ones((1, len(z))) @ sizes - ell, np.zeros(1))
    elif isinstance(cost, L2NormCost):
        into.lorentz(ell.stacked(cost.GetDenseA() @ x + t.times(cost.b())))
    elif isinstance(cost, LInfNormCost):
        z = cost.A() @ x + t.times(cost.b())
        all_of_it = np.ones((len(z), 1)) @ ell
        for sign in (-1.0, 1.0):
            into.linear(np.zeros(len(z)), all_of_it + (sign * np.eye(len(z))) @ z, np.full(len(z), np.inf))
    elif isinstance(cost, PerspectiveQuadraticCost):
        z = cost.A() @ x + t.times(cost.b())
        into.rotated_lorentz(ell.stacked(z))
    else:
        raise RuntimeError(f"GraphOfConvexSets::Edge does not support this binding type: {str(binding).strip()}")


def add_constraint(into: Rows, binding: BindingBase[Constraint], x: Affine, t: Affine) -> None:
    """Constrains x / t as a constraint says.

    Args:
        into: The program.
        binding: The constraint.
        x: Its variables times t.
        t: Not negative.

    Raises:
        RuntimeError: the constraint is of a kind without perspective.
    """
    c = binding.evaluator()
    if isinstance(c, LinearEqualityConstraint):
        into.equal(c.GetDenseA() @ x - t.times(c._lower))
    elif isinstance(c, (LinearConstraint, BoundingBoxConstraint)):
        lower, upper = c._lower, c._upper
        e = x if isinstance(c, BoundingBoxConstraint) else c.GetDenseA() @ x
        same = lower == upper
        if same.any():
            into.equal(e[same] - t.times(lower[same]))
        if not same.all():
            into.within(lower[~same], e[~same], upper[~same], t)
    elif isinstance(c, LorentzConeConstraint):
        into.lorentz(c._A @ x + t.times(c._b))
    elif isinstance(c, RotatedLorentzConeConstraint):
        into.rotated_lorentz(c._A @ x + t.times(c._b))
    elif isinstance(c, ExponentialConeConstraint):
        into.exponential(c._A @ x + t.times(c._b))
    elif isinstance(c, PositiveSemidefiniteConstraint):
        into.semidefinite(x, c.matrix_rows())
    elif isinstance(c, LinearMatrixInequalityConstraint):
        F = c.F()
        slopes = np.column_stack([M.ravel() for M in F[1:]])
        into.semidefinite(slopes @ x + t.times(F[0].ravel()), c.matrix_rows())
    else:
        hint = ""
        if isinstance(c, QuadraticConstraint):
            hint = (
                ". Please add convex quadratic constraints in conic form by using the function "
                "AddQuadraticAsRotatedLorentzConeConstraint"
            )
        raise RuntimeError(f"ShortestPathProblem::Edge does not support this binding type: {binding}{hint}")
