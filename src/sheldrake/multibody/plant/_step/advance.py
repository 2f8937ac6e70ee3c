"""How a plant advances: the stages that run, the same in Python for one context, and the scratch that either leaves."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.common.chain import Chain
from sheldrake.common.kernel import Kernel
from sheldrake.multibody.contact_solvers._kernels.problem import MASS_NOT_POSITIVE
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._building.settings import Settings
from sheldrake.multibody.plant._context.contexts import Contexts
from sheldrake.multibody.plant._kernels.derivatives import DerivativeVectors
from sheldrake.multibody.plant._kernels.ports import CONSTRAINTS_IN_CONTINUOUS_TIME, GEOMETRY_NOT_CONNECTED
from sheldrake.multibody.plant._step.applied_forces import AppliedForces
from sheldrake.multibody.plant._step.continuous import ContinuousDynamics
from sheldrake.multibody.plant._step.discrete import DiscreteUpdate
from sheldrake.multibody.plant._step.failures import Failures
from sheldrake.multibody.plant._step.input_ports import GEOMETRY_QUERY, sees_geometry, vector_inputs
from sheldrake.multibody.plant._step.kernel_models import CompiledGeometry, KernelModels
from sheldrake.multibody.plant._step.stages import repeats
from sheldrake.multibody.plant._step.surface_speeds import SurfaceSpeeds
from sheldrake.systems.framework import Context, LeafSystem, System
from sheldrake.systems.framework._declarations import FedStage, PythonStage, Stages

if TYPE_CHECKING:
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.plant._kernels.model import StepWork
    from sheldrake.systems.framework._engine.memory import RootView


class Advance:
    """The update of a discrete plant, or the derivatives of a continuous one.

    Args:
        elements: Tell whether there are constraints.
        settings: Discrete or continuous; sampled ports or not.
        contexts: The state.
        models: The arrays of the kernels.
        applied: Forces that come as objects.
        speeds: How fast surfaces run.
        failures: Why kernels could not go on.
    """

    def __init__(
        self,
        elements: Elements,
        settings: Settings,
        contexts: Contexts,
        models: KernelModels,
        applied: AppliedForces,
        speeds: SurfaceSpeeds,
        failures: Failures,
    ) -> None:
        self._elements, self._settings, self._contexts = elements, settings, contexts
        self._models, self._applied, self._speeds, self._failures = models, applied, speeds, failures
        kind = DiscreteUpdate if settings.is_discrete() else ContinuousDynamics
        self.equations: Any = kind(elements, settings, models)
        """A `DiscreteUpdate` or `ContinuousDynamics`: which kernels run, and what their scratch means."""
        self._prototype: tuple[Any, bool, Any] | None = None

    # --- rows

    def declare(self, plant: LeafSystem) -> None:
        """Declares the update or the derivatives."""
        self.equations.declare(plant, Stages(_stages_in, repeats))

    def stages_in(self, plant: LeafSystem, root: RootView) -> list[Kernel | PythonStage | FedStage]:
        """What runs in the contexts of a root, in order; first what finds forces that come as objects.

        Args:
            plant: The plant.
            root: Its view of the root.
        """
        if refusal := self.equations.refusal(root):
            return refusal
        kernels = self.equations.stages(self._models.in_root(root))
        if self._speeds.any():
            kernels = [PythonStage(_find_surface_speeds, (self.equations.vectors, "surface_speed")), *kernels]
        if root.source(GEOMETRY_QUERY) is not None and self._models.geometry_in(root).strange:
            kernels = [PythonStage(_refuse_strangers, None), *kernels]
        if not self._applied.are_used(plant):
            return kernels
        native = self._applied.native_stages(plant, root)
        reads = PythonStage(_find_applied_force, (self.equations.vectors, "applied_force"))
        return [*([reads] if native is None else native), *kernels]

    def find_applied_force(self, context: Context) -> None:
        """Turns the applied spatial forces into generalized ones, in the scratch of the step or the derivatives."""
        view = self._contexts.view(context)
        if view.applied_force is None:
            view.applied_force = self.equations.applied_force(context._store.scratch(context._node))
        self._put_applied_force(context, view.applied_force)

    def _put_applied_force(self, context: Context, targets: tuple[np.ndarray, ...]) -> None:
        for target, values in zip(targets, self._applied.amount(context)):
            target[...] = values

    def find_surface_speeds(self, context: Context) -> None:
        """Puts the speeds of surfaces into the scratch of the step or the derivatives."""
        scratch = context._store.scratch(context._node)
        getattr(scratch, self.equations.vectors).surface_speed[:] = self._speeds.speeds(context)

    def refuse_strangers(self, context: Context) -> None:
        """Looks whether geometry of others is in contact with the plant's own, on which it could exert no forces.

        Raises:
            RuntimeError: it is.
        """
        if pairs := self._models.geometry_of(context).strange:
            self._failures.refuse_contact_of(pairs, context)

    # --- scratch

    def prototype(self, plant: System, geometry: CompiledGeometry) -> StepWork:
        """The scratch of a plant's contexts with a state of the geometry."""
        known, pushes = self._prototype, self._applied.are_used(plant)
        if known is None or known[0] is not geometry.model or known[1] != pushes:
            known = self._prototype = geometry.model, pushes, self.equations.make_work(geometry, pushes)
        return known[2]

    def arrays(self) -> list[Any]:
        """What copies of the plant on other scalars share."""
        return [self._prototype]

    def carry(self, old: StepWork, new: StepWork) -> None:
        """Fills new scratch with what old scratch says that does not speak of contacts."""
        for name in self.equations.kept_parts:
            for target, values in zip(getattr(new, name), getattr(old, name)):
                if target.shape == values.shape:  # forces may be applied from now on
                    target[...] = values

    def results(self, context: Context, motion: bool = True) -> Any:
        """Scratch of the last step; of the present state when ports are not sampled.

        Args:
            context: Where.
            motion: Whether accelerations are asked for; in continuous time, forces of contact are known without them.
        """
        return context._store.scratch(context._node) if self._settings.sampled else self.present_work(context, motion)

    def present_work(self, context: Context, motion: bool = True) -> StepWork:
        """Scratch of a step from the present state, or of its derivatives; made once a state. See `results`."""
        view = self._contexts.view(context)
        stamp = context._store.i[2]
        if view.results is None or view.results[0] != stamp:
            work, status = self._run(context)
            if status and (status != MASS_NOT_POSITIVE or self._settings.is_discrete()):
                raise self._failures.explain(status, context)
            view.results = stamp, work, status
        if motion and view.results[2]:
            raise self._failures.explain(view.results[2], context)
        return view.results[1]

    def vdot(self, context: Context, sampled: bool = False) -> np.ndarray:
        """Generalized accelerations at the present state, shape (nv,).

        Args:
            context: Where.
            sampled: In the last step, where ports are sampled.
        """
        view = self._contexts.view(context)  # whether it is a context of this plant is told there
        if not self._settings.is_discrete() and view.T is AutoDiffXd:  # its sweeps leave no scratch
            return context._system.EvalTimeDerivatives(context).get_generalized_velocity().CopyToVector()
        return self.equations.vdot(self.results(context) if sampled else self.present_work(context))

    def forces(self, context: Context) -> DerivativeVectors:
        """Vectors of the derivatives as they are before accelerations are computed; for symbols."""
        work, status = self._run(context, solve=False)
        if status:
            raise self._failures.explain(status, context)
        return getattr(work, self.equations.vectors)

    # --- in Python

    def _run(self, context: Context, solve: bool = True) -> tuple[StepWork, int]:
        """Runs the stages of the step or the derivatives with everything that acts from outside: scratch and status.

        A view of floats keeps scratch and bound kernels for the next time, as binding takes a hundred times longer.
        """
        view = self._contexts.view(context)
        connected, geometry = sees_geometry(context), self._models.geometry_of(context)
        models, prototype = self._models.of(connected, geometry), self.prototype(context._system, geometry)
        late = context._store.unsettled
        rehearsal: Rehearsal | None = None if late else view.rehearsal
        if rehearsal is None or not rehearsal.serves(prototype, models):
            rehearsal = self._new_rehearsal(context, prototype, models, vector_inputs(context), solve)
            view.rehearsal = rehearsal if view.native and not late else None
        work = rehearsal.afresh()
        if self._applied.are_given(context):
            self._put_applied_force(context, self.equations.applied_force(work))
        if self._speeds.any():
            getattr(work, self.equations.vectors).surface_speed[:] = self._speeds.speeds(context)
        for row in rehearsal.rows:
            context._store.pull(row)
        if self._models.misses_geometry(connected):
            raise self._failures.explain(GEOMETRY_NOT_CONNECTED, context)
        if self._elements.constraints and not self._settings.is_discrete():
            raise self._failures.explain(CONSTRAINTS_IN_CONTINUOUS_TIME, context)
        if connected:
            self.refuse_strangers(context)
        return work, rehearsal.run()

    def _new_rehearsal(
        self,
        context: Context,
        prototype: StepWork,
        models: dict[str, Any],
        inputs: tuple[tuple[np.ndarray, ...], list[int]],
        solve: bool,
    ) -> Rehearsal:
        view, (u, rows) = self._contexts.view(context), inputs
        copy = view.copy_of(prototype)
        work, originals = in_one_piece(copy, _rows_of_a_run(copy))
        values = dict(work._asdict(), **models, xd=view.x, xc=view.x, p=view.p, u=u, out=view.zeros(len(view.x)))
        stages = self.equations.stages(models)
        chain = Chain(stages if solve else stages[:-1])
        run = chain.bind(**values) if view.native else partial(chain, **values)
        return Rehearsal(prototype, models, work, originals, rows, run)


