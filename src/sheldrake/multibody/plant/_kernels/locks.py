"""Locked joints: their dofs are taken out of the step by cutting them off from all others.

A locked dof has no force, a momentum of its own and no part in any constraint, so its velocity stays zero.
"""

from __future__ import annotations

from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.problem import DOFS, NUM_CONTACTS, NUM_ROWS, ROW_DOFS, WIDTH
from sheldrake.multibody.tree._kernels.model import DEPTH, DOF_PARENT, ROW


@kernel
def is_locked(plant_model, p, dof):
    """Whether the joint of a dof is locked."""
    if plant_model.lock.shape[0] > 0:
        return p[plant_model.lock[dof]] != 0.0
    return False


@kernel
def any_locked(plant_model, p):
    found = False
    for k in range(plant_model.lock.shape[0]):
        if is_locked(plant_model, p, k):
            found = True
    return found


@kernel
def lock_motion(plant_model, p, v, force):
    """No velocity and no force on locked dofs."""
    for k in range(plant_model.lock.shape[0]):
        if is_locked(plant_model, p, k):
            v[k] = 0.0
            force[k] = 0.0


@kernel
def lock_mass_matrix(tree_model, plant_model, p, M):
    """Rows and columns of locked dofs become those of the unit matrix."""
    if any_locked(plant_model, p):
        for k in range(tree_model.dof.shape[0]):
            row = tree_model.dof[k, ROW]
            locked = is_locked(plant_model, p, k)
            if locked:
                M[row + tree_model.dof[k, DEPTH]] = 1.0
            i = tree_model.dof[k, DOF_PARENT]
            while i >= 0:
                if locked or is_locked(plant_model, p, i):
                    M[row + tree_model.dof[i, DEPTH]] = 0.0
                i = tree_model.dof[i, DOF_PARENT]


@kernel
def lock_contacts(plant_model, p, contacts, count):
    """Contacts do not move locked dofs."""
    if any_locked(plant_model, p):
        for c in range(count[NUM_CONTACTS]):
            for i in range(contacts.index[c, WIDTH]):
                if is_locked(plant_model, p, contacts.index[c, DOFS + i]):
                    for r in range(3):
                        contacts.J[3 * c + r, i] = 0.0


@kernel
def lock_rows(plant_model, p, rows, count):
    """Rows do not move locked dofs; a row that moves nothing else pulls at nothing."""
    if any_locked(plant_model, p):
        for r in range(count[NUM_ROWS]):
            for i in range(rows.index[r, WIDTH]):
                if is_locked(plant_model, p, rows.index[r, ROW_DOFS + i]):
                    rows.J[r, i] = 0.0
