import numpy as np
import pytest

from sheldrake import symbolic as sym
from sheldrake.symbolic import Expression, Monomial, Polynomial, RationalFunction, SinCos, Variable, Variables

x, y, z = (Variable(name) for name in "xyz")
Type = sym.SinCosSubstitutionType


def texts(array):
    return [str(m) for m in array]


def test_monomials():
    m = Monomial({x: 2, y: 1})
    assert str(m) == "x^2 * y" and m.total_degree() == 3 and m.degree(x) == 2 and m.get_powers() == {x: 2, y: 1}
    assert m == Monomial([x, y], [2, 1]) == Monomial(x, 2) * Monomial(y) and hash(m) == hash(
        Monomial(x, 2) * Monomial(y)
    )
    assert str(Monomial()) == "1" and str(m**2) == "x^4 * y^2" and str(m.ToExpression()) == "(pow(x, 2) * y)"
    assert m.Evaluate({x: 2.0, y: 3.0}) == 12.0 and m.EvaluatePartial({x: 3.0}) == (9.0, Monomial(y))
    assert m.Evaluate([x, y], [[1.0, 2.0], [3.0, 4.0]]).tolist() == [3.0, 16.0]
    for wrong in (lambda: Monomial(x, -1), lambda: m**-1, lambda: m.Evaluate({x: 1.0})):
        with pytest.raises(RuntimeError):
            wrong()
    with pytest.raises(TypeError):
        Monomial({x: 1.5})


def test_bases_of_monomials():
    v = Variables([x, y])
    assert texts(sym.MonomialBasis(v, 2)) == ["y^2", "x * y", "x^2", "y", "x", "1"]
    assert texts(sym.EvenDegreeMonomialBasis(v, 2)) == ["y^2", "x * y", "x^2", "1"]
    assert texts(sym.OddDegreeMonomialBasis(v, 1)) == ["y", "x"]
    assert texts(sym.CalcMonomialBasisOrderUpToOne(v)) == ["1", "y", "x", "x * y"]
    assert texts(sym.MonomialBasis({Variables([x]): 1, Variables([y]): 1})) == ["x * y", "y", "x", "1"]
    n = len(sym.MonomialBasis([x, y, z], 4))
    assert n == 35  # binomial(3 + 4, 4)


def test_polynomials_are_a_ring():
    rng = np.random.default_rng(5)
    at = {x: 0.3, y: -0.7, z: 1.1}

    def random():
        basis = sym.MonomialBasis([x, y], 3)
        return Polynomial({m: Expression(c) + z for m, c in zip(basis, rng.normal(size=len(basis)))})

    p, q = random(), random()
    a, b = p.Evaluate(at), q.Evaluate(at)
    for made, expected in (
        (p + q, a + b), (p - q, a - b), (p * q, a * b), (p * 2.5 + 1, 2.5 * a + 1), (1 - p, 1 - a), (-p, -a),
        (p / 4, a / 4), (p**3, a**3), (p * x, a * 0.3), (p + Monomial(y), a - 0.7), (p - z, a - 1.1),
    ):  # fmt: skip
        assert made.Evaluate(at) == pytest.approx(expected, rel=1e-12), made
    assert (p - p).EqualTo(Polynomial()) and str(p == p) == "True" and str(p == p + 1) == "False"
    assert p.indeterminates() == Variables([x, y]) and p.decision_variables() == Variables([z])
    assert p.ToExpression().Evaluate(at) == pytest.approx(a) and p.TotalDegree() == 3 and p.Degree(x) == 3
    for v in (x, y, z):
        assert p.Differentiate(v).Evaluate(at) == pytest.approx(p.ToExpression().Differentiate(v).Evaluate(at))
    assert p.Integrate(x).Differentiate(x).CoefficientsAlmostEqual(p, 1e-12)
    swapped = p.SubstituteAndExpand({x: Polynomial(y + 1), y: Polynomial(x * y)})
    assert swapped.Evaluate({x: 0.3, y: -0.7, z: 1.1}) == pytest.approx(p.Evaluate({x: 0.3, y: -0.21, z: 1.1}))


