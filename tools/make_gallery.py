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
from typing import NamedTuple

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "src"), str(ROOT / "tests" / "browser")]

from chromium import Chromium  # noqa: E402

from sheldrake.all import Meshcat, Rgba, RigidTransform, RotationMatrix  # noqa: E402

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


class View(NamedTuple):
    """How an example is looked at."""

    eye: list[float]
    """Where the camera is [m]."""
    target: list[float]
    """What it looks at [m]."""
    seconds: float
    """How long the scene runs [s]."""
    ghosts: tuple[float, ...] = ()
    """Moments of the past that are drawn too, as shades [s]."""


VIEWS = {
    "arm_pid": View([1.15, -1.3, 0.8], [0.17, 0.1, 0.47], 2.0, (0.0, 0.2, 0.32, 0.45, 0.65)),
    "bouncing_ball": View([0.5, -2.6, 0.75], [0.0, 0.0, 0.5], 0.72, (0.0, 0.15, 0.25, 0.32, 0.38, 0.42, 0.455)),
    "cart_pole_lqr": View([0.45, -1.35, 0.4], [0.2, 0.0, 0.22], 1.6, (0.0, 0.2, 0.4, 0.6)),
    "clutter": View([0.5, -0.62, 0.72], [0.0, 0.0, 0.03], 2.5),
    "double_pendulum": View([0.2, -1.5, 0.15], [0.2, 0.0, 0.06], 1.3, (1.0, 1.08, 1.16, 1.23)),
    "drop_the_block": View([0.25, -0.24, 0.16], [0.035, 0.0, 0.055], 2.0, (0.0, 0.1)),
    "gripper": View([0.42, -0.54, 0.36], [0.0, 0.0, 0.1], 2.0, (0.0,)),
    "gyroscope": View([0.38, -0.46, 0.26], [0.0, 0.0, 0.0], 1.85, (1.69, 1.77)),
    "pendulum": View([0.2, -1.75, 0.1], [0.0, 0.0, -0.05], 0.8, (0.0, 0.35, 0.5, 0.6, 0.67, 0.74)),
    "quadruped": View([0.62, -0.75, 0.42], [0.0, 0.0, 0.19], 1.5),
    "soft_ball": View([0.3, -1.2, 0.36], [0.0, 0.0, 0.03], 1.5),
    "stack": View([1.15, -1.32, 0.75], [0.0, 0.0, 0.5], 1.5),
}


class Remembering(Meshcat):
    """A page that remembers what was drawn, and where the frames were at each time."""

    def __init__(self):
        super().__init__()
        self._objects, self._places, self._history = {}, {}, []

    def SetObject(self, path, *args, **kwargs):
        """Draws something."""
        self._objects[path] = args
        super().SetObject(path, *args, **kwargs)

    def SetTransform(self, path, X_ParentPath, *args, **kwargs):
        """Places something."""
        self._places[path] = X_ParentPath
        super().SetTransform(path, X_ParentPath, *args, **kwargs)

    def _set_poses(self, paths, poses, time=None):
        self._history.append((time, list(paths), np.array(poses)))
        super()._set_poses(paths, poses, time)

    def draw_ghosts(self, times) -> None:
        """Draws the moving things as they were at some times, the older the paler."""
        for k, moment in enumerate(times):
            _, paths, poses = min(self._history, key=lambda entry, moment=moment: abs(entry[0] - moment))
            for path, pose in zip(paths, poses):
                inside = path.removeprefix("/drake/") + "/"
                for name, (shape, rgba, *_) in list(self._objects.items()):
                    if name.startswith(inside):
                        self._draw_ghost(f"ghost/{k}/{name}", name, shape, rgba, pose, 0.12 + 0.3 * k / len(times))

    def _draw_ghost(self, path, name, shape, rgba, pose, opacity) -> None:
        super().SetObject(path, shape, Rgba(rgba.r(), rgba.g(), rgba.b(), opacity))
        X_WF = RigidTransform(RotationMatrix(pose[:3, :3]), pose[:3, 3])
        super().SetTransform(path, X_WF @ self._places.get(name, RigidTransform()))


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


def take_images(folder: pathlib.Path) -> None:
    """Writes docs/gallery/camera.webp: what the camera of that example sees, side by side."""
    from PIL import Image

    from sheldrake.visualization import ColorizeDepthImage, ColorizeLabelImage

    def look(camera, context):
        color, depth, label = (
            camera.GetOutputPort(port).Eval(context) for port in ("color_image", "depth_image_32f", "label_image")
        )
        images = [color, type(color)(), type(color)()]
        ColorizeDepthImage().Calc(depth, images[1])
        ColorizeLabelImage().Calc(label, images[2])
        small = [np.array(Image.fromarray(image.data[..., :3].copy()).resize((320, 240))) for image in images]
        Image.fromarray(np.hstack(small)).save(folder / "camera.png")

    example("camera").main(look=look)
    save_small(folder / "camera.png", OUT / "camera.webp")


def take_pages(names: list[str]) -> None:
    """Writes pictures of the pages of examples."""
    with tempfile.TemporaryDirectory() as folder, Chromium(width=WIDTH, height=HEIGHT, smooth=True) as browser:
        os.chdir(folder)
        for name in names:
            view = VIEWS[name]
            meshcat = Remembering()
            meshcat.SetProperty("/Grid", "visible", False)
            meshcat.SetProperty("/Axes", "visible", False)
            example(name).main(meshcat, seconds=view.seconds)
            meshcat.draw_ghosts(view.ghosts)
            meshcat.SetCameraPose(view.eye, view.target)
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


def main(names: list[str]) -> None:
    """Writes docs/gallery/NAME.webp."""
    OUT.mkdir(parents=True, exist_ok=True)
    os.environ["MPLBACKEND"] = "Agg"
    names = names or [*sorted(VIEWS), "camera"]
    if "camera" in names:
        with tempfile.TemporaryDirectory() as folder:
            take_images(pathlib.Path(folder))
    pages = [name for name in names if name != "camera"]
    if pages:
        take_pages(pages)


if __name__ == "__main__":
    main(sys.argv[1:])
