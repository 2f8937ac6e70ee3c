"""One context of a plant as arrays, and the queries on them.

Between the calls of users and the tree's kernels: it binds a kernel to a context's memory once, and knows which stages
are up to date.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.common import quick
from sheldrake.common._kernels.poses import compose_poses
from sheldrake.common.calls import Calls, Query, object_query
from sheldrake.common.kernel import MISFIT, Kernel
from sheldrake.math import RigidTransform, RigidTransform_
from sheldrake.multibody.math import SpatialVelocity, SpatialVelocity_
from sheldrake.multibody.math._kernels.spatial import inertia_of_ten
from sheldrake.multibody.math._spatial_inertia import SPATIAL_INERTIA
from sheldrake.multibody.plant._building.frozen_model import FrozenModel
from sheldrake.multibody.plant._context.dual_calls import DualCalls
from sheldrake.multibody.plant._kernels.ports import write_finite, write_number, write_pose
from sheldrake.multibody.tree import Frame, Joint, QuaternionFloatingJoint, RigidBody
from sheldrake.multibody.tree._kernels import dynamics, integrate, jacobians, kinematics, queries
from sheldrake.multibody.tree._kernels.model import BodyPose, TreeWork, make_work
from sheldrake.symbolic import Expression
from sheldrake.systems.framework import Context

if TYPE_CHECKING:
    from sheldrake.common._types import KernelArgument
    from sheldrake.multibody.math import SpatialInertia
    from sheldrake.systems.framework import System

_LEVEL_OF_DISCRETE, _LEVEL_OF_CONTINUOUS = 1, 2
_MOST_PLACES = 256
"""How many queries that depend on frames are kept."""


def _refuse(*_: object) -> int:
    return MISFIT


def _refuse_poses(joints: Sequence[Joint], q: np.ndarray, plant: System) -> None:
    raise RuntimeError(f"{plant._describe()}: {no_rotation(joints, q)}.")


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


class View:
    """One context of a plant as arrays: views of its memory, a workspace, and queries bound to both.

    Stages (poses, inertias, velocities, velocities of the body origins) are computed when a query needs them and kept
    until a source of the plant's state or parameters is written. `ask_*` are queries: each gives a new array.
    """

    def __init__(self, frozen: FrozenModel, family: object, context: Context):
        """
        Args:
            frozen: The model of the plant.
            family: Which plants may use the view.
            context: What is viewed.
        """
        store, place = context._store, context._place
        is_discrete = place.groups[1] > place.groups[0]
        state, p = slice(*(place.xd if is_discrete else place.xc)), slice(*place.p)
        self.frozen = frozen
        self.S = store.S
        self._changes, self._by_python = store.I[:3], store.by_python  # not the store itself, which holds its views
        self.level = _LEVEL_OF_DISCRETE if is_discrete else _LEVEL_OF_CONTINUOUS
        self.nq, self.nv, self.nb = frozen.nq, frozen.nv, frozen.num_bodies
        x = store.S[state]
        self.x, self.q, self.v, self.p = x, x[: self.nq], x[self.nq : self.nq + self.nv], store.S[p]
        self.results: tuple[int, Any, int] | None = None
        """The stamp of a state, the scratch of a step from it or of its derivatives, and the status they ended with."""
        self.accelerations: tuple[Any, np.ndarray] | None = None
        """Results of a state, and the accelerations of the body origins that follow from them."""
        self.rehearsal: Any = None
        """Scratch and bound kernels that results of the present state come from, once they were asked for."""
        self.contact_room: Any = None
        """What point contacts are put together in, once they were asked for."""
        self.reactions: Any = None
        """What reaction forces are computed in, once they were asked for."""
        self.distances: dict[bool, Any] = {}
        """What finds distances of geometries for those who plan, of a pair alone or not, once they were asked for."""
        self.forms: dict[int, Any] = {}
        """What computes so many numbers of where frames are in others, for constraints, once they were asked for."""
        self._in_step: tuple[Any, Query] | None = None
        """The tree of a step, and the query of accelerations there, once they were asked for."""
        self.applied_force: tuple[np.ndarray, ...] | None = None
        """What applied spatial forces amount to, in the scratch of the step, once they were asked for."""
        self.model, self.native = frozen.tree, store.native
        is_float = store.S.dtype == float
        work, memory = frozen.blank_work.new() if is_float else (make_work(self.model, object), None)
        self.work: TreeWork = work
        self.dtype = store.S.dtype
        self.T, self.family = context._system._scalar, family
        self._types: dict[Any, Any] = {}
        first = place.groups[0] if is_discrete else context._node
        self.source = ("xd", first) if is_discrete else ("xc", first)
        self.written = store.count_writes_of(self.source)
        self._buffers: dict[str, np.ndarray] = {}
        self._bound: dict[Kernel, Query] = {}
        self._applied: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, Query] | None = None
        self.V_WB = self.zeros(self.nb, 6)

        counter = store.I[self.level : self.level + 1]
        refuse = partial(_refuse_poses, frozen.joints, self.q, context._system)
        if self.T is AutoDiffXd:
            self.calls: Any = DualCalls(counter, store.I[:1], self.x, self.p, (self.q, self.v), refuse)
        else:
            self.calls = Calls(counter, self.native, refuse, frozen.templates, (self.work, memory))
        calls = self.calls
        poses = kinematics.position_kinematics if self.T is Expression else kinematics.poses_of_rotations
        self.POSES = calls.stage(poses, self.model, self.p, self.work, self.q)
        self.INERTIAS = calls.stage(dynamics.body_inertias, self.model, self.p, self.work)
        self.VELOCITIES = calls.stage(kinematics.velocity_kinematics, self.model, self.p, self.work, self.q, self.v)
        self.ORIGINS = calls.stage(kinematics.body_velocities, self.model, self.work, self.V_WB)
        self.places: dict[Any, Query] = {}
        self.transforms: dict[tuple[Frame, Frame], Callable[[], RigidTransform]] = {}
        self.poses: dict[RigidBody, Callable[[], RigidTransform]] = {}
        self.writers: dict[tuple[str, int, int], Query] = {}
        self.twists: dict[RigidBody, Callable[[], SpatialVelocity]] = {}
        self.velocities_of: dict[tuple[Frame, Frame, Frame], Callable[[], SpatialVelocity]] = {}
        self._inertias: dict[int, Callable[[], SpatialInertia] | None] = {}
        self._chosen: np.ndarray | None = None

    # --- arrays

    def zeros(self, *shape: int) -> np.ndarray:
        """An array of zeros of the context's scalar type."""
        return np.zeros(shape) if self.dtype == float else np.full(shape, self.T(0.0), dtype=object)

    def buffer(self, name: str, *shape: int) -> np.ndarray:
        """An array that is always the same for this view, for kernels to read or fill."""
        array = self._buffers.get(name)
        if array is None:
            array = self._buffers[name] = self.zeros(*shape)
        return array

    def copy_of(self, work: Any) -> Any:
        """A workspace like `work`, of the context's scalar type."""
        if isinstance(work, np.ndarray):
            return work.copy() if work.dtype == np.int64 else work.astype(self.dtype)
        return type(work)(*(self.copy_of(part) for part in work))

    def integers(self, name: str, size: int) -> np.ndarray:
        """The same for integers."""
        array = self._buffers.get(name)
        if array is None:
            array = self._buffers[name] = np.zeros(size, np.int64)
        return array

    def of(self, family: Any) -> Any:
        """The class of a family for the context's scalar type."""
        cls = self._types.get(family)
        if cls is None:
            cls = self._types[family] = family[self.T]
        return cls

    # --- kernels

    def call(self, kernel: Kernel, *args: KernelArgument) -> int:
        """Runs a kernel on arrays that are new at each call."""
        return (kernel.native if self.native else kernel)(*args) or 0

    def query(
        self, kernel: Kernel, *args: KernelArgument, given: tuple[str, ...], needs: int, answer: np.ndarray
    ) -> Query:
        """As `Calls.query`, on arrays that are always the same for this view; made once."""
        ask = self._bound.get(kernel)
        if ask is None:
            ask = self._bound[kernel] = self.calls.query(kernel, *args, given=given, needs=needs, answer=answer)
        return ask

    # --- stages

    def X_WB(self) -> np.ndarray:
        """Poses of the bodies by row, to be read only."""
        if self.T is AutoDiffXd:
            return self.calls.results(self.POSES, self.work).X_WB
        self._ask_poses()
        return self.work.X_WB

    def positions(self) -> Any:
        """The workspace with `X_WB`, `S` and `inertia`; for duals what it would hold, to be read only."""
        if self.T is AutoDiffXd:
            return self.calls.results(self.POSES | self.INERTIAS, self.work)
        self._ask_positions()
        return self.work

    def velocities(self) -> Any:
        """The workspace with `V` and `A` too; for duals what it would hold, to be read only."""
        if self.T is AutoDiffXd:
            return self.calls.results(self.POSES | self.INERTIAS | self.VELOCITIES, self.work)
        self._ask_velocities()
        return self.work

    def body_velocities(self) -> np.ndarray:
        """Spatial velocities of the body origins, by row, shape (num_bodies, 6)."""
        return self._ask_body_velocities()

    @cached_property
    def _ask_poses(self) -> Query:
        return self.calls.stages(self.POSES)

    @cached_property
    def _ask_positions(self) -> Query:
        return self.calls.stages(self.POSES | self.INERTIAS)

    @cached_property
    def _ask_velocities(self) -> Query:
        return self.calls.stages(self.POSES | self.INERTIAS | self.VELOCITIES)

    @cached_property
    def _ask_body_velocities(self) -> Query:
        return self.calls.stages(self.POSES | self.VELOCITIES | self.ORIGINS, answer=self.V_WB)

    # --- writing

    def _writer(self, target: np.ndarray) -> Query:
        return self._query_to_write(write_finite, (target,), target)

    def _query_to_write(self, kernel: Kernel, given: tuple, target: np.ndarray) -> Query:
        if self.T is not float:
            return _refuse
        arguments = (*given, target, self._changes, self._by_python, self.written, self.level)
        return self.calls.query(kernel, *arguments, given=kernel.names[: len(given)])

    def writer(self, part: str, at: int, size: int) -> Query:
        """Sets positions ("q") or velocities ("v") from number `at` on: 0 when they are finite; kept in `writers`.

        They are given as an array of `size` numbers, or for 0 as a number; for "pose" as a rotation matrix and a
        position.
        """
        target = (self.v if part == "v" else self.q)[at : at + (7 if part == "pose" else size or 1)]
        if part == "pose":
            ask = self._query_to_write(write_pose, (np.eye(3), np.zeros(3)), target)
        else:
            ask = self._writer(target) if size else self._query_to_write(write_number, (0.0,), target)
        self.writers[part, at, size] = ask
        return ask

    @cached_property
    def write_q(self) -> Query:
        """Sets the given positions: 0 when they are an array of nq finite numbers."""
        return self._writer(self.q)

    @cached_property
    def write_v(self) -> Query:
        """Sets the given velocities: 0 when they are an array of nv finite numbers."""
        return self._writer(self.v)

    @cached_property
    def write_x(self) -> Query:
        """Sets the given state: 0 when it is an array of nq + nv finite numbers."""
        return self._writer(self.x)

    # --- dynamics

    @cached_property
    def ask_mass_matrix(self) -> Query:
        """M(q)."""
        M, needs = self.zeros(self.nv, self.nv), self.POSES | self.INERTIAS
        return self.calls.query(queries.calc_mass_matrix, self.model, self.p, self.work, M, needs=needs, answer=M)

    @cached_property
    def ask_bias(self) -> Query:
        """C(q, v) v."""
        bias, needs = self.zeros(self.nv), self.POSES | self.INERTIAS | self.VELOCITIES
        return self.calls.query(queries.calc_bias, self.model, self.work, bias, needs=needs, answer=bias)

    @cached_property
    def ask_gravity(self) -> Query:
        """tau_g(q)."""
        tau, needs = self.zeros(self.nv), self.POSES | self.INERTIAS
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
            needs=self.POSES | self.INERTIAS | self.VELOCITIES,
            answer=tau,
        )

    @cached_property
    def mask(self) -> np.ndarray:
        """1 for each body, by row, that queries of mass, momentum and centre of mass are of."""
        return np.ones(self.nb, np.int64)

    def choose(self, rows: np.ndarray) -> None:
        """Says of which bodies queries of mass, momentum and centre of mass are; `rows` must stay as they are."""
        if self._chosen is not rows:
            self.mask[:] = 0
            self.mask[rows] = 1
            self._chosen = rows

    @cached_property
    def ask_mass(self) -> Query:
        """Mass of the chosen bodies, shape (1,)."""
        mass = self.zeros(1)
        return self.calls.query(queries.calc_mass, self.model, self.p, self.mask, mass, answer=mass)

    @cached_property
    def ask_centre_of_mass(self) -> Query:
        """Position of the centre of mass of the chosen bodies; 1 where they have no mass."""
        centre, needs = self.zeros(3), self.POSES | self.INERTIAS
        arguments = self.model, self.work, self.mask, centre
        return self.calls.query(queries.calc_centre_of_mass, *arguments, needs=needs, answer=centre)

    @cached_property
    def ask_velocity_of_centre(self) -> Query:
        """Velocity of the centre of mass of the chosen bodies; 1 where they have no mass."""
        v, needs = self.zeros(3), self.POSES | self.INERTIAS | self.VELOCITIES
        arguments = self.model, self.work, self.mask, v
        return self.calls.query(queries.calc_velocity_of_centre, *arguments, needs=needs, answer=v)

    @cached_property
    def ask_acceleration_of_centre(self) -> Query:
        """Acceleration of the same, given those of the body origins."""
        a, needs = self.zeros(3), self.POSES | self.INERTIAS | self.VELOCITIES
        arguments = self.model, self.work, self.mask, self.zeros(self.nb, 6), a
        kernel = queries.calc_acceleration_of_centre
        return self.calls.query(kernel, *arguments, given=("A_WB",), needs=needs, answer=a)

    @cached_property
    def ask_momentum(self) -> Query:
        """Spatial momentum of the chosen bodies, given a point."""
        L = self.zeros(6)
        return self.calls.query(
            queries.calc_momentum,
            *(self.model, self.work, self.mask, np.zeros(3), L),
            given=("point",),
            needs=self.POSES | self.INERTIAS | self.VELOCITIES,
            answer=L,
        )

    @cached_property
    def ask_kinetic_energy(self) -> Query:
        """Energy of motion, shape (1,)."""
        E, needs = self.zeros(1), self.POSES | self.INERTIAS | self.VELOCITIES
        arguments = (self.model, self.p, self.work, self.v, E)
        return self.calls.query(queries.calc_kinetic_energy, *arguments, needs=needs, answer=E)

    @cached_property
    def ask_potential_energy(self) -> Query:
        """Energy of gravity and force elements, shape (1,)."""
        E, needs = self.zeros(1), self.POSES | self.INERTIAS
        arguments = self.model, self.frozen.forces, self.p, self.work, self.q, E
        return self.calls.query(queries.calc_potential_energy, *arguments, needs=needs, answer=E)

    @cached_property
    def ask_powers(self) -> Query:
        """Powers of conservative and of dissipative forces of gravity and force elements, shape (2,)."""
        P, needs = self.zeros(2), self.POSES | self.INERTIAS | self.VELOCITIES
        arguments = self.model, self.frozen.forces, self.p, self.work, self.q, self.v, P
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

    def ask_accelerations(self, vdot: np.ndarray) -> np.ndarray:
        """A_WB of the body origins by row for given vdot; an int where it is no vector of the context's scalar."""
        A = self.buffer("A_WB", self.nb, 6)
        arguments = self.model, self.work, self.buffer("vdot", self.nv), A
        needs = self.POSES | self.INERTIAS | self.VELOCITIES
        return self.query(queries.calc_accelerations, *arguments, given=("vdot",), needs=needs, answer=A)(vdot)

    def accelerations_in(self, work: Any, vdot: np.ndarray) -> np.ndarray:
        """The same where `work`, the tree of a step, holds the kinematics; a view remembers one such."""
        if self._in_step is None or self._in_step[0] is not work:
            A = self.zeros(self.nb, 6)
            arguments = self.model, work, self.zeros(self.nv), A
            self._in_step = work, self.calls.query(queries.calc_accelerations, *arguments, given=("vdot",), answer=A)
        return self._in_step[1](vdot)

    def ask_generalized_forces(self, F_Bo_W: np.ndarray) -> np.ndarray:
        """Generalized forces of spatial forces at the body origins, by row; an int where they do not fit."""
        tau = self.buffer("tau_F", self.nv)
        arguments = self.model, self.work, self.buffer("F_Bo_W", self.nb, 6), tau
        ask = self.query(queries.calc_generalized_forces, *arguments, given=("F_Bo_W",), needs=self.POSES, answer=tau)
        return ask(F_Bo_W)

    def applied_forces(self, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, Query]:
        """Room for `count` applied forces, and a query for the generalized forces of those in it.

        Returns:
            Rows of the bodies, the last item the number of forces; points p_BoBq_B; forces F_Bq_W; what the query
            fills with forces by body about `root`; the query.
        """
        found = self._applied
        if found is None or len(found[1]) < count:
            room = max(4, 2 * count)
            rows, points, forces = np.zeros(room + 1, np.int64), np.zeros((room, 3)), np.zeros((room, 6))
            F, tau = self.zeros(self.nb, 6), self.zeros(self.nv)
            arguments = self.model, self.work, rows, points, forces, F, tau
            ask = self.calls.query(queries.calc_applied_forces, *arguments, needs=self.POSES, answer=tau)
            found = self._applied = rows, points, forces, F, ask
        return found

    @cached_property
    def ask_contribution(self) -> Query:
        """Forces of all force elements at the body origins, by body, then generalized ones, damping too, all flat."""
        frozen, F_rows = self.frozen, self.zeros(self.nb, 6)
        arguments = self.model, frozen.forces, self.p, self.work, self.q, self.v, frozen.damping_at, frozen.rows
        found = self.zeros(F_rows.size + self.nv)
        results = F_rows, found[: F_rows.size].reshape(-1, 6), found[F_rows.size :]
        needs = self.POSES | self.INERTIAS | self.VELOCITIES
        return self.calls.query(queries.calc_contribution, *arguments, *results, needs=needs, answer=found)

    @cached_property
    def ask_jacobian_of_centre(self) -> Query:
        """Jacobian of the velocity of the centre of mass of the chosen bodies, shape (3, nv); 1 without mass."""
        J, needs = self.zeros(3, self.nv), self.POSES | self.INERTIAS
        arguments = self.model, self.work, self.mask, J
        return self.calls.query(jacobians.calc_jacobian_of_centre, *arguments, needs=needs, answer=J)

    # --- frames

    def jacobian(self, key: tuple, ends: tuple) -> Query:
        """A query for the Jacobian of a given point, shape (6, nv); kept by `key`.

        `ends` as in `jacobians.Ends`.
        """
        J = self.zeros(6, self.nv)
        places = jacobians.Frames(np.array(ends, np.int64))
        arguments = (self.model, self.p, self.work, places, np.zeros(3), J)
        ask = self.calls.query(jacobians.calc_frame_jacobian, *arguments, given=("point",), needs=self.POSES, answer=J)
        return self._keep_place(key, ask)

    def point_velocity(self, key: tuple, ends: tuple) -> Query:
        """A query for the spatial velocity of a given point, shape (6,); as `jacobian`."""
        V, places = self.zeros(6), jacobians.Frames(np.array(ends, np.int64))
        arguments, needs = (self.model, self.p, self.work, places, np.zeros(3), V), self.POSES | self.VELOCITIES
        kernel = jacobians.calc_point_velocity
        return self._keep_place(key, self.calls.query(kernel, *arguments, given=("point",), needs=needs, answer=V))

    def point_acceleration(self, key: tuple, ends: tuple) -> Query:
        """A query for the spatial acceleration of a point, given those of the body origins and it; as `jacobian`."""
        A, places = self.zeros(6), jacobians.Frames(np.array(ends, np.int64))
        arguments = self.model, self.p, self.work, places, self.zeros(self.nb, 6), np.zeros(3), A
        kernel, needs = jacobians.calc_point_acceleration, self.POSES | self.VELOCITIES
        ask = self.calls.query(kernel, *arguments, given=("A_WB", "point"), needs=needs, answer=A)
        return self._keep_place(key, ask)

    def frame_velocity(self, key: tuple[Frame, Frame, Frame], ends: tuple) -> Callable[[], SpatialVelocity]:
        """A query for the spatial velocity of frame B in A, expressed in E; kept in `velocities_of`."""
        V, places = self.zeros(6), jacobians.Frames(np.array(ends, np.int64))
        arguments, needs = (self.model, self.p, self.work, places, self.zeros(3), V), self.POSES | self.VELOCITIES
        if len(self.velocities_of) >= _MOST_PLACES:
            self.velocities_of.clear()
        kernel, cls = jacobians.calc_point_velocity, self.of(SpatialVelocity_)
        if self.T is float:
            V_WF = self.calls.query(kernel, *arguments, needs=needs, answer=V, frozen=True)
            made = object_query(cls, _c=V_WF)
        else:
            ask = self.calls.query(kernel, *arguments, needs=needs, answer=V)
            made = lambda: cls._make(ask())  # noqa: E731
        self.velocities_of[key] = made
        return made

    def spatial_inertia(self, key: tuple, place: tuple[int, int]) -> Query:
        """A query for the spatial inertia of the chosen bodies about the origin of a frame, expressed in it.

        It gives thirteen numbers, mass, centre of mass and unit inertia by rows, or 1 where they have no mass; as
        `jacobian`. `place` has the rows of the frame and its body.
        """
        found, places = self.zeros(13), jacobians.Frames(np.array((*place, 0, -1, 0, -1), np.int64))
        arguments, needs = (self.model, self.p, self.work, self.mask, places, found), self.POSES | self.INERTIAS
        return self._keep_place(key, self.calls.query(jacobians.calc_inertia, *arguments, needs=needs, answer=found))

    def inertia_of_body(self, group: int) -> Callable[[], SpatialInertia] | None:
        """A query for the spatial inertia that a group of parameters says, of floats; None where there is none."""
        if group not in self._inertias:
            ten = self.p[self.frozen.parameters.of(group)]
            can = self.T is float and self.native
            query = quick.query(inertia_of_ten, ten, takes=(), gives=SPATIAL_INERTIA) if can else None
            self._inertias[group] = query
        return self._inertias[group]

    def bias_acceleration(self, key: tuple, ends: tuple) -> Query:
        """A query for the spatial acceleration of a given point that does not depend on vdot; as `jacobian`."""
        A = self.zeros(6)
        places = jacobians.Frames(np.array(ends, np.int64))
        arguments, needs = (self.model, self.p, self.work, places, np.zeros(3), A), self.POSES | self.VELOCITIES
        kernel = jacobians.calc_bias_acceleration
        return self._keep_place(key, self.calls.query(kernel, *arguments, given=("point",), needs=needs, answer=A))

    def relative_pose(self, key: tuple, ends: tuple) -> Query:
        """A query for the pose of a frame in another, twelve numbers; kept by `key`.

        `ends` as in `jacobians.Ends`; those of E do not matter.
        """
        X = self.zeros(12)
        places, pose = jacobians.Frames(np.array((*ends, 0, -1), np.int64)), jacobians.RelativePose(X.reshape(1, 12))
        arguments = (self.model, self.p, self.work, places, pose)
        ask = self.calls.query(jacobians.calc_relative_pose, *arguments, needs=self.POSES, answer=X)
        return self._keep_place(key, ask)

    def point_position(self, key: tuple, ends: tuple) -> Query:
        """A query for the position of a given point of a frame in another, shape (3,); as `relative_pose`."""
        position, places = self.zeros(3), jacobians.Frames(np.array((*ends, 0, -1), np.int64))
        arguments, needs = (self.model, self.p, self.work, places, np.zeros(3), position), self.POSES
        ask = self.calls.query(
            jacobians.calc_point_position, *arguments, given=("point",), needs=needs, answer=position
        )
        return self._keep_place(key, ask)

    def transform(self, key: tuple[Frame, Frame], ends: tuple[int, ...]) -> Callable[[], RigidTransform]:
        """The same as a RigidTransform; kept in `transforms`."""
        X = self.zeros(12)
        places, pose = jacobians.Frames(np.array((*ends, 0, -1), np.int64)), jacobians.RelativePose(X.reshape(1, 12))
        arguments, R_AB = (self.model, self.p, self.work, places, pose), X[:9].reshape(3, 3)
        ask_R = self.calls.query(jacobians.calc_relative_pose, *arguments, needs=self.POSES, answer=R_AB, frozen=True)
        ask_p = self.calls.stages(0, answer=X[9:], frozen=True)  # the kernel has run then
        if len(self.transforms) >= _MOST_PLACES:
            self.transforms.clear()
        ask = self.transforms[key] = self.of(RigidTransform_)._maker(ask_R, ask_p)
        return ask

    def body_pose(self, body: RigidBody, row: int) -> Callable[[], RigidTransform]:
        """A query for the pose of a body, a RigidTransform; kept in `poses`."""
        ask = self.poses[body] = self.pose_of_row(row)
        return ask

    def pose_of_row(self, row: int, X_BG: RigidTransform | None = None) -> Callable[[], RigidTransform]:
        """A query for the pose of the body of a row, or of what is fixed to it."""
        X_WB = self.work.X_WB[row]
        if self.T is not float and X_BG is None:  # rotation and position at once
            ask, make = self.calls.stages(self.POSES, answer=X_WB[:12]), self.of(RigidTransform_)._make
            return lambda: make((X := ask())[:9].reshape(3, 3), X[9:])
        R_WB, p_WB = X_WB[BodyPose.R_WB.columns], X_WB[BodyPose.p_WB.columns]
        if X_BG is None:
            ask_R = self.calls.stages(self.POSES, answer=R_WB.reshape(3, 3), frozen=True)
            return self.of(RigidTransform_)._maker(ask_R, self.calls.stages(self.POSES, answer=p_WB, frozen=True))
        R_WG, p_WG = self.zeros(9), self.zeros(3)
        arguments = R_WB, p_WB, X_BG.rotation().matrix().ravel(), X_BG.translation().copy(), R_WG, p_WG
        answer = R_WG.reshape(3, 3)
        ask_R = self.calls.query(compose_poses, *arguments, needs=self.POSES, answer=answer, frozen=True)
        ask_p = self.calls.stages(0, answer=p_WG, frozen=True)  # the kernel has run then
        return self.of(RigidTransform_)._maker(ask_R, ask_p)

    def body_velocity(self, body: RigidBody, row: int) -> Callable[[], SpatialVelocity]:
        """A query for the spatial velocity of a body's origin; kept in `twists`."""
        needs = self.POSES | self.VELOCITIES | self.ORIGINS
        ask_V = self.calls.stages(needs, answer=self.V_WB[row], frozen=True)
        ask = self.twists[body] = object_query(self.of(SpatialVelocity_), _c=ask_V)
        return ask

    def _keep_place(self, key: tuple, ask: Query) -> Query:
        if len(self.places) >= _MOST_PLACES:
            self.places.clear()
        self.places[key] = ask
        return ask
