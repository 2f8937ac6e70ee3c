"""Where things are and how they move: poses, velocities, accelerations, centres of mass, momentum, energy."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.autodiffutils._matrices import alike, filled
from sheldrake.math import RotationMatrix_
from sheldrake.multibody.math import SpatialAcceleration_, SpatialInertia_, SpatialMomentum_, SpatialVelocity_
from sheldrake.multibody.tree import BodyIndex, Frame, ModelInstanceIndex, RigidBody
from sheldrake.multibody.tree._element import vector
from sheldrake.multibody.tree._kernels.model import ROOT


class Motion:
    """Pose, velocity and acceleration of a frame as plain arrays, in W."""

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
    """Kinematics and properties of all or of some bodies."""

    # --- bodies

    def EvalBodyPoseInWorld(self, context: Any, body: RigidBody) -> Any:
        """X_WB.

        Raises:
            RuntimeError: the body or the context is not of this plant.
        """
        try:  # the one that has to be quick
            view = context._kept
            if view.family is self._family:
                return view.poses[body]()
        except (AttributeError, KeyError, TypeError):
            pass
        return self._pose_query(self._view(context), body)()

    def _pose_query(self, view: Any, body: RigidBody) -> Any:
        if getattr(body, "_owner", None) is not self:
            self._require_mine("EvalBodyPoseInWorld", body)
        return view.body_pose(body, self._rows[body._index._value])

    def _body_velocities(self, context: Any) -> np.ndarray:
        """Spatial velocities of the body origins, by row, shape (num_bodies, 6)."""
        return self._view(context).body_velocities()

    def EvalBodySpatialVelocityInWorld(self, context: Any, body: RigidBody) -> Any:
        """V_WB of the body origin, expressed in W."""
        self._require_mine("EvalBodySpatialVelocityInWorld", body)
        V = self._body_velocities(context)[self._rows[body._index._value]]
        return self._view(context).of(SpatialVelocity_)._make(V.copy())

    def _accelerations(self, context: Any, vdot: np.ndarray) -> np.ndarray:
        """Spatial accelerations of the body origins, by row, shape (num_bodies, 6)."""
        A = self._view(context).ask_accelerations(np.ascontiguousarray(vdot))
        if type(A) is int:
            raise TypeError(f"{self._describe()}: accelerations must have the scalar type of the context.")
        return A

    def CalcSpatialAccelerationsFromVdot(self, context: Any, known_vdot: Any) -> list[Any]:
        """A_WB of all body origins, expressed in W, for given vdot, by body."""
        vdot = vector("CalcSpatialAccelerationsFromVdot", "known_vdot", known_vdot, self._nv)
        A, T = self._accelerations(context, vdot), self._view(context).of(SpatialAcceleration_)._make
        return [T(A[self._rows[i]]) for i in range(len(self._rows))]

    def EvalBodySpatialAccelerationInWorld(self, context: Any, body: RigidBody) -> Any:
        """A_WB of the body origin, expressed in W, at the present state.

        For a discrete plant, of the step that would be taken from there; the port body_spatial_accelerations has that
        of the step that was taken, when ports are sampled.
        """
        self._require_mine("EvalBodySpatialAccelerationInWorld", body)
        A = self._accelerations(context, self._vdot(context))
        return self._view(context).of(SpatialAcceleration_)(A[self._rows[body._index._value]])

    # --- frames

    def _body_and_offset(self, context: Any, frame: Frame) -> tuple[int, Any]:
        if getattr(frame, "_owner", None) is not self:
            self._require_mine("CalcRelativeTransform", frame)
        return self._rows[frame._body._index._value], None if frame.is_body_frame() else frame._X_BF(context)

    def _motion(self, context: Any, frame: Frame, order: int = 0, A_WB: np.ndarray | None = None) -> Motion:
        """Motion of a frame; order 0: pose; 1: velocity too; A_WB: acceleration too."""
        row, X_BF = self._body_and_offset(context, frame)
        if frame.is_world_frame():
            return Motion(np.eye(3), np.zeros(3), np.zeros(6), np.zeros(6))
        X = self._relative_pose(context, self.world_frame(), frame._body.body_frame())
        R_WB, p_WB = X[:9].reshape(3, 3), X[9:]
        V = self._body_velocities(context)[row] if order else None
        A = None if A_WB is None else A_WB[row]
        body = Motion(R_WB, p_WB, V, A)
        if X_BF is None:
            return body
        p_WF = p_WB + R_WB @ X_BF.translation()
        R_WF = R_WB @ X_BF.rotation().matrix()
        V_F = None if V is None else np.concatenate([body.w, body.velocity_at(p_WF)])
        A_F = None if A is None else np.concatenate([body.alpha, body.acceleration_at(p_WF)])
        return Motion(R_WF, p_WF, V_F, A_F)

    def _pose_of_frame(self, context: Any, frame: Frame) -> Any:
        return self._transform(context, self._relative_pose(context, self.world_frame(), frame))

    def _velocity_of_frame(self, context: Any, frame: Frame) -> Any:
        m = self._motion(context, frame, 1)
        return self._view(context).of(SpatialVelocity_)(m.w, m.v)

    def _acceleration_of_frame(self, context: Any, frame: Frame) -> Any:
        m = self._motion(context, frame, 1, self._accelerations(context, self._vdot(context)))
        return self._view(context).of(SpatialAcceleration_)(m.alpha, m.a)

    def _relative_acceleration(self, context: Any, frame: Frame, measured_in: Frame) -> Any:
        """A_MF expressed in W."""
        A_WB = self._accelerations(context, self._vdot(context))
        F, M = self._motion(context, frame, 1, A_WB), self._motion(context, measured_in, 1, A_WB)
        alpha, a = relative_acceleration(F, M)
        return self._view(context).of(SpatialAcceleration_)(alpha, a)

    def CalcRelativeTransform(self, context: Any, frame_A: Frame, frame_B: Frame) -> Any:
        """X_AB: frame B in frame A."""
        return self._transform(context, self._relative_pose(context, frame_A, frame_B))

    def _relative_pose(self, context: Any, frame_A: Frame, frame_B: Frame) -> np.ndarray:
        """X_AB as twelve numbers."""
        view = self._view(context)
        key = frame_A, frame_B
        ask = view.places.get(key) or view.relative_pose(key, (*self._place(frame_A), *self._place(frame_B)))
        return ask()

    def _place(self, frame: Frame) -> tuple[int, int]:
        """Body row and frame row of a frame."""
        if getattr(frame, "_owner", None) is not self:
            self._require_mine("a query", frame)
        return self._rows[frame._body._index._value], self._frame_rows.get(frame._index._value, -1)

    def CalcRelativeRotationMatrix(self, context: Any, frame_A: Frame, frame_B: Frame) -> Any:
        """R_AB: orientation of frame B in frame A."""
        X_AB = self._relative_pose(context, frame_A, frame_B)
        return self._view(context).of(RotationMatrix_)._make(X_AB[:9].reshape(3, 3).copy())

    def CalcPointsPositions(self, context: Any, frame_B: Frame, p_BQi: Any, frame_A: Frame) -> np.ndarray:
        """Positions in frame A of points given in frame B [m], shape (3, n)."""
        X_AB = self._relative_pose(context, frame_A, frame_B)
        p_BQi = points("CalcPointsPositions", "p_BQi", p_BQi)
        duals = alike(X_AB.tolist()) if X_AB.dtype == object and p_BQi.dtype == float else None
        if duals is None:
            return X_AB[:9].reshape(3, 3) @ p_BQi + X_AB[9:, None]
        X, slopes = np.array(duals[0]), duals[1]
        slopes_R = slopes[:9].reshape(3, 3, -1)
        slopes_p = p_BQi.T @ slopes_R + slopes[9:, None]  # by row of R: points, derivatives
        return filled(X[:9].reshape(3, 3) @ p_BQi + X[9:, None], slopes_p.reshape(p_BQi.size, -1))

    def CalcPointsVelocities(
        self, context: Any, frame_B: Frame, p_BQi: Any, frame_A: Frame, frame_E: Frame
    ) -> np.ndarray:
        """Velocities measured in frame A, expressed in E, of points fixed to frame B [m/s], shape (3, n)."""
        A, B, E = self._motion(context, frame_A, 1), self._motion(context, frame_B, 1), self._motion(context, frame_E)
        p_WQi = B.p[:, None] + B.R @ points("CalcPointsVelocities", "p_BQi", p_BQi)
        v = [B.velocity_at(p) - A.velocity_at(p) for p in p_WQi.T]
        return E.R.T @ np.array(v).T.reshape(3, -1)

    # --- groups of bodies

    def _rows_of(self, call: str, model_instances: Any) -> np.ndarray:
        """Rows of the bodies of some model instances, without the world; of all for None."""
        self._require_finalized(call)
        if model_instances is None:
            return np.arange(1, len(self._row_bodies))
        wanted = set()
        for instance in model_instances:
            self._instances.get(instance, call)
            wanted.add(int(instance))
        return np.array(
            [r for r, b in enumerate(self._row_bodies) if r and int(b.model_instance()) in wanted], np.int64
        )

    def CalcTotalMass(self, context: Any, model_instances: list[ModelInstanceIndex] | None = None) -> float:
        """Mass [kg] of all bodies or of those of some model instances."""
        view, rows = self._view(context), self._rows_of("CalcTotalMass", model_instances)
        if not len(rows):
            return 0.0
        masses = [view.p[self._start(self._row_bodies[r])] for r in rows]
        return float(np.sum(masses)) if view.dtype == float else sum(masses[1:], masses[0])

    def _com_rows(self, call: str, context: Any, model_instances: Any) -> tuple[Any, np.ndarray, Any, Any]:
        """(view, rows, total mass, results of positions) of bodies whose centre of mass is asked for."""
        view, rows = self._view(context), self._rows_of(call, model_instances)
        if not len(rows):
            raise RuntimeError(
                f"{call}(): There must be at least one non-world body contained in model_instances."
                if model_instances is not None
                else f"{call}(): This MultibodyPlant only contains the world_body() so its center of mass is undefined."
            )
        work = view.positions()
        mass = sum(view.p[self._start(self._row_bodies[r])] for r in rows)
        if view.dtype == float and not mass > 0.0:
            raise RuntimeError(f"{call}(): the total mass must be positive, not {mass}.")
        return view, rows, mass, work

    def _roots(self, work: Any, rows: np.ndarray) -> np.ndarray:
        """Reference points of rows, in W, shape (n, 3)."""
        return work.X_WB[self._tree_model.body[rows, ROOT], 9:]

    def CalcCenterOfMassPositionInWorld(
        self, context: Any, model_instances: list[ModelInstanceIndex] | None = None
    ) -> np.ndarray:
        """p_WScm of all bodies or of those of some model instances [m], shape (3,)."""
        call = "CalcCenterOfMassPositionInWorld"
        view = self._view(context)
        if model_instances is None and type(centre := view.ask_centre_of_mass()) is not int:
            return centre
        view, rows, mass, work = self._com_rows(call, context, model_instances)
        inertia = work.inertia[rows]
        return (inertia[:, 1:4] + inertia[:, :1] * self._roots(work, rows)).sum(axis=0) / mass

    def CalcCenterOfMassTranslationalVelocityInWorld(
        self, context: Any, model_instances: list[ModelInstanceIndex] | None = None
    ) -> np.ndarray:
        """v_WScm expressed in W, of all bodies or of those of some model instances [m/s], shape (3,)."""
        call = "CalcCenterOfMassTranslationalVelocityInWorld"
        view, rows, mass, _ = self._com_rows(call, context, model_instances)
        return self._momentum_of(view, rows, np.zeros(3))[3:] / mass

    def _momentum_of(self, view: Any, rows: Any, p_WoP_W: np.ndarray) -> Any:
        """Spatial momentum of some bodies about a point; an int where that is no vector of the context's scalar."""
        ask = view.ask_momentum
        view.mask[:] = 0
        view.mask[rows] = 1
        return ask(p_WoP_W)

    def CalcCenterOfMassTranslationalAccelerationInWorld(
        self, context: Any, model_instances: list[ModelInstanceIndex] | None = None
    ) -> np.ndarray:
        """a_WScm expressed in W, of all bodies or of those of some model instances [m/s²], shape (3,)."""
        call = "CalcCenterOfMassTranslationalAccelerationInWorld"
        view, rows, mass, _ = self._com_rows(call, context, model_instances)
        return self._com_acceleration(view, rows, mass, self._accelerations(context, self._vdot(context)))

    def _com_acceleration(self, view: Any, rows: np.ndarray, mass: Any, A_WB: np.ndarray) -> np.ndarray:
        """Acceleration of a centre of mass, given those of the body origins."""
        work = view.velocities()
        inertia, V, A = work.inertia[rows], work.V[rows], A_WB[rows]
        h = inertia[:, 1:4] + inertia[:, :1] * (self._roots(work, rows) - work.X_WB[rows, 9:])
        w = V[:, :3]
        a = inertia[:, :1] * A[:, 3:] + np.cross(A[:, :3], h) + np.cross(w, np.cross(w, h))
        return a.sum(axis=0) / mass

    def CalcSpatialMomentumInWorldAboutPoint(self, context: Any, *args: Any, **kwargs: Any) -> Any:
        """Spatial momentum about a point P of W, expressed in W: `(context, p_WoP_W)` of all bodies, or
        `(context, model_instances, p_WoP_W)`.
        """  # fmt: skip
        rest, instances = list(args), kwargs.pop("model_instances", None)
        if len(rest) == 2:
            instances = rest.pop(0)
        point = rest.pop(0) if rest else kwargs.pop("p_WoP_W", None)
        call = "CalcSpatialMomentumInWorldAboutPoint"
        if rest or kwargs or point is None:
            raise TypeError(f"{call}(): incompatible function arguments. Takes (context, [model_instances], p_WoP_W).")
        view = self._view(context)
        rows = slice(None) if instances is None else self._rows_of(call, instances)
        L = self._momentum_of(view, rows, point)
        if type(L) is int:
            L = self._momentum_of(view, rows, vector(call, "p_WoP_W", point, 3))
            if type(L) is int:
                raise TypeError(f"{call}(): the point must have the scalar type of the context.")
        return view.of(SpatialMomentum_)(L)

    def CalcSpatialInertia(self, context: Any, frame_F: Frame, body_indexes: list[BodyIndex]) -> Any:
        """Spatial inertia of some bodies about Fo, expressed in F.

        Raises:
            RuntimeError: a body is named twice.
        """
        rows = [int(i) for i in body_indexes]
        if len(set(rows)) < len(rows):
            raise RuntimeError("CalcSpatialInertia(): contains a repeated BodyIndex.")
        bodies = [self.get_body(i) for i in body_indexes]
        total = self._view(context).of(SpatialInertia_).Zero()
        for body in bodies:
            if body.index() != 0:
                X_FB = self.CalcRelativeTransform(context, frame_F, body.body_frame())
                M_BBo_F = body.CalcSpatialInertiaInBodyFrame(context).ReExpress(X_FB.rotation())
                total += M_BBo_F.Shift(-X_FB.translation())
        return total

    # --- energy

    def CalcPotentialEnergy(self, context: Any) -> float:
        """Energy of gravity (zero at the world's origin) and springs [J]."""
        energy = self._view(context).ask_gravity_energy()[0]
        for element in self._force_elements:
            energy = energy + element._potential_energy(context)
        return float(energy) if isinstance(energy, float) else energy

    def CalcKineticEnergy(self, context: Any) -> float:
        """Energy of motion [J], of rotors too."""
        energy = self._view(context).ask_kinetic_energy()[0]
        return float(energy) if isinstance(energy, float) else energy

    def CalcConservativePower(self, context: Any) -> float:
        """Power of gravity and of the elastic forces of springs [W]: what potential energy loses."""
        power = self._view(context).v @ self.CalcGravityGeneralizedForces(context)
        power = sum((element._powers(context)[0] for element in self._force_elements), power)
        return float(power) if isinstance(power, float) else power

    def CalcNonConservativePower(self, context: Any) -> float:
        """Power of the dampers and of the friction of force elements [W]; joints, actuators, contact do not count."""
        self._require_finalized("CalcNonConservativePower")
        return sum((element._powers(context)[1] for element in self._force_elements), 0.0)

    EvalPotentialEnergy = CalcPotentialEnergy
    EvalKineticEnergy = CalcKineticEnergy


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b of two vectors; numpy's takes ten times as long."""
    ax, ay, az = a
    bx, by, bz = b
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def relative_acceleration(B: Motion, A: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Angular acceleration of B in A and acceleration of Bo in A, expressed in W (both motions with acceleration)."""
    w_AB, v_AB = B.w - A.w, B.v - A.velocity_at(B.p)
    alpha = B.alpha - A.alpha - cross(A.w, w_AB)
    return alpha, B.a - A.acceleration_at(B.p) - 2 * cross(A.w, v_AB)


def points(call: str, name: str, value: Any) -> np.ndarray:
    """`value` as points in columns, shape (3, n); one point may be given flat.

    Raises:
        TypeError: it is no array.
        RuntimeError: it has another number of rows.
    """
    array = np.asarray(value)
    if array.ndim == 0:
        raise TypeError(f"{call}(): incompatible function arguments. {name} must have shape (3, n), not {value!r}.")
    array = array.astype(float) if array.dtype != object else array
    array = array.reshape(-1, 1) if array.ndim == 1 else array
    if array.ndim != 2 or array.shape[0] != 3:
        raise RuntimeError(f"{call}(): {name} must have shape (3, n), not {np.shape(value)}.")
    return array
