"""Constraints between joints and between bodies, which the discrete update keeps."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sheldrake.common._checked import checked
from sheldrake.math import RigidTransform
from sheldrake.multibody.plant._building.elements import ConstraintRecord, Elements
from sheldrake.multibody.plant._building.frozen_model import FrozenModel
from sheldrake.multibody.plant._building.settings import Settings
from sheldrake.multibody.tree import BodyIndex, Joint, MultibodyConstraintId, RigidBody
from sheldrake.multibody.tree._element import NamedElement, finite, vector
from sheldrake.multibody.tree._frame import pose_numbers
from sheldrake.multibody.tree._owner import ContextNumbers
from sheldrake.systems.framework import Context
from sheldrake.systems.framework._vector import plain


@checked
class DistanceConstraintParams:
    """What a distance constraint keeps: points P of body A and Q of body B at a distance, with a spring and damper."""

    def __init__(
        self,
        bodyA: BodyIndex | None = None,
        p_AP: ArrayLike = (0.0, 0.0, 0.0),
        bodyB: BodyIndex | None = None,
        p_BQ: ArrayLike = (0.0, 0.0, 0.0),
        distance: float = 1.0,
        stiffness: float = np.inf,
        damping: float = 0.0,
    ):
        """
        Args:
            bodyA: Body A.
            p_AP: P in A [m], shape (3,).
            bodyB: Body B.
            p_BQ: Q in B [m], shape (3,).
            distance: [m], positive.
            stiffness: [N/m], positive, may be infinite.
            damping: [N s/m], not negative.

        Raises:
            RuntimeError: both bodies are the same, or a number is out of range.
        """
        if bodyA is not None and bodyA == bodyB and BodyIndex(bodyA).is_valid():
            raise RuntimeError(f"DistanceConstraintParams(): bodyA and bodyB are the same body, {bodyA!r}.")
        if not (distance > 0.0 and stiffness > 0.0 and damping >= 0.0):
            raise RuntimeError(
                "DistanceConstraintParams(): needs distance > 0, stiffness > 0 and damping >= 0, not "
                f"{distance}, {stiffness} and {damping}."
            )
        self._A, self._B = BodyIndex() if bodyA is None else bodyA, BodyIndex() if bodyB is None else bodyB
        self._p_AP = vector("DistanceConstraintParams", "p_AP", p_AP, 3)
        self._p_BQ = vector("DistanceConstraintParams", "p_BQ", p_BQ, 3)
        self._distance, self._stiffness, self._damping = float(distance), float(stiffness), float(damping)

    def bodyA(self) -> BodyIndex:
        """Body A."""
        return self._A

    def bodyB(self) -> BodyIndex:
        """Body B."""
        return self._B

    def p_AP(self) -> np.ndarray:
        """P in A [m], shape (3,)."""
        return self._p_AP.copy()

    def p_BQ(self) -> np.ndarray:
        """Q in B [m], shape (3,)."""
        return self._p_BQ.copy()

    def distance(self) -> float:
        """The distance [m]."""
        return self._distance

    def stiffness(self) -> float:
        """Stiffness [N/m]."""
        return self._stiffness

    def damping(self) -> float:
        """Damping [N s/m]."""
        return self._damping

    def _numbers(self) -> list[float]:
        return [*self._p_AP, *self._p_BQ, self._distance, self._stiffness, self._damping]

    def __copy__(self) -> DistanceConstraintParams:
        return DistanceConstraintParams(
            self._A, self._p_AP, self._B, self._p_BQ, self._distance, self._stiffness, self._damping
        )

    def __deepcopy__(self, memo: dict) -> DistanceConstraintParams:
        return copy.copy(self)


class Constraints:
    """Registering constraints, before Finalize(), and changing them in contexts.

    Args:
        elements: What constraints join.
        contexts: Where their numbers are.
        settings: kTamsi takes no constraints.
    """

    def __init__(self, elements: Elements, contexts: ContextNumbers, settings: Settings) -> None:
        self._elements, self._contexts, self._settings = elements, contexts, settings

    def require_rows(self, call: str) -> None:
        """Makes sure that the plant's solver takes constraints.

        Raises:
            RuntimeError: it does not.
        """
        if self._settings.is_discrete() and not self._settings.kind.scalar_rows:
            raise RuntimeError(
                f"{call}(): Currently this MultibodyPlant is set to use the TAMSI solver, which takes no constraints. "
                "Choose another DiscreteContactApproximation."
            )

    def _add(
        self, call: str, kind: str, A: NamedElement, B: NamedElement, numbers: Iterable[float], **options: Any
    ) -> MultibodyConstraintId:
        self._elements.require_not_finalized(call)
        self.require_rows(call)
        self._elements.require_mine(call, A, B)
        values = [float(x) for x in numbers]
        if any(map(math.isnan, values)):
            raise RuntimeError(f"{call}(): a number is nan among {values}.")
        new = MultibodyConstraintId.get_new_id()
        self._elements.constraints[new] = ConstraintRecord(kind, A, B, values, **options)
        return new

    @checked
    def AddCouplerConstraint(
        self, joint0: Joint, joint1: Joint, gear_ratio: float, offset: float = 0.0
    ) -> MultibodyConstraintId:
        """Keeps q0 = gear_ratio q1 + offset for two joints of one degree of freedom.

        Raises:
            RuntimeError: a joint has more, the plant is continuous, uses TAMSI, or is finalized.
        """
        for joint in (joint0, joint1):
            if joint.num_velocities() != 1:
                raise RuntimeError(
                    f"AddCouplerConstraint(): Coupler constraint can only be defined on single-DOF joints. However "
                    f"joint '{joint.name()}' has {joint.num_velocities()} degrees of freedom."
                )
        numbers = finite("AddCouplerConstraint", "gear_ratio and offset", [gear_ratio, offset])
        return self._add("AddCouplerConstraint", "coupler", joint0, joint1, numbers)

    def AddTendonConstraint(
        self,
        joints: Sequence[Joint],
        a: ArrayLike,
        offset: float | None = None,
        lower_limit: float | None = None,
        upper_limit: float | None = None,
        stiffness: float | None = None,
        damping: float | None = None,
    ) -> MultibodyConstraintId:
        """Keeps the length sum(a_i q_i) + offset of a tendon over joints of one degree of freedom within limits.

        Drake has this in C++ and for the tag `drake:tendon_constraint`, not in pydrake.

        Args:
            joints: Different joints, of one or two trees (in Drake of any number).
            a: A coefficient for each joint.
            offset: 0 by default.
            lower_limit: Infinite by default, as is the other; one must be finite.
            upper_limit: Not below the other.
            stiffness: Positive, in the unit of force per length; infinite by default.
            damping: Not negative; 0 by default.

        Raises:
            RuntimeError: an argument is not as said, the plant is continuous, uses TAMSI, or is finalized. Trees are
                counted by `Finalize()`.
        """
        call, joints, coefficients = "AddTendonConstraint", tuple(joints), np.array(a, dtype=float).ravel()
        lower, upper = (
            (-np.inf if lower_limit is None else lower_limit),
            (np.inf if upper_limit is None else upper_limit),
        )
        k, d = (np.inf if stiffness is None else stiffness), (0.0 if damping is None else damping)
        if not joints or len(set(map(id, joints))) != len(joints) or len(coefficients) != len(joints):
            raise RuntimeError(
                f"{call}(): needs one coefficient for each of one or more different joints, not {len(coefficients)} "
                f"for {[joint.name() for joint in joints]}."
            )
        for joint in joints:
            if joint.num_velocities() != 1:
                raise RuntimeError(
                    f"{call}(): Tendon constraint can only be defined on single-DOF joints. However joint "
                    f"'{joint.name()}' has {joint.num_velocities()} degrees of freedom."
                )
        if not (lower <= upper and (lower > -np.inf or upper < np.inf) and k > 0.0 and 0.0 <= d < np.inf):
            raise RuntimeError(
                f"{call}(): needs lower_limit <= upper_limit, one of them finite, stiffness > 0 and damping >= 0, not "
                f"{lower}, {upper}, {k} and {d}."
            )
        self._elements.require_mine(call, *joints)
        numbers = [offset or 0.0, lower, upper, k, d, *coefficients]
        return self._add(call, "tendon", joints[0], joints[-1], numbers, joints=joints)

    @checked
    def AddDistanceConstraint(
        self,
        body_A: RigidBody,
        p_AP: ArrayLike,
        body_B: RigidBody,
        p_BQ: ArrayLike,
        distance: float,
        stiffness: float = np.inf,
        damping: float = 0.0,
    ) -> MultibodyConstraintId:
        """Keeps a point P of body A and a point Q of body B at a distance [m], with a spring [N/m] and damper [N s/m].

        Raises:
            RuntimeError: a number is out of range, the plant is continuous, uses TAMSI, or is finalized.
        """
        params = DistanceConstraintParams(body_A.index(), p_AP, body_B.index(), p_BQ, distance, stiffness, damping)
        return self._add("AddDistanceConstraint", "distance", body_A, body_B, params._numbers())

    @checked
    def AddBallConstraint(
        self, body_A: RigidBody, p_AP: ArrayLike, body_B: RigidBody, p_BQ: ArrayLike | None = None
    ) -> MultibodyConstraintId:
        """Keeps a point P of body A and a point Q of body B together [m]; Q is by default where P is at the default
        positions.

        Raises:
            RuntimeError: the bodies are the same, the plant is continuous, uses TAMSI, or is finalized.
        """  # fmt: skip
        call = "AddBallConstraint"
        if body_A is body_B:
            raise RuntimeError(f"{call}(): Invalid set of parameters for constraint: bodies A and B are the same.")
        points = [*vector(call, "p_AP", p_AP, 3), *(np.zeros(3) if p_BQ is None else vector(call, "p_BQ", p_BQ, 3))]
        return self._add(call, "ball", body_A, body_B, finite(call, "the points", points), open_point=p_BQ is None)

    @checked
    def AddWeldConstraint(
        self, body_A: RigidBody, X_AP: RigidTransform, body_B: RigidBody, X_BQ: RigidTransform
    ) -> MultibodyConstraintId:
        """Keeps a frame P of body A and a frame Q of body B together.

        Raises:
            RuntimeError: the bodies are the same, the plant is continuous, uses TAMSI, or is finalized.
        """
        if body_A is body_B:
            raise RuntimeError(
                "AddWeldConstraint(): Invalid set of parameters for constraint: bodies A and B are the same."
            )
        P, Q = pose_numbers(X_AP), pose_numbers(X_BQ)
        return self._add("AddWeldConstraint", "weld", body_A, body_B, [*P, *Q])

    @checked
    def RemoveConstraint(self, id: MultibodyConstraintId) -> None:
        """Takes a constraint out again, before Finalize()."""
        self._elements.require_not_finalized("RemoveConstraint")
        self.record("RemoveConstraint", id)
        del self._elements.constraints[id]

    def record(self, call: str, id: MultibodyConstraintId) -> ConstraintRecord:
        """What was registered under an id.

        Raises:
            RuntimeError: nothing was.
        """
        if id not in self._elements.constraints:
            raise RuntimeError(f"{call}(): The constraint id {id!r} does not match any constraint of this plant.")
        return self._elements.constraints[id]

    def num_constraints(self) -> int:
        """Number of constraints."""
        return len(self._elements.constraints)

    def GetConstraintIds(self) -> list[MultibodyConstraintId]:
        """All constraints."""
        return list(self._elements.constraints)

    # --- in a context

    @checked
    def GetConstraintActiveStatus(self, context: Context, id: MultibodyConstraintId) -> bool:
        """Whether a constraint is active in a context."""
        record = self.record("GetConstraintActiveStatus", id)
        return bool(plain(self._contexts.numbers(context, record.group)[0]))

    @checked
    def SetConstraintActiveStatus(self, context: Context, id: MultibodyConstraintId, status: bool) -> None:
        """Makes a constraint active in a context, or not."""
        record = self.record("SetConstraintActiveStatus", id)
        numbers = np.array(self._contexts.numbers(context, record.group))
        numbers[0] = float(status)
        self._contexts.write_numbers(context, record.group, numbers)

    def GetDefaultDistanceConstraintParams(self) -> dict[MultibodyConstraintId, DistanceConstraintParams]:
        """The distance constraints as contexts are made with."""
        return {
            id: self._distance_params(record, record.numbers)
            for id, record in self._elements.constraints.items()
            if record.kind == "distance"
        }

    def _distance_params(self, record: ConstraintRecord, n: Sequence[float] | np.ndarray) -> DistanceConstraintParams:
        return DistanceConstraintParams(record.A.index(), n[:3], record.B.index(), n[3:6], n[6], n[7], n[8])

    @checked
    def GetDistanceConstraintParams(self, context: Context, id: MultibodyConstraintId | None = None) -> Any:
        """A distance constraint as a context has it, or all by id."""
        if id is None:
            return {i: self.GetDistanceConstraintParams(context, i) for i in self.GetDefaultDistanceConstraintParams()}
        record = self.record("GetDistanceConstraintParams", id)
        if record.kind != "distance":
            raise RuntimeError(f"GetDistanceConstraintParams(): constraint {id!r} is no distance constraint.")
        return self._distance_params(record, self._contexts.numbers(context, record.group)[1:])

    @checked
    def SetDistanceConstraintParams(
        self, context: Context, id: MultibodyConstraintId, params: DistanceConstraintParams
    ) -> None:
        """Changes the numbers of a distance constraint in a context; its bodies stay.

        Raises:
            RuntimeError: it is no distance constraint, or joins other bodies than params say.
        """
        record = self.record("SetDistanceConstraintParams", id)
        if record.kind != "distance" or {params.bodyA(), params.bodyB()} != {record.A.index(), record.B.index()}:
            raise RuntimeError(
                f"SetDistanceConstraintParams(): constraint {id!r} is no distance constraint between the bodies of "
                "params."
            )
        active = self._contexts.numbers(context, record.group)[0]
        self._contexts.write_numbers(context, record.group, [active, *params._numbers()])

    # --- for the kernels

    def rows(self) -> list[dict[str, Any]]:
        """The constraints as `make_plant_model` takes them.

        Raises:
            NotImplementedError: a tendon pulls at more than two trees.
        """
        model = self._elements.model("Finalize")
        rows: list[dict[str, Any]] = []
        tendons = 0
        for record in self._elements.constraints.values():
            start = model.parameters.starts[record.group]
            if record.kind == "coupler":
                ends = dict(a=record.A._v_start, b=record.B._v_start, q_a=record.A._q_start, q_b=record.B._q_start)
            elif record.kind == "tendon":
                joints = sorted((j._v_start, j._q_start, i) for i, j in enumerate(record.joints))
                _require_two_trees(model, record)
                ends = dict(a=tendons, b=tendons + len(joints), joints=joints)
                tendons += len(joints)
            else:
                ends = dict(a=int(model.row_of(record.A)), b=int(model.row_of(record.B)))
            rows.append(dict(kind=record.kind, active=start, p=start + 1, **ends))
        return rows


def _require_two_trees(model: FrozenModel, tendon: ConstraintRecord) -> None:
    trees = {int(model.tree.dofs[joint._v_start].tree) for joint in tendon.joints}
    if len(trees) > 2:
        names = ", ".join(joint.name() for joint in tendon.joints)
        raise NotImplementedError(
            f"Finalize(): the tendon over joints {names} pulls at {len(trees)} trees; more than two are not "
            "implemented."
        )
