"""What all convex sets can do.

The base of the sets beside it: what a set must say of itself, and what follows from that for programs.
"""

from __future__ import annotations

import copy
import math
from typing import TYPE_CHECKING, Any, NamedTuple
from typing import overload as typing_overload

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._distributions import sample_uniform
from sheldrake.common._kinds import instance_of
from sheldrake.common._no_constructor import no_constructor
from sheldrake.common._overloads import dispatch, overload
from sheldrake.geometry.optimization import _polyhedron_programs as programs
from sheldrake.geometry.optimization._affine import Affine, Rows
from sheldrake.solvers import Constraint, MathematicalProgram, Solve, _arrays
from sheldrake.solvers._engines.quadratic import solve_rows
from sheldrake.solvers._functions.bindings import as_kind
from sheldrake.symbolic import Variable

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.common import Parallelism, RandomGenerator
    from sheldrake.common._types import Vector
    from sheldrake.geometry import Shape
    from sheldrake.math import RigidTransform
    from sheldrake.solvers._arrays import Matrix


class SampledVolume(NamedTuple):
    """A volume found by sampling, a bound of its relative error, and how many samples it took."""

    volume: float
    rel_accuracy: float
    num_samples: int


def checked_box(call: str, lb: ArrayLike, ub: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """The bounds of a box.

    Raises:
        RuntimeError: a lower bound is above its upper bound, or the sizes differ.
    """
    lb, ub = _arrays.float_vector(lb), _arrays.float_vector(ub)
    if lb.size != ub.size or np.any(lb > ub):
        raise RuntimeError(f"{call}(): lower bounds {lb} must not be above upper bounds {ub}.")
    return lb, ub


@no_constructor()
@checked
class ConvexSet:
    """A convex set in a space of some dimension. Not made directly: its kinds are."""

    _dimension: int
    _has_volume = False

    # What a kind of set says

    def _contain(self, into: Rows, x: Affine, scale: Affine) -> None:
        """Constrains x to be in scale times this set; the scale is not negative."""
        raise NotImplementedError

    def _contains(self, x: np.ndarray, tol: float) -> bool | None:
        """Whether a point is in the set; None if a program has to tell."""
        return None

    def _contains_quickly(self, x: ArrayLike, tol: float) -> bool | None:
        """The same by a kernel, for a set that has one; None for what it does not take."""
        return None

    def _empty(self) -> bool:
        """In a space without dimensions most sets have a point."""
        return self._dimension > 0 and self._some_point() is None

    def _bounded(self) -> bool | None:
        """Whether it is bounded; None if programs have to tell."""
        return None

    def _point(self) -> np.ndarray | None:
        """The only point, where that is plain."""
        return None

    def _faces(self) -> tuple[np.ndarray, np.ndarray] | None:
        """A and b of A x <= b, for a set that is known by its faces."""
        return None

    def _corners(self) -> np.ndarray | None:
        """Columns, at least one and finite, whose hull it is, for a set that is known by such."""
        return None

    def _image(self) -> programs.Image | None:
        """The set as an affine image of A w <= b, where it is one and that is plain."""
        faces, corners = self._faces(), self._corners()
        if corners is not None:
            return programs.hull(corners)
        return None if faces is None else programs.Image(np.eye(self._dimension), np.zeros(self._dimension), *faces)

    def _least_scaled(self, A: np.ndarray, center: np.ndarray) -> np.ndarray | None:
        """The point x with the least |A (x - center)|, where the set is such that it is found without a program."""
        faces = self._faces()
        if faces is None:
            return None
        Q = A.T @ A
        return solve_rows(Q, -(Q @ center), *faces, 0)

    def _meets(self, other: ConvexSet) -> bool | None:
        """Whether it has a point in common with another set; None where that is not plain."""
        return None

    def _some_point(self) -> np.ndarray | None:
        """A point of the set; None if it is empty."""
        prog, x = self._program()
        result = Solve(prog)
        return result.GetSolution(x) if result.is_success() else None

    def _volume(self) -> float:
        raise NotImplementedError

    def _shape(self) -> tuple[Shape, RigidTransform]:
        raise RuntimeError(f"ToShapeWithPose is not implemented yet for {type(self).__name__}.")

    # What all have

    def _program(self) -> tuple[MathematicalProgram, np.ndarray]:
        """A program with a point of this set."""
        prog = MathematicalProgram()
        x = prog.NewContinuousVariables(self._dimension, "x")
        self._contain(Rows(prog), Affine.of(x), Affine.constant(1.0))
        return prog, x

    def _extent(self, direction: np.ndarray) -> float:
        """The greatest direction'x of its points; infinite if unbounded.

        Raises:
            RuntimeError: the set is empty, or the solver fails.
        """
        prog, x = self._program()
        cost = prog.AddLinearCost(-direction, 0.0, x)
        result = Solve(prog)
        if result.is_success():
            return -float(result.get_optimal_cost())
        if result.get_solution_result().name in ("kUnbounded", "kDualInfeasible", "kInfeasibleOrUnbounded"):
            prog.RemoveCost(cost)
            if Solve(prog).is_success():
                return np.inf
        raise RuntimeError(f"{type(self).__name__}: no extent was found: {result.get_solution_result().name}.")

    def ambient_dimension(self) -> int:
        """Returns the dimension of the space that the set is in."""
        return self._dimension

    def Clone(self) -> ConvexSet:
        """Returns a copy."""
        return copy.deepcopy(self)

    def __copy__(self) -> ConvexSet:
        return copy.deepcopy(self)

    def __deepcopy__(self, memo: dict[int, Any]) -> ConvexSet:
        out: ConvexSet = object.__new__(type(self))
        memo[id(self)] = out
        for name, value in self.__dict__.items():  # arrays of sets never change in place
            out.__dict__[name] = value if isinstance(value, np.ndarray) else copy.deepcopy(value, memo)
        return out

    def _same_space(self, call: str, other: ConvexSet) -> None:
        if other.ambient_dimension() != self._dimension:
            raise RuntimeError(
                f"{call}(): sets of dimensions {self._dimension} and {other.ambient_dimension()} are not in one space."
            )

    def IntersectsWith(self, other: ConvexSet) -> bool:
        """Tells whether two sets have a point in common.

        Raises:
            RuntimeError: they are in spaces of different dimensions.
        """
        self._same_space("IntersectsWith", other)
        if self._dimension == 0:
            return not self.IsEmpty() and not other.IsEmpty()
        own, others = self._faces(), other._faces()
        if own is not None and others is not None:
            return programs.point(np.vstack((own[0], others[0])), np.concatenate((own[1], others[1]))) is not None
        for faces, vertices in ((own, other._corners()), (others, self._corners())):
            if faces is not None and vertices is not None:
                return programs.hull_meets(vertices, *faces)
        for one, another in ((self, other), (other, self)):
            known = another._meets(one)
            if known is not None:
                return known
        image, other_image = self._image(), other._image()
        if image is not None and other_image is not None:
            return programs.meet(image, other_image)
        prog, x = self._program()
        other._contain(Rows(prog), Affine.of(x), Affine.constant(1.0))
        return Solve(prog).is_success()

    def IsBounded(self, parallelism: Parallelism | int | bool | None = None) -> bool:
        """Tells whether the set is bounded."""
        known = True if self._dimension == 0 else self._bounded()
        if known is not None:
            return known
        if self.IsEmpty():
            return True
        directions = np.vstack((np.eye(self._dimension), -np.eye(self._dimension)))
        return all(np.isfinite(self._extent(e)) for e in directions)

    def IsEmpty(self) -> bool:
        """Tells whether the set has no points; in a space without dimensions most sets have one."""
        return self._empty()

    def MaybeGetPoint(self) -> np.ndarray | None:
        """Returns the only point of the set, if that is plain without solving a program; else None."""
        if self._dimension == 0:
            return None if self.IsEmpty() else np.zeros(0)
        return self._point()

    def MaybeGetFeasiblePoint(self) -> np.ndarray | None:
        """Returns a point of the set, or None if it is empty."""
        point = self.MaybeGetPoint()
        if point is not None or self._dimension == 0:
            return point
        return self._some_point()

    def PointInSet(self, x: ArrayLike, tol: float = 1e-8) -> bool:
        """Tells whether a point is in the set, up to a tolerance in each coordinate or constraint.

        Raises:
            RuntimeError: the point has another dimension.
        """
        inside = self._contains_quickly(x, tol)
        if inside is not None:
            return bool(inside)
        x = np.array(x, dtype=float).ravel()
        if x.size != self._dimension:
            raise RuntimeError(f"PointInSet(): the point has {x.size} coordinates, the set {self._dimension}.")
        if self._dimension == 0:
            return not self.IsEmpty()
        known = self._contains(x, tol)
        if known is not None:
            return bool(known)
        prog, y = self._program()
        error = prog.NewContinuousVariables(1, "error")
        ones = np.ones((x.size, 1))
        near = np.concatenate((y, error))
        prog.AddLinearConstraint(np.hstack((np.eye(x.size), -ones)), np.full(x.size, -np.inf), x, near)
        prog.AddLinearConstraint(np.hstack((np.eye(x.size), ones)), x, np.full(x.size, np.inf), near)
        prog.AddLinearCost(np.ones(1), 0.0, error)
        result = Solve(prog)
        return result.is_success() and result.get_optimal_cost() <= tol

    def _require_dimensions(self, call: str) -> None:
        if self._dimension == 0:
            raise RuntimeError(f"{call}(): {type(self).__name__} is in a space without dimensions.")

    def AddPointInSetConstraints(self, prog: MathematicalProgram, vars: Vector) -> tuple[np.ndarray, list]:
        """Constrains variables to be a point of the set; returns the variables and constraints that this adds.

        Raises:
            RuntimeError: the space has no dimensions, or another number than there are variables.
        """
        self._require_dimensions("AddPointInSetConstraints")
        vars = _arrays.variable_vector(vars)
        if vars.size != self._dimension:
            raise RuntimeError(f"AddPointInSetConstraints(): {vars.size} variables, expected {self._dimension}.")
        into = Rows(prog)
        self._contain(into, Affine.of(vars), Affine.constant(1.0))
        return np.array(into.variables, dtype=object), [as_kind(Constraint, added) for added in into.constraints]

    @typing_overload
    @checked
    def AddPointInNonnegativeScalingConstraints(
        self, prog: MathematicalProgram, x: np.ndarray, t: Variable
    ) -> list: ...
    @typing_overload
    @checked
    def AddPointInNonnegativeScalingConstraints(
        self,
        prog: MathematicalProgram,
        A: ArrayLike,
        b: ArrayLike,
        c: ArrayLike,
        d: float,
        x: np.ndarray,
        t: np.ndarray,
    ) -> list: ...
    def AddPointInNonnegativeScalingConstraints(self, *args: Any, **kwargs: Any) -> list:
        """Constrains x to t S, t >= 0, for this set S (to its directions of recession where t = 0).

        Called as `(prog, x, t)` with variables, or as `(prog, A, b, c, d, x, t)` for A x + b in (c't + d) S.

        Raises:
            RuntimeError: the space has no dimensions.
        """
        self._require_dimensions("AddPointInNonnegativeScalingConstraints")

        def plain(self: ConvexSet, prog: MathematicalProgram, x: np.ndarray, t: Any) -> list:
            return self._scaled(prog, Affine.of(x), Affine.of([t]))

        def general(
            self: ConvexSet,
            prog: MathematicalProgram,
            A: Matrix,
            b: np.ndarray,
            c: Any,
            scale0: float,
            x: np.ndarray,
            t: Any,
        ) -> list:
            scale = Affine([(c.reshape(1, -1), t)], np.array([scale0]))
            return self._scaled(prog, Affine([(A @ np.eye(x.size), x)], b), scale)

        program, vector = instance_of(MathematicalProgram), _arrays.float_vector
        vars, one = _arrays.variable_vector, instance_of(Variable)
        ways = [
            overload(plain, prog=program, x=vars, t=one),
            overload(
                general, prog=program, A=_arrays.float_matrix, b=vector, c=vector, d=_arrays.number, x=vars, t=vars
            ),
        ]
        return dispatch("AddPointInNonnegativeScalingConstraints", ways, self, args, kwargs)

    def _scaled(self, prog: MathematicalProgram, x: Affine, scale: Affine) -> list:
        into = Rows(prog)
        self._contain(into, x, scale)
        return [as_kind(Constraint, added) for added in into.constraints]

    def ToShapeWithPose(self) -> tuple[Shape, RigidTransform]:
        """Returns a shape and its pose in the world.

        Raises:
            RuntimeError: the set is not in space, or its kind has no shape.
        """
        if self._dimension != 3:
            raise RuntimeError(f"ToShapeWithPose(): the set is in {self._dimension} dimensions, expected 3.")
        return self._shape()

    def CalcVolume(self) -> float:
        """Returns the volume.

        Raises:
            RuntimeError: it is not known in closed form, or the space has no dimensions.
        """
        if not self._has_volume:
            raise RuntimeError(
                f"The class {type(self).__name__} reports that it cannot report an exact volume. Use "
                "CalcVolumeViaSampling() instead."
            )
        if self._dimension == 0:
            raise RuntimeError(
                f"The instance defined from {type(self).__name__} is a zero-dimensional set. The volume is not well "
                "defined."
            )
        return float(self._volume())

    def CalcVolumeViaSampling(
        self, generator: RandomGenerator, desired_rel_accuracy: float = 1e-2, max_num_samples: int = 10000
    ) -> SampledVolume:
        """Returns the volume as the part of its bounding box whose samples are in the set.

        Args:
            generator: Of the samples.
            desired_rel_accuracy: Relative error at which sampling ends; it is taken to be 1 / (2 sqrt(hits)).
            max_num_samples: Most samples.

        Raises:
            RuntimeError: the space has no dimensions, or there is no bounding box.
        """
        if self._dimension == 0:
            raise RuntimeError(f"CalcVolumeViaSampling(): {type(self).__name__} is in a space without dimensions.")
        bounds = self._bounding_box()
        if bounds is None:
            raise RuntimeError("CalcVolumeViaSampling(): the set has no bounding box: it is empty or unbounded.")
        hits, samples, error = 0, 0, 1.0
        while error > desired_rel_accuracy and samples < max_num_samples:
            hits += self.PointInSet([sample_uniform(generator, lo, hi) for lo, hi in zip(*bounds)])
            samples += 1
            if hits:
                error = 0.5 / math.sqrt(hits)
        part = hits / samples if samples else math.nan
        return SampledVolume(float(np.prod(bounds[1] - bounds[0])) * part, error, samples)

    def _bounding_box(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Lower and upper corner of the smallest box around the set; None if the set is empty or unbounded."""
        axes = np.eye(self.ambient_dimension())
        try:
            ends = np.array([(-self._extent(-e), self._extent(e)) for e in axes])
        except RuntimeError:
            return None
        if not np.isfinite(ends).all():
            return None
        return np.minimum(ends[:, 0], ends[:, 1]), ends[:, 1]

    def Projection(self, points: ArrayLike) -> tuple[list[float], np.ndarray] | None:
        """Returns distances of points to the set and their nearest points, columns; None if the set is empty.

        Args:
            points: Shape (n, number of points).

        Raises:
            RuntimeError: the points have another dimension, or the solver fails.
        """
        points = np.array(points, dtype=float)
        points = points.reshape(-1, 1) if points.ndim == 1 else points
        if points.shape[0] != self._dimension:
            raise RuntimeError(f"Projection(): points have {points.shape[0]} rows, expected {self._dimension}.")
        if self.IsEmpty():
            return None
        nearest = np.column_stack([self._nearest(p) for p in points.T])
        return [float(v) for v in np.linalg.norm(nearest - points, axis=0)], nearest

    def _nearest(self, p: np.ndarray) -> np.ndarray:
        if self.PointInSet(p, 0.0):
            return p
        nearest = self._least_scaled(np.eye(p.size), p)
        if nearest is not None:
            return nearest
        prog, x = self._program()
        prog.AddQuadraticErrorCost(np.eye(p.size), p, x)
        return programs.solved("Projection", prog).GetSolution(x)


def sets_of(args: tuple, kwargs: dict) -> list[ConvexSet] | None:
    """Sets given as `(sets)` or `(setA, setB)`, all in one space; None if something else, or more, was given.

    Raises:
        RuntimeError: they are in spaces of different dimensions.
    """
    if not kwargs.keys() <= {"sets", "setA", "setB"}:
        return None
    values = [*args, *(kwargs[n] for n in ("sets", "setA", "setB") if n in kwargs)]
    if len(values) == 1 and isinstance(values[0], (list, tuple, np.ndarray)):
        values = list(values[0])
    elif len(values) != 2:
        return None
    if not all(isinstance(s, ConvexSet) for s in values):
        return None
    return copy.deepcopy(values)  # a set that is given several times stays one, and is written but once


def require_one_space(call: str, sets: list[ConvexSet]) -> int:
    """The dimension that sets share; zero if there are none.

    Raises:
        RuntimeError: they do not share one.
    """
    for s in sets[1:]:
        sets[0]._same_space(call, s)
    return sets[0].ambient_dimension() if sets else 0
