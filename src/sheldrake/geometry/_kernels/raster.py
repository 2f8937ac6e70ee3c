"""Which surface every pixel sees.

The ray of pixel (u, v) is t (x, y, 1) with x = (u + 1/2 - c_x) / f_x, y likewise: t is the depth z. A triangle ABC is
met where the three numbers in (x, y, 1) = t^-1 (A, B, C) b are not negative. They and the nearness 1/z are linear in u
and v (M. Olano and T. Greer, Triangle scan conversion using 2D homogeneous coordinates, 1997): a row of a triangle is
one span, nothing is clipped, and depth is exact. Curved patches are met by solving their quadratic equation.
"""

from __future__ import annotations

from sheldrake.common._kernels.generic import sqrt, whole
from sheldrake.common._kernels.vec import (
    add3,
    cross3,
    dot3,
    rotate,
    rotate_back,
    scale3,
)
from sheldrake.common.kernel import kernel

from .raster_scene import QUADRIC

BOTH, BACK, FRONT = range(3)  # sides of a surface
EDGE_ON = 1e-28  # square of the sine of the angle between camera and face below which its side is rounding
SLACK = 1e-9  # pixels by which a span is too long, so that rounding leaves no gap between neighbours


@kernel
def clear(scene, screen):
    beyond = 1.0 / scene.far
    for v in range(screen.seen.shape[0]):
        for u in range(screen.seen.shape[1]):
            screen.nearness[v, u] = beyond
            screen.seen[v, u] = -1


@kernel
def ray_x(scene, u):
    """x of the ray (x, y, 1) of column u."""
    return (u + 0.5 - scene.centre_x) / scene.focal_x


@kernel
def ray_y(scene, v):
    return (v + 0.5 - scene.centre_y) / scene.focal_y


@kernel
def place_vertices(surfaces, scene, item):
    """p_CV of an item's vertices."""
    pose = scene.poses[item]
    for i in range(surfaces.items[item].first_vertex, surfaces.items[item + 1].first_vertex):
        scene.corners[i].p_CV = add3(rotate(pose.R_CG, surfaces.vertices[i].p_GV), pose.p_CG)


# ---- boxes in the picture: (first column, last column, first row, last row)


@kernel
def clipped_pixel(x, count):
    """A column or row, kept within one of those of the picture."""
    return 0 if x < 0.0 else count if x > count else whole(x)


@kernel
def cover_point(scene, box, p):
    """The box (in pixels, not rounded) with a point in front of the camera added."""
    u = p[0] / p[2] * scene.focal_x + scene.centre_x - 0.5
    v = p[1] / p[2] * scene.focal_y + scene.centre_y - 0.5
    return min(box[0], u), max(box[1], u), min(box[2], v), max(box[3], v)


@kernel
def cover_edge(scene, box, a, b):
    """The box with the part of the edge from a to b beyond the near plane added; b itself is left to the next edge."""
    near = scene.near
    if a[2] >= near:
        box = cover_point(scene, box, a)
    if (a[2] >= near) != (b[2] >= near):
        s = (near - a[2]) / (b[2] - a[2])
        box = cover_point(scene, box, (a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), near))
    return box


@kernel
def empty_box():
    return 1e300, -1e300, 1e300, -1e300


@kernel
def pixels_of(screen, box):
    """Whole columns and rows of a box, first and last, within the picture; last < first for an empty one."""
    height, width = screen.seen.shape
    if box[1] < -0.5 or box[0] > width - 0.5 or box[3] < -0.5 or box[2] > height - 0.5:
        return 0, -1, 0, -1
    return (
        clipped_pixel(box[0], width - 1),
        clipped_pixel(box[1] + 1.0, width - 1),
        clipped_pixel(box[2], height - 1),
        clipped_pixel(box[3] + 1.0, height - 1),
    )


# ---- triangles


