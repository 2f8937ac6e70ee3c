"""A system written as symbolic expressions."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.systems.framework import BasicVector, LeafSystem
from sheldrake.systems.framework._index import Ticket


class SymbolicVectorSystem(LeafSystem):
    """x' = dynamics (or the next x), y = output, as expressions of time, state, input and parameters.

    Args:
        time: The variable that stands for time, or None.
        state: Variables of the state.
        input: Variables of the input.
        parameter: Variables of the parameters.
        dynamics: Expressions, one for each state.
        output: Expressions.
        time_period: Period of the discrete update [s]; 0: continuous.
    """

    _generic = True

    def __init__(
        self,
        time: Any = None,
        state: Any = (),
        input: Any = (),
        parameter: Any = (),
        dynamics: Any = (),
        output: Any = (),
        time_period: float = 0.0,
    ):
        super().__init__()
        self._time = time
        self._variables = [list(np.ravel(np.array(v, object))) for v in (state, input, parameter)]
        self._dynamics, self._output = (list(np.ravel(np.array(v, object))) for v in (dynamics, output))
        self._period = float(time_period)
        n = len(self._variables[0])
        if len(self._dynamics) != n:
            raise RuntimeError(f"SymbolicVectorSystem: {n} states need as many dynamics, not {len(self._dynamics)}.")
        if self._variables[1]:
            self.DeclareVectorInputPort("u0", len(self._variables[1]))
        if self._variables[2]:
            self.DeclareNumericParameter(BasicVector(np.zeros(len(self._variables[2]))))
        if n and self._period > 0:
            self.DeclareDiscreteState(n)
            self.DeclarePeriodicDiscreteUpdateEvent(self._period, 0.0, self._update)
        elif n:
            self.DeclareContinuousState(n)
        if self._output:
            self.DeclareVectorOutputPort("y0", len(self._output), self._calc, self._output_tickets())

    def _output_tickets(self) -> set[int]:
        used = {v.get_id() for e in self._output for v in _variables_of(e)}
        tickets = {Ticket.NOTHING}
        if self._time is not None and self._time.get_id() in used:
            tickets.add(Ticket.TIME)
        for group, ticket in zip(self._variables, (Ticket.ALL_STATE, Ticket.ALL_INPUTS, Ticket.PN)):
            if any(v.get_id() in used for v in group):
                tickets.add(ticket)
        return tickets

    def dynamics_for_variable(self, var: Any) -> Any:
        """The expression for a state variable.

        Raises:
            IndexError: it is none.
        """
        for state, expression in zip(self._variables[0], self._dynamics):
            if state.get_id() == var.get_id():
                return expression
        raise IndexError(f"SymbolicVectorSystem: {var} is no state variable.")

    def _values(self, context: Any, used: set[int]) -> dict:
        values = {}
        if self._time is not None:
            values[self._time] = context.get_time()
        state, inputs, parameters = self._variables
        if state:
            x = context.get_discrete_state_vector() if self._period > 0 else context.get_continuous_state_vector()
            values.update(zip(state, x.CopyToVector()))
        if inputs and any(v.get_id() in used for v in inputs):
            values.update(zip(inputs, self.get_input_port(0).Eval(context)))
        if parameters:
            values.update(zip(parameters, context.get_numeric_parameter(0).CopyToVector()))
        return {k: v for k, v in values.items() if k.get_id() in used}

    def _evaluate(self, context: Any, expressions: list) -> list:
        used = {v.get_id() for e in expressions for v in _variables_of(e)}
        values = self._values(context, used)
        return [_at(e, values) for e in expressions]

    def _calc(self, context: Any, output: Any) -> None:
        output.SetFromVector(self._evaluate(context, self._output))

    def _update(self, context: Any, x_next: Any) -> None:
        x_next.set_value(self._evaluate(context, self._dynamics))

    def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
        derivatives.SetFromVector(self._evaluate(context, self._dynamics))


def _variables_of(expression: Any) -> list:
    if hasattr(expression, "GetVariables"):
        return list(expression.GetVariables())
    return [expression] if hasattr(expression, "get_id") else []


def _at(expression: Any, values: dict) -> Any:
    """An expression where its variables have these values: floats, dual numbers or expressions."""
    from sheldrake.common._scalars import autodiff_class, expression_class

    if not isinstance(expression, expression_class()):
        expression = expression_class()(expression)
    if all(isinstance(v, (float, int)) for v in values.values()):
        return expression.Evaluate(values)
    if any(isinstance(v, autodiff_class()) for v in values.values()):
        plain = {k: v.value() if hasattr(v, "derivatives") else float(v) for k, v in values.items()}
        slopes: Any = 0.0
        for variable, value in values.items():
            if hasattr(value, "derivatives") and len(value.derivatives()):
                slopes = slopes + expression.Differentiate(variable).Evaluate(plain) * value.derivatives()
        number = expression.Evaluate(plain)
        return autodiff_class()(number) if np.ndim(slopes) == 0 else autodiff_class()(number, slopes)
    return expression.Substitute({k: expression_class()(v) for k, v in values.items()})
