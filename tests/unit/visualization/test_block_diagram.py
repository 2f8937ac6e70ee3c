"""Block diagrams: nothing overlaps, wires run from port to port around the boxes, all names are there."""

import itertools
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from sheldrake.geometry import SceneGraph
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import Adder, ConstantVectorSource, FirstOrderLowPassFilter, Gain
from sheldrake.visualization import DrawDiagram, DrawTopology
from sheldrake.visualization._layered_layout import Box, Layout, Wire, nearest_with_gaps
from sheldrake.visualization._svg_boxes import _COLORS


def random_graph(seed, n=30):
    """Boxes of random sizes with random wires, some of them backward or around one box."""
    rng = np.random.default_rng(seed)
    boxes = []
    for _ in range(n):
        inputs, outputs = rng.integers(0, 4, 2)
        ports = [[20.0 + 15 * k for k in range(count)] for count in (inputs, outputs)]
        boxes.append(Box(float(rng.integers(60, 200)), 30.0 + 15 * max(inputs, outputs), *ports))
    wires = []
    for v, box in enumerate(boxes):
        for j in range(len(box.inputs)):
            u = int(np.clip(v - rng.integers(-2, 7), 0, n - 1))
            if boxes[u].outputs:
                wires.append(Wire((u, int(rng.integers(len(boxes[u].outputs)))), (v, j)))
    return boxes, wires


def pieces(wire):
    return list(itertools.pairwise(wire.points))


@pytest.mark.parametrize("seed", range(25))
def test_boxes_and_wires_keep_clear_of_each_other(seed):
    boxes, wires = random_graph(seed)
    layout = Layout(boxes, wires)
    for a, b in itertools.combinations(boxes, 2):
        apart = a.x + a.width <= b.x or b.x + b.width <= a.x or a.y + a.height <= b.y or b.y + b.height <= a.y
        assert apart
    for wire in wires:
        (u, i), (v, j) = wire.source, wire.target
        assert wire.points[0] == pytest.approx((boxes[u].x + boxes[u].width, boxes[u].y + boxes[u].outputs[i]))
        assert wire.points[-1] == pytest.approx((boxes[v].x, boxes[v].y + boxes[v].inputs[j]))
        assert wire.points[1][0] > wire.points[0][0] and wire.points[-2][0] < wire.points[-1][0], "out right, in left"
        for (xa, ya), (xb, yb) in pieces(wire):
            assert abs(xa - xb) < 1e-6 or abs(ya - yb) < 1e-6, "horizontal or vertical"
            for box in boxes:
                inside_x = min(xa, xb) < box.x + box.width - 1e-6 and max(xa, xb) > box.x + 1e-6
                inside_y = min(ya, yb) < box.y + box.height - 1e-6 and max(ya, yb) > box.y + 1e-6
                assert not (inside_x and inside_y), "through a box"
    assert all(0 <= x <= layout.width and -1e-9 <= y <= layout.height for w in wires for x, y in w.points)


@pytest.mark.parametrize("seed", range(25))
def test_vertical_pieces_of_different_ports_are_apart(seed):
    _, wires = graph = random_graph(seed)
    Layout(*graph)
    upright = [
        (wire.source, xa, min(ya, yb), max(ya, yb)) for wire in wires for (xa, ya), (xb, yb) in pieces(wire) if xa == xb
    ]
    for (a, xa, low_a, high_a), (b, xb, low_b, high_b) in itertools.combinations(upright, 2):
        if a != b and abs(xa - xb) < 1:
            assert high_a < low_b or high_b < low_a


def test_a_chain_is_straight_and_feedback_goes_below():
    boxes = [Box(50, 40, [20.0], [20.0]) for _ in range(4)]
    wires = [Wire((k, 0), (k + 1, 0)) for k in range(3)] + [Wire((3, 0), (0, 0))]
    Layout(boxes, wires)
    assert [box.layer for box in boxes] == [0, 1, 2, 3] and len({box.y for box in boxes}) == 1
    assert all(len(wire.points) == 2 for wire in wires[:3])
    assert max(y for _, y in wires[3].points) > boxes[0].y + boxes[0].height and len(wires[3].points) == 6


