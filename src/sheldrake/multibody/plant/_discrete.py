"""The discrete update: what its kernel is given, and what it left for ports to report."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from sheldrake.geometry._kernels.cells import make_cells
from sheldrake.geometry._kernels.hydro_model import empty_hydro_model
from sheldrake.geometry._kernels.model import contact_table, empty_geometry_model
from sheldrake.multibody.plant import _step, _step_results
from sheldrake.multibody.plant._contact_results import ContactResults, PointContactArrays, PointPairContactInfo
from sheldrake.multibody.plant._enums import ContactModel, DiscreteContactApproximation
from sheldrake.multibody.plant._explain_failure import explain_failure
from sheldrake.multibody.plant._hydroelastic import split_pairs, step_surfaces, touch_along_surfaces
from sheldrake.multibody.plant._kernels.model import StepWork
from sheldrake.multibody.plant._kernels.ports import refuse_without_geometry
from sheldrake.multibody.tree._kernels import dynamics
from sheldrake.systems.framework._declarations import Stages

_NAMES = {
    DiscreteContactApproximation.kTamsi: "tamsi",
    DiscreteContactApproximation.kSap: "sap",
    DiscreteContactApproximation.kSimilar: "similar",
    DiscreteContactApproximation.kLagged: "lagged",
}


class CompiledGeometry(NamedTuple):
    """A state of the SceneGraph as the kernels' arrays: what touches in points, ids of the rows, surfaces."""

    state: Any
    model: Any
    ids: list[Any]
    hydro: Any


