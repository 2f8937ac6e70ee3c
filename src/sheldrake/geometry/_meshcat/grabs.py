"""What the mouse holds in a page: Ctrl and the left button on a body, and where it is dragged to."""

from __future__ import annotations

import dataclasses
import threading
import weakref
from collections.abc import Callable, Collection
from typing import TYPE_CHECKING, Any

import numpy as np

from .tree import SceneTree, as_matrix4, parents

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@dataclasses.dataclass(frozen=True)
class Drag:
    """A point of something that is drawn, and where the mouse pulls it.

    Attributes:
        path: The full path of what is held.
        point: Where it is held, in the frame of `path` [m], shape (3,).
        p_WT: Where it is pulled to, in the world [m], shape (3,).
    """

    path: str
    point: np.ndarray
    p_WT: np.ndarray


class Grabs:
    """Bodies that a page may hold, and the one that it does.

    Args:
        tree: The scene.
    """

    def __init__(self, tree: SceneTree):
        self._tree = tree
        self._lock = threading.RLock()
        self._owners: dict[int, tuple[frozenset[str], Callable[[], Callable[[], None] | None]]] = {}
        self._client: int | None = None
        self.drag: Drag | None = None
        self.on_offer: Callable[[], None] = lambda: None

    def offer(self, bodies: Collection[str], told: Callable[[], None]) -> int:
        """Lets pages hold bodies; returns a number to withdraw that with.

        Args:
            bodies: Ends of their paths, "model/body".
            told: A bound method that is called when a drag begins, moves or ends, from another thread. Its object is
                not kept alive.
        """
        reference = weakref.WeakMethod(told)
        with self._lock:
            number = max(self._owners, default=0) + 1
            self._owners[number] = frozenset(bodies), reference
        self.on_offer()
        return number

    def withdraw(self, number: int) -> None:
        """Ends what offer() began."""
        with self._lock:
            if self._owners.pop(number, None) is None:
                return
            self.drag = None
        self.on_offer()

    def bodies(self) -> list[str]:
        """Returns the ends of the paths of all bodies that may be held, sorted."""
        with self._lock:
            return sorted({name for names, told in self._owners.values() if told() is not None for name in names})

    def receive(self, message: dict[str, Any], client: int | None) -> None:
        """Takes what a page says of its mouse.

        A page of ours says where it holds what in the frame of that ("point"), Meshcat's own in the world
        ("drag_anchor"); an empty name ends the drag.

        Raises:
            ValueError, TypeError, KeyError: when it says nothing of the kind.
        """
        path = str(message["name"])
        with self._lock:
            if not path:
                if client == self._client:
                    self.end(client)
                return
            target = _three(message["drag_target"])
            if self.drag is None or self.drag.path != path or client != self._client:
                if "point" in message:
                    point = _three(message["point"])
                else:
                    X_WN = self._tree.pose_in_world(path)
                    point = np.linalg.solve(X_WN, [*_three(message["drag_anchor"]), 1.0])[:3]
            else:
                point = self.drag.point
            self._client, self.drag = client, Drag(path, point, target)
        self._tell()

    def end(self, client: int | None) -> None:
        """Ends the drag of a page, if it has one."""
        with self._lock:
            if self.drag is None or client != self._client:
                return
            self.drag = None
        self._tell()

    def held(self) -> tuple[str, np.ndarray, np.ndarray] | None:
        """Returns which body is held, where on it and where to, or None.

        The body is the end of its path that was offered, of several that fit the longest, and of those the one nearest
        to the root: what is drawn of a body may have its name. The point is in the body's frame.
        """
        drag = self.drag
        if drag is None:
            return None
        chain = [drag.path, *parents(drag.path)]
        best: tuple[int, str] | None = None
        for depth, part in enumerate(chain):
            for name in self.bodies():
                if part.endswith("/" + name) and (best is None or len(name) >= len(best[1])):
                    best = depth, name
        if best is None:
            return None
        X = np.eye(4)
        for part in chain[: best[0]]:
            element = self._tree.get(part)
            if element is not None and element.pose is not None:
                X = as_matrix4(element.pose) @ X
        return best[1], X[:3, :3] @ drag.point + X[:3, 3], drag.p_WT

    def _tell(self) -> None:
        with self._lock:
            told = [reference() for _, reference in self._owners.values()]
        for call in told:
            if call is not None:
                call()


def _three(values: ArrayLike) -> np.ndarray:
    array = np.array(values, dtype=float)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise ValueError(f"expected three finite numbers, got {values!r}")
    return array