def test_crossings_are_taken_out():
    """Ten wires in reverse order: reordering one side leaves none."""
    boxes = [Box(10, 10, [], [5.0]) for _ in range(10)] + [Box(10, 10, [5.0], []) for _ in range(10)]
    Layout(boxes, [Wire((k, 0), (19 - k, 0)) for k in range(10)])
    assert all(boxes[k].y == boxes[19 - k].y for k in range(10))


def test_nearest_with_gaps_is_the_least_squares_solution():
    assert nearest_with_gaps([0, 0, 0], [1, 1, 1], [2, 2]) == pytest.approx([-2, 0, 2])
    assert nearest_with_gaps([0, 5, 1], [1, 1, 3], [1, 1]) == pytest.approx([0, 1.25, 2.25])
    assert nearest_with_gaps([0, 9], [1, 1], [1]) == [0, 9] and nearest_with_gaps([], [], []) == []


def loop():
    builder = DiagramBuilder()
    gain = builder.AddNamedSystem("gain <1>", Gain(2.0, 1))
    filter_ = builder.AddNamedSystem("filter", FirstOrderLowPassFilter(1.0, 1))
    adder = builder.AddSystem(Adder(2, 1))
    builder.Connect(adder.get_output_port(), gain.get_input_port())
    builder.Connect(gain.get_output_port(), filter_.get_input_port())
    builder.Connect(filter_.get_output_port(), adder.get_input_port(0))
    builder.ExportInput(adder.get_input_port(1), "command")
    builder.ExportOutput(filter_.get_output_port(), "measured")
    diagram = builder.Build()
    diagram.set_name("loop")
    return diagram


def texts(svg):
    return [e.text for e in ElementTree.fromstring(svg).iter() if e.tag.endswith(("text", "title")) and e.text]


def test_all_names_and_connections_are_in_the_picture(tmp_path):
    svg = DrawDiagram(loop(), tmp_path / "loop.svg")
    assert (tmp_path / "loop.svg").read_text(encoding="utf-8") == svg
    found = texts(svg)
    for name in ("loop", "gain <1>", "Gain", "filter", "Adder", "command", "measured", "u1", "sum"):
        assert name in found
    for wire in ("Adder.sum → gain <1>.y0", "command → Adder.u1", "filter.y0 → measured"):
        assert wire.replace("y0", "u0") in found or wire in found


def test_parts_have_pictures_of_their_own_that_a_click_leads_to():
    builder = DiagramBuilder()
    inner = builder.AddSystem(loop())
    source = builder.AddNamedSystem("source", ConstantVectorSource([1.0]))
    builder.Connect(source.get_output_port(), inner.get_input_port())
    outer = builder.Build()
    svg = DrawDiagram(outer)
    root = ElementTree.fromstring(svg)
    levels = {e.get("id"): e for e in root if e.tag.endswith("svg")}
    assert len(levels) == 2 and [e.get("display") for e in levels.values()] == [None, "none"]
    links = {e.get("href") for e in root.iter() if e.tag.endswith("}a")}
    assert links == {f"#{name}" for name in levels}, "into the part, and back"


def test_systems_can_be_left_out():
    builder = DiagramBuilder()
    gains = [builder.AddNamedSystem(f"gain{i}", Gain(1.0, 1)) for i in range(3)]
    builder.Connect(gains[0].get_output_port(), gains[1].get_input_port())
    builder.Connect(gains[0].get_output_port(), gains[2].get_input_port())
    builder.ExportOutput(gains[1].get_output_port(), "gone")
    builder.ExportOutput(gains[2].get_output_port(), "stays")
    svg = DrawDiagram(builder.Build(), leave_out=lambda system: system.get_name() == "gain1")
    found = texts(svg)
    assert "gain1" not in found and "gone" not in found and "stays" in found and "gain2" in found
    assert svg.count('class="hit"') == 2


