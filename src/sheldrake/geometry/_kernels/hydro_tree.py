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
def sizes_of(R_AB):
    """The entries of a rotation without their signs."""
    return (
        absolute(R_AB[0]),
        absolute(R_AB[1]),
        absolute(R_AB[2]),
        absolute(R_AB[3]),
        absolute(R_AB[4]),
        absolute(R_AB[5]),
        absolute(R_AB[6]),
        absolute(R_AB[7]),
        absolute(R_AB[8]),
    )


@kernel
def boxes_apart(one, other, R_AB, p_AB, sizes):
    """True if an axis of one of two boxes, each in the frame of its geometry, separates them.

    `sizes` are those of R_AB. The three axes of a box are looked at together: which one it is cannot be foreseen.
    """
    h_a = one.half_sizes
    h_b = other.half_sizes
    d = sub3(add3(rotate(R_AB, other.centre), p_AB), one.centre)
    reach = add3(rotate(sizes, h_b), h_a)
    gap = max(absolute(d[0]) - reach[0], max(absolute(d[1]) - reach[1], absolute(d[2]) - reach[2]))
    if gap > 0.0 or h_a[0] < 0.0 or h_b[0] < 0.0:
        return True
    e = rotate_back(R_AB, d)
    reach = add3(rotate_back(sizes, h_a), h_b)
    gap = max(absolute(e[0]) - reach[0], max(absolute(e[1]) - reach[1], absolute(e[2]) - reach[2]))
    return gap > 0.0


@kernel
def beyond(d, half_size):
    return max(absolute(d) - half_size, 0.0 * d)


@kernel
def is_off_box(box, centre, radius):
    """True if a sphere, in the frame of a box, does not reach it."""
    d = sub3(centre, box.centre)
    h = box.half_sizes
    r = (beyond(d[0], h[0]), beyond(d[1], h[1]), beyond(d[2], h[2]))
    return dot3(r, r) > radius * radius


@kernel
def larger_box(model, node_a, node_b):
    """True if the box of node a is the larger one."""
    a = model.nodes[node_a].half_sizes
    b = model.nodes[node_b].half_sizes
    return a[0] + a[1] + a[2] >= b[0] + b[1] + b[2]
