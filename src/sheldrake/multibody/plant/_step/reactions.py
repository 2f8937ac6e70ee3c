"""Reaction forces of joints."""

from __future__ import annotations

import numpy as np

from sheldrake.multibody.contact_solvers._kernels.problem import HOLONOMIC, RowState
from sheldrake.multibody.math import SpatialForce, SpatialForce_
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._building.frozen_model import FrozenModel
from sheldrake.multibody.plant._building.geometry import PlantGeometry
from sheldrake.multibody.plant._building.settings import Settings
from sheldrake.multibody.plant._contact.hydroelastic import HydroelasticContactInfo
from sheldrake.multibody.plant._context.contexts import Contexts
from sheldrake.multibody.plant._kernels.model import COUPLER, StepWork
from sheldrake.multibody.plant._step.advance import Advance
from sheldrake.multibody.plant._step.applied_forces import AppliedForces
from sheldrake.multibody.plant._step.kernel_models import KernelModels
from sheldrake.multibody.plant._step.reports import Reports
from sheldrake.multibody.tree._kernels import dynamics, forces
from sheldrake.multibody.tree._kernels.kinematics import point_on
from sheldrake.multibody.tree._kernels.model import Body, BodyInertia, BodyPose, TreeWork
from sheldrake.systems.framework import Context


