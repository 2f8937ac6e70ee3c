"""Building diagrams: wiring, names, errors that say what is wrong, and nothing half-changed."""

import pytest

from sheldrake.common.value import Value
from sheldrake.systems.framework import Diagram, DiagramBuilder, LeafSystem, PortDataType, SystemVisitor
from sheldrake.systems.primitives import Adder, ConstantVectorSource, Gain, Integrator, PassThrough


def test_algebraic_loop_is_spelled_out_and_can_be_repaired():
    builder = DiagramBuilder()
    x, y = builder.AddNamedSystem("x", Gain(1.0, 1)), builder.AddNamedSystem("y", Adder(2, 1))
    builder.Connect(x.get_output_port(), y.get_input_port(1))
    builder.Connect(y.get_output_port(), x.get_input_port())
    builder.ExportInput(y.get_input_port(0))
    with pytest.raises(RuntimeError, match=r"algebraic loop") as info:
        builder.Build()
    text = str(info.value)
    for part in ("InputPort[1] (u1) of System ::x", "OutputPort[0] (y0) of System", "InputPort[0] (u0)", "(sum)"):
        assert part.replace("::x", "::") in text or part in text
    assert "::_::y" in text and "::_::x" in text
    builder.Disconnect(y.get_output_port(), x.get_input_port())
    builder.ExportInput(x.get_input_port())
    assert builder.Build().num_input_ports() == 2


def test_a_path_out_of_a_subdiagram_and_back_is_no_loop():
    inner = DiagramBuilder()
    for k in (2.0, 3.0):
        gain = inner.AddSystem(Gain(k, 1))
        inner.ExportInput(gain.get_input_port())
        inner.ExportOutput(gain.get_output_port())
    builder = DiagramBuilder()
    sub, source = builder.AddSystem(inner.Build()), builder.AddSystem(ConstantVectorSource([1.0]))
    builder.Connect(source.get_output_port(), sub.get_input_port(0))
    builder.Connect(sub.get_output_port(0), sub.get_input_port(1))
    builder.ExportOutput(sub.get_output_port(1))
    diagram = builder.Build()
    assert diagram.get_output_port().Eval(diagram.CreateDefaultContext()) == 6.0
    assert sub.GetDirectFeedthroughs() == [(0, 0), (1, 1)]


def test_feedthrough_of_a_diagram():
    builder = DiagramBuilder()
    gain, integrator = builder.AddSystem(Gain(2.0, 1)), builder.AddSystem(Integrator(1))
    builder.Cascade(gain, integrator)
    builder.ExportInput(gain.get_input_port())
    builder.ExportOutput(integrator.get_output_port())
    builder.ExportOutput(gain.get_output_port())
    diagram = builder.Build()
    assert not diagram.HasDirectFeedthrough(0) and diagram.HasDirectFeedthrough(0, 1)


def test_one_value_for_several_inputs():
    builder = DiagramBuilder()
    gains = [builder.AddSystem(Gain(k, 1)) for k in (1.0, 2.0, 3.0)]
    index = builder.ExportInput(gains[0].get_input_port(), "u")
    builder.ConnectInput(index, gains[1].get_input_port())
    assert builder.ConnectToSame(gains[0].get_input_port(), gains[2].get_input_port())
    for gain in gains:
        builder.ExportOutput(gain.get_output_port())
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    diagram.get_input_port().FixValue(context, 5.0)
    assert [diagram.get_output_port(j).Eval(context)[0] for j in range(3)] == [5.0, 10.0, 15.0]
    assert len(diagram.GetInputPortLocators(index)) == 3
    assert diagram.get_output_port_locator(1) == (gains[1], 0)


def test_connections_are_reported():
    builder = DiagramBuilder()
    a, b = builder.AddNamedSystem("a", Gain(1.0, 1)), builder.AddNamedSystem("b", Gain(1.0, 1))
    builder.Connect(a.get_output_port(), b.get_input_port())
    builder.ExportInput(a.get_input_port())
    assert builder.IsConnectedOrExported(a.get_input_port()) and builder.num_input_ports() == 1
    diagram = builder.Build()
    assert builder.already_built()
    assert diagram.AreConnected(a.get_output_port(), b.get_input_port())
    assert not diagram.AreConnected(b.get_output_port(), a.get_input_port())
    ((system, i), (source, j)) = next(iter(diagram.connection_map().items()))
    assert (system, int(i), source, int(j)) == (b, 0, a, 0)
    assert diagram.GetSystems() == [a, b] and diagram.GetSubsystemByName("b") is b
    assert b.GetSystemPathname() == "::_::b"
    with pytest.raises(RuntimeError, match=r"subsystems are named {a, b}"):
        diagram.GetSubsystemByName("c")


def test_removing_a_system_removes_its_wires():
    builder = DiagramBuilder()
    a, b, c = (builder.AddNamedSystem(name, Gain(1.0, 1)) for name in "abc")
    builder.Connect(a.get_output_port(), b.get_input_port())
    builder.Connect(b.get_output_port(), c.get_input_port())
    builder.ExportInput(a.get_input_port())
    builder.RemoveSystem(b)
    assert not builder.HasSubsystemNamed("b")
    assert not builder.IsConnectedOrExported(c.get_input_port())
    builder.Connect(a.get_output_port(), c.get_input_port())
    assert builder.Build().GetSystems() == [a, c]


