"""Mass matrix, bias, forces, inverse and forward dynamics, Jacobians."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np
from numpy.typing import ArrayLike

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch, expect, in_order
from sheldrake.common._scalars import plain_vector
from sheldrake.common.calls import Query
from sheldrake.multibody.math import SpatialAcceleration, SpatialAcceleration_
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._context.contexts import Contexts
from sheldrake.multibody.plant._context.coordinates import sparse
from sheldrake.multibody.plant._context.kinematics import Kinematics, cross, fitting, points
from sheldrake.multibody.plant._context.view import View
from sheldrake.multibody.tree import Frame, JacobianWrtVariable, MultibodyForces
from sheldrake.multibody.tree._element import vector
from sheldrake.systems.framework import Context

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scipy.sparse import csc_matrix

    from sheldrake.multibody.tree import ModelInstanceIndex

_KV = JacobianWrtVariable.kV


class Dynamics:
    """Terms of the equation of motion M(q) vdot + C(q, v) v = tau.

    Args:
        elements: Bodies, frames and joints.
        contexts: Where positions and velocities are.
        kinematics: Where frames are and how they move.
    """

    def __init__(self, elements: Elements, contexts: Contexts, kinematics: Kinematics) -> None:
        self._elements, self._contexts, self._kinematics = elements, contexts, kinematics

    def CalcMassMatrix(self, context: Context) -> np.ndarray:
        """M(q), reflected inertias of actuators included, shape (nv, nv)."""
        return self._contexts.view(context).ask_mass_matrix()

    def CalcMassMatrixViaInverseDynamics(self, context: Context) -> np.ndarray:
        """M(q), column by column from inverse dynamics, shape (nv, nv): slower, for checks."""
        view = self._contexts.view(context)
        no_F, no_tau = np.zeros((view.nb, 6)), np.zeros(view.nv)
        still = view.ask_inverse_dynamics(np.zeros(view.nv), no_F, no_tau)
        columns = [view.ask_inverse_dynamics(unit, no_F, no_tau) - still for unit in np.eye(view.nv)]
        return np.array(columns).T.reshape(view.nv, view.nv)

    def CalcBiasTerm(self, context: Context) -> np.ndarray:
        """C(q, v) v: Coriolis, centrifugal and gyroscopic forces, shape (nv,)."""
        return self._contexts.view(context).ask_bias()

    def CalcGravityGeneralizedForces(self, context: Context) -> np.ndarray:
        """tau_g(q): generalized forces of gravity, shape (nv,)."""
        return self._contexts.view(context).ask_gravity()

    def CalcInverseDynamics(
        self, context: Context, known_vdot: ArrayLike, external_forces: MultibodyForces
    ) -> np.ndarray:
        """Generalized forces that give known_vdot besides external_forces, gravity among these if wanted; (nv,)."""
        view = self._contexts.view(context)
        if view.frozen.rows_in_order and type(external_forces) is MultibodyForces:
            tau = view.ask_inverse_dynamics(known_vdot, external_forces._F_Bo_W, external_forces._tau)
            if type(tau) is not int:
                return tau
        return self._any_inverse_dynamics(view, known_vdot, external_forces)

    def _any_inverse_dynamics(self, view: View, known_vdot: ArrayLike, external_forces: MultibodyForces) -> np.ndarray:
        """The same for arguments that must be converted or put in order first.

        Raises:
            TypeError: known_vdot is no vector of nv numbers of the context's scalar.
            RuntimeError: the forces are those of another plant.
        """
        call = "CalcInverseDynamics"
        vdot = vector(call, "known_vdot", known_vdot, view.nv)
        _require_fitting(call, view, external_forces)
        F_Bo_W = external_forces._F_Bo_W[view.frozen.row_indices]
        tau = view.ask_inverse_dynamics(vdot, F_Bo_W, external_forces._tau)
        if type(tau) is int:
            raise TypeError(f"{call}(): known_vdot and external_forces must have the scalar type of the context.")
        return tau

    def CalcForceElementsContribution(self, context: Context, forces: MultibodyForces) -> None:
        """Sets `forces` to those of all force elements, gravity and joint damping included."""
        view = self._contexts.view(context)
        _require_fitting("CalcForceElementsContribution", view, forces)
        F, tau = forces._F_Bo_W, forces._tau
        if (view.T is float) != (tau.dtype == float):
            raise TypeError(
                "CalcForceElementsContribution(): incompatible function arguments. forces must have the scalar type of "
                "the context."
            )
        found = view.ask_contribution()
        F[:], tau[:] = found[: F.size].reshape(F.shape), found[F.size :]

    def CalcGeneralizedForces(self, context: Context, forces: MultibodyForces) -> np.ndarray:
        """All of `forces` as generalized forces, shape (nv,)."""
        view = self._contexts.view(context)
        _require_fitting("CalcGeneralizedForces", view, forces)
        F = np.empty_like(forces._F_Bo_W)
        F[view.frozen.rows] = forces._F_Bo_W
        tau = view.ask_generalized_forces(F)
        if type(tau) is int:
            raise TypeError("CalcGeneralizedForces(): the forces must have the scalar type of the context.")
        return tau + forces._tau

    # --- positions and velocities

    def MapVelocityToQDot(self, context: Context, v: ArrayLike) -> np.ndarray:
        """qdot = N(q) v, shape (nq,)."""
        view = self._contexts.view(context)
        if type(found := view.ask_qdot(v)) is int:
            found = view.ask_qdot(vector("MapVelocityToQDot", "v", v, view.nv))
        return fitting("MapVelocityToQDot", found)

    def MapQDotToVelocity(self, context: Context, qdot: ArrayLike) -> np.ndarray:
        """v = N⁺(q) qdot, shape (nv,)."""
        view = self._contexts.view(context)
        if type(found := view.ask_velocity_of_qdot(qdot)) is int:
            found = view.ask_velocity_of_qdot(vector("MapQDotToVelocity", "qdot", qdot, view.nq))
        return fitting("MapQDotToVelocity", found)

    def qdot_to_velocity(self, context: Context) -> np.ndarray:
        """N⁺(q) as a dense matrix, shape (nv, nq)."""
        return self._contexts.view(context).ask_qdot_map().T

    @checked
    def MakeVelocityToQDotMap(self, context: Context) -> csc_matrix:
        """N(q), a scipy.sparse.csc_matrix, shape (nq, nv)."""
        return sparse(self._contexts.view(context).ask_velocity_map())

    @checked
    def MakeQDotToVelocityMap(self, context: Context) -> csc_matrix:
        """N⁺(q), a scipy.sparse.csc_matrix, shape (nv, nq)."""
        return sparse(np.ascontiguousarray(self.qdot_to_velocity(context).T))

    def IsVelocityEqualToQDot(self) -> bool:
        """Whether qdot = v for all joints."""
        return self._elements.model("IsVelocityEqualToQDot").v_is_qdot

    # --- Jacobians

    def _frame_jacobian(
        self, context: Context, call: str, frame_B: Frame, p_BoBp_B: ArrayLike, frame_A: Frame, frame_E: Frame
    ) -> np.ndarray:
        """Spatial velocity Jacobian of a point of frame B measured in A, expressed in E, shape (6, nv)."""
        view = self._contexts.view(context)
        key = frame_B, frame_A, frame_E
        ask = view.places.get(key) or self._jacobian_query(view, key)
        J = ask(p_BoBp_B)
        if type(J) is int:
            J = ask(vector(call, "p_BoBp_B", p_BoBp_B, 3))
            if type(J) is int:
                raise TypeError(f"{call}(): the point must have the scalar type of the context.")
        return J

    def _jacobian_query(self, view: View, frames: tuple[Frame, Frame, Frame]) -> Query:
        B, A, E = (self._kinematics.place(view, frame) for frame in frames)
        return view.keep(view.places, frames, view.queries.jacobian(*A, *B, *E))

    def _express(
        self, context: Context, call: str, J: np.ndarray, with_respect_to: JacobianWrtVariable, frame_E: Frame
    ) -> np.ndarray:
        """A Jacobian in W, blocks of three rows, turned to E and to the wanted variable."""
        if not frame_E.is_world_frame():
            R_EW = self._kinematics.rotation_in_world(context, frame_E).T
            J = np.concatenate([R_EW @ J[r : r + 3] for r in range(0, len(J), 3)])
        return self._by_variable(context, call, J, with_respect_to)

    def _by_variable(
        self, context: Context, call: str, J: np.ndarray, with_respect_to: JacobianWrtVariable
    ) -> np.ndarray:
        """A Jacobian with respect to v or qdot, from one with respect to v."""
        if with_respect_to is _KV:
            return J
        if with_respect_to is not JacobianWrtVariable.kQDot:
            raise Mismatch(
                f"{call}(): incompatible function arguments. with_respect_to must be a JacobianWrtVariable, not "
                f"{with_respect_to!r}."
            )
        return J if self._contexts.view(context).frozen.v_is_qdot else J @ self.qdot_to_velocity(context)

    def CalcJacobianSpatialVelocity(
        self,
        context: Context,
        with_respect_to: JacobianWrtVariable,
        frame_B: Frame,
        p_BoBp_B: ArrayLike,
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
        self, context: Context, with_respect_to: JacobianWrtVariable, frame_B: Frame, frame_A: Frame, frame_E: Frame
    ) -> np.ndarray:
        """J with w_AB_E = J s, shape (3, nv or nq); arguments as in CalcJacobianSpatialVelocity()."""
        call = "CalcJacobianAngularVelocity"
        J = self._frame_jacobian(context, call, frame_B, np.zeros(3), frame_A, frame_E)[:3]
        return self._by_variable(context, call, J, with_respect_to)

    def CalcJacobianTranslationalVelocity(
        self,
        context: Context,
        with_respect_to: JacobianWrtVariable,
        frame_B: Frame,
        p_BoBi_B: ArrayLike,
        frame_A: Frame,
        frame_E: Frame,
    ) -> np.ndarray:
        """J with v_ABi_E = J s for points Bi of frame B, stacked, shape (3 n, nv or nq)."""
        call = "CalcJacobianTranslationalVelocity"
        if (point := plain_vector(p_BoBi_B)) is not None:  # nearly always
            J = self._frame_jacobian(context, call, frame_B, point, frame_A, frame_E)[3:]
            return J if with_respect_to is _KV else self._by_variable(context, call, J, with_respect_to)
        p_BoBi_B = points(call, "p_BoBi_B", p_BoBi_B)
        if p_BoBi_B.shape[1] == 1:
            J = self._frame_jacobian(context, call, frame_B, p_BoBi_B.ravel(), frame_A, frame_E)[3:]
            return self._by_variable(context, call, J, with_respect_to)
        given = np.ascontiguousarray(p_BoBi_B.T)
        rows = [self._frame_jacobian(context, call, frame_B, point, frame_A, frame_E)[3:] for point in given]
        return self._by_variable(context, call, np.concatenate(rows), with_respect_to)

    def CalcJacobianPositionVector(
        self, context: Context, frame_B: Frame, p_BoBi_B: ArrayLike, frame_A: Frame, frame_E: Frame
    ) -> np.ndarray:
        """Partial derivatives with respect to q of p_AoBi_E, differentiated in A, stacked, shape (3 n, nq)."""
        return self.CalcJacobianTranslationalVelocity(
            context, JacobianWrtVariable.kQDot, frame_B, p_BoBi_B, frame_A, frame_E
        )

    @typing_overload
    def CalcJacobianCenterOfMassTranslationalVelocity(
        self, context: Context, with_respect_to: JacobianWrtVariable, frame_A: Frame, frame_E: Frame
    ) -> np.ndarray: ...
    @typing_overload
    def CalcJacobianCenterOfMassTranslationalVelocity(
        self,
        context: Context,
        model_instances: Sequence[ModelInstanceIndex],
        with_respect_to: JacobianWrtVariable,
        frame_A: Frame,
        frame_E: Frame,
    ) -> np.ndarray: ...
    def CalcJacobianCenterOfMassTranslationalVelocity(self, context: Context, *args: Any, **kwargs: Any) -> np.ndarray:
        """J with v_AScm_E = J s, shape (3, nv or nq): `(context, [model_instances], with_respect_to, frame_A,
        frame_E)`.
        """  # fmt: skip
        call = "CalcJacobianCenterOfMassTranslationalVelocity"
        instances, wrt, frame_A, frame_E = com_arguments(call, args, kwargs)
        view, bodies = self._kinematics.choose(call, context, instances)
        J = self._kinematics.of_centre(call, view.ask_jacobian_of_centre(bodies))
        if not frame_A.is_world_frame():
            world = self._elements.world.body_frame()
            p_WScm = self._kinematics.CalcCenterOfMassPositionInWorld(context, instances)
            J = J + self._frame_jacobian(context, call, world, p_WScm, frame_A, world)[3:]
        return self._express(context, call, J, wrt, frame_E)

    # --- bias accelerations

    def _bias_query(
        self, context: Context, call: str, wrt: JacobianWrtVariable, frames: tuple[Frame, Frame, Frame]
    ) -> Query:
        """A query for the bias acceleration of a point of B, measured in A, expressed in E; frames are B, A, E."""
        if wrt is not JacobianWrtVariable.kV:
            raise RuntimeError(f"{call}(): only supports with_respect_to == JacobianWrtVariable.kV, not {wrt}.")
        view, key = self._contexts.view(context), (call, frames)
        ask = view.places.get(key)
        if ask is None:
            B, A, E = (self._kinematics.place(view, frame) for frame in frames)
            ask = view.keep(view.places, key, view.queries.bias_acceleration(*A, *B, *E))
        return ask

    def _bias_vdot(self, context: Context, call: str, wrt: JacobianWrtVariable) -> np.ndarray:
        if wrt is not JacobianWrtVariable.kV:
            raise RuntimeError(f"{call}(): only supports with_respect_to == JacobianWrtVariable.kV, not {wrt}.")
        return np.zeros(self._contexts.view(context).nv)

    @checked
    def CalcBiasSpatialAcceleration(
        self,
        context: Context,
        with_respect_to: JacobianWrtVariable,
        frame_B: Frame,
        p_BoBp_B: ArrayLike,
        frame_A: Frame,
        frame_E: Frame,
    ) -> SpatialAcceleration:
        """The part of A_ABp_E that does not depend on vdot; arguments as in CalcJacobianSpatialVelocity()."""
        call = "CalcBiasSpatialAcceleration"
        ask = self._bias_query(context, call, with_respect_to, (frame_B, frame_A, frame_E))
        A = fitting(call, ask(vector(call, "p_BoBp_B", p_BoBp_B, 3)))
        return self._contexts.view(context).of(SpatialAcceleration_)._make(A)

    @checked
    def CalcBiasTranslationalAcceleration(
        self,
        context: Context,
        with_respect_to: JacobianWrtVariable,
        frame_B: Frame,
        p_BoBi_B: ArrayLike,
        frame_A: Frame,
        frame_E: Frame,
    ) -> np.ndarray:
        """The part of a_ABi_E that does not depend on vdot, for points Bi of frame B [m/s²], shape (3, n)."""
        call = "CalcBiasTranslationalAcceleration"
        ask = self._bias_query(context, call, with_respect_to, (frame_B, frame_A, frame_E))
        columns = points(call, "p_BoBi_B", p_BoBi_B).T
        return np.array([fitting(call, ask(np.ascontiguousarray(p)))[3:] for p in columns]).T

    @typing_overload
    def CalcBiasCenterOfMassTranslationalAcceleration(
        self, context: Context, with_respect_to: JacobianWrtVariable, frame_A: Frame, frame_E: Frame
    ) -> np.ndarray: ...
    @typing_overload
    def CalcBiasCenterOfMassTranslationalAcceleration(
        self,
        context: Context,
        model_instances: Sequence[ModelInstanceIndex],
        with_respect_to: JacobianWrtVariable,
        frame_A: Frame,
        frame_E: Frame,
    ) -> np.ndarray: ...
    def CalcBiasCenterOfMassTranslationalAcceleration(self, context: Context, *args: Any, **kwargs: Any) -> np.ndarray:
        """The part of a_AScm_E that does not depend on vdot, shape (3,): `(context, [model_instances],
        with_respect_to, frame_A, frame_E)`.

        Raises:
            RuntimeError: with_respect_to is not kV.
        """  # fmt: skip
        call = "CalcBiasCenterOfMassTranslationalAcceleration"
        instances, wrt, frame_A, frame_E = com_arguments(call, args, kwargs)
        A_WB = self._kinematics.accelerations(context, self._bias_vdot(context, call, wrt))
        a = self._kinematics.acceleration_of_centre(call, context, instances, A_WB)
        if not frame_A.is_world_frame():  # of the point of W where the centre is now, and the centre's in W
            world = self._elements.world.body_frame()
            p_WScm = self._kinematics.CalcCenterOfMassPositionInWorld(context, instances)
            v = self._kinematics.CalcCenterOfMassTranslationalVelocityInWorld(context, instances)
            V_AQ = self._kinematics.point_velocity(context, world, frame_A, world)(p_WScm)
            A_AQ = self._kinematics.point_acceleration(context, world, frame_A, world)(A_WB, p_WScm)
            a = A_AQ[3:] + a + 2 * cross(V_AQ[:3], v)
        return a if frame_E.is_world_frame() else self._kinematics.rotation_in_world(context, frame_E).T @ a


def _require_fitting(call: str, view: View, forces: MultibodyForces) -> None:
    expect(call, forces, MultibodyForces).require_fitting(call, view.nb, view.nv)


def com_arguments(call: str, args: tuple, kwargs: dict[str, Any]) -> tuple[Any, Any, Frame, Frame]:
    """(model instances or None, with_respect_to, frame_A, frame_E)."""
    names = ("model_instances", "with_respect_to", "frame_A", "frame_E")
    of_all = in_order(names[1:], args, kwargs)
    found = in_order(names, args, kwargs) if of_all is None else [None, *of_all]
    if found is None:
        raise Mismatch(
            f"{call}(): incompatible function arguments. Takes (context, [model_instances: list[ModelInstanceIndex]], "
            "with_respect_to: JacobianWrtVariable, frame_A: Frame, frame_E: Frame)."
        )
    model_instances, with_respect_to, frame_A, frame_E = found
    return model_instances, with_respect_to, expect(call, frame_A, Frame), expect(call, frame_E, Frame)
