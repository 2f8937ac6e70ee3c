"""Certificates that a plane separates two geometries wherever s is in a polytope."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake import symbolic
from sheldrake.common._no_constructor import no_constructor
from sheldrake.geometry.optimization._cspace_geometries import Condition, CSpaceSeparatingPlane
from sheldrake.solvers import MathematicalProgram, MathematicalProgramResult
from sheldrake.symbolic import Expression, Monomial, Polynomial, Variable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sheldrake.multibody.rational import RationalForwardKinematics

# ---- polynomials in s and y as tables of coefficients, and identities of them as linear equations


Powers = tuple[int, ...]
Table = dict[Powers, Any]
"""Coefficients, numbers or rows of them, by the powers of s and then of y."""


def times(a: Table, b: Table) -> Table:
    """The product; coefficients of at least one are numbers."""
    out: Table = {}
    for (p, x), (q, y) in itertools.product(a.items(), b.items()):
        key = tuple(i + j for i, j in zip(p, q))
        out[key] = out.get(key, 0.0) + x * y
    return out


def plus(*tables: Table) -> Table:
    """The sum."""
    out: Table = {}
    for table in tables:
        for key, x in table.items():
            out[key] = out.get(key, 0.0) + x
    return out


def unit(size: int, k: int, power: int = 1) -> Powers:
    """The powers of one variable alone."""
    return tuple(power if i == k else 0 for i in range(size))


def affine(size: int, constant: float, slopes: Sequence[float] | np.ndarray) -> Table:
    """constant + slopes s, for the first variables."""
    out: Table = {(0,) * size: constant}
    for k, slope in enumerate(slopes):
        out[unit(size, k)] = slope
    return out


class Gram:
    """A sum of squares: in each group of monomials z, z' Q z with Q >= 0.

    Args:
        prog: The program that gets new variables Q; None for the sum of no squares: zero.
        groups: The monomials of each group.
    """

    def __init__(self, prog: MathematicalProgram, groups: list[list[Powers]]):
        self.terms: list[tuple[Any, Powers, float]] = []
        for z in groups if prog is not None else []:
            Q = prog.NewSymmetricContinuousVariables(len(z), "Gram")
            if len(z) == 1:
                prog.AddBoundingBoxConstraint(0.0, np.inf, Q.ravel())
            else:
                prog.AddPositiveSemidefiniteConstraint(Q)
            for i in range(len(z)):
                for j in range(i + 1):
                    key = tuple(p + q for p, q in zip(z[i], z[j]))
                    self.terms.append((Q[i, j], key, 1.0 if i == j else 2.0))

    def polynomial(self, variables: list) -> Polynomial:
        """The sum with Q as decision variables."""
        return polynomial_of({}, [(v, key, factor) for v, key, factor in self.terms], variables)

    def values(self, result: MathematicalProgramResult) -> Table:
        """The sum with the solution's Q."""
        out: Table = {}
        if self.terms:
            solution = np.atleast_1d(result.GetSolution(np.array([v for v, _, _ in self.terms], dtype=object)))
            for (_, key, factor), value in zip(self.terms, solution):
                out[key] = out.get(key, 0.0) + factor * value
        return out


def polynomial_of(numbers: Table, terms: list[tuple[Any, Powers, float]], variables: list) -> Polynomial:
    """A polynomial of numbers and of decision variables times factors."""
    out: dict[Powers, Any] = {key: Expression(float(x)) for key, x in numbers.items()}
    for v, key, factor in terms:
        out[key] = out.get(key, Expression(0.0)) + factor * v
    monomials = {Monomial({v: p for v, p in zip(variables, key) if p}): e for key, e in out.items()}
    return Polynomial(monomials)


