"""Forward kinematics in s = tan((q - q*) / 2) of revolute joints and s = q - q* of prismatic ones."""

from __future__ import annotations

import itertools
import math
import sys
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._no_constructor import no_constructor
from sheldrake.common.cpp_template import TemplateClass
from sheldrake.symbolic import Expression, Monomial, Polynomial, RationalFunction, Variable, atan2, tan
from sheldrake.symbolic import _build as build

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import BodyIndex

_KINDS = ("weld", "revolute", "prismatic")
# A pose is a sum of products of indeterminates, of no joint's twice, with coefficients of shape (4, 4).
_Terms = dict[frozenset, np.ndarray]
_Powers = dict[tuple[int, ...], Any]  # Coefficients by the powers of all s.


@no_constructor()
class RationalForwardKinematicsPose:
    """A pose whose elements are polynomials or rational functions; `CalcBodyPoseAsMultilinearPolynomial` makes it."""

    _rotation: np.ndarray
    _position: np.ndarray

    @classmethod
    def _of(cls, elements: np.ndarray) -> RationalForwardKinematicsPose:
        out = object.__new__(cls)
        out._rotation, out._position = elements[:, :3], elements[:, 3]
        return out

    def rotation(self) -> np.ndarray:
        """Returns R_AB, shape (3, 3)."""
        return self._rotation.copy()

    def position(self) -> np.ndarray:
        """Returns p_AB, shape (3,)."""
        return self._position.copy()


class _RationalPose(RationalForwardKinematicsPose):
    """A pose of rational functions."""


RationalForwardKinematicsPose_ = TemplateClass(
    "RationalForwardKinematicsPose_", scope=sys.modules["sheldrake.multibody.rational"]
)
RationalForwardKinematicsPose_.add_instantiation(Polynomial, RationalForwardKinematicsPose, skip_rename=True)
RationalForwardKinematicsPose_.add_instantiation(RationalFunction, _RationalPose)
RationalForwardKinematicsPose_.__doc__ = (
    "A pose of polynomials, or of rational functions: `RationalForwardKinematicsPose_[T]`."
)


class _Mobility(NamedTuple):
    """How a body moves in its parent: X_PB = X_PF E X_MB with E linear in cos and sin, or in s, of its joint.

    Attributes:
        parent: Index of the parent.
        X_PF: Pose of the joint on the parent, shape (4, 4).
        X_MB: Pose of the body in its joint, shape (4, 4).
        axis: Axis of the joint; zero for a weld.
        is_revolute: Whether it turns about the axis, else slides along it.
        q: Index of its position.
        s: Index of its s.
    """

    parent: int
    X_PF: np.ndarray
    X_MB: np.ndarray
    axis: np.ndarray
    is_revolute: bool
    q: int
    s: int


