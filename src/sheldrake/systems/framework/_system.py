"""System: what can be asked of any system, leaf or diagram, with a context."""

from __future__ import annotations

import gc
import operator
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, SupportsIndex
from typing import overload as typing_overload

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._copies import Cloned
from sheldrake.common._overloads import Mismatch
from sheldrake.common._scalars import writable
from sheldrake.systems.framework import _evaluate
from sheldrake.systems.framework._context import defaults
from sheldrake.systems.framework._declarations import DISCRETE
from sheldrake.systems.framework._engine.asked import UPDATE, native_call
from sheldrake.systems.framework._engine.layout import Layout
from sheldrake.systems.framework._engine.store import Store
from sheldrake.systems.framework._engine.topology import tree_of
from sheldrake.systems.framework._event import PeriodicEventData, WitnessFunction
from sheldrake.systems.framework._index import PortDataType
from sheldrake.systems.framework._port_values import SystemOutput
from sheldrake.systems.framework._scalar_conversion import ScalarConversion
from sheldrake.systems.framework._state import State
from sheldrake.systems.framework._system_ports import SystemPorts
from sheldrake.systems.framework._values import ContinuousState, DiscreteValues
from sheldrake.systems.framework._vector import BasicVector, lifted

if TYPE_CHECKING:
    from typing_extensions import Self

    from sheldrake.common import RandomGenerator
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._diagram import Diagram
    from sheldrake.systems.framework._leaf_events import LeafEvents


class _NoCollection:
    """Keeps Python from searching for garbage among many small objects that all stay alive."""

    def __enter__(self) -> None:
        self._was_enabled = gc.isenabled()
        gc.disable()

    def __exit__(self, *error: object) -> None:
        if self._was_enabled:
            gc.enable()