class Identity:
    """A polynomial that is linear in variables of a program, and is to vanish."""

    def __init__(self) -> None:
        self._columns: dict[Any, int] = {}
        self._variables: list[Variable] = []
        self._entries: list[tuple[Powers, int, float]] = []
        self._constants: Table = {}

    def add(self, v: Variable, key: Powers, factor: float) -> None:
        """Adds factor v times a monomial."""
        column = self._columns.setdefault(v.get_id(), len(self._columns))
        if column == len(self._variables):
            self._variables.append(v)
        self._entries.append((key, column, factor))

    def add_numbers(self, table: Table, factor: float = 1.0) -> None:
        """Adds a multiple of a polynomial of numbers."""
        self._constants = plus(self._constants, {key: factor * x for key, x in table.items()})

    def add_rows(self, table: Table, x: np.ndarray) -> None:
        """Adds a polynomial whose coefficients are rows r: r[:-1] x + r[-1]."""
        for key, row in table.items():
            for v, factor in zip(x, row):
                if factor != 0.0:
                    self.add(v, key, float(factor))
        self.add_numbers({key: row[-1] for key, row in table.items()})

    def add_gram(self, gram: Gram, factor: Table) -> None:
        """Adds a sum of squares times a polynomial of numbers."""
        for v, key, weight in gram.terms:
            for other, x in factor.items():
                if x != 0.0:
                    self.add(v, tuple(p + q for p, q in zip(key, other)), weight * float(x))

    def impose(self, prog: MathematicalProgram) -> None:
        """Adds to a program that all coefficients are zero."""
        keys = sorted({key for key, _, _ in self._entries} | set(self._constants))
        places = {key: i for i, key in enumerate(keys)}
        A = np.zeros((len(keys), len(self._variables)))
        for key, column, factor in self._entries:
            A[places[key], column] += factor
        b = np.array([-float(self._constants.get(key, 0.0)) for key in keys])
        if len(keys):
            prog.AddLinearEqualityConstraint(A, b, np.array(self._variables, dtype=object))


# ---- certificates


class Face:
    """A condition slack(s) >= 0 on s, and which multiplier list of `SeparatingPlaneLagrangians` it has."""

    def __init__(self, kind: str, index: int, slack: Table):
        self.kind, self.index, self.slack = kind, index, slack


class SeparatingPlaneLagrangians:
    """Multipliers of C s <= d, s >= s_lower and s <= s_upper, for one rational function.

    Args:
        C_rows: Number of rows of C.
        s_size: Number of s.
    """

    def __init__(self, C_rows: int, s_size: int):
        self._polynomials = {
            kind: np.array([symbolic.Polynomial() for _ in range(size)], dtype=object)
            for kind, size in (("polytope", C_rows), ("s_lower", s_size), ("s_upper", s_size))
        }

    def polytope(self) -> np.ndarray:
        """Returns the multipliers of C s <= d."""
        return self._polynomials["polytope"]

    def s_lower(self) -> np.ndarray:
        """Returns the multipliers of s >= s_lower."""
        return self._polynomials["s_lower"]

    def s_upper(self) -> np.ndarray:
        """Returns the multipliers of s <= s_upper."""
        return self._polynomials["s_upper"]

    def GetSolution(self, result: MathematicalProgramResult) -> SeparatingPlaneLagrangians:
        """Returns the multipliers with the values of a solution."""
        out = SeparatingPlaneLagrangians(len(self.polytope()), len(self.s_lower()))
        for kind, polynomials in self._polynomials.items():
            for i, p in enumerate(polynomials):
                out._polynomials[kind][i] = result.GetSolution(p)
        return out


@no_constructor()
class SeparationCertificateResultBase:
    """A plane that separates two geometries.

    Attributes:
        a: Polynomials in s, shape (3,); the plane is a x + b = 0.
        b: A polynomial in s.
        plane_decision_var_vals: Values of the plane's decision variables.
        result: The solver's result.
    """

    a: np.ndarray
    b: symbolic.Polynomial
    plane_decision_var_vals: np.ndarray
    result: MathematicalProgramResult


