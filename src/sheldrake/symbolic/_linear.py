"""Linear, affine and quadratic expressions as matrices, and arrays of expressions at once."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._kinds import anything
from sheldrake.common._overloads import Mismatch, expect, overload, overloaded
from sheldrake.symbolic import _build, _decompose, _differentiate, _traverse
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._arguments import by_variable, expression, variable
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._keys import age
from sheldrake.symbolic._polynomial import Polynomial
from sheldrake.symbolic._traverse import object_array, variables_of
from sheldrake.symbolic._variable import Variable, Variables

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sheldrake.common import RandomGenerator
    from sheldrake.common._types import Symbolic, Symbolics


def _flat(call: str, expressions: Symbolics) -> list[Expression]:
    if expressions.__class__ is Expression:
        return [expressions]  # type: ignore[list-item]
    items = np.asarray(expressions, dtype=object).ravel().tolist()
    return [e if e.__class__ is Expression else _build.expect(call, e) for e in items]


def _sorted(variables: Iterable[Variable]) -> list[Variable]:
    return sorted(variables, key=age)


# Arrays of expressions


def _as_matrix(call: str, m: Symbolics) -> np.ndarray:
    array = np.asarray(m, dtype=object)
    if array.ndim == 1:
        array = array.reshape(-1, 1)
    if array.ndim != 2:
        raise Mismatch(f"{call}(): incompatible function arguments; expected a vector or a matrix, got {m!r}.")
    return array


def Evaluate(
    m: Symbolics, env: Mapping[Variable, float] | None = None, generator: RandomGenerator | None = None
) -> np.ndarray:
    """Returns the values of a matrix of expressions, shape `(rows, cols)`; see `Expression.Evaluate`."""
    matrix = _as_matrix("Evaluate", m)
    polynomials = [isinstance(e, Polynomial) for e in matrix.flat]
    if any(polynomials):
        return np.array([e.Evaluate(env or {}) for e in matrix.flat]).reshape(matrix.shape)
    return np.array(_traverse.evaluate(_flat("Evaluate", matrix), env, generator), dtype=float).reshape(matrix.shape)


@overloaded(
    overload(m=anything, subst=by_variable),
    overload(m=anything, var=variable, e=anything),
    overload(e=anything, subs=by_variable),
    overload(m=anything, subs=by_variable),
)
def Substitute(m: Any, places: Any, e: Any = None) -> Any:
    """Returns expressions with others in the place of variables.

    Called as `Substitute(m, {var: e})` or `Substitute(m, var, e)` with a matrix of expressions; or with a dict of
    variables to `SinCos`, to put variables for sine and cosine in the place of angles.
    """
    from sheldrake.symbolic import _sin_cos

    if e is None and any(isinstance(v, _sin_cos.SinCos) for v in places.values()):
        return _sin_cos.substitute(m, places)
    matrix = _as_matrix("Substitute", m)
    found = _traverse.substitute(_flat("Substitute", matrix), _traverse.substitution("Substitute", places, e))
    return object_array(found, matrix.shape)


def Jacobian(f: Symbolics, vars: Symbolics) -> np.ndarray:
    """Returns the partial derivatives of expressions, or of polynomials, by variables, shape `(len(f), len(vars))`."""
    functions, variables = list(np.asarray(f, dtype=object).ravel()), _traverse.variable_list("Jacobian", vars)
    out = np.empty((len(functions), len(variables)), dtype=object)
    if functions and isinstance(functions[0], Polynomial):
        for i, p in enumerate(functions):
            out[i] = p.Jacobian(variables)
        return out
    expressions = [_build.expect("Jacobian", e) for e in functions]
    for i, row in enumerate(_differentiate.jacobian(expressions, variables)):
        out[i] = row
    return out


def IsAffine(m: Symbolics, vars: Variables | None = None) -> bool:
    """Tells whether all expressions are affine in some variables; in all of theirs, if none are named."""
    return all(_is_affine(e, vars) for e in _flat("IsAffine", m))


def _is_affine(e: Expression, vars: Variables | None) -> bool:
    try:
        found = _decompose.decompose(e, set(variables_of(e)) if vars is None else set(vars))
    except RuntimeError:
        return False
    return all(m.total_degree() <= 1 for m in found)


def GetVariableVector(expressions: Symbolics) -> np.ndarray:
    """Returns the variables that the expressions are.

    Raises:
        RuntimeError: an expression is no variable.
    """
    out = []
    for e in _flat("GetVariableVector", expressions):
        if e._kind != k.VAR:
            raise RuntimeError(f"{e} is not a variable.")
        out.append(e._args[0])
    return object_array(out)


@overloaded(overload(e=expression), overload(expressions=anything))
def ExtractVariablesFromExpression(expressions: Symbolics) -> tuple[np.ndarray, dict[int, int]]:
    """Returns the variables of one or several expressions, and their places in that vector by identity number."""
    wanted = _sorted(set().union(*map(variables_of, _flat("ExtractVariablesFromExpression", expressions))))
    return object_array(wanted), {v._id: i for i, v in enumerate(wanted)}


# Linear and affine


def DecomposeAffineExpression(e: Symbolic | None, map_var_to_index: dict[int, int]) -> tuple[np.ndarray, float]:
    """Returns coefficients, shape `(n,)`, and constant of an affine expression.

    Args:
        e: The expression.
        map_var_to_index: Place of each variable, by its identity number.

    Raises:
        RuntimeError: it is not affine, or has a variable without a place.
    """
    e = _build.expect("DecomposeAffineExpression", e)
    places = {v: map_var_to_index[v._id] for v in variables_of(e) if v._id in map_var_to_index}
    row = np.zeros(len(map_var_to_index))
    constant = _decompose.affine_into(row, e, places)
    return row, constant


def _coefficient_rows(call: str, expressions: Symbolics, vars: list[Variable]) -> tuple[np.ndarray, np.ndarray]:
    es = _flat(call, expressions)
    A, b = np.zeros((len(es), len(vars))), np.zeros(len(es))
    places = {v: i for i, v in enumerate(vars)}
    for i, e in enumerate(es):
        linear = _decompose.linear_terms(e)
        if linear is not None:
            terms, constant = linear
            columns = [places.get(v, -1) for v, _ in terms]
            if -1 not in columns:
                A[i, columns] = [c for _, c in terms]
                b[i] = constant
                continue
        try:
            found = _decompose.decompose(e, set(vars))
        except RuntimeError:
            raise _non_linear(e, vars) from None
        for m, c in found.items():
            if m.total_degree() > 1:
                raise _non_linear(e, vars)
            if c._kind != k.CONSTANT:
                raise RuntimeError(f"While decomposing an expression, we detected a non-constant expression: {c}.")
            if m.total_degree() == 0:
                b[i] = c._args[0]
            else:
                A[i, places[next(iter(m._powers))]] = c._args[0]
    return A, b


def _non_linear(e: Expression, vars: list[Variable]) -> RuntimeError:
    names = " ".join(v.get_name() for v in vars)
    return RuntimeError(
        f"While decomposing an expression, we detected a non-linear expression: {e} of indeterminates {names}."
    )


def DecomposeLinearExpressions(expressions: Symbolics, vars: Symbolics) -> np.ndarray:
    """Returns M with `expressions = M @ vars`, shape `(m, n)`.

    Raises:
        RuntimeError: an expression is not linear in the variables, with numbers as coefficients.
    """
    variables = _traverse.variable_list("DecomposeLinearExpressions", vars)
    A, b = _coefficient_rows("DecomposeLinearExpressions", expressions, variables)
    for e, constant in zip(_flat("DecomposeLinearExpressions", expressions), b):
        if constant != 0.0:
            raise RuntimeError(
                f"{_non_linear(e, variables).args[0][:-1]}, with a constant term {constant:g}. This is an affine "
                "expression; a linear should have no constant terms."
            )
    return A


def DecomposeAffineExpressions(expressions: Any = None, vars: Any = None, *, v: Any = None) -> tuple:
    """Returns A and b with `expressions = A @ vars + b`; without `vars` also the variables there are.

    Raises:
        RuntimeError: an expression is not affine in the variables, with numbers as coefficients.
    """
    expressions = v if expressions is None else expressions
    if vars is not None:
        variables = _traverse.variable_list("DecomposeAffineExpressions", vars)
        return _coefficient_rows("DecomposeAffineExpressions", expressions, variables)
    es = _flat("DecomposeAffineExpressions", expressions)
    variables = _sorted(set().union(*(variables_of(e) for e in es)))
    return (*_coefficient_rows("DecomposeAffineExpressions", es, variables), object_array(variables))


# Quadratic


def DecomposeQuadraticPolynomial(
    poly: Polynomial, map_var_to_index: dict[int, int]
) -> tuple[np.ndarray, np.ndarray, float]:
    """Returns Q, b, c with `poly = 0.5 x' Q x + b' x + c`, Q symmetric.

    Args:
        poly: A polynomial with numbers as coefficients.
        map_var_to_index: Place of each variable in x, by its identity number.

    Raises:
        RuntimeError: the degree is above two, a coefficient is no number, or a variable has no place.
    """
    expect("DecomposeQuadraticPolynomial", poly, Polynomial)
    if missing := [v for v in poly.indeterminates() if v.get_id() not in map_var_to_index]:
        raise RuntimeError(
            f"DecomposeQuadraticPolynomial(): {missing[0]} of {poly} has no place in the map of indices."
        )
    n = len(map_var_to_index)
    Q, b, c = np.zeros((n, n)), np.zeros(n), 0.0
    keys = poly._keys
    for key, coefficient in poly._part.items():
        value = coefficient if coefficient.__class__ is float else coefficient.Evaluate()
        if keys.degree(key) > 2:
            m = keys.monomial(key)
            raise RuntimeError(f"{m} has order higher than 2 and it cannot be handled by DecomposeQuadraticPolynomial.")
        at = [map_var_to_index[v.get_id()] for v, exponent in keys.powers(key) for _ in range(exponent)]
        if len(at) == 2:
            Q[at[0], at[1]] += value
            Q[at[1], at[0]] += value
        elif at:
            b[at[0]] += value
        else:
            c += value
    return Q, b, c


def DecomposeL2NormExpression(
    e: Symbolic | None, psd_tol: float = 1e-8, coefficient_tol: float = 1e-8
) -> tuple[bool, np.ndarray, np.ndarray, np.ndarray]:
    """Returns whether e is the norm of an affine vector, and then A, b, x with `e = |A x + b|`.

    Args:
        e: The expression.
        psd_tol: Eigenvalues of the quadratic form above minus this count as not negative.
        coefficient_tol: Largest error of a coefficient of the square.
    """
    e = _build.expect("DecomposeL2NormExpression", e)
    if not (psd_tol >= 0.0 and coefficient_tol >= 0.0):
        raise RuntimeError(
            "DecomposeL2NormExpression(): psd_tol and coefficient_tol must not be negative, got "
            f"{psd_tol} and {coefficient_tol}."
        )
    none = (False, np.zeros((0, 0)), np.zeros(0), np.empty(0, dtype=object))
    if e._kind != k.SQRT:
        return none
    try:
        poly = Polynomial(e._args[0])
    except RuntimeError:
        return none
    if poly.TotalDegree() != 2:
        return none
    x, places = ExtractVariablesFromExpression(e)
    Q, linear, c = DecomposeQuadraticPolynomial(poly, places)
    found = _root_and_shift(Q / 2.0, linear / 2.0, psd_tol)
    if found is None:
        return none
    A, b = found
    if np.abs(2.0 * b.dot(A) - linear).max() > coefficient_tol or abs(b.dot(b) - c) > coefficient_tol:
        return none
    return True, A, b, x


def _root_and_shift(M: np.ndarray, r: np.ndarray, psd_tol: float) -> tuple[np.ndarray, np.ndarray] | None:
    """A with A' A = M, Cholesky's factor where there is one, and b with A' b = r, as near as may be.

    None if an eigenvalue of M is less than minus the tolerance.
    """
    try:
        L = np.linalg.cholesky(M)
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(M)
        if values.min() < -psd_tol:
            return None
        keep = values > 1e-12 * max(1.0, values.max())
        roots, axes = np.sqrt(values[keep]), vectors[:, keep]
        return (axes * roots).T, axes.T.dot(r) / roots
    return L.T, np.linalg.solve(L, r)


def ReplaceBilinearTerms(e: Symbolic | None, x: Symbolics, y: Symbolics, W: Symbolics) -> Expression:
    """Returns e with W[i, j] in the place of each product of x[i] and y[j].

    Raises:
        RuntimeError: shapes do not fit, or a term has a higher degree in x and y.
    """
    xs, ys = (_traverse.variable_list("ReplaceBilinearTerms", v) for v in (x, y))
    products = np.asarray(W, dtype=object)
    if products.ndim != 2 or products.shape[0] < len(xs) or products.shape[1] < len(ys):
        raise RuntimeError(f"ReplaceBilinearTerms(): W must be {len(xs)} x {len(ys)}, it is {products.shape}.")
    rows, cols = {v: i for i, v in enumerate(xs)}, {v: j for j, v in enumerate(ys)}
    terms = []
    for m, c in _decompose.decompose(_build.expect("ReplaceBilinearTerms", e), {*xs, *ys}).items():
        factors = [v for v, n in m._powers.items() for _ in range(n)]
        if len(factors) > 2:
            raise RuntimeError(f"The term {m} has degree larger than 2 on the variables")
        replaced = m.ToExpression()
        if len(factors) == 2:
            a, b = factors
            a, b = (a, b) if a in rows and b in cols else (b, a)
            if a in rows and b in cols:
                replaced = _build.expect("ReplaceBilinearTerms", products[rows[a], cols[b]])
            else:
                raise RuntimeError(f"The term {m} is not a product of a variable of x and one of y.")
        terms.append(_build.multiply(c, replaced))
    return _build.sum_of(terms)


def TaylorExpand(f: Symbolics, a: dict[Variable, float], order: int) -> Expression:
    """Returns the Taylor polynomial of f about a point, of total degree `order` in the variables of that point.

    Raises:
        RuntimeError: the order is less than one.
    """
    e = _build.expect("TaylorExpand", f)
    if order < 1:
        raise RuntimeError(f"TaylorExpand(): the order must be at least one, got {order}.")
    point = _traverse.numbers_by_variable("TaylorExpand", a)
    variables = _sorted(point)
    shifts = [v - point[v] for v in variables]
    layer = {(0,) * len(variables): e}
    derivatives = dict(layer)
    for _ in range(order):
        layer = _next_layer(layer, variables)
        derivatives.update(layer)
    terms = []
    for powers, term in zip(derivatives, _traverse.substitute(derivatives.values(), point)):
        for shift, p in zip(shifts, powers):
            term = _build.multiply(term, _build.power(shift, _build.constant(p)))
        terms.append(_build.divide(term, _build.constant(math.prod(map(math.factorial, powers)))))
    return _build.sum_of(terms)


_Derivatives = dict[tuple[int, ...], Expression]


def _next_layer(layer: _Derivatives, variables: list[Variable]) -> _Derivatives:
    """Derivatives of one order more; those of equal powers once."""
    out: _Derivatives = {}
    for powers, slopes in zip(layer, _differentiate.jacobian(list(layer.values()), variables)):
        for i, slope in enumerate(slopes):
            out.setdefault((*powers[:i], powers[i] + 1, *powers[i + 1 :]), slope)
    return out


def DecomposeLumpedParameters(f: Symbolics, parameters: Symbolics) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns W, alpha, w0 with `f = W @ alpha + w0`, alpha in the parameters alone, W and w0 free of them.

    Args:
        f: Expressions, shape `(m,)`.
        parameters: Variables.

    Raises:
        RuntimeError: a factor mixes parameters with other variables.
    """
    from sheldrake.symbolic._lumped import lumped

    return lumped(_flat("DecomposeLumpedParameters", f), set(_traverse.variable_list("parameters", parameters)))
