"""Linear approximations of systems, and what they tell about control."""

from __future__ import annotations

import operator
from typing import TYPE_CHECKING, Any, SupportsIndex

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.systems.framework import InputPortSelection, OutputPortSelection, PortDataType, System
from sheldrake.systems.framework._engine.linear_rows import motion_by_rows, split
from sheldrake.systems.primitives._affine_system import AffineSystem, LinearSystem

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context


@checked
def Linearize(
    system: System,
    context: Context,
    input_port_index: InputPortSelection | SupportsIndex = InputPortSelection.kUseFirstInputIfItExists,
    output_port_index: OutputPortSelection | SupportsIndex = OutputPortSelection.kUseFirstOutputIfItExists,
    equilibrium_check_tolerance: float = 1e-6,
) -> LinearSystem:
    """The linear system of deviations from an equilibrium.

    Args:
        system: Converts to AutoDiffXd; its state is continuous, or discrete with one period.
        context: The equilibrium; the chosen input has a value.
        input_port_index: Which input, or an InputPortSelection.
        output_port_index: Which output, or an OutputPortSelection.
        equilibrium_check_tolerance: How far from standing still the equilibrium may be.

    Raises:
        RuntimeError: `context` is no equilibrium, or the system does not convert.
    """
    values, slopes, x0, _, period = motion_and_slopes(system, context, input_port_index, output_port_index)
    n = len(x0)
    f = values[:n] - x0 if period else values[:n]
    if n and np.abs(f).max() > equilibrium_check_tolerance:
        raise RuntimeError(
            "The nominal operating point (x0,u0) is not an equilibrium point of the system.  Without additional "
            "information, a time-invariant linearization of this system is not well defined."
        )
    A, B, C, D = slopes[:n, :n], slopes[:n, n:], slopes[n:, :n], slopes[n:, n:]
    return LinearSystem._of(A, B, np.zeros(n), C, D, np.zeros(len(C)), period)


@checked
def FirstOrderTaylorApproximation(
    system: System,
    context: Context,
    input_port_index: Any = InputPortSelection.kUseFirstInputIfItExists,
    output_port_index: OutputPortSelection | SupportsIndex = OutputPortSelection.kUseFirstOutputIfItExists,
) -> AffineSystem:
    """The affine system that agrees with a system to first order; arguments as of `Linearize`."""
    values, slopes, x0, u0, period = motion_and_slopes(system, context, input_port_index, output_port_index)
    n = len(x0)
    A, B, C, D = slopes[:n, :n], slopes[:n, n:], slopes[n:, :n], slopes[n:, n:]
    return AffineSystem._of(A, B, values[:n] - A @ x0 - B @ u0, C, D, values[n:] - C @ x0 - D @ u0, period)


def _chosen(
    selection: InputPortSelection | OutputPortSelection | SupportsIndex,
    ports: list,
    none: InputPortSelection | OutputPortSelection,
    first: InputPortSelection | OutputPortSelection,
) -> int | None:
    if selection is none:
        return None
    if selection is first:
        vector = [i for i, port in enumerate(ports) if port.data_type is PortDataType.kVectorValued]
        return 0 if ports and 0 in vector else None
    return operator.index(selection)


def motion_and_slopes(
    system: System,
    context: Context,
    input_index: InputPortSelection | SupportsIndex,
    output_index: OutputPortSelection | SupportsIndex,
) -> tuple:
    """x' or x+ and y, their derivatives by x and u, x, u, and the period [s], 0 for continuous state."""
    system.ValidateContext(context)
    periods = system._periodic_discrete()
    if not context.has_only_continuous_state() and not context.is_stateless():
        if not context.has_only_discrete_state() or len(periods) != 1:
            raise RuntimeError(
                f"Linearize: {system._describe()} must have only continuous state, or only "
                "discrete state with one period."
            )
    period = periods.pop()[0] if context.has_only_discrete_state() else 0.0
    i = _chosen(input_index, system._inputs, InputPortSelection.kNoInput, InputPortSelection.kUseFirstInputIfItExists)
    j = _chosen(
        output_index, system._outputs, OutputPortSelection.kNoOutput, OutputPortSelection.kUseFirstOutputIfItExists
    )
    x0 = (
        np.concatenate([g.CopyToVector() for g in context.get_discrete_state().get_data()])
        if period
        else context.get_continuous_state_vector().CopyToVector()
    )
    u0 = system.get_input_port(i).Eval(context) if i is not None else np.empty(0)
    n = len(x0)
    values, slopes = (
        system._motion_and_slopes(context, x0, u0, i, j)
        or motion_by_rows(system, context, n, i, j, period)
        or _by_conversion(system, context, x0, u0, i, j, period)
    )
    return values, slopes, x0, u0, period


