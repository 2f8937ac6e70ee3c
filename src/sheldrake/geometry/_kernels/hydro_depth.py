"""How deep the vertices of a volume mesh lie below its surface."""

from __future__ import annotations

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import add3, dot3, load3, scale3, sub3
from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector, kernel


@kernel
def towards_edge(p, a, b):
    """Square of the distance of p from the segment from a to b."""
    u = sub3(b, a)
    length2 = dot3(u, u)
    t = 0.0
    if length2 > 0.0:
        t = dot3(sub3(p, a), u) / length2
    t = min(max(t, 0.0), 1.0)
    r = sub3(p, add3(a, scale3(u, t)))
    return dot3(r, r)


@kernel
def towards_triangle(p, a, b, c):
    """Square of the distance of p from a triangle: from its plane if the foot is inside, else from an edge."""
    u = sub3(b, a)
    v = sub3(c, a)
    q = sub3(p, a)
    uu = dot3(u, u)
    uv = dot3(u, v)
    vv = dot3(v, v)
    uq = dot3(u, q)
    vq = dot3(v, q)
    scale = uu * vv - uv * uv
    if scale > 0.0:
        beta = (vv * uq - uv * vq) / scale
        gamma = (uu * vq - uv * uq) / scale
        if beta >= 0.0 and gamma >= 0.0 and beta + gamma <= 1.0:
            r = sub3(q, add3(scale3(u, beta), scale3(v, gamma)))
            return dot3(r, r)
    return min(towards_edge(p, a, b), towards_edge(p, b, c), towards_edge(p, c, a))


@kernel(top=True)
def depths_below(vertex: Matrix, inside: IntVector, triangle: IntMatrix, depth: Vector) -> None:
    """Distance of each vertex of `inside` from the nearest triangle [m]."""
    for i in range(inside.shape[0]):
        p = load3(vertex, inside[i])
        least = 1e300
        for t in range(triangle.shape[0]):
            a, b, c = load3(vertex, triangle[t, 0]), load3(vertex, triangle[t, 1]), load3(vertex, triangle[t, 2])
            least = min(least, towards_triangle(p, a, b, c))
        depth[i] = sqrt(least)
