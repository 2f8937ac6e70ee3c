"""Rotation matrices relaxed to mixed-integer linear constraints."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._enums import BoundEnum
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.solvers._relaxations import box_sphere
from sheldrake.solvers._relaxations.special_ordered_sets import (
    AddBilinearProductMcCormickEnvelopeSos2,
    IntervalBinning,
    gray_code,
)
from sheldrake.symbolic import Variable

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


_SIGNS = tuple(itertools.product((1, -1), repeat=3))


class MixedIntegerRotationConstraintGenerator:
    """Adds mixed-integer linear constraints that every rotation matrix satisfies, and others nearly do not.

    The range [-1, 1] of each element is cut into intervals; binary variables say in which interval it is, and there
    products and the unit sphere are relaxed (Dai, Izatt and Tedrake, Global inverse kinematics via mixed-integer
    convex optimization, 2019).

    Args:
        approach: What is relaxed.
        num_intervals_per_half_axis: Into how many intervals [0, 1] is cut.
        interval_binning: How binary variables say which interval is meant.

    Raises:
        RuntimeError: there are no intervals.
    """

    class Approach(BoundEnum):
        """Boxes meet the unit sphere; or products are in McCormick's envelopes; or both."""

        kBoxSphereIntersection = 0
        kBilinearMcCormick = 1
        kBoth = 2

    class ReturnType:
        """New variables, by row and column of the matrix.

        Attributes:
            B_: Binary variables of the element's interval.
            lambda_: Weights of the ends of intervals; the element is their mean.
        """

        B_: list[list[np.ndarray]]
        lambda_: list[list[np.ndarray]]

        def __init__(self, *args: object, **kwargs: object):
            raise TypeError("pydrake.solvers.ReturnType: No constructor defined!")

    def __init__(self, approach: Approach, num_intervals_per_half_axis: int, interval_binning: IntervalBinning):
        if num_intervals_per_half_axis < 1:
            raise RuntimeError(
                "MixedIntegerRotationConstraintGenerator(): num_intervals_per_half_axis must be at least 1, got "
                f"{num_intervals_per_half_axis}."
            )
        self._approach, self._n = approach, int(num_intervals_per_half_axis)
        self._binning = interval_binning

    def phi(self) -> np.ndarray:
        """Returns the ends of the intervals, shape (2 n + 1,)."""
        return np.linspace(-1.0, 1.0, 2 * self._n + 1)

    def phi_nonnegative(self) -> np.ndarray:
        """Returns the ends that are not negative, shape (n + 1,)."""
        return self.phi()[self._n :]

    def approach(self) -> Approach:
        """Returns what is relaxed."""
        return self._approach

    def num_intervals_per_half_axis(self) -> int:
        """Returns into how many intervals [0, 1] is cut."""
        return self._n

    def interval_binning(self) -> IntervalBinning:
        """Returns how binary variables say which interval is meant."""
        return self._binning

    def AddToProgram(self, R: ArrayLike, prog: MathematicalProgram) -> ReturnType:
        """Adds the constraints on a matrix of variables.

        Args:
            R: The matrix, shape (3, 3).
            prog: The program.
        """
        return _Relaxation(self, np.asarray(R, dtype=object).reshape(3, 3), prog).add()


class _Affine:
    """Numbers A x + c of variables: rows of constraints are made of them."""

    def __init__(self, A: np.ndarray, c: np.ndarray, x: Sequence[Variable]):
        self.A, self.c, self.x = A, c, list(x)

    def rows(self, prog: MathematicalProgram, M: ArrayLike, lower: ArrayLike, upper: ArrayLike) -> None:
        """Adds lower <= M (A x + c) <= upper."""
        M = np.atleast_2d(np.asarray(M, dtype=float))
        shift = M @ self.c
        A, low, high = M @ self.A, np.broadcast_to(lower, len(M)) - shift, np.broadcast_to(upper, len(M)) - shift
        used = np.flatnonzero(np.any(A != 0.0, axis=0))
        prog.AddLinearConstraint(A[:, used], low, high, np.array([self.x[i] for i in used.tolist()], dtype=object))


