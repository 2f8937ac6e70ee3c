"""Locked joints: their dofs are taken out of the step by cutting them off from all others.

A locked dof has no force, a momentum of its own and no part in any constraint, so its velocity stays zero.
"""

from __future__ import annotations

from sheldrake.common.kernel import kernel


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
        for k in range(len(tree_model.dofs)):
            row = tree_model.dofs[k].row
            locked = is_locked(plant_model, p, k)
            if locked:
                M[row + tree_model.dofs[k].depth] = 1.0
            i = tree_model.dofs[k].parent
            while i >= 0:
                if locked or is_locked(plant_model, p, i):
                    M[row + tree_model.dofs[i].depth] = 0.0
                i = tree_model.dofs[i].parent


@kernel
def lock_contacts(plant_model, p, problem, contacts):
    """Contacts do not move locked dofs."""
    if any_locked(plant_model, p):
        for c in range(problem.num_contacts):
            contact = contacts[c]
            for i in range(contact.width):
                if is_locked(plant_model, p, contact.dofs[i]):
                    for r in range(3):
                        contact.J[r, i] = 0.0


@kernel
def lock_rows(plant_model, p, problem, rows):
    """Rows do not move locked dofs; a row that moves nothing else pulls at nothing."""
    if any_locked(plant_model, p):
        for r in range(problem.num_rows):
            row = rows[r]
            for i in range(row.width):
                if is_locked(plant_model, p, row.dofs[i]):
                    row.J[i] = 0.0
