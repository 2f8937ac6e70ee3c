"""Boxes of mesh trees against planes and against each other."""

from __future__ import annotations

from sheldrake.common._kernels.vec import add3, dot3, load3_at, rotate, rotate_back, sub3
from sheldrake.common.kernel import kernel

from .hydro_model import CENTRE, HALF
from .table import absolute


@kernel
def is_empty(model, node):
    return model.node[node, HALF] < 0.0


@kernel
def reach_along(half, normal):
    """How far a box of half sizes `half` reaches along a direction [m]."""
    return half[0] * absolute(normal[0]) + half[1] * absolute(normal[1]) + half[2] * absolute(normal[2])


@kernel
def height_of_box(model, node, normal, offset):
    """Height of a box's centre above a plane, and how far the box reaches from there [m]."""
    centre = load3_at(model.node, node, CENTRE)
    return dot3(normal, centre) - offset, reach_along(load3_at(model.node, node, HALF), normal)


@kernel
def wider(a, b, reach):
    return absolute(a) > b + reach


@kernel
def boxes_apart(model, node_a, node_b, R_AB, p_AB):
    """True if an axis of one of two boxes, each in the frame of its geometry, separates them."""
    h_a = load3_at(model.node, node_a, HALF)
    h_b = load3_at(model.node, node_b, HALF)
    if h_a[0] < 0.0 or h_b[0] < 0.0:
        return True
    b_in_A = add3(rotate(R_AB, load3_at(model.node, node_b, CENTRE)), p_AB)
    d = sub3(b_in_A, load3_at(model.node, node_a, CENTRE))
    if wider(d[0], h_a[0], reach_along(h_b, (R_AB[0], R_AB[1], R_AB[2]))):
        return True
    if wider(d[1], h_a[1], reach_along(h_b, (R_AB[3], R_AB[4], R_AB[5]))):
        return True
    if wider(d[2], h_a[2], reach_along(h_b, (R_AB[6], R_AB[7], R_AB[8]))):
        return True
    e = rotate_back(R_AB, d)
    if wider(e[0], h_b[0], reach_along(h_a, (R_AB[0], R_AB[3], R_AB[6]))):
        return True
    if wider(e[1], h_b[1], reach_along(h_a, (R_AB[1], R_AB[4], R_AB[7]))):
        return True
    return wider(e[2], h_b[2], reach_along(h_a, (R_AB[2], R_AB[5], R_AB[8])))


@kernel
def larger_box(model, node_a, node_b):
    """True if the box of node a is the larger one."""
    a = model.node[node_a, HALF] + model.node[node_a, HALF + 1] + model.node[node_a, HALF + 2]
    return a >= model.node[node_b, HALF] + model.node[node_b, HALF + 1] + model.node[node_b, HALF + 2]