def test_polynomials_from_expressions():
    p = Polynomial(x * (y + 1) ** 2 + z, [x])
    assert str(p) == "z*1 + (1 + 2 * y + pow(y, 2))*x"
    assert str(Polynomial((x + y) / 2)) == "0.5*y + 0.5*x" and str(Polynomial()) == "0"
    for wrong in (sym.sin(x), x / y, x**y, x**-1, sym.abs(x)):
        with pytest.raises(RuntimeError):
            Polynomial(wrong)
    assert str(Polynomial(sym.sin(y) * x, [x])) == "sin(y)*x"
    p.SetIndeterminates(Variables([y]))
    assert str(p) == "(x + z)*1 + (2 * x)*y + x*y^2"
    with pytest.raises(TypeError):
        Polynomial("x")


def test_values_and_roots():
    p = Polynomial(x**2 * y - 3 * y + z * x, [x, y])
    assert str(p.EvaluatePartial({z: 2.0})) == "-3*y + 2*x + 1*x^2 * y"
    assert Polynomial(x * y + x).EvaluateIndeterminates([x, y], [[1.0, 2.0], [3.0, 4.0]]).tolist() == [4.0, 10.0]
    A, v, b = Polynomial((y + 2) * x + 2 * z - 1, [x]).EvaluateWithAffineCoefficients([x], [[1.0, 2.0]])
    assert A.tolist() == [[1, 2], [2, 2]] and b.tolist() == [1, 3] and texts(v) == ["y", "z"]
    np.testing.assert_allclose(Polynomial(x**4 - 5 * x**2 + 4).Roots(), [2, -2, 1, -1])
    with pytest.raises(RuntimeError, match="univariate"):
        p.Roots()
    basis = sym.MonomialBasis([x, y], 1)
    gram = sym.CalcPolynomialWLowerTriangularPart(basis, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    Q = np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]])
    m = np.array([0.5, -2.0, 1.0])
    assert gram.Evaluate({y: 0.5, x: -2.0}) == pytest.approx(m @ Q @ m)


def test_rational_functions():
    r = RationalFunction(Polynomial(x), Polynomial(y + 1))
    at = {x: 3.0, y: 0.5}
    for made, expected in (
        (r + r, 4.0), (r * r, 4.0), (r / r, 1.0), (1 - r, -1.0), (2 / r, 1.0), (r * Monomial(x), 6.0), (-r, -2.0),
        (Polynomial(x) / r, 1.5),
    ):  # fmt: skip
        assert made.Evaluate(at) == pytest.approx(expected), made
    assert (
        str(r) == "(1*x) / (1*1 + 1*y)"
        and str(r == RationalFunction(Polynomial(2 * x), Polynomial(2 * y + 2))) == "True"
    )
    for wrong in (lambda: r / 0, lambda: RationalFunction(Polynomial(x), Polynomial())):
        with pytest.raises(RuntimeError):
            wrong()


def test_linear_algebra_of_expressions():
    np.testing.assert_array_equal(sym.DecomposeLinearExpressions([x + y, 2 * x], [x, y]), [[1, 1], [2, 0]])
    A, b = sym.DecomposeAffineExpressions([x + y + 1, 2 * x], [x, y])
    assert A.tolist() == [[1, 1], [2, 0]] and b.tolist() == [1, 0]
    with pytest.raises(RuntimeError, match="constant term"):
        sym.DecomposeLinearExpressions([x + 1], [x])
    with pytest.raises(RuntimeError, match="non-linear"):
        sym.DecomposeAffineExpressions([x * y], [x, y])
    Q, b, c = sym.DecomposeQuadraticPolynomial(Polynomial(x * x + 2 * x * y + y + 1), {x.get_id(): 0, y.get_id(): 1})
    assert Q.tolist() == [[2, 2], [2, 0]] and b.tolist() == [0, 1] and c == 1
    good, A, b, v = sym.DecomposeL2NormExpression(sym.sqrt((x + 1) ** 2 + 4 * (y - 2) ** 2))
    assert good and np.linalg.norm(A @ [0.3, 0.9] + b) == pytest.approx(np.hypot(1.3, 2 * -1.1)) and len(v) == 2
    assert not sym.DecomposeL2NormExpression(x + y)[0]
    W, alpha, w0 = sym.DecomposeLumpedParameters([x * y + 1 + y * y, x * x * z + sym.sin(x) * y * 3], [y, z])
    assert texts(alpha) == ["y", "z", "pow(y, 2)"] and texts(W[1]) == ["(3 * sin(x))", "pow(x, 2)", "0"]
    assert texts(w0) == ["1", "0"]
    assert str(sym.ReplaceBilinearTerms(x * y + 2, [x], [y], [[z]])) == "(2 + z)"
    assert sym.IsAffine(np.array([[x * y + 1]]), Variables([x])) and not sym.IsAffine(np.array([[x * y + 1]]))
    np.testing.assert_allclose(sym.Evaluate(np.array([x + y, x * y]), {x: 2.0, y: 3.0}), [[5.0], [6.0]])
    assert texts(sym.Jacobian([x + y, x * y], [x, y]).ravel()) == ["1", "1", "y", "x"]
    assert texts(sym.Substitute(np.array([x + y]), x, y * 1)[0]) == ["(2 * y)"]


