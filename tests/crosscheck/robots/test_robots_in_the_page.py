"""Every description of a real robot, opened in a browser: it fills a good part of the picture and is in its middle.

With SHELDRAKE_PICTURES set, one picture of all robots, `robots.png`, is left in that folder.
"""

from __future__ import annotations

import base64
import io
import os
import time
from pathlib import Path

import numpy as np
import pytest
from real_robots import robot_files
from test_robot_files import WRONG
from tests.browser.chromium import Chromium, executable

from sheldrake.visualization import ModelVisualizer

Image = pytest.importorskip("PIL.Image")
pytestmark = [pytest.mark.browser, pytest.mark.slow, pytest.mark.usefixtures("quiet")]

FILES = [path for path in robot_files("urdf", "sdf") if path.name not in WRONG and path.name != "ur3.urdf"]
"""Those that can be read, but for one without links."""
WIDTH, HEIGHT = 480, 360
READY = "!!(window.__viserMutable && window.__viserMutable.scene && window.__viserMutable.nodeRefFromName['/Grid'])"
HIDE_PANEL = """
(() => {
  const style = document.createElement("style");
  style.textContent = "body *:not(:has(canvas)):not(canvas) { visibility: hidden !important }";
  document.head.append(style);
})()
"""


@pytest.fixture(scope="module")
def chromium():
    if executable() is None:
        pytest.skip("no Chromium found; on Debian: apt-get install chromium")
    with Chromium(WIDTH, HEIGHT) as browser:
        yield browser


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


def picture_of(page):
    data = base64.b64decode(page.call("Page.captureScreenshot", format="png")["data"])
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))


def settled_picture(page, differs_from=None, seconds=240):
    """What the page shows once it stands still, and does not show something given any more."""
    deadline, before = time.monotonic() + seconds, None
    while time.monotonic() < deadline:
        picture = picture_of(page)
        if before is not None and np.array_equal(picture, before):
            if differs_from is None or not np.array_equal(picture, differs_from):
                return picture
        before = picture
        time.sleep(0.2)
    raise TimeoutError("the page never stands still")


def extent(pixels):
    """First and last row and column of what is true, as shares of the picture: shape (2, 2)."""
    sides = [np.flatnonzero(pixels.any(axis=axis)) for axis in (1, 0)]
    return np.array([(side[0] / n, (side[-1] + 1) / n) for side, n in zip(sides, pixels.shape)])


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parts[-3]}-{path.name}")
def test_a_robot_fills_the_picture_and_stands_in_its_middle(path, chromium):
    visualizer = ModelVisualizer(publish_contacts=False, simulate=True)  # as `sheldrake view` has it
    visualizer.AddModels(str(path))
    visualizer.Finalize()
    meshcat = visualizer.meshcat()
    page = chromium.open(meshcat.web_url())
    try:
        page.call("Emulation.setDeviceMetricsOverride", width=WIDTH, height=HEIGHT, deviceScaleFactor=1, mobile=False)
        page.wait_for(READY)
        page.evaluate(HIDE_PANEL)
        meshcat.SetProperty("", "visible", False)
        meshcat.Flush()
        without = settled_picture(page)
        meshcat.SetProperty("", "visible", True)
        picture = settled_picture(page, differs_from=without)
    finally:
        chromium.close_page(page)
    PICTURES[f"{path.parts[-3]}/{path.name}"] = picture
    if "SHELDRAKE_PICTURES" in os.environ:
        save_sheet(Path(os.environ["SHELDRAKE_PICTURES"]) / "robots.png")
    seen = extent((np.abs(picture.astype(int) - without) > 6).any(axis=2))
    filled, middle = np.diff(seen, axis=1).ravel(), seen.mean(axis=1)
    assert 0.2 < filled.max() < 0.8 and filled.min() < 0.8, f"fills {filled.round(2)} of the height and width"
    assert np.abs(middle - 0.5).max() < 0.15, f"its middle is at {middle.round(2)} of the height and width"
