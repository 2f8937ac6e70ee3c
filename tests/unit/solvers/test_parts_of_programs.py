"""A program is put together from parts: each works without a program, and a program shows the calls of all of them."""

import inspect
import re
import sys
import typing

import numpy as np
import pytest

from sheldrake.common._parts import home_of
from sheldrake.solvers import LinearCost, MathematicalProgram, QuadraticCost
from sheldrake.solvers._program.bindings import ProgramBindings
from sheldrake.solvers._program.cones import ProgramCones
from sheldrake.solvers._program.constraints import ProgramConstraints
from sheldrake.solvers._program.costs import ProgramCosts
from sheldrake.solvers._program.epigraphs import ProgramEpigraphs
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.polynomials import ProgramPolynomials
from sheldrake.solvers._program.variables import ProgramVariables
from sheldrake.symbolic import Variable

PARTS = (
    ProgramVariables,
    ProgramBindings,
    ProgramCosts,
    ProgramConstraints,
    ProgramCones,
    ProgramEpigraphs,
    ProgramPolynomials,
)


@pytest.mark.parametrize("part", PARTS)
def test_a_program_shows_the_calls_of_each_part(part):
    calls = [name for name in vars(part) if name[0].isupper()]
    assert calls
    for name in calls:
        assert home_of(MathematicalProgram, name) is part
        shown = getattr(MathematicalProgram, name)
        assert shown.__doc__ == getattr(part, name).__doc__
        assert inspect.signature(shown) == inspect.signature(getattr(part, name))
        assert shown.__qualname__ == f"MathematicalProgram.{name}"


@pytest.mark.skipif(not hasattr(typing, "get_overloads"), reason="before Python 3.11 overloads leave no trace")
@pytest.mark.parametrize("part", PARTS)
def test_what_editors_are_told_is_what_calls_take(part):
    module = sys.modules[part.__module__]
    for name, call in vars(part).items():
        told = typing.get_overloads(call) if inspect.isfunction(call) else []
        if not told:
            continue
        ways = getattr(
            module,
            re.search(rf"(_[A-Z_]+)\.choose\(\"{name}|\"{name}\", (_[A-Z_]+)", inspect.getsource(call)).expand(r"\1\2"),
        )
        taken = {tuple((n, n in way.defaults) for n in way.names) for way in ways}
        parameters = [list(inspect.signature(f).parameters.values())[1:] for f in told]
        assert {tuple((p.name, p.default is not p.empty) for p in of) for of in parameters} == taken, name


def test_variables_alone():
    variables = ProgramVariables()
    x = variables.NewContinuousVariables(3, "x")
    variables.SetInitialGuess(x, [1.0, 2.0, 3.0])
    variables.SetVariableScaling(x[2], 5.0)
    assert variables.remove(x[1]) == 1
    assert list(variables.decision_variables()) == [x[0], x[2]]
    assert variables.initial_guess().tolist() == [1.0, 3.0]
    assert variables.GetVariableScaling() == {1: 5.0}
    assert variables.is_decision(x[0]) and not variables.is_decision(x[1])


def test_bindings_alone_know_kinds_values_and_what_is_in_use():
    variables = ProgramVariables()
    bindings = ProgramBindings(variables)
    x = variables.NewContinuousVariables(2, "x")
    costs = ProgramCosts(bindings)
    linear = costs.AddLinearCost([1.0, 2.0], 3.0, x)
    costs.AddCost(x[0] * x[0])
    assert bindings.of(LinearCost) == [linear]
    assert len(bindings.of(QuadraticCost)) == 1
    assert bindings.EvalBinding(linear, [1.0, 1.0]) == pytest.approx([6.0])
    with pytest.raises(ValueError, match="associated"):
        bindings.RemoveDecisionVariable(x[1])
    bindings.RemoveCost(linear)
    assert bindings.RemoveDecisionVariable(x[1]) == 1
    with pytest.raises(RuntimeError, match="not a decision variable"):
        costs.AddLinearCost([1.0], 0.0, [Variable("other")])


def test_a_copy_has_lists_of_its_own():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2, "x")
    prog.AddLinearCost(x[0] + x[1])
    bound_before = prog.AddConstraint  # calls are kept by the object that they were asked of
    copy = prog.Clone()
    bound_before(x[0] >= 1)
    copy.AddConstraint(x[0] >= 2)
    copy.AddConstraint(x[1] >= 3)
    assert len(prog.GetAllConstraints()) == 1
    assert len(copy.GetAllConstraints()) == 2
    assert parts_of(copy).variables is not parts_of(prog).variables
    y = copy.NewContinuousVariables(1, "y")
    assert prog.num_vars() == 2 and copy.num_vars() == 3
    assert copy.FindDecisionVariableIndex(y[0]) == 2


def test_errors_name_the_call_of_the_program():
    prog = MathematicalProgram()
    with pytest.raises(TypeError, match=r"^AddLinearCost\(\): incompatible function arguments"):
        prog.AddLinearCost("x")
    with pytest.raises(TypeError, match=r"MathematicalProgram\.CheckSatisfied\(\)"):
        prog.CheckSatisfied()
    with pytest.raises(TypeError, match=r"MathematicalProgram\.num_vars\(\)"):
        prog.num_vars(np.zeros(1))
