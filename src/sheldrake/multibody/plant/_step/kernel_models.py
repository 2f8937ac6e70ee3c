"""What the kernels of a plant are given: tree, geometry, actuators, limits and solver as arrays."""

from __future__ import annotations

import functools
import math
import operator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.geometry import FrameId, GeometryId
from sheldrake.geometry._compiled.hydroelastic import HydroPairs, compile_hydro, has_surfaces
from sheldrake.geometry._kernels.hydro_model import empty_hydro_model
from sheldrake.geometry._kernels.model import GeometryModel, empty_geometry_model
from sheldrake.geometry._roles import Role
from sheldrake.multibody.contact_solvers._kernels.problem import SolverModel
from sheldrake.multibody.plant._building.constraints import Constraints
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._building.geometry import PlantGeometry
from sheldrake.multibody.plant._building.settings import Settings
from sheldrake.multibody.plant._building.surface_axes import SurfaceAxes
from sheldrake.multibody.plant._context.coordinates import Coordinates
from sheldrake.multibody.plant._enums import ContactModel
from sheldrake.multibody.plant._kernels.model import PlantModel
from sheldrake.multibody.plant._step.arrays import actuator_arrays, make_plant_model
from sheldrake.multibody.plant._step.input_ports import GEOMETRY_QUERY, InputPorts
from sheldrake.multibody.plant._step.tuning import (
    set_margin,
    shared_solver_model,
    supply_missing_material,
    tamsi_limit_penalty,
)
from sheldrake.multibody.tree import Frame, Joint, JointActuator, RevoluteJoint
from sheldrake.systems.framework import Context

if TYPE_CHECKING:
    from sheldrake.geometry._kernels.hydro_model import HydroModel
    from sheldrake.geometry._state.collision_filter import Pair
    from sheldrake.geometry._state.state import GeometryState
    from sheldrake.systems.framework._engine.memory import RootView


class CompiledGeometry(NamedTuple):
    """A state of the SceneGraph as the kernels' arrays: what touches in points, ids of the rows, surfaces."""

    state: GeometryState | None
    model: GeometryModel
    ids: list[GeometryId]
    hydro: HydroModel
    strange: frozenset[Pair] = frozenset()
    """Pairs that may touch of the plant's geometry with what moves with none of its bodies."""


@functools.cache
def _no_geometry() -> CompiledGeometry:
    """Of plants without geometry: all share it, so nobody may change it."""
    points, surfaces = empty_geometry_model(), empty_hydro_model()
    for array in (*points, *surfaces):
        array.flags.writeable = False
    return CompiledGeometry(None, points, [], surfaces)


