"""How bodies and frames accelerate: at the present state, and in the last step."""

from __future__ import annotations

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.multibody.math import SpatialAcceleration, SpatialAcceleration_
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._building.settings import Settings
from sheldrake.multibody.plant._context.contexts import Contexts
from sheldrake.multibody.plant._context.dynamics import Dynamics
from sheldrake.multibody.plant._context.kinematics import Kinematics, relative_acceleration
from sheldrake.multibody.plant._step.advance import Advance
from sheldrake.multibody.tree import Frame, ModelInstanceIndex, RigidBody
from sheldrake.multibody.tree._kernels import dynamics as kernels
from sheldrake.symbolic import Expression
from sheldrake.systems.framework import Context


class Accelerations:
    """Accelerations of a plant in its contexts.

    Args:
        elements: Bodies and frames.
        settings: Discrete or continuous.
        contexts: Where they are.
        kinematics: How they move.
        dynamics: What they take.
        advance: Which forces act.
    """

    def __init__(
        self,
        elements: Elements,
        settings: Settings,
        contexts: Contexts,
        kinematics: Kinematics,
        dynamics: Dynamics,
        advance: Advance,
    ) -> None:
        self._elements, self._settings, self._contexts = elements, settings, contexts
        self._kinematics, self._dynamics, self._advance = kinematics, dynamics, advance

    def _present(self, context: Context) -> np.ndarray:
        """Of the body origins at the present state, by row, shape (num_bodies, 6)."""
        return self._kinematics.accelerations(context, self._advance.vdot(context))

    def in_last_step(self, context: Context) -> np.ndarray:
        """Of the body origins as they were at the beginning of the last step, by row, shape (num_bodies, 6)."""
        if not self._settings.is_discrete():
            return self._present(context)
        work, view = self._advance.results(context), self._contexts.view(context)
        vdot = self._advance.equations.vdot(work)
        if view.T is float:
            return view.accelerations_in(work.tree, vdot)
        A = np.zeros_like(work.tree.A)
        kernels.accelerations(view.model, work.tree, vdot, A)
        kernels.body_accelerations(view.model, work.tree, A)
        return A

    @checked
    def EvalBodySpatialAccelerationInWorld(self, context: Context, body: RigidBody) -> SpatialAcceleration:
        """A_WB of the body origin, expressed in W, at the present state.

        For a discrete plant, of the step that would be taken from there; the port body_spatial_accelerations has that
        of the step that was taken, when ports are sampled.
        """
        self._elements.require_mine("EvalBodySpatialAccelerationInWorld", body)
        view = self._contexts.view(context)
        return view.of(SpatialAcceleration_)(self._present(context)[view.frozen.row_of(body)])

    def of_frame(self, context: Context, frame: Frame) -> SpatialAcceleration:
        """A_WF, expressed in W."""
        m = self._kinematics.motion(context, frame, 1, self._present(context))
        return self._contexts.view(context).of(SpatialAcceleration_)(m.alpha, m.a)

    def of_frame_in(self, context: Context, frame: Frame, measured_in: Frame) -> SpatialAcceleration:
        """A_MF, expressed in W."""
        A_WB = self._present(context)
        F, M = (self._kinematics.motion(context, one, 1, A_WB) for one in (frame, measured_in))
        alpha, a = relative_acceleration(F, M)
        return self._contexts.view(context).of(SpatialAcceleration_)(alpha, a)

    def CalcCenterOfMassTranslationalAccelerationInWorld(
        self, context: Context, model_instances: list[ModelInstanceIndex] | None = None
    ) -> np.ndarray:
        """a_WScm expressed in W, of all bodies or of those of some model instances [m/s²], shape (3,)."""
        call = "CalcCenterOfMassTranslationalAccelerationInWorld"
        view, rows, mass, _ = self._kinematics.com_rows(call, context, model_instances)
        return self._kinematics.com_acceleration(view, rows, mass, self._present(context))

    def implicit_residual(self, context: Context, proposed: np.ndarray) -> np.ndarray:
        """Of proposed derivatives: qdot - N(q) v; the forces that are missing, M(q) vdot + C(q, v) v - tau; the rest.

        Of symbols without dividing by anything, so that it is polynomial in masses and inertias.
        """
        view, M = self._contexts.view(context), self._dynamics.CalcMassMatrix(context)
        velocities = slice(view.nq, view.nq + view.nv)
        if view.T is not Expression:
            left = proposed - context._system.EvalTimeDerivatives(context).CopyToVector()
            left[velocities] = M @ left[velocities]
            return left
        flow = self._advance.forces(context)
        qdot = proposed[: view.nq] - self._dynamics.MapVelocityToQDot(context, view.v)
        missing = M @ proposed[velocities] - (flow.force + flow.contact_force)
        return np.concatenate([qdot, missing, proposed[velocities.stop :] - flow.surface_speed])