class DiscreteUpdate:
    """The step of a plant with time_step > 0."""

    # --- what the kernel is given

    def _step_stages(self, models: dict[str, Any]) -> list[Any]:
        tamsi = self._approximation is DiscreteContactApproximation.kTamsi
        strict = self._contact_model is ContactModel.kHydroelastic
        return _step.stages(models["geometry_model"], self._plant_model, tamsi, models["hydro_model"], strict)

    def _stages_in(self, root: Any) -> list[Any]:
        if self._misses_geometry(root.source(0) is not None):
            return [refuse_without_geometry]
        return self._step_stages(self._kernel_models(root))

    def _misses_geometry(self, connected: bool) -> bool:
        """Whether there is collision geometry, but nothing answers queries about it."""
        return bool(self._collision_ids) and not connected

    def _declare_discrete_update(self) -> None:
        dt, stages = self._time_step, Stages(DiscreteUpdate._stages_in)
        if self._sampled:
            self.DeclarePeriodicUnrestrictedUpdateEvent(dt, 0.0, stages)
            self.DeclareForcedUnrestrictedUpdateEvent(stages)
        else:
            self.DeclarePeriodicDiscreteUpdateEvent(dt, 0.0, stages)
            self.DeclareForcedDiscreteUpdateEvent(stages)

    def _geometry_of(self, context: Any) -> CompiledGeometry:
        """What kernels know of the geometry of a context."""
        layout = context._store.layout
        kind, n, _ = layout.sources[context._node, 0]
        return self._compiled_geometry(layout.given.get(n) if kind == "out" else None)

    def _compiled_geometry(self, state: Any = None) -> CompiledGeometry:
        """What kernels know of geometry: that of new contexts, or the given; kept for the last few states."""
        if self._scene_graph is None:
            return CompiledGeometry(None, empty_geometry_model(), [], empty_hydro_model())
        state = self._scene_graph._default_state() if state is None else state
        found = self._geometry_cache.get(state.serial)
        if found is None:
            rows = {frame: int(self._rows[i]) for i, frame in self._frame_of_body.items()}
            cells = self.is_discrete() and not touch_along_surfaces(self, state)
            model, ids = self._scene_graph._compile_proximity(rows, state, cells)
            stiffness, dissipation = self._fallback_stiffness()
            _step.supply_missing_material(model, stiffness, dissipation, 0.1)
            if self.is_discrete():
                _step.set_margin(model, _NAMES[self._approximation], self.time_step())
            pairs = split_pairs(self, state, model, ids)
            while len(self._geometry_cache) > 3:
                self._geometry_cache.pop(next(iter(self._geometry_cache)))
            found = CompiledGeometry(state, pairs.points, ids, pairs.model)
            self._geometry_cache[state.serial] = found
        return found

    def _fallback_stiffness(self) -> tuple[float, float]:
        """Point stiffness [N/m] and dissipation [s/m] of geometry that says none, from the penetration allowance."""
        masses = [b.default_mass() for b in self._bodies if b.index() != 0]
        heaviest = max([m for m in masses if np.isfinite(m)], default=0.0)
        g, delta = self._gravity_strength(), self._penetration_allowance
        return 2.0 * heaviest * g / delta, 1.0 / (g * delta) ** 0.5

    def _solver_model(self, geometry_model: Any) -> Any:
        return _step.solver_model_of(
            self._tree_model,
            geometry_model,
            self._time_step,
            _NAMES[self._approximation],
            stiction_tolerance=self._stiction_tolerance,
            near_rigid_threshold=self._near_rigid_threshold,
        )

    def _compile_plant_model(self, connected: Any = lambda port: True) -> Any:
        """Actuators and limits.

        Args:
            connected: tells whether an input port is.
        """
        actuators = []
        for a in self._actuators:
            joint, instance = a.joint(), int(a.model_instance())
            of_instance = list(self._input_indices("actuation", a.model_instance()))
            element = of_instance.index(a._input_start)
            row = dict(
                dof=joint._v_start,
                q=joint._q_start,
                port=self._port_numbers["actuation"],
                element=a._input_start,
                instance_port=self._port_numbers["actuation", instance],
                instance_element=element,
                effort_limit=a.effort_limit(),
            )
            desired = self._port_numbers["desired_state", instance]
            if a._gains is not None:
                row |= dict(p=a._gains.p, d=a._gains.d, desired_port=desired, desired_q=element)
                row["desired_v"] = element + len(of_instance)
            actuators.append(row)
        limited = [j for j in self._joints if self.is_discrete() and j.num_velocities() == 1 and self._has_limits(j)]
        limits = [self._limit_row(j) for j in limited]
        first_lock = self._parameter_starts[self._lock_group]
        locks = np.zeros(self._nv, np.int64)
        for joint in self._joints:
            locks[joint._v_start : joint._v_start + joint.num_velocities()] = first_lock + int(joint.index())
        ports = [self._port_numbers["generalized_force"]]
        frictions = self._dry_frictions()
        return _step.make_plant_model(actuators, limits, ports, self._constraint_rows(), locks, frictions)

    def _dry_frictions(self) -> list[tuple[int, float]]:
        """(dof, largest effort) of the joints that have dry friction."""
        return [
            (joint._v_start + k, effort)
            for joint in self._joints
            for k, effort in enumerate(joint._dry_friction)
            if effort > 0.0
        ]

    def _has_limits(self, joint: Any) -> bool:
        lower, upper = joint._limits["position"]
        return bool(np.isfinite(lower[0]) or np.isfinite(upper[0]))

    def _limit_row(self, joint: Any) -> dict[str, Any]:
        lower, upper = joint._limits["position"]
        stiffness = damping = 0.0  # as in Drake, whose kTamsi ignores the limits of other joints
        if joint.type_name() in ("revolute", "prismatic"):
            stiffness, damping = _step.tamsi_limit_penalty(self._limit_inertia(joint), self._time_step)
        return dict(
            dof=joint._v_start, q=joint._q_start, lower=lower[0], upper=upper[0], stiffness=stiffness, damping=damping
        )

    def _limit_inertia(self, joint: Any) -> float:
        """The smaller of parent's and child's mass, or inertia about the axis (for kTamsi's limits)."""

        def of(frame: Any) -> float:
            body = frame.body()
            if body.index() == 0:
                return np.inf
            M = body.default_spatial_inertia()
            if joint.type_name() == "prismatic":
                return float(M.get_mass())
            X_BF = frame.GetFixedPoseInBodyFrame()
            axis = X_BF.rotation() @ joint._axis
            I = M.Shift(X_BF.translation()).CalcRotationalInertia().CopyToFullMatrix3()
            return float(axis @ I @ axis)

        return min(of(joint.frame_on_parent()), of(joint.frame_on_child()))

    def _actuator_changed(self, actuator: Any) -> None:
        """Effort limits and gains may change after Finalize()."""
        if self._finalized:
            for number, a in enumerate(self._actuators):
                if a is actuator and self._plant_model is not None:
                    gains = (a._gains.p, a._gains.d) if a._gains else (0.0, 0.0)
                    self._plant_model.gain[number] = a.effort_limit(), *gains

    def _kernel_models(self, root: Any) -> dict[str, Any]:
        return self._models(root.source(0) is not None, self._compiled_geometry(root.given(0)))

    def _models(self, has_geometry: bool, geometry: CompiledGeometry) -> dict[str, Any]:
        """Constant arrays of the kernels, with proximity geometry when the geometry_query port is connected."""
        models = {"tree_model": self._tree_model, "force_model": self._force_model, "plant_model": self._plant_model}
        models["geometry_model"] = geometry.model if has_geometry else empty_geometry_model()
        models["hydro_model"] = geometry.hydro if has_geometry else empty_hydro_model()
        if self.is_discrete():
            models["solver_model"] = self._solver_model(models["geometry_model"])
        return models

    def _scratch_in(self, root: Any) -> Any:
        """Memory of the step in a context; grows with the geometry that may touch."""
        if not self._finalized:
            return 0
        return self._prototype_of(self._compiled_geometry(root.given(0)))

    def _prototype_of(self, geometry: CompiledGeometry) -> Any:
        kept = self._prototype
        if kept is None or kept[0] is not geometry.model:
            if self.is_discrete():
                table, solver = contact_table(geometry.model), self._solver_model(geometry.model)
                work: Any = _step.make_step_work(
                    self._tree_model,
                    solver,
                    self._plant_model,
                    table,
                    hydro_model=geometry.hydro,
                    cells=make_cells(geometry.model),
                )
            else:
                work = self._derivative_work(geometry)
            kept = self._prototype = geometry.model, work
        return kept[1]

    def _carry_scratch(self, old: Any, new: Any) -> None:
        """Results of the last step that do not speak of contacts."""
        parts = ("tree", "step") if self.is_discrete() else ("tree",)
        for name in parts:
            for target, values in zip(getattr(new, name), getattr(old, name)):
                target[...] = values

    def _explain_status(self, status: int, context: Any) -> Exception:
        return explain_failure(self, status, context)

    # --- what it left

    def _step_tickets(self) -> set[Any]:
        """Prerequisites of what depends on the step."""
        if self.is_discrete() and self._sampled:
            return {self._scratch_ticket()}
        return {self.all_sources_ticket()}

    def _results(self, context: Any) -> StepWork:
        """Scratch of the last step; of a step from the present state when ports are not sampled."""
        return context._store.scratch(context._node) if self._sampled else self._present_results(context)

    def _present_results(self, context: Any) -> StepWork:
        """Scratch of a step from the present state."""
        view = context._system._view(context)
        stamp = context._store.i[2]
        if view.results is None or view.results[0] != stamp:
            work = view.copy_of(self._prototype_of(self._geometry_of(context)))
            self._run(context, work, view.zeros(len(view.x)))
            view.results = stamp, work
        return view.results[1]

    def _input_vector(self, context: Any, i: int) -> np.ndarray:
        """Value of an input port: empty for an abstract one, zeros for one without a value."""
        declaration, port = self._inputs[i], context._system.get_input_port(i)
        if declaration.size == 0:
            return np.zeros(0)
        return np.array(port.Eval(context)) if port.HasValue(context) else np.zeros(declaration.size)

    def _vdot(self, context: Any) -> np.ndarray:
        """Generalized accelerations at the present state, shape (nv,)."""
        self._view(context)  # Whether it is a context of this plant is told there.
        if self.is_discrete():
            return _step_results.accelerations(self._present_results(context), self._time_step)
        return self._continuous_vdot(context)

    def _step_vdot(self, context: Any) -> np.ndarray:
        """Generalized accelerations in the last step, shape (nv,)."""
        if self.is_discrete():
            return _step_results.accelerations(self._results(context), self._time_step)
        return self._continuous_vdot(context)

    def _step_accelerations(self, context: Any) -> np.ndarray:
        """Spatial accelerations of the body origins by row, as they were at the beginning of the last step."""
        if not self.is_discrete():
            return self._accelerations(context, self._continuous_vdot(context))
        work = self._results(context)
        tree = work.tree
        A = np.zeros_like(tree.A)
        dynamics.accelerations(self._tree_model, tree, _step_results.accelerations(work, self._time_step), A)
        dynamics.body_accelerations(self._tree_model, tree, A)
        return A

    def _generalized_contact_forces(self, context: Any) -> np.ndarray:
        if not self.is_discrete():
            return self._continuous_contact_forces(context)
        return _step_results.generalized_contact_forces(self._results(context), self._time_step)

    def _net_actuation(self, context: Any) -> np.ndarray:
        if not self.is_discrete():
            return self._continuous_actuation(context)
        return self._results(context).step.net_actuation

    def _contact_results(self, context: Any) -> ContactResults:
        results = ContactResults()
        results._plant = self
        if not self.is_discrete():
            results._point_pairs = self._continuous_contacts(context)
            results._hydroelastic = self._continuous_surfaces(context)
            return results
        _, model, ids, hydro = self._geometry_of(context)
        work = self._results(context)
        results._hydroelastic = step_surfaces(work, hydro, ids, self._time_step, context._system._scalar)
        contacts = _step_results.step_contacts(work, model.material[:, 0], self._time_step)
        pair = contacts.pair.tolist()
        bodies = [body.index() for body in self._row_bodies]
        arrays = PointContactArrays(
            [bodies[a] for _, _, a, _ in pair],
            [bodies[b] for _, _, _, b in pair],
            [ids[A] for A, *_ in pair],
            [ids[B] for _, B, *_ in pair],
            contacts.f_Bc_W,
            contacts.p_WC,
        )
        results._set_points(arrays, lambda: self._contact_infos(contacts, arrays))
        return results

    def _contact_infos(self, contacts: Any, arrays: PointContactArrays) -> list[PointPairContactInfo]:
        """Point contacts as objects."""
        return [
            PointPairContactInfo(
                arrays.body_A[i],
                arrays.body_B[i],
                contacts.f_Bc_W[i],
                contacts.p_WC[i],
                contacts.separation_speed[i],
                contacts.slip_speed[i],
                self._point_pair(
                    arrays.geometry_A[i],
                    arrays.geometry_B[i],
                    contacts.p_WCa[i],
                    contacts.p_WCb[i],
                    contacts.nhat_BA_W[i],
                    contacts.depth[i],
                ),
            )
            for i in range(len(contacts.depth))
        ]

    def _point_pair(self, id_A: Any, id_B: Any, p_WCa: Any, p_WCb: Any, nhat: Any, depth: Any) -> Any:
        from sheldrake.geometry import PenetrationAsPointPair

        pair = object.__new__(PenetrationAsPointPair)  # every field is given: no defaults
        pair.id_A, pair.id_B, pair.p_WCa, pair.p_WCb, pair.nhat_BA_W, pair.depth = (
            id_A, id_B, p_WCa, p_WCb, nhat, depth,
        )  # fmt: skip
        return pair
