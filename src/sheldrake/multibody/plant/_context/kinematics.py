"""Where things are and how they move: poses, velocities, accelerations, centres of mass, momentum, energy."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property
from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np
from numpy.typing import ArrayLike

from sheldrake.autodiffutils._matrices import alike, filled
from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch, expect
from sheldrake.common.calls import Query
from sheldrake.math import RigidTransform, RotationMatrix, RotationMatrix_
from sheldrake.multibody.math import (
    SpatialAcceleration,
    SpatialAcceleration_,
    SpatialInertia,
    SpatialInertia_,
    SpatialMomentum,
    SpatialMomentum_,
    SpatialVelocity,
    SpatialVelocity_,
)
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._context.contexts import Contexts
from sheldrake.multibody.plant._context.view import View
from sheldrake.multibody.tree import BodyIndex, Frame, ModelInstanceIndex, RigidBody
from sheldrake.multibody.tree._element import vector
from sheldrake.multibody.tree._kernels import queries
from sheldrake.multibody.tree._kernels.model import Body, BodyInertia, BodyPose
from sheldrake.systems.framework import Context

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sheldrake.common._types import Scalar, Scalars

_FLOAT64 = np.dtype(np.float64)
_ALL = slice(1, None)
"""Rows of all bodies but the world."""


class Motion:
    """Pose, velocity and acceleration of a frame as plain arrays, in W."""

    is_still = False
    """Whether it is the world's."""

    def __init__(self, R: np.ndarray, p: np.ndarray, V: np.ndarray | None = None, A: np.ndarray | None = None):
        self.R, self.p = R, p
        if V is not None:
            self.w, self.v = V[:3], V[3:]
        if A is not None:
            self.alpha, self.a = A[:3], A[3:]

    def velocity_at(self, p_WQ: np.ndarray) -> np.ndarray:
        """Velocity of the point fixed to this frame that is now at p_WQ."""
        return self.v + cross(self.w, p_WQ - self.p)

    def acceleration_at(self, p_WQ: np.ndarray) -> np.ndarray:
        """Acceleration of the point fixed to this frame that is now at p_WQ."""
        r = p_WQ - self.p
        return self.a + cross(self.alpha, r) + cross(self.w, cross(self.w, r))


