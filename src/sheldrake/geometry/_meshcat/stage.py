"""What surrounds the scene: grid, world axes, background, lights, camera. Meshcat's "/Grid", "/Cameras" ..."""

from __future__ import annotations

import math
import struct
import zlib
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    import viser

STAGE = ("/Grid", "/Axes", "/Background", "/Lights", "/Cameras", "/Render Settings")
_FOV = math.radians(40.0)
_FILLED = 0.75  # of the height or width of a picture, by a scene that the camera is placed for
_TOP, _BOTTOM = (225, 234, 244), (255, 255, 255)
_AMBIENT = 0.55  # intensity of the light from all around
_VIEW_DIRECTION = np.array([0.8, -1.0, 0.55])  # from the scene to the camera


def is_stage_path(path: str) -> bool:
    """Returns whether a full path belongs to what surrounds the scene."""
    return any(path == name or path.startswith(name + "/") for name in STAGE)


def viewpoint(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Returns where to look at and from [m] to see points, shape (n, 3) [m], and the radius of the ball around them.

    The points fill `_FILLED` of a square picture, in perspective: of a camera at distance D along the direction d, all
    points p with |p.u - t| <= k (D - p.d) are in the picture, u being its horizontal or its vertical.
    """
    d = _VIEW_DIRECTION / np.linalg.norm(_VIEW_DIRECTION)
    horizontal = np.cross([0.0, 0.0, 1.0], d)
    horizontal /= np.linalg.norm(horizontal)
    k, depth = _FILLED * math.tan(_FOV / 2), points @ d
    radius = max(1e-3, float(np.linalg.norm(np.ptp(points, axis=0))) / 2)
    distance, target = depth.max() + 1e-3 * radius, d * (depth.min() + depth.max()) / 2
    for u in (horizontal, np.cross(d, horizontal)):
        highest, lowest = (points @ u + k * depth).max(), (points @ u - k * depth).min()
        distance = max(distance, (highest - lowest) / (2 * k))
        target = target + u * (highest + lowest) / 2
    return target, target + d * (distance - target @ d), radius


class Stage:
    """The surroundings of a scene in viser's page.

    Args:
        server: A viser.ViserServer.
    """

    def __init__(self, server: viser.ViserServer):
        self._server = server
        self._framed = False
        self._user_camera = False
        self._background = {"top_color": _TOP, "bottom_color": _BOTTOM, "visible": True}
        self._fov = _FOV
        self.position = np.array([3.0, -3.0, 2.0])
        self.target = np.zeros(3)
        scene, gui = server.scene, server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium")
        gui.set_panel_label("sheldrake")
        self._ambient = _AMBIENT
        self._environment: bytes | None = None  # a JPEG picture of all directions, the user's own
        self._send_environment()
        scene.configure_default_lights(True, cast_shadow=True)
        # A hair below z = 0, so that a plate at z = 0 hides it.
        self._grid = scene.add_grid(
            "/Grid",
            infinite_grid=True,
            plane="xy",
            cell_size=0.1,
            section_size=1.0,
            cell_color=(215, 219, 224),
            section_color=(175, 182, 190),
            fade_distance=30.0,
            shadow_opacity=0.2,
            position=(0.0, 0.0, -1e-4),
        )
        self._axes = scene.add_frame("/Axes", axes_length=0.5, axes_radius=0.005, origin_radius=0.0)
        self._show_background()
        server.initial_camera.fov = self._fov
        self._send_camera()

    def frame_scene(self, outline: Callable[[], np.ndarray | None]) -> None:
        """Places the camera so that it sees the scene; once, and never over the user's choice.

        Args:
            outline: Gives points around the scene, shape (n, 3) [m], None for an empty one.
        """
        points = None if self._framed else outline()
        if points is None:
            return
        self._framed = True
        target, position, radius = viewpoint(points)
        if not self._user_camera:
            self.target, self.position = target, position
        unit = 10.0 ** math.floor(math.log10(radius))
        if self.stands("/Axes"):
            self._axes.axes_length, self._axes.axes_radius = 0.4 * radius, radius / 150
        if self.stands("/Grid"):
            self._grid.cell_size, self._grid.section_size = unit, 10 * unit
            self._grid.fade_distance = 60 * radius
        if not self._user_camera:
            self._send_camera()

    def camera_for(self, points: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Returns target and position of a camera that sees points, shape (n, 3) [m], or the user's own."""
        if self._user_camera or points is None:
            return self.target, self.position
        return viewpoint(points)[:2]

    def set_camera(self, position: np.ndarray | None, target: np.ndarray) -> None:
        """Places the camera and what it looks at, shape (3,) each [m]; None keeps the position."""
        self._user_camera = True
        self.target = np.array(target, dtype=float)
        if position is not None:
            self.position = np.array(position, dtype=float)
        self._send_camera()

    @property
    def field_of_view(self) -> float:
        """Of the cameras, from the lower to the upper edge [rad]."""
        return self._fov

    def set_field_of_view(self, fov: float) -> None:
        """Sets the vertical field of view [rad]."""
        self._fov = fov
        self._server.initial_camera.fov = fov
        for client in self._server.get_clients().values():
            client.camera.fov = fov

    def view_flat(self, X_WC: np.ndarray, xmin: float, xmax: float, ymin: float, ymax: float) -> None:
        """Looks along +Cy so that the rectangle fills the page: a far camera with a narrow field of view."""
        self._user_camera = True
        fov = math.radians(2.0)
        height = max(ymax - ymin, 1e-6)
        distance = 0.5 * height / math.tan(fov / 2)
        center_C = np.array([(xmin + xmax) / 2, 0.0, (ymin + ymax) / 2])
        R = X_WC[:3, :3]
        self.target = X_WC[:3, 3] + R @ center_C
        self.position = self.target - R[:, 1] * distance
        self.set_field_of_view(fov)
        self._send_camera(up=R[:, 2])
        for path in ("/Background", "/Grid", "/Axes"):
            self.set_property(path, "visible", False)

    def reset(self) -> None:
        """Shows everything again, through the usual camera."""
        for path in ("/Background", "/Grid", "/Axes"):
            self.set_property(path, "visible", True)
        self.set_field_of_view(_FOV)
        self._user_camera = self._framed = False
        self._send_camera(up=np.array([0.0, 0.0, 1.0]))

    def _send_camera(self, up: np.ndarray | None = None) -> None:
        server, initial = self._server, self._server.initial_camera
        distance = float(np.linalg.norm(self.position - self.target))
        initial.near, initial.far = max(1e-4, distance / 200), max(100.0, 50 * distance)
        if up is not None:
            initial.up = up
        initial.position, initial.look_at = self.position, self.target
        for client in server.get_clients().values():
            with client.atomic():
                if up is not None:
                    client.camera.up_direction = up
                client.camera.near, client.camera.far = initial.near, initial.far
                client.camera.position, client.camera.look_at = self.position, self.target

    def stands(self, path: str) -> bool:
        """Whether the part of the stage at a path is there; an object that somebody draws there takes its place."""
        handle = {"Grid": self._grid, "Axes": self._axes}.get(path.split("/")[1])
        return handle is None or not handle._impl.removed

    def set_property(self, path: str, name: str, value: Any) -> bool:
        """Sets a property below one of the STAGE paths; returns False when the page cannot show it."""
        part = path.split("/")[1]
        if part in ("Grid", "Axes") and name == "visible":
            if self.stands(path):
                (self._grid if part == "Grid" else self._axes).visible = bool(value)
            return True
        if part == "Background" and name in ("visible", "top_color", "bottom_color"):
            self._background[name] = bool(value) if name == "visible" else [round(255 * float(c)) for c in value][:3]
            self._show_background()
            return True
        if part == "Background" and name == "environment_map":
            return self._set_environment(str(value))
        if part == "Lights" and path == "/Lights" and name == "visible":
            self._server.scene.configure_default_lights(bool(value))
            return True
        if part == "Lights" and "AmbientLight" in path and name == "intensity":
            self._ambient = _AMBIENT * float(value) / 0.6  # 0.6 is Meshcat's own
            self._send_environment()
            return True
        if part == "Cameras":
            return self._set_camera_property(name, value)
        return False

    def _set_camera_property(self, name: str, value: Any) -> bool:
        if name == "fov":
            self.set_field_of_view(math.radians(float(value)))
        elif name == "zoom":
            self.set_field_of_view(2 * math.atan(math.tan(_FOV / 2) / float(value)))
        elif name == "position":  # in three.js's axes, +y up, relative to the target
            x, y, z = (float(v) for v in value)
            self.set_camera(self.target + np.array([x, -z, y]), self.target)
        else:
            return False
        return True

    def _set_environment(self, path: str) -> bool:
        """Lights the scene by a picture and shows it all around, "" for neither; False when it is no picture."""
        environment = None
        if path:
            try:
                environment = _as_jpeg(path)
            except OSError:
                return False
        self._environment = environment
        self._send_environment()
        self._show_background()
        return True

    def _send_environment(self) -> None:
        scene = self._server.scene
        if self._environment is None:
            scene.configure_environment_map("warehouse", environment_intensity=self._ambient)
            return
        from viser import _messages

        turn = (1.0, 0.0, 0.0, 0.0)
        self._server._websock_server.queue_message(  # viser's own call knows its presets only
            _messages.EnvironmentMapMessage(
                self._environment, bool(self._background["visible"]), 0.0, 1.0, turn, self._ambient / _AMBIENT, turn
            )
        )

    def _show_background(self) -> None:
        if self._environment is not None:
            self._send_environment()
            if self._background["visible"]:
                self._server.scene.set_background_image(None)
                return
        shown = self._background["visible"]
        top = np.array(self._background["top_color"] if shown else (255, 255, 255), dtype=float)
        bottom = np.array(self._background["bottom_color"] if shown else (255, 255, 255), dtype=float)
        ramp = np.linspace(0.0, 1.0, 256)[:, None]
        rows = np.round(top + ramp * (bottom - top)).astype(np.uint8)
        from viser import _messages

        self._server._websock_server.queue_message(  # viser's own call loads all that knows a format of pictures
            _messages.BackgroundImageMessage("png", _png(np.repeat(rows[:, None], 4, axis=1)), None)
        )


def _png(image: np.ndarray) -> bytes:
    """A picture as a PNG file (W3C, Portable Network Graphics). `image`: shape (height, width, 3), of bytes."""
    height, width, _ = image.shape
    lines = np.zeros((height, 1 + 3 * width), np.uint8)  # the first byte of a line says how it is filtered: not at all
    lines[:, 1:] = image.reshape(height, -1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)  # eight bits each of red, green, blue
    chunks = (b"IHDR", header), (b"IDAT", zlib.compress(lines.tobytes())), (b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunk(*each) for each in chunks)


def _as_jpeg(path: str) -> bytes:
    """A picture file as JPEG, which is what the page reads; OSError when it is none."""
    import io

    from PIL import Image

    out = io.BytesIO()
    with Image.open(path) as picture:
        picture.convert("RGB").save(out, "JPEG", quality=92)
    return out.getvalue()
