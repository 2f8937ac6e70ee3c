"""Deep copies of graphs of objects, as `copy.deepcopy` makes them."""

import copy
import enum
import types
import weakref
from typing import NamedTuple

import numpy as np
import pytest

from sheldrake.common._copies import deep_copy
from sheldrake.geometry import FrameId
from sheldrake.math import RigidTransform
from sheldrake.multibody.tree import BodyIndex, JointIndex


class Thing:
    def __init__(self, **attributes):
        self.__dict__.update(attributes)


class Slotted:
    __slots__ = ("a", "b")


class Color(enum.Enum):
    RED = 1


class Pair(NamedTuple):
    first: Thing
    second: int


class OwnWay:
    def __init__(self):
        self.copied = False

    def __deepcopy__(self, memo):
        new = OwnWay()
        new.copied = True
        return new


class Counted:
    made = 0

    def __new__(cls):
        Counted.made += 1
        return object.__new__(cls)


class Table(dict):
    pass


def shape_of(value, seen):
    """Types, contents and which objects are the same, as nested tuples."""
    if id(value) in seen:
        return ("again", seen[id(value)])
    if isinstance(value, types.MethodType):
        return value.__func__, shape_of(value.__self__, seen)
    if isinstance(value, (int, float, str, type(None), enum.Enum, type, set)) or callable(value):
        return value
    seen[id(value)] = len(seen)
    if isinstance(value, dict):
        return type(value), [(k, shape_of(v, seen)) for k, v in value.items()]
    if isinstance(value, (list, tuple)):
        return type(value), [shape_of(v, seen) for v in value]
    if isinstance(value, np.ndarray) and value.dtype == object:
        return value.shape, [shape_of(v, seen) for v in value.flat]
    if isinstance(value, np.ndarray):
        return value.dtype, value.tolist(), value.flags.writeable, value.strides
    names = [*getattr(value, "__dict__", {}), *getattr(type(value), "__slots__", ())]
    return type(value), [(name, shape_of(getattr(value, name), seen)) for name in names if hasattr(value, name)]


def graph():
    shared = Thing(name="shared", numbers=np.arange(6.0).reshape(2, 3).T)
    slotted = Slotted()
    slotted.a = shared
    frozen = np.arange(6.0)[1:4]  # a view, of what can be written
    frozen.setflags(write=False)
    root = Thing(
        plain=(1, "a", None), pair=(shared, [shared]), table={1: shared, "x": {"y": [1.5]}}, slotted=slotted,
        color=Color.RED, function=len, cls=Thing, frozen=frozen, own=Table(a=shared), X=RigidTransform([1.0, 2.0, 3.0]),
        counted=Counted(), mixed=np.array([shared, 1], object), names={"a", "b"}, named=Pair(shared, 2),
    )  # fmt: skip
    shared.root = root
    root.method = shared.__init__
    return root


def test_copies_are_those_of_deepcopy():
    root = graph()
    ours, expected = deep_copy(root, {}), copy.deepcopy(root)
    assert shape_of(ours, {}) == shape_of(expected, {})
    assert list(vars(ours)) == list(vars(root))
    assert ours.names == root.names
    assert ours.names is not root.names


def test_what_is_one_object_stays_one_object():
    ours = deep_copy(graph(), {})
    shared = ours.pair[0]
    assert shared is ours.pair[1][0] is ours.table[1] is ours.slotted.a is ours.own["a"] is ours.mixed[0]
    assert shared.root is ours
    assert ours.method.__self__ is shared
    assert ours.plain is graph().plain or ours.plain == (1, "a", None)


def test_what_the_memo_has_is_not_copied():
    root = graph()
    other = Thing()
    ours = deep_copy(root, {id(root.pair[0]): other})
    assert ours.pair[0] is ours.table[1] is ours.slotted.a is other


def test_classes_have_their_own_way():
    value = OwnWay()
    first, second = deep_copy([value, value], {})
    assert first is second
    assert first.copied
    before = Counted.made
    deep_copy(Counted(), {})
    assert Counted.made == before + 2


def test_what_is_never_changed_is_shared():
    numbers = np.zeros(3)
    numbers.setflags(write=False)
    value = [(numbers, numbers), BodyIndex(3), {("a", JointIndex(1)): FrameId.get_new_id()}]
    ours = deep_copy(value, {})
    assert ours[0] is value[0] and ours[1] is value[1]
    assert ours is not value and ours[2] is not value[2] and ours[2] == value[2]


def test_what_refers_weakly_is_kept():
    thing = Thing()
    reference = weakref.ref(thing)
    assert deep_copy([reference], {}) == [reference]


def test_a_tuple_that_holds_itself():
    inner: list = []
    value = (inner,)
    inner.append(value)
    ours = deep_copy(value, {})
    assert ours[0][0] is ours
    assert ours is not value


def test_what_cannot_be_copied_is_refused():
    with pytest.raises(TypeError):
        deep_copy(Thing(stream=(x for x in [1])), {})