def _by_conversion(
    system: System, context: Context, x0: np.ndarray, u0: np.ndarray, i: int | None, j: int | None, period: float
) -> tuple[np.ndarray, np.ndarray]:
    """The same from the system on AutoDiffXd."""
    from sheldrake.autodiffutils import AutoDiffXd

    dual = system.ToAutoDiffXd()
    other = dual.CreateDefaultContext()
    other.SetTimeStateAndParametersFrom(context)
    for k in range(system.num_input_ports()):
        port = system.get_input_port(k)
        if k != i and port.HasValue(context):
            if port.get_data_type() is PortDataType.kVectorValued:
                dual.get_input_port(k).FixValue(other, port.Eval(context))
            else:
                dual.get_input_port(k).FixValue(other, port.EvalAbstract(context))
    n, m = len(x0), len(u0)
    variables = np.array([AutoDiffXd(v, d) for v, d in zip([*x0, *u0], np.eye(n + m))], object)
    if i is not None:
        dual.get_input_port(i).FixValue(other, variables[n:])
    found: list[Any] = []
    if period:
        at = 0
        for g in range(other.num_discrete_state_groups()):
            size = other.get_discrete_state(g).size()
            other.SetDiscreteState(g, variables[at : at + size])
            at += size
        found += [g.CopyToVector() for g in dual.EvalUniquePeriodicDiscreteUpdate(other).get_data()]
    elif n:
        other.SetContinuousState(variables[:n])
        found.append(dual.EvalTimeDerivatives(other).CopyToVector())
    if j is not None:
        found.append(dual.get_output_port(j).Eval(other))
    return split(np.concatenate(found) if found else np.empty(0), n + m)


@checked
def ControllabilityMatrix(linear_system: LinearSystem, /) -> np.ndarray:
    """[B, A B, ..., A^(n-1) B], shape (n, n m)."""
    A, block, blocks = linear_system.A(), linear_system.B(), []
    for _ in range(linear_system.num_states()):
        blocks.append(block)
        block = A @ block
    return np.hstack(blocks)


@checked
def ObservabilityMatrix(linear_system: LinearSystem, /) -> np.ndarray:
    """[C; C A; ...; C A^(n-1)], shape (n k, n)."""
    A, block, blocks = linear_system.A(), linear_system.C(), []
    for _ in range(linear_system.num_states()):
        blocks.append(block)
        block = block @ A
    return np.vstack(blocks)


def _rank(matrix: np.ndarray, threshold: float | None) -> int:
    s = np.linalg.svd(matrix, compute_uv=False)
    limit = threshold if threshold is not None else max(matrix.shape) * np.finfo(float).eps
    return int(np.sum(s > limit * np.max(s, initial=0.0)))


@checked
def IsControllable(sys: LinearSystem, threshold: float | None = None) -> bool:
    """Whether input can steer every state."""
    return _rank(ControllabilityMatrix(sys), threshold) == sys.num_states()


@checked
def IsObservable(sys: LinearSystem, threshold: float | None = None) -> bool:
    """Whether output tells every state."""
    return _rank(ObservabilityMatrix(sys), threshold) == sys.num_states()


def _hautus(A: np.ndarray, B: np.ndarray, discrete: bool, threshold: float | None) -> bool:
    """Whether every mode that does not die out is reached by B (Hautus's test)."""
    for mode in np.linalg.eigvals(A):
        alive = abs(mode) >= 1.0 if discrete else mode.real >= 0.0
        if alive and _rank(np.hstack([mode * np.eye(len(A)) - A, B]), threshold) < len(A):
            return False
    return True


@checked
def IsStabilizable(sys: LinearSystem, threshold: float | None = None) -> bool:
    """Whether input can bring every state to rest that does not come to rest by itself."""
    return _hautus(sys.A(), sys.B(), sys.time_period() > 0, threshold)


@checked
def IsDetectable(sys: LinearSystem, threshold: float | None = None) -> bool:
    """Whether output tells every state that does not come to rest by itself."""
    return _hautus(sys.A().T, sys.C().T, sys.time_period() > 0, threshold)
