"""A loop of a Python plant and a Python controller: what a user writes first."""

import math

import numpy as np
import pytest

from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder, LeafSystem
from sheldrake.systems.primitives import ConstantVectorSource, Integrator, LogVectorOutput


class Plant(LeafSystem):
    """A double integrator, updated periodically."""

    def __init__(self, dt):
        super().__init__()
        self.dt = dt
        self.DeclareVectorInputPort("u", 1)
        self.DeclareStateOutputPort("x", self.DeclareDiscreteState(2))
        self.DeclarePeriodicDiscreteUpdateEvent(dt, 0.0, self.step)

    def step(self, context, x_next):
        x = context.get_discrete_state_vector().value()
        u = self.get_input_port(0).Eval(context)
        x_next.set_value([x[0] + self.dt * x[1], x[1] + self.dt * u[0]])


class Controller(LeafSystem):
    """Proportional and derivative."""

    def __init__(self):
        super().__init__()
        self.DeclareVectorInputPort("x", 2)
        self.DeclareVectorOutputPort("u", 1, self.calc)

    def calc(self, context, output):
        x = self.get_input_port(0).Eval(context)
        output[0] = -4.0 * (x[0] - 1.0) - 3.0 * x[1]


def closed_loop(dt=1e-3):
    builder = DiagramBuilder()
    plant, controller = builder.AddNamedSystem("plant", Plant(dt)), builder.AddNamedSystem("pd", Controller())
    builder.Connect(plant.get_output_port(0), controller.get_input_port(0))
    builder.Connect(controller.get_output_port(0), plant.get_input_port(0))
    return builder, plant, controller


def expected(dt, steps):
    x, out = np.zeros(2), [np.zeros(2)]
    for _ in range(steps):
        u = -4.0 * (x[0] - 1.0) - 3.0 * x[1]
        x = np.array([x[0] + dt * x[1], x[1] + dt * u])
        out.append(x)
    return np.array(out).T


def test_log_holds_every_step_bit_for_bit():
    builder, plant, _ = closed_loop()
    sink = LogVectorOutput(plant.get_output_port(0), builder)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.5)
    log = sink.FindLog(simulator.get_context())
    assert np.array_equal(log.sample_times(), np.arange(501) * 1e-3)
    assert np.array_equal(log.data(), expected(1e-3, 500))
    assert simulator.get_num_steps_taken() == simulator.get_num_discrete_updates() == 500
    assert simulator.get_num_publishes() == 501


def test_update_at_the_boundary_stays_pending():
    builder, plant, _ = closed_loop(0.1)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.3)
    context = plant.GetMyContextFromRoot(simulator.get_context())
    steps = 4 if 3 * 0.1 < 0.3 else 3  # 3 * 0.1 is a little more than 0.3
    assert np.array_equal(context.get_discrete_state_vector().value(), expected(0.1, steps)[:, -1])
    simulator.AdvanceTo(0.3)
    simulator.AdvanceTo(0.35)
    assert np.array_equal(context.get_discrete_state_vector().value(), expected(0.1, 4)[:, -1])


def test_an_error_keeps_the_last_good_state_and_names_system_and_time():
    class Failing(Plant):
        def step(self, context, x_next):
            if context.get_time() > 0.45:
                raise ValueError("too late")
            x_next[0] = context.get_discrete_state_vector()[0] + 1.0

    builder = DiagramBuilder()
    failing = builder.AddNamedSystem("failing", Failing(0.1))
    builder.ExportInput(failing.get_input_port(0), "u")
    diagram = builder.Build()
    diagram.set_name("root")
    simulator = Simulator(diagram)
    with pytest.raises(ValueError, match="too late") as info:
        simulator.AdvanceTo(1.0)
    assert "root::failing" in info.value.__notes__[0] and "t = 0.5 s" in info.value.__notes__[0]
    assert simulator.get_context().get_time() == 0.5
    context = failing.GetMyContextFromRoot(simulator.get_context())
    assert context.get_discrete_state_vector()[0] == 5.0


def test_unconnected_input_is_named_with_its_path():
    builder = DiagramBuilder()
    builder.AddNamedSystem("plant", Plant(0.1))
    diagram = builder.Build()
    with pytest.raises(RuntimeError, match=r"InputPort\[0\] \(u\) of System ::_::plant .* is not connected"):
        Simulator(diagram).AdvanceTo(1.0)


@pytest.mark.parametrize("time", ["1.0", "x", None, [1.0]])
def test_a_time_that_is_no_number_is_a_type_error(time):
    simulator = Simulator(ConstantVectorSource([1.0]))
    with pytest.raises(TypeError):
        simulator.AdvanceTo(time)
    assert simulator.get_context().get_time() == 0.0


@pytest.mark.parametrize(
    ("call", "numbers"),
    [
        ("set_target_accuracy", (0.0, -1.0, -math.inf)),
        ("request_initial_step_size_target", (0.0, -1.0, -math.inf)),
        ("set_requested_minimum_step_size", (-1.0, -math.inf, math.inf, math.nan)),
        ("set_maximum_step_size", (-1.0, -math.inf, math.nan)),
    ],
)
def test_numbers_with_which_an_integrator_would_not_end_are_refused(call, numbers):
    integrator = Simulator(Integrator(1)).get_mutable_integrator()
    for number in numbers:
        with pytest.raises(RuntimeError, match=f"{call}.*{number}"):
            getattr(integrator, call)(number)
