"""A system written as symbolic expressions."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.systems.framework import BasicVector, LeafSystem
from sheldrake.systems.framework._index import Ticket
from sheldrake.systems.primitives._state_space import declare_motion

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sheldrake.common._types import Symbolics
    from sheldrake.common.kernel import Kernel
    from sheldrake.symbolic._expression import Expression
    from sheldrake.symbolic._variable import Variable
    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._values import ContinuousState, DiscreteValues


@checked
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
        time: Variable | None = None,
        state: Sequence[Variable] | np.ndarray = (),
        input: Sequence[Variable] | np.ndarray = (),
        parameter: Sequence[Variable] | np.ndarray = (),
        dynamics: Symbolics = (),
        output: Symbolics = (),
        time_period: float = 0.0,
    ):
        super().__init__()
        self._time = time
        self._variables = [_flat(v) for v in (state, input, parameter)]
        self._dynamics, self._output = _flat(dynamics), _flat(output)
        self._period = float(time_period)
        n = len(self._variables[0])
        if len(self._dynamics) != n:
            raise RuntimeError(f"SymbolicVectorSystem: {n} states need as many dynamics, not {len(self._dynamics)}.")
        everything = [v for group in ([] if time is None else [time], *self._variables) for v in group]
        self._functions = [_Function(e, everything, self._variables[1]) for e in (self._dynamics, self._output)]
        motion, shown = self._kernels()
        if self._variables[1]:
            self.DeclareVectorInputPort("u0", len(self._variables[1]))
        if self._variables[2]:
            self.DeclareNumericParameter(BasicVector(np.zeros(len(self._variables[2]))))
        declare_motion(self, SymbolicVectorSystem, n, motion)
        if self._output:
            self.DeclareVectorOutputPort("y0", len(self._output), self._calc, self._output_tickets())
            self._compute_natively(0, shown)
            self._output_models[0] = {"tape_model": self._tapes[1]}

    def _kernels(self) -> list[Kernel | None]:
        """What computes dynamics and output on doubles; None for those that only Python can evaluate."""
        from sheldrake.symbolic._tape import tape_of
        from sheldrake.systems.primitives._kernels import expressions

        state, inputs, parameters = self._variables
        variables = [self._time, *state, *parameters, *inputs]
        self._tapes = [tape_of(function.expressions, variables, function.used) for function in self._functions]
        sizes = [len(tape.constant) + len(variables) + len(tape.operation) for tape in self._tapes if tape is not None]
        self._declare_scratch(max(sizes, default=0))
        return [
            None if tape is None else expressions.of_state_and_input if f.by_inputs else expressions.of_state
            for f, tape in zip(self._functions, self._tapes)
        ]

    def _kernel_models(self, root: Any) -> dict:
        return {"tape_model": self._tapes[0]}

    def _explain_status(self, status: int, context: Context) -> Exception:
        """What Python says of the numbers that a kernel has left."""
        ends = np.cumsum([0, 1, *(len(self._variables[k]) for k in (0, 2, 1))])
        work = context._store.scratch(context._node)
        t, x, p, u = (work[a:b].tolist() for a, b in itertools.pairwise(ends))
        for function in self._functions:
            try:
                function.at_floats([*(t if self._time is not None else ()), *x, *u, *p])
            except Exception as error:
                return error
        return super()._explain_status(status, context)

    def _output_tickets(self) -> set[int]:
        used = self._functions[1].used
        tickets = {Ticket.NOTHING}
        if self._time is not None and self._time.get_id() in used:
            tickets.add(Ticket.TIME)
        for group, ticket in zip(self._variables, (Ticket.ALL_STATE, Ticket.ALL_INPUTS, Ticket.PN)):
            if any(v.get_id() in used for v in group):
                tickets.add(ticket)
        return tickets

    def dynamics_for_variable(self, var: Variable) -> Expression:
        """The expression for a state variable.

        Raises:
            IndexError: it is none.
        """
        for state, expression in zip(self._variables[0], self._dynamics):
            if state.get_id() == var.get_id():
                return expression
        raise IndexError(f"SymbolicVectorSystem: {var} is no state variable.")

    def _numbers(self, context: Context, by_inputs: bool) -> list:
        """Time, state, input and parameters in a context, as `_all_variables`; the input only if it counts."""
        state, inputs, parameters = self._variables
        numbers = [] if self._time is None else [context.get_time()]
        if state:
            x = context.get_discrete_state_vector() if self._period > 0 else context.get_continuous_state_vector()
            numbers += x.CopyToVector().tolist()
        if inputs and by_inputs:
            read = context._reads.get(0)  # what a port that was asked before leaves
            numbers += (self.get_input_port(0).Eval(context) if read is None else read()).tolist()
        elif inputs:
            numbers += [0.0] * len(inputs)
        if parameters:
            numbers += context.get_numeric_parameter(0).CopyToVector().tolist()
        return numbers

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._value_of(self._functions[1], context))

    def _update(self, context: Context, x_next: DiscreteValues) -> None:
        x_next.set_value(self._value_of(self._functions[0], context))

    def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
        derivatives.SetFromVector(self._value_of(self._functions[0], context))

    def _value_of(self, function: _Function, context: Context) -> Any:
        numbers = self._numbers(context, function.by_inputs)
        return function.at_floats(numbers) if self._scalar is float else function.at(numbers)

    def _motion_and_slopes(
        self, context: Context, x: np.ndarray, u: np.ndarray, i: int | None, j: int | None
    ) -> tuple[np.ndarray, np.ndarray]:
        functions = [f for f, wanted in zip(self._functions, (len(x), j is not None)) if wanted]
        numbers = self._numbers(context, i is not None or any(f.by_inputs for f in functions))
        begin = self._time is not None
        end = begin + len(self._variables[0]) + (len(self._variables[1]) if i is not None else 0)
        values = [f.at(numbers) for f in functions]
        slopes = [f.slopes(numbers)[:, begin:end] for f in functions]
        return (np.concatenate(values), np.concatenate(slopes)) if functions else (u[:0], np.zeros((0, end - begin)))


def _flat(given: Any) -> list:
    if isinstance(given, (list, tuple)) and not any([isinstance(e, (list, tuple, np.ndarray)) for e in given]):
        return list(given)
    return list(np.ravel(np.array(given, object)))


class _Function:
    """Expressions as a function of all variables of a system.

    Args:
        expressions: Expressions, variables or numbers.
        variables: Time, state, input, parameters.
        inputs: Those of the input.

    Attributes:
        used: Ids of the variables that are in the expressions.
    """

    def __init__(self, expressions: list, variables: list, inputs: list):
        from sheldrake.symbolic._compiled import Compiled
        from sheldrake.symbolic._expression import Expression
        from sheldrake.symbolic._traverse import variables_of

        self.expressions = [Expression(e) for e in expressions]
        self._variables, self._plain = variables, Compiled(self.expressions, variables)
        self._slopes: Any = None
        self.used = {v.get_id() for e in self.expressions for v in variables_of(e)}
        self.by_inputs = any([v.get_id() in self.used for v in inputs])

    def at(self, numbers: list) -> Any:
        """The values, of floats, dual numbers or expressions."""
        from sheldrake.common._scalars import autodiff_class, expression_class

        is_used = [v.get_id() in self.used for v in self._variables]
        kinds = {type(x) for x, used in zip(numbers, is_used) if used}
        if autodiff_class() in kinds:
            plain = [x.value() if hasattr(x, "derivatives") else float(x) for x in numbers]
            duals = [(k, x.derivatives()) for k, x in enumerate(numbers) if hasattr(x, "derivatives")]
            moving = [(k, d) for k, d in duals if len(d)]
            values = self._plain(plain)
            if not moving:
                return [autodiff_class()(v) for v in values]
            slopes = self.slopes(plain)[:, [k for k, _ in moving]] @ np.array([d for _, d in moving])
            return [autodiff_class()(v, slope) for v, slope in zip(values, slopes)]
        if not all(issubclass(T, (float, int)) for T in kinds):
            at = {v: expression_class()(x) for v, x, used in zip(self._variables, numbers, is_used) if used}
            return [e.Substitute(at) for e in self.expressions]
        return self.at_floats(numbers)

    def at_floats(self, numbers: list[float]) -> np.ndarray:
        """The values, of numbers that are floats."""
        total = sum(numbers)
        if total != total:  # a number is nan, or two are infinite
            for v, x in zip(self._variables, numbers):
                if x != x and v.get_id() in self.used:
                    raise RuntimeError(f"SymbolicVectorSystem: the value of {v} is nan.")
        return np.array(self._plain(numbers), dtype=float)

    def slopes(self, numbers: list[float]) -> np.ndarray:
        """Derivatives by all variables, shape (expressions, variables)."""
        from sheldrake.symbolic import Jacobian
        from sheldrake.symbolic._compiled import Compiled

        shape = len(self.expressions), len(self._variables)
        if self._slopes is None:
            self._slopes = Compiled(Jacobian(self.expressions, self._variables).ravel().tolist(), self._variables)
        return np.array(self._slopes(numbers), dtype=float).reshape(shape)
