"""Message types, field by field, against the Python classes that Drake ships."""

from __future__ import annotations

import importlib

import numpy as np
import pytest

from sheldrake.common.value import AbstractValue
from sheldrake.lcm import _messages
from sheldrake.systems.lcm import PySerializer

drake = pytest.importorskip("drake")
pytestmark = pytest.mark.peer
TYPES = {name: value for name, value in vars(_messages).items() if name.startswith("lcmt_")}


def theirs(name):
    return getattr(importlib.import_module(f"drake.{name}"), name)


@pytest.mark.parametrize("name", sorted(TYPES))
def test_a_message_is_encoded_as_theirs(name):
    """The first eight bytes name the type and all types of its fields; the rest is fields without values."""
    ours = TYPES[name]()
    message = theirs(name)()
    assert ours.encode()[:8] == message.encode()[:8]
    assert TYPES[name].decode(ours.encode()).encode() == ours.encode()
    read = theirs(name).decode(ours.encode())
    assert [f for f, *_ in TYPES[name]._fields] == list(read.__slots__)
    constants = {k: v for k, v in vars(theirs(name)).items() if k.isupper()}
    assert {k: getattr(TYPES[name], k, None) for k in constants} == constants


def test_values_arrive():
    rng = np.random.default_rng(0)
    state = {"utime": 5, "num_joints": 2, "joint_name": ["a", "b"], "joint_position": (0.5, -2.0)}
    plan = _messages.lcmt_robot_plan(utime=7, num_states=1, plan=[_messages.lcmt_robot_state(**state)])
    read = theirs("lcmt_robot_plan").decode(plan.encode())
    assert {name: getattr(read.plan[0], name) for name in state} == state
    count = 3
    values = {name: list(rng.normal(size=count)) for name in ("joint_position", "finger_current")}
    status = _messages.lcmt_jaco_status(num_joints=count, num_fingers=count)
    for name, _, *dimensions in status._fields:
        if dimensions:
            setattr(status, name, values.get(name, [0.0] * count))
    back = theirs("lcmt_jaco_status").decode(status.encode())
    assert {name: list(getattr(back, name)) for name in values} == values


def test_a_message_of_the_other_class_is_serialized():
    ours = _messages.lcmt_iiwa_command(num_joints=1, joint_position=[2.0])
    serializer = PySerializer(theirs("lcmt_iiwa_command"))
    assert serializer.Serialize(AbstractValue.Make(ours)) == ours.encode()
    with pytest.raises(TypeError, match="is no lcmt_iiwa_command"):
        serializer.Serialize(AbstractValue.Make(_messages.lcmt_iiwa_status()))
