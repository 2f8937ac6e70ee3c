"""Bodies whose surfaces run around an axis, as belts do, while the bodies stand still."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.tree import RigidBody

_LEAST = 1e-12
"""Length from which on a vector tells a direction."""


class SurfaceAxes:
    """Which bodies have surfaces that run, and around which axes.

    Args:
        elements: The bodies.
    """

    def __init__(self, elements: Elements) -> None:
        self._elements = elements
        self._axes: dict[RigidBody, np.ndarray] = {}

    def SetSurfaceVelocityAxis(self, body: RigidBody, axis_B: ArrayLike | None) -> None:
        """Has the surface of a body run: with speed s, at s (axis x n) where its outward normal is n.

        What touches it is dragged along by friction. Speeds come by the surface_speeds port.

        Args:
            body: Any but the world.
            axis_B: Direction in the body's frame, of any length but zero; None for a surface that does not run.

        Raises:
            RuntimeError: the plant is finalized, the body is the world or of another plant, or `axis_B` tells no
                direction.
        """
        call = "SetSurfaceVelocityAxis"
        self._elements.require_not_finalized(call)
        self._elements.require_mine(call, body)
        body = self._elements.bodies.get(body.index(), call)
        if axis_B is None:
            self._axes.pop(body, None)
            return
        if body.index() == 0:
            raise RuntimeError(f"{call}(): the world body has no surface that runs; weld a body to it and give it one.")
        self._axes[body] = _direction(call, body, axis_B)

    def GetSurfaceVelocityAxis(self, body: RigidBody) -> np.ndarray | None:
        """Unit vector in the body's frame around which its surface runs, None if it does not."""
        call = "GetSurfaceVelocityAxis"
        self._elements.require_mine(call, body)
        axis = self._axes.get(self._elements.bodies.get(body.index(), call))
        return None if axis is None else axis.copy()

    def bodies(self) -> list[RigidBody]:
        """The bodies whose surfaces run, in the order of their numbers."""
        return sorted(self._axes, key=lambda body: int(body.index()))

    def rows(self) -> list[tuple[int, np.ndarray]]:
        """Row and axis of each of them; after Finalize()."""
        rows = self._elements.model("Finalize").rows
        return [(int(rows[int(body.index())]), self._axes[body]) for body in self.bodies()]


def _direction(call: str, body: RigidBody, axis_B: ArrayLike) -> np.ndarray:
    axis = np.asarray(axis_B, dtype=float).reshape(-1)
    length = float(np.linalg.norm(axis)) if axis.shape == (3,) else 0.0
    if not _LEAST <= length < np.inf:
        raise RuntimeError(
            f"{call}(): the axis of {body.scoped_name()} must be three numbers that tell a direction, not {axis_B!r}."
        )
    return axis / length
