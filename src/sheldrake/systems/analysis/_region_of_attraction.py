"""Regions of attraction of polynomial systems, by sums of squares."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._options import Options
from sheldrake.math import BalanceQuadraticForms, RealContinuousLyapunovEquation
from sheldrake.symbolic import Expression, Polynomial, Variable, Variables

if TYPE_CHECKING:
    from sheldrake.solvers._program.program import MathematicalProgram
    from sheldrake.systems.framework import Context, System

_STANDS_STILL = 1e-14


class RegionOfAttractionOptions(Options):
    """Options of `RegionOfAttraction`.

    Attributes:
        lyapunov_candidate: The function whose level sets are looked at; 0: one of the linearized system.
        state_variables: What the states are called in the candidate and in the answer; empty: x(0), x(1), and so on.
        use_implicit_dynamics: Reads the dynamics as g(x, x') = 0, which may be polynomial where x' = f(x) is rational.
        solver_id: Which solver; None: one is chosen.
        solver_options: Options of the solver.
        certificate_tolerance: How far what a solver finds may miss the equations between coefficients and the cones,
            at most; finite and not negative. It is no option of the solver.
    """

    lyapunov_candidate: Any = Expression(0.0)
    state_variables: Any = np.array([], dtype=object)
    use_implicit_dynamics: bool = False
    solver_id: Any = None
    solver_options: Any = None
    certificate_tolerance: float = 1e-6


@checked
def RegionOfAttraction(
    system: System, context: Context, options: RegionOfAttractionOptions | None = None
) -> Expression:
    """The largest level set of a Lyapunov function that is certainly attracted by a fixed point.

    On its boundary, and outside near it, the function may stop decreasing; within, it decreases everywhere: a
    statement about polynomials (Parrilo, 2000), shown by sums of squares.

    Args:
        system: Has continuous state only, converts to symbolic expressions, and its dynamics are polynomial.
        context: The fixed point; inputs that matter have values.
        options: Everything else.

    Returns:
        V(x), with V <= 1 in the region.

    Raises:
        RuntimeError: the dynamics are not polynomial, `context` is no fixed point, the candidate is not positive there
            or uses other variables, or no largest level set is found: the region may be everything. Or a solver's
            answer misses the program by more than the tolerance of certificates, or this is no tolerance.
    """
    options = options or RegionOfAttractionOptions()
    if not 0.0 <= options.certificate_tolerance < np.inf:
        raise RuntimeError(
            f"RegionOfAttraction(): certificate_tolerance must be finite and not negative, not "
            f"{options.certificate_tolerance}."
        )
    _check(system, context)
    n, x0 = context.num_continuous_states(), context.get_continuous_state_vector().CopyToVector()
    names = _state_variables(options, n)
    dynamics = _Dynamics(system, context, options.use_implicit_dynamics)
    if Expression(options.lyapunov_candidate).EqualTo(Expression(0.0)):
        V, T = _of_linearization(system, context, dynamics.x)
    else:
        V, T = _given(options, names, dynamics.x, x0), np.eye(n)
    if options.use_implicit_dynamics:
        rho = _largest_level(V, T, dynamics, options)
    else:
        rho = _largest_level_of_flow(V, T, dynamics, options)
    deviation = {a: Expression(b) - float(c) for a, b, c in zip(dynamics.x, names, x0)}
    return V.Substitute(deviation) / rho


def _check(system: System, context: Context) -> None:
    system.ValidateContext(context)
    if not context.has_only_continuous_state() or not context.num_continuous_states():
        raise RuntimeError(f"RegionOfAttraction(): {system._describe()} must have continuous state, and no other.")
    worst = np.abs(system.EvalTimeDerivatives(context).CopyToVector()).max()
    if not worst <= _STANDS_STILL:
        raise RuntimeError(
            f"RegionOfAttraction(): the context is not a fixed point of {system._describe()}: the largest time "
            f"derivative is {worst:g}."
        )


def _state_variables(options: RegionOfAttractionOptions, n: int) -> list[Variable]:
    names = list(np.ravel(options.state_variables))
    if len(names) not in (0, n):
        raise RuntimeError(
            f"RegionOfAttraction(): there are {len(names)} state_variables, the system has {n} continuous states."
        )
    return names or [Variable(f"x({i})") for i in range(n)]


class _Dynamics:
    """f(x), or g(x, x'), as expressions of the deviation x from the fixed point."""

    def __init__(self, system: System, context: Context, implicit: bool):
        n, x0 = context.num_continuous_states(), context.get_continuous_state_vector().CopyToVector()
        self.x = np.array([Variable(f"x({i})") for i in range(n)])
        self.xdot = np.array([Variable(f"xdot({i})") for i in range(n)])
        symbolic = system.ToSymbolic()
        symbols = symbolic.CreateDefaultContext()
        symbols.SetTimeStateAndParametersFrom(context)
        symbolic.FixInputPortsFrom(system, context, symbols)
        symbols.SetContinuousState(np.array([Expression(a) + float(b) for a, b in zip(self.x, x0)]))
        if implicit:
            derivatives = symbolic.AllocateTimeDerivatives()
            derivatives.SetFromVector(np.array([Expression(v) for v in self.xdot]))
            self.equations = symbolic.CalcImplicitTimeDerivativesResidual(symbols, derivatives)
        else:
            self.flow = np.array([Expression(v) for v in symbolic.EvalTimeDerivatives(symbols).CopyToVector()])


def _of_linearization(system: System, context: Context, x: np.ndarray) -> tuple[Expression, np.ndarray]:
    """V of A'P + PA = -1, and the coordinates in which V and its derivative are equally round."""
    from sheldrake.systems.framework import InputPortSelection, OutputPortSelection
    from sheldrake.systems.primitives import Linearize

    A = Linearize(system, context, InputPortSelection.kNoInput, OutputPortSelection.kNoOutput).A()
    if not np.linalg.eigvals(A).real.max() < 0.0:
        raise RuntimeError(f"RegionOfAttraction(): {system._describe()} is not stable at the fixed point.")
    Q = np.eye(len(x))
    P = RealContinuousLyapunovEquation(A, Q)
    return x.dot(P).dot(x), BalanceQuadraticForms(P, Q)


def _given(options: RegionOfAttractionOptions, names: list, x: np.ndarray, x0: np.ndarray) -> Expression:
    """The candidate, as a function of the deviation."""
    candidate = Expression(options.lyapunov_candidate)
    strangers = Variables(candidate.GetVariables()) - Variables(names)
    if len(strangers):
        raise RuntimeError(
            f"RegionOfAttraction(): lyapunov_candidate has the variables {strangers}, which are not among the "
            f"state_variables {Variables(names)}."
        )
    V = candidate.Substitute({b: Expression(a) + float(c) for a, b, c in zip(x, names, x0)})
    return _checked_positive(V, x, options)


def _checked_positive(V: Expression, x: np.ndarray, options: RegionOfAttractionOptions) -> Expression:
    from sheldrake.solvers import MathematicalProgram

    program = MathematicalProgram()
    program.AddIndeterminates(x)
    program.AddSosConstraint(Polynomial(V, Variables(x)))
    if not _solved(program, options).is_success():
        raise RuntimeError(f"RegionOfAttraction(): lyapunov_candidate {V} is not shown to be positive (not SOS).")
    return V


def _scaled(e: Expression, x: np.ndarray, T: np.ndarray) -> Expression:
    """An expression in x, in the coordinates y with x = T y, which are called x again."""
    return e.Substitute(dict(zip(x, T.dot(x)))) if not np.array_equal(T, np.eye(len(x))) else e


def _largest_level_of_flow(V: Expression, T: np.ndarray, dynamics: Any, options: RegionOfAttractionOptions) -> float:
    """The largest rho for which V' = 0 implies V >= rho or x = 0."""
    from sheldrake.solvers import MathematicalProgram

    x = dynamics.x
    program = MathematicalProgram()
    program.AddIndeterminates(x)
    rho = program.NewContinuousVariables(1, "rho")[0]
    level = Polynomial(_scaled(V, x, T), Variables(x))
    rate_text = _scaled(sum(V.Jacobian(x).ravel() * dynamics.flow), x, T)
    rate = Polynomial(rate_text.Expand(), Variables(x))
    degree = rate.TotalDegree()
    if _falls_near_zero(rate_text, x):
        multiplier = program.NewFreePolynomial(Variables(x), degree)
    else:  # then V' >= 0 must imply it
        multiplier, _ = program.NewSosPolynomial(Variables(x), degree + degree % 2)
    power = (multiplier.TotalDegree() + degree - level.TotalDegree()) // 2
    round_ = Polynomial(x.dot(x) ** power, Variables(x))
    slack = Polynomial({_one(): Expression(rho)})
    program.AddSosConstraint((level - slack) * round_ - multiplier * rate)
    program.AddLinearCost(-Expression(rho))
    return _level(program, rho, options)


def _largest_level(V: Expression, T: np.ndarray, dynamics: Any, options: RegionOfAttractionOptions) -> float:
    """The same, for x and x' with g(x, x') = 0."""
    from sheldrake.solvers import MathematicalProgram

    x, xdot = dynamics.x, dynamics.xdot
    both = Variables([*x, *xdot])
    program = MathematicalProgram()
    program.AddIndeterminates([*x, *xdot])
    rho = program.NewContinuousVariables(1, "rho")[0]
    level = Polynomial(_scaled(V, x, T), both)
    change = {**dict(zip(x, T.dot(x))), **dict(zip(xdot, T.dot(xdot)))}
    rate = Polynomial(sum(V.Jacobian(x).ravel() * xdot).Substitute(change).Expand(), both)
    equations = [Polynomial(Expression(e).Substitute(change).Expand(), both) for e in dynamics.equations]
    degree = max(e.TotalDegree() for e in equations)
    power = (degree + 1) // 2 + (level.TotalDegree() - 2) // 2
    total = level.TotalDegree() + 2 * power
    proof = (level - Polynomial({_one(): Expression(rho)})) * Polynomial(x.dot(x) ** power, both)
    proof = proof - program.NewFreePolynomial(both, total - rate.TotalDegree()) * rate
    for equation in equations:
        proof = proof - program.NewFreePolynomial(both, total - equation.TotalDegree()) * equation
    program.AddSosConstraint(proof)
    program.AddLinearCost(-Expression(rho))
    return _level(program, rho, options)


def _one() -> Any:
    from sheldrake.symbolic import Monomial

    return Monomial()


def _falls_near_zero(rate: Expression, x: np.ndarray) -> bool:
    """Whether the Hessian of V' at 0 is negative definite."""
    zero = {v: 0.0 for v in x}
    hessian = np.array([[b.Evaluate(zero) for b in a.Jacobian(x).ravel()] for a in rate.Jacobian(x).ravel()])
    return bool(np.linalg.eigvalsh(0.5 * (hessian + hessian.T)).max() < -1e-8)


def _solved(program: MathematicalProgram, options: RegionOfAttractionOptions) -> Any:
    from sheldrake.solvers import MakeSolver, Solve

    solve = Solve if options.solver_id is None else MakeSolver(options.solver_id).Solve
    result = solve(program, None, options.solver_options)
    if result.is_success():
        x, tolerance = result.get_x_val(), options.certificate_tolerance
        missed = [b for b in program.GetAllConstraints() if not program.CheckSatisfied(b, x, tolerance)]
        if missed:
            raise RuntimeError(
                f"RegionOfAttraction(): what {result.get_solver_id().name()} found misses {len(missed)} constraints "
                f"({type(missed[0].evaluator()).__name__} and others) by more than certificate_tolerance = "
                f"{tolerance:g}. Let the solver be more exact, or take a larger tolerance."
            )
    return result


def _level(program: MathematicalProgram, rho: Variable, options: RegionOfAttractionOptions) -> float:
    result = _solved(program, options)
    if not result.is_success():
        raise RuntimeError(
            f"RegionOfAttraction(): no largest level set is found ({result.get_solver_id().name()} says "
            f"{result.get_solution_result().name}). The function may decrease everywhere: all states are attracted."
        )
    return float(result.GetSolution(rho))
