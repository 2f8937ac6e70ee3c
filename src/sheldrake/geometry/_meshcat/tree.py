"""What a Meshcat scene holds, apart from any page: paths, objects, poses, properties, and what changed.

The simulation's thread writes here (a dictionary store and a mark), the page's thread takes the
marked changes away. Nothing here knows how a page is drawn.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, SupportsFloat

import numpy as np

from sheldrake.common._overloads import expect

if TYPE_CHECKING:
    from sheldrake.geometry._meshcat.drawables import Drawable

WORKING_DIRECTORY = "/drake"
OBJECT = "<object>"


def full_path(path: str) -> str:
    """Returns the absolute path: "foo" is "/drake/foo", "" is "/drake", a trailing "/" does not count."""
    if not expect("Meshcat", path, str).startswith("/"):
        path = f"{WORKING_DIRECTORY}/{path}"
    return "/" + "/".join(part for part in path.split("/") if part)


def parents(path: str) -> Iterable[str]:
    """Yields the ancestors of a full path, nearest first, without the root."""
    while True:
        path = path.rpartition("/")[0]
        if not path:
            return
        yield path


class Element:
    """One place in the scene: what is drawn there, its pose in its parent, its properties."""

    __slots__ = ("object", "pose", "properties")

    def __init__(self) -> None:
        self.object: Drawable | None = None
        self.pose: np.ndarray | None = None  # shape (4, 4) or (3, 4)
        self.properties: dict[str, Any] = {}


class Changes:
    """What happened since the page last looked. Deletions come before everything else here."""

    __slots__ = ("deleted", "objects", "poses", "properties")

    def __init__(self) -> None:
        self.deleted: dict[str, None] = {}
        self.objects: dict[str, None] = {}
        self.poses: dict[str, None] = {}
        self.properties: dict[tuple[str, str], None] = {}

    def __bool__(self) -> bool:
        return bool(self.deleted or self.objects or self.poses or self.properties)


class SceneTree:
    """The scene by full path. Every method may be called from any thread.

    Args:
        on_change: Called, without the lock, after something changed.
    """

    def __init__(self, on_change: Callable[[], None] = lambda: None):
        self._lock = threading.Lock()
        self._elements: dict[str, Element] = {"/": Element()}
        self._changes = Changes()
        self._notes: set[str] = set()
        self._drawing = threading.RLock()
        self._deferred: dict[str, Callable[[], None]] = {}
        self.on_change = on_change

    def _element(self, path: str) -> Element:
        element = self._elements.get(path)
        if element is None:
            element = self._elements[path] = Element()
            for parent in parents(path):
                if parent in self._elements:
                    break
                self._elements[parent] = Element()
        return element

    def defer(self, owner: str, draw: Callable[[], None]) -> None:
        """Has something drawn when somebody looks: a page, or who asks what the scene holds.

        Args:
            owner: Who draws; what it deferred before is not drawn any more.
            draw: Draws into this tree, in whatever thread looks.
        """
        with self._lock:
            self._deferred[owner] = draw
        self.on_change()

    def settle(self) -> None:
        """Draws what was deferred; waits for another thread that does."""
        with self._drawing:
            with self._lock:
                deferred, self._deferred = self._deferred, {}
            for draw in deferred.values():
                draw()

    def set_object(self, path: str, drawable: Drawable) -> None:
        """Places something to draw at a path, in place of what was drawn there."""
        with self._lock:
            self._element(path).object = drawable
            self._changes.objects[path] = None
        self.on_change()

    def set_pose(self, path: str, pose: np.ndarray) -> None:
        """Places a path in its parent. The array, shape (4, 4) or (3, 4), is kept, not copied."""
        with self._lock:
            element = self._element(path)
            if element.pose is not None and element.pose.shape == pose.shape and (element.pose == pose).all():
                return
            element.pose = pose
            self._changes.poses[path] = None
        self.on_change()

    def set_poses(self, paths: list[str], poses: Iterable[np.ndarray]) -> None:
        """Places many paths at once. The arrays, shape (3, 4) or (4, 4) each, are kept, not copied."""
        with self._lock:
            for path, element, pose in zip(paths, map(self._elements.get, paths), poses):
                (element or self._element(path)).pose = pose
            self._changes.poses.update(dict.fromkeys(paths))
        self.on_change()

    def set_property(self, path: str, name: str, value: object) -> None:
        """Sets a property of a path."""
        with self._lock:
            self._element(path).properties[name] = value
            self._changes.properties[path, name] = None
        self.on_change()

    def set_properties(self, paths: list[str], name: str, values: list[Any]) -> None:
        """Sets one property of many paths at once."""
        with self._lock:
            elements, changed = self._elements, self._changes.properties
            for path, value in zip(paths, values):
                element = elements.get(path) or self._element(path)
                element.properties[name] = value
                changed[path, name] = None
        self.on_change()

    def delete(self, path: str) -> None:
        """Removes a path and everything below it; ".../<object>" removes only what is drawn there."""
        if path == "/":
            return
        self.settle()
        with self._lock:
            below = path + "/"
            for key in [key for key in self._elements if key == path or key.startswith(below)]:
                del self._elements[key]
            owner, _, last = path.rpartition("/")
            if last == OBJECT and owner in self._elements:
                self._elements[owner].object = None
            changes = self._changes
            for marked in (changes.objects, changes.poses):
                for key in [key for key in marked if key == path or key.startswith(below)]:
                    del marked[key]
            if last == OBJECT:
                changes.objects.pop(owner, None)
            for named in [named for named in changes.properties if named[0] == path or named[0].startswith(below)]:
                del changes.properties[named]
            changes.deleted[path] = None
        self.on_change()

    def has_path(self, path: str) -> bool:
        """Returns whether something was ever set at, or below, a path and not deleted."""
        self.settle()
        with self._lock:
            return path in self._elements

    def get(self, path: str) -> Element | None:
        """Returns the element at a path, or None."""
        if self._deferred:
            self.settle()
        with self._lock:
            return self._elements.get(path)

    def note(self, path: str) -> None:
        """Says that what is drawn below a full path tells about the scene and is no part of it, such as forces."""
        self._notes.add(path)

    def is_part_of_the_scene(self, path: str) -> bool:
        """Returns whether what is drawn at a full path is seen, and no note about something else."""
        for part in [f"{path}/{OBJECT}", path, *parents(path)]:
            element = self.get(part)
            if part in self._notes or (element is not None and element.properties.get("visible") is False):
                return False
        return True

    def items(self) -> list[tuple[str, Element]]:
        """Returns all paths with their elements."""
        self.settle()
        with self._lock:
            return list(self._elements.items())

    def take_changes(self) -> Changes:
        """Returns what changed since the last call and forgets it."""
        self.settle()
        with self._lock:
            changes, self._changes = self._changes, Changes()
        return changes

    def pose_in_world(self, path: str, moved: dict[str, np.ndarray] | None = None) -> np.ndarray:
        """Returns the product of all poses along a path, shape (4, 4).

        Args:
            path: A full path.
            moved: Path -> pose, shape (3, 4), in place of the tree's.
        """
        X = np.eye(4)
        for part in [path, *parents(path)]:
            element = self.get(part)
            pose = element.pose if element is not None else None
            if moved and part in moved:
                pose = moved[part]
            if pose is not None:
                X = as_matrix4(pose) @ X
        return X


def as_float(number: SupportsFloat) -> float:
    """Returns a number without its derivatives."""
    return float(number.value() if hasattr(number, "value") else number)


def as_matrix4(pose: np.ndarray) -> np.ndarray:
    """Returns a pose of shape (3, 4) or (4, 4) as a matrix of shape (4, 4)."""
    if pose.shape == (4, 4):
        return pose
    return np.vstack([pose, (0.0, 0.0, 0.0, 1.0)])


def quaternions(R: np.ndarray) -> np.ndarray:
    """Returns unit quaternions (w, x, y, z), shape (n, 4), of rotation matrices, shape (n, 3, 3).

    Shepperd's method: divide by the largest of the four components.
    """
    trace = R[:, 0, 0] + R[:, 1, 1] + R[:, 2, 2]
    diagonal = np.stack([trace, R[:, 0, 0], R[:, 1, 1], R[:, 2, 2]], axis=1)
    q = np.empty((len(R), 4))
    largest = np.argmax(diagonal, axis=1)
    for n, case in enumerate(largest):
        M = R[n]
        if case == 0:
            q[n] = (1.0 + trace[n], M[2, 1] - M[1, 2], M[0, 2] - M[2, 0], M[1, 0] - M[0, 1])
        else:
            i = case - 1
            j, k = (i + 1) % 3, (i + 2) % 3
            q[n, 0] = M[k, j] - M[j, k]
            q[n, 1 + i] = 1.0 + M[i, i] - M[j, j] - M[k, k]
            q[n, 1 + j] = M[j, i] + M[i, j]
            q[n, 1 + k] = M[k, i] + M[i, k]
    return q / np.linalg.norm(q, axis=1, keepdims=True)
