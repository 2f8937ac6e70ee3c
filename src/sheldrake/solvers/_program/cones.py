"""Adding cone and matrix constraints to a program.

One of the parts that `MathematicalProgram` is put together from.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import Mismatch, Ways, overload
from sheldrake.solvers import _kinds as kinds
from sheldrake.solvers._arrays import Matrix
from sheldrake.solvers._functions.bindings import Binding, BindingBase, bind
from sheldrake.solvers._functions.cone_constraints import (
    ExponentialConeConstraint,
    LinearMatrixInequalityConstraint,
    LorentzConeConstraint,
    PositiveSemidefiniteConstraint,
    RotatedLorentzConeConstraint,
)
from sheldrake.solvers._functions.constraints import LinearConstraint
from sheldrake.solvers._parse import coefficients
from sheldrake.solvers._parse import constraints as parse
from sheldrake.solvers._program.bindings import ProgramBindings
from sheldrake.solvers._program.variables import ProgramVariables
from sheldrake.symbolic import Expression, Variable
from sheldrake.symbolic import _build as build
from sheldrake.symbolic import _traverse as traverse

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.common._types import Symbolic, Symbolics
    from sheldrake.solvers._arrays import VariablesLike
    from sheldrake.symbolic import Formula

_SMOOTH = LorentzConeConstraint.EvalType.kConvexSmooth


def quadratic_factor(e: Expression, tol: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A, b, x with `e = |A x + b|^2`.

    Raises:
        RuntimeError: e is not quadratic, or negative somewhere.
    """
    c = coefficients.quadratic(e, "AddLorentzConeConstraint")
    n = len(c.vars)
    # [x; 1]' M [x; 1] is e: a factor of M, without rows of zeros, is [A b].
    M = np.block([[c.hessian() / 2.0, c.b.reshape(-1, 1) / 2.0], [c.b.reshape(1, -1) / 2.0, np.array([[c.c]])]])
    values, vectors = np.linalg.eigh(M)
    if values.min(initial=0.0) < -max(tol, 1e-12) * max(1.0, np.abs(values).max(initial=0.0)):
        raise RuntimeError(f"AddLorentzConeConstraint(): the quadratic expression {e} is negative somewhere.")
    keep = values > max(tol, 1e-14) * max(1.0, values.max(initial=0.0))
    factor = (vectors[:, keep] * np.sqrt(values[keep])).T
    return factor[:, :n], factor[:, n], c.vars