def test_taylor_series_converge():
    f = sym.exp(x) * sym.cos(y)
    series = sym.TaylorExpand(f, {x: 0.0, y: 0.0}, 4)
    for h in (0.1, 0.05):
        error = abs(series.Evaluate({x: h, y: h}) - f.Evaluate({x: h, y: h}))
        assert error < h**5
    assert str(sym.TaylorExpand(x * y, {x: 1.0, y: 1.0}, 1)) == "(-1 + x + y)"


@pytest.mark.parametrize("kind", list(Type))
def test_sines_and_cosines_as_variables(kind):
    s, c, q = Variable("s"), Variable("c"), 0.7
    angle = q if kind is Type.kAngle else q / 2
    values = {s: np.sin(angle), c: np.cos(angle), x: 0.4}
    exprs = [sym.sin(z), sym.cos(3 * z), sym.sin(z + x) * x, sym.cos(-2 * z - x), sym.tan(z), sym.exp(sym.sin(z))]
    if kind is not Type.kAngle:
        exprs.append(sym.sin(0.5 * z) + sym.cos(-z / 2))
    for e in exprs:
        new = sym.Substitute(e, {z: SinCos(s, c, kind)})
        assert z not in new.GetVariables()
        assert new.Evaluate(values) == pytest.approx(e.Evaluate({z: q, x: 0.4}), rel=1e-12), e
    with pytest.raises(RuntimeError, match="integer"):
        sym.Substitute(sym.sin(z * x), {z: SinCos(s, c, kind)})
    with pytest.raises(RuntimeError, match="integer"):
        sym.Substitute(sym.sin(0.3 * z), {z: SinCos(s, c, kind)})


def test_stereographic_projection():
    s, c, t = Variable("s"), Variable("c"), Variable("t")
    p = Polynomial(s * c + s + z)
    r = sym.SubstituteStereographicProjection(p, [SinCos(s, c)], [t])
    q = 0.9
    expected = np.sin(q) * np.cos(q) + np.sin(q) + 0.3
    assert r.Evaluate({t: np.tan(q / 2), z: 0.3}) == pytest.approx(expected)


def test_latex():
    assert sym.ToLatex(x * y / 2 + sym.sin(x) + x**2) == r"(\frac{x y}{2} + x^{2} + \sin{x})"
    assert sym.ToLatex(sym.logical_not(sym.logical_and(x > y, x > 1))) == r"x \le 1 \lor x \le y"
    assert sym.ToLatex(1.23456 * x, 2) == "1.23 x" and sym.ToLatex(np.array([[1.0, 2.5]])) == (
        r"\begin{bmatrix} 1 & 2.500 \end{bmatrix}"
    )
    assert sym.ToLatex(sym.MakeMatrixVariable(1, 2, "q")[0, 1]) == "q_{0, 1}"
    with pytest.raises(RuntimeError):
        sym.ToLatex(sym.uninterpreted_function("f", [x]))


