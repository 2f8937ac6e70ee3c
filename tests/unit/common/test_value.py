import copy

import numpy as np
import pytest

from sheldrake.common.cpp_param import List
from sheldrake.common.value import AbstractValue, Value, _register_value_type


class Point:
    def __init__(self, x=0.0):
        self.x = x

    def __copy__(self):
        return Point(self.x)


class Plain:
    pass


_register_value_type(Point, with_list=True)


@pytest.mark.parametrize(
    "held, cls",
    [
        ("a", Value[str]),
        (True, Value[bool]),
        (2.5, Value[float]),
        (np.float64(2.5), Value[float]),
        (3, Value[object]),
        (None, Value[object]),
        ({}, Value[object]),
        ([], Value[object]),
        ([1.0], Value[object]),
        (Point(), Value[Point]),
        ([Point()], Value[List[Point]]),
    ],
)
def test_make_chooses_the_class_by_type(held, cls):
    assert type(Value(held)) is cls
    assert type(AbstractValue.Make(held)) is cls


def test_subclass_of_a_registered_type_is_held_as_object():
    class Derived(Point):
        pass

    assert type(Value(Derived())) is Value[object]


def test_unknown_parameter_is_named():
    with pytest.raises(RuntimeError, match=r"Invalid instantiation: Value\[Plain\]"):
        Value[Plain]


def test_no_arguments_is_an_error():
    with pytest.raises(TypeError):
        Value()
    with pytest.raises(TypeError):
        AbstractValue()


def test_object_value_holds_the_reference_and_clones_deeply():
    held = {"a": [1]}
    value = Value[object](held)
    assert value.get_value() is held
    assert value.get_mutable_value() is held
    clone = value.Clone()
    assert type(clone) is Value[object]
    held["a"].append(2)
    assert clone.get_value() == {"a": [1]}


def test_registered_type_is_held_by_copy():
    point = Point(1.0)
    value = Value(point)
    point.x = 2.0
    assert value.get_value().x == 1.0
    assert value.get_value() is value.get_mutable_value()
    value.get_mutable_value().x = 3.0
    assert value.get_value().x == 3.0
    clone = copy.copy(value)
    value.get_mutable_value().x = 4.0
    assert clone.get_value().x == 3.0


def test_constructor_arguments_are_those_of_the_held_type():
    assert Value[Point]().get_value().x == 0.0
    assert Value[Point](x=2.0).get_value().x == 2.0
    assert Value[str]().get_value() == ""
    assert Value[str](b"ab").get_value() == "ab"
    assert Value[float](True).get_value() == 1.0
    assert Value[object]().get_value() is None


def test_set_value_checks_the_type():
    value = Value("a")
    value.set_value("b")
    assert value.get_value() == "b"
    with pytest.raises(TypeError, match=r"incompatible function arguments.*expected str"):
        value.set_value(3)
    with pytest.raises(TypeError):
        Value(Point()).set_value("x")
    with pytest.raises(TypeError):
        Value[List[Point]]([Point(), 3])
    number = Value(2.0)
    number.set_value(3)
    assert number.get_value() == 3.0 and type(number.get_value()) is float


def test_immutable_types_have_no_mutable_value():
    for held in ("a", True, 1.0):
        with pytest.raises(RuntimeError, match="type-conversion"):
            Value(held).get_mutable_value()


def test_set_from_needs_the_same_type():
    value = Value("a")
    value.SetFrom(Value("c"))
    assert value.get_value() == "c"
    with pytest.raises(RuntimeError, match="cast"):
        value.SetFrom(Value(1))
    with pytest.raises(TypeError):
        value.SetFrom("d")
    target, source = Value(Point(1.0)), Value(Point(2.0))
    target.SetFrom(source)
    source.get_mutable_value().x = 9.0
    assert target.get_value().x == 2.0


def test_list_value_copies_its_items():
    points = [Point(1.0)]
    value = Value(points)
    points[0].x = 5.0
    assert value.get_value()[0].x == 1.0


def test_repr_says_what_is_held():
    assert repr(Value("a")) == "Value[str]('a')"