class Rehearsal(NamedTuple):
    """A step, or derivatives, on scratch beside that of the context: nothing in the context changes."""

    prototype: StepWork
    models: dict[str, Any]
    work: StepWork
    originals: list[tuple[np.ndarray, np.ndarray]]
    """The memory of the scratch, and what the prototype says there."""
    rows: list[int]
    """Rows of the store that feed its input ports, to be brought up to date before it runs."""
    run: Callable[[], int]

    def serves(self, prototype: StepWork, models: dict[str, Any]) -> bool:
        """Whether it is for this scratch and these arrays."""
        if self.prototype is not prototype:
            return False
        return self.models is models or all(models[name] is mine for name, mine in self.models.items())

    def afresh(self) -> StepWork:
        """The scratch, as the prototype is in all that a run does not write before it reads it."""
        for array, original in self.originals:
            array[...] = original
        return self.work


_WRITTEN_FIRST = {
    "table": ("work", "link", "hole", "stack"),
    "surfaces": ("face", "value", "vertex", "contact", "work", "plane", "stack"),
    "flow": ("face",),
}
"""Of scratch, where stages read no more than they have written in the same run: most of its memory."""


def _rows_of_a_run(work: StepWork) -> list[np.ndarray]:
    """The arrays of `_WRITTEN_FIRST`."""
    return [
        getattr(getattr(work, part), name)
        for part, names in _WRITTEN_FIRST.items()
        for name in names
        if hasattr(work, part)
    ]


