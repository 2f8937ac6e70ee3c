"""Drawings of planar systems."""

import numpy as np
import pytest

from sheldrake.systems.analysis import Simulator
from sheldrake.systems.drawing import plot_graphviz
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import LogVectorOutput, Sine
from sheldrake.systems.pyplot_visualizer import PyPlotVisualizer

matplotlib = pytest.importorskip("matplotlib")
matplotlib.use("agg")


class Dot(PyPlotVisualizer):
    """Keeps where it would draw."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.DeclareVectorInputPort("x", 2)
        self.drawn = []

    def draw(self, context):
        value = context if isinstance(context, np.ndarray) else self.get_input_port().Eval(context)
        self.drawn.append(value.tolist())


def scene(**kwargs):
    builder = DiagramBuilder()
    wave, dot = builder.AddSystem(Sine(1.0, 2.0, 0.0, 2)), builder.AddSystem(Dot(draw_period=0.1, **kwargs))
    builder.Connect(wave.get_output_port(0), dot.get_input_port())
    sink = LogVectorOutput(wave.get_output_port(0), builder)
    return Simulator(builder.Build()), dot, sink


def test_draws_at_the_start_and_with_its_period():
    simulator, dot, _ = scene()
    simulator.AdvanceTo(0.35)
    times = np.append(0.0, np.arange(4) * 0.1)  # initialization publishes too, as in Drake
    np.testing.assert_allclose(np.array(dot.drawn)[:, 0], np.sin(2.0 * times), rtol=1e-12)


def test_draws_while_it_records():
    simulator, dot, _ = scene()
    dot.start_recording()
    simulator.AdvanceTo(0.25)
    assert len(dot.drawn) == len(dot._recorded_contexts) == 4


def test_does_not_draw_what_nobody_is_shown():
    simulator, dot, _ = scene(show=False)
    simulator.AdvanceTo(0.35)
    assert dot.drawn == []


def test_records_and_animates():
    simulator, dot, sink = scene(show=False)
    dot.start_recording()
    simulator.AdvanceTo(0.5)
    dot.stop_recording()
    assert dot.drawn == []
    film = dot.get_recording_as_animation(repeat=False)
    film._draw_frame(4)
    assert dot.drawn[-1][0] == pytest.approx(np.sin(0.6))
    film._draw_was_started = True  # silences matplotlib: nobody renders it
    film = dot.animate(sink.FindLog(simulator.get_context()), repeat=False)
    film._draw_frame(2)
    assert dot.drawn[-1][0] == pytest.approx(np.sin(0.4))
    film._draw_was_started = True
    dot.reset_recording()


def test_graphviz_needs_pydot(monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "pydot", None)
    with pytest.raises(ImportError, match="needs pydot"):
        plot_graphviz("digraph {}")


def test_a_notebook_shows_graphviz_as_svg(monkeypatch):
    import importlib
    import sys
    from types import SimpleNamespace

    from sheldrake.systems import drawing

    shown = []
    page = SimpleNamespace(SVG=lambda data: ("svg", data), display=shown.append)
    python = SimpleNamespace(get_ipython=lambda: SimpleNamespace(kernel=1), display=page)
    graph = SimpleNamespace(create_svg=lambda: "<svg/>")
    assert not drawing.running_as_notebook
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "IPython", python)
        patch.setitem(sys.modules, "IPython.display", page)
        patch.setitem(sys.modules, "pydot", SimpleNamespace(graph_from_dot_data=lambda text: [graph]))
        importlib.reload(drawing)
        drawing.plot_graphviz("digraph {}")
    importlib.reload(drawing)
    assert shown == [("svg", "<svg/>")] and not drawing.running_as_notebook