@kernel
def narrowed(low, high, slope, at_zero):
    """The part of the columns from low to high where slope u + at_zero is not negative."""
    if slope > 0.0:
        return max(low, -at_zero / slope - SLACK), high
    if slope < 0.0:
        return low, min(high, -at_zero / slope + SLACK)
    if at_zero < 0.0:
        return high + 1.0, high
    return low, high


@kernel
def in_pixels(scene, e):
    """The linear function e . (x, y, 1) as (slope in u, slope in v, value at u = v = 0)."""
    slope_u = e[0] / scene.focal_x
    slope_v = e[1] / scene.focal_y
    at_zero = e[2] + (0.5 - scene.centre_x) * slope_u + (0.5 - scene.centre_y) * slope_v
    return slope_u, slope_v, at_zero


@kernel(outline=True)
def draw_face(surfaces, scene, face, side, screen):
    i, j, k = surfaces.faces[face].corners
    a = scene.corners[i].p_CV
    b = scene.corners[j].p_CV
    c = scene.corners[k].p_CV
    e_a = cross3(b, c)
    det = dot3(a, e_a)  # the camera is in front of a face when it is negative
    if det * det <= EDGE_ON * dot3(a, a) * dot3(b, b) * dot3(c, c):
        return
    if (side == BACK and det < 0.0) or (side == FRONT and det > 0.0):
        return
    box = cover_edge(scene, empty_box(), a, b)
    box = cover_edge(scene, box, b, c)
    box = cover_edge(scene, box, c, a)
    first_u, last_u, first_v, last_v = pixels_of(screen, box)
    if last_u < first_u:
        return
    sign = 1.0 if det > 0.0 else -1.0
    f_a = in_pixels(scene, e_a)
    f_b = in_pixels(scene, cross3(c, a))
    f_c = in_pixels(scene, cross3(a, b))
    slope = (f_a[0] + f_b[0] + f_c[0]) / det
    nearest = 1.0 / scene.near
    for v in range(first_v, last_v + 1):
        r_a = f_a[1] * v + f_a[2]
        r_b = f_b[1] * v + f_b[2]
        r_c = f_c[1] * v + f_c[2]
        at_zero = (r_a + r_b + r_c) / det
        low, high = narrowed(first_u * 1.0, last_u * 1.0, sign * f_a[0], sign * r_a)
        low, high = narrowed(low, high, sign * f_b[0], sign * r_b)
        low, high = narrowed(low, high, sign * f_c[0], sign * r_c)
        low, high = narrowed(low, high, -slope, nearest - at_zero)
        if low > high:
            continue
        for u in range(-whole(-low), whole(high) + 1):
            nearness = slope * u + at_zero
            if nearness > screen.nearness[v, u]:
                screen.nearness[v, u] = nearness
                screen.seen[v, u] = face


# ---- patches


@kernel
def cover_patch(surfaces, scene, patch):
    """The box of a patch in the picture; the whole plane when a part of it is not beyond the near plane."""
    box = empty_box()
    held = surfaces.patches[patch]
    pose = scene.poses[surfaces.patch_kinds[patch].item]
    for k in range(8):
        x = held.half_x if k % 2 == 0 else -held.half_x
        y = held.half_y if k % 4 < 2 else -held.half_y
        z = held.top if k < 4 else held.bottom
        p = add3(rotate(pose.R_CG, (x, y, z)), pose.p_CG)
        if p[2] < scene.near:
            return -1e300, 1e300, -1e300, 1e300
        box = cover_point(scene, box, p)
    return box


@kernel
def origin_in_patch(surfaces, scene, patch):
    """Position of the camera from the patch's centre, in G."""
    pose = scene.poses[surfaces.patch_kinds[patch].item]
    p_GC = rotate_back(pose.R_CG, pose.p_CG)
    return -p_GC[0], -p_GC[1], -p_GC[2] - surfaces.patches[patch].z0