class Kinematics:
    """Kinematics and properties of all or of some bodies.

    Args:
        elements: Bodies and frames.
        contexts: Where positions and velocities are.
    """

    def __init__(self, elements: Elements, contexts: Contexts) -> None:
        self._elements, self._contexts = elements, contexts

    # --- bodies

    def EvalBodyPoseInWorld(self, context: Context, body: RigidBody) -> RigidTransform:
        """X_WB.

        Raises:
            RuntimeError: the body or the context is not of this plant.
        """
        try:  # the one that has to be quick
            view = context._kept
            if view.family is self._contexts.family:
                return view.poses[body]()
        except (AttributeError, KeyError, TypeError):
            pass
        return self._pose_query(context, body)()

    def _pose_query(self, context: Context, body: RigidBody) -> Callable[[], RigidTransform]:
        """A query for X_WB of a body; kept in `View.poses`.

        Raises:
            RuntimeError: the body or the context is not of this plant.
        """
        view = self._contexts.view(context)
        if not self._elements.has(body):
            self._elements.require_mine("EvalBodyPoseInWorld", body)
        expect("EvalBodyPoseInWorld", body, RigidBody)
        return view.body_pose(body, view.frozen.row_of(body))

    def EvalBodySpatialVelocityInWorld(self, context: Context, body: RigidBody) -> SpatialVelocity:
        """V_WB of the body origin, expressed in W."""
        try:  # the one that has to be quick
            view = context._kept
            if view.family is self._contexts.family:
                return view.twists[body]()
        except (AttributeError, KeyError, TypeError):
            pass
        if not self._elements.has(body):
            self._elements.require_mine("EvalBodySpatialVelocityInWorld", body)
        expect("EvalBodySpatialVelocityInWorld", body, RigidBody)
        view = self._contexts.view(context)
        return view.body_velocity(body, view.frozen.row_of(body))()

    def accelerations(self, context: Context, vdot: np.ndarray) -> np.ndarray:
        """Spatial accelerations of the body origins, by row, for given vdot; shape (num_bodies, 6).

        Raises:
            TypeError: vdot is no vector of nv numbers of the context's scalar.
        """
        A = self._contexts.view(context).ask_accelerations(np.ascontiguousarray(vdot))
        if type(A) is int:
            raise TypeError(f"{context._system._describe()}: accelerations must have the scalar type of the context.")
        return A

    @checked
    def CalcSpatialAccelerationsFromVdot(self, context: Context, known_vdot: ArrayLike) -> list[SpatialAcceleration]:
        """A_WB of all body origins, expressed in W, for given vdot, by body."""
        view, call = self._contexts.view(context), "CalcSpatialAccelerationsFromVdot"
        A = self.accelerations(context, vector(call, "known_vdot", known_vdot, view.nv))
        make = view.of(SpatialAcceleration_)._make
        return [make(A[row]) for row in view.frozen.rows]

    # --- frames

    def _body_and_offset(self, view: View, context: Context, frame: Frame) -> tuple[int, Any]:
        if not self._elements.has(frame):
            self._elements.require_mine("CalcRelativeTransform", frame)
        return view.frozen.row_of(frame._body), None if frame.is_body_frame() else frame._X_BF(context)

    def motion(self, context: Context, frame: Frame, order: int = 0, A_WB: np.ndarray | None = None) -> Motion:
        """Motion of a frame; order 0: pose; 1: velocity too; A_WB: acceleration too."""
        view = self._contexts.view(context)
        row, X_BF = self._body_and_offset(view, context, frame)
        if frame.is_world_frame():
            return _WORLD
        X = self.relative_pose(context, self._world_frame, frame._body.body_frame())
        R_WB, p_WB = X[:9].reshape(3, 3), X[9:]
        V = view.body_velocities()[row] if order else None
        A = None if A_WB is None else A_WB[row]
        body = Motion(R_WB, p_WB, V, A)
        if X_BF is None:
            return body
        p_WF = p_WB + R_WB @ X_BF.translation()
        R_WF = R_WB @ X_BF.rotation().matrix()
        V_F = None if V is None else np.concatenate([body.w, body.velocity_at(p_WF)])
        A_F = None if A is None else np.concatenate([body.alpha, body.acceleration_at(p_WF)])
        return Motion(R_WF, p_WF, V_F, A_F)

    @cached_property
    def _world_frame(self) -> Frame:
        return self._elements.world.body_frame()

    def pose_of_frame(self, context: Context, frame: Frame) -> RigidTransform:
        """X_WF."""
        try:  # the one that has to be quick
            view = context._kept
            if view.family is self._contexts.family:
                return view.transforms[self._world_frame, frame]()
        except (AttributeError, KeyError, TypeError):
            pass
        return self.CalcRelativeTransform(context, self._world_frame, frame)

    def velocity_of_frame(self, context: Context, frame: Frame) -> SpatialVelocity:
        """V_WF."""
        m = self.motion(context, frame, 1)
        return self._contexts.view(context).of(SpatialVelocity_)._make(np.concatenate([m.w, m.v]))

    def CalcRelativeTransform(self, context: Context, frame_A: Frame, frame_B: Frame) -> RigidTransform:
        """X_AB: frame B in frame A."""
        try:  # the one that has to be quick
            view = context._kept
            if view.family is self._contexts.family:
                return view.transforms[frame_A, frame_B]()
        except (AttributeError, KeyError, TypeError):
            pass
        view = self._contexts.view(context)
        if view.T is not float:
            return self._contexts.transform(context, self.relative_pose(context, frame_A, frame_B))
        return view.transform((frame_A, frame_B), (*self.place(view, frame_A), *self.place(view, frame_B)))()

    def relative_pose(self, context: Context, frame_A: Frame, frame_B: Frame) -> np.ndarray:
        """X_AB as twelve numbers."""
        view = self._contexts.view(context)
        key = frame_A, frame_B
        ask = view.places.get(key) or view.relative_pose(key, (*self.place(view, frame_A), *self.place(view, frame_B)))
        return ask()

    def ask_point(self, view: View, frame_B: Frame, frame_A: Frame) -> Query:
        """A query for the position in frame A of a given point of frame B."""
        key = "point", frame_A, frame_B
        ask = view.places.get(key)
        return ask or view.point_position(key, (*self.place(view, frame_A), *self.place(view, frame_B)))

    def place(self, view: View, frame: Frame) -> tuple[int, int]:
        """Row of the body of a frame, and row of the frame.

        Raises:
            RuntimeError: the frame is of another plant.
        """
        if not self._elements.has(frame):
            self._elements.require_mine("a query", frame)
        return view.frozen.place_of(frame)

    def CalcRelativeRotationMatrix(self, context: Context, frame_A: Frame, frame_B: Frame) -> RotationMatrix:
        """R_AB: orientation of frame B in frame A."""
        X_AB = self.relative_pose(context, frame_A, frame_B)
        return self._contexts.view(context).of(RotationMatrix_)._make(X_AB[:9].reshape(3, 3).copy())

    def CalcPointsPositions(self, context: Context, frame_B: Frame, p_BQi: ArrayLike, frame_A: Frame) -> np.ndarray:
        """Positions in frame A of points given in frame B [m], shape (3, n)."""
        view = self._contexts.view(context)
        if view.T is float and type(p_AQ := self.ask_point(view, frame_B, frame_A)(p_BQi)) is not int:
            return p_AQ.reshape(3, 1)  # of one point
        X_AB = self.relative_pose(context, frame_A, frame_B)
        p_BQi = points("CalcPointsPositions", "p_BQi", p_BQi)
        duals = alike(X_AB.tolist()) if X_AB.dtype == object and p_BQi.dtype == float else None
        if duals is None:
            return X_AB[:9].reshape(3, 3) @ p_BQi + X_AB[9:, None]
        X, slopes = np.array(duals[0]), duals[1]
        slopes_R = slopes[:9].reshape(3, 3, -1)
        slopes_p = p_BQi.T @ slopes_R + slopes[9:, None]  # by row of R: points, derivatives
        return filled(X[:9].reshape(3, 3) @ p_BQi + X[9:, None], slopes_p.reshape(p_BQi.size, -1))

    @checked
    def CalcPointsVelocities(
        self, context: Context, frame_B: Frame, p_BQi: ArrayLike, frame_A: Frame, frame_E: Frame
    ) -> np.ndarray:
        """Velocities measured in frame A, expressed in E, of points fixed to frame B [m/s], shape (3, n)."""
        A, B, E = self.motion(context, frame_A, 1), self.motion(context, frame_B, 1), self.motion(context, frame_E)
        p_WQi = B.p[:, None] + B.R @ points("CalcPointsVelocities", "p_BQi", p_BQi)
        v = [B.velocity_at(p) - A.velocity_at(p) for p in p_WQi.T]
        return E.R.T @ np.array(v).T.reshape(3, -1)

    # --- groups of bodies

    def _rows_of(self, call: str, model_instances: Iterable[ModelInstanceIndex] | None) -> np.ndarray:
        """Rows of the bodies of some model instances, without the world; of all for None."""
        bodies = self._elements.model(call).row_bodies
        if model_instances is None:
            return np.arange(1, len(bodies))
        wanted = set()
        for instance in model_instances:
            self._elements.require_instance(call, instance)
            wanted.add(int(instance))
        return np.array([r for r, b in enumerate(bodies) if r and int(b.model_instance()) in wanted], np.int64)

    def _masses(self, view: View, rows: np.ndarray | slice) -> np.ndarray:
        return view.p[view.frozen.mass_at[rows]]

    def CalcTotalMass(self, context: Context, model_instances: list[ModelInstanceIndex] | None = None) -> float:
        """Mass [kg] of all bodies or of those of some model instances."""
        view = self._contexts.view(context)
        if model_instances is None:
            at = view.frozen.mass_of_bodies_at
        else:
            at = view.frozen.mass_at[self._rows_of("CalcTotalMass", model_instances)]
        masses = view.p[at].tolist()
        return sum(masses[1:], masses[0]) if masses else 0.0

    def com_rows(
        self, call: str, context: Context, model_instances: Iterable[ModelInstanceIndex] | None
    ) -> tuple[View, np.ndarray, Any, Any]:
        """(view, rows, total mass, results of positions) of bodies whose centre of mass is asked for."""
        view, rows = self._contexts.view(context), self._rows_of(call, model_instances)
        if not len(rows):
            raise RuntimeError(
                f"{call}(): There must be at least one non-world body contained in model_instances."
                if model_instances is not None
                else f"{call}(): This MultibodyPlant only contains the world_body() so its center of mass is undefined."
            )
        work = view.positions()
        mass: Any = sum(self._masses(view, rows).tolist())
        if view.dtype == float and not mass > 0.0:
            raise RuntimeError(f"{call}(): the total mass must be positive, not {mass}.")
        return view, rows, mass, work

    def _roots(self, view: View, work: Any, rows: np.ndarray) -> np.ndarray:
        """Reference points of rows, in W, shape (n, 3)."""
        return work.X_WB[view.model.body[rows, Body.root], BodyPose.p_WB.columns]

    def _masses_and_moments(self, work: Any, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Masses, shape (n, 1), and first moments about `root`, shape (n, 3)."""
        inertia = work.inertia[rows]
        return inertia[:, BodyInertia.mass.columns], inertia[:, BodyInertia.first_moment.columns]

    def CalcCenterOfMassPositionInWorld(
        self, context: Context, model_instances: list[ModelInstanceIndex] | None = None
    ) -> np.ndarray:
        """p_WScm of all bodies or of those of some model instances [m], shape (3,)."""
        call = "CalcCenterOfMassPositionInWorld"
        view = self._contexts.view(context)
        if model_instances is None and type(centre := view.ask_centre_of_mass()) is not int:
            return centre
        view, rows, mass, work = self.com_rows(call, context, model_instances)
        m, h = self._masses_and_moments(work, rows)
        return (h + m * self._roots(view, work, rows)).sum(axis=0) / mass

    def CalcCenterOfMassTranslationalVelocityInWorld(
        self, context: Context, model_instances: list[ModelInstanceIndex] | None = None
    ) -> np.ndarray:
        """v_WScm expressed in W, of all bodies or of those of some model instances [m/s], shape (3,)."""
        call = "CalcCenterOfMassTranslationalVelocityInWorld"
        view, rows, mass, _ = self.com_rows(call, context, model_instances)
        return _momentum_of(view, rows, np.zeros(3))[3:] / mass

    def com_acceleration(self, view: View, rows: np.ndarray, mass: Scalar, A_WB: np.ndarray) -> np.ndarray:
        """Acceleration of a centre of mass, given those of the body origins."""
        mask, force = view.integers("mask", view.nb), view.buffer("force of masses", 3)
        mask[:] = 0
        mask[rows] = 1
        arguments = view.model, view.work, mask, view.buffer("A_WB of masses", view.nb, 6), force
        needs = view.POSES | view.INERTIAS | view.VELOCITIES
        return (
            view.query(queries.calc_force_of_masses, *arguments, given=("A_WB",), needs=needs, answer=force)(A_WB)
            / mass
        )

    @typing_overload
    def CalcSpatialMomentumInWorldAboutPoint(self, context: Context, p_WoP_W: Scalars) -> SpatialMomentum: ...
    @typing_overload
    def CalcSpatialMomentumInWorldAboutPoint(
        self, context: Context, model_instances: Sequence[ModelInstanceIndex], p_WoP_W: Scalars
    ) -> SpatialMomentum: ...
    def CalcSpatialMomentumInWorldAboutPoint(self, context: Context, *args: Any, **kwargs: Any) -> SpatialMomentum:
        """Spatial momentum about a point P of W, expressed in W: `(context, p_WoP_W)` of all bodies, or
        `(context, model_instances, p_WoP_W)`.
        """  # fmt: skip
        rest, instances = list(args), kwargs.pop("model_instances", None)
        if len(rest) == 2:
            instances = rest.pop(0)
        point = rest.pop(0) if rest else kwargs.pop("p_WoP_W", None)
        call = "CalcSpatialMomentumInWorldAboutPoint"
        if rest or kwargs or point is None:
            raise Mismatch(f"{call}(): incompatible function arguments. Takes (context, [model_instances], p_WoP_W).")
        view = self._contexts.view(context)
        rows = slice(None) if instances is None else self._rows_of(call, instances)
        L = _momentum_of(view, rows, point)
        if type(L) is int:
            L = _momentum_of(view, rows, vector(call, "p_WoP_W", point, 3))
            if type(L) is int:
                raise TypeError(f"{call}(): the point must have the scalar type of the context.")
        return view.of(SpatialMomentum_)(L)

    def CalcSpatialInertia(self, context: Context, frame_F: Frame, body_indexes: list[BodyIndex]) -> SpatialInertia:
        """Spatial inertia of some bodies about Fo, expressed in F.

        Raises:
            RuntimeError: a body is named twice.
        """
        rows = [int(i) for i in body_indexes]
        if len(set(rows)) < len(rows):
            raise RuntimeError("CalcSpatialInertia(): contains a repeated BodyIndex.")
        bodies = [self._elements.bodies.get(i, "get_body") for i in body_indexes]
        total = self._contexts.view(context).of(SpatialInertia_).Zero()
        for body in bodies:
            if body.index() != 0:
                X_FB = self.CalcRelativeTransform(context, frame_F, body.body_frame())
                M_BBo_F = body.CalcSpatialInertiaInBodyFrame(context).ReExpress(X_FB.rotation())
                total += M_BBo_F.Shift(-X_FB.translation())
        return total

    # --- energy

    def CalcPotentialEnergy(self, context: Context) -> float:
        """Energy of gravity (zero at the world's origin) and springs [J]."""
        energy = self._contexts.view(context).ask_gravity_energy()[0]
        for element in self._elements.force_elements:
            energy = energy + element._potential_energy(context)
        return float(energy) if isinstance(energy, float) else energy

    def CalcKineticEnergy(self, context: Context) -> float:
        """Energy of motion [J], of rotors too."""
        energy = self._contexts.view(context).ask_kinetic_energy()[0]
        return float(energy) if isinstance(energy, float) else energy

    def CalcConservativePower(self, context: Context) -> float:
        """Power of gravity and of the elastic forces of springs [W]: what potential energy loses."""
        view = self._contexts.view(context)
        power = view.v @ view.ask_gravity()
        power = sum((element._powers(context)[0] for element in self._elements.force_elements), power)
        return float(power) if isinstance(power, float) else power

    @checked
    def CalcNonConservativePower(self, context: Context) -> float:
        """Power of the dampers and of the friction of force elements [W]; joints, actuators, contact do not count."""
        self._elements.require_finalized("CalcNonConservativePower")
        power = sum((element._powers(context)[1] for element in self._elements.force_elements), 0.0)
        return float(power) if isinstance(power, float) else power


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b of two vectors; numpy's takes ten times as long."""
    ax, ay, az = a.tolist()
    bx, by, bz = b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def _world_motion() -> Motion:
    R, p, V = np.eye(3), np.zeros(3), np.zeros(6)
    for array in (R, p, V):
        array.flags.writeable = False
    world = Motion(R, p, V, V)
    world.is_still = True
    return world


_WORLD = _world_motion()


def relative_acceleration(B: Motion, A: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Angular acceleration of B in A and acceleration of Bo in A, expressed in W (both motions with acceleration)."""
    if A.is_still:
        return B.alpha, B.a
    w_AB, v_AB = B.w - A.w, B.v - A.velocity_at(B.p)
    alpha = B.alpha - A.alpha - cross(A.w, w_AB)
    return alpha, B.a - A.acceleration_at(B.p) - 2 * cross(A.w, v_AB)


def points(call: str, name: str, value: ArrayLike) -> np.ndarray:
    """`value` as points in columns, shape (3, n); one point may be given flat.

    Raises:
        TypeError: it is no array.
        RuntimeError: it has another number of rows.
    """
    array = np.asarray(value)
    if array.ndim == 0:
        raise Mismatch(f"{call}(): incompatible function arguments. {name} must have shape (3, n), not {value!r}.")
    if array.dtype is _FLOAT64:
        pass
    elif array.dtype != object or all(isinstance(x, (float, int)) for x in array.flat):
        array = array.astype(float)
    array = array.reshape(-1, 1) if array.ndim == 1 else array
    if array.ndim != 2 or array.shape[0] != 3:
        raise RuntimeError(f"{call}(): {name} must have shape (3, n), not {np.shape(value)}.")
    return array


def _momentum_of(view: View, rows: Any, p_WoP_W: np.ndarray) -> Any:
    """Spatial momentum of some bodies about a point; an int where that is no vector of the context's scalar."""
    ask = view.ask_momentum
    view.mask[:] = 0
    view.mask[rows] = 1
    return ask(p_WoP_W)
