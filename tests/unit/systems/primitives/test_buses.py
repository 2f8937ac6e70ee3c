"""Buses carry what their creator is given now, whoever else looks at them."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from sheldrake.all import AbstractValue, BusCreator, BusSelector, DiagramBuilder


def test_what_is_packed_follows_the_inputs():
    creator = BusCreator()
    x, name = creator.DeclareVectorInputPort("x", 2), creator.DeclareAbstractInputPort("name", AbstractValue.Make("a"))
    context = creator.CreateDefaultContext()
    port = creator.get_output_port()
    assert list(port.Eval(context)) == []
    x.FixValue(context, [1.0, 2.0])
    first = copy.deepcopy(port.Eval(context))
    name.FixValue(context, "b")
    x.FixValue(context, [3.0, 4.0])
    bus = port.Eval(context)
    assert list(bus) == ["name", "x"] and bus.Find("name") == "b"
    np.testing.assert_array_equal(bus.Find("x").value(), [3.0, 4.0])
    np.testing.assert_array_equal(first.Find("x").value(), [1.0, 2.0])
    other = context.Clone()
    x.FixValue(other, [5.0, 6.0])
    np.testing.assert_array_equal(port.Eval(other).Find("x").value(), [5.0, 6.0])
    np.testing.assert_array_equal(port.Eval(context).Find("x").value(), [3.0, 4.0])


def test_a_selector_gives_what_was_packed():
    builder = DiagramBuilder()
    creator, selector = builder.AddSystem(BusCreator()), builder.AddSystem(BusSelector())
    for name in ("x", "y"):
        builder.ExportInput(creator.DeclareVectorInputPort(name, 1), name)
    selector.DeclareVectorOutputPort("y", 1)
    builder.Connect(creator.get_output_port(), selector.get_input_port())
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    own = selector.GetMyContextFromRoot(context)
    diagram.GetInputPort("x").FixValue(context, [1.0])
    with pytest.raises(RuntimeError, match="Missing value for input signal y"):
        selector.get_output_port().Eval(own)
    for value in (2.0, 3.0):
        diagram.GetInputPort("y").FixValue(context, [value])
        assert selector.get_output_port().Eval(own) == [value]
