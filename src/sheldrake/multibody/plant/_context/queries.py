"""What is asked of the tree in a context: kernels, what they are called on, and the stages that they need.

A set of queries is made once for all contexts that are laid out alike, of plants whose trees are alike, and is told at
each call which context is meant. Duals, symbols and kernels as plain Python have a set for each context.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.common._kernels.poses import compose_poses
from sheldrake.common._native import builtin
from sheldrake.common.calls import Calls, CallsInMemory, Memory, Query, object_query
from sheldrake.common.kernel import MISFIT, Kernel
from sheldrake.math import RigidTransform, RigidTransform_
from sheldrake.multibody.math import SpatialVelocity, SpatialVelocity_
from sheldrake.multibody.plant._building.frozen_model import FrozenModel
from sheldrake.multibody.plant._context.dual_calls import DualCalls
from sheldrake.multibody.plant._kernels.ports import write_finite, write_number, write_pose
from sheldrake.multibody.tree import Joint, QuaternionFloatingJoint
from sheldrake.multibody.tree._kernels import dynamics, integrate, jacobians, kinematics, queries
from sheldrake.multibody.tree._kernels.model import BodyPose, TreeWork, make_work, shapes_of_work
from sheldrake.symbolic import Expression

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sheldrake.systems.framework._engine.store import Store

LEVEL_OF_DISCRETE, LEVEL_OF_CONTINUOUS = 1, 2
POSES, INERTIAS, VELOCITIES, ORIGINS = 1, 2, 4, 8
"""Stages: poses of the bodies, inertias, velocities, velocities of the body origins."""
MOST_PLACES = 256
"""How many queries that depend on frames or bodies are kept."""
_INTEGERS, _KEPT_AT = 8, 4
"""Of a room: so many integers come first, and where two of them are for `CallsInMemory`."""
_MOST_SETS = 16
"""For how many trees queries are kept in layouts that are alike."""


class Numbers(NamedTuple):
    """A context as arrays: what is in its slab, and what queries leave for each other."""

    x: np.ndarray
    q: np.ndarray
    v: np.ndarray
    p: np.ndarray
    work: TreeWork
    V_WB: np.ndarray
    """Of the body origins, by row, shape (num_bodies, 6)."""
    side: np.ndarray
    room: np.ndarray
    """What counts writes, see `Store.rooms`, and what is known of the stages."""
    level: int
    """Of the counter that changes with the state."""


def _refuse(*_: object) -> int:
    return MISFIT


def no_rotation(joints: Sequence[Joint], q: np.ndarray) -> str:
    """What is wrong with positions in which quaternions of joints are zero; empty where none is."""
    floating = [joint for joint in joints if isinstance(joint, QuaternionFloatingJoint)]
    lost = [repr(j.name()) for j in floating if all(x == 0.0 for x in q[j.position_start() :][:4])]
    if not lost:
        return ""
    names = ", ".join(lost[:10]) + (f" and {len(lost) - 10} more" if len(lost) > 10 else "")
    return (
        f"all elements of a quaternion are zero, which is no rotation. It happened at the joints {names}; without "
        "rotation a quaternion is (1, 0, 0, 0), which comes first in q"
    )


def _refuse_poses(at: slice, S: np.ndarray, joints: Any) -> None:
    joints = getattr(joints, "owner", joints)  # those of `Addresses`
    raise RuntimeError(f"{joints[0].GetParentPlant()._describe()}: {no_rotation(joints, S[at])}.")


def _shapes(frozen: FrozenModel) -> list[tuple[int, ...]]:
    return [*shapes_of_work(frozen.tree), (frozen.num_bodies, 6)]


def new_room(frozen: FrozenModel) -> np.ndarray:
    """What queries of a context of floats leave for each other: integers, behind them floats."""
    return np.zeros(_INTEGERS + sum(map(math.prod, _shapes(frozen))), np.int64)


def work_in(room: np.ndarray, frozen: FrozenModel) -> tuple[TreeWork, np.ndarray]:
    """What of that is `Numbers.work` and `V_WB`."""
    views, at, numbers = [], _INTEGERS, room.view(float)
    for shape in _shapes(frozen):
        views.append(numbers[at : at + math.prod(shape)].reshape(shape))
        at += views[-1].size
    return TreeWork._make(views[:-1]), views[-1]


def queries_of_all(store: Store, n: int, frozen: FrozenModel) -> Queries:
    """The queries of all contexts that are laid out like this one, whose calls are given a `Memory`."""
    layout, form = store.layout, (n, frozen.nq, frozen.nv, frozen.addresses.form)
    known = layout.made.setdefault("queries", {})
    found = known.get(form)
    if found is None:
        if len(known) >= _MOST_SETS:
            known.clear()
        like = Memory(np.zeros(layout.size), store.I.copy(), new_room(frozen), frozen.addresses)
        numbers = _numbers(store, n, frozen, like.slab, like.side, like.room)
        start = state_of(store, n)[0].start
        refuse = partial(_refuse_poses, slice(start, start + frozen.nq))
        calls = CallsInMemory(like, numbers.level, _KEPT_AT, refuse)
        found = known[form] = Queries(frozen, float, calls, numbers)
    return found


def queries_of_one(store: Store, n: int, frozen: FrozenModel, T: type) -> Queries:
    """The queries of one context, of any scalar."""
    room = store.rooms.setdefault(n, new_room(frozen))
    numbers = _numbers(store, n, frozen, store.S, store.I, room)
    if T is not float:
        work, V_WB = make_work(frozen.tree, object), _zeros(T, frozen.num_bodies, 6)
        numbers = numbers._replace(work=work, V_WB=V_WB)
    counter, q = store.I[numbers.level : numbers.level + 1], numbers.q
    refuse = partial(_refuse_poses, slice(0, frozen.nq), q, frozen.joints)
    if T is AutoDiffXd:
        calls: Any = DualCalls(counter, store.I[:1], numbers.x, numbers.p, (q, numbers.v), refuse)
    else:
        calls = Calls(counter, store.native, refuse)
    return Queries(frozen, T, calls, numbers)


def _numbers(store: Store, n: int, frozen: FrozenModel, S: np.ndarray, side: np.ndarray, room: np.ndarray) -> Numbers:
    state, level = state_of(store, n)
    x, p = S[state], S[slice(*store.layout.places[n].p)]
    q, v = x[: frozen.nq], x[frozen.nq : frozen.nq + frozen.nv]
    return Numbers(x, q, v, p, *work_in(room, frozen), side, room[:_INTEGERS], level)


def can_be_of_all(store: Store) -> bool:
    """Whether queries of a context may be those of all that are laid out alike."""
    return store.native and builtin.available()


def state_of(store: Store, n: int) -> tuple[slice, int]:
    """Where the state of a plant is in the slab, and the level of its counter."""
    place = store.layout.places[n]
    if place.groups[1] > place.groups[0]:
        return slice(*place.xd), LEVEL_OF_DISCRETE
    return slice(*place.xc), LEVEL_OF_CONTINUOUS


def _zeros(T: Any, *shape: int) -> np.ndarray:
    return np.zeros(shape) if T is float else np.full(shape, T(0.0), dtype=object)


def _kept(make: Callable[..., Any]) -> Callable[..., Any]:
    """A query for each choice of frames or bodies, made once."""

    @functools.wraps(make)
    def get(self: Queries, *key: Any) -> Any:
        ask = self._kept.get((make, key))
        if ask is None:
            if len(self._kept) >= MOST_PLACES:
                self._kept.clear()
            ask = self._kept[make, key] = make(self, *key)
        return ask

    return get


class Queries:
    """Queries on the tree of a plant. Each gives a new array, or an int when what it is given does not fit.

    Rows and frames are given as `ends`, see `jacobians.Ends`.
    """

    def __init__(self, frozen: FrozenModel, T: Any, calls: Any, numbers: Numbers):
        self.T, self.calls, self.numbers = T, calls, numbers
        self.model, self._forces = frozen.tree, frozen.forces
        self._damping_at, self._rows = frozen.damping_at, frozen.rows
        self.nq, self.nv, self.nb = frozen.nq, frozen.nv, frozen.num_bodies
        self.x, self.q, self.v, self.p, self.work, self.V_WB, *_ = numbers
        poses = kinematics.position_kinematics if T is Expression else kinematics.poses_of_rotations
        calls.stage(poses, self.model, self.p, self.work, self.q)
        calls.stage(dynamics.body_inertias, self.model, self.p, self.work)
        calls.stage(kinematics.velocity_kinematics, self.model, self.p, self.work, self.q, self.v)
        calls.stage(kinematics.body_velocities, self.model, self.work, self.V_WB)
        self._kept: dict[Any, Any] = {}

    def zeros(self, *shape: int) -> np.ndarray:
        """An array of zeros of the context's scalar type."""
        return _zeros(self.T, *shape)

    # --- stages

    @cached_property
    def ask_poses(self) -> Query:
        """Only brings stages up to date."""
        return self.calls.stages(POSES)

    @cached_property
    def ask_positions(self) -> Query:
        """Only brings stages up to date."""
        return self.calls.stages(POSES | INERTIAS)

    @cached_property
    def ask_velocities(self) -> Query:
        """Only brings stages up to date."""
        return self.calls.stages(POSES | INERTIAS | VELOCITIES)

    @cached_property
    def ask_body_velocities(self) -> Query:
        """Spatial velocities of the body origins, by row, shape (num_bodies, 6)."""
        needs = POSES | VELOCITIES | ORIGINS
        if self.T is not float:
            return self.calls.stages(needs, answer=self.V_WB)
        return self.calls.part(needs, self.V_WB.reshape(-1), self.nb, 6)

    # --- writing

    def _query_to_write(self, kernel: Kernel, given: tuple, target: np.ndarray) -> Query:
        if self.T is not float:
            return _refuse
        numbers = self.numbers
        arguments = *given, target, numbers.side, numbers.room, numbers.level
        return self.calls.query(kernel, *arguments, given=kernel.names[: len(given)])

    @_kept
    def writer(self, part: str, at: int, size: int) -> Query:
        """Sets positions ("q") or velocities ("v") from number `at` on: 0 when they are finite.

        They are given as an array of `size` numbers, or for 0 as a number; for "pose" as a rotation matrix and a
        position.
        """
        numbers = self.v if part == "v" else self.q
        if part == "pose":
            return self._query_to_write(write_pose, (np.eye(3), np.zeros(3)), numbers[at : at + 7])
        if not size:
            return self._query_to_write(write_number, (0.0,), numbers[at : at + 1])
        return self._query_to_write(write_finite, (np.zeros(size),), numbers[at : at + size])

    @cached_property
    def write_q(self) -> Query:
        """Sets the given positions: 0 when they are an array of nq finite numbers."""
        return self._query_to_write(write_finite, (np.zeros(self.nq),), self.q)

    @cached_property
    def write_v(self) -> Query:
        """Sets the given velocities: 0 when they are an array of nv finite numbers."""
        return self._query_to_write(write_finite, (np.zeros(self.nv),), self.v)

    @cached_property
    def write_x(self) -> Query:
        """Sets the given state: 0 when it is an array of nq + nv finite numbers."""
        size = self.nq + self.nv
        return self._query_to_write(write_finite, (np.zeros(size),), self.x[:size])

    # --- dynamics

    @cached_property
    def ask_mass_matrix(self) -> Query:
        """M(q)."""
        M, needs = self.zeros(self.nv, self.nv), POSES | INERTIAS
        return self.calls.query(queries.calc_mass_matrix, self.model, self.p, self.work, M, needs=needs, answer=M)

    @cached_property
    def ask_bias(self) -> Query:
        """C(q, v) v."""
        bias, needs = self.zeros(self.nv), POSES | INERTIAS | VELOCITIES
        return self.calls.query(queries.calc_bias, self.model, self.work, bias, needs=needs, answer=bias)

    @cached_property
    def ask_gravity(self) -> Query:
        """tau_g(q)."""
        tau, needs = self.zeros(self.nv), POSES | INERTIAS
        return self.calls.query(queries.calc_gravity, self.model, self.work, tau, needs=needs, answer=tau)

    @cached_property
    def ask_inverse_dynamics(self) -> Query:
        """tau, given vdot, applied spatial forces by row, and applied generalized forces."""
        vdot, F, applied, tau = np.zeros(self.nv), np.zeros((self.nb, 6)), np.zeros(self.nv), self.zeros(self.nv)
        arguments = (self.model, self.p, self.work, vdot, F, applied, self.zeros(self.nb, 6), tau)
        return self.calls.query(
            queries.calc_inverse_dynamics,
            *arguments,
            given=("vdot", "F_Bo_W", "applied"),
            needs=POSES | INERTIAS | VELOCITIES,
            answer=tau,
        )

    @cached_property
    def ask_mass(self) -> Query:
        """Mass of bodies, shape (1,), given 1 for each of them, by row, and 0 for the others."""
        mass = self.zeros(1)
        arguments = self.model, self.p, np.zeros(self.nb), mass
        return self.calls.query(queries.calc_mass, *arguments, given=("mask",), answer=mass)

    @cached_property
    def ask_centre_of_mass(self) -> Query:
        """Position of the centre of mass of bodies, given as for `ask_mass`; 1 where they have no mass."""
        centre, needs = self.zeros(3), POSES | INERTIAS
        arguments = self.model, self.work, np.zeros(self.nb), centre
        return self.calls.query(queries.calc_centre_of_mass, *arguments, given=("mask",), needs=needs, answer=centre)

    @cached_property
    def ask_velocity_of_centre(self) -> Query:
        """Velocity of the centre of mass of bodies, given as for `ask_mass`; 1 where they have no mass."""
        v, needs = self.zeros(3), POSES | INERTIAS | VELOCITIES
        arguments = self.model, self.work, np.zeros(self.nb), v
        return self.calls.query(queries.calc_velocity_of_centre, *arguments, given=("mask",), needs=needs, answer=v)

    @cached_property
    def ask_acceleration_of_centre(self) -> Query:
        """Acceleration of the same, given the bodies and accelerations of the body origins."""
        a, needs = self.zeros(3), POSES | INERTIAS | VELOCITIES
        arguments = self.model, self.work, np.zeros(self.nb), self.zeros(self.nb, 6), a
        kernel = queries.calc_acceleration_of_centre
        return self.calls.query(kernel, *arguments, given=("mask", "A_WB"), needs=needs, answer=a)

    @cached_property
    def ask_momentum(self) -> Query:
        """Spatial momentum of bodies, given as for `ask_mass`, about a given point."""
        L = self.zeros(6)
        return self.calls.query(
            queries.calc_momentum,
            *(self.model, self.work, np.zeros(self.nb), np.zeros(3), L),
            given=("mask", "point"),
            needs=POSES | INERTIAS | VELOCITIES,
            answer=L,
        )

    @cached_property
    def ask_kinetic_energy(self) -> Query:
        """Energy of motion, shape (1,)."""
        E, needs = self.zeros(1), POSES | INERTIAS | VELOCITIES
        arguments = (self.model, self.p, self.work, self.v, E)
        return self.calls.query(queries.calc_kinetic_energy, *arguments, needs=needs, answer=E)

    @cached_property
    def ask_potential_energy(self) -> Query:
        """Energy of gravity and force elements, shape (1,)."""
        E, needs = self.zeros(1), POSES | INERTIAS
        arguments = self.model, self._forces, self.p, self.work, self.q, E
        return self.calls.query(queries.calc_potential_energy, *arguments, needs=needs, answer=E)

    @cached_property
    def ask_powers(self) -> Query:
        """Powers of conservative and of dissipative forces of gravity and force elements, shape (2,)."""
        P, needs = self.zeros(2), POSES | INERTIAS | VELOCITIES
        arguments = self.model, self._forces, self.p, self.work, self.q, self.v, P
        return self.calls.query(queries.calc_powers, *arguments, needs=needs, answer=P)

    @cached_property
    def ask_qdot(self) -> Query:
        """N(q) v, given v."""
        qdot = self.zeros(self.nq)
        arguments = self.model, self.q, self.zeros(self.nv), qdot
        return self.calls.query(integrate.qdot_of_velocity, *arguments, given=("v",), answer=qdot)

    @cached_property
    def ask_velocity_of_qdot(self) -> Query:
        """N⁺(q) qdot, given qdot."""
        v = self.zeros(self.nv)
        arguments = self.model, self.q, self.zeros(self.nq), v
        return self.calls.query(integrate.velocity_of_qdot, *arguments, given=("qdot",), answer=v)

    @cached_property
    def ask_velocity_map(self) -> Query:
        """The transpose of N(q)."""
        columns = self.zeros(self.nv, self.nq)
        arguments = self.model, self.q, self.zeros(self.nv), self.zeros(self.nq), columns
        return self.calls.query(integrate.qdot_of_velocity_map, *arguments, answer=columns)

    @cached_property
    def ask_qdot_map(self) -> Query:
        """The transpose of N⁺(q)."""
        columns = self.zeros(self.nq, self.nv)
        arguments = self.model, self.q, self.zeros(self.nq), self.zeros(self.nv), columns
        return self.calls.query(integrate.velocity_of_qdot_map, *arguments, answer=columns)

    @cached_property
    def ask_accelerations(self) -> Query:
        """A_WB of the body origins by row, given vdot."""
        A, needs = self.zeros(self.nb, 6), POSES | INERTIAS | VELOCITIES
        arguments = self.model, self.work, self.zeros(self.nv), A
        return self.calls.query(queries.calc_accelerations, *arguments, given=("vdot",), needs=needs, answer=A)

    @cached_property
    def ask_generalized_forces(self) -> Query:
        """Generalized forces, given spatial forces at the body origins, by row."""
        tau = self.zeros(self.nv)
        arguments = self.model, self.work, self.zeros(self.nb, 6), tau
        kernel = queries.calc_generalized_forces
        return self.calls.query(kernel, *arguments, given=("F_Bo_W",), needs=POSES, answer=tau)

    @cached_property
    def ask_contribution(self) -> Query:
        """Forces of all force elements at the body origins, by body, then generalized ones, damping too, all flat."""
        F_rows, model = self.zeros(self.nb, 6), (self.model, self._forces)
        arguments = *model, self.p, self.work, self.q, self.v, self._damping_at, self._rows
        found = self.zeros(F_rows.size + self.nv)
        results = F_rows, found[: F_rows.size].reshape(-1, 6), found[F_rows.size :]
        needs = POSES | INERTIAS | VELOCITIES
        return self.calls.query(queries.calc_contribution, *arguments, *results, needs=needs, answer=found)

    @cached_property
    def ask_jacobian_of_centre(self) -> Query:
        """Jacobian of the velocity of the centre of mass of bodies, given as for `ask_mass`, shape (3, nv)."""
        J, needs = self.zeros(3, self.nv), POSES | INERTIAS
        arguments = self.model, self.work, np.zeros(self.nb), J
        return self.calls.query(jacobians.calc_jacobian_of_centre, *arguments, given=("mask",), needs=needs, answer=J)

    # --- frames

    @_kept
    def jacobian(self, *ends: int) -> Query:
        """The Jacobian of a given point, shape (6, nv)."""
        J, places = self.zeros(6, self.nv), _frames(ends)
        arguments = self.model, self.p, self.work, places, np.zeros(3), J
        return self.calls.query(jacobians.calc_frame_jacobian, *arguments, given=("point",), needs=POSES, answer=J)

    @_kept
    def point_velocity(self, *ends: int) -> Query:
        """The spatial velocity of a given point, shape (6,)."""
        V, needs = self.zeros(6), POSES | VELOCITIES
        arguments = self.model, self.p, self.work, _frames(ends), np.zeros(3), V
        return self.calls.query(jacobians.calc_point_velocity, *arguments, given=("point",), needs=needs, answer=V)

    @_kept
    def point_acceleration(self, *ends: int) -> Query:
        """The spatial acceleration of a point, given those of the body origins and it."""
        A, needs = self.zeros(6), POSES | VELOCITIES
        arguments = self.model, self.p, self.work, _frames(ends), self.zeros(self.nb, 6), np.zeros(3), A
        kernel = jacobians.calc_point_acceleration
        return self.calls.query(kernel, *arguments, given=("A_WB", "point"), needs=needs, answer=A)

    @_kept
    def bias_acceleration(self, *ends: int) -> Query:
        """The spatial acceleration of a given point that does not depend on vdot."""
        A, needs = self.zeros(6), POSES | VELOCITIES
        arguments = self.model, self.p, self.work, _frames(ends), np.zeros(3), A
        return self.calls.query(jacobians.calc_bias_acceleration, *arguments, given=("point",), needs=needs, answer=A)

    @_kept
    def frame_velocity(self, *ends: int) -> Callable[..., SpatialVelocity]:
        """The spatial velocity of frame B in A, expressed in E."""
        V, cls = self.zeros(6), SpatialVelocity_[self.T]
        arguments, needs = (self.model, self.p, self.work, _frames(ends), self.zeros(3), V), POSES | VELOCITIES
        if self.T is float:
            ask = self.calls.query(jacobians.calc_point_velocity, *arguments, needs=needs, answer=V, frozen=True)
            return object_query(cls, _c=ask)
        ask = self.calls.query(jacobians.calc_point_velocity, *arguments, needs=needs, answer=V)
        return lambda: cls._make(ask())

    @_kept
    def spatial_inertia(self, *place: int) -> Query:
        """The spatial inertia of bodies, given as for `ask_mass`, about the origin of a frame, expressed in it.

        It gives thirteen numbers, mass, centre of mass and unit inertia by rows, or 1 where they have no mass. `place`
        has the rows of the frame's body and of the frame.
        """
        found, needs = self.zeros(13), POSES | INERTIAS
        arguments = self.model, self.p, self.work, np.zeros(self.nb), _frames((*place, 0, -1, 0, -1)), found
        return self.calls.query(jacobians.calc_inertia, *arguments, given=("mask",), needs=needs, answer=found)

    @_kept
    def relative_pose(self, *ends: int) -> Query:
        """The pose of a frame in another, twelve numbers; `ends` without those of E."""
        X = self.zeros(12)
        pose = jacobians.RelativePose(X.reshape(1, 12))
        arguments = self.model, self.p, self.work, _frames((*ends, 0, -1)), pose
        return self.calls.query(jacobians.calc_relative_pose, *arguments, needs=POSES, answer=X)

    @_kept
    def point_position(self, *ends: int) -> Query:
        """The position of a given point of a frame in another, shape (3,); as `relative_pose`."""
        position = self.zeros(3)
        arguments = self.model, self.p, self.work, _frames((*ends, 0, -1)), np.zeros(3), position
        kernel = jacobians.calc_point_position
        return self.calls.query(kernel, *arguments, given=("point",), needs=POSES, answer=position)

    @_kept
    def transform(self, *ends: int) -> Callable[..., RigidTransform]:
        """The same as `relative_pose` as a RigidTransform, of floats."""
        X = self.zeros(12)
        pose, R_AB = jacobians.RelativePose(X.reshape(1, 12)), X[:9].reshape(3, 3)
        arguments = self.model, self.p, self.work, _frames((*ends, 0, -1)), pose
        ask_R = self.calls.query(jacobians.calc_relative_pose, *arguments, needs=POSES, answer=R_AB, frozen=True)
        ask_p = self.calls.stages(0, answer=X[9:], frozen=True)  # the kernel has run then
        return RigidTransform_[self.T]._maker(ask_R, ask_p)

    # --- bodies

    @_kept
    def body_pose(self, row: int) -> Callable[..., RigidTransform]:
        """The pose of the body of a row."""
        if self.T is not float:  # rotation and position at once
            ask, make = self.calls.stages(POSES, answer=self.work.X_WB[row][:12]), RigidTransform_[self.T]._make
            return lambda: make((X := ask())[:9].reshape(3, 3), X[9:])
        R_WB, p_WB = self._pose(row)
        ask_R = self.calls.part(POSES, R_WB, 3, 3)
        return RigidTransform_[self.T]._maker(ask_R, self.calls.part(POSES, p_WB, 3))

    def pose_of(self, row: int, X_BG: RigidTransform) -> Callable[..., RigidTransform]:
        """The pose of what is fixed to the body of a row."""
        R_WG, p_WG = self.zeros(9), self.zeros(3)
        arguments = *self._pose(row), X_BG.rotation().matrix().ravel(), X_BG.translation().copy(), R_WG, p_WG
        answer = R_WG.reshape(3, 3)
        ask_R = self.calls.query(compose_poses, *arguments, needs=POSES, answer=answer, frozen=True)
        ask_p = self.calls.stages(0, answer=p_WG, frozen=True)  # the kernel has run then
        return RigidTransform_[self.T]._maker(ask_R, ask_p)

    @_kept
    def body_velocity(self, row: int) -> Callable[..., SpatialVelocity]:
        """The spatial velocity of the origin of the body of a row."""
        needs, numbers = POSES | VELOCITIES | ORIGINS, self.V_WB[row]
        if self.T is float:
            return object_query(SpatialVelocity_[self.T], _c=self.calls.part(needs, numbers, 6))
        return object_query(SpatialVelocity_[self.T], _c=self.calls.stages(needs, answer=numbers, frozen=True))

    def _pose(self, row: int) -> tuple[np.ndarray, np.ndarray]:
        """Rotation and position of the body of a row."""
        X_WB = self.work.X_WB[row]
        return X_WB[BodyPose.R_WB.columns], X_WB[BodyPose.p_WB.columns]


def _frames(ends: tuple[int, ...]) -> jacobians.Frames:
    return jacobians.Frames(np.array(ends, np.int64))