def in_one_piece(table: Any, apart: list[np.ndarray]) -> tuple[Any, list[tuple[np.ndarray, np.ndarray]]]:
    """A table of arrays, or of tables, with all its numbers of a kind in one array: these, and copies of them.

    Args:
        table: The table.
        apart: Arrays of it that stay where they are, and of which there are no copies.
    """
    others = set(map(id, apart))
    arrays = [array for array in _arrays_of(table) if id(array) not in others]
    kinds = {array.dtype for array in arrays}
    whole = {kind: np.concatenate([a.ravel() for a in arrays if a.dtype == kind]) for kind in kinds}
    taken = dict.fromkeys(kinds, 0)

    def moved(part: Any) -> Any:
        if not isinstance(part, np.ndarray):
            return type(part)(*map(moved, part))
        if id(part) in others:
            return part
        begin = taken[part.dtype]
        taken[part.dtype] = end = begin + part.size
        return whole[part.dtype][begin:end].reshape(part.shape)

    return moved(table), [(numbers, numbers.copy()) for numbers in whole.values()]


def _arrays_of(table: Any) -> list[np.ndarray]:
    """The arrays of a table, or of tables of tables."""
    return [table] if isinstance(table, np.ndarray) else [array for part in table for array in _arrays_of(part)]


# A plant's declarations serve its copies on other scalars: so these ask the plant that they are called for.


def _stages_in(plant: MultibodyPlant, root: RootView) -> list[Kernel | PythonStage | FedStage]:
    return plant._parts.advance.stages_in(plant, root)


def _find_applied_force(plant: MultibodyPlant, context: Context) -> None:
    plant._parts.advance.find_applied_force(context)


def _refuse_strangers(plant: MultibodyPlant, context: Context) -> None:
    plant._parts.advance.refuse_strangers(context)


def _find_surface_speeds(plant: Any, context: Context) -> None:
    plant._parts.advance.find_surface_speeds(context)
