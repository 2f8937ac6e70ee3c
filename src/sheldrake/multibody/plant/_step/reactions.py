"""Reaction forces of joints."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.multibody.contact_solvers._kernels.problem import (
    HOLONOMIC,
    NUM_ROWS,
    ROW_GAMMA,
    ROW_GROUP,
    ROW_KIND,
    ROW_OWNER,
)
from sheldrake.multibody.math import SpatialForce_
from sheldrake.multibody.plant._kernels.constraint_rows import point_on
from sheldrake.multibody.plant._kernels.model import (
    CONSTRAINT_A,
    CONSTRAINT_B,
    CONSTRAINT_KIND,
    CONSTRAINT_P,
    COUPLER,
)
from sheldrake.multibody.tree._kernels import dynamics, forces
from sheldrake.multibody.tree._kernels.model import PARENT, ROOT, TreeWork


class Reactions:
    """Forces that joints transmit."""

    def _reaction_forces(self, context: Any) -> list[Any]:
        """F_CJc_Jc of every joint: the spatial force on its child at its frame M, expressed in M.

        Newton-Euler on each body at the accelerations of the last step (of the present state when ports are not
        sampled), tip to base: what moves a body, less what acts on it otherwise, comes through its inboard joint.
        """
        work = self._results(context) if self.is_discrete() else self._derivatives(context)
        tree, vdot = work.tree, self._step_vdot(context)
        T = SpatialForce_[context._system._scalar]
        reactions: list[Any] = [T(np.zeros(6)) for _ in range(max(1, len(self._joints)))]
        if self.is_discrete() and self._sampled and not np.any(tree.inertia[1:, 0] != 0.0):
            return reactions
        F = self._force_to_move(context, tree, vdot)
        order = {int(j.index()): n for n, j in enumerate(self._joints)}
        body = self._tree_model.body
        origin = tree.X_WB[body[:, ROOT], 9:]
        for row in range(len(self._row_bodies) - 1, 0, -1):
            step, parent = self._steps[row - 1], int(body[row, PARENT])
            arm = origin[row] - origin[parent]
            F[parent, :3] += F[row, :3] + np.cross(arm, F[row, 3:])
            F[parent, 3:] += F[row, 3:]
            M = step.joint.frame_on_child()
            child = self._rows[int(M.body().index())]
            X, X_BM = tree.X_WB[child], M._X_BF(context)
            R_WM = X[:9].reshape(3, 3) @ X_BM.rotation().matrix()
            p_WM = X[9:] + X[:9].reshape(3, 3) @ X_BM.translation()
            torque = F[row, :3] + np.cross(origin[row] - p_WM, F[row, 3:])
            sign = -1.0 if step.reversed else 1.0
            numbers = sign * np.concatenate([R_WM.T @ torque, R_WM.T @ F[row, 3:]])
            reactions[order[int(step.joint.index())]] = T(numbers)
        return reactions

    def _force_to_move(self, context: Any, tree: TreeWork, vdot: np.ndarray) -> np.ndarray:
        """Spatial forces about `root` that bodies need besides gravity, contact and applied forces."""
        model, p = self._tree_model, context._system._view(context).p
        A, F, other = np.zeros_like(tree.A), np.zeros_like(tree.A), np.zeros_like(tree.A)
        dynamics.accelerations(model, tree, vdot, A)
        for row in range(1, len(F)):
            alpha, a = tuple(A[row, :3]), tuple(A[row, 3:])
            t, f = dynamics.inertial_force(model, tree, row, (alpha, a), 1.0)
            F[row] = [*t, *f]
        forces.add_struts(model, self._force_model, p, tree, other)
        forces.add_bushings(model, self._force_model, p, tree, other)
        results = self._contact_results(context)
        for surface in results._hydroelastic:
            self._add_surface_force(tree, surface, other)
        for info in results._point_pairs:
            for index, sign in ((info.bodyB_index(), 1.0), (info.bodyA_index(), -1.0)):
                f = tuple(sign * info.contact_force())
                forces.add_point_force(model, tree, other, self._rows[int(index)], tuple(info.contact_point()), f)
        if self.is_discrete() and self._constraints:
            self._add_constraint_forces(self._results(context), p, other)
        F_Bo_W = self._applied_body_forces(context, tree.X_WB)
        if F_Bo_W is not None:
            forces.add_body_forces(model, tree, F_Bo_W, other)
        return F - other

    def _add_constraint_forces(self, work: Any, p: np.ndarray, F: np.ndarray) -> None:
        """Adds to F what distance, ball and weld constraints exert on both bodies; couplers act along joints."""
        rows, constraint = work.rows, self._plant_model.constraint
        for r in range(work.problem.count[NUM_ROWS]):
            n, owner = int(rows.index[r, ROW_GROUP]), int(rows.index[r, ROW_OWNER])
            if rows.index[r, ROW_KIND] != HOLONOMIC or n == 0 or constraint[owner, CONSTRAINT_KIND] == COUPLER:
                continue
            force = rows.state[r : r + n, ROW_GAMMA] / self._time_step
            a, b, at = (int(constraint[owner, k]) for k in (CONSTRAINT_A, CONSTRAINT_B, CONSTRAINT_P))
            first, second = (at, at + 3) if n < 6 else (at + 9, at + 21)  # a weld's positions follow its rotations
            P = np.array(point_on(work.tree, a, tuple(p[first : first + 3])))
            Q = np.array(point_on(work.tree, b, tuple(p[second : second + 3])))
            if n == 1:
                force = force * (Q - P) / np.sqrt((Q - P) @ (Q - P))
            elif n == 6:
                F[b, :3] += force[:3]
                F[a, :3] -= force[:3]
                P = Q = 0.5 * (P + Q)
            forces.add_point_force(self._tree_model, work.tree, F, b, tuple(Q), tuple(force[-3:]))
            forces.add_point_force(self._tree_model, work.tree, F, a, tuple(P), tuple(-force[-3:]))

    def _add_surface_force(self, tree: TreeWork, info: Any, F: np.ndarray) -> None:
        """Adds the force of a contact surface to F, on both bodies."""
        surface, force = info.contact_surface(), info.F_Ac_W().get_coeffs()
        geometries = self._scene_graph._default_state().geometries
        for geometry_id, sign in ((surface.id_M(), 1.0), (surface.id_N(), -1.0)):
            body = self.GetBodyFromFrameId(geometries[geometry_id].frame)
            row = self._rows[int(body.index())]
            F[row, :3] += sign * force[:3]
            point, f = tuple(surface.centroid()), tuple(sign * force[3:])
            forces.add_point_force(self._tree_model, tree, F, row, point, f)

    def _applied_body_forces(self, context: Any, X_WB: np.ndarray) -> np.ndarray | None:
        """Forces of the applied_spatial_force port at the body origins by row, None without any.

        Raises:
            RuntimeError: a force names a body that does not exist.
        """
        port = context._system.get_applied_spatial_force_input_port()
        applied = port.Eval(context) if port.HasValue(context) else ()
        if not applied:
            return None
        F = np.zeros((len(self._row_bodies), 6), dtype=X_WB.dtype)
        for one in applied:
            body = self._bodies.get(one.body_index, "applied_spatial_force")
            row, coefficients = self._rows[int(body.index())], one.F_Bq_W.get_coeffs()
            arm = X_WB[row, :9].reshape(3, 3) @ one.p_BoBq_B
            F[row, :3] += coefficients[:3] + np.cross(arm, coefficients[3:])
            F[row, 3:] += coefficients[3:]
        return F
