"""Plots that follow a simulation in the page."""

import time

import numpy as np
import pytest
from chromium import until
from test_accessible_pages import keeps_the_rules
from test_meshcat_page import READY

from sheldrake import model_path
from sheldrake.geometry import Meshcat
from sheldrake.math import RigidTransform
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.visualization import AddDefaultVisualization, AddLivePlot

CHARTS = """Object.values((window.__viserTestpoints || {}).uplots || {}).map((u) =>
  ({ titles: u.chart.series.map((s) => s.label), data: u.chart.data.map((row) => [...row]) }))"""


def falling_block(meshcat):
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
    (block,) = Parser(plant).AddModels(model_path("two_hole_block/two_hole_block.urdf"))
    plant.Finalize()
    plant.SetDefaultFloatingBaseBodyPose(plant.GetBodyByName("body"), RigidTransform([0, 0, 2]))
    AddDefaultVisualization(builder, meshcat)
    plot = AddLivePlot(builder, plant.get_state_output_port(block), meshcat, title="block")
    return Simulator(builder.Build()), plot


def test_the_fall_is_plotted_while_it_happens(chromium, pictures):
    meshcat = Meshcat(port=0)
    simulator, plot = falling_block(meshcat)
    page = chromium.open(meshcat.web_url())
    page.wait_for(READY)

    def chart(label):
        return next((c for c in page.evaluate(CHARTS) or () if label in c["titles"]), None)

    def last_time():
        found = chart("vz")
        return found["data"][0][-1] if found else None

    simulator.AdvanceTo(0.25)
    until(lambda: last_time() == pytest.approx(0.25))
    simulator.AdvanceTo(0.5)
    until(lambda: last_time() == pytest.approx(0.5))
    page.wait_for("document.body.innerText.includes('block: orientation [deg]')")
    seen = chart("vz")
    times, vz = np.array(seen["data"][0]), np.array(seen["data"][seen["titles"].index("vz")])
    assert len(times) == 17
    assert vz == pytest.approx(-9.81 * times, abs=9.81e-3), "the plant steps every millisecond"
    height = chart("z")
    assert height["titles"] == ["t [s]", "x", "y", "z"]
    time.sleep(0.5)
    page.screenshot(pictures, "live-plot.png", 1200, 1000)
    keeps_the_rules(page)

    simulator.get_mutable_context().SetTime(0.0)
    simulator.Initialize()
    until(lambda: last_time() == 0.0)
    plot.Delete()
    page.wait_for("!Object.keys(window.__viserTestpoints.uplots).length")
    assert page.console() == []
