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
)
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._context.contexts import Contexts
from sheldrake.multibody.plant._context.view import View
from sheldrake.multibody.tree import BodyIndex, Frame, ModelInstanceIndex, RigidBody
from sheldrake.multibody.tree._element import vector
from sheldrake.systems.framework import Context

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sheldrake.common._types import Scalars

_FLOAT64 = np.dtype(np.float64)
_ALL = slice(1, None)
"""Rows of all bodies but the world."""


class Kinematics:
    """Kinematics and properties of all or of some bodies.

    Args:
        elements: Bodies and frames.
        contexts: Where positions and velocities are.
    """

    def __init__(self, elements: Elements, contexts: Contexts) -> None:
        self._elements, self._contexts = elements, contexts
        self._bodies_of: tuple[tuple[BodyIndex, ...], list[RigidBody], np.ndarray] | None = None

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
        return view.keep(view.poses, body, view.queries.body_pose(view.frozen.row_of(body)))

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
        return view.keep(view.twists, body, view.queries.body_velocity(view.frozen.row_of(body)))()

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

    @cached_property
    def world_frame(self) -> Frame:
        """The frame W."""
        return self._elements.world.body_frame()

    def pose_of_frame(self, context: Context, frame: Frame) -> RigidTransform:
        """X_WF."""
        try:  # the one that has to be quick
            view = context._kept
            if view.family is self._contexts.family:
                return view.transforms[self.world_frame, frame]()
        except (AttributeError, KeyError, TypeError):
            pass
        return self.CalcRelativeTransform(context, self.world_frame, frame)

    def velocity_of_frame(self, context: Context, frame: Frame) -> SpatialVelocity:
        """V_WF, expressed in W."""
        return self.relative_velocity(context, frame, self.world_frame, self.world_frame)

    def relative_velocity(self, context: Context, frame_B: Frame, frame_A: Frame, frame_E: Frame) -> SpatialVelocity:
        """V_AB: of the origin of frame B, measured in A, expressed in E."""
        key = frame_B, frame_A, frame_E
        try:  # the one that has to be quick
            view = context._kept
            if view.family is self._contexts.family:
                return view.velocities_of[key]()
        except (AttributeError, KeyError, TypeError):
            pass
        view = self._contexts.view(context)
        return view.keep(view.velocities_of, key, view.queries.frame_velocity(*self._ends(view, key)))()

    def velocity_of_point(self, context: Context, frame: Frame, p_FQ: np.ndarray) -> np.ndarray:
        """v_WQ of a point of a frame, expressed in W [m/s], shape (3,)."""
        found = self.point_velocity(context, frame, self.world_frame, self.world_frame)(p_FQ)
        return fitting("velocity_of_point", found)[3:]

    def point_velocity(self, context: Context, frame_B: Frame, frame_A: Frame, frame_E: Frame) -> Query:
        """A query for the spatial velocity of a given point of frame B, measured in A, expressed in E."""
        view, key = self._contexts.view(context), ("velocity", frame_B, frame_A, frame_E)
        ask = view.places.get(key)
        return ask or view.keep(view.places, key, view.queries.point_velocity(*self._ends(view, key[1:])))

    def point_acceleration(self, context: Context, frame_B: Frame, frame_A: Frame, frame_E: Frame) -> Query:
        """A query for the spatial acceleration of that point, given those of the body origins (`accelerations`) and it.

        Points are given to both as arrays of three floats.
        """
        view, key = self._contexts.view(context), ("acceleration", frame_B, frame_A, frame_E)
        ask = view.places.get(key)
        return ask or view.keep(view.places, key, view.queries.point_acceleration(*self._ends(view, key[1:])))

    def _ends(self, view: View, frames: Iterable[Frame]) -> tuple[int, ...]:
        """Rows of bodies and frames B, A and E, as `jacobians.Ends` has them."""
        B, A, E = (self.place(view, frame) for frame in frames)
        return *A, *B, *E

    def rotation_in_world(self, context: Context, frame: Frame) -> np.ndarray:
        """R_WF, shape (3, 3)."""
        return self.relative_pose(context, self.world_frame, frame)[:9].reshape(3, 3)

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
        ask = view.queries.transform(*self.place(view, frame_A), *self.place(view, frame_B))
        return view.keep(view.transforms, (frame_A, frame_B), ask)()

    def relative_pose(self, context: Context, frame_A: Frame, frame_B: Frame) -> np.ndarray:
        """X_AB as twelve numbers."""
        view = self._contexts.view(context)
        key = frame_A, frame_B
        ask = view.places.get(key)
        if ask is None:
            pose = view.queries.relative_pose(*self.place(view, frame_A), *self.place(view, frame_B))
            ask = view.keep(view.places, key, pose)
        return ask()

    def ask_point(self, view: View, frame_B: Frame, frame_A: Frame) -> Query:
        """A query for the position in frame A of a given point of frame B."""
        key = "point", frame_A, frame_B
        ask = view.places.get(key)
        if ask is None:
            position = view.queries.point_position(*self.place(view, frame_A), *self.place(view, frame_B))
            ask = view.keep(view.places, key, position)
        return ask

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
        if type(p_BQi) is not np.ndarray or p_BQi.shape != (3,):
            p_BQi = points("CalcPointsPositions", "p_BQi", p_BQi)
        if view.T is float and p_BQi.size == 3:
            p_AQ = self.ask_point(view, frame_B, frame_A)(p_BQi if p_BQi.ndim == 1 else p_BQi[:, 0].copy())
            if type(p_AQ) is not int:
                return p_AQ.reshape(3, 1)
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
        call, ask = "CalcPointsVelocities", self.point_velocity(context, frame_B, frame_A, frame_E)
        if type(V := ask(p_BQi)) is not int:
            return V[3:].reshape(3, 1)  # of one point
        columns = points(call, "p_BQi", p_BQi).T
        found = [fitting(call, ask(np.ascontiguousarray(p)))[3:] for p in columns]
        return np.array(found).reshape(-1, 3).T

    # --- groups of bodies

    def _bodies_of_instances(
        self, call: str, model_instances: Iterable[ModelInstanceIndex] | None
    ) -> tuple[np.ndarray, bool]:
        """What queries take for the bodies of some model instances, of all but the world for None; if there are any."""
        wanted = None
        if model_instances is not None:
            instances = list(model_instances)
            for instance in instances:
                self._elements.require_instance(call, instance)
            wanted = tuple(map(int, instances))
        frozen = self._elements.model(call)
        found = frozen.bodies_of_instances.get(wanted)
        if found is None:
            owners = enumerate(int(body.model_instance()) for body in frozen.row_bodies)
            mine = [bool(row) and (wanted is None or owner in wanted) for row, owner in owners]
            found = frozen.bodies_of_instances[wanted] = np.array(mine, float), any(mine)
        return found

    def CalcTotalMass(self, context: Context, model_instances: list[ModelInstanceIndex] | None = None) -> float:
        """Mass [kg] of all bodies or of those of some model instances."""
        view = self._contexts.view(context)
        bodies, _ = self._bodies_of_instances("CalcTotalMass", model_instances)
        return view.ask_mass(bodies).item()

    def choose(
        self, call: str, context: Context, model_instances: Iterable[ModelInstanceIndex] | None
    ) -> tuple[View, np.ndarray]:
        """A view, and what its queries of centres of mass take for the bodies of some model instances, of all for None.

        Raises:
            RuntimeError: these have no body.
        """
        view, (bodies, any_bodies) = self._contexts.view(context), self._bodies_of_instances(call, model_instances)
        if not any_bodies:
            raise RuntimeError(
                f"{call}(): There must be at least one non-world body contained in model_instances."
                if model_instances is not None
                else f"{call}(): This MultibodyPlant only contains the world_body() so its center of mass is undefined."
            )
        return view, bodies

    def of_centre(self, call: str, found: np.ndarray | int) -> np.ndarray:
        """What a query of a centre of mass gave.

        Raises:
            RuntimeError: the bodies have no mass.
        """
        if isinstance(found, int):
            raise RuntimeError(f"{call}(): the total mass must be positive, not 0.0.")
        return found

    def CalcCenterOfMassPositionInWorld(
        self, context: Context, model_instances: list[ModelInstanceIndex] | None = None
    ) -> np.ndarray:
        """p_WScm of all bodies or of those of some model instances [m], shape (3,)."""
        call = "CalcCenterOfMassPositionInWorld"
        view, bodies = self.choose(call, context, model_instances)
        return self.of_centre(call, view.ask_centre_of_mass(bodies))

    def CalcCenterOfMassTranslationalVelocityInWorld(
        self, context: Context, model_instances: list[ModelInstanceIndex] | None = None
    ) -> np.ndarray:
        """v_WScm expressed in W, of all bodies or of those of some model instances [m/s], shape (3,)."""
        call = "CalcCenterOfMassTranslationalVelocityInWorld"
        view, bodies = self.choose(call, context, model_instances)
        return self.of_centre(call, view.ask_velocity_of_centre(bodies))

    def acceleration_of_centre(
        self, call: str, context: Context, model_instances: Iterable[ModelInstanceIndex] | None, A_WB: np.ndarray
    ) -> np.ndarray:
        """a_WScm expressed in W, given accelerations of the body origins."""
        view, bodies = self.choose(call, context, model_instances)
        return self.of_centre(call, view.ask_acceleration_of_centre(bodies, A_WB))

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
        if len(rest) == 2 or (rest and "p_WoP_W" in kwargs):
            instances = rest.pop(0)
        point = rest.pop(0) if rest else kwargs.pop("p_WoP_W", None)
        call = "CalcSpatialMomentumInWorldAboutPoint"
        if rest or kwargs or point is None:
            raise Mismatch(f"{call}(): incompatible function arguments. Takes (context, [model_instances], p_WoP_W).")
        view = self._contexts.view(context)
        bodies, _ = self._bodies_of_instances(call, instances)
        L = view.ask_momentum(bodies, point)
        if type(L) is int:
            L = fitting(call, view.ask_momentum(bodies, vector(call, "p_WoP_W", point, 3)))
        return view.of(SpatialMomentum_)._make(L)

    def CalcSpatialInertia(self, context: Context, frame_F: Frame, body_indexes: list[BodyIndex]) -> SpatialInertia:
        """Spatial inertia of some bodies about Fo, expressed in F.

        Raises:
            RuntimeError: a body is named twice.
        """
        view, key = self._contexts.view(context), ("inertia", frame_F)
        ask = view.places.get(key)
        if ask is None:
            ask = view.keep(view.places, key, view.queries.spatial_inertia(*self.place(view, frame_F)))
        bodies, chosen = self._known_bodies(view, tuple(body_indexes))
        if type(found := ask(chosen)) is not int:
            G = found[4:].reshape(3, 3).copy()
            return view.of(SpatialInertia_)._make(found.item(0), found[1:4].copy(), G)
        total = self._contexts.view(context).of(SpatialInertia_).Zero()
        for body in bodies:
            if body.index() != 0:
                X_FB = self.CalcRelativeTransform(context, frame_F, body.body_frame())
                M_BBo_F = body.CalcSpatialInertiaInBodyFrame(context).ReExpress(X_FB.rotation())
                total += M_BBo_F.Shift(-X_FB.translation())
        return total

    def _known_bodies(self, view: View, indexes: tuple[BodyIndex, ...]) -> tuple[list[RigidBody], np.ndarray]:
        """Bodies, and what queries take for them; the same while the same bodies are asked for."""
        known = self._bodies_of
        if known is None or known[0] != indexes:
            rows = [int(i) for i in indexes]
            if len(set(rows)) < len(rows):
                raise RuntimeError("CalcSpatialInertia(): contains a repeated BodyIndex.")
            bodies = [self._elements.bodies.get(i, "get_body") for i in indexes]
            chosen = np.zeros(view.nb)
            chosen[view.frozen.rows[rows]] = 1.0
            known = self._bodies_of = indexes, bodies, chosen
        return known[1:]

    # --- energy

    def CalcPotentialEnergy(self, context: Context) -> float:
        """Energy of gravity (zero at the world's origin) and springs [J]."""
        energy = self._with_potential(context).ask_potential_energy()[0]
        return float(energy) if isinstance(energy, float) else energy

    def CalcKineticEnergy(self, context: Context) -> float:
        """Energy of motion [J], of rotors too."""
        energy = self._contexts.view(context).ask_kinetic_energy()[0]
        return float(energy) if isinstance(energy, float) else energy

    def CalcConservativePower(self, context: Context) -> float:
        """Power of gravity and of the elastic forces of springs [W]: what potential energy loses."""
        power = self._with_potential(context).ask_powers()[0]
        return float(power) if isinstance(power, float) else power

    @checked
    def CalcNonConservativePower(self, context: Context) -> float:
        """Power of the dampers and of the friction of force elements [W]; joints, actuators, contact do not count."""
        self._elements.require_finalized("CalcNonConservativePower")
        power = self._with_potential(context).ask_powers()[1]
        return float(power) if isinstance(power, float) else power

    def _with_potential(self, context: Context) -> View:
        """The view of a context; refused where forces have no potential energy."""
        view = self._contexts.view(context)
        if len(view.frozen.forces.bushing):
            raise NotImplementedError("LinearBushingRollPitchYaw: its force is not the gradient of a potential energy.")
        return view


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b of two vectors; numpy's takes ten times as long."""
    ax, ay, az = a.tolist()
    bx, by, bz = b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


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


def fitting(call: str, found: np.ndarray | int) -> np.ndarray:
    """What a query gave for given numbers.

    Raises:
        TypeError: it did not take them.
    """
    if isinstance(found, int):
        raise TypeError(f"{call}(): the given numbers must have the scalar type of the context.")
    return found
