"""The point contacts of a step as plants report them."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from sheldrake.common._kernels.generic import is_zero, sqrt
from sheldrake.common._kernels.vec import add3, neg3, scale3, sub3
from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector, kernel
from sheldrake.common.record import Record, integers, number, numbers, table
from sheldrake.geometry._kernels.model import ContactTable
from sheldrake.multibody.contact_solvers._kernels.laws import share
from sheldrake.multibody.contact_solvers._kernels.problem import Contacts
from sheldrake.multibody.plant._kernels.contacts import contact_frame
from sheldrake.multibody.plant._kernels.derivatives import DerivativeVectors


class Who(Record):
    """Who touches."""

    pair = integers(4, "rows of geometries A and B, rows of their bodies")


class PointContact(Record):
    """Where, and how they push."""

    p_WCa = numbers(3, "point on A's surface", "m")
    p_WCb = numbers(3, "point on B's surface", "m")
    nhat_BA_W = numbers(3, "unit normal from B into A")
    p_WC = numbers(3, "contact point", "m")
    f_Bc_W = numbers(3, "contact force on B at C", "N")
    depth = number("penetration at the step's start", "m")
    slip_speed = number("tangential speed of B against A at the step's end", "m/s")
    separation_speed = number("normal speed at the step's end, positive when separating", "m/s")


@table
class PointContacts(NamedTuple):
    """Room for all contacts; `total` says how many there are."""

    who: Annotated[IntMatrix, Who]
    how: Annotated[Matrix, PointContact]
    total: IntVector


@kernel(top=True)
def report_points(
    table: ContactTable, contacts: Contacts, stiffness: Vector, time_step: float, found: PointContacts
) -> None:
    """Fills `found` with the contacts that are felt, in the order of the solver; others were only seen ahead.

    Args:
        table: Contacts of the step.
        contacts: The same in the solver.
        stiffness: Of a point of each geometry [N/m].
        time_step: Of the step [s].
        found: Filled.
    """
    n = 0
    for c in range(table.num_contacts):
        contact = contacts[c]
        gamma, vc = contact.gamma, contact.vc
        if table[c].depth > 0.0 or gamma[2] > 0.0:
            nhat = table[c].nhat_BA_W
            x, y, _ = contact_frame(neg3(nhat))
            push = sub3(add3(scale3(x, gamma[0]), scale3(y, gamma[1])), scale3(nhat, gamma[2]))
            w = share(stiffness[table[c].geometry_A], stiffness[table[c].geometry_B])
            p_WCa, p_WCb = table[c].p_WCa, table[c].p_WCb
            found[n].pair = table[c].who
            found[n].p_WCa, found[n].p_WCb, found[n].nhat_BA_W = p_WCa, p_WCb, nhat
            found[n].p_WC = add3(p_WCb, scale3(sub3(p_WCa, p_WCb), w))
            found[n].f_Bc_W = (push[0] / time_step, push[1] / time_step, push[2] / time_step)
            found[n].depth = table[c].depth
            found[n].slip_speed = sqrt(vc[0] * vc[0] + vc[1] * vc[1])
            found[n].separation_speed = vc[2]
            n += 1
    found.total[0] = n


@kernel(top=True)
def report_forces(table: ContactTable, flow: DerivativeVectors, found: PointContacts) -> None:
    """Fills `found` with the contacts of derivatives that push; others part faster than springs do."""
    n = 0
    for c in range(table.num_contacts):
        force = flow.contacts[c]
        f_BC_W = force.f_BC_W
        if not (is_zero(f_BC_W[0]) and is_zero(f_BC_W[1]) and is_zero(f_BC_W[2])):
            found[n].pair = table[c].who
            found[n].p_WCa, found[n].p_WCb, found[n].nhat_BA_W = table[c].p_WCa, table[c].p_WCb, table[c].nhat_BA_W
            found[n].p_WC, found[n].f_Bc_W = force.p_WC, f_BC_W
            found[n].depth = table[c].depth
            found[n].slip_speed, found[n].separation_speed = force.slip, force.separation
            n += 1
    found.total[0] = n