def test_sympy_and_back():
    sympy = pytest.importorskip("sympy")
    e = x * y + sym.sin(x) ** 2 / 3 + sym.if_then_else(x > y, sym.exp(x), sym.max(x, 2 * y)) - sym.atan2(x, y)
    memo = {}
    there = sym.to_sympy(e, memo=memo)
    back = sym.from_sympy(there, memo=memo)
    for at in ({x: 0.3, y: 0.9}, {x: 1.3, y: -0.9}):
        assert back.Evaluate(at) == pytest.approx(e.Evaluate(at))
        assert float(there.subs({memo[v.get_id()]: value for v, value in at.items()})) == pytest.approx(e.Evaluate(at))
    f = sym.logical_or(x > y, sym.logical_not(x >= 2))
    assert sym.from_sympy(sym.to_sympy(f, memo=memo), memo=memo).Evaluate({x: 3.0, y: 4.0}) is False
    assert sym.from_sympy(sympy.pi) == pytest.approx(np.pi) and sym.to_sympy(2.5) == 2.5
    for wrong in (
        lambda: sym.from_sympy(sympy.Symbol("q")),
        lambda: sym.to_sympy("a"),
        lambda: sym.to_sympy(sym.isnan(x)),
    ):
        with pytest.raises(NotImplementedError):
            wrong()


@pytest.mark.parametrize("n", [3, 34])
def test_products_of_few_and_of_many_variables(n):
    v = sym.MakeVectorContinuousVariable(n, "v")
    a = Variable("a")
    e = (sum(v[1:]) + a * v[0]) * (v[0] - 2.0 * v[1]) ** 3
    values = dict(zip(v, np.linspace(-1.0, 2.0, n))) | {a: 0.7}
    exact = e.Evaluate(values)
    p = Polynomial(e, Variables(v))
    q = Polynomial(v[0] - 2.0 * v[1])
    assert p.TotalDegree() == 4 and len(p.monomial_to_coefficient_map()) == len((p * 1.0).monomial_to_coefficient_map())
    for same in (p, Polynomial(e.Expand()), Polynomial(sum(v[1:]) + a * v[0], Variables(v)) * q**3):
        assert same.Evaluate(values) == pytest.approx(exact, rel=1e-12)
    shifted = p.SubstituteAndExpand({x: Polynomial(x + 1.0) for x in v})
    back = {x: value - 1.0 for x, value in values.items()} | {a: 0.7}
    assert shifted.Evaluate(back) == pytest.approx(exact, rel=1e-9)


def test_exponents_as_high_as_they_come():
    p = Polynomial(x**1_000_000 * y**3) ** 1000
    assert p.Degree(x) == 10**9 and p.Degree(y) == 3000 and (p * p).TotalDegree() == 2 * (10**9 + 3000)


def test_lumped_parameters_that_come_twice_count_twice():
    x, y, m, l = (sym.Variable(name) for name in "xyml")
    f = [x * (m + l) + y * m * l - x * x * m * l, m * l * sym.sin(x) + y * m * l * l + 2.0 * m * l + x]
    W, alpha, w0 = sym.DecomposeLumpedParameters(f, [m, l])
    assert len(alpha) == 3
    at = {x: 0.3, y: 0.4, m: 0.5, l: 0.6}
    for given, again in zip(f, W @ alpha + w0):
        assert again.Evaluate(at) == pytest.approx(given.Evaluate(at), abs=1e-14)


def test_monomials_of_a_polynomial_are_copies():
    p = Polynomial(3 * x * y + 1)
    for m in p.monomial_to_coefficient_map():
        m.pow_in_place(2)
    assert str(p) == "1*1 + 3*x * y" and p.Evaluate({x: 2.0, y: 5.0}) == 31.0


@pytest.mark.parametrize("n", [3, 40])
def test_indeterminates_and_decision_variables_stay_when_terms_cancel(n):
    v, a = sym.MakeVectorVariable(n, "v"), Variable("a")
    p = Polynomial(a * v[0] ** 2 + v[1], Variables(v))
    assert p.indeterminates() == Variables(v) and (p - p).indeterminates() == Variables(v)
    assert (p - p).decision_variables() == Variables([a]) and (p - p).EqualTo(Polynomial())
    assert p.Differentiate(v[0]).indeterminates() == Variables([v[0]])
    q = Polynomial(v[0]) * 2.0 + Polynomial(v[-1] ** 3)
    assert (p.Differentiate(v[0]) + q).indeterminates() == Variables([v[0], v[-1]]) and q.TotalDegree() == 3
    q.SetIndeterminates(Variables(v[[0, 2, -1]]))
    assert q.indeterminates() == Variables(v[[0, 2, -1]]) and str(q) == f"1*{v[-1]}^3 + 2*{v[0]}"


