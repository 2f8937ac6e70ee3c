"""Boxes of mesh trees against planes and against each other."""

from __future__ import annotations

from sheldrake.common._kernels.vec import add3, dot3, rotate, rotate_back, sub3
from sheldrake.common.kernel import kernel

from .table import absolute, reach_along


@kernel
def is_empty(model, node):
    return model.nodes[node].half_sizes[0] < 0.0


@kernel
def height_of_box(model, node, normal, offset):
    """Height of a box's centre above a plane, and how far the box reaches from there [m]."""
    box = model.nodes[node]
    return dot3(normal, box.centre) - offset, reach_along(box.half_sizes, normal)


@kernel
def wider(a, b, reach):
    return absolute(a) > b + reach


@kernel
def boxes_apart(model, node_a, node_b, R_AB, p_AB):
    """True if an axis of one of two boxes, each in the frame of its geometry, separates them."""
    h_a = model.nodes[node_a].half_sizes
    h_b = model.nodes[node_b].half_sizes
    if h_a[0] < 0.0 or h_b[0] < 0.0:
        return True
    b_in_A = add3(rotate(R_AB, model.nodes[node_b].centre), p_AB)
    d = sub3(b_in_A, model.nodes[node_a].centre)
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
    a = model.nodes[node_a].half_sizes
    b = model.nodes[node_b].half_sizes
    return a[0] + a[1] + a[2] >= b[0] + b[1] + b[2]
