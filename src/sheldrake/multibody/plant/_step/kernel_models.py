"""What the kernels of a plant are given: tree, geometry, actuators, limits and solver as arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from sheldrake.geometry._compiled.hydroelastic import HydroPairs, compile_hydro, has_surfaces
from sheldrake.geometry._kernels.hydro_model import empty_hydro_model
from sheldrake.geometry._kernels.model import GeometryModel, empty_geometry_model
from sheldrake.multibody.plant._enums import ContactModel, DiscreteContactApproximation
from sheldrake.multibody.plant._step.arrays import make_plant_model
from sheldrake.multibody.plant._step.tuning import (
    set_margin,
    solver_model_of,
    supply_missing_material,
    tamsi_limit_penalty,
)

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


class KernelModels:
    """The arrays that kernels of a plant are given."""

    def _models(self, has_geometry: bool, geometry: CompiledGeometry) -> dict[str, Any]:
        """Constant arrays of the kernels, with proximity geometry when the geometry_query port is connected."""
        models = {"tree_model": self._tree_model, "force_model": self._force_model, "plant_model": self._plant_model}
        models["geometry_model"] = geometry.model if has_geometry else empty_geometry_model()
        models["hydro_model"] = geometry.hydro if has_geometry else empty_hydro_model()
        if self.is_discrete():
            models["solver_model"] = self._solver_model(models["geometry_model"])
        return models

    def _kernel_models(self, root: Any) -> dict[str, Any]:
        return self._models(root.source(0) is not None, self._compiled_geometry(root.given(0)))

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
            cells = self.is_discrete() and not self._touches_along_surfaces(state)
            model, ids = self._scene_graph._compile_proximity(rows, state, cells)
            stiffness, dissipation = self._fallback_stiffness()
            supply_missing_material(model, stiffness, dissipation, 0.1)
            if self.is_discrete():
                set_margin(model, _NAMES[self._approximation], self.time_step())
            pairs = self._split_pairs(state, model, ids)
            while len(self._geometry_cache) > 3:
                self._geometry_cache.pop(next(iter(self._geometry_cache)))
            found = CompiledGeometry(state, pairs.points, ids, pairs.model)
            self._geometry_cache[state.serial] = found
        return found

    def _misses_geometry(self, connected: bool) -> bool:
        """Whether there is collision geometry, but nothing answers queries about it."""
        return bool(self._collision_ids) and not connected

    def _fallback_stiffness(self) -> tuple[float, float]:
        """Point stiffness [N/m] and dissipation [s/m] of geometry that says none, from the penetration allowance."""
        masses = [b.default_mass() for b in self._bodies if b.index() != 0]
        heaviest = max([m for m in masses if np.isfinite(m)], default=0.0)
        g, delta = self._gravity_strength(), self._penetration_allowance
        return 2.0 * heaviest * g / delta, 1.0 / (g * delta) ** 0.5

    def _solver_model(self, geometry_model: Any) -> Any:
        return solver_model_of(
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
        return make_plant_model(actuators, limits, ports, self._constraint_rows(), locks, frictions)

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
            stiffness, damping = tamsi_limit_penalty(self._limit_inertia(joint), self._time_step)
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
            X_BF = frame._fixed_X_BF()
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

    def _touches_along_surfaces(self, state: Any) -> bool:
        """Whether any geometry of the plant can make contact surfaces."""
        return self._contact_model is not ContactModel.kPoint and has_surfaces(state)

    def _split_pairs(self, state: Any, model: GeometryModel, ids: list) -> HydroPairs:
        """Which pairs of geometries touch along surfaces: none with ContactModel.kPoint."""
        if self._contact_model is ContactModel.kPoint:
            return HydroPairs(empty_hydro_model(), model)
        return compile_hydro(state, model, ids, self._representation)
