"""Programs of sums of squares as courses of robotics write them, set up and not solved, against Drake: CPU time [ms].

    python benchmarks/sums_of_squares.py [PROGRAM ...] [--rounds 5] [--calls]

Each line is a whole set-up: new variables, polynomials, their products and derivatives, constraints. `--calls` adds
lines of single calls as these programs make them. Both libraries take turns in one process.
"""

from __future__ import annotations

import argparse
import functools
import importlib
import pathlib
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from benchmarks.turns import machine, repeated_time, take_turns  # noqa: E402

PROGRAMS: dict[str, Callable[[Any], Any]] = {}
SECONDS_A_TURN = 0.1


def program(make: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Adds a function of the library that sets up a program and returns it."""
    PROGRAMS[make.__name__] = make
    return make


@program
def van_der_pol(lib: Any) -> Any:
    """The largest level of x' P x whose set is attracted by the origin of a Van der Pol oscillator in reverse time."""
    prog = lib.MathematicalProgram()
    x = prog.NewIndeterminates(2, "x")
    f = [-x[1], x[0] + (x[0] ** 2 - 1.0) * x[1]]
    V = x.dot(np.array([[1.5, -0.5], [-0.5, 1.0]]) @ x)
    Vdot = lib.Jacobian([V], x)[0].dot(f)
    rho = prog.NewContinuousVariables(1, "rho")[0]
    multiplier = prog.NewSosPolynomial(lib.Variables(x), 4)[0].ToExpression()
    free = prog.NewFreePolynomial(lib.Variables(x), 4).ToExpression()
    prog.AddSosConstraint(x.dot(x) ** 2 * (V - rho) - multiplier * Vdot)
    prog.AddSosConstraint(-Vdot - free * (1.2 - V) - 1e-3 * x.dot(x))
    prog.AddLinearCost(-rho)
    return prog


@program
def global_lyapunov(lib: Any) -> Any:
    """A Lyapunov function of degree four for a polynomial system of three states, everywhere."""
    prog = lib.MathematicalProgram()
    x = prog.NewIndeterminates(3, "x")
    f = [-(x[0] ** 3) - x[0] * x[2] ** 2, -x[1] - x[0] ** 2 * x[1], -x[2] + 3.0 * x[0] ** 2 * x[2] - 3.0 * x[2]]
    V = prog.NewSosPolynomial(lib.Variables(x), 4)[0].ToExpression()
    prog.AddLinearConstraint(V.Substitute({v: 0.0 for v in x}) == 0.0)
    prog.AddLinearConstraint(V.Substitute({v: 1.0 for v in x}) == 1.0)
    Vdot = V.Jacobian(x).dot(f)
    prog.AddSosConstraint(V - 1e-3 * x.dot(x))
    prog.AddSosConstraint(-Vdot * (x[2] ** 2 + 1.0))
    return prog


@program
def cubic_system(lib: Any) -> Any:
    """A Lyapunov function of degree six for a system of four states with cubic springs, by polynomials alone."""
    prog = lib.MathematicalProgram()
    x = prog.NewIndeterminates(4, "x")
    xs = lib.Variables(x)
    f = [
        lib.Polynomial(e, xs)
        for e in (
            x[2],
            x[3],
            -x[0] - x[0] ** 3 + 0.2 * x[1] - 0.5 * x[2],
            -(x[1] ** 3) + 0.2 * x[0] - x[1] - 0.5 * x[3],
        )
    ]
    V = prog.NewFreePolynomial(xs, 6)
    Vdot = sum((slope * g for slope, g in zip(V.Jacobian(x), f)), lib.Polynomial())
    radius = lib.Polynomial(x.dot(x), xs)
    multiplier = prog.NewSosPolynomial(xs, 4)[0]
    prog.AddSosConstraint(V - 1e-2 * radius)
    prog.AddSosConstraint(-Vdot - multiplier * (1.0 - radius) ** 2)
    return prog


@program
def value_iteration(lib: Any) -> Any:
    """A lower bound of the cost-to-go of a pendulum in sine and cosine: Bellman's inequality on the circle."""
    prog = lib.MathematicalProgram()
    z, u = prog.NewIndeterminates(3, "z"), prog.NewIndeterminates(1, "u")
    zu = np.concatenate((z, u))
    f = [z[1] * z[2], -z[0] * z[2], u[0] - 0.1 * z[2] + z[0]]
    J = prog.NewFreePolynomial(lib.Variables(z), 4)
    J_expr = J.ToExpression()
    cost = z[0] ** 2 + (1.0 - z[1]) ** 2 + z[2] ** 2 + 0.1 * u[0] ** 2
    circle = prog.NewFreePolynomial(lib.Variables(zu), 4).ToExpression()
    inside = prog.NewSosPolynomial(lib.Variables(zu), 4)[0].ToExpression()
    slope = J_expr.Jacobian(z).dot(f)
    prog.AddSosConstraint(
        cost + slope + circle * (z[0] ** 2 + z[1] ** 2 - 1.0) - inside * (9.0 - z[2] ** 2 - u[0] ** 2)
    )
    prog.AddLinearConstraint(J_expr.EvaluatePartial(dict(zip(z, [0.0, 1.0, 0.0]))) == 0.0)
    integral = J.Integrate(z[0], -1.0, 1.0).Integrate(z[1], -1.0, 1.0).Integrate(z[2], -3.0, 3.0)
    prog.AddLinearCost(-integral.ToExpression())
    return prog


@program
def matrix_of_polynomials(lib: Any) -> Any:
    """A contraction metric: matrices of polynomials in the state are positive semidefinite, as forms y' M(x) y."""
    prog = lib.MathematicalProgram()
    x, y = prog.NewIndeterminates(2, "x"), prog.NewIndeterminates(2, "y")
    f = np.array([-x[0] + x[1] - 0.5 * x[0] ** 3, -x[1] - x[0] * x[1] ** 2])
    A = lib.Jacobian(f, x)
    M = np.empty((2, 2), dtype=object)
    for i in range(2):
        for j in range(i + 1):
            M[i, j] = M[j, i] = prog.NewFreePolynomial(lib.Variables(x), 4, f"m{i}{j}").ToExpression()
    slopes = np.array([[e.Jacobian(x).dot(f) for e in row] for row in M])
    R = A.T @ M + M @ A + slopes
    prog.AddSosConstraint(y.dot(M @ y) - 0.1 * y.dot(y))
    prog.AddSosConstraint(-y.dot(R @ y) - 0.2 * y.dot(M @ y))
    bound = prog.NewSosPolynomial(lib.Variables(np.concatenate((x, y))), 4)[0]
    prog.AddEqualityConstraintBetweenPolynomials(bound, lib.Polynomial(y.dot(M @ y), lib.Variables([*x, *y])) + bound)
    return prog


def calls(lib: Any) -> dict[str, Callable[[], Any]]:
    """Single calls, by title, each on objects that exist."""
    prog = lib.MathematicalProgram()
    x = prog.NewIndeterminates(3, "x")
    xs = lib.Variables(x)
    V, S = prog.NewFreePolynomial(xs, 6), prog.NewSosPolynomial(xs, 4)[0]
    number = lib.Polynomial((1.0 + x[0] * x[1] - 0.5 * x[2] ** 2 + x[0]) ** 3, xs)
    a, b, m, l, g = lib.MakeVectorVariable(5, "a")
    V_expr, S_expr = V.ToExpression(), S.ToExpression()

    def fresh() -> Any:
        return x[0] ** 2 * x[1] + 2.0 * x[0] * x[2] - (x[0] + x[1]) ** 2

    return {
        "NewFreePolynomial(3, 6)": lambda: lib.MathematicalProgram().NewFreePolynomial(xs, 6),
        "NewSosPolynomial(3, 4)": lambda: lib.MathematicalProgram().NewSosPolynomial(xs, 4),
        "ToExpression": lambda: V.ToExpression(),
        "Polynomial(e, x), as written": lambda: lib.Polynomial(V_expr, xs),
        "Polynomial(e, x), products": lambda: lib.Polynomial(S_expr * (1.0 - x[0] ** 2) - x[1] * V_expr, xs),
        "V * numbers": lambda: V * number,
        "S * S": lambda: S * S,
        "numbers * numbers": lambda: number * number,
        "numbers ** 3": lambda: number**3,
        "V.Jacobian": lambda: V.Jacobian(x),
        "V - S": lambda: V - S,
        "fresh expression": fresh,
        "fresh expression, Jacobian": lambda: fresh().Jacobian(x),
        "fresh expression, Substitute": lambda: fresh().Substitute({x[0]: x[1] + a, x[1]: b}),
        "V_expr.Substitute": lambda: V_expr.Substitute({x[0]: x[1] + a, x[1]: b}),
        "V_expr.Jacobian": lambda: V_expr.Jacobian(x),
        "equality of polynomials": lambda: equality(lib, V, S),
        "AddSosConstraint(p, basis)": lambda: sos(lib, V, lib.MonomialBasis(xs, 3)),
        "AddSosConstraint(p)": lambda: sos(lib, V),
        "DecomposeLumpedParameters": lambda: lib.DecomposeLumpedParameters(
            [m * l**2 * a + m * g * l * lib.sin(x[0]) + b * x[1], (m + b) * a * x[2] + m * l * lib.cos(x[0])], [m, l, b]
        ),
    }


def equality(lib: Any, p: Any, q: Any) -> Any:
    """A program in which two polynomials are equal."""
    prog = program_of(lib, p - q)
    return prog.AddEqualityConstraintBetweenPolynomials(p, q)


def sos(lib: Any, p: Any, *basis: Any) -> Any:
    """A program in which a polynomial is a sum of squares."""
    return program_of(lib, p).AddSosConstraint(p, *basis)


def program_of(lib: Any, p: Any) -> Any:
    """A program with the variables of a polynomial."""
    prog = lib.MathematicalProgram()
    prog.AddIndeterminates(p.indeterminates())
    prog.AddDecisionVariables(list(p.decision_variables()))
    return prog


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", nargs="*", default=list(PROGRAMS))
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--calls", action="store_true")
    options = parser.parse_args()
    libraries = {name: importlib.import_module(f"{name}.all") for name in ("sheldrake", "pydrake")}
    print(machine())
    print(f"{'':40s}{'ours':>10s}{'Drake':>10s}{'ours/Drake':>12s}")
    lines = {
        title: {name: functools.partial(PROGRAMS[title], lib) for name, lib in libraries.items()}
        for title in options.programs
    }
    if options.calls:
        single = {name: calls(lib) for name, lib in libraries.items()}
        lines |= {title: {name: found[title] for name, found in single.items()} for title in single["pydrake"]}
    for title, contenders in lines.items():
        turns = {name: functools.partial(repeated_time, call, enough(call)) for name, call in contenders.items()}
        times = take_turns(turns, options.rounds)
        ours, drakes = (min(times[name]) / 1000.0 for name in libraries)
        print(f"{title:40s}{ours:10.3f}{drakes:10.3f}{ours / drakes:12.2f}", flush=True)


def enough(call: Callable[[], Any]) -> int:
    """How many calls make a turn that can be measured."""
    call()
    return max(1, min(2000, round(SECONDS_A_TURN * 1e6 / repeated_time(call, 1))))


if __name__ == "__main__":
    main()
