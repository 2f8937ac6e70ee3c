"""Pictures of diagrams have the lines that pydrake's have; edges may come in another order."""

import importlib
import re

import pytest

pytest.importorskip("pydrake")
pytestmark = pytest.mark.peer


def nested(name):
    """A diagram in a diagram, with ports that carry nothing."""
    lib = importlib.import_module(f"{name}.all")

    class Leaf(lib.LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareVectorInputPort("empty", 0)
            self.DeclareAbstractInputPort("a<b", lib.Value(""))
            self.DeclareVectorOutputPort("y", 1, lambda context, y: None)

        def DoGetGraphvizFragment(self, params):
            params.header_lines = [*params.header_lines, f"depth={params.max_depth}"]
            return super().DoGetGraphvizFragment(params)

    inner = lib.DiagramBuilder()
    gain = inner.AddNamedSystem("k & <g>", lib.Gain(1.0, 1))
    total = inner.AddNamedSystem("sum", lib.Adder(3, 1))
    inner.Connect(gain.get_output_port(), total.get_input_port(0))
    inner.ExportInput(total.get_input_port(2), "u")
    inner.ConnectInput("u", gain.get_input_port())
    inner.ExportOutput(total.get_output_port(), "y")
    inner.ExportOutput(gain.get_output_port())
    builder = lib.DiagramBuilder()
    source = builder.AddNamedSystem("source", lib.ConstantVectorSource([1.0]))
    diagram = builder.AddNamedSystem("inner", inner.Build())
    builder.AddNamedSystem("leaf", Leaf())
    builder.Connect(source.get_output_port(), diagram.get_input_port())
    builder.ExportOutput(diagram.get_output_port(0), "out")
    return builder.Build()


def lines(name, **arguments):
    """The lines, with systems numbered as they come, edges sorted."""
    text = nested(name).GetGraphvizString(**arguments).replace(f"{__name__}.", "")
    numbers = {}
    text = re.sub(r"(_|\bs|clusters?)(\d+)", lambda m: m[1] + str(numbers.setdefault(m[2], len(numbers))), text)
    return sorted(text.splitlines())


@pytest.mark.parametrize(
    "arguments",
    [
        {},
        {"max_depth": 0},
        {"max_depth": 1, "options": {"split": "I/O"}},
        {"max_depth": 0, "options": {"split": "I/O"}},
        {"options": {"inner/sum/split": "I/O", "source/split": "I/O", "inner/split": "I/O"}},
    ],
)
def test_lines_are_the_same(arguments):
    assert lines("sheldrake", **arguments) == lines("pydrake", **arguments)


def test_fragments_are_the_same():
    ours, theirs = (nested(name).GetGraphvizFragment(max_depth=0) for name in ("sheldrake", "pydrake"))
    for a, b in ((ours.fragments, theirs.fragments), (ours.output_ports, theirs.output_ports)):
        assert [re.sub(r"^s\d+", "s", text) for text in a] == [re.sub(r"^s\d+", "s", text) for text in b]
    base = importlib.import_module("sheldrake.systems.framework").SystemBase
    assert isinstance(ours, base.GraphvizFragment) and base.GraphvizFragmentParams