class RationalForwardKinematics:
    """Poses of a plant's bodies as polynomials in cos and sin of q - q*, and as rational functions of s.

    s = tan((q - q*) / 2) for revolute joints, so that cos = (1 - s^2) / (1 + s^2) and sin = 2 s / (1 + s^2);
    s = q - q* for prismatic ones. q* is a nominal posture.

    Args:
        plant: The plant.

    Raises:
        RuntimeError: it is not finalized, or has a joint that is neither weld, revolute nor prismatic.
    """

    def __init__(self, plant: MultibodyPlant):
        if not plant.is_finalized():
            raise RuntimeError("RationalForwardKinematics(): the plant is not finalized.")
        self._plant = plant
        self._mobilities: dict[int, _Mobility] = {}
        self._s: list[Variable] = []
        self._cosines: dict[int, tuple[Variable, Variable]] = {}
        children = {int(plant.get_joint(i).child_body().index()): plant.get_joint(i) for i in plant.GetJointIndices()}
        for body, joint in sorted(children.items()):
            self._mobilities[body] = self._read(joint)
        self._angles = {c.get_id(): (k, 0) for k, (c, _) in self._cosines.items()}
        self._angles |= {s.get_id(): (k, 1) for k, (_, s) in self._cosines.items()}

    def _read(self, joint: Any) -> _Mobility:
        kind = joint.type_name()
        if kind not in _KINDS:
            raise RuntimeError(
                f"RationalForwardKinematics: joint {joint.name()!r} is of unsupported type {kind!r}; only weld, "
                "revolute and prismatic joints are supported."
            )
        X_PF = joint.frame_on_parent().GetFixedPoseInBodyFrame()
        X_MB = joint.frame_on_child().GetFixedPoseInBodyFrame().inverse()
        axis, q, s = np.zeros(3), -1, -1
        if kind == "weld":
            X_PF = X_PF @ joint.X_FM()
        else:
            q, s = int(joint.position_start()), len(self._s)
            self._s.append(Variable(f"s[{s}]"))
            axis = np.array(joint.revolute_axis() if kind == "revolute" else joint.translation_axis())
            if kind == "revolute":
                k = len(self._cosines)
                self._cosines[s] = (Variable(f"cos_delta[{k}]"), Variable(f"sin_delta[{k}]"))
        parent = int(joint.parent_body().index())
        return _Mobility(parent, X_PF.GetAsMatrix4(), X_MB.GetAsMatrix4(), axis, kind == "revolute", q, s)

    def plant(self) -> MultibodyPlant:
        """Returns the plant."""
        return self._plant

    def s(self) -> np.ndarray:
        """Returns the variables s, in the order of bodies; not always that of positions."""
        return np.array(self._s, dtype=object)

    # Values

    def _moving(self) -> list[_Mobility]:
        return [m for m in self._mobilities.values() if m.s >= 0]

    def _values(self, call: str, values: ArrayLike, q_star_val: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        values, q_star = np.asarray(values).ravel(), np.asarray(q_star_val, dtype=float).ravel()
        for name, array in (("the first argument", values), ("q_star_val", q_star)):
            if array.size != len(self._s):
                raise RuntimeError(f"{call}(): {name} has {array.size} values, expected {len(self._s)}.")
        symbolic = values.dtype == object
        return (np.array([build.expect(call, v) for v in values]) if symbolic else values.astype(float)), q_star

    def ComputeSValue(self, q_val: ArrayLike, q_star_val: ArrayLike, angles_wrap_to_inf: bool = False) -> np.ndarray:
        """Returns s for positions, of numbers or of expressions.

        Args:
            q_val: Positions, shape (nq,).
            q_star_val: The nominal posture q*, shape (nq,).
            angles_wrap_to_inf: Whether s is infinite for angles of pi and more from those of q*.

        Raises:
            RuntimeError: a size is another.
        """
        q, q_star = self._values("ComputeSValue", q_val, q_star_val)
        out = np.empty(len(self._s), dtype=q.dtype)
        for m in self._moving():
            way = q[m.q] - q_star[m.q]
            if not m.is_revolute:
                out[m.s] = way
            elif isinstance(way, Expression):
                out[m.s] = tan(way / 2)
            elif angles_wrap_to_inf and abs(way) >= math.pi:
                out[m.s] = math.copysign(math.inf, way)
            else:
                out[m.s] = math.tan(0.5 * way)
        return out

    def ComputeQValue(self, s_val: ArrayLike, q_star_val: ArrayLike) -> np.ndarray:
        """Returns positions for s, of numbers or of expressions.

        Args:
            s_val: s, shape (nq,).
            q_star_val: The nominal posture q*, shape (nq,).

        Raises:
            RuntimeError: a size is another.
        """
        s, q_star = self._values("ComputeQValue", s_val, q_star_val)
        out = np.empty(len(self._s), dtype=s.dtype)
        for m in self._moving():
            v, symbolic = s[m.s], isinstance(s[m.s], Expression)
            if not m.is_revolute:
                out[m.q] = q_star[m.q] + v
            else:
                turn = atan2(2 * v, 1 - v**2) if symbolic else math.atan2(2.0 * v, 1.0 - v * v)
                out[m.q] = q_star[m.q] + turn
        return out

    # Poses

    def CalcBodyPoseAsMultilinearPolynomial(
        self, q_star: ArrayLike, body_index: BodyIndex, expressed_body_index: BodyIndex
    ) -> RationalForwardKinematicsPose:
        """Returns the pose X_AB as polynomials in the cos and sin of joints' angles and in the s of sliding joints.

        Args:
            q_star: The nominal posture q*, shape (nq,).
            body_index: Body B.
            expressed_body_index: Body A.

        Raises:
            RuntimeError: there is no such body, or the size is another.
        """
        terms, _ = self._terms(q_star, int(body_index), int(expressed_body_index))
        return RationalForwardKinematicsPose._of(_polynomials(terms))

    def _terms(self, q_star: ArrayLike, body: int, expressed: int) -> tuple[_Terms, list[int]]:
        """X_AB as a sum of products of indeterminates, and which s are on the way from A to B."""
        q_star = np.asarray(q_star, dtype=float).ravel()
        if q_star.size != len(self._s):
            raise RuntimeError(f"CalcBodyPoseAsMultilinearPolynomial(): q_star has {q_star.size} values.")
        up, down = self._kinematic_path(expressed, body)
        terms: _Terms = {frozenset(): np.eye(4)}
        for body_on_way, inverse in [*((b, True) for b in up), *((b, False) for b in down)]:
            product: _Terms = {}
            step = self._step(body_on_way, q_star, inverse)
            for (a, A), (b, B) in itertools.product(terms.items(), step.items()):
                product[a | b] = product.get(a | b, 0.0) + A @ B
            terms = product
        return terms, sorted(s for s in (self._mobilities[b].s for b in (*up, *down)) if s >= 0)

    def _kinematic_path(self, start: int, end: int) -> tuple[list[int], list[int]]:
        """The bodies whose joints are passed from one body to another: up to where they meet, then down."""
        up, down = self._to_world(start), self._to_world(end)
        while up and down and up[-1] == down[-1]:
            up, down = up[:-1], down[:-1]
        return up, down[::-1]

    def _rational_pose(self, q_star: ArrayLike, body: int, expressed: int) -> tuple[_Powers, _Powers, list[int]]:
        """X_AB times a common denominator, and that, by powers of s; and which s are on the way from A to B."""
        terms, on_way = self._terms(q_star, body, expressed)
        angles = [k for k in on_way if k in self._cosines]
        numerator: _Powers = {}
        for key, X in terms.items():
            found = {k: which for k, which in (self._angles.get(v.get_id(), (-1, 0)) for v in key) if k >= 0}
            slides = [k for k in on_way if any(v.get_id() == self._s[k].get_id() for v in key)]
            for powers, factor in _expanded(found, angles):
                exponents = [powers.get(k, 0) for k in range(len(self._s))]
                for k in slides:
                    exponents[k] += 1
                place = tuple(exponents)
                numerator[place] = numerator.get(place, 0.0) + factor * X
        denominator: _Powers = {}
        for powers, factor in _expanded({}, angles):
            denominator[tuple(powers.get(k, 0) for k in range(len(self._s)))] = factor
        return numerator, denominator, on_way

    def _to_world(self, body: int) -> list[int]:
        if body != 0 and body not in self._mobilities:
            raise RuntimeError(f"RationalForwardKinematics: the plant has no body {body}.")
        way = []
        while body != 0:
            way.append(body)
            body = self._mobilities[body].parent
        return way

    def _step(self, body: int, q_star: np.ndarray, inverse: bool) -> _Terms:
        """X_PB of a body in its parent, or X_BP."""
        m = self._mobilities[body]
        motion: _Terms = {frozenset(): np.eye(4)}
        if m.s >= 0 and m.is_revolute:
            cos_delta, sin_delta = self._cosines[m.s]
            turns = _turn(m.axis, q_star[m.q])
            keys: tuple[frozenset, ...] = (frozenset(), frozenset([cos_delta]), frozenset([sin_delta]))
            motion = {key: turn.T if inverse else turn for key, turn in zip(keys, turns)}
        elif m.s >= 0:
            slide = np.zeros((4, 4))
            slide[:3, 3] = -m.axis if inverse else m.axis
            motion = {frozenset(): np.eye(4) + q_star[m.q] * slide, frozenset([self._s[m.s]]): slide}
        left, right = (np.linalg.inv(m.X_MB), np.linalg.inv(m.X_PF)) if inverse else (m.X_PF, m.X_MB)
        return {key: left @ E @ right for key, E in motion.items()}

    def ConvertMultilinearPolynomialToRationalFunction(self, e: Polynomial) -> RationalFunction:
        """Returns a polynomial in cos and sin of joints' angles as a rational function of s.

        Args:
            e: The polynomial; in each term, a joint has its cos or its sin, or none.

        Raises:
            RuntimeError: a term has more of a joint.
        """
        rows: list[tuple[dict[int, int], dict[Variable, int], Expression]] = []
        angles: set[int] = set()
        for monomial, coefficient in e.monomial_to_coefficient_map().items():
            found: dict[int, int] = {}
            rest: dict[Variable, int] = {}
            for v, power in monomial.get_powers().items():
                k, which = self._angles.get(v.get_id(), (-1, 0))
                if k < 0:
                    rest[v] = power
                elif power > 1 or k in found:
                    raise RuntimeError(
                        f"ConvertMultilinearPolynomialToRationalFunction(): {monomial} is not multilinear in the "
                        "cos and sin of joints' angles."
                    )
                else:
                    found[k] = which
            rows.append((found, rest, coefficient))
            angles |= set(found)
        numerator: dict[Monomial, Any] = {}
        for found, rest, coefficient in rows:
            for powers, factor in _expanded(found, sorted(angles)):
                key = Monomial({**rest, **{self._s[k]: p for k, p in powers.items()}})
                numerator[key] = numerator.get(key, 0.0) + factor * coefficient
        denominator = {
            Monomial({self._s[k]: 2 for k in chosen}): Expression(1.0)
            for count in range(len(angles) + 1)
            for chosen in itertools.combinations(sorted(angles), count)
        }
        return RationalFunction(Polynomial(numerator), Polynomial(denominator))


def _turn(axis: np.ndarray, angle: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """E0, E1, E2, shape (4, 4), with E0 + cos E1 + sin E2 the turn about an axis by `angle` and a bit more."""
    along = np.outer(axis, axis)
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    across = np.eye(3) - along
    c, s = math.cos(angle), math.sin(angle)
    out = np.zeros((3, 4, 4))
    out[0, :3, :3], out[1, :3, :3], out[2, :3, :3] = along, c * across + s * skew, c * skew - s * across
    out[0, 3, 3] = 1.0
    return out[0], out[1], out[2]


def _polynomials(terms: _Terms) -> np.ndarray:
    """Elements of [R | p] as polynomials, shape (3, 4)."""
    monomials = {key: Monomial({v: 1 for v in key}) for key in terms}
    out = np.empty((3, 4), dtype=object)
    for i, j in np.ndindex(3, 4):
        out[i, j] = Polynomial({monomials[key]: Expression(X[i, j]) for key, X in terms.items() if X[i, j] != 0.0})
    return out


def _expanded(found: dict[int, int], angles: list[int]) -> list[tuple[dict[int, int], float]]:
    """Powers of s and factors of a term: over 1 + s^2 of all angles, cos is 1 - s^2, sin is 2 s, and 1 is 1 + s^2."""
    choices = {0: [(0, 1.0), (2, -1.0)], 1: [(1, 2.0)], None: [(0, 1.0), (2, 1.0)]}
    out = []
    for picked in itertools.product(*(choices[found.get(k)] for k in angles)):
        powers = {k: p for k, (p, _) in zip(angles, picked) if p}
        out.append((powers, math.prod(f for _, f in picked)))
    return out
