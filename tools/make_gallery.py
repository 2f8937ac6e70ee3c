"""Makes the pictures of docs/gallery/: every example runs in real time, and a headless Chromium looks at its page.

    python tools/make_gallery.py [name ...]

Needs a Chromium; look at what it made.
"""

from __future__ import annotations

import importlib.util
import os
import pathlib
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
OUT = ROOT / "docs" / "gallery"
WIDTH, HEIGHT = 640, 420
"""Of a picture [pixels]."""
ONLY_THE_SCENE = """(() => {
  const canvas = [...document.querySelectorAll('canvas')].sort((a, b) => b.width * b.height - a.width * a.height)[0];
  for (const e of document.body.querySelectorAll('*')) {
    if (e.contains(canvas)) { e.style.transition = 'none'; e.style.opacity = 1; }  // the page fades in
    else e.style.visibility = 'hidden';
  }
})()"""
LIMIT = 60_000
"""No picture has more bytes."""
VIEWS = {
    "arm_pid": ([0.75, -0.85, 0.6], [0.2, 0.12, 0.27], 2.0),
    "bouncing_ball": ([0.9, -1.3, 0.8], [0.0, 0.0, 0.4], 0.72),
    "cart_pole_lqr": ([0.75, -0.95, 0.4], [0.3, 0.0, 0.2], 0.3),
    "clutter": ([0.5, -0.62, 0.72], [0.0, 0.0, 0.08], 2.5),
    "double_pendulum": ([0.3, -1.9, 0.1], [0.15, 0.0, -0.1], 1.2),
    "drop_the_block": ([0.15, -0.13, 0.12], [0.03, 0.0, 0.012], 2.0),
    "gripper": ([0.32, -0.42, 0.3], [0.0, 0.0, 0.13], 2.0),
    "gyroscope": ([0.35, -0.45, 0.25], [0.0, 0.0, 0.0], 1.85),
    "pendulum": ([0.25, -1.3, 0.0], [0.0, 0.0, -0.15], 0.8),
    "quadruped": ([0.62, -0.75, 0.42], [0.0, 0.0, 0.19], 1.5),
    "soft_ball": ([0.35, -0.75, 0.35], [0.0, 0.0, 0.06], 1.5),
    "stack": ([1.0, -1.15, 0.9], [0.0, 0.0, 0.5], 1.5),
}
"""Of every example: where the camera is and what it looks at [m], and how long the scene runs [s]."""


def example(name: str):
    """Returns an example as a module."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "examples" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def save_small(png: pathlib.Path, path: pathlib.Path) -> None:
    """Writes a picture as WebP, as good as its limit of bytes allows."""
    from PIL import Image

    image = Image.open(png).convert("RGB")
    for quality in (90, 80, 70, 60, 40):
        image.save(path, quality=quality, method=6)
        if path.stat().st_size < LIMIT:
            return
    raise RuntimeError(f"{path} is larger than {LIMIT} bytes at any quality")


def main(names: list[str]) -> None:
    """Writes docs/gallery/NAME.webp."""
    sys.path[:0] = [str(ROOT / "src"), str(ROOT / "tests" / "browser")]
    from chromium import Chromium

    from sheldrake.all import Meshcat

    OUT.mkdir(parents=True, exist_ok=True)
    os.environ["MPLBACKEND"] = "Agg"
    with tempfile.TemporaryDirectory() as folder, Chromium(width=WIDTH, height=HEIGHT) as browser:
        os.chdir(folder)
        for name in names or sorted(VIEWS):
            eye, target, seconds = VIEWS[name]
            meshcat = Meshcat()
            meshcat.SetProperty("/Grid", "visible", False)
            meshcat.SetProperty("/Axes", "visible", False)
            example(name).main(meshcat, seconds=seconds)
            meshcat.SetCameraPose(eye, target)
            page = browser.open(meshcat.web_url())
            page.wait_for("!!(window.__viserMutable && window.__viserMutable.nodeRefFromName)", 120)
            time.sleep(8.0)
            page.evaluate(ONLY_THE_SCENE)
            png = pathlib.Path(folder) / f"{name}.png"
            page.screenshot(png, WIDTH, HEIGHT)
            save_small(png, OUT / f"{name}.webp")
            print(f"{name}: {(OUT / name).with_suffix('.webp').stat().st_size / 1000:.1f} kB", flush=True)
            browser.close_pages()
            del meshcat


if __name__ == "__main__":
    main(sys.argv[1:])
