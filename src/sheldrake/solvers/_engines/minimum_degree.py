"""An order of elimination that keeps the factors of a sparse symmetric matrix sparse."""

from __future__ import annotations

import numpy as np

from sheldrake.solvers._kernels.elimination import Quotient, order_of_least_degree


def minimum_degree(size: int, rows: np.ndarray, cols: np.ndarray) -> np.ndarray:
    """Rows in the order in which they are best eliminated: always one that is connected with the fewest that are left.

    Args:
        size: Number of rows.
        rows: Row of each entry that is not zero, of either half or both.
        cols: Its column.

    Returns:
        Shape (size,).
    """
    off = rows != cols
    i, j = rows[off], cols[off]
    keys = np.sort(np.concatenate((i * size + j, j * size + i)))
    keys = keys[np.diff(keys, prepend=-1) > 0]  # np.unique would load masked arrays, which takes longer than the rest
    starts = np.searchsorted(keys, np.arange(size + 1) * size).astype(np.int64)
    near = (keys % size).astype(np.int64)
    neighbours, elements, *others = np.zeros((13, size), dtype=np.int64)
    graph = Quotient(starts, near, neighbours, elements, np.zeros(2 * len(near), dtype=np.int64), *others)
    order_of_least_degree.native(graph)
    return graph.order
