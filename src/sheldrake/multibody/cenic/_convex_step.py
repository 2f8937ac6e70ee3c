"""CENIC's step as a row of the event loop: its arrays, and what it calls."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common.kernel import Kernel
from sheldrake.geometry._kernels.model import contact_table
from sheldrake.geometry._kernels.spatial_hash import make_cells
from sheldrake.multibody.cenic._kernels.step import Calls, Convex, PlantPlace, Tolerances, cenic_step
from sheldrake.multibody.contact_solvers import IcfSolverParameters
from sheldrake.multibody.contact_solvers._kernels.solve import CONTACT_MARGIN, prepare_hunt_crossley_contacts
from sheldrake.multibody.plant._enums import ContactModel
from sheldrake.multibody.plant._kernels.contacts import static_friction
from sheldrake.multibody.plant._kernels.ports import GEOMETRY_NOT_CONNECTED
from sheldrake.multibody.plant._parts import parts_of
from sheldrake.multibody.plant._step.arrays import make_plant_model, make_step_work
from sheldrake.multibody.plant._step.input_ports import sees_geometry
from sheldrake.multibody.plant._step.kernel_models import is_limited
from sheldrake.multibody.plant._step.stages import discrete_stages
from sheldrake.multibody.plant._step.tuning import solver_model_of
from sheldrake.systems.analysis._kernel_steps import Arguments, callees, prepare, set_step

if TYPE_CHECKING:
    from sheldrake.multibody.plant._multibody_plant import MultibodyPlant
    from sheldrake.systems.analysis._span import Span
    from sheldrake.systems.framework._context.context import Context


class ConvexStep:
    """Solves the convex problems of steps from the state of a plant's context, with arrays of its own.

    Joint limits, constraints and PD gains are part of the problem, as in a discrete plant. Forces that come from other
    systems of the diagram are linearized in the velocity of the joint they act on, and are implicit in so far as they
    brake it, so that stiff controllers need no short steps.

    Args:
        plant: a finalized plant with time_step = 0.
        context: its context.
        span: the event loop of its root context.

    Raises:
        RuntimeError: the plant has collision geometry, but is connected to no SceneGraph.
    """

    def __init__(self, plant: MultibodyPlant, context: Context, span: Span):
        self._plant, self._context = plant, context
        self._parts = parts = parts_of(plant)
        connected = sees_geometry(context)
        if parts.kernel_models.misses_geometry(connected):
            raise parts.failures.explain(GEOMETRY_NOT_CONNECTED, context)
        found = parts.kernel_models.geometry_of(context)
        if connected and found.strange:
            raise RuntimeError(
                f"{plant._describe()}: its geometry may touch that of another plant, of which CENIC knows no motion. "
                "Exclude such pairs with a collision filter."
            )
        models = parts.kernel_models.of(connected, found)
        geometry, hydro = models["geometry_model"], models["hydro_model"]
        models["geometry_model"] = geometry = geometry._replace(margin=np.array([CONTACT_MARGIN, 0.0]))
        models["plant_model"] = plant_model = self._with_limits(models["plant_model"])
        models["solver_model"] = self._solver = solver_model_of(
            models["tree_model"],
            geometry,
            1.0,
            "lagged",
            hydro,
            stiction_tolerance=parts.settings.stiction_tolerance,
            moving_tolerance=0.0,  # errors are controlled by the integrator
        )
        table, cells = contact_table(geometry), make_cells(geometry)
        work = make_step_work(models["tree_model"], self._solver, plant_model, table, hydro_model=hydro, cells=cells)
        strict = parts.settings.contact_model is ContactModel.kHydroelastic
        stages = discrete_stages(geometry, plant_model, "lagged", hydro, strict)
        stages.insert(stages.index(prepare_hunt_crossley_contacts), static_friction)
        self._work = work
        self._convex = self._memory(len(parts.contexts.view(context).p))
        self._models = models
        self._add_to(span, stages, {**work._asdict(), **models, "convex": self._convex})

    def _with_limits(self, model: Any) -> Any:
        """Position limits, which derivatives do without."""
        joints = [joint for joint in self._parts.elements.joints if is_limited(joint)]
        rows = [(j, *j._limits["position"]) for j in joints]
        limits = [dict(dof=j._v_start, q=j._q_start, lower=low[0], upper=high[0]) for j, low, high in rows]
        made = make_plant_model(limits=limits)
        return model._replace(limit=made.limit, bound=made.bound)

    def _memory(self, num_parameters: int) -> Convex:
        n, nv = self._plant.num_multibody_states(), self._plant.num_velocities()
        sizes = (n, n, n, num_parameters, nv, Tolerances.SIZE)
        xd, out, whole, p, gain, tolerance = (np.zeros(size) for size in sizes)
        return Convex(xd, out, whole, p, gain, self._solver.option, tolerance)

    def _add_to(self, span: Span, stages: list[Kernel], values: dict[str, Any]) -> None:
        """Has the span make its steps so."""
        plant, place, layout = self._plant, self._context._place, span.layout
        prepare([*stages, cenic_step])
        u = [slot.span for slot in place.inputs]
        memory = {name: getattr(self._convex, name) for name in ("xd", "out", "p")}
        spatial, running = self._parts.applied_forces.are_used(plant), self._parts.surface_speeds.any()
        functions = [self._find_applied_force] * spatial + [self._find_surface_speeds] * running
        arguments = Arguments(span, {**values, **memory}, {"u": u})
        called = callees(span, [(stage, arguments) for stage in stages], functions)
        rows = layout.stages(place.derivatives)
        starts = [j._q_start for j in self._parts.elements.joints if j.type_name() == "quaternion_floating"]
        self._calls = Calls(*called, np.zeros(PlantPlace.SIZE, np.int64), np.array(starts, np.int64))
        self._calls.state_begin = place.xc[0] - layout.xc[0]
        self._calls.num_q, self._calls.num_v = plant.num_positions(), plant.num_velocities()
        self._calls.is_fed = spatial or self._is_fed()
        self._calls.spatial = len(stages) if spatial else -1
        self._calls.surfaces = len(stages) + spatial if running else -1
        self._calls.row_begin, self._calls.row_end = rows[0], rows[-1] + 1
        set_step(span, cenic_step, Arguments(span, {**values, "calls": self._calls}, {"u": u, "p": place.p}))

    def _is_fed(self) -> bool:
        """Whether other systems of the diagram give forces."""
        plant = self._plant
        parent = plant._parent()
        me = next(k for k, system in enumerate(parent._systems) if system is plant)
        return any((me, n) in parent._wires for n in self._parts.inputs.of_forces())

    def _find_applied_force(self) -> None:
        self._work.step.applied_force[:] = self._parts.applied_forces.amount(self._context)[0]

    def _find_surface_speeds(self) -> None:
        self._work.step.surface_speed[:] = self._parts.surface_speeds.speeds(self._context)

    def use(self, parameters: IcfSolverParameters) -> None:
        """Settings of the solver."""
        self._solver.max_iterations = parameters.max_iterations
        self._convex.least_tolerance = parameters.min_tolerance