def _stacked(*parts: _Affine) -> _Affine:
    place: dict[Any, int] = {}
    for part in parts:
        for v in part.x:
            place.setdefault(v.get_id(), len(place))
    x: list = [None] * len(place)
    A = np.zeros((sum(len(p.c) for p in parts), len(place)))
    row = 0
    for part in parts:
        for k, v in enumerate(part.x):
            x[place[v.get_id()]] = v
            A[row : row + len(part.c), place[v.get_id()]] += part.A[:, k]
        row += len(part.c)
    return _Affine(A, np.concatenate([p.c for p in parts]), x)


class _Relaxation:
    """The constraints of one matrix."""

    def __init__(self, generator: MixedIntegerRotationConstraintGenerator, R: np.ndarray, prog: MathematicalProgram):
        self.n, self.phi, self.prog, self.R = generator._n, generator.phi(), prog, R
        self.linear = generator._binning is IntervalBinning.kLinear
        self.approach = generator._approach

    def add(self) -> MixedIntegerRotationConstraintGenerator.ReturnType:
        """Adds them and returns the new variables."""
        Generator = MixedIntegerRotationConstraintGenerator
        out = object.__new__(Generator.ReturnType)
        grid = [[self._add_intervals(i, j) for j in range(3)] for i in range(3)]
        self.weights = out.lambda_ = [[cell[0] for cell in row] for row in grid]
        self.bits = out.B_ = [[cell[1] for cell in row] for row in grid]
        self.is_positive = [[self._is_positive(i, j) for j in range(3)] for i in range(3)]
        self._orthants()
        self._signs_of_cofactors()
        if self.approach is not Generator.Approach.kBoxSphereIntersection:
            self._unit_length()
            self._products()
        if self.approach is not Generator.Approach.kBilinearMcCormick:
            self._boxes()
        return out

    def _add_intervals(self, i: int, j: int) -> tuple[np.ndarray, np.ndarray]:
        """The element as a mean of two neighbouring ends of intervals: weights, and the bits that choose them."""
        prog, count = self.prog, 2 * self.n
        weights = prog.NewContinuousVariables(count + 1, f"lambda[{i}][{j}]")
        digits = count if self.linear else int(np.ceil(np.log2(count)))
        bits = prog.NewBinaryVariables(digits, f"B[{i}][{j}]" if self.linear else "y")
        prog.AddBoundingBoxConstraint(0.0, 1.0, weights)
        both = np.concatenate(([self.R[i, j]], weights))
        prog.AddLinearEqualityConstraint(np.append(1.0, -self.phi)[None], [0.0], both)
        prog.AddLinearEqualityConstraint(np.ones((1, count + 1)), [1.0], weights)
        near = np.zeros((count + 1, count))
        near[np.arange(count), np.arange(count)] = near[np.arange(1, count + 1), np.arange(count)] = 1.0
        if self.linear:
            prog.AddLinearEqualityConstraint(np.ones((1, count)), [1.0], bits)
            A = np.hstack((np.eye(count + 1), -near))
            prog.AddLinearConstraint(A, np.full(count + 1, -np.inf), np.zeros(count + 1), np.append(weights, bits))
            return weights, bits
        codes = gray_code(digits)[:count]
        for d in range(digits):
            ones, zeros = (np.array([np.all(codes[row > 0, d] == bit) for row in near], float) for bit in (1, 0))
            A = np.vstack((np.append(ones, -1.0), np.append(zeros, 1.0)))
            prog.AddLinearConstraint(A, [-np.inf, -np.inf], [0.0, 1.0], np.append(weights, bits[d]))
        return weights, bits

    def _indicator(self, i: int, j: int, intervals: Sequence[int]) -> _Affine:
        """One where the element is in one of the intervals, else zero."""
        if not self.linear and self.n == 1 and len(intervals) == 1:  # The only bit says which of the two it is.
            sign = 1.0 if intervals[0] == 1 else -1.0
            return _Affine(np.array([[sign]]), np.array([0.5 * (1.0 - sign)]), list(self.bits[i][j]))
        variables = self.bits[i][j] if self.linear else self._interval_variables(i, j)
        return _Affine(np.ones((1, len(intervals))), np.zeros(1), [variables[k] for k in intervals])

    def _is_positive(self, i: int, j: int) -> _Affine:
        """One where the element is in an interval above zero, else zero."""
        if not self.linear and self.n & (self.n - 1) == 0:  # The first digit of the Gray code tells halves apart.
            return _Affine(np.ones((1, 1)), np.zeros(1), [self.bits[i][j][0]])
        return self._indicator(i, j, range(self.n, 2 * self.n))

    def _interval_variables(self, i: int, j: int) -> np.ndarray:
        """Variables that are one for the interval that the bits name, else zero."""
        made = self.__dict__.setdefault("_made", {})
        if (i, j) not in made:
            bits, count = self.bits[i][j], 2 * self.n
            codes = gray_code(len(bits))[:count]
            chosen = made[i, j] = self.prog.NewContinuousVariables(count, f"c[{i}][{j}]")
            self.prog.AddBoundingBoxConstraint(0.0, 1.0, chosen)
            self.prog.AddLinearEqualityConstraint(np.ones((1, count)), [1.0], chosen)
            # Those whose digit is one sum to that digit.
            A = np.hstack((codes.T.astype(float), -np.eye(len(bits))))
            self.prog.AddLinearEqualityConstraint(A, np.zeros(len(bits)), np.append(chosen, bits))
        return made[i, j]

    def _lines(self) -> list[list[list[tuple[int, int]]]]:
        """Places of the elements of the three columns, and of the three rows."""
        columns = [[(i, j) for i in range(3)] for j in range(3)]
        return [columns, [[(j, i) for i, j in line] for line in columns]]

    def _orthants(self) -> None:
        """Two columns, or two rows, are never in the same orthant, nor in opposite ones: they are orthogonal."""
        for lines in self._lines():
            for a, b in itertools.combinations(lines, 2):
                signs = _stacked(*(self.is_positive[i][j] for i, j in (*a, *b)))
                s = np.array(_SIGNS, dtype=float)
                # With all bits as s says, s.bits is the number of ones of s.
                ones = (s > 0).sum(axis=1)
                signs.rows(self.prog, np.hstack((s, s)), -np.inf, 2 * ones - 1)
                signs.rows(self.prog, np.hstack((s, -s)), -np.inf, 2.0)

    def _signs_of_cofactors(self) -> None:
        """An element is the difference of two products: their signs, if they differ, tell its own."""
        clauses = []
        for product, bits in itertools.product((1, -1), itertools.product((1, -1), repeat=2)):
            # ab has the sign `product`, cd the other one; then e has it too.
            a, c = bits
            pattern = np.array([a, a * product, c, -c * product, -product], dtype=float)
            clauses.append((pattern, (pattern > 0).sum() - 1.0))
        M, upper = np.array([c[0] for c in clauses]), np.array([c[1] for c in clauses])
        for i, j in itertools.product(range(3), repeat=2):
            i1, i2, j1, j2 = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
            places = ((i1, j1), (i2, j2), (i1, j2), (i2, j1), (i, j))
            _stacked(*(self.is_positive[a][b] for a, b in places)).rows(self.prog, M, -np.inf, upper)

    def _unit_length(self) -> None:
        """The squares of a column, or row, sum to one: tangents are below squares, chords above."""
        grid = np.array([p for p in itertools.product(self.phi, repeat=3) if any(p)])
        upper = 1.0 + (grid**2).sum(axis=1)
        for line in itertools.chain(*self._lines()):
            weights = np.concatenate([self.weights[i][j] for i, j in line])
            self.prog.AddLinearConstraint(np.tile(self.phi**2, (1, 3)), [1.0], [np.inf], weights)
            x = np.array([self.R[i, j] for i, j in line], dtype=object)
            self.prog.AddLinearConstraint(2.0 * grid, np.full(len(grid), -np.inf), upper, x)

    def _products(self) -> None:
        """Columns, and rows, are orthogonal, and the product of two is the third; products of elements are relaxed."""
        R, prog = self.R, self.prog
        places = list(itertools.product(range(3), repeat=2))
        product: dict[frozenset, Any] = {}
        for pair in itertools.combinations(places, 2):
            x, y = (R[place] for place in pair)
            w = product[frozenset(pair)] = prog.NewContinuousVariables(1, f"{x}*{y}")[0]
            x_bits, y_bits = (self.bits[i][j] for i, j in pair)
            binning = IntervalBinning.kLinear if self.linear else IntervalBinning.kLogarithmic
            AddBilinearProductMcCormickEnvelopeSos2(prog, x, y, w, self.phi, self.phi, x_bits, y_bits, binning)
        for lines in self._lines():
            for a, b in itertools.combinations(lines, 2):
                products = np.array([product[frozenset(pair)] for pair in zip(a, b)], dtype=object)
                prog.AddLinearEqualityConstraint(np.ones((1, 3)), [0.0], products)
            for k in range(3):
                a, b, c = lines[k], lines[(k + 1) % 3], lines[(k + 2) % 3]
                for i in range(3):
                    i1, i2 = (i + 1) % 3, (i + 2) % 3
                    plus, minus = product[frozenset((a[i1], b[i2]))], product[frozenset((a[i2], b[i1]))]
                    terms = np.array([plus, minus, R[c[i]]], dtype=object)
                    prog.AddLinearEqualityConstraint(np.array([[1.0, -1.0, -1.0]]), [0.0], terms)

    def _boxes(self) -> None:
        """A column, or row, is where its box meets the sphere; the other two are then nearly orthogonal to its axis."""
        for lines in self._lines():
            for k in range(3):
                v0, v1, v2 = lines[k], lines[(k + 1) % 3], lines[(k + 2) % 3]
                elements = [self.R[p] for p in (*v0, *v1, *v2)]
                vectors = _Affine(np.eye(9), np.zeros(9), elements)
                v = np.array([self.R[p] for p in v0], dtype=object)
                for box, region in box_sphere.regions(self.n).items():
                    if len(region.corners):  # A unit vector goes nowhere farther than one.
                        self.prog.AddLinearConstraint(
                            np.array(_SIGNS) * region.normal, np.full(8, -np.inf), np.ones(8), v
                        )
                    for s in _SIGNS:
                        self._in_box(box, np.array(s, dtype=float), region, v0, vectors)

    def _in_box(self, box: tuple, s: np.ndarray, region: box_sphere.Region, v0: list, vectors: _Affine) -> None:
        intervals = [self.n + b if sign > 0 else self.n - 1 - b for b, sign in zip(box, s)]
        chosen = [self._indicator(place[0], place[1], [k]) for place, k in zip(v0, intervals)]
        if len(region.corners) == 0:
            _stacked(*chosen).rows(self.prog, np.ones((1, 3)), -np.inf, 2.0)
            return
        both = _stacked(vectors, *chosen)
        M, inside, anywhere = _relations(region, s)
        slack = anywhere - inside  # Where less than three bits say that v0 is in the box, nothing is asked.
        both.rows(self.prog, np.hstack((M, np.tile(slack[:, None], 3))), -np.inf, inside + 3.0 * slack)


def _relations(region: box_sphere.Region, s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows M and bounds of M [v0, v1, v2]: for v0 in the region mirrored by s, and for every rotation matrix."""
    n, zero, eye = s * region.normal, np.zeros(3), np.eye(3)
    sine = np.sqrt(max(0.0, 1.0 - region.cosine**2))
    chord = 2.0 * np.sin(0.5 * np.arccos(region.cosine))
    rows = [(np.concatenate((-n, zero, zero)), -region.cosine, 1.0)]
    rows += [(np.concatenate((-s * facet[:3], zero, zero)), -facet[3], 1.0) for facet in region.facets]
    cross = np.array([[0.0, -n[2], n[1]], [n[2], 0.0, -n[0]], [-n[1], n[0], 0.0]])
    for sign in (1.0, -1.0):
        rows += [
            (np.concatenate((zero, sign * n, zero)), sine, 1.0),
            (np.concatenate((zero, zero, sign * n)), sine, 1.0),
        ]
        # |n x v1 - v2| <= |n - v0|
        rows += [(sign * np.concatenate((zero, c, -e)), chord, 2.0) for c, e in zip(cross, eye)]
    M, inside, anywhere = zip(*rows)
    return np.array(M), np.array(inside), np.array(anywhere)