class Ports(LeafSystem):
    """A vector and an abstract port each way."""

    def __init__(self):
        super().__init__()
        self.DeclareVectorInputPort("u", 3)
        self.DeclareAbstractInputPort("a", Value("text"))
        self.DeclareVectorOutputPort("y", 2, lambda context, y: None, {self.nothing_ticket()})


def test_wrong_connections_name_ports_and_sizes():
    builder = DiagramBuilder()
    source, ports = builder.AddNamedSystem("source", Ports()), builder.AddNamedSystem("target", Ports())
    text = builder.AddSystem(PassThrough(Value(1.0)))
    with pytest.raises(RuntimeError, match=r"'y' of System ::source .* has size 2, .*'u' .*::target.* has size 3"):
        builder.Connect(source.get_output_port(0), ports.get_input_port(0))
    with pytest.raises(RuntimeError, match=r"(?i)mix vector-valued and abstract-valued .*'y'.*'a'"):
        builder.Connect(source.get_output_port(0), ports.get_input_port(1))
    with pytest.raises(RuntimeError, match=r"Mismatched value types .*float.*str"):
        builder.Connect(text.get_output_port(), ports.get_input_port(1))
    with pytest.raises(RuntimeError, match="registered using AddSystem"):
        builder.Connect(Gain(1.0, 3).get_output_port(), ports.get_input_port(0))
    builder.ExportInput(ports.get_input_port(0), "in")
    with pytest.raises(RuntimeError, match="already wired"):
        builder.ExportInput(ports.get_input_port(0))
    with pytest.raises(RuntimeError, match="named in already"):
        builder.ExportInput(source.get_input_port(0), "in")
    with pytest.raises(TypeError, match="incompatible"):
        builder.Connect(ports.get_input_port(0), source.get_output_port(0))
    assert builder.connection_map() == {} and builder.num_input_ports() == 1


def test_calls_at_the_wrong_time():
    builder = DiagramBuilder()
    with pytest.raises(RuntimeError, match="empty"):
        builder.Build()
    a, _ = builder.AddNamedSystem("same", Gain(1.0, 1)), builder.AddNamedSystem("same", Gain(1.0, 1))
    with pytest.raises(RuntimeError, match='non-unique name "same"'):
        builder.Build()
    with pytest.raises(RuntimeError, match="belongs to one Diagram"):
        builder.AddSystem(a)
    a.set_name("other")
    diagram = builder.Build()
    for call in (builder.Build, builder.GetSystems, lambda: builder.AddSystem(Gain(1.0, 1)), builder.empty):
        with pytest.raises(RuntimeError, match="already been called"):
            call()
    with pytest.raises(RuntimeError, match="belongs to one Diagram"):
        DiagramBuilder().AddSystem(a)
    assert diagram.GetSystems()[0] is a


def test_a_derived_diagram():
    class Doubled(Diagram):
        def __init__(self):
            super().__init__()
            builder = DiagramBuilder()
            gain = builder.AddSystem(Gain(2.0, 1))
            builder.ExportInput(gain.get_input_port(), "u")
            builder.ExportOutput(gain.get_output_port(), "y")
            builder.BuildInto(self)

    diagram = Doubled()
    context = diagram.CreateDefaultContext()
    diagram.get_input_port().FixValue(context, [4.0])
    assert diagram.GetOutputPort("y").Eval(context) == 8.0


def test_visitors_and_pictures():
    inner = DiagramBuilder()
    gain = inner.AddNamedSystem("gain", Gain(1.0, 1))
    inner.ExportInput(gain.get_input_port(), "u")
    builder = DiagramBuilder()
    sub = builder.AddNamedSystem("inner", inner.Build())
    builder.ExportInput(sub.get_input_port(), "u")
    diagram = builder.Build()

    class Names(SystemVisitor):
        def __init__(self):
            self.seen = []

        def VisitSystem(self, system):
            self.seen.append(system.get_name())

        def VisitDiagram(self, diagram):
            self.seen.append([diagram.get_name()])
            for system in diagram.GetSystems():
                system.Accept(self)

    names = Names()
    diagram.Accept(names)
    assert names.seen == [[""], ["inner"], "gain"]
    text = diagram.GetGraphvizString()
    assert text.startswith("digraph") and "name=gain" in text and text.count("{") == text.count("}")
    assert "name=gain" not in diagram.GetGraphvizString(max_depth=1)


def test_ports_by_name_and_number():
    ports = Ports()
    assert ports.GetInputPort("a").get_data_type() is PortDataType.kAbstractValued
    assert ports.HasInputPort("u") and not ports.HasOutputPort("u")
    with pytest.raises(RuntimeError, match=r"input port named z \(valid port names: u, a\)"):
        ports.GetInputPort("z")
    with pytest.raises(IndexError, match="only 2 input ports"):
        ports.get_input_port(2)
    with pytest.raises(RuntimeError, match="has 2 inputs"):
        ports.get_input_port()
    with pytest.raises(RuntimeError, match="already has an input port named u"):
        ports.DeclareVectorInputPort("u", 1)
    assert ports.get_output_port() is ports.get_output_port(0) or ports.get_output_port().get_index() == 0
