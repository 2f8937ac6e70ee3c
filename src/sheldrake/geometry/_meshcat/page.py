"""The scene of a Meshcat as viser shows it: takes what changed in the tree and tells the page.

One viser frame stands for each path, one node below it, named "<object>", for what is drawn there.
"""

from __future__ import annotations

import logging
import threading
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from . import nodes
from .drawables import bounds_of, transformed, triangles_of
from .server import Sweeper
from .stage import Stage, is_stage_path
from .tree import OBJECT, SceneTree, as_matrix4, parents, quaternions

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sheldrake.geometry._meshcat.drawables import Drawable

log = logging.getLogger("drake")

PERIOD = 1 / 64.0  # least time between two batches of changes [s]
_APPEARANCE = ("color", "opacity", "modulated_opacity")
_PLACEMENT = ("position", "quaternion", "scale")


def split_rigid(pose: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
    """Returns the nearest rigid pose X, shape (4, 4), and S with pose = X S, or None when it is rigid itself."""
    M = as_matrix4(pose)
    A = M[:3, :3]
    if np.abs(A.T @ A - np.eye(3)).max() < 1e-9 and np.linalg.det(A) > 0:
        return M, None
    U, _, Vt = np.linalg.svd(A)
    R = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
    X = M.copy()
    X[:3, :3] = R
    S = np.eye(4)
    S[:3, :3] = R.T @ A
    return X, S


class Page:
    """Keeps viser's scene equal to a SceneTree.

    Work happens in viser's thread, at most 64 times a second, and only while somebody looks.

    Args:
        server: A viser.ViserServer.
        tree: The scene.
    """

    def __init__(self, server: Any, tree: SceneTree):
        self._server = server
        self._tree = tree
        self._lock = threading.RLock()
        self._wanted = False
        self._last = 0.0
        self._frames: dict[str, Any] = {}
        self._drawn: dict[str, Any] = {}
        self._stretched: dict[str, np.ndarray] = {}
        self._scaled: dict[str, Any] = {}  # path -> what is drawn there, where a stretch is the node's own scale
        self._ignored: set[str] = set()
        self.player: Any = None
        self.stage = Stage(server)
        self._sweeper = Sweeper(server)
        server._websock_server.on_client_connect(self._on_connect)

    def num_clients(self) -> int:
        """Returns the number of open connections."""
        return len(self._server._websock_server._client_state_from_id)

    def wake(self) -> None:
        """Says that the tree changed. Costs next to nothing; called from the simulation's thread."""
        if self._wanted or not self._server._websock_server._client_state_from_id:
            return
        self._wanted = True
        try:
            self._server.get_event_loop().call_soon_threadsafe(self._on_wake)
        except RuntimeError:  # the server has stopped
            pass

    def _on_wake(self) -> None:
        wait = self._last + PERIOD - time.monotonic()
        if wait > 0:
            self._server.get_event_loop().call_later(wait, self._sync_now)
        else:
            self._sync_now()

    def _sync_now(self) -> None:
        try:
            self.sync()
        except Exception:
            log.exception("The page could not follow a change of the scene.")
        self._last = time.monotonic()

    async def _on_connect(self, _connection: object) -> None:
        self._sync_now()
        self.stage.frame_scene(self.outline)

    def sync(self) -> None:
        """Brings the page up to date, in the calling thread."""
        with self._lock:
            self._wanted = False
            changes = self._tree.take_changes()
            if not changes:
                return
            new = bool(changes.objects)
            with self._server.atomic():
                for path in changes.deleted:
                    self._delete(path)
                for path in changes.objects:
                    self._draw(path)
                self._move(changes.poses)
                for path, name in changes.properties:
                    self._apply_property(path, name)
            self._sweeper.sweep_if_due()
            if new:
                self.stage.frame_scene(self.outline)

    def _frame(self, path: str) -> Any:
        frame = self._frames.get(path)
        if frame is None:
            for parent in parents(path):
                if parent in self._frames:
                    break
                self._frames[parent] = self._server.scene.add_frame(parent, show_axes=False)
            frame = self._frames[path] = self._server.scene.add_frame(path, show_axes=False)
        return frame

    def _delete(self, path: str) -> None:
        owner, _, last = path.rpartition("/")
        if last == OBJECT:
            self._erase(owner)
            return
        if is_stage_path(path):
            self.stage.set_property(path, "visible", False)
        below = path + "/"
        frame = self._frames.get(path)
        for known in (self._frames, self._drawn, self._stretched, self._scaled):
            for key in [key for key in known if key == path or key.startswith(below)]:
                del known[key]
        if frame is not None:
            frame.remove()

    def _erase(self, path: str) -> None:
        handle = self._drawn.pop(path, None)
        if handle is not None:
            handle.remove()

    def _draw(self, path: str) -> None:
        element = self._tree.get(path)
        if element is None or element.object is None:
            self._erase(path)
            return
        self._frame(path)
        drawable, scale = element.object, None
        stretch = self._stretch_at(path)
        if stretch is not None:
            scale = nodes.scale_along_axes(drawable, stretch)
            if scale is None:
                drawable = transformed(drawable, stretch)
        self._scaled.pop(path, None)
        handle = nodes.add(self._server.scene, f"{path}/{OBJECT}", drawable, *self._appearance(path, drawable))
        if scale is not None:
            handle.scale = scale
            self._scaled[path] = drawable
        own = self._tree.get(f"{path}/{OBJECT}")
        if own is not None and own.properties.get("visible") is False:
            handle.visible = False
        self._drawn[path] = handle

    def _appearance(self, path: str, drawable: Any) -> tuple[Any, float]:
        """Returns the color in force at a path (None: the drawable's own) and its opacity."""
        color, opacity, factor = None, None, 1.0
        for part in [f"{path}/{OBJECT}", path, *parents(path)]:
            element = self._tree.get(part)
            if element is None or not element.properties:
                continue
            properties = element.properties
            if color is None and "color" in properties:
                color = [float(c) for c in properties["color"]]
            if opacity is None and "opacity" in properties:
                opacity = float(properties["opacity"])
            factor *= float(properties.get("modulated_opacity", 1.0))
        if opacity is None:
            opacity = color[3] if color is not None and len(color) == 4 else drawable.rgba.a()
        return color, min(1.0, max(0.0, opacity * factor))

    def _move(self, paths: Iterable[str]) -> None:
        """Sends the poses of some paths."""
        moved = []
        for path in paths:
            element = self._tree.get(path)
            if element is None or element.pose is None or is_stage_path(path):
                continue
            self._frame(path)
            pose = element.pose
            if pose.shape == (4, 4):
                pose, stretch = split_rigid(pose)
                if stretch is not None or path in self._stretched:
                    if stretch is None:
                        del self._stretched[path]
                    else:
                        self._stretched[path] = stretch
                    self._redraw_below(path)
            if self._stretched and any(parent in self._stretched for parent in parents(path)):
                self._redraw_below(path)
            moved.append((path, pose))
        if moved:
            q = quaternions(np.array([pose[:3, :3] for _, pose in moved]))
            for (path, pose), wxyz in zip(moved, q.tolist()):
                nodes.send_pose(self._server, path, wxyz, pose[:3, 3].tolist())

    def show_pose(self, path: str, pose: np.ndarray) -> None:
        """Shows a pose, shape (3, 4), that is not the tree's: for playback."""
        self._frame(path)
        nodes.send_pose(self._server, path, quaternions(pose[None, :3, :3])[0].tolist(), pose[:3, 3].tolist())

    def _stretch_at(self, path: str) -> np.ndarray | None:
        """Returns what the rigid frames along a path leave out, to be built into what is drawn there."""
        if not self._stretched:
            return None
        chain = [path, *parents(path)]
        if not any(part in self._stretched for part in chain):
            return None
        full, rigid = np.eye(4), np.eye(4)
        for part in reversed(chain):
            element = self._tree.get(part)
            if element is not None and element.pose is not None:
                full = full @ as_matrix4(element.pose)
                rigid = rigid @ split_rigid(element.pose)[0]
        return np.linalg.solve(rigid, full)

    def _redraw_below(self, path: str) -> None:
        below = path + "/"
        for drawn in [key for key in self._drawn if key == path or key.startswith(below)]:
            if not self._rescale(drawn):
                self._draw(drawn)

    def _drawable_at(self, path: str) -> Drawable | None:
        element = self._tree.get(path)
        return None if element is None else element.object

    def _rescale(self, path: str) -> bool:
        """Changes the scale of what is drawn; returns False when it must be drawn anew."""
        drawable, stretch = self._drawable_at(path), self._stretch_at(path)
        if self._scaled.get(path) is not drawable or stretch is None:
            return False
        scale = nodes.scale_along_axes(drawable, stretch)
        if scale is None:
            return False
        self._drawn[path].scale = scale
        return True

    def drawable_at(self, path: str) -> Drawable | None:
        """Returns what is drawn at a path, None for nothing."""
        element = self._tree.get(path.removesuffix(f"/{OBJECT}"))
        return None if element is None else element.object

    def _apply_property(self, path: str, name: str) -> None:
        element = self._tree.get(path)
        if element is None or name not in element.properties or (name in _PLACEMENT and not is_stage_path(path)):
            return  # Meshcat.SetProperty() has put what places a path into its pose
        self.show_property(path, name, element.properties[name])

    def show_property(self, path: str, name: str, value: object) -> None:
        """Shows one property. What the page has no way to show is said once and kept."""
        if is_stage_path(path) and self.stage.stands(path):
            if not self.stage.set_property(path, name, value):
                self._say_ignored(path, name)
            return
        owner, _, last = path.rpartition("/")
        target = owner if last == OBJECT else path
        if name == "visible":
            handle = self._drawn.get(owner) if last == OBJECT else self._frame(path)
            if handle is not None:
                handle.visible = bool(value)
        elif name in _APPEARANCE:
            below = target + "/"
            for drawn in [key for key in self._drawn if key == target or key.startswith(below)]:
                drawable = self._drawable_at(drawn)
                if not nodes.recolor(self._drawn[drawn], drawable, *self._appearance(drawn, drawable)):
                    self._draw(drawn)
        elif name in _PLACEMENT:
            message = nodes.property_message(path, name, value, self.drawable_at(path))
            if message is not None:
                self._server._websock_server.queue_message(message)
        else:
            self._say_ignored(path, name)

    def _say_ignored(self, path: str, name: str) -> None:
        key = f"{path} {name}"
        if key not in self._ignored:
            self._ignored.add(key)
            log.warning("Meshcat.SetProperty(): '%s' of '%s' is kept, but this page cannot show it.", name, path)

    def outline(self, moved: dict[str, np.ndarray] | None = None) -> np.ndarray | None:
        """Returns points around everything that is seen, shape (n, 3), in the world [m]; None for an empty scene.

        What is hidden does not count, nor do notes about the scene, such as forces; of the ground its height alone.

        Args:
            moved: Path -> pose in its parent, shape (3, 4), in place of the tree's.
        """
        corners, floors = [], []
        for path, element in self._tree.items():
            if element.object is None or is_stage_path(path) or not self._tree.is_part_of_the_scene(path):
                continue
            M = self._tree.pose_in_world(path, moved)
            box = bounds_of(element.object)
            if box is None:
                floors.append(M[2, 3])
                continue
            points = np.array(np.meshgrid(*box.T)).reshape(3, -1).T
            corners.append(points @ M[:3, :3].T + M[:3, 3])
        if not corners:
            return None
        points = np.concatenate(corners)
        points = points[np.isfinite(points).all(axis=1)]
        if not len(points):
            return None
        x, y, _ = points.mean(axis=0)
        return np.vstack([points, *[(x, y, z) for z in floors]])

    def lowest(self, path: str) -> float | None:
        """Returns the height of the lowest point that is seen at or below a full path, in the world [m]."""
        heights = []
        for part, element in self._tree.items():
            inside = part == path or part.startswith(path + "/")
            if not inside or element.object is None or not self._tree.is_part_of_the_scene(part):
                continue
            triangles = triangles_of(element.object)
            if triangles is not None and len(triangles.vertices):
                M = self._tree.pose_in_world(part)
                heights.append(float((triangles.vertices @ M[2, :3]).min() + M[2, 3]))
        return min(heights, default=None)