def test_keys_of_monomials_are_in_their_order():
    v = sym.MakeVectorVariable(3, "v")
    basis = sym.MonomialBasis(Variables(v), 4)
    p = Polynomial({m: float(i + 1) for i, m in enumerate(basis)})
    found = list(p.monomial_to_coefficient_map())
    assert [m.get_powers() for m in found] == [m.get_powers() for m in sorted(basis, key=Monomial._key)]
    assert p.TotalDegree() == 4 and not p.IsEven() and not p.IsOdd()


def test_definite_integral_is_the_difference_of_the_other():
    x, y, a = (Variable(name) for name in "xya")
    p = Polynomial(a * x**3 * y + 2.5 * x**2 - x * y + 7.0, Variables([x, y]))
    definite, whole = p.Integrate(x, -0.5, 2.0), p.Integrate(x)
    assert definite.CoefficientsAlmostEqual(whole.EvaluatePartial(x, 2.0) - whole.EvaluatePartial(x, -0.5), 1e-14)
    assert Polynomial(x**3).Integrate(x, -1.0, 1.0).monomial_to_coefficient_map() == {}


@pytest.mark.parametrize("count", [3, 40])
def test_values_at_many_points_are_those_at_each(count):
    x = sym.MakeVectorContinuousVariable(count, "x")
    p = Polynomial(2.0 * x[0] ** 3 * x[2] - x[1] ** 2 + 0.5 + sum(0.1 * v for v in x))
    points = np.random.default_rng(2).normal(size=(count, 5))
    each = [p.Evaluate(dict(zip(x, point))) for point in points.T]
    np.testing.assert_allclose(p.EvaluateIndeterminates(x, points), each, rtol=1e-13)
    with pytest.raises(ValueError, match="is not present"):
        p.EvaluateIndeterminates(x[1:], points[1:])


def test_a_variable_that_no_term_has_needs_no_value():
    x, y = Variable("x"), Variable("y")
    p = Polynomial(x * y + x**2, Variables([x, y])) - Polynomial(x * y)
    assert p.EvaluateIndeterminates([x], [[3.0]]) == [9.0]


def test_sines_of_sums_with_a_rest():
    x, y, z, s, c = (Variable(name) for name in ("x", "y", "z", "s", "c"))
    e = sym.sin(2 * x + y + 0.3) * z + sym.cos(x - z) ** 2 + sym.tan(x)
    found = sym.Substitute(np.array([e, z * e]), {x: SinCos(s, c)}).ravel()
    at = {y: 0.4, z: -1.2}
    for wanted, e_of_sc in zip((e, z * e), found):
        assert not e_of_sc.GetVariables().include(x)
        value = e_of_sc.Evaluate({**at, s: np.sin(0.7), c: np.cos(0.7)})
        assert value == pytest.approx(wanted.Evaluate({**at, x: 0.7}), rel=1e-13)


@pytest.mark.parametrize("exponent", [0.5, 1.0, 2.7, "2"])
def test_exponents_are_whole_numbers(exponent):
    x = Variable("x")
    for base in (Polynomial(x**2 + 1.0), Monomial(x, 2)):
        with pytest.raises(TypeError, match="must be int"):
            base**exponent
        assert (base ** np.int64(2)).EqualTo(base * base)
    with pytest.raises(TypeError, match="must be int"):
        Monomial(x, 2).pow_in_place(exponent)


def test_values_that_are_too_large_are_infinite():
    x, y = Variable("x"), Variable("y")
    p = Polynomial(-(x**3) * y)
    assert p.Evaluate({x: 1e300, y: 1.0}) == -np.inf
    assert Monomial(x, 3).Evaluate({x: -1e300}) == -np.inf
    (coefficient,) = p.EvaluatePartial(x, 1e300).monomial_to_coefficient_map().values()
    (integral,) = p.Integrate(x, 0.0, 1e300).monomial_to_coefficient_map().values()
    assert coefficient.Evaluate() == integral.Evaluate() == -np.inf