def _stack(
    linear: list[Expression], A: np.ndarray, b: np.ndarray, x: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows of affine expressions above A x + b, over all variables."""
    rows = coefficients.affine_vector(linear, "AddLorentzConeConstraint")
    everything = sorted({*rows.vars, *x}, key=Variable.get_id)
    places = {v: i for i, v in enumerate(everything)}
    M = np.zeros((len(linear) + len(b), len(everything)))
    M[: len(linear), [places[v] for v in rows.vars]] = rows.A
    M[len(linear) :, [places[v] for v in x]] = A
    return M, np.concatenate((rows.c, b)), traverse.object_array(everything)


@checked
class ProgramCones:
    """Adds constraints that are Lorentz, exponential and matrix cones.

    Args:
        variables: Where new variables are made.
        bindings: Where constraints are kept.
    """

    def __init__(self, variables: ProgramVariables, bindings: ProgramBindings) -> None:
        self._variables, self._bindings = variables, bindings

    @typing_overload
    def AddLorentzConeConstraint(
        self,
        f: Formula | bool,
        eval_type: LorentzConeConstraint.EvalType = ...,
        psd_tol: float = 1e-08,
        coefficient_tol: float = 1e-08,
    ) -> Binding[LorentzConeConstraint]: ...
    @typing_overload
    def AddLorentzConeConstraint(
        self, v: Symbolics, eval_type: LorentzConeConstraint.EvalType = ...
    ) -> Binding[LorentzConeConstraint]: ...
    @typing_overload
    def AddLorentzConeConstraint(
        self,
        linear_expression: Symbolic,
        quadratic_expression: Symbolic,
        tol: float = 0.0,
        eval_type: LorentzConeConstraint.EvalType = ...,
    ) -> Binding[LorentzConeConstraint]: ...
    @typing_overload
    def AddLorentzConeConstraint(
        self, A: ArrayLike | Matrix, b: ArrayLike, vars: VariablesLike, eval_type: LorentzConeConstraint.EvalType = ...
    ) -> Binding[LorentzConeConstraint]: ...
    def AddLorentzConeConstraint(self, *args: Any, **kwargs: Any) -> Binding[LorentzConeConstraint]:
        """Adds z_0 >= |z_1 ... z_m|.

        Called as `(v)` with affine expressions z; `(f)` with a formula |A x + b| <= affine;
        `(linear_expression, quadratic_expression, tol=0)` with z_0 and the square of the length; or `(A, b, vars)`
        with z = A x + b. All take `eval_type`.

        Raises:
            RuntimeError: an expression is not of that kind.
        """
        return self._bindings.add(_LORENTZ.choose("AddLorentzConeConstraint", args, kwargs))

    @typing_overload
    def AddRotatedLorentzConeConstraint(
        self,
        linear_expression1: Symbolic,
        linear_expression2: Symbolic,
        quadratic_expression: Symbolic,
        tol: float = 0.0,
    ) -> Binding[RotatedLorentzConeConstraint]: ...
    @typing_overload
    def AddRotatedLorentzConeConstraint(self, v: Symbolics) -> Binding[RotatedLorentzConeConstraint]: ...
    @typing_overload
    def AddRotatedLorentzConeConstraint(
        self, A: ArrayLike | Matrix, b: ArrayLike, vars: VariablesLike
    ) -> Binding[RotatedLorentzConeConstraint]: ...
    def AddRotatedLorentzConeConstraint(self, *args: Any, **kwargs: Any) -> Binding[RotatedLorentzConeConstraint]:
        """Adds z_0 z_1 >= z_2^2 + ..., z_0 >= 0, z_1 >= 0.

        Called as `(v)` with affine expressions z; `(linear_expression1, linear_expression2, quadratic_expression,
        tol=0)` with z_0, z_1 and the sum of squares; or `(A, b, vars)` with z = A x + b.

        Raises:
            RuntimeError: an expression is not of that kind.
        """
        return self._bindings.add(_ROTATED_LORENTZ.choose("AddRotatedLorentzConeConstraint", args, kwargs))

    def AddQuadraticAsRotatedLorentzConeConstraint(
        self, Q: ArrayLike, b: ArrayLike, c: float, vars: VariablesLike, psd_tol: float = 0.0
    ) -> Binding[RotatedLorentzConeConstraint]:
        """Adds 1/2 x' Q x + b' x + c <= 0 as a rotated Lorentz cone.

        Raises:
            RuntimeError: Q is not positive semidefinite.
        """
        Q, b, vars = kinds.matrix(Q), kinds.vector(b), kinds.vars(vars)
        values, vectors = np.linalg.eigh((Q + Q.T) / 4.0)
        if values.min(initial=0.0) < -max(psd_tol, 1e-12) * max(1.0, np.abs(values).max(initial=0.0)):
            raise RuntimeError("AddQuadraticAsRotatedLorentzConeConstraint(): Q is not positive semidefinite.")
        keep = values > 1e-14 * max(1.0, values.max(initial=0.0))
        factor = (vectors[:, keep] * np.sqrt(values[keep])).T
        A = np.vstack((-b, np.zeros(b.size), factor))
        z = np.concatenate(([-c, 1.0], np.zeros(len(factor))))
        return self._bindings.add(parse.rotated_lorentz(A, z, vars))

    @typing_overload
    def AddExponentialConeConstraint(
        self, A: ArrayLike | Matrix, b: ArrayLike, vars: VariablesLike
    ) -> Binding[ExponentialConeConstraint]: ...
    @typing_overload
    def AddExponentialConeConstraint(self, z: Symbolics) -> Binding[ExponentialConeConstraint]: ...
    def AddExponentialConeConstraint(self, *args: Any, **kwargs: Any) -> Binding[ExponentialConeConstraint]:
        """Adds z_0 >= z_1 exp(z_2 / z_1), z_1 > 0; called as `(A, b, vars)` or `(z)` with affine expressions."""
        return self._bindings.add(_EXPONENTIAL.choose("AddExponentialConeConstraint", args, kwargs))

    # Matrices

    def AddPositiveSemidefiniteConstraint(self, e: np.ndarray) -> Binding[PositiveSemidefiniteConstraint]:
        """Adds that a symmetric matrix of variables or affine expressions has no negative eigenvalue.

        A matrix of expressions is made equal to a new matrix of variables. Of a matrix of variables the lower triangle
        counts, whatever the upper one is, as in Drake.

        Raises:
            RuntimeError: the matrix of expressions is not symmetric, or an expression not affine.
        """
        given = np.asarray(e, dtype=object)
        if (
            given.ndim == 2
            and given.shape[0] == given.shape[1]
            and set(map(type, given.ravel().tolist())) <= {Variable}
        ):
            X, n = given, len(given)
        else:
            X = _square("AddPositiveSemidefiniteConstraint", e)
            n = X.shape[0]
            _check_symmetric(X)
            M = self._variables.NewSymmetricContinuousVariables(n)
            lower = [(i, j) for j in range(n) for i in range(j, n)]
            rows = traverse.object_array([X[p] - M[p] for p in lower])
            self._bindings.add(parse.equality_constraint(rows, np.zeros(len(lower))))
            X = M
        vars = kinds.vars(X)
        return self._bindings.add(bind(PositiveSemidefiniteConstraint, PositiveSemidefiniteConstraint(n), vars))

    def AddPrincipalSubmatrixIsPsdConstraint(
        self, X: np.ndarray, minor_indices: set[int]
    ) -> Binding[PositiveSemidefiniteConstraint] | Binding[LinearMatrixInequalityConstraint]:
        """Adds that the rows and columns of some numbers of a symmetric matrix are positive semidefinite."""
        X = np.asarray(X, dtype=object)
        at = sorted(minor_indices)
        part = X[np.ix_(at, at)]
        if all(isinstance(v, Variable) for v in part.flat):
            return self.AddPositiveSemidefiniteConstraint(part)
        return self.AddLinearMatrixInequalityConstraint(part)

    @typing_overload
    def AddLinearMatrixInequalityConstraint(
        self, F: Iterable[ArrayLike], vars: VariablesLike
    ) -> Binding[LinearMatrixInequalityConstraint]: ...
    @typing_overload
    def AddLinearMatrixInequalityConstraint(self, X: Symbolics) -> Binding[LinearMatrixInequalityConstraint]: ...
    def AddLinearMatrixInequalityConstraint(
        self, *args: Any, **kwargs: Any
    ) -> Binding[LinearMatrixInequalityConstraint]:
        """Adds that F_0 + sum F_i x_i is positive semidefinite; called as `(F, vars)` or `(X)` with affine expressions.

        Raises:
            RuntimeError: a matrix is not symmetric, or an expression not affine.
        """

        return self._bindings.add(_INEQUALITY.choose("AddLinearMatrixInequalityConstraint", args, kwargs))

    # Diagonally dominant matrices: inner and outer bounds of the semidefinite cone (Ahmadi and Majumdar, 2019).

    def AddPositiveDiagonallyDominantMatrixConstraint(self, X: np.ndarray) -> np.ndarray:
        """Adds that each diagonal element is at least the sum of the absolute values in its row.

        Returns:
            Y with Y_ij >= |X_ij| off the diagonal, and X_ii on it.
        """
        X = _symmetrized(_square("AddPositiveDiagonallyDominantMatrixConstraint", X))
        n = X.shape[0]
        Y = np.empty((n, n), dtype=object)
        slack = iter(self._variables.NewContinuousVariables(n * (n - 1) // 2, "diagonally_dominant_slack"))
        rows = []
        for j in range(n):
            Y[j, j] = X[j, j]
            for i in range(j + 1, n):
                Y[i, j] = Y[j, i] = Expression(next(slack))
                rows += [X[i, j] - Y[i, j], -X[i, j] - Y[i, j]]
        rows += [_sum([Y[i, j] for j in range(n) if j != i]) - X[i, i] for i in range(n)]
        for row in rows:
            a = coefficients.affine_vector([row], "AddPositiveDiagonallyDominantMatrixConstraint")
            new = LinearConstraint(a.A, [-np.inf], -a.c)
            self._bindings.add(bind(LinearConstraint, new, a.vars))
        return Y

    def AddPositiveDiagonallyDominantDualConeMatrixConstraint(self, X: np.ndarray) -> Binding[LinearConstraint]:
        """Adds v' X v >= 0 for all v with at most two elements that are not zero, those being 1 or -1."""
        X = _square("AddPositiveDiagonallyDominantDualConeMatrixConstraint", X)
        n = X.shape[0]
        rows = [X[i, i] for i in range(n)]
        for i in range(n):
            for j in range(i + 1, n):
                rows += [X[i, i] + X[j, j] + X[i, j] + X[j, i], X[i, i] + X[j, j] - X[i, j] - X[j, i]]
        return self._nonnegative(rows)

    def _nonnegative(self, rows: list[Expression]) -> BindingBase[LinearConstraint]:
        a = coefficients.affine_vector(rows, "MathematicalProgram")
        new = LinearConstraint(a.A, 0.0 - a.c, np.full(len(rows), np.inf))
        return self._bindings.add(bind(LinearConstraint, new, a.vars))

    def AddScaledDiagonallyDominantMatrixConstraint(self, X: np.ndarray) -> list[list[np.ndarray]]:
        """Adds that X is a sum of matrices that are zero but for a positive semidefinite 2 x 2 part.

        Returns:
            M with M[i][j], i < j, the part in rows and columns i and j: of variables where X is.
        """
        is_of_variables = all(isinstance(x, Variable) for x in np.ravel(X))
        X = _symmetrized(_square("AddScaledDiagonallyDominantMatrixConstraint", X))
        n = X.shape[0]
        M = [[np.full((2, 2), Expression(0.0), dtype=object) for _ in range(n)] for _ in range(n)]
        if n == 1:
            self._nonnegative([X[0, 0]])
        slack = iter(self._variables.NewContinuousVariables(2, n * (n - 1) // 2, "sdd_slack_M").T)
        for i in range(n):
            for j in range(i + 1, n):
                a, b = next(slack)
                M[i][j] = np.array([[Expression(a), X[i, j]], [X[i, j], Expression(b)]], dtype=object)
                self.AddRotatedLorentzConeConstraint(np.array([a, b, X[i, j]], dtype=object))
        if n > 1:
            sums = [
                _sum([M[i][j][0, 0] for j in range(i + 1, n)] + [M[j][i][1, 1] for j in range(i)]) - X[i, i]
                for i in range(n)
            ]
            self._bindings.add(parse.equality_constraint(traverse.object_array(sums), np.zeros(n)))
        return [[_variables(part) for part in row] for row in M] if is_of_variables else M

    def AddScaledDiagonallyDominantDualConeMatrixConstraint(
        self, X: np.ndarray
    ) -> list[Binding[RotatedLorentzConeConstraint]]:
        """Adds that all 2 x 2 principal submatrices are positive semidefinite; returns their constraints."""
        X = _square("AddScaledDiagonallyDominantDualConeMatrixConstraint", X)
        n = X.shape[0]
        return [
            self.AddRotatedLorentzConeConstraint(np.array([X[i, i], X[j, j], X[i, j]], dtype=object))
            for i in range(n)
            for j in range(i + 1, n)
        ]

    def _psd_matrix(self, constraint: BindingBase[PositiveSemidefiniteConstraint]) -> np.ndarray:
        n = constraint.evaluator().matrix_rows()
        if self._bindings.RemoveConstraint(constraint) == 0:
            raise RuntimeError("The constraint is not in the program.")
        return constraint.variables().reshape(n, n).T

    def TightenPsdConstraintToDd(self, constraint: BindingBase) -> np.ndarray:
        """Puts a diagonally dominant matrix in the place of a positive semidefinite one; returns its slack matrix."""
        return self.AddPositiveDiagonallyDominantMatrixConstraint(self._psd_matrix(constraint))

    def TightenPsdConstraintToSdd(self, constraint: BindingBase) -> list[list[np.ndarray]]:
        """Puts a scaled diagonally dominant matrix in the place of a positive semidefinite one; returns its parts."""
        return self.AddScaledDiagonallyDominantMatrixConstraint(self._psd_matrix(constraint))

    def RelaxPsdConstraintToDdDualCone(self, constraint: BindingBase) -> Binding[LinearConstraint]:
        """Puts the dual of diagonally dominant matrices in the place of positive semidefinite ones."""
        return self.AddPositiveDiagonallyDominantDualConeMatrixConstraint(self._psd_matrix(constraint))

    def RelaxPsdConstraintToSddDualCone(self, constraint: BindingBase) -> list[Binding[RotatedLorentzConeConstraint]]:
        """Puts the dual of scaled diagonally dominant matrices in the place of positive semidefinite ones."""
        return self.AddScaledDiagonallyDominantDualConeMatrixConstraint(self._psd_matrix(constraint))


# What the calls take, and the constraints that they make of it.


def _lorentz_of_expressions(
    v: np.ndarray, eval_type: LorentzConeConstraint.EvalType
) -> BindingBase[LorentzConeConstraint]:
    a = coefficients.affine_vector(list(v.ravel()), "AddLorentzConeConstraint")
    return parse.lorentz(a.A, a.c, a.vars, eval_type)


def _lorentz_of_squares(
    linear: Expression, quadratic: Expression, tol: float, eval_type: LorentzConeConstraint.EvalType
) -> BindingBase[LorentzConeConstraint]:
    M, b, x = _stack([linear], *quadratic_factor(quadratic, tol))
    return parse.lorentz(M, b, x, eval_type)


def _rotated_of_expressions(v: np.ndarray) -> BindingBase[RotatedLorentzConeConstraint]:
    a = coefficients.affine_vector(list(v.ravel()), "AddRotatedLorentzConeConstraint")
    return parse.rotated_lorentz(a.A, a.c, a.vars)


def _rotated_of_squares(
    first: Expression, second: Expression, quadratic: Expression, tol: float
) -> BindingBase[RotatedLorentzConeConstraint]:
    M, b, x = _stack([first, second], *quadratic_factor(quadratic, tol))
    return parse.rotated_lorentz(M, b, x)


def _exponential(A: Matrix, b: np.ndarray, vars: np.ndarray) -> BindingBase[ExponentialConeConstraint]:
    return bind(ExponentialConeConstraint, ExponentialConeConstraint(A, b), vars)


def _exponential_of_expressions(z: np.ndarray) -> BindingBase[ExponentialConeConstraint]:
    a = coefficients.affine_vector(list(z.ravel()), "AddExponentialConeConstraint")
    return _exponential(a.A, a.c, a.vars)


def _inequality(F: Sequence[Matrix], vars: np.ndarray) -> BindingBase[LinearMatrixInequalityConstraint]:
    return bind(LinearMatrixInequalityConstraint, LinearMatrixInequalityConstraint(F), vars)


def _inequality_of_expressions(X: np.ndarray) -> BindingBase[LinearMatrixInequalityConstraint]:
    X = _square("AddLinearMatrixInequalityConstraint", X)
    _check_symmetric(X)
    a = coefficients.affine_vector(list(X.ravel()), "AddLinearMatrixInequalityConstraint")
    F = [a.c.reshape(X.shape), *(column.reshape(X.shape) for column in a.A.T)]
    return _inequality(F, a.vars)


def _matrices(value: Iterable[ArrayLike]) -> list[Matrix]:
    if isinstance(value, np.ndarray) and value.ndim != 3:
        raise Mismatch
    return [kinds.matrix(f) for f in instance_of(list, tuple, np.ndarray)(value)]


def _square(call: str, X: np.ndarray) -> np.ndarray:
    X = kinds.expressions(X)
    X = X[:, None] if X.ndim == 1 else X  # a vector is a column
    if X.ndim != 2 or X.shape[0] != X.shape[1]:
        raise RuntimeError(f"{call}(): the matrix must be square, it has shape {X.shape}.")
    return X


def _check_symmetric(X: np.ndarray) -> None:
    for i, j in np.ndindex(X.shape):
        if i < j and X[i, j] is not X[j, i]:
            difference = coefficients.coefficients(X[i, j] - X[j, i])
            if difference is None or max(np.abs(difference.b).max(initial=0.0), abs(difference.c)) > 1e-10:
                raise RuntimeError(
                    f"The matrix is not symmetric: element ({i}, {j}) is {X[i, j]}, ({j}, {i}) is {X[j, i]}."
                )


def _symmetrized(X: np.ndarray) -> np.ndarray:
    return np.array(
        [[X[i, j] if X[i, j] is X[j, i] else (X[i, j] + X[j, i]) / 2.0 for j in range(len(X))] for i in range(len(X))],
        dtype=object,
    )


def _variables(part: np.ndarray) -> np.ndarray:
    """A matrix of expressions that are variables as variables; no variable in particular where one is a number."""
    out = np.full(part.shape, Variable("𝑥"))
    for at, e in np.ndenumerate(part):
        if e.GetVariables().size():
            (out[at],) = e.GetVariables()
    return out


def _sum(items: list[Expression]) -> Expression:
    return build.sum_of(items)


_EVAL_TYPE = (instance_of(LorentzConeConstraint.EvalType), _SMOOTH)
_TOLERANCE = (kinds.number, 1e-8)
_LORENTZ = Ways(
    [
        overload(
            parse.lorentz_from_formula,
            f=kinds.formula,
            eval_type=_EVAL_TYPE,
            psd_tol=_TOLERANCE,
            coefficient_tol=_TOLERANCE,
        ),
        overload(_lorentz_of_expressions, v=kinds.expressions, eval_type=_EVAL_TYPE),
        overload(
            _lorentz_of_squares,
            linear_expression=kinds.expression,
            quadratic_expression=kinds.expression,
            tol=(kinds.number, 0.0),
            eval_type=_EVAL_TYPE,
        ),
        overload(parse.lorentz, A=kinds.matrix, b=kinds.vector, vars=kinds.vars, eval_type=_EVAL_TYPE),
    ]
)
_ROTATED_LORENTZ = Ways(
    [
        overload(
            _rotated_of_squares,
            linear_expression1=kinds.expression,
            linear_expression2=kinds.expression,
            quadratic_expression=kinds.expression,
            tol=(kinds.number, 0.0),
        ),
        overload(_rotated_of_expressions, v=kinds.expressions),
        overload(parse.rotated_lorentz, A=kinds.matrix, b=kinds.vector, vars=kinds.vars),
    ]
)
_EXPONENTIAL = Ways(
    [
        overload(_exponential, A=kinds.matrix, b=kinds.vector, vars=kinds.vars),
        overload(_exponential_of_expressions, z=kinds.expressions),
    ]
)
_INEQUALITY = Ways(
    [
        overload(_inequality, F=_matrices, vars=kinds.vars),
        overload(_inequality_of_expressions, X=kinds.expressions),
    ]
)