def test_a_crowd_of_unconnected_ports_is_counted():
    builder = DiagramBuilder()
    adder = builder.AddNamedSystem("adder", Adder(20, 1))
    source = builder.AddNamedSystem("source", ConstantVectorSource([1.0]))
    builder.Connect(source.get_output_port(), adder.get_input_port(7))
    found = texts(DrawDiagram(builder.Build()))
    assert "+ 19 unconnected" in found and "u7" in found and "u8" not in found


def test_a_system_alone_and_a_notebook():
    assert "SceneGraph" in texts(DrawDiagram(SceneGraph()))
    diagram = loop()
    assert diagram._repr_svg_() == DrawDiagram(diagram)


def test_thirty_systems_fit_a_readable_picture():
    boxes, wires = random_graph(3, 30)
    layout = Layout(boxes, wires)
    assert layout.width < 6000 and layout.height < 3000 and len({box.layer for box in boxes}) > 3


ARM = """<robot name='arm'><link name='world'/><link name='rod'><inertial><mass value='2.5'/>
<inertia ixx='.1' iyy='.1' izz='.1' ixy='0' ixz='0' iyz='0'/></inertial></link><link name='ball'/>
<joint name='turn' type='revolute'><axis xyz='0 0 1'/><parent link='world'/><child link='rod'/>
<limit lower='-1' upper='2' effort='1' velocity='1'/></joint>
<transmission type='SimpleTransmission'><joint name='turn'/><actuator name='motor'>
<mechanicalReduction>1</mechanicalReduction></actuator></transmission></robot>"""


def test_bodies_and_joints_of_a_plant(tmp_path):
    plant, _ = AddMultibodyPlantSceneGraph(DiagramBuilder(), 0.0)
    Parser(plant).AddModelsFromString(ARM, "urdf")
    with pytest.raises(RuntimeError, match="Finalize"):
        DrawTopology(plant)
    assert plant._repr_svg_() is None
    plant.Finalize()
    assert plant._repr_svg_() == DrawTopology(plant), "notebooks show it"
    svg = DrawTopology(plant, tmp_path / "arm.svg")
    assert (tmp_path / "arm.svg").read_text(encoding="utf-8") == svg
    found = texts(svg)
    for text in ("world", "rod", "arm · 2.5 kg", "turn (revolute, driven)", "ball (quaternion_floating)"):
        assert text in found
    assert "world → rod: turn, revolute, from -1 to 2" in found


def luminance(color):
    """Relative luminance of "#rgb" or "#rrggbb", as WCAG 2 defines it."""
    digits = color[1:] if len(color) == 7 else "".join(2 * c for c in color[1:])
    channels = np.array([int(digits[k : k + 2], 16) / 255 for k in (0, 2, 4)])
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


@pytest.mark.parametrize("dark", [False, True])
def test_colors_can_be_told_apart_on_light_and_dark_paper(dark):
    color = {(name, what): colors[dark] for name, what, *colors in _COLORS}

    def contrast(a, b):
        low, high = sorted((luminance(color[a]), luminance(color[b])))
        return (high + 0.05) / (low + 0.05)

    paper, ink = (".paper", "fill"), ("", "fill")
    grounds = [paper, (".box", "fill"), (".inner", "fill"), (".header", "fill"), (".inner+.header", "fill")]
    assert (luminance(color[paper]) < 0.1) == dark
    for ground in grounds:
        assert contrast(ink, ground) > 7.0
    for text, on in ((".kind", grounds[3]), (".kind", grounds[4]), (".free", grounds[1]), (".link", paper)):
        assert contrast((text, "fill"), on) > 4.5, text
    for line in (".box", ".inner", ".wire", ".back", ".input", ".output", "g.w:hover .wire"):
        assert contrast((line, "stroke"), paper) > 3.0, line


def test_a_page_with_a_switch_of_its_own_says_which_paper():
    text = DrawDiagram(loop())
    before, _, after = text.partition("@media (prefers-color-scheme:dark)")
    assert ".shd .paper{fill:#fff}" in before and ".shd .paper{fill:#161b22}" in after
    for page, paper in (("[data-jp-theme-light=true]", "#fff"), ("[data-jp-theme-light=false]", "#161b22")):
        assert any(page in line and ".paper{" in line and paper in line for line in after.splitlines())
