"""How bodies and frames accelerate: at the present state, and in the last step."""

from __future__ import annotations

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.multibody.math import SpatialAcceleration, SpatialAcceleration_
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._building.settings import Settings
from sheldrake.multibody.plant._context.contexts import Contexts
from sheldrake.multibody.plant._context.dynamics import Dynamics
from sheldrake.multibody.plant._context.kinematics import Kinematics
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
        """Of the body origins at the present state, by row, shape (num_bodies, 6), to be read only."""
        view = self._contexts.view(context)
        if view.accelerations is not None:  # whether they are of this state is to be told quickly
            (stamp, _, status), known = view.accelerations
            if stamp == context._store.i[2] and not status:
                return known
        if view.T is not float:
            return self._kinematics.accelerations(context, self._advance.vdot(context))
        work = self._advance.present_work(context)
        if view.accelerations is None or view.accelerations[0] is not view.results:
            vdot = self._advance.equations.vdot(work)
            view.accelerations = view.results, self._kinematics.accelerations(context, vdot)
        return view.accelerations[1]

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
        return view.of(SpatialAcceleration_)._make(self._present(context)[view.frozen.row_of(body)].copy())

    def of_point(
        self,
        context: Context,
        point: np.ndarray,
        frame_B: Frame,
        frame_A: Frame | None = None,
        frame_E: Frame | None = None,
    ) -> SpatialAcceleration:
        """Of a point of frame B, p_BoBp_B, measured in A, expressed in E; both are the world's when left out."""
        world = self._kinematics.world_frame
        ask = self._kinematics.point_acceleration(context, frame_B, frame_A or world, frame_E or world)
        A = ask(self._present(context), point)
        return self._contexts.view(context).of(SpatialAcceleration_)._make(A)

    def CalcCenterOfMassTranslationalAccelerationInWorld(
        self, context: Context, model_instances: list[ModelInstanceIndex] | None = None
    ) -> np.ndarray:
        """a_WScm expressed in W, of all bodies or of those of some model instances [m/s²], shape (3,)."""
        call = "CalcCenterOfMassTranslationalAccelerationInWorld"
        self._kinematics.choose(call, context, model_instances)  # says what is wrong before anything else does
        return self._kinematics.acceleration_of_centre(call, context, model_instances, self._present(context))

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
