"""Mass matrix, bias, forces, inverse and forward dynamics, Jacobians."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from sheldrake.common._overloads import expect, in_order
from sheldrake.multibody.math import SpatialAcceleration_
from sheldrake.multibody.plant._context.kinematics import Motion, points, relative_acceleration
from sheldrake.multibody.tree import Frame, JacobianWrtVariable, MultibodyForces
from sheldrake.multibody.tree._element import vector
from sheldrake.multibody.tree._kernels import jacobians, queries

_KV = JacobianWrtVariable.kV


class Dynamics:
    """Terms of the equation of motion M(q) vdot + C(q, v) v = tau."""

    def CalcMassMatrix(self, context: Any) -> np.ndarray:
        """M(q), reflected inertias of actuators included, shape (nv, nv)."""
        return self._view(context).ask_mass_matrix()

    def CalcMassMatrixViaInverseDynamics(self, context: Any) -> np.ndarray:
        """M(q), column by column from inverse dynamics, shape (nv, nv): slower, for checks."""
        view = self._view(context)
        no_F, no_tau = np.zeros((view.nb, 6)), np.zeros(self._nv)
        still = view.ask_inverse_dynamics(np.zeros(self._nv), no_F, no_tau)
        columns = [view.ask_inverse_dynamics(unit, no_F, no_tau) - still for unit in np.eye(self._nv)]
        return np.array(columns).T.reshape(self._nv, self._nv)

    def CalcBiasTerm(self, context: Any) -> np.ndarray:
        """C(q, v) v: Coriolis, centrifugal and gyroscopic forces, shape (nv,)."""
        return self._view(context).ask_bias()

    def CalcGravityGeneralizedForces(self, context: Any) -> np.ndarray:
        """tau_g(q): generalized forces of gravity, shape (nv,)."""
        return self._view(context).ask_gravity()

    def CalcInverseDynamics(self, context: Any, known_vdot: Any, external_forces: MultibodyForces) -> np.ndarray:
        """Generalized forces that give known_vdot besides external_forces, gravity among these if wanted; (nv,)."""
        view = self._view(context)
        if self._rows_in_order and type(external_forces) is MultibodyForces:
            tau = view.ask_inverse_dynamics(known_vdot, external_forces._F_Bo_W, external_forces._tau)
            if type(tau) is not int:
                return tau
        return self._any_inverse_dynamics(view, known_vdot, external_forces)

    def _any_inverse_dynamics(self, view: Any, known_vdot: Any, external_forces: MultibodyForces) -> np.ndarray:
        """The same for arguments that must be converted or put in order first.

        Raises:
            TypeError: known_vdot is no vector of nv numbers of the context's scalar.
            RuntimeError: the forces are those of another plant.
        """
        call = "CalcInverseDynamics"
        vdot = vector(call, "known_vdot", known_vdot, self._nv)
        self._require_fitting(call, external_forces)
        tau = view.ask_inverse_dynamics(vdot, external_forces._F_Bo_W[self._row_indices], external_forces._tau)
        if type(tau) is int:
            raise TypeError(f"{call}(): known_vdot and external_forces must have the scalar type of the context.")
        return tau

    def CalcForceElementsContribution(self, context: Any, forces: MultibodyForces) -> None:
        """Sets `forces` to those of all force elements, gravity and joint damping included."""
        view = self._view(context)
        self._require_fitting("CalcForceElementsContribution", forces)
        found = view.ask_element_forces(self._force_model)()
        forces._F_Bo_W[:] = found[: 6 * view.nb].reshape(-1, 6)[self._rows]
        forces._tau[:] = found[6 * view.nb :]
        for joint in self._joints:
            joint.AddInDamping(context, forces)

    def _require_fitting(self, call: str, forces: MultibodyForces) -> None:
        expect(call, forces, MultibodyForces)
        if forces.num_bodies() != len(self._rows) or forces.num_velocities() != self._nv:
            raise RuntimeError(
                f"{call}(): the forces are for {forces.num_bodies()} bodies and {forces.num_velocities()} velocities, "
                f"this plant has {len(self._rows)} and {self._nv}."
            )

    def CalcGeneralizedForces(self, context: Any, forces: MultibodyForces) -> np.ndarray:
        """All of `forces` as generalized forces, shape (nv,)."""
        self._require_fitting("CalcGeneralizedForces", forces)
        F = np.empty_like(forces._F_Bo_W)
        F[self._rows] = forces._F_Bo_W
        tau = self._view(context).ask_generalized_forces(F)
        if type(tau) is int:
            raise TypeError("CalcGeneralizedForces(): the forces must have the scalar type of the context.")
        return tau + forces._tau

    # --- positions and velocities

    def MapVelocityToQDot(self, context: Any, v: Any) -> np.ndarray:
        """qdot = N(q) v, shape (nq,)."""
        view = self._view(context)
        values = vector("MapVelocityToQDot", "v", v, self._nv)
        if self._v_is_qdot and values.dtype == view.dtype:
            return values
        given, qdot = np.zeros(self._nv), view.buffer("qdot_out", self._nq)
        ask = view.query(queries.calc_qdot, view.model, view.q, given, qdot, given=("v",), needs=0, answer=qdot)
        return self._mapped("MapVelocityToQDot", ask(values))

    def MapQDotToVelocity(self, context: Any, qdot: Any) -> np.ndarray:
        """v = N⁺(q) qdot, shape (nv,)."""
        view = self._view(context)
        values = vector("MapQDotToVelocity", "qdot", qdot, self._nq)
        if self._v_is_qdot and values.dtype == view.dtype:
            return values
        given, v = np.zeros(self._nq), view.buffer("v_out", self._nv)
        ask = view.query(queries.calc_velocity, view.model, view.q, given, v, given=("qdot",), needs=0, answer=v)
        return self._mapped("MapQDotToVelocity", ask(values))

    def _mapped(self, call: str, found: Any) -> np.ndarray:
        if type(found) is int:
            raise TypeError(f"{call}(): the given numbers must have the scalar type of the context.")
        return found

    def _qdot_map(self, context: Any) -> np.ndarray:
        """N⁺(q) as a dense matrix, shape (nv, nq)."""
        columns = [self.MapQDotToVelocity(context, unit) for unit in np.eye(self._nq)]
        return np.array(columns).T.reshape(self._nv, self._nq)

    def MakeVelocityToQDotMap(self, context: Any) -> Any:
        """N(q), a scipy.sparse.csc_matrix, shape (nq, nv)."""
        from scipy.sparse import csc_matrix

        columns = [self.MapVelocityToQDot(context, unit) for unit in np.eye(self._nv)]
        return csc_matrix(np.array(columns).T.reshape(self._nq, self._nv))

    def MakeQDotToVelocityMap(self, context: Any) -> Any:
        """N⁺(q), a scipy.sparse.csc_matrix, shape (nv, nq)."""
        from scipy.sparse import csc_matrix

        return csc_matrix(self._qdot_map(context))

    def IsVelocityEqualToQDot(self) -> bool:
        """Whether qdot = v for all joints."""
        self._require_finalized("IsVelocityEqualToQDot")
        return self._v_is_qdot

    @functools.cached_property
    def _v_is_qdot(self) -> bool:
        same = ("weld", "revolute", "prismatic", "screw", "planar", "universal", "curvilinear")
        return all(j.type_name() in same for j in self._joints)

    # --- Jacobians

    def _frame_jacobian(
        self, context: Any, call: str, frame_B: Frame, p_BoBp_B: Any, frame_A: Frame, frame_E: Frame
    ) -> np.ndarray:
        """Spatial velocity Jacobian of a point of frame B measured in A, expressed in E, shape (6, nv)."""
        view = self._view(context)
        key = frame_B, frame_A, frame_E
        ask = view.places.get(key) or self._jacobian_query(view, key)
        J = ask(p_BoBp_B)
        if type(J) is int:
            J = ask(vector(call, "p_BoBp_B", p_BoBp_B, 3))
            if type(J) is int:
                raise TypeError(f"{call}(): the point must have the scalar type of the context.")
        return J

    def _jacobian_query(self, view: Any, frames: tuple[Frame, Frame, Frame]) -> Any:
        B, A, E = (self._place(frame) for frame in frames)
        return view.jacobian(frames, (*B, A[0], *E))

    def _jacobian(self, context: Any, frame_B: Frame, frame_A: Frame, p_WQ: np.ndarray) -> np.ndarray:
        """Spatial velocity Jacobian of a point of B, measured in A, expressed in W, shape (6, nv)."""
        view = self._view(context)
        bodies, J = view.integers("bodies", 2), view.buffer("J", 6, self._nv)
        bodies[:] = self._rows[frame_B._body._index._value], self._rows[frame_A._body._index._value]
        arguments = view.model, view.work, bodies, np.zeros(3), J
        ask = view.query(jacobians.calc_relative_jacobian, *arguments, given=("point",), needs=view.POSES, answer=J)
        return ask(np.ascontiguousarray(p_WQ))

    def _express(self, context: Any, call: str, J: np.ndarray, with_respect_to: Any, frame_E: Frame) -> np.ndarray:
        """A Jacobian in W, blocks of three rows, turned to E and to the wanted variable."""
        if not frame_E.is_world_frame():
            R_EW = self._motion(context, frame_E).R.T
            J = np.concatenate([R_EW @ J[r : r + 3] for r in range(0, len(J), 3)])
        return self._by_variable(context, call, J, with_respect_to)

    def _by_variable(self, context: Any, call: str, J: np.ndarray, with_respect_to: Any) -> np.ndarray:
        """A new Jacobian with respect to v or qdot, from one with respect to v."""
        if with_respect_to is JacobianWrtVariable.kV:
            return J.copy()
        if with_respect_to is not JacobianWrtVariable.kQDot:
            raise TypeError(
                f"{call}(): incompatible function arguments. with_respect_to must be a JacobianWrtVariable, not "
                f"{with_respect_to!r}."
            )
        return J.copy() if self.IsVelocityEqualToQDot() else J @ self._qdot_map(context)

    def CalcJacobianSpatialVelocity(
        self,
        context: Any,
        with_respect_to: JacobianWrtVariable,
        frame_B: Frame,
        p_BoBp_B: Any,
        frame_A: Frame,
        frame_E: Frame,
    ) -> np.ndarray:
        """J with V_ABp_E = J s for a point Bp of frame B, shape (6, nv or nq).

        Args:
            context: Where the bodies are.
            with_respect_to: s: v or qdot.
            frame_B: The frame that moves.
            p_BoBp_B: The point [m], shape (3,).
            frame_A: The frame in which its velocity is measured.
            frame_E: The frame in which it is expressed.
        """
        call = "CalcJacobianSpatialVelocity"
        J = self._frame_jacobian(context, call, frame_B, p_BoBp_B, frame_A, frame_E)
        return J if with_respect_to is _KV else self._by_variable(context, call, J, with_respect_to)

    def CalcJacobianAngularVelocity(
        self, context: Any, with_respect_to: JacobianWrtVariable, frame_B: Frame, frame_A: Frame, frame_E: Frame
    ) -> np.ndarray:
        """J with w_AB_E = J s, shape (3, nv or nq); arguments as in CalcJacobianSpatialVelocity()."""
        call = "CalcJacobianAngularVelocity"
        J = self._frame_jacobian(context, call, frame_B, np.zeros(3), frame_A, frame_E)[:3]
        return self._by_variable(context, call, J, with_respect_to)

    def CalcJacobianTranslationalVelocity(
        self,
        context: Any,
        with_respect_to: JacobianWrtVariable,
        frame_B: Frame,
        p_BoBi_B: Any,
        frame_A: Frame,
        frame_E: Frame,
    ) -> np.ndarray:
        """J with v_ABi_E = J s for points Bi of frame B, stacked, shape (3 n, nv or nq)."""
        call = "CalcJacobianTranslationalVelocity"
        p_BoBi_B = points(call, "p_BoBi_B", p_BoBi_B)
        if p_BoBi_B.shape[1] == 1:
            point = np.ascontiguousarray(p_BoBi_B[:, 0])
            J = self._frame_jacobian(context, call, frame_B, point, frame_A, frame_E)[3:]
            return self._by_variable(context, call, J, with_respect_to)
        given = np.ascontiguousarray(p_BoBi_B.T)
        rows = [self._frame_jacobian(context, call, frame_B, point, frame_A, frame_E)[3:] for point in given]
        return self._by_variable(context, call, np.concatenate(rows), with_respect_to)

    def CalcJacobianPositionVector(
        self, context: Any, frame_B: Frame, p_BoBi_B: Any, frame_A: Frame, frame_E: Frame
    ) -> np.ndarray:
        """Partial derivatives with respect to q of p_AoBi_E, differentiated in A, stacked, shape (3 n, nq)."""
        return self.CalcJacobianTranslationalVelocity(
            context, JacobianWrtVariable.kQDot, frame_B, p_BoBi_B, frame_A, frame_E
        )

    def CalcJacobianCenterOfMassTranslationalVelocity(self, context: Any, *args: Any, **kwargs: Any) -> np.ndarray:
        """J with v_AScm_E = J s, shape (3, nv or nq): `(context, [model_instances], with_respect_to, frame_A,
        frame_E)`.
        """  # fmt: skip
        call = "CalcJacobianCenterOfMassTranslationalVelocity"
        instances, wrt, frame_A, frame_E = com_arguments(call, args, kwargs)
        view, rows, mass, _ = self._com_rows(call, context, instances)
        mask, J = view.integers("mask", len(self._row_bodies)), view.buffer("J_com", 3, self._nv)
        mask[:] = 0
        mask[rows] = 1
        arguments, needs = (view.model, view.work, mask, J), view.POSES | view.INERTIAS
        J = view.query(jacobians.calc_momentum_jacobian, *arguments, given=(), needs=needs, answer=J)() / mass
        if not frame_A.is_world_frame():
            p_WScm = self.CalcCenterOfMassPositionInWorld(context, instances)
            J = J - self._jacobian(context, frame_A, self.world_frame(), p_WScm)[3:]
        return self._express(context, call, J, wrt, frame_E)

    # --- bias accelerations

    def _bias_motions(self, context: Any, call: str, wrt: Any, frame_B: Frame, frame_A: Frame) -> tuple[Motion, Motion]:
        """Motions of B and A with the accelerations they have when the speeds s do not change."""
        A_WB = self._accelerations(context, self._bias_vdot(context, call, wrt))
        return self._motion(context, frame_B, 1, A_WB), self._motion(context, frame_A, 1, A_WB)

    def _bias_vdot(self, context: Any, call: str, wrt: Any) -> np.ndarray:
        if wrt is not JacobianWrtVariable.kV:
            raise RuntimeError(f"{call}(): only supports with_respect_to == JacobianWrtVariable.kV, not {wrt}.")
        return np.zeros(self._nv)

    def CalcBiasSpatialAcceleration(
        self,
        context: Any,
        with_respect_to: JacobianWrtVariable,
        frame_B: Frame,
        p_BoBp_B: Any,
        frame_A: Frame,
        frame_E: Frame,
    ) -> Any:
        """The part of A_ABp_E that does not depend on vdot; arguments as in CalcJacobianSpatialVelocity()."""
        call = "CalcBiasSpatialAcceleration"
        B, A = self._bias_motions(context, call, with_respect_to, frame_B, frame_A)
        moved = shifted(B, B.R @ vector(call, "p_BoBp_B", p_BoBp_B, 3))
        alpha, a = relative_acceleration(moved, A)
        R_EW = self._motion(context, frame_E).R.T
        return self._view(context).of(SpatialAcceleration_)(R_EW @ alpha, R_EW @ a)

    def CalcBiasTranslationalAcceleration(
        self,
        context: Any,
        with_respect_to: JacobianWrtVariable,
        frame_B: Frame,
        p_BoBi_B: Any,
        frame_A: Frame,
        frame_E: Frame,
    ) -> np.ndarray:
        """The part of a_ABi_E that does not depend on vdot, for points Bi of frame B [m/s²], shape (3, n)."""
        call = "CalcBiasTranslationalAcceleration"
        B, A = self._bias_motions(context, call, with_respect_to, frame_B, frame_A)
        arms = (B.R @ points(call, "p_BoBi_B", p_BoBi_B)).T
        R_EW = self._motion(context, frame_E).R.T
        return np.array([R_EW @ relative_acceleration(shifted(B, arm), A)[1] for arm in arms]).T

    def CalcBiasCenterOfMassTranslationalAcceleration(self, context: Any, *args: Any, **kwargs: Any) -> np.ndarray:
        """The part of a_AScm_E that does not depend on vdot, shape (3,): `(context, [model_instances],
        with_respect_to, frame_A, frame_E)`.

        Raises:
            RuntimeError: with_respect_to is not kV.
        """  # fmt: skip
        call = "CalcBiasCenterOfMassTranslationalAcceleration"
        instances, wrt, frame_A, frame_E = com_arguments(call, args, kwargs)
        view, rows, mass, _ = self._com_rows(call, context, instances)
        A_WB = self._accelerations(context, self._bias_vdot(context, call, wrt))
        a = self._com_acceleration(view, rows, mass, A_WB)
        if not frame_A.is_world_frame():
            p = self.CalcCenterOfMassPositionInWorld(context, instances)
            v = self.CalcCenterOfMassTranslationalVelocityInWorld(context, instances)
            still = np.zeros(3)
            S = Motion(np.eye(3), p, np.concatenate([still, v]), np.concatenate([still, a]))
            a = relative_acceleration(S, self._motion(context, frame_A, 1, A_WB))[1]
        return self._motion(context, frame_E).R.T @ a


def shifted(B: Motion, arm: np.ndarray) -> Motion:
    """Motion of the frame fixed to B whose origin is at an arm from Bo, given in W."""
    p = B.p + arm
    return Motion(B.R, p, np.concatenate([B.w, B.velocity_at(p)]), np.concatenate([B.alpha, B.acceleration_at(p)]))


def com_arguments(call: str, args: tuple, kwargs: dict[str, Any]) -> tuple[Any, Any, Frame, Frame]:
    """(model instances or None, with_respect_to, frame_A, frame_E)."""
    names = ("model_instances", "with_respect_to", "frame_A", "frame_E")
    of_all = in_order(names[1:], args, kwargs)
    found = in_order(names, args, kwargs) if of_all is None else [None, *of_all]
    if found is None:
        raise TypeError(
            f"{call}(): incompatible function arguments. Takes (context, [model_instances: list[ModelInstanceIndex]], "
            "with_respect_to: JacobianWrtVariable, frame_A: Frame, frame_E: Frame)."
        )
    model_instances, with_respect_to, frame_A, frame_E = found
    return model_instances, with_respect_to, expect(call, frame_A, Frame), expect(call, frame_E, Frame)
