"""Sets of configurations with angles that go around: pieces narrower than half a turn, and which of them meet."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import anything, flag
from sheldrake.common._overloads import Mismatch, kind, overload, overloaded
from sheldrake.geometry.optimization._affine import Affine, Rows
from sheldrake.geometry.optimization._composed_sets import Intersection
from sheldrake.geometry.optimization._convex_set import ConvexSet
from sheldrake.geometry.optimization._hpolyhedron import HPolyhedron
from sheldrake.geometry.optimization._hyperrectangle import Hyperrectangle
from sheldrake.solvers import MathematicalProgram, Solve

if TYPE_CHECKING:
    from sheldrake.common._parallelism import Parallelism


_TURN = 2.0 * math.pi


def check_joints(joints: Sequence[int], dimension: int) -> list[int]:
    """The places of angles.

    Raises:
        RuntimeError: one is repeated, or out of range.
    """
    joints = [int(j) for j in joints]
    for place, j in enumerate(joints):
        if not 0 <= j < dimension:
            raise RuntimeError(
                f"Each joint index in continuous_revolute_joints must lie in the interval [0, {dimension}). Joint "
                f"index {j} (located at {place}) violates this."
            )
    if len(set(joints)) < len(joints):
        raise RuntimeError("continuous_revolute_joints must not contain duplicate entries.")
    return joints


def _ends(s: ConvexSet, dimension: int) -> tuple[float, float]:
    """The least and the greatest coordinate.

    Raises:
        RuntimeError: the set is empty, or unbounded there.
    """
    e = np.eye(s.ambient_dimension())[dimension]
    found = []
    for word, sign in (("lower", -1.0), ("upper", 1.0)):
        value = sign * s._extent(sign * e)
        if not math.isfinite(value):
            raise RuntimeError(f"Failed to compute the {word} bound of a convex set along dimension {dimension}!")
        found.append(value)
    return found[0], found[1]


@checked
def CheckIfSatisfiesConvexityRadius(convex_set: ConvexSet, continuous_revolute_joints: list[int]) -> bool:
    """Tells whether a set is narrower than half a turn in each of its angles.

    Raises:
        RuntimeError: a place of an angle is repeated or out of range, or the set is unbounded there.
    """
    joints = check_joints(continuous_revolute_joints, convex_set.ambient_dimension())
    return all(high - low < math.pi for low, high in (_ends(convex_set, j) for j in joints))


@checked
def PartitionConvexSet(
    convex_set: Any = None,
    continuous_revolute_joints: Sequence[int] = (),
    epsilon: float = 1e-5,
    *,
    convex_sets: Any = None,
) -> list[ConvexSet]:
    """Returns pieces of a set (or of several) that are narrower than half a turn in each angle, and overlap a little.

    Args:
        convex_set: A set, or a list of them.
        continuous_revolute_joints: Places of the angles.
        epsilon: The overlap [rad].
        convex_sets: Sets, instead of `convex_set`.

    Raises:
        RuntimeError: epsilon is not between 0 and pi, a place is repeated or out of range, or a set is unbounded there.
    """
    given = convex_set if convex_sets is None else convex_sets
    sets = [given] if isinstance(given, ConvexSet) else list(given)
    if not 0.0 < epsilon < math.pi:
        raise RuntimeError(f"PartitionConvexSet(): epsilon must be between 0 and pi, got {epsilon}.")
    return [piece for s in sets for piece in _pieces(s, continuous_revolute_joints, epsilon)]


def _pieces(s: ConvexSet, joints: Sequence[int], epsilon: float) -> list[ConvexSet]:
    joints = check_joints(joints, s.ambient_dimension())
    intervals = [_intervals(*_ends(s, j), epsilon) for j in joints]
    if all(len(i) == 1 for i in intervals):
        return [s.Clone()]
    out: list[ConvexSet] = []
    for choice in itertools.product(*intervals):
        A, b = [], []
        for j, (low, high) in zip(joints, choice):
            e = np.eye(s.ambient_dimension())[j]
            A += [e, -e]
            b += [high, -low]
        piece = Intersection(s, HPolyhedron(np.array(A), np.array(b)))
        if not piece.IsEmpty():
            out.append(piece)
    return out


def _intervals(low: float, high: float, epsilon: float) -> list[tuple[float, float]]:
    if high - low < math.pi:
        return [(low, high)]
    step, width = math.pi - 2.0 * epsilon, math.pi - epsilon
    out, start = [], low
    while True:
        end = min(start + width, high)
        out.append((start, end))
        if end >= high:
            return out
        start += step


def _list_of(cls: type | tuple[type, ...], value: Any) -> list:
    if not isinstance(value, Iterable):
        raise Mismatch
    items = list(value)
    if not all(isinstance(item, cls) for item in items):
        raise Mismatch
    return items


@kind("list of ConvexSet")
def _sets(value: object) -> list[ConvexSet]:
    return _list_of(ConvexSet, value)


@kind("list of int")
def _places(value: Any) -> list[int]:
    return _list_of((int, np.integer), value)


@kind("list of Hyperrectangle")
def _boxes(value: object) -> list[Hyperrectangle]:
    return _list_of(Hyperrectangle, value)


_TWO_LISTS = {"convex_sets_A": _sets, "convex_sets_B": _sets}
_TIME = {"preprocess_bbox": (flag, True), "parallelism": (anything, None)}
_JOINTS = {"continuous_revolute_joints": _places}


@overloaded(
    overload(
        lambda A, B, joints, *_: _between(A, B, joints), convex_sets_A=_sets, convex_sets_B=_sets, **_JOINTS, **_TIME
    ),
    overload(
        **_TWO_LISTS,
        **_JOINTS,
        bboxes_A=_boxes,
        bboxes_B=_boxes,
        parallelism=_TIME["parallelism"],
    ),
    overload(lambda A, joints, *_: _between(A, None, joints), convex_sets=_sets, **_JOINTS, **_TIME),
    overload(
        lambda A, joints, boxes, _: _between(A, None, joints, boxes),
        convex_sets=_sets,
        **_JOINTS,
        bboxes=(_boxes, None),
        parallelism=_TIME["parallelism"],
    ),
)
@checked
def ComputePairwiseIntersections(
    A: list[ConvexSet],
    B: list[ConvexSet],
    joints: list[int],
    boxes_A: Sequence[Hyperrectangle],
    boxes_B: Sequence[Hyperrectangle],
    _parallelism: Parallelism | int | bool,
) -> tuple[list[tuple[int, int]], list[np.ndarray]]:
    """Returns which sets meet, if angles may be changed by whole turns, and by how much the first has to be moved.

    Called as `(convex_sets, continuous_revolute_joints)` within a list, each pair in both orders; or as
    `(convex_sets_A, convex_sets_B, continuous_revolute_joints)` between two lists. Bounding boxes (`bboxes`, `bboxes_A`
    and `bboxes_B`) may be given; `preprocess_bbox` and `parallelism` change nothing but time.

    Raises:
        RuntimeError: a list is empty, dimensions differ, or a place of an angle is repeated or out of range.
    """
    return _between(A, B, joints, boxes_A, boxes_B)


def _between(
    A: list[ConvexSet],
    others: list[ConvexSet] | None,
    joints: Sequence[int],
    boxes_A: Any = None,
    boxes_B: Any = None,
) -> tuple[list[tuple[int, int]], list[np.ndarray]]:
    """Pairs within a list, or between two, and offsets."""
    B = A if others is None else others
    if not A or not B:
        raise RuntimeError("ComputePairwiseIntersections(): a list of sets is empty.")
    if len({s.ambient_dimension() for s in (*A, *B)}) > 1:
        raise RuntimeError("ComputePairwiseIntersections(): the sets are in spaces of different dimensions.")
    joints = check_joints(joints, A[0].ambient_dimension())
    box = Hyperrectangle.MaybeCalcAxisAlignedBoundingBox
    boxes_A = boxes_A or [box(s) for s in A]
    boxes_B = boxes_A if others is None else (boxes_B or [box(s) for s in B])
    if len(boxes_A) != len(A) or len(boxes_B) != len(B):
        raise RuntimeError("ComputePairwiseIntersections(): there must be one bounding box for each set.")
    edges, offsets = [], []
    for i in range(len(A)):
        for j in range(i + 1 if others is None else 0, len(B)):
            offset = _offset(boxes_A[i], boxes_B[j], joints)
            if offset is None or not _meet(A[i], B[j], offset):
                continue
            edges.append((i, j))
            offsets.append(offset)
            if others is None:
                edges.append((j, i))
                offsets.append(-offset)
    return edges, offsets


def _offset(a: Hyperrectangle, b: Hyperrectangle, joints: list[int]) -> np.ndarray | None:
    """Whole turns that bring one box to another; None if they do not meet."""
    if a is None or b is None:
        return np.zeros(0)  # Empty or unbounded: only a program tells.
    out = np.zeros(a.ambient_dimension())
    for k in range(out.size):
        if k in joints:
            out[k] = _TURN * math.ceil((b.lb()[k] - a.ub()[k]) / _TURN - 1e-9)
        if a.lb()[k] + out[k] > b.ub()[k] + 1e-9 or a.ub()[k] + out[k] < b.lb()[k] - 1e-9:
            return None
    return out


def _meet(a: ConvexSet, b: ConvexSet, offset: np.ndarray) -> bool:
    if not offset.any():
        return a.IntersectsWith(b)
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(offset.size, "x")
    one = Affine.constant(1.0)
    a._contain(Rows(prog), Affine.of(x) - Affine.constant(offset), one)
    b._contain(Rows(prog), Affine.of(x), one)
    return Solve(prog).is_success()