class System(ScalarConversion, SystemPorts, Cloned):
    """Base of all systems."""

    # Contexts.

    def _layout_with(self, overrides: frozenset = frozenset(), structures: dict | None = None) -> Layout:
        if structures:
            return Layout(self, overrides, structures)
        version = sum(s._version for s in tree_of(self))
        layout = self._layouts.get(overrides)
        if layout is None or layout.version != version:
            with _NoCollection():
                layout = self._layouts[overrides] = Layout(self, overrides)
        return layout

    def AllocateContext(self) -> Context:
        """A context with the state and parameters that were declared; systems that set their own have not yet."""
        store = Store(self._layout_with(), tree_of(self), self._scalar)
        defaults.set_declared(store, 0)
        return store.context(0)

    def CreateDefaultContext(self) -> Context:
        """A context with default state and parameters, for this system as root."""
        with _NoCollection():
            store = Store(self._layout_with(), tree_of(self), self._scalar)
            defaults.set_defaults(store, 0)
        return store.context(0)

    def SetDefaultContext(self, context: Context) -> None:
        """Sets state and parameters to their defaults."""
        self.ValidateContext(context)
        defaults.set_defaults(context._store, context._node)

    def SetRandomContext(self, context: Context, generator: RandomGenerator) -> None:
        """Sets state and parameters to random values, as far as systems know how; else to their defaults."""
        self.SetDefaultContext(context)
        for m in _evaluate.leaves_under(context._store, context._node):
            context._store.systems[m]._set_random_context(context._store.context(m), generator)

    def GetSubsystemContext(self, subsystem: System, context: Context) -> Context:
        """The part of `context`, which is this system's, that belongs to a subsystem.

        Raises:
            RuntimeError: `subsystem` is not in this system.
        """
        self.ValidateContext(context)
        store = context._store
        n = store.layout.node_of.get(subsystem._system_id)
        m = n
        while m is not None and m != context._node and m >= 0:
            m = store.layout.nodes[m].parent
        if n is None or m != context._node:
            raise RuntimeError(
                f"System.GetSubsystemContext(): {subsystem._describe()} is not contained in {self._describe()}."
            )
        return store.context(n)

    GetMutableSubsystemContext = GetSubsystemContext

    def GetMyContextFromRoot(self, root_context: Any) -> Context:
        """This system's part of the context of the diagram it is in.

        Raises:
            RuntimeError: `root_context` is no root context, or of another diagram.
        """
        if not hasattr(root_context, "_store"):
            raise Mismatch(
                f"GetMyContextFromRoot(): incompatible function arguments: expected a Context, got {root_context!r}"
            )
        store = root_context._store
        if root_context._node != 0:
            raise RuntimeError(
                f"System.GetMyContextFromRoot(): the given Context, of {root_context._system._describe()}, must be a "
                "root context."
            )
        n = store.layout.node_of.get(self._system_id)
        if n is None:
            raise RuntimeError(
                f"System.GetMyContextFromRoot(): {self._describe()} is not contained in the Diagram that the given "
                f"Context was made for, {root_context._system._describe()}."
            )
        return store.context(n)

    GetMyMutableContextFromRoot = GetMyContextFromRoot

    # Outputs, derivatives, updates.

    def AllocateOutput(self) -> SystemOutput:
        """Values for all output ports, to be filled by `CalcOutput`."""
        return SystemOutput._of(self.num_output_ports(), self._allocate_output)

    def CalcOutput(self, context: Context, outputs: SystemOutput) -> None:
        """Computes all output ports into `outputs`, those in Python anew."""
        self.ValidateContext(context)
        for j in range(self.num_output_ports()):
            port = self.get_output_port(j)
            context._store.forget(port._slot(context).row)
            outputs.get_data(j).SetFrom(port.EvalAbstract(context))

    def AllocateTimeDerivatives(self) -> ContinuousState:
        """A continuous state to compute derivatives into."""
        return self._structure()[0].Clone()

    def AllocateDiscreteVariables(self) -> DiscreteValues:
        """Discrete values to compute an update into."""
        return self._structure()[1].Clone()

    def _structure(self) -> tuple[ContinuousState, DiscreteValues]:
        """State as a new context has it, to be cloned; kept as long as the layout is the same."""
        layout = self._layout_with()
        if self._state_of is None or self._state_of[0] is not layout:
            context = self.AllocateContext()
            self._state_of = layout, context._continuous_view().Clone(), context._discrete_view().Clone()
        return self._state_of[1:]

    def AllocateImplicitTimeDerivativesResidual(self) -> np.ndarray:
        """An array for the residuals of the implicit form, shape (n,)."""
        return lifted(np.zeros(self.implicit_time_derivatives_residual_size()), self._scalar)

    def EvalTimeDerivatives(self, context: Context) -> ContinuousState:
        """Time derivatives of the continuous state."""
        if getattr(context, "_system", None) is not self:
            self.ValidateContext(context)
        found = _evaluate.derivatives(context)
        return ContinuousState._view(BasicVector._view(found.copy()), context._store.layout.parts(context._node))

    def CalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
        """Time derivatives of the continuous state, into `derivatives`; those in Python are computed anew."""
        if getattr(context, "_system", None) is not self:
            self.ValidateContext(context)
        _evaluate.forget_derivatives(context)
        derivatives._vector.SetFromVector(_evaluate.derivatives(context))

    @checked
    def CalcImplicitTimeDerivativesResidual(
        self, context: Context, proposed_derivatives: ContinuousState, residual: np.ndarray | None = None
    ) -> Any:
        """What the implicit form of the dynamics leaves for proposed derivatives, shape (n,).

        Proposed derivatives minus those computed; of the velocities of a continuous `MultibodyPlant`, the generalized
        forces that are missing: M(q) vdot + C(q, v) v - tau. Into `residual` if given.

        Raises:
            RuntimeError: there are more or fewer proposed derivatives than continuous states.
        """
        if residual is not None:
            writable("CalcImplicitTimeDerivativesResidual", "residual", residual)
        proposed = proposed_derivatives.CopyToVector()
        if len(proposed) != self.num_continuous_states():
            raise RuntimeError(
                f"CalcImplicitTimeDerivativesResidual(): {self._describe()} has {self.num_continuous_states()} "
                f"continuous states, not {len(proposed)} as the proposed derivatives."
            )
        value = self._implicit_residual(context, proposed)
        if residual is None:
            return value
        residual[:] = value
        return None

    def _implicit_residual(self, context: Context, proposed: np.ndarray) -> np.ndarray:
        """See `CalcImplicitTimeDerivativesResidual`."""
        return proposed - self.EvalTimeDerivatives(context).CopyToVector()

    @checked
    def CalcForcedDiscreteVariableUpdate(self, context: Context, discrete_state: DiscreteValues) -> None:
        """What the forced discrete updates would make of the discrete state, into `discrete_state`."""
        self.ValidateContext(context)
        store, n, call = context._store, context._node, "CalcForcedDiscreteVariableUpdate"
        discrete_state.SetFrom(_evaluate.discrete_update(store, n, "forced", call)[0])

    @checked
    def CalcForcedUnrestrictedUpdate(self, context: Context, state: State) -> None:
        """What the forced unrestricted updates would make of the state, into `state`."""
        self.ValidateContext(context)
        store, n, call = context._store, context._node, "CalcForcedUnrestrictedUpdate"
        state.SetFrom(_evaluate.unrestricted_update(store, n, "forced", call)[0])

    def ForcedPublish(self, context: Context) -> None:
        """Runs all forced publishes."""
        self.ValidateContext(context)
        _evaluate.publish_or_raise(context._store, context._node, "forced", "ForcedPublish")

    def ExecuteInitializationEvents(self, context: Context) -> None:
        """Runs all initialization events and changes the state as they say."""
        self._execute(context, "initialization", True, "ExecuteInitializationEvents")

    def ExecuteForcedEvents(self, context: Context, publish: bool = True) -> None:
        """Runs all forced events and changes the state as they say."""
        self._execute(context, "forced", publish, "ExecuteForcedEvents")

    def _execute(self, context: Context, trigger: str, publish: bool, call: str) -> None:
        self.ValidateContext(context)
        store, n = context._store, context._node
        _evaluate.apply_unrestricted(store, n, trigger, call)
        _evaluate.apply_discrete(store, n, trigger, call)
        if publish:
            _evaluate.publish_or_raise(store, n, trigger, call)

    # Periodic updates.

    def _motion_and_slopes(self, context: Context, x: np.ndarray, u: Any, i: int | None, j: int | None) -> Any:
        """x' or x+ and output j, and their derivatives by x and input i = u, where a system knows them.

        Returns:
            Shapes (n + ny,) and (n + ny, n + nu); None where it does not.
        """
        return None

    def _periodic_discrete(self) -> set[tuple[float, float]]:
        return {
            (event.period, event.offset)
            for s in tree_of(self)
            if s._subsystems() is None
            for event in s._all_events()
            if event.kind == DISCRETE and event.trigger == "periodic"
        }

    def GetUniquePeriodicDiscreteUpdateAttribute(self) -> PeriodicEventData | None:
        """Period and offset of the periodic discrete updates, if all share them."""
        times = self._periodic_discrete()
        return PeriodicEventData._make(*times.pop()) if len(times) == 1 else None

    def EvalUniquePeriodicDiscreteUpdate(self, context: Context) -> DiscreteValues:
        """What the periodic discrete updates would make of the discrete state.

        Raises:
            RuntimeError: there are none, or not all at the same times.
        """
        self.ValidateContext(context)
        store, key = context._store, ("unique update", context._node)
        kept = store.cache.get(key)
        if kept is not None and kept[0] == store.i[2] and not (store.uncached or store.unsettled):
            return kept[1].Clone()
        update = context._reads.get(UPDATE) or native_call(context, UPDATE)
        if update is not None and update():
            found = context._discrete_view(store.layout.plus).Clone()
        else:
            found = self._unique_update(context)
        store.cache[key] = store.i[2], found
        return found.Clone()

    def _unique_update(self, context: Context) -> DiscreteValues:
        call = "EvalUniquePeriodicDiscreteUpdate"
        times = self._periodic_discrete()
        if len(times) != 1:
            raise RuntimeError(
                f"{call}(): there are "
                + (
                    "no periodic discrete update events in this System."
                    if not times
                    else "multiple timing attributes for the periodic discrete update events in this System: "
                    f"(period, offset) {sorted(times)}."
                )
            )
        return _evaluate.discrete_update(context._store, context._node, "periodic", call)[0].Clone()

    def IsDifferenceEquationSystem(self) -> tuple[bool, float]:
        """Whether the state is one group of discrete state that has a periodic update with one period; that period [s].

        Other events do not count, nor do they in Drake.
        """
        times = self._periodic_discrete()
        if (
            self.num_continuous_states()
            or self.num_abstract_states()
            or self.num_discrete_state_groups() != 1
            or len(times) != 1
        ):
            return False, 0.0
        period, offset = times.pop()
        return (True, period) if offset == 0.0 else (False, 0.0)

    def IsDifferentialEquationSystem(self) -> bool:
        """Whether there is no state but continuous state, and no input but vectors."""
        if self.num_discrete_state_groups() or self.num_abstract_states():
            return False
        return all(port.data_type is PortDataType.kVectorValued for port in self._inputs)

    # Feedthrough.

    def HasAnyDirectFeedthrough(self) -> bool:
        """Whether any output depends on any input directly."""
        return bool(self._feedthrough())

    @typing_overload
    @checked
    def HasDirectFeedthrough(self, output_port: int) -> bool: ...
    @typing_overload
    @checked
    def HasDirectFeedthrough(self, input_port: int, output_port: int) -> bool: ...
    def HasDirectFeedthrough(self, *args: Any, output_port: Any = None, input_port: Any = None) -> bool:
        """Whether an output depends directly on any input: `(output_port)`, or on one: `(input_port, output_port)`."""
        if len(args) == 1 and output_port is None:
            output_port = args[0]
        elif len(args) == 1:
            input_port = args[0]
        elif len(args) == 2:
            input_port, output_port = args
        j = operator.index(output_port)
        if input_port is None:
            return any(b == j for _, b in self._feedthrough())
        return (operator.index(input_port), j) in self._feedthrough()

    def GetDirectFeedthroughs(self) -> list[tuple[int, int]]:
        """All pairs (input, output) with direct feedthrough."""
        return sorted(self._feedthrough())

    def _feedthrough(self) -> set[tuple[int, int]]:
        layout = self._layout_with()
        found = set()
        for j in range(len(self._outputs)):
            n, k = layout.output_source(0, j) if layout.nodes[0].leaf else layout._outputs[0, j]
            seen, todo = set(), [(n, k)]
            while todo:
                port = todo.pop()
                if port in seen or port not in layout.needs:
                    continue
                seen.add(port)
                for need in layout.needs[port]:
                    if isinstance(need, tuple):
                        kind, m, i = layout.sources[port[0], need[1]]
                        if kind == "out":
                            todo.append((m, i))
                        elif m == 0:
                            found.add((i, j))
        return found

    # Energy.

    def _energy(self, context: Context, name: str) -> float:
        self.ValidateContext(context)
        hook, total = getattr(self, name, None), context._store.scalar(0.0)
        if hook is not None:
            total = total + hook(context)
        return float(total) if isinstance(total, float) else total

    def EvalPotentialEnergy(self, context: Context) -> float:
        """Potential energy [J]; 0 for a diagram, as in Drake: ask its systems."""
        return self._energy(context, "DoCalcPotentialEnergy")

    def EvalKineticEnergy(self, context: Context) -> float:
        """Kinetic energy [J]; 0 for a diagram, as in Drake: ask its systems."""
        return self._energy(context, "DoCalcKineticEnergy")

    CalcPotentialEnergy, CalcKineticEnergy = EvalPotentialEnergy, EvalKineticEnergy

    def CalcConservativePower(self, context: Context) -> float:
        """Power of conservative forces [W]; 0 for a diagram, as in Drake: ask its systems."""
        return self._energy(context, "DoCalcConservativePower")

    def CalcNonConservativePower(self, context: Context) -> float:
        """Power of non-conservative forces [W]; 0 for a diagram, as in Drake: ask its systems."""
        return self._energy(context, "DoCalcNonConservativePower")

    # The rest.

    def GetWitnessFunctions(self, context: Context) -> list:
        """Witness functions that are active now."""
        self.ValidateContext(context)
        store = context._store
        found: list = []
        for m in _evaluate.leaves_under(store, context._node):
            if store.systems[m]._has_witnesses():
                found += _witnesses_of(store.systems[m], store.context(m))
        return found

    @checked
    def Accept(self, v: SystemVisitor) -> None:
        """Shows itself to a visitor."""
        v.VisitSystem(self)

    def num_constraints(self) -> int:
        """How many constraints are declared."""
        return 0

    def Clone(self) -> Self:
        """A copy of the system, through its scalar converter.

        Raises:
            RuntimeError: it cannot be converted.
        """
        return self._clone()

    def __reduce_ex__(self, protocol: SupportsIndex) -> str | tuple:
        raise TypeError(f"cannot pickle {type(self).__name__!r} object")


def _witnesses_of(system: LeafEvents, context: Context) -> Sequence[WitnessFunction]:
    """What `DoGetWitnessFunctions` of a leaf system returns, which people override."""
    found = system.DoGetWitnessFunctions(context)
    if not isinstance(found, (list, tuple)) or not all([isinstance(witness, WitnessFunction) for witness in found]):
        raise (TypeError if found is None else RuntimeError)(
            f"DoGetWitnessFunctions() of {system._describe()} must return a list of what MakeWitnessFunction() made; "
            f"it returned {found!r}."
        )
    return found


class SystemVisitor:
    """Override `VisitSystem` and `VisitDiagram`; `System.Accept` calls one of them."""

    def VisitSystem(self, system: System) -> None:
        """Called for a leaf system."""
        raise NotImplementedError("SystemVisitor.VisitSystem() must be overridden.")

    def VisitDiagram(self, diagram: Diagram) -> None:
        """Called for a diagram."""
        raise NotImplementedError("SystemVisitor.VisitDiagram() must be overridden.")