class KernelModels:
    """The arrays that kernels of a plant are given.

    Args:
        elements: The model of the tree.
        settings: Time step and numbers of contact.
        geometry: What may touch.
        axes: Surfaces that run.
        constraints: What holds bodies and joints together.
        coordinates: Which inputs model instances have.
        inputs: Where efforts come from.
    """

    def __init__(
        self,
        elements: Elements,
        settings: Settings,
        geometry: PlantGeometry,
        axes: SurfaceAxes,
        constraints: Constraints,
        coordinates: Coordinates,
        inputs: InputPorts,
    ) -> None:
        self._elements, self._settings, self._geometry, self._axes = elements, settings, geometry, axes
        self._constraints, self._coordinates, self._inputs = constraints, coordinates, inputs
        self.compiled: dict[int, CompiledGeometry] = {}
        """For the last few states of the SceneGraph, by serial."""
        self._plant_model: PlantModel | None = None
        self._solver_model: tuple[tuple[Any, ...], SolverModel] | None = None
        self._known: dict[bool, tuple[tuple[Any, ...], dict[str, Any]]] = {}  # of a continuous plant, what `of` gave

    @property
    def plant_model(self) -> PlantModel:
        """Actuators, limits and constraints; made at Finalize()."""
        assert self._plant_model is not None
        return self._plant_model

    def arrays(self) -> list[Any]:
        """What copies of the plant on other scalars share."""
        return [self._plant_model]

    def of(self, has_geometry: bool, geometry: CompiledGeometry) -> dict[str, Any]:
        """Constant arrays of the kernels, with proximity geometry when the geometry_query port is connected."""
        model = self._elements.model("MultibodyPlant")
        sources = model.tree, model.forces, self._plant_model, geometry
        known = self._known.get(has_geometry)
        if known is not None and all(map(operator.is_, known[0], sources)):
            return known[1]
        models: dict[str, Any] = {
            "tree_model": model.tree,
            "force_model": model.forces,
            "plant_model": self.plant_model,
        }
        seen = geometry if has_geometry else _no_geometry()
        models["geometry_model"], models["hydro_model"] = seen.model, seen.hydro
        if self._settings.is_discrete():
            models["solver_model"] = self.solver_model(seen)
        else:
            self._known[has_geometry] = sources, models
        return models

    def in_root(self, root: RootView) -> dict[str, Any]:
        """The same for the contexts of a root.

        Args:
            root: The plant's view of it.
        """
        return self.of(root.source(GEOMETRY_QUERY) is not None, self.geometry_in(root))

    def geometry_in(self, root: RootView) -> CompiledGeometry:
        """What kernels know of the geometry of a root."""
        return self.compiled_geometry(root.structure_behind(GEOMETRY_QUERY))

    def geometry_of(self, context: Context) -> CompiledGeometry:
        """What kernels know of the geometry of a context."""
        layout = context._store.layout
        kind, n, _ = layout.sources[context._node, GEOMETRY_QUERY]
        return self.compiled_geometry(layout.structures.get(n) if kind == "out" else None)

    def compiled_geometry(self, state: GeometryState | None = None) -> CompiledGeometry:
        """What kernels know of geometry: that of new contexts, or the given; kept for the last few states."""
        scene_graph = self._geometry.scene_graph
        if scene_graph is None:
            return _no_geometry()
        state = scene_graph._default_state() if state is None else state
        found = self.compiled.get(state.serial)
        if found is None:
            rows = self.rows_of_frames()
            cells = self._settings.is_discrete() and not self._touches_along_surfaces(state)
            model, ids = scene_graph._compile_proximity(rows, state, cells)
            stiffness, dissipation = self._fallback_stiffness()
            supply_missing_material(model, stiffness, dissipation, 0.1)
            if self._settings.is_discrete():
                set_margin(model, self._settings.kind.name, self._settings.time_step)
            pairs = self._split_pairs(state, model, ids)
            while len(self.compiled) > 3:
                self.compiled.pop(next(iter(self.compiled)))
            found = CompiledGeometry(state, pairs.points, ids, pairs.model, self._strange_pairs(state, ids))
            self.compiled[state.serial] = found
        return found

    def _strange_pairs(self, state: GeometryState, ids: list[GeometryId]) -> frozenset[Pair]:
        if len(ids) == len(state.ids_with_role(Role.kProximity)):
            return frozenset()
        own = {i for i in ids if state.geometries[i].source == self._geometry.source_id}
        pairs = [pair for pair in state.collision_candidates() if not own.isdisjoint(pair)]
        return frozenset(pair for pair in pairs if not set(ids).issuperset(pair))

    def rows_of_frames(self) -> dict[FrameId, int]:
        """Rows of the bodies of the SceneGraph's frames."""
        rows = self._elements.model("MultibodyPlant").row_list
        return {frame: rows[i] for i, frame in self._geometry.frame_of_body.items()}

    def misses_geometry(self, connected: bool) -> bool:
        """Whether there is collision geometry, but nothing answers queries about it."""
        return bool(self._geometry.collision_ids) and not connected

    def _fallback_stiffness(self) -> tuple[float, float]:
        """Point stiffness [N/m] and dissipation [s/m] of geometry that says none, from the penetration allowance."""
        masses = [body._M_BBo_B._mass for body in self._elements.bodies if body is not self._elements.world]
        heaviest = max(filter(math.isfinite, masses), default=0.0)
        g, delta = self._elements.gravity_strength(), self._settings.penetration_allowance
        return 2.0 * heaviest * g / delta, 1.0 / (g * delta) ** 0.5

    def solver_model(self, geometry: CompiledGeometry) -> SolverModel:
        """The solver's constants for a state of the geometry; the last are kept."""
        geometry_model, hydro_model = geometry.model, geometry.hydro
        settings, tree = self._settings, self._elements.model("MultibodyPlant").tree
        dt, name = settings.time_step, settings.kind.name
        stiction, near_rigid = settings.stiction_tolerance, settings.near_rigid_threshold
        numbers = dt, name, stiction, near_rigid
        known = self._solver_model
        if known is None or known[0][0] is not tree or known[0][1] is not geometry_model or known[0][2:] != numbers:
            made = shared_solver_model(tree, geometry_model, hydro_model, *numbers)
            known = self._solver_model = (tree, geometry_model, *numbers), made
        return known[1]

    def compile(self) -> None:
        """Makes the plant's own model, at Finalize()."""
        model = self._elements.model("Finalize")
        limited = [j for j in model.joints if self._settings.is_discrete() and is_limited(j)]
        scalar_rows = bool(limited) and self._settings.kind.scalar_rows
        first_lock = model.parameters.starts[model.lock_group]
        locks = np.zeros(model.nv, np.int64)
        for joint in model.joints:
            locks[joint._v_start : joint._v_start + joint.num_velocities()] = first_lock + int(joint.index())
        self._plant_model = make_plant_model(
            [self._actuator_row(a) for a in model.actuators],
            [self._limit_row(j, scalar_rows) for j in limited],
            [self._inputs.generalized_force],
            self._constraints.rows(),
            locks,
            _dry_frictions(model.joints),
            self._axes.rows(),
        )

    def _actuator_row(self, a: JointActuator) -> dict[str, Any]:
        joint, instance = a.joint(), int(a.model_instance())
        of_instance = list(self._coordinates.input_indices("actuation", a.model_instance()))
        element = of_instance.index(a._input_start)
        row = dict(
            dof=joint._v_start,
            q=joint._q_start,
            port=self._inputs.actuation,
            element=a._input_start,
            instance_port=self._inputs.actuation_of[instance],
            instance_element=element,
            effort_limit=a.effort_limit(),
            gains=self._elements.model("Finalize").gains_at(a),
        )
        if a._gains is not None:
            desired = self._inputs.desired_state_of[instance]
            row |= dict(p=a._gains.p, d=a._gains.d, desired_port=desired, desired_q=element)
            row["desired_v"] = element + len(of_instance)
        return row

    def _limit_row(self, joint: Joint, scalar_rows: bool) -> dict[str, Any]:
        lower, upper = joint._limits["position"]
        stiffness = damping = 0.0  # as in Drake, kTamsi, which has no rows for limits, ignores those of other joints
        if not scalar_rows and joint._type.limited:
            stiffness, damping = tamsi_limit_penalty(_limit_inertia(joint), self._settings.time_step)
        return dict(
            dof=joint._v_start, q=joint._q_start, lower=lower[0], upper=upper[0], stiffness=stiffness, damping=damping
        )

    def actuator_changed(self, actuator: JointActuator) -> None:
        """Effort limits and gains may change after Finalize()."""
        if self._plant_model is not None:
            number = next(i for i, a in enumerate(self._elements.actuators) if a is actuator)
            self._plant_model.actuator[number], self._plant_model.gain[number] = actuator_arrays(
                self._actuator_row(actuator)
            )

    def _touches_along_surfaces(self, state: GeometryState) -> bool:
        """Whether any geometry of the plant can make contact surfaces."""
        return self._settings.contact_model is not ContactModel.kPoint and has_surfaces(state)

    def _split_pairs(self, state: GeometryState, model: GeometryModel, ids: list) -> HydroPairs:
        """Which pairs of geometries touch along surfaces: none with ContactModel.kPoint."""
        if self._settings.contact_model is ContactModel.kPoint:
            return HydroPairs(empty_hydro_model(), model)
        return compile_hydro(state, model, ids, self._settings.representation)