class SeparationCertificateResult(SeparationCertificateResultBase):
    """A plane that separates two geometries, and the multipliers that prove it.

    Attributes:
        plane_index: Index of the plane in `separating_planes()`.
        positive_side_rational_lagrangians: Multipliers for each rational function of the positive side.
        negative_side_rational_lagrangians: The same of the negative side.
    """

    plane_index: int
    positive_side_rational_lagrangians: list[SeparatingPlaneLagrangians]
    negative_side_rational_lagrangians: list[SeparatingPlaneLagrangians]
    _values: list[list[Table]]


@no_constructor()
class SeparationCertificate:
    """Multipliers for each rational function, with decision variables as coefficients.

    Attributes:
        positive_side_rational_lagrangians: Of the positive side.
        negative_side_rational_lagrangians: Of the negative side.
    """

    positive_side_rational_lagrangians: list[SeparatingPlaneLagrangians]
    negative_side_rational_lagrangians: list[SeparatingPlaneLagrangians]
    _grams: list[list[Gram]]

    def GetSolution(
        self,
        plane_index: int,
        a: np.ndarray,
        b: Polynomial,
        plane_decision_vars: np.ndarray,
        result: MathematicalProgramResult,
    ) -> SeparationCertificateResult:
        """Returns the plane and the multipliers with the values of a solution."""
        out = object.__new__(SeparationCertificateResult)
        out.plane_index, out.result = int(plane_index), result
        out.a = np.array([result.GetSolution(p) for p in a], dtype=object)
        out.b = result.GetSolution(b)
        out.plane_decision_var_vals = np.atleast_1d(result.GetSolution(np.asarray(plane_decision_vars, dtype=object)))
        for side in ("positive", "negative"):
            name = f"{side}_side_rational_lagrangians"
            setattr(out, name, [lagrangians.GetSolution(result) for lagrangians in getattr(self, name)])
        out._values = [[gram.values(result) for gram in grams] for grams in self._grams]
        return out


@no_constructor()
class SeparationCertificateProgramBase:
    """A program that looks for a certificate.

    Attributes:
        plane_index: Index of the plane in `separating_planes()`.
    """

    plane_index: int
    _prog: MathematicalProgram

    def prog(self) -> MathematicalProgram:
        """Returns the program."""
        return self._prog


class SeparationCertificateProgram(SeparationCertificateProgramBase):
    """A program that looks for a plane and multipliers.

    Attributes:
        plane_index: Index of the plane in `separating_planes()`.
        certificate: The multipliers.
    """

    certificate: SeparationCertificate

    def __init__(self) -> None:
        self._prog, self.plane_index = MathematicalProgram(), -1


class Rational:
    """The numerator of a rational function that is not negative where a geometry is on its side of a plane.

    Attributes:
        numerator: Rows over the plane's decision variables and one, by powers of s and y.
        groups: Monomials of its sums of squares.
        side: 0 for the positive side, 1 for the negative one.
    """

    def __init__(self, numerator: Table, groups: list[list[Powers]], side: int):
        self.numerator, self.groups, self.side = numerator, groups, side


def rationals(
    plane: CSpaceSeparatingPlane,
    kinematics: RationalForwardKinematics,
    q_star: np.ndarray,
    rows: np.ndarray,
    with_cross_y: bool,
) -> list[Rational]:
    """All rational functions of a plane.

    Args:
        plane: The plane.
        kinematics: RationalForwardKinematics.
        q_star: The nominal posture.
        rows: a and b: for each, coefficients of s and one as rows over the decision variables and one.
        with_cross_y: Whether squares may have products of different y.
    """
    num_s = len(kinematics.s())
    size = num_s + 3
    a_b = [affine(size, row[-1], row[:-1]) for row in rows]
    out = []
    for side, geometry in enumerate((plane.positive_side_geometry, plane.negative_side_geometry)):
        X, denominator, chain = kinematics._rational_pose(q_star, int(geometry.body_index()), int(plane.expressed_body))
        X = {(*key, 0, 0, 0): value @ geometry.X_BG().GetAsMatrix4() for key, value in X.items()}
        denominator = {(*key, 0, 0, 0): value for key, value in denominator.items()}
        signed = [{key: (1.0, -1.0)[side] * row for key, row in table.items()} for table in a_b]
        z = [tuple(1 if k in chosen else 0 for k in range(size)) for chosen in _subsets(chain)]
        for condition in geometry._conditions:
            out.append(_rational(signed, X, denominator, condition, z, side, with_cross_y, num_s))
    return out


