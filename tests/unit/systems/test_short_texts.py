"""What a notebook or a debugger shows of the objects that people hold: one short line that says how things are."""

from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder, EventStatus
from sheldrake.systems.primitives import ConstantVectorSource, Integrator, LogVectorOutput, ZeroOrderHold


def test_each_says_in_one_line_how_it_is():
    builder = DiagramBuilder()
    integrator = builder.AddNamedSystem("integrator", Integrator(2))
    hold = builder.AddNamedSystem("hold", ZeroOrderHold(0.5, 2))
    builder.Connect(integrator.get_output_port(), hold.get_input_port())
    builder.Connect(hold.get_output_port(), integrator.get_input_port())
    logger = LogVectorOutput(hold.get_output_port(), builder, 0.5)
    diagram = builder.Build()
    diagram.set_name("loop")
    simulator = Simulator(diagram)
    log = logger.FindLog(simulator.get_context())
    assert repr(log) == "<VectorLog of 2 elements, 0 samples>"
    status = simulator.AdvanceTo(1.0)
    context = simulator.get_context()
    assert repr(status) == "<SimulatorStatus: Simulator successfully reached the boundary time (1).>"
    assert repr(context) == "<DiagramContext of '::loop' at t = 1.0 s, 2 continuous and 2 discrete states>"
    assert repr(hold.GetMyContextFromRoot(context)).endswith("of '::loop::hold' at t = 1.0 s, 2 discrete states>")
    assert repr(simulator).startswith("<Simulator of 'loop' at t = 1.0 s, ")
    assert repr(log) == "<VectorLog of 2 elements, 3 samples, from 0 to 1 s>"
    assert repr(EventStatus.Failed(hold, "too hot")) == "<EventStatus Failed: too hot>"


def test_what_has_no_name_is_called_by_its_kind():
    builder = DiagramBuilder()
    builder.AddSystem(ConstantVectorSource([1.0]))
    simulator = Simulator(builder.Build())
    assert repr(simulator) == "<Simulator of 'Diagram' at t = 0.0 s, 0 steps taken>"
    assert repr(simulator.get_context()) == "<DiagramContext at t = 0.0 s, no state>"
