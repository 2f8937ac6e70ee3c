"""Calls that return ports, made by a line each."""

from __future__ import annotations

import pytest

from sheldrake.manipulation import IiwaStatusSender
from sheldrake.systems.framework import LeafSystem
from sheldrake.systems.framework._port_getters import input_port, output_port


class TwoPorts(LeafSystem):
    def __init__(self):
        super().__init__()
        self.DeclareVectorInputPort("speed", 2)
        self.DeclareVectorOutputPort("force", 1, lambda context, output: None)

    get_speed_input_port = input_port("speed", "The speed [m/s].")
    get_first_input_port = input_port(0)
    get_force_output_port = output_port(0, "The force [N].")


def test_they_return_the_ports_by_index_and_by_name():
    system = TwoPorts()
    assert system.get_speed_input_port() is system.get_first_input_port() is system.get_input_port(0)
    assert system.get_force_output_port() is system.get_output_port(0)


def test_they_are_methods_as_if_written_out():
    method = TwoPorts.get_speed_input_port
    assert (method.__name__, method.__qualname__) == ("get_speed_input_port", "TwoPorts.get_speed_input_port")
    assert (method.__doc__, method.__module__) == ("The speed [m/s].", __name__)
    with pytest.raises(TypeError, match=r"get_speed_input_port\(\)"):
        TwoPorts().get_speed_input_port(1)
    assert "time_measured" in IiwaStatusSender.get_time_measured_input_port.__doc__
