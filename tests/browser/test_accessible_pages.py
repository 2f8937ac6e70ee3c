"""Every page keeps the rules of accessibility that axe-core checks."""

import json
import pathlib

import pytest
from chromium import until
from test_meshcat_page import READY

import sheldrake
from sheldrake.cad import MakeUrdfFromMesh
from sheldrake.geometry import Box, Meshcat, Rgba
from sheldrake.math import RigidTransform
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.report import SaveReport
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import LogVectorOutput
from sheldrake.visualization import DrawDiagram, DrawTopology

axe = pytest.importorskip("axe_core_python")
BLOCK = pathlib.Path(sheldrake.__file__).parent / "models" / "two_hole_block"


def violations(page):
    """Returns the rules a page breaks, with the elements that do."""
    page.evaluate((pathlib.Path(axe.__file__).parent / "axe.min.js").read_text(encoding="utf-8") + "; 0")
    return page.evaluate(
        "axe.run(document, {iframes: false}).then((r) => r.violations.map("
        "(v) => [v.id, ...v.nodes.map((n) => n.html.slice(0, 200))]))"
    )


def keeps_the_rules(page):
    """Waits until a page breaks no rule: names come to elements a moment after the elements."""
    seen = []

    def clean():
        seen[:] = violations(page)
        return not seen

    try:
        until(clean, 30)
    except AssertionError:
        raise AssertionError(json.dumps(seen, indent=1)) from None


def test_the_rules_find_a_planted_fault(chromium, tmp_path):
    path = tmp_path / "bad.html"
    path.write_text("<!doctype html><html lang='en'><title>t</title><main><h1>h</h1><button></button></main></html>")
    page = chromium.open(path.as_uri())
    page.wait_for("document.readyState === 'complete'")
    assert [rule for rule, *_ in violations(page)] == ["button-name"]


def scene():
    meshcat = Meshcat(port=0)
    meshcat.SetObject("box", Box(0.5, 0.5, 0.5), Rgba(0.2, 0.4, 0.8))
    meshcat.StartRecording()
    for t in (0.0, 1.0):
        meshcat.SetTransform("box", RigidTransform([0, 0, t]), t)
    meshcat.StopRecording()
    return meshcat


def test_the_page_with_controls_and_player(chromium):
    meshcat = scene()
    meshcat.AddButton("Go", "KeyG")
    meshcat.AddSlider("angle [rad]", -1, 1, 0.1, 0.5, "KeyA", "KeyD")
    meshcat.PublishRecording()
    page = chromium.open(meshcat.web_url())
    page.wait_for(READY)
    page.wait_for("[...document.querySelectorAll('button')].some((b) => b.textContent.trim() === 'Go')")
    keeps_the_rules(page)
    assert page.evaluate("document.querySelector('[role=slider]').ariaLabel") == "angle [rad]"


def test_the_saved_scene_and_its_player(chromium, tmp_path):
    meshcat = scene()
    meshcat.PublishRecording()
    (tmp_path / "scene.html").write_text(meshcat.StaticHtml(), encoding="utf-8")
    page = chromium.open((tmp_path / "scene.html").as_uri())
    page.wait_for("!!document.querySelector('[role=slider]')")
    keeps_the_rules(page)


def falling_block():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
    Parser(plant).AddModels(str(BLOCK / "two_hole_block.urdf"))
    plant.Finalize()
    LogVectorOutput(plant.get_state_output_port(), builder, publish_period=0.01)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.1)
    return simulator, plant


def test_report_and_pictures(chromium, tmp_path):
    simulator, plant = falling_block()
    SaveReport(simulator, tmp_path / "report.html", title="A block falls")
    page = chromium.open((tmp_path / "report.html").as_uri())
    page.wait_for("window.report && !window.report.changed")
    keeps_the_rules(page)
    for name, svg in (("diagram", DrawDiagram(simulator.get_system())), ("topology", DrawTopology(plant))):
        path = tmp_path / f"{name}.html"
        html = f"<!doctype html><html lang='en'><title>t</title><main><h1>h</h1>{svg}</main></html>"
        path.write_text(html, encoding="utf-8")
        page = chromium.open(path.as_uri())
        page.wait_for("!!document.querySelector('svg')")
        keeps_the_rules(page)


def test_the_preview_of_a_part_from_cad(chromium, tmp_path, pictures):
    preview = tmp_path / "block.html"
    mesh, output = BLOCK / "two_hole_block.obj", tmp_path / "block.urdf"
    MakeUrdfFromMesh(mesh, units="mm", mass=0.77, output=output, preview=preview)
    page = chromium.open(preview.as_uri())
    page.wait_for("!!document.querySelector('canvas') && !!(window.__viserMutable && window.__viserMutable.scene)")
    assert page.evaluate("document.querySelector('h1').textContent") == "block: 80 x 40 x 30 mm, 0.77 kg"
    keeps_the_rules(page)
    page.screenshot(pictures, "preview.png")
