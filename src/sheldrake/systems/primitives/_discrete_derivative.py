"""Derivatives by differences of samples."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sheldrake.common._checked import checked
from sheldrake.systems.framework import Diagram, DiagramBuilder_, LeafSystem, State
from sheldrake.systems.framework._templates import on_scalar_of
from sheldrake.systems.framework._vector import as_vector
from sheldrake.systems.primitives._blocks import Multiplexer
from sheldrake.systems.primitives._kernels import blocks

if TYPE_CHECKING:
    from sheldrake.common._types import Scalars
    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._engine.memory import RootView


@checked
class DiscreteDerivative(LeafSystem):
    """(newest sample - the one before) / time step.

    Args:
        num_inputs: Size.
        time_step: Time step [s].
        suppress_initial_transient: Output zero until there are two samples.
    """

    _generic = True

    def __init__(self, num_inputs: int, time_step: float, suppress_initial_transient: bool = True):
        super().__init__()
        if not time_step > 0:
            raise RuntimeError(f"DiscreteDerivative: time_step must be positive, got {time_step}.")
        self._dt, self._suppress, n = float(time_step), bool(suppress_initial_transient), int(num_inputs)
        self.DeclareVectorInputPort("u", n)
        self.DeclareDiscreteState(n)
        self.DeclareDiscreteState(n)
        if self._suppress:
            self.DeclareDiscreteState(1)
        self.DeclareVectorOutputPort("dudt", n, blocks.difference_output)
        self.DeclarePeriodicDiscreteUpdateEvent(self._dt, 0.0, blocks.difference_next)

    def _kernel_models(self, root: RootView) -> dict:
        return {"difference_model": blocks.Difference.of(dt=self._dt, begins_with_zero=self._suppress)}

    def time_step(self) -> float:
        """Time step [s]."""
        return self._dt

    def suppress_initial_transient(self) -> bool:
        """Whether the output is zero until there are two samples."""
        return self._suppress

    def set_input_history(self, state: State | Context, u: Scalars, previous: Scalars | None = None) -> None:
        """Sets the newest sample and the one before (the same if not given), in a State or a context.

        Raises:
            RuntimeError: the state has not the groups of this system's, so is of another one.
        """
        discrete = state.get_mutable_discrete_state()
        if discrete.num_groups() != 2 + self._suppress:
            raise RuntimeError(
                f"DiscreteDerivative.set_input_history(): a state of {discrete.num_groups()} groups was not created "
                f"for {self._describe()}."
            )
        u = as_vector(u)
        discrete.set_value(0, u)
        discrete.set_value(1, u if previous is None else previous)
        if self._suppress:
            discrete.set_value(2, [2.0])


@checked
class StateInterpolatorWithDiscreteDerivative(Diagram):
    """Positions, and velocities by differences of samples of positions.

    Args:
        num_positions: Number of positions.
        time_step: Time step of the difference [s].
        suppress_initial_transient: Velocities are zero until there are two samples.
    """

    def __init__(self, num_positions: int, time_step: float, suppress_initial_transient: bool = True):
        super().__init__()
        builder = DiagramBuilder_[self._scalar]()
        n = int(num_positions)
        derivative = on_scalar_of(builder, DiscreteDerivative)
        self._derivative = builder.AddSystem(derivative(n, time_step, suppress_initial_transient))
        state = builder.AddSystem(on_scalar_of(builder, Multiplexer)([n, n]))
        index = builder.ExportInput(state.get_input_port(0), "position")
        builder.ConnectInput(index, self._derivative.get_input_port())
        builder.Connect(self._derivative.get_output_port(), state.get_input_port(1))
        builder.ExportOutput(state.get_output_port(), "state")
        builder.BuildInto(self)

    def suppress_initial_transient(self) -> bool:
        """Whether velocities are zero until there are two samples."""
        return self._derivative.suppress_initial_transient()

    def set_initial_position(
        self, context: Context | State | None = None, position: Scalars | None = None, *, state: State | None = None
    ) -> None:
        """Sets the position as if it had stood still, in a context or a State."""
        target: Any = context if state is None else state
        if not isinstance(target, State):
            target = self.GetSubsystemContext(self._derivative, target)
        self._derivative.set_input_history(target, position)
