"""Names for the columns of kernels' arrays, interpreted: every element type, and what is said about mistakes."""

from __future__ import annotations

import fractions
import operator
from typing import Annotated, NamedTuple

import numpy as np
import pytest

from sheldrake.common.kernel import IntMatrix, Matrix, Vector
from sheldrake.common.record import Each, Items, Record, Stack, array, integer, number, numbers, table, vector, view_of


class Law(Record):
    """Of a contact."""

    stiffness = number("k", "N/m")
    V_WB = numbers((3, 3), "spatial velocity", "rad/s, m/s")
    inertia = numbers((1, 3), "mass and first moment")
    weights = array((2, 2), "of two methods")
    compliance = number("1 / k", "m/N", same_as=stiffness)
    further = array(..., "all that follows")


class Options(Record):
    """Of a solver."""

    dt = number("time step", "s")


class Tree(Record):
    """A kinematic tree."""

    first_dof = integer("its first dof")
    num_dofs = integer("how many it has")


class Leaf(Record):
    """Another way to see a tree."""

    colour = integer("of its leaves")


class Vectors(Stack):
    """Over the dofs."""

    v = vector("velocity")
    dv = vector("search direction")


@table
class Contacts(NamedTuple):
    """All kinds of parts."""

    law: Annotated[Matrix, Law]
    J: Annotated[Matrix, Each(3)]
    option: Annotated[Vector, Options]
    tree: Annotated[IntMatrix, Items("trees", Tree), Items("leaves", Leaf)]
    x: Annotated[Matrix, Vectors]


def contacts(dtype: type = float) -> Contacts:
    law = np.arange(36.0).reshape(2, 18)
    if dtype is fractions.Fraction:
        law = np.vectorize(fractions.Fraction, otypes=[object])(law)
    tree = np.array([[0, 6], [6, 7]])
    return Contacts(law.astype(object if dtype is fractions.Fraction else dtype), np.ones((6, 4)), np.zeros(1), tree,
                    np.arange(8.0).reshape(2, 4))  # fmt: skip


@pytest.mark.parametrize("dtype", [float, complex, fractions.Fraction])
def test_fields_are_the_arrays_own_memory(dtype):
    table_ = contacts(dtype)
    contact = table_[1]
    assert contact.stiffness == 18
    assert contact.V_WB == ((19, 20, 21), (22, 23, 24))
    assert contact.inertia == (25, (26, 27, 28))
    assert contact.weights.tolist() == [[29, 30], [31, 32]]
    assert contact.further.tolist() == [33, 34, 35]
    contact.V_WB = ((1, 2, 3), (4, 5, 6))
    contact.stiffness += 1
    contact.inertia = (7, (8, 9, 10))
    assert table_.law[1, :11].tolist() == [19, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10]
    assert contact.compliance == 19
    assert type(contact.stiffness) is type(table_.law[1, 0])


def test_what_a_table_has_beside_its_rows():
    table_ = contacts()
    table_.dt = 0.5
    assert table_.option[0] == table_.dt == 0.5
    assert len(table_.trees) == 2
    table_.trees[1].num_dofs = 3
    assert table_.tree.tolist() == [[0, 6], [6, 3]]
    assert table_.leaves[1].colour == 6
    assert table_.dv.tolist() == [4, 5, 6, 7]
    assert table_[1].J.shape == (3, 4) and np.shares_memory(table_[1].J, table_.J[3:])


def test_a_field_is_an_index_of_numpy():
    law = contacts().law
    assert law[:, Law.stiffness].tolist() == [0, 18]
    assert law[0, Law.V_WB.columns].tolist() == [1, 2, 3, 4, 5, 6]
    with pytest.raises(TypeError, match=r"V_WB takes 6 columns: use `V_WB.columns`"):
        operator.index(Law.V_WB)


def test_declarations_are_documentation_and_rows_print_their_fields():
    assert "stiffness            [N/m]          k" in (Law.__doc__ or "")
    shown = repr(contacts()[0])
    assert "    stiffness = 0.0 N/m" in shown and "    V_WB = ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0)) rad/s, m/s" in shown


def test_misspelt_names_are_answered_with_those_there_are():
    table_ = contacts()
    names = "has no field 'stifness'; it has stiffness, V_WB, inertia, weights, compliance, further, J"
    with pytest.raises(AttributeError, match=names):
        _ = table_[0].stifness
    with pytest.raises(AttributeError, match=names):
        table_[0].stifness = 1.0
    with pytest.raises(AttributeError, match="Contacts has no field 'dT'; it has law, J, option, tree, x, dt, dv"):
        _ = table_.dT
    with pytest.raises(TypeError, match="V_WB takes a tuple of 2, not of 3"):
        table_[0].V_WB = (1.0, 2.0, 3.0)


def test_a_vector_is_made_of_the_values_of_a_record():
    class Force(Record):
        torque = numbers(3, "about the centre", "N m")
        size = number("of the force", "N")
        weights = array((2, 2), "of two methods")
        norm = number("the same", same_as=size)

    made = Force.of(torque=(1, 2, 3), size=4, weights=np.eye(2))
    assert made.dtype == float and made.tolist() == [1, 2, 3, 4, 1, 0, 0, 1]
    assert Tree.of(first_dof=3, num_dofs=2).dtype == np.int64
    assert Law.of(stiffness=1, V_WB=((1, 2, 3), (4, 5, 6)), inertia=(7, (8, 9, 10)), weights=np.zeros((2, 2)),
                  further=[5.0, 6.0])[-2:].tolist() == [5.0, 6.0]  # fmt: skip
    with pytest.raises(TypeError, match=r"Force has no field 'sise'; it has torque, size, weights\."):
        Force.of(sise=1)
    with pytest.raises(TypeError, match=r"Force.of\(\) needs torque, weights too"):
        Force.of(size=1)
    with pytest.raises(TypeError, match="torque takes a tuple of 3, not of 2"):
        Force.of(torque=(1, 2), size=4, weights=np.eye(2))
    with pytest.raises(TypeError, match="size takes 1 number, not 2"):
        Force.of(torque=(1, 2, 3), size=[4, 5], weights=np.eye(2))
    seen = view_of(Force)(made)
    assert repr(seen).splitlines()[:3] == ["Force", "    torque = (1.0, 2.0, 3.0) N m", "    size = 4.0 N"]


def test_declarations_that_contradict_themselves_are_refused():
    class Wrong(NamedTuple):
        tree: Annotated[Matrix, Items("trees", Tree)]

    class Twice(NamedTuple):
        dt: Vector
        option: Annotated[Vector, Options]

    with pytest.raises(TypeError, match=r"Wrong.tree holds float64; 'first_dof' is declared int64"):
        table(Wrong)
    with pytest.raises(TypeError, match="Twice: there are two of 'dt'"):
        table(Twice)
