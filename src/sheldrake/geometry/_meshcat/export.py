"""The scene, and a recording, as one page that needs no server and no network."""

from __future__ import annotations

import base64
import io
import json
import zipfile
from importlib import resources
from typing import Any

import numpy as np

from .animation import MeshcatAnimation
from .dress import NO_NOTICE, dress_page
from .nodes import property_message
from .page import Page
from .player import Frames
from .scripts import EVERY_PAGE
from .tree import quaternions

TITLE = "sheldrake"


def serialize_scene(page: Page, animation: MeshcatAnimation | None) -> bytes:
    """Returns what viser's player plays: the scene as it is and, when given, a recording."""
    page.sync()
    with page._lock:
        websocket_server = page._server._websock_server
        with websocket_server._record_lock:  # nothing sent meanwhile gets into the file
            serializer = page._server.get_scene_serializer()
            kept = [m for m in serializer._messages if m[1]["type"] != "RunJavascriptMessage"]
            serializer._messages[:] = kept  # they say by which channel to speak to us: nothing for a file
            if animation is not None and animation._num_frames() > 0:
                frames = Frames(animation)
                _insert_camera(serializer, page, frames)
                _insert_recording(serializer, page, frames)
            return serializer.serialize()


def _insert_camera(serializer: Any, page: Page, frames: Frames) -> None:
    """Places the camera so that it sees where everything goes."""
    from viser import _messages

    outlines = [page.outline(dict(frames.poses_at(int(f)))) for f in np.linspace(0, frames.num_frames - 1, 20)]
    seen = [points for points in outlines if points is not None]
    if seen:
        target, position = page.stage.camera_for(np.concatenate(seen))
        serializer._insert_message(_messages.SetCameraPositionMessage(tuple(position.tolist()), initial=True))
        serializer._insert_message(_messages.SetCameraLookAtMessage(tuple(target.tolist()), initial=True))


def _insert_recording(serializer: Any, page: Page, frames: Frames) -> None:
    from viser import _messages

    period = 1.0 / frames.frames_per_second
    sent: dict[str, np.ndarray] = {}
    told: dict[tuple[str, str], Any] = {}
    for frame in range(frames.num_frames):
        poses, properties = frames.changes_at(frame)
        if frame == 0:  # what is recorded later only starts where it is recorded first
            poses, properties = frames.poses_at(0), frames.properties_at(0)
        poses = [(path, pose) for path, pose in poses if path not in sent or not np.array_equal(sent[path], pose)]
        if poses:
            q = quaternions(np.array([pose[:, :3] for _, pose in poses])).tolist()
            for (path, pose), wxyz in zip(poses, q):
                sent[path] = pose
                serializer._insert_message(_messages.SetOrientationMessage(path, tuple(wxyz)))
                serializer._insert_message(_messages.SetPositionMessage(path, tuple(pose[:, 3].tolist())))
        for path, name, value in properties:
            if (path, name) in told and told[path, name] == value:
                continue
            told[path, name] = value
            message = property_message(path, name, value, page.drawable_at(path))
            if message is not None:
                serializer._insert_message(message)
        if frame + 1 < frames.num_frames:
            serializer.insert_sleep(period)


def _player_script(animation: MeshcatAnimation | None) -> str:
    """Returns a script that presses "pause" when the recording is not to start by itself."""
    if animation is None or animation.autoplay() or animation._num_frames() == 0:
        return ""
    return (
        "const waiting = setInterval(() => {"
        " if (!window.__viserMutable || !window.__viserMutable.scene) return;"
        ' clearInterval(waiting); dispatchEvent(new KeyboardEvent("keydown", {code: "Space"})); }, 50);'
    )


def static_html(page: Page, animation: MeshcatAnimation | None) -> str:
    """Returns one self-contained HTML page."""
    data = base64.b64encode(serialize_scene(page, animation)).decode("ascii")
    embed = f'window.__VISER_EMBED_DATA__="{data}";window.__VISER_EMBED_CONFIG__={{darkMode:false}};'
    return dress_page(_client(), embed + _player_script(animation) + EVERY_PAGE + NO_NOTICE, TITLE)


def static_zip(page: Page, animation: MeshcatAnimation | None) -> bytes:
    """Returns a ZIP file with the page, "meshcat.html", and the scene beside it, for a web server."""
    load = 'if (!new URLSearchParams(location.search).has("playbackPath"))'
    load += f" location.search = {json.dumps('?playbackPath=scene.viser')};"
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        script = load + _player_script(animation) + EVERY_PAGE + NO_NOTICE
        archive.writestr("meshcat.html", dress_page(_client(), script, TITLE))
        archive.writestr("scene.viser", serialize_scene(page, animation))
    return out.getvalue()


def _client() -> str:
    return (resources.files("viser") / "client" / "build" / "index.html").read_text(encoding="utf-8")
