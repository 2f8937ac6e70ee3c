"""Every description of a real robot, opened in a browser: it fills a good part of the picture and is in its middle.

With SHELDRAKE_PICTURES set, one picture of all robots, `robots.png`, is left in that folder.
"""

from __future__ import annotations

import base64
import io
import json
import os
from pathlib import Path

import numpy as np
import pytest
from real_robots import robot_files
from test_robot_files import WRONG
from tests.browser.chromium import Chromium, executable

from sheldrake.geometry import Meshcat
from sheldrake.visualization import ModelVisualizer

Image = pytest.importorskip("PIL.Image")
pytestmark = [pytest.mark.browser, pytest.mark.slow, pytest.mark.usefixtures("quiet")]

FILES = [path for path in robot_files("urdf", "sdf") if path.name not in WRONG and path.name != "ur3.urdf"]
"""Those that can be read, but for one without links."""
WIDTH, HEIGHT = 480, 360
READY = "!!(window.__viserMutable && window.__viserMutable.scene && window.__viserMutable.nodeRefFromName['/Grid'])"
IS_DRAWN = """
  const node = window.__viserMutable.nodeRefFromName[name];
  if (node) node.traverse((o) => { drawn = drawn || o.isMesh || o.isLine || o.isPoints; })
"""
IS_LIT = """
(async () => {
  const { scene, canvas } = window.__viserMutable, light = scene.environment;
  await new Promise((later) => setTimeout(later, 3000));  // viser's own light comes first, and then ours
  return light && scene.environment === light && canvas.style.opacity === "1";
})()
"""
DRAWN = """
(async () => {
  const next = () => new Promise((drawn) => requestAnimationFrame(drawn));
  window.__viserMutable.requestRender();
  for (let k = 0; k < 3; k++) await next();
  const gl = window.__viserMutable.canvas.getContext("webgl2");  // waits until all that was asked for is drawn
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
})()
"""
HIDE_PANEL = """
(() => {
  const style = document.createElement("style");
  style.textContent = "body *:not(:has(canvas)):not(canvas) { visibility: hidden !important }";
  document.head.append(style);
})()
"""


class OnePage:
    """A page of a browser in which scenes are looked at one after the other: loading it takes longer than all else."""

    def __init__(self, browser):
        self.meshcat = Meshcat(port=0)
        self._page = browser.open(f"{self.meshcat.web_url()}?fixedDpr=1")  # else pixels grow while drawing is slow
        self._page.call(
            "Emulation.setDeviceMetricsOverride", width=WIDTH, height=HEIGHT, deviceScaleFactor=1, mobile=False
        )
        self._page.wait_for(READY)
        self._page.wait_for(IS_LIT)
        self._page.evaluate(HIDE_PANEL)

    def show(self, path):
        """Shows a model as `sheldrake view` does, as soon as its page is opened."""
        self.meshcat.Delete()
        visualizer = ModelVisualizer(meshcat=self.meshcat, publish_contacts=False, simulate=True)
        visualizer.AddModels(str(path))
        visualizer.Finalize()
        self.meshcat.ResetRenderMode()
        scene = self.meshcat._hub.page
        scene.sync()
        scene.stage.frame_scene(scene.outline)
        objects = json.dumps([f"{path}/<object>" for path in scene._drawn])
        self._page.wait_for(f"{objects}.every((name) => {{ let drawn = false; {IS_DRAWN}; return drawn; }})")

    def picture(self, visible):
        """What is seen with the models or without them, shape (HEIGHT, WIDTH, 3), once it stands still."""
        self.meshcat.SetProperty("", "visible", visible)
        self.meshcat.Flush()
        self._page.wait_for(f"window.__viserMutable.nodeRefFromName['/drake'].visible === {json.dumps(visible)}")
        before = None
        while True:
            self._page.evaluate(DRAWN)
            data = base64.b64decode(self._page.call("Page.captureScreenshot", format="png")["data"])
            picture = np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))
            if before is not None and np.array_equal(picture, before):
                return picture
            before = picture


@pytest.fixture(scope="module")
def one_page():
    if executable() is None:
        pytest.skip("no Chromium found; on Debian: apt-get install chromium")
    with Chromium(WIDTH, HEIGHT) as browser:
        yield OnePage(browser)


PICTURES: dict[str, np.ndarray] = {}


def save_sheet(path, columns=8, size=(240, 180)):
    """Writes all pictures so far in one, with their names."""
    from PIL import ImageDraw

    rows = -(-len(PICTURES) // columns)
    sheet = Image.new("RGB", (columns * size[0], rows * size[1]), "white")
    pen = ImageDraw.Draw(sheet)
    for n, (name, picture) in enumerate(PICTURES.items()):
        corner = (n % columns * size[0], n // columns * size[1])
        sheet.paste(Image.fromarray(picture).resize(size), corner)
        pen.text((corner[0] + 4, corner[1] + 4), name, fill="black")
    path.parent.mkdir(parents=True, exist_ok=True)
    sheet.save(path)


def extent(pixels):
    """First and last row and column of what is true, as shares of the picture: shape (2, 2)."""
    sides = [np.flatnonzero(pixels.any(axis=axis)) for axis in (1, 0)]
    return np.array([(side[0] / n, (side[-1] + 1) / n) for side, n in zip(sides, pixels.shape)])


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parts[-3]}-{path.name}")
def test_a_robot_fills_the_picture_and_stands_in_its_middle(path, one_page):
    one_page.show(path)
    without, picture = one_page.picture(False), one_page.picture(True)
    PICTURES[f"{path.parts[-3]}/{path.name}"] = picture
    if "SHELDRAKE_PICTURES" in os.environ:
        save_sheet(Path(os.environ["SHELDRAKE_PICTURES"]) / "robots.png")
    differs = (np.abs(picture.astype(int) - without) > 6).any(axis=2)
    assert differs.any(), "nothing is seen"
    seen = extent(differs)
    filled, middle = np.diff(seen, axis=1).ravel(), seen.mean(axis=1)
    assert 0.2 < filled.max() < 0.8 and filled.min() < 0.8, f"fills {filled.round(2)} of the height and width"
    assert np.abs(middle - 0.5).max() < 0.15, f"its middle is at {middle.round(2)} of the height and width"
