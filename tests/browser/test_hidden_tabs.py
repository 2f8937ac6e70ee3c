"""Twenty tabs of one browser: the one in front draws, the others take messages, and draw right once they are shown."""

import pytest
from chromium import until
from test_meshcat_page import READY, at

from sheldrake.geometry import Box, Meshcat, Rgba

NUM_TABS, NUM_BODIES, ROUNDS, MOST = 20, 50, 60, 1000
FEW = f"window.__sheldrake = {{ channel: null, keys: [], most: {MOST} }};"
WAITING = "window.__viserMutable ? window.__viserMutable.messageQueue.length : 0"


def scene():
    meshcat = Meshcat(port=0)
    for n in range(NUM_BODIES):
        meshcat.SetObject(f"body{n}", Box(0.05, 0.05, 0.05), Rgba(0.2, 0.4, 0.8))
        meshcat.SetTransform(f"body{n}", at(0.1 * n, 0, 0))
    return meshcat


def move(meshcat, z):
    """Bodies move, and something comes and goes under a new name."""
    meshcat.SetObject(f"passing/{z}", Box(0.1, 0.1, 0.1))
    for n in range(NUM_BODIES):
        meshcat.SetTransform(f"body{n}", at(0.1 * n, 0, z))
    meshcat.Flush()
    meshcat.Delete(f"passing/{z}")
    meshcat.Flush()


def shows(tab, z):
    tab.call("Page.bringToFront")
    tab.wait_for("!document.hidden")
    for n in (0, NUM_BODIES - 1):
        tab.wait_until_at(f"/drake/body{n}", [0.1 * n, 0, z])
    names = "Object.entries(window.__viserMutable.nodeRefFromName).filter(([, node]) => node).map(([name]) => name)"
    tab.wait_for(f"{names}.filter((name) => name.startsWith('/drake/body')).length === {2 * NUM_BODIES}")
    tab.wait_for(f"!{names}.some((name) => name.startsWith('/drake/passing/'))")


@pytest.mark.slow
def test_twenty_tabs(chromium):
    meshcat = scene()
    tabs = [chromium.open(meshcat.web_url(), FEW, is_shown=k % 2 == 0) for k in range(NUM_TABS)]
    until(lambda: meshcat.GetNumActiveConnections() == NUM_TABS)
    in_front = tabs[-2]
    shows(in_front, 0)
    for k in range(1, ROUNDS + 1):
        move(meshcat, k / ROUNDS)
    hidden = [tab for tab in tabs if tab is not in_front]
    assert all(tab.evaluate("document.hidden") for tab in hidden)
    assert max(tab.evaluate(WAITING) for tab in hidden) <= MOST
    shows(in_front, 1.0)
    for tab in (tabs[0], tabs[1], tabs[10], tabs[11], tabs[-1]):
        shows(tab, 1.0)
        assert tab.console() == []
    until(lambda: meshcat.GetNumActiveConnections() == NUM_TABS)
    meshcat.AddButton("Kick")
    tabs[1].click_on("[...document.querySelectorAll('button')].find((b) => b.textContent.trim() === 'Kick')")
    until(lambda: meshcat.GetButtonClicks("Kick") == 1)


def test_a_frame_out_of_sight_keeps_up(chromium):
    """As in a notebook that is scrolled away: nothing is drawn there, yet the tab is not hidden."""
    meshcat = scene()
    tab = chromium.open(meshcat.web_url(), FEW)
    tab.wait_for(READY)
    tab.evaluate(
        """const frame = document.createElement("iframe"); frame.src = location.href; frame.id = "frame";
        frame.style = "position: fixed; z-index: 9; width: 300px; height: 200px; left: 10px; top: 10px";
        document.body.append(frame);"""
    )
    viewer = "document.getElementById('frame').contentWindow.__viserMutable"
    tab.wait_for(f"!!{viewer}.nodeRefFromName['/drake/body0']")
    tab.evaluate("document.getElementById('frame').style.display = 'none'")
    longest = 0
    for k in range(1, ROUNDS + 1):
        move(meshcat, k / ROUNDS)
        longest = max(longest, tab.evaluate(f"{viewer}.messageQueue.length"))
    assert 200 < longest <= MOST, "nothing is drawn, and not much is kept"
    tab.evaluate("document.getElementById('frame').style.display = ''")
    height = f"(() => {{ const e = {viewer}.nodeRefFromName['/drake/body0']; return e.position.z; }})()"
    tab.wait_for(f"Math.abs({height} - 1.0) < 1e-6")
    assert tab.console() == []


def test_a_page_that_can_apply_nothing_yet_begins_anew(chromium):
    """As a tab that was never shown: what waits is dropped, and the first picture has the whole scene."""
    meshcat = scene()
    tab = chromium.open(meshcat.web_url(), FEW)
    tab.wait_for(READY)
    tab.wait_until_at("/drake/body0", [0, 0, 0])
    connection = set(meshcat._hub.server._websock_server._client_state_from_id)
    tab.evaluate(
        "const v = window.__viserMutable; window.__drain = v.drainMessageQueue; v.drainMessageQueue = null;"
        "v.getRenderRequestState = 'not yet'; 0"
    )
    for k in range(1, ROUNDS + 1):
        move(meshcat, k / ROUNDS)
        assert tab.evaluate(WAITING) <= MOST
    tab.evaluate("v.getRenderRequestState = 'ready'; v.drainMessageQueue = window.__drain; 0")
    until(lambda: set(meshcat._hub.server._websock_server._client_state_from_id) - connection)
    shows(tab, 1.0)
