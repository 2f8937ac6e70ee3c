"""Riccati differential equations, many steps at once.

S' = -(Q + S A + A' S - S G S) is linear in X and Y with S = Y X^-1: their Hamiltonian matrix is [[A, -G], [-Q, -A']].
Over a step it is integrated to fourth order in time (Magnus 1954; Blanes, Casas and Ros 2000) and exactly where it is
constant, however fast its modes. A step back in time is S -> H + E' S (1 + G S)^-1 E, and so are two in a row, which is
how they are composed (Anderson 1978): pairs of steps are solved as steps, and then what is in their middles.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

_PADE = 1.0, 1 / 2, 5 / 44, 1 / 66, 1 / 792, 1 / 15840, 1 / 665280
"""Coefficients of the diagonal approximant of exp of degree six."""


class Maps(NamedTuple):
    """S at the end of stretches of time to S at their starts; each of shape (stretches, n, n)."""

    E: np.ndarray
    G: np.ndarray
    H: np.ndarray

    def __call__(self, S: np.ndarray) -> np.ndarray:
        """S at the starts."""
        one = np.eye(S.shape[-1])
        S = self.H + _transposed(self.E) @ S @ np.linalg.solve(one + self.G @ S, self.E)
        return 0.5 * (S + _transposed(S))

    def after(self, later: Maps) -> Maps:
        """The maps of these stretches and those that follow them, as one."""
        n = self.E.shape[-1]
        V = np.linalg.solve(np.eye(n) + self.G @ later.H, np.concatenate((self.E, self.G), axis=-1))
        V_E, V_G, E_T = V[..., :n], V[..., n:], _transposed(self.E)
        return Maps(later.E @ V_E, later.G + later.E @ V_G @ _transposed(later.E), self.H + E_T @ later.H @ V_E)

    def back_from(self, S: np.ndarray) -> np.ndarray:
        """S at the start of each stretch, from that at the very end."""
        if len(self.E) == 1:
            return self(S)
        alone = len(self.E) % 2
        firsts, seconds = self._part(slice(alone, None, 2)), self._part(slice(alone + 1, None, 2))
        starts = np.empty_like(self.E)
        starts[alone::2] = firsts.after(seconds).back_from(S)
        starts[alone + 1 :: 2] = seconds(np.concatenate((starts[alone + 2 :: 2], S[None])))
        if alone:
            starts[:1] = self._part(slice(1))(starts[1:2])
        return starts

    def _part(self, which: slice) -> Maps:
        return Maps(*(m[which] for m in self))


def _transposed(matrices: np.ndarray) -> np.ndarray:
    return np.swapaxes(matrices, -1, -2)


def hamiltonian(A: np.ndarray, G: np.ndarray, Q: np.ndarray) -> np.ndarray:
    """[[A, -G], [-Q, -A']], shape (..., 2 n, 2 n)."""
    return np.concatenate((np.concatenate((A, -G), axis=-1), np.concatenate((-Q, -_transposed(A)), axis=-1)), axis=-2)


def maps_of(start: np.ndarray, middle: np.ndarray, end: np.ndarray, h: np.ndarray) -> Maps:
    """The maps of steps.

    Args:
        start: The Hamiltonian matrix at the start of each step, shape (steps, 2 n, 2 n).
        middle: In the middle.
        end: At the end.
        h: Durations [s], shape (steps,).
    """
    h = h[:, None, None]
    turn = start @ end
    M = -h / 6.0 * (start + 4.0 * middle + end) + h * h / 12.0 * (turn - end @ start)
    halvings = int(max(0.0, np.ceil(np.log2(max(1e-300, np.abs(M).sum(axis=-1).max()) / 0.5))))
    maps = _from_exponential(_exponential(M * 0.5**halvings))
    for _ in range(halvings):
        maps = maps.after(maps)
    return maps


def _exponential(M: np.ndarray) -> np.ndarray:
    """Exp of matrices with norms up to 1/2."""
    one = np.eye(M.shape[-1])
    M2 = M @ M
    M4 = M2 @ M2
    c = _PADE
    even = c[0] * one + c[2] * M2 + c[4] * M4 + c[6] * (M4 @ M2)
    odd = M @ (c[1] * one + c[3] * M2 + c[5] * M4)
    return np.linalg.solve(even - odd, even + odd)


def _from_exponential(P: np.ndarray) -> Maps:
    n = P.shape[-1] // 2
    E = np.linalg.inv(P[..., :n, :n])
    return Maps(E, E @ P[..., :n, n:], P[..., n:, :n] @ E)