def _subsets(chain: list[int]) -> list[tuple[int, ...]]:
    return [c for count in range(len(chain) + 1) for c in itertools.combinations(chain, count)]


def _rational(
    a_b: list[Table],
    X: Table,
    denominator: Table,
    condition: Condition,
    z: list[Powers],
    side: int,
    with_cross_y: bool,
    num_s: int,
) -> Rational:
    size = num_s + 3
    p = {key: value[:3, :3] @ condition.p_G + value[:3, 3] for key, value in X.items()}
    height = plus(_dot(a_b, p), times(a_b[3], denominator))
    arms = condition.arms_G.shape[1]
    if not arms:
        one = np.zeros(len(next(iter(a_b[3].values()))))
        one[-1] = -1.0
        return Rational(plus(height, {key: value * one for key, value in denominator.items()}), [z], side)
    y = [unit(size, num_s + k) for k in range(arms)]
    squares: Table = {(0,) * size: 1.0, **{unit(size, num_s + k, 2): 1.0 for k in range(arms)}}
    parts = [times(height, squares)]
    for k in range(arms):
        arm = {key: value[:3, :3] @ condition.arms_G[:, k] for key, value in X.items()}
        parts.append(times(_dot(a_b, arm), {y[k]: 2.0}))
    lifted = [[tuple(i + j for i, j in zip(key, extra)) for key in z] for extra in y]
    groups = [list(itertools.chain(z, *lifted))] if with_cross_y else [z + more for more in lifted]
    return Rational(plus(*parts), groups, side)


def _dot(a_b: list[Table], v: Table) -> Table:
    return plus(*(times(a_b[i], {key: float(value[i]) for key, value in v.items()}) for i in range(3)))


def certificate_program(
    plane_index: int,
    plane: CSpaceSeparatingPlane,
    rational_list: list[Rational],
    faces: list[Face],
    C_rows: int,
    variables: list,
) -> SeparationCertificateProgram:
    """The program that looks for a plane, and for multipliers of the faces, one for each rational function."""
    out = SeparationCertificateProgram()
    prog = out._prog
    out.plane_index = plane_index
    prog.AddDecisionVariables(plane.decision_variables)
    certificate = out.certificate = object.__new__(SeparationCertificate)
    certificate._grams = []
    sides: tuple[list, list] = ([], [])
    num_s = len(variables) - 3
    for rational in rational_list:
        grams = [Gram(prog, rational.groups) for _ in faces]
        identity = Identity()
        identity.add_rows(rational.numerator, plane.decision_variables)
        one: Table = {(0,) * len(variables): -1.0}
        for face, gram in zip(faces, grams):
            identity.add_gram(gram, times(face.slack, one))
        identity.add_gram(Gram(prog, rational.groups), one)
        identity.impose(prog)
        lagrangians = SeparatingPlaneLagrangians(C_rows, num_s)
        for face, gram in zip(faces, grams):
            lagrangians._polynomials[face.kind][face.index] = gram.polynomial(variables)
        sides[rational.side].append(lagrangians)
        certificate._grams.append(grams)
    certificate.positive_side_rational_lagrangians, certificate.negative_side_rational_lagrangians = sides
    return out