@kernel
def draw_quadric(surfaces, scene, patch, side, screen):
    first_u, last_u, first_v, last_v = pixels_of(screen, cover_patch(surfaces, scene, patch))
    R_CG = scene.poses[surfaces.patch_kinds[patch].item].R_CG
    o = origin_in_patch(surfaces, scene, patch)
    quadric = surfaces.patches[patch]
    D = quadric.squares
    Do = (D[0] * o[0], D[1] * o[1], D[2] * o[2])
    c = dot3(o, Do) - 1.0
    low = quadric.low - quadric.z0
    high = quadric.high - quadric.z0
    nearest = 1.0 / scene.near
    right = rotate_back(R_CG, (1.0, 0.0, 0.0))
    for v in range(first_v, last_v + 1):
        start = rotate_back(R_CG, (0.0, ray_y(scene, v), 1.0))
        for u in range(first_u, last_u + 1):
            d = add3(start, scale3(right, ray_x(scene, u)))
            a = D[0] * d[0] * d[0] + D[1] * d[1] * d[1] + D[2] * d[2] * d[2]
            b = dot3(d, Do)
            under = b * b - a * c
            if under < 0.0:
                continue
            # c w^2 + 2 b w + a = 0 for the nearness w, without differences of nearly equal numbers
            q = -b + sqrt(under) if b < 0.0 else -b - sqrt(under)
            for over, below in ((q, c), (a, q)):
                w = over / below if below != 0.0 else -1.0
                if w <= screen.nearness[v, u] or w > nearest:
                    continue
                front = b * w + a < 0.0  # the way in
                if (side == BACK and front) or (side == FRONT and not front):
                    continue
                z = o[2] + d[2] / w
                if low <= z and z <= high:
                    screen.nearness[v, u] = w
                    screen.seen[v, u] = len(surfaces.faces) + patch


@kernel
def draw_disc(surfaces, scene, patch, side, screen):
    first_u, last_u, first_v, last_v = pixels_of(screen, cover_patch(surfaces, scene, patch))
    R_CG = scene.poses[surfaces.patch_kinds[patch].item].R_CG
    o = origin_in_patch(surfaces, scene, patch)
    disc = surfaces.patches[patch]
    outside = o[2] * disc.z0 > 0.0  # a disc's outer side is away from the middle of its cylinder
    if o[2] == 0.0 or (side == BACK and outside) or (side == FRONT and not outside):
        return
    nearest = 1.0 / scene.near
    radius = disc.high
    for v in range(first_v, last_v + 1):
        for u in range(first_u, last_u + 1):
            d = rotate_back(R_CG, (ray_x(scene, u), ray_y(scene, v), 1.0))
            w = -d[2] / o[2]
            if w > screen.nearness[v, u] and w <= nearest:
                x = o[0] + d[0] / w
                y = o[1] + d[1] / w
                if x * x + y * y <= radius * radius:
                    screen.nearness[v, u] = w
                    screen.seen[v, u] = len(surfaces.faces) + patch


@kernel(outline=True)
def draw_patch(surfaces, scene, patch, side, screen):
    if surfaces.patch_kinds[patch].kind == QUADRIC:
        draw_quadric(surfaces, scene, patch, side, screen)
    else:
        draw_disc(surfaces, scene, patch, side, screen)


@kernel
def draw_item(surfaces, scene, item, side, screen):
    """Marks the pixels that see an item; `side` is BOTH, or only what shows its BACK or FRONT."""
    place_vertices(surfaces, scene, item)
    for face in range(surfaces.items[item].first_face, surfaces.items[item + 1].first_face):
        draw_face(surfaces, scene, face, side, screen)
    for patch in range(surfaces.items[item].first_patch, surfaces.items[item + 1].first_patch):
        draw_patch(surfaces, scene, patch, side, screen)


@kernel
def draw_opaque(surfaces, scene, screen):
    clear(scene, screen)
    for k in range(scene.opaque.shape[0]):
        draw_item(surfaces, scene, scene.opaque[k], BOTH, screen)
