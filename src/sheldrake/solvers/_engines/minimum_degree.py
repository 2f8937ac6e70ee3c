"""An order of elimination that keeps the factors of a sparse symmetric matrix sparse."""

from __future__ import annotations

import heapq

import numpy as np


def minimum_degree(size: int, rows: np.ndarray, cols: np.ndarray) -> np.ndarray:
    """Rows in the order in which they are best eliminated: always one that is connected with the fewest that are left.

    After W. F. Tinney and J. W. Walker, "Direct solutions of sparse network equations by optimally ordered triangular
    factorization" (Proceedings of the IEEE 55, 1967). Rows whose neighbours are among those of the row that goes are
    eliminated with it, as nothing fills then (mass elimination: A. George and J. W. H. Liu, SIAM Review 31, 1989).

    Args:
        size: Number of rows.
        rows: Row of each entry that is not zero, of either half or both.
        cols: Its column.

    Returns:
        Shape (size,).
    """
    neighbours: list[set[int]] = [set() for _ in range(size)]
    for i, j in zip(rows.tolist(), cols.tolist()):
        if i != j:
            neighbours[i].add(j)
            neighbours[j].add(i)
    waiting = [(len(near), i) for i, near in enumerate(neighbours)]
    heapq.heapify(waiting)
    order: list[int] = []
    gone = [False] * size
    while waiting:
        degree, row = heapq.heappop(waiting)
        if gone[row] or degree != len(neighbours[row]):
            continue  # It has another degree since, and waits with that one, too.
        clique = neighbours[row]
        closed = clique | {row}
        together = [i for i in clique if len(neighbours[i]) <= degree and neighbours[i] <= closed]
        order += [row, *sorted(together)]
        for i in (row, *together):
            gone[i] = True
        left = clique.difference(together)
        for i in left:
            near = neighbours[i]
            near |= left
            near.difference_update(together)
            near.discard(row)
            near.discard(i)
            heapq.heappush(waiting, (len(near), i))
    return np.array(order, dtype=np.int64)
