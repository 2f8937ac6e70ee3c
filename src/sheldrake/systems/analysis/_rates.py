"""How rates of positions follow from velocities, in all systems of a context."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from sheldrake.systems.framework._engine.store import Store


class Rates:
    """qdot = N(q) v and v = N⁺(q) qdot of a whole context; N is the identity where a leaf does not say otherwise.

    Attributes:
        q: Where positions are in the continuous state, shape (nq,).
        v: Where velocities are, shape (nv,).
        y: Where velocities and other variables are, shape (nv + nz,).
        memory: The slab.
        is_identity: Whether all rates of positions are velocities.
    """

    def __init__(self, store: Store):
        layout = store.layout
        q, v, z = (_indices(parts) for parts in layout.parts(0))
        self.q, self.v, self.y = q, v, np.concatenate([v, z])
        self.memory, self._at_q = store.S, layout.xc[0] + q
        self._leaves: list[tuple[Any, Any, slice, slice]] = []  # system, context, its places among q and v
        at_q = at_v = 0
        for n in layout.leaves:
            nq, nv, _ = (len(_indices(parts)) for parts in layout.parts(n))
            mapped = nq > 0 and not _is_identity(store.systems[n], nq, nv)
            context = store.context(n) if mapped else None
            self._leaves.append((store.systems[n], context, slice(at_q, at_q + nq), slice(at_v, at_v + nv)))
            at_q, at_v = at_q + nq, at_v + nv
        self.is_identity = all(context is None for _, context, _, _ in self._leaves)

    def qdot(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """N(q) v, shape (nq,); leaves q in the context."""
        if self.is_identity:
            return v
        self.memory[self._at_q] = q
        return self.qdot_there(v)

    def keep_to_velocities(self, dx: np.ndarray) -> None:
        """Takes from the change of a state, shape (n,), that of positions which velocities cannot change."""
        dq, v = dx[self.q], np.empty(len(self.v))
        for system, context, at_q, at_v in self._leaves:
            v[at_v] = dq[at_q] if context is None else system.MapQDotToVelocity(context, dq[at_q])
        dx[self.q] = self.qdot_there(v)

    def qdot_there(self, v: np.ndarray) -> np.ndarray:
        """N(q) v of the q in the context, shape (nq,)."""
        qdot = np.empty(len(self.q))
        for system, context, at_q, at_v in self._leaves:
            qdot[at_q] = v[at_v] if context is None else system.MapVelocityToQDot(context, v[at_v])
        return qdot


def _indices(parts: list[tuple[int, int]]) -> np.ndarray:
    return np.concatenate([np.arange(a, b) for a, b in parts])


def _is_identity(system: Any, nq: int, nv: int) -> bool:
    if hasattr(system, "MapVelocityToQDot"):
        return bool(system.IsVelocityEqualToQDot())
    if nq != nv:
        raise RuntimeError(
            f"{system._describe()} has {nq} positions and {nv} velocities: how velocities change positions is only "
            "known of plants, or where both are as many."
        )
    return True