def is_limited(joint: Joint) -> bool:
    """Whether the position of a joint of one degree of freedom has limits."""
    if joint.num_velocities() != 1:
        return False
    lower, upper = joint._limits["position"]
    return math.isfinite(lower[0]) or math.isfinite(upper[0])


def _dry_frictions(joints: list[Joint]) -> list[tuple[int, float]]:
    """(dof, largest effort) of the joints that have dry friction."""
    return [
        (joint._v_start + k, effort) for joint in joints for k, effort in enumerate(joint._dry_friction) if effort > 0.0
    ]


def _limit_inertia(joint: Joint) -> float:
    """The smaller of parent's and child's mass, or of a revolute joint inertia about the axis (for kTamsi's limits)."""

    def of(frame: Frame) -> float:
        body = frame.body()
        if body.index() == 0:
            return np.inf
        M = body.default_spatial_inertia()
        if not isinstance(joint, RevoluteJoint):
            return float(M.get_mass())
        X_BF = frame._fixed_X_BF()
        axis = X_BF.rotation() @ joint._axis
        I = M.Shift(X_BF.translation()).CalcRotationalInertia().CopyToFullMatrix3()
        return float(axis @ I @ axis)

    return min(of(joint.frame_on_parent()), of(joint.frame_on_child()))
