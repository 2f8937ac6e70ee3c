"""The discrete update: its stages, its scratch, and the work of the last step."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.geometry._kernels.cells import make_cells
from sheldrake.geometry._kernels.model import contact_table
from sheldrake.multibody.plant._enums import ContactModel, DiscreteContactApproximation
from sheldrake.multibody.plant._kernels.model import StepWork
from sheldrake.multibody.plant._kernels.ports import refuse_without_geometry
from sheldrake.multibody.plant._step.arrays import make_step_work
from sheldrake.multibody.plant._step.explain_failure import explain_failure
from sheldrake.multibody.plant._step.kernel_models import CompiledGeometry
from sheldrake.multibody.plant._step.stages import discrete_stages
from sheldrake.systems.framework._declarations import Stages


class DiscreteUpdate:
    """The step of a plant with time_step > 0."""

    def _declare_discrete_update(self) -> None:
        dt, stages = self._time_step, Stages(DiscreteUpdate._stages_in)
        if self._sampled:
            self.DeclarePeriodicUnrestrictedUpdateEvent(dt, 0.0, stages)
            self.DeclareForcedUnrestrictedUpdateEvent(stages)
        else:
            self.DeclarePeriodicDiscreteUpdateEvent(dt, 0.0, stages)
            self.DeclareForcedDiscreteUpdateEvent(stages)

    def _stages_in(self, root: Any) -> list[Any]:
        if self._misses_geometry(root.source(0) is not None):
            return [refuse_without_geometry]
        return self._step_stages(self._kernel_models(root))

    def _step_stages(self, models: dict[str, Any]) -> list[Any]:
        tamsi = self._approximation is DiscreteContactApproximation.kTamsi
        strict = self._contact_model is ContactModel.kHydroelastic
        return discrete_stages(models["geometry_model"], self._plant_model, tamsi, models["hydro_model"], strict)

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
                work: Any = make_step_work(
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

    def _step_tickets(self) -> set[Any]:
        """Prerequisites of what depends on the step."""
        if self.is_discrete() and self._sampled:
            return {self._scratch_ticket()}
        return {self.all_sources_ticket()}

    def _results(self, context: Any) -> StepWork:
        """Scratch of the last step; of a step from the present state when ports are not sampled."""
        return context._store.scratch(context._node) if self._sampled else self._present_work(context)

    def _present_work(self, context: Any) -> Any:
        """Scratch of a step from the present state, or of its derivatives; made once a state."""
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
