"""Twenty pages look at one simulation: all see it, it pays next to nothing, and late joiners see all.

They are two tabs with nine more pages in frames each: what lies behind another tab draws nothing, and a process of the
browser draws sixteen scenes at most.
"""

import json
import time

import pytest
from chromium import until
from test_meshcat_page import READY

from sheldrake.geometry import Box, Meshcat, MeshcatVisualizer
from sheldrake.math import RigidTransform
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.multibody.tree import SpatialInertia
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder

NUM_FRAMES, NUM_BODIES, SECONDS = 9, 60, 10.0
SHARE = 0.05  # of a core, at most, that showing 60 bodies at 64 Hz may take from a simulation
PATHS = "/drake/visualizer"
SELDOM = """const draw = requestAnimationFrame;  // without a graphics card twenty pages draw twice a second at most
window.requestAnimationFrame = (f) => setTimeout(() => draw(f), 500);"""


def falling_boxes(meshcat):
    """Sixty boxes fall freely, without gravity's end."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1 / 256)
    for i in range(NUM_BODIES):
        body = plant.AddRigidBody(f"box{i}", SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 0.1))
        color = [0.2 + 0.6 * (i % 8) / 8, 0.4, 0.8, 1.0]
        plant.RegisterVisualGeometry(body, RigidTransform(), Box(0.1, 0.1, 0.1), "look", color)
        plant.SetDefaultFloatingBaseBodyPose(body, RigidTransform([0.2 * (i % 8), 0.2 * (i // 8), 0.0]))
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, -1e-3])
    plant.Finalize()
    if meshcat is not None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(1.0)  # what is loaded and compiled once is no cost of a step
    return simulator, plant


def processor_time(simulator):
    """Time of a processor that the simulating thread takes [s]: no other thread's, and no waiting."""
    begin = time.thread_time()
    simulator.AdvanceTo(simulator.get_context().get_time() + SECONDS)
    return time.thread_time() - begin


def open_ten(chromium, meshcat):
    """A tab with ten pages."""
    tab = chromium.open(meshcat.web_url(), SELDOM)
    tab.wait_for(READY)
    tab.call("Network.disable")  # what the pages get would all be told here
    tab.evaluate(
        f"""for (let k = 0; k < {NUM_FRAMES}; k++) {{
          const frame = document.createElement("iframe");
          frame.src = location.href;
          frame.style = `position: fixed; z-index: 9; width: 150px; height: 110px; left: ${{10 + 160 * (k % 3)}}px;` +
            `top: ${{100 + 120 * Math.floor(k / 3)}}px; border: 1px solid gray`;
          document.body.append(frame);
        }}
        window.__pages = () => [window, ...[...document.querySelectorAll("iframe")].map((f) => f.contentWindow)];"""
    )
    return tab


def all_see(tab, simulator, plant):
    """Waits until each page of a tab shows all bodies, the first and the last where they are."""
    context = plant.GetMyContextFromRoot(simulator.get_context())
    heights = {
        f"{PATHS}/{name}": plant.EvalBodyPoseInWorld(context, plant.GetBodyByName(name)).translation()[2]
        for name in ("box0", f"box{NUM_BODIES - 1}")
    }
    tab.call("Page.bringToFront")
    tab.wait_for(
        f"""__pages().every((page) => {{
          const nodes = page.__viserMutable.nodeRefFromName, root = nodes[""];
          const boxes = Object.keys(nodes).filter((n) => nodes[n] && /^.drake.visualizer.box[0-9]+$/.test(n));
          root.updateWorldMatrix(true, false);
          const height = (name) => {{
            nodes[name].updateWorldMatrix(true, false);
            return root.matrixWorld.clone().invert().multiply(nodes[name].matrixWorld).elements[14];
          }};
          return boxes.length === {NUM_BODIES} &&
            Object.entries({json.dumps(heights)}).every(([name, z]) => Math.abs(height(name) - z) < 1e-5);
        }})"""
    )


@pytest.mark.slow
def test_twenty_pages_and_a_late_one(chromium):
    alone = processor_time(falling_boxes(None)[0])
    meshcat = Meshcat(port=0)
    simulator, plant = falling_boxes(meshcat)
    tabs = [open_ten(chromium, meshcat) for _ in range(2)]
    until(lambda: meshcat.GetNumActiveConnections() == 2 * (1 + NUM_FRAMES))
    watched = processor_time(simulator)
    assert watched - alone < SHARE * SECONDS, f"{watched - alone} s of {SECONDS} s"
    for tab in tabs:
        all_see(tab, simulator, plant)

    # A long session: things come and go under ever new names.
    server = meshcat._hub.server
    kept = server._websock_server._broadcast_buffer.message_from_id
    before = len(kept)
    for k in range(1500):
        meshcat.SetObject(f"passing/{k}", Box(0.1, 0.1, 0.1))
        meshcat.AddSlider(f"gain {k}", 0.0, 1.0, 0.1, 0.5, "", "KeyG")
        meshcat._hub.page.sync()
        meshcat.DeleteSlider(f"gain {k}")
        meshcat.Delete(f"passing/{k}")
        meshcat._hub.page.sync()

    def is_forgotten():
        server._run_garbage_collector()
        return len(kept) < before + 50

    chromium.close_page(tabs[0])
    until(is_forgotten)  # once the pages have read it
    simulator.AdvanceTo(simulator.get_context().get_time() + 1.0)
    late = open_ten(chromium, meshcat)
    until(lambda: meshcat.GetNumActiveConnections() == 2 * (1 + NUM_FRAMES))
    for tab in (late, tabs[1]):
        all_see(tab, simulator, plant)
    names = "Object.keys(__viserMutable.nodeRefFromName)"
    assert late.evaluate(f"{names}.filter((n) => n.startsWith('/drake/passing/')).length") == 0
    assert late.console() == [] and tabs[1].console() == []
