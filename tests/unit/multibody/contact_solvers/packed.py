"""The factor of a packed momentum matrix, as the plant gives it to the solver."""

import numpy as np


def put_factor(model, problem):
    """Replaces `problem.L`, a packed symmetric matrix, by 1/D and L of L^T D L (Featherstone 2008, section 6.5)."""
    nv = len(model.dof)
    H, places = np.zeros((nv, nv)), {}
    for k in range(nv):
        i = k
        while i >= 0:
            places[k, i] = model.dofs[k].row_start + model.dofs[i].depth
            H[k, i] = H[i, k] = problem.L[places[k, i]]
            i = model.dofs[i].parent
    for k in range(nv - 1, -1, -1):
        row = H[k, :k] / H[k, k]
        H[:k, :k] -= np.outer(row, H[k, :k])
        H[k, :k], H[k, k] = row, 1.0 / H[k, k]
    for (k, i), at in places.items():
        problem.L[at] = H[k, i]