class Reactions:
    """Forces that joints transmit.

    Args:
        elements: Joints and constraints.
        settings: Discrete or continuous; sampled ports or not.
        geometry: Whose shapes touch.
        contexts: The state.
        applied: Forces from outside.
        models: Constants of the kernels.
        advance: The last step.
        reports: Contacts.
    """

    def __init__(
        self,
        elements: Elements,
        settings: Settings,
        geometry: PlantGeometry,
        contexts: Contexts,
        applied: AppliedForces,
        models: KernelModels,
        advance: Advance,
        reports: Reports,
    ) -> None:
        self._elements, self._settings, self._geometry = elements, settings, geometry
        self._contexts, self._applied, self._models = contexts, applied, models
        self._advance, self._reports = advance, reports

    def forces(self, context: Context) -> list[SpatialForce]:
        """F_CJc_Jc of every joint: the spatial force on its child at its frame M, expressed in M.

        Newton-Euler on each body at the accelerations of the last step (of the present state when ports are not
        sampled), tip to base: what moves a body, less what acts on it otherwise, comes through its inboard joint.
        """
        model, work = self._contexts.view(context).frozen, self._advance.results(context)
        tree, vdot = work.tree, self._reports.vdot(context)
        T = SpatialForce_[context._system._scalar]
        reactions: list[SpatialForce] = [T(np.zeros(6)) for _ in range(max(1, len(model.joints)))]
        if self._settings.sampled and not np.any(tree.inertia[1:, BodyInertia.mass] != 0.0):
            return reactions
        F = self._force_to_move(context, tree, vdot)
        order = {int(j.index()): n for n, j in enumerate(model.joints)}
        bodies = model.tree.bodies
        origin = tree.X_WB[model.tree.body[:, Body.root], BodyPose.p_WB.columns]
        for row in range(model.num_bodies - 1, 0, -1):
            step, parent = model.steps[row - 1], int(bodies[row].parent)
            arm = origin[row] - origin[parent]
            F[parent, :3] += F[row, :3] + np.cross(arm, F[row, 3:])
            F[parent, 3:] += F[row, 3:]
            M = step.joint.frame_on_child()
            child = model.row_of(M.body())
            R_WB, p_WB = np.reshape(tree[child].R_WB, (3, 3)), np.array(tree[child].p_WB)
            X_BM = M._X_BF(context)
            R_WM = R_WB @ X_BM.rotation().matrix()
            p_WM = p_WB + R_WB @ X_BM.translation()
            torque = F[row, :3] + np.cross(origin[row] - p_WM, F[row, 3:])
            sign = -1.0 if step.reversed else 1.0
            numbers = sign * np.concatenate([R_WM.T @ torque, R_WM.T @ F[row, 3:]])
            reactions[order[int(step.joint.index())]] = T(numbers)
        return reactions

    def _force_to_move(self, context: Context, tree: TreeWork, vdot: np.ndarray) -> np.ndarray:
        """Spatial forces about `root` that bodies need besides gravity, contact and applied forces."""
        view = self._contexts.view(context)
        model, p = view.model, view.p
        A, F, other = np.zeros_like(tree.A), np.zeros_like(tree.A), np.zeros_like(tree.A)
        dynamics.accelerations(model, tree, vdot, A)
        for row in range(1, len(F)):
            alpha, a = tuple(A[row, :3]), tuple(A[row, 3:])
            t, f = dynamics.inertial_force(model, tree, row, (alpha, a), 1.0)
            F[row] = [*t, *f]
        forces.add_struts(model, view.frozen.forces, p, tree, other)
        forces.add_bushings(model, view.frozen.forces, p, tree, other)
        results = self._reports.contact_results(context)
        for surface in results._hydroelastic:
            self._add_surface_force(view.frozen, tree, surface, other)
        for info in results._point_pairs:
            for index, sign in ((info.bodyB_index(), 1.0), (info.bodyA_index(), -1.0)):
                f = tuple(sign * info.contact_force())
                forces.add_point_force(model, tree, other, view.frozen.rows[int(index)], tuple(info.contact_point()), f)
        if self._settings.is_discrete() and self._elements.constraints:
            self._add_constraint_forces(view.frozen, self._advance.results(context), p, other)
        F_Bo_W = self._applied.on_bodies(context, tree.X_WB)
        if F_Bo_W is not None:
            forces.add_body_forces(model, tree, F_Bo_W, other)
        return F - other

    def _add_constraint_forces(self, model: FrozenModel, work: StepWork, p: np.ndarray, F: np.ndarray) -> None:
        """Adds to F what distance, ball and weld constraints exert on both bodies; couplers act along joints."""
        rows, constraints = work.rows, self._models.plant_model.constraints
        for r in range(work.problem.num_rows):
            n, owner = int(rows[r].group), int(rows[r].owner)
            constraint = constraints[owner]
            if rows[r].kind != HOLONOMIC or n == 0 or constraint.kind == COUPLER:
                continue
            force = rows.state[r : r + n, RowState.gamma] / self._settings.time_step
            a, b, at = int(constraint.A), int(constraint.B), int(constraint.p)
            first, second = (at, at + 3) if n < 6 else (at + 9, at + 21)  # a weld's positions follow its rotations
            P = np.array(point_on(work.tree, a, tuple(p[first : first + 3])))
            Q = np.array(point_on(work.tree, b, tuple(p[second : second + 3])))
            if n == 1:
                force = force * (Q - P) / np.sqrt((Q - P) @ (Q - P))
            elif n == 6:
                F[b, :3] += force[:3]
                F[a, :3] -= force[:3]
                P = Q = 0.5 * (P + Q)
            forces.add_point_force(model.tree, work.tree, F, b, tuple(Q), tuple(force[-3:]))
            forces.add_point_force(model.tree, work.tree, F, a, tuple(P), tuple(-force[-3:]))

    def _add_surface_force(
        self, model: FrozenModel, tree: TreeWork, info: HydroelasticContactInfo, F: np.ndarray
    ) -> None:
        """Adds the force of a contact surface to F, on both bodies."""
        surface, force = info.contact_surface(), info.F_Ac_W().get_coeffs()
        geometries = self._geometry.required_scene_graph()._default_state().geometries
        for geometry_id, sign in ((surface.id_M(), 1.0), (surface.id_N(), -1.0)):
            row = model.row_of(self._geometry.body_of_frame[geometries[geometry_id].frame])
            F[row, :3] += sign * force[:3]
            point, f = tuple(surface.centroid()), tuple(sign * force[3:])
            forces.add_point_force(model.tree, tree, F, row, point, f)
