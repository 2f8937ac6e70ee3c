"""The real scene in the page: the plant's block falls and rests, live and in the replay that needs no network."""

from __future__ import annotations

import numpy as np
from chromium import until
from test_meshcat_page import READY
from tests.scenes.scene import drop, library

import sheldrake
from sheldrake.geometry import Meshcat
from sheldrake.multibody.math import SpatialVelocity

BLOCK = sheldrake.model_path("two_hole_block/two_hole_block.urdf")
NODE = "/drake/visualizer/two_hole_block/body"


def test_the_page_sees_the_block_fall_and_rest(chromium, pictures):
    meshcat = Meshcat()
    simulator, _, plant, _ = drop(library("sheldrake"), BLOCK, meshcat=meshcat)
    page = chromium.open(meshcat.web_url())
    page.wait_for(READY)
    page.wait_until_at(NODE, [None, None, 0.1])
    context = plant.GetMyContextFromRoot(simulator.get_context())
    heights = []
    for t in (0.05, 0.1, 0.13, 3.0):
        simulator.AdvanceTo(t)
        simulator.get_system().ForcedPublish(simulator.get_context())
        meshcat.Flush()
        heights.append(plant.GetPositions(context)[6])
        page.wait_until_at(NODE, [None, None, heights[-1]])
    assert heights == sorted(heights, reverse=True)
    assert heights[0] > 0.08 and abs(heights[-1]) < 1e-4
    assert np.abs(plant.GetVelocities(context)).max() < 1e-9
    page.screenshot(pictures, "dropped.png")
    assert page.console() == []


def test_the_replay_of_the_drop_opens_without_a_network(offline_chromium, tmp_path, pictures):
    meshcat = Meshcat()
    simulator, _, plant, _ = drop(library("sheldrake"), BLOCK, meshcat=meshcat)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    up = SpatialVelocity(w=np.zeros(3), v=[0.0, 0.0, 5.0])  # in the air for a third of the recording: any page sees it
    plant.SetFreeBodySpatialVelocity(context, plant.GetBodyByName("body"), up)
    meshcat.StartRecording()
    simulator.AdvanceTo(3.0)
    meshcat.StopRecording()
    meshcat.PublishRecording()
    file = tmp_path / "drop.html"
    file.write_text(meshcat.StaticHtml(), encoding="utf-8")
    assert file.stat().st_size < 3_000_000
    page = offline_chromium.open(file.as_uri())
    page.wait_for(READY)
    page.watch(NODE)
    until(lambda: max((z for _, _, z in page.watched()), default=0) > 0.05, 120)
    page.wait_until_at(NODE, [None, None, plant.GetPositions(context)[6]], 1e-4, 120)
    page.screenshot(pictures, "replay-of-drop.png")
    assert [url for url in page.requests() if not url.startswith("file:")] == []
