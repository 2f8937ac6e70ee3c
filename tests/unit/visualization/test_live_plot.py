"""LivePlot without a page: what would be seen of the last seconds."""

import gc
import weakref

import numpy as np
import pytest

from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import ConstantVectorSource, Integrator, TrajectorySource
from sheldrake.trajectories import PiecewisePolynomial
from sheldrake.visualization import AddLivePlot, LivePlot


def ramp(meshcat, **options):
    builder = DiagramBuilder()
    line = PiecewisePolynomial.FirstOrderHold([0.0, 100.0], np.array([[0.0, 100.0], [0.0, -200.0]]))
    source = builder.AddNamedSystem("ramp", TrajectorySource(line))
    plot = AddLivePlot(builder, source.get_output_port(), meshcat, **options)
    return Simulator(builder.Build()), plot


def test_the_last_seconds_are_seen_and_a_new_start_starts_anew(meshcat):
    simulator, plot = ramp(meshcat, publish_period=0.5, window=2.0)
    simulator.AdvanceTo(1.0)
    (panel,) = plot._panels()
    assert panel.title == "ramp/y0" and panel.labels == ["y0", "y1"]
    assert panel.times == pytest.approx([0, 0.5, 1.0])
    simulator.AdvanceTo(7.0)
    (panel,) = plot._panels()
    assert panel.times == pytest.approx([5.0, 5.5, 6.0, 6.5, 7.0])
    assert panel.rows == pytest.approx(np.array([panel.times, -2 * panel.times]))
    simulator.get_mutable_context().SetTime(0.0)
    simulator.Initialize()
    assert plot._panels()[0].times.tolist() == [0.0]
    plot.Delete()
    assert len(plot._panels()[0].times) == 0


def test_kinds_units_and_noise(meshcat):
    names = ["arm_qw", "arm_qx", "arm_qy", "arm_qz", "arm_x", "speed [m/s]"]
    plot = LivePlot(meshcat, names)
    context = plot.CreateDefaultContext()
    plot.get_input_port().FixValue(context, [np.cos(0.5), 0, 0, np.sin(0.5), 1e-14, 3.0])
    plot.ForcedPublish(context)
    panels = {panel.title: panel for panel in plot._panels()}
    assert list(panels) == ["orientation [deg]", "position [m]", "value [m/s]"]
    assert panels["orientation [deg]"].labels == ["roll", "pitch", "yaw"]
    assert panels["orientation [deg]"].rows[:, 0] == pytest.approx([0, 0, np.degrees(1.0)])
    assert panels["position [m]"].rows.tolist() == [[0.0]], "rounding errors are no motion"


def test_many_lines_are_cut_and_it_is_said(meshcat):
    plot = LivePlot(meshcat, [f"y{i}" for i in range(20)], title="all")
    context = plot.CreateDefaultContext()
    plot.get_input_port().FixValue(context, np.ones(20))
    plot.ForcedPublish(context)
    (panel,) = plot._panels()
    assert panel.title == "all (first 8 of 20)" and len(panel.rows) == 8


def test_a_port_of_one_number_has_its_name(meshcat):
    builder = DiagramBuilder()
    source = builder.AddSystem(ConstantVectorSource([0.5]))
    integrator = builder.AddNamedSystem("distance", Integrator(1))
    builder.Connect(source.get_output_port(), integrator.get_input_port())
    plot = AddLivePlot(builder, integrator.get_output_port(), meshcat, title="way")
    assert plot._names == [integrator.get_output_port().get_name()]


def test_a_plot_that_is_gone_leaves_nothing(meshcat):
    plot = LivePlot(meshcat, ["x"])
    gone = weakref.ref(plot)
    charts = plot._charts
    del plot
    gc.collect()
    assert gone() is None
    charts._send()


def test_wrong_arguments(meshcat):
    with pytest.raises(ValueError, match="names is empty"):
        LivePlot(meshcat, [])
    for times in ({"publish_period": 0.0}, {"publish_period": 2.0, "window": 1.0}):
        with pytest.raises(ValueError, match="0 < publish_period <= window"):
            LivePlot(meshcat, ["x"], **times)
    builder = DiagramBuilder()
    nothing = builder.AddNamedSystem("nothing", ConstantVectorSource([]))
    with pytest.raises(ValueError, match="nothing/y0 has no numbers"):
        AddLivePlot(builder, nothing.get_output_port(), meshcat)
