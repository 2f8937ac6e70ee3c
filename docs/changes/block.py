"""A spring with play: a mass that feels nothing within a band, as a block in a loop, by itself, and with its slope."""

from __future__ import annotations

import numpy as np

from sheldrake.autodiffutils import InitializeAutoDiff
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import DeadZone, Gain, Integrator

# What it computes.
zone = DeadZone([-1.0, -2.0], [1.0, 0.5])
context = zone.CreateDefaultContext()
for u, y in (([0.5, 0.0], [0.0, 0.0]), ([3.0, -2.5], [2.0, -0.5]), ([-1.5, 0.75], [-0.5, 0.25])):
    zone.get_input_port().FixValue(context, u)
    np.testing.assert_array_equal(zone.get_output_port().Eval(context), y)
try:
    DeadZone([1.0], [0.0])
except ValueError as error:
    assert "not exceed" in str(error)
else:
    raise AssertionError("a band that is upside down was taken")

# One source of its slope: 0 within the band, 1 outside.
dual = zone.ToAutoDiffXd()
dual_context = dual.CreateDefaultContext()
dual.get_input_port().FixValue(dual_context, InitializeAutoDiff([3.0, 0.0]))
slopes = [y.derivatives() for y in dual.get_output_port().Eval(dual_context)]
np.testing.assert_array_equal(slopes, [[1.0, 0.0], [0.0, 0.0]])

# In a loop: x'' = -zone(x), from x = -1 at 1 m/s. It crosses the band at constant speed and turns after a half swing,
# so that a period is 2 (2 + pi).
builder = DiagramBuilder()
zone, spring = builder.AddSystem(DeadZone([-1.0], [1.0])), builder.AddSystem(Gain(-1.0, 1))
speed, place = builder.AddSystem(Integrator(1)), builder.AddSystem(Integrator(1))
builder.Connect(place.get_output_port(), zone.get_input_port())
builder.Connect(zone.get_output_port(), spring.get_input_port())
builder.Connect(spring.get_output_port(), speed.get_input_port())
builder.Connect(speed.get_output_port(), place.get_input_port())
simulator = Simulator(builder.Build())
root = simulator.get_mutable_context()
speed.set_integral_value(speed.GetMyMutableContextFromRoot(root), [1.0])
place.set_integral_value(place.GetMyMutableContextFromRoot(root), [-1.0])
simulator.AdvanceTo(2.0 * (2.0 + np.pi))
np.testing.assert_allclose(root.get_continuous_state_vector().CopyToVector(), [1.0, -1.0], atol=1e-3)
print("ok")
