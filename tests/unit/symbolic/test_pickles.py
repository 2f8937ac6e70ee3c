"""What comes out of a pickle of variables, expressions and formulas, here and in another process."""

import os
import pickle
import subprocess
import sys

import pytest

from sheldrake import symbolic as sym
from sheldrake.symbolic import Expression, Formula, Polynomial, RationalFunction, Variable, Variables

x, y = Variable("x"), Variable("y")
b = Variable("b", Variable.Type.BOOLEAN)

EXPRESSIONS = [
    Expression(3.0),
    Expression(x),
    2.0 * x * y + 3.0 * sym.sin(x) ** y / (1.0 + x) - 1.5,
    sym.if_then_else(x > y, sym.atan2(x, y), y + 2.0) - sym.min(x, y),
    x**2.5 * y / 2.0,
    sym.uninterpreted_function("f", [Expression(x), x + y]),
]
FORMULAS = [
    Formula.True_(),
    Formula(b),
    sym.logical_and(x <= y, sym.sin(x) == 2.0, sym.logical_not(y > 3.0)),
    sym.logical_or(x < y, x > 2.0),
    sym.forall([x], x * y > 2.0),
    sym.isnan(Expression(x)),
    sym.positive_semidefinite([[Expression(x), Expression(y)], [Expression(y), Expression(1.0)]]),
]


def again(thing):
    return pickle.loads(pickle.dumps(thing))


@pytest.mark.parametrize("e", EXPRESSIONS, ids=str)
def test_expressions_are_the_same_in_their_process(e):
    assert again(e).EqualTo(e)


@pytest.mark.parametrize("f", FORMULAS, ids=str)
def test_formulas_are_the_same_in_their_process(f):
    assert again(f) == f


def test_variables_are_the_same_in_their_process():
    assert again(x) is x and again(b) is b
    assert again(Variables([x, y])) == Variables([x, y])
    assert again(Polynomial(x * y + y)).EqualTo(Polynomial(x * y + y))
    assert again(RationalFunction(Polynomial(x), Polynomial(y))).EqualTo(RationalFunction(Polynomial(x), Polynomial(y)))


def test_deep_expressions_need_no_recursion():
    e = Expression(x)
    for _ in range(3000):
        e = sym.sin(e)
    assert again(e).EqualTo(e)


def test_elsewhere_all_pickles_of_a_variable_are_one_which_comes_home_as_itself():
    elsewhere = """if True:
        import pickle, sys
        from sheldrake import symbolic as sym
        mine = sym.Variable("z")
        x, y, e = pickle.load(sys.stdin.buffer)
        x2, later = pickle.load(sys.stdin.buffer)
        assert x2 is x and not x.EqualTo(mine) and x.get_name() == "x" and e.EqualTo(x * y + sym.cos(y))
        assert later.EqualTo(x + y)
        sys.stdout.buffer.write(pickle.dumps(e))
    """
    first, second = pickle.dumps((x, y, x * y + sym.cos(y))), pickle.dumps((x, x + y))
    command = [sys.executable, "-c", elsewhere]
    out = subprocess.run(command, input=first + second, stdout=subprocess.PIPE, check=True).stdout
    assert pickle.loads(out).EqualTo(x * y + sym.cos(y))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")
def test_a_forked_child_makes_variables_of_its_own():
    again(x)
    read, write = os.pipe()
    child = os.fork()
    if not child:
        os.write(write, pickle.dumps([x, Variable("of the child")]))
        os._exit(0)
    os.close(write)
    with os.fdopen(read, "rb") as pipe:
        mine = Variable("of the parent")  # has the number that the child's has
        again(mine)
        back = pickle.load(pipe)
    os.waitpid(child, 0)
    assert back[0] is x and back[1].get_name() == "of the child" and not back[1].EqualTo(mine)
