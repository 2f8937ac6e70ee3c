"""`sheldrake demo` as a new user meets it: the page opens, then the block falls, and the replay stays until Ctrl-C."""

import signal
import subprocess
import sys
import time

import pytest

NODE = "/drake/visualizer/two_hole_block/body"
WATCH = f"""
window.__seen = [];
setInterval(() => {{
  const viewer = window.__viserMutable, node = viewer && viewer.nodeRefFromName[{NODE!r}];
  if (!node) return;
  node.updateWorldMatrix(true, false);
  const root = viewer.nodeRefFromName[""];
  root.updateWorldMatrix(true, false);
  const z = root.matrixWorld.clone().invert().multiply(node.matrixWorld).elements[14];
  if (z !== 0 && z !== window.__seen.at(-1)) window.__seen.push(z);
}}, 20);
"""
"""Notes each height of the block that the page shows, from the page's first moment on."""
PLAY = "[...document.querySelectorAll('button')].find((b) => b.textContent.trim() === 'Play')"


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGINT there")
def test_whoever_opens_the_page_sees_the_fall_and_keeps_the_replay(chromium, tmp_path):
    command = [sys.executable, "-u", "-m", "sheldrake", "demo", "--no-browser", "--seconds", "4"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as demo:
        try:
            url = demo.stdout.readline().split()[-1]
            page = chromium.open(url, script=WATCH)
            small = {"width": 320, "height": 200, "deviceScaleFactor": 1, "mobile": False}  # a picture costs less
            page.call("Emulation.setDeviceMetricsOverride", **small)
            page.wait_for("window.__seen && __seen.length && Math.abs(__seen.at(-1)) < 1e-3")
            heights = page.evaluate("window.__seen")
            assert heights[0] > 0.36, "the page was open before the fall"
            assert any(0.01 < z < 0.36 for z in heights), "and saw it"
            lines = iter(demo.stdout.readline, "")
            assert any("Ctrl-C ends it" in line for line in lines)
            page.wait_for(f"!!{PLAY}")
            time.sleep(0.5)
            assert demo.poll() is None, "the page stays"
            demo.send_signal(signal.SIGINT)
            assert demo.wait(60) == 0
        finally:
            demo.kill()
    assert {p.suffix for p in (tmp_path / "sheldrake-demo").iterdir()} == {".npz", ".csv", ".png", ".html"}
