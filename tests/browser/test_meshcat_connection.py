"""A page that loses its server for a moment, and a page with a gamepad."""

import asyncio

from chromium import until
from test_meshcat_page import READY, at

from sheldrake.geometry import Box, Meshcat, Rgba

PAD = """
  window.__pad = { index: 0, buttons: [{ value: 0 }, { value: 1 }], axes: [0.25, -1] };
  navigator.getGamepads = () => [null, window.__pad];
"""


def drop_connections(meshcat):
    """Closes every connection from the server's side, as a network that goes away for a moment does."""
    server = meshcat._hub.server

    async def drop():
        for connection in list(server._websock_server._live_connections.values()):
            await connection.close(1011)

    asyncio.run_coroutine_threadsafe(drop(), server.get_event_loop()).result(60)


def test_a_page_that_lost_its_server_comes_back_to_the_scene_as_it_is(chromium):
    meshcat = Meshcat(port=0)
    for name in ("moves", "goes"):
        meshcat.SetObject(name, Box(0.2, 0.2, 0.2), Rgba(0.2, 0.4, 0.8))
    meshcat.AddButton("Kick", "KeyK")
    meshcat.AddSlider("speed", 0.0, 10.0, 0.5, 2.0)
    page = chromium.open(meshcat.web_url())
    page.wait_for(READY)
    page.wait_until_at("/drake/moves", [0, 0, 0])
    connection = next(iter(meshcat._hub.server._websock_server._client_state_from_id))
    drop_connections(meshcat)
    meshcat.SetTransform("moves", at(0, 0, 0.5))
    meshcat.Delete("goes")
    meshcat.SetObject("comes", Box(0.1, 0.1, 0.1))
    meshcat.SetSliderValue("speed", 7.5)
    until(lambda: set(meshcat._hub.server._websock_server._client_state_from_id) - {connection})
    page.wait_until_at("/drake/moves", [0, 0, 0.5])
    page.wait_until_at("/drake/comes", [0, 0, 0])
    page.wait_for("!window.__viserMutable.nodeRefFromName['/drake/goes']")
    page.wait_for("[...document.querySelectorAll('input')].some((i) => i.value === '7.5')")
    page.click_on("[...document.querySelectorAll('button')].find((b) => b.textContent.trim() === 'Kick')")
    until(lambda: meshcat.GetButtonClicks("Kick") == 1)
    page.press("k", "KeyK")
    until(lambda: meshcat.GetButtonClicks("Kick") == 2)
    assert meshcat.GetNumActiveConnections() == 1


def test_a_gamepad_is_heard(chromium):
    meshcat = Meshcat(port=0)
    page = chromium.open(meshcat.web_url())
    page.wait_for(READY)
    assert meshcat.GetGamepad().index is None
    page.evaluate(PAD)
    until(lambda: meshcat.GetGamepad().index == 0)
    pad = meshcat.GetGamepad()
    assert (pad.button_values, pad.axes) == ([0.0, 1.0], [0.25, -1.0])
    page.evaluate("window.__pad.axes[1] = 0.5")
    until(lambda: meshcat.GetGamepad().axes == [0.25, 0.5])
