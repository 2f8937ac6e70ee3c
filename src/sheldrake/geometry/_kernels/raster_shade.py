"""The colour of a point of a surface: material, texture, light."""

from __future__ import annotations

import numpy as np

from sheldrake.common._kernels.generic import acos, atan2, sqrt, whole
from sheldrake.common._kernels.vec import (
    add3,
    cross3,
    dot3,
    neg3,
    rotate,
    rotate_back,
    scale3,
    sub3,
)
from sheldrake.common.kernel import kernel

from .raster import origin_in_patch
from .raster_scene import DIRECTIONAL, QUADRIC, SPOT
from .table import absolute

PI = np.pi


@kernel
def unit(a):
    return scale3(a, 1.0 / sqrt(dot3(a, a) + 1e-300))


@kernel
def times3(a, b):
    return (a[0] * b[0], a[1] * b[1], a[2] * b[2])


# ---- points of surfaces


@kernel
def mixed3(p, q, r, b):
    """Sum of three vectors, weighted."""
    return add3(scale3(p, b[0]), add3(scale3(q, b[1]), scale3(r, b[2])))


@kernel
def mixed2(p, q, r, b):
    return (p[0] * b[0] + (q[0] * b[1] + r[0] * b[2]), p[1] * b[0] + (q[1] * b[1] + r[1] * b[2]))


@kernel
def on_face(surfaces, scene, face, p):
    """Normal of a face, of any length, and the weights of its corners at point p."""
    i, j, k = surfaces.faces[face].corners
    A = scene.corners[i].p_CV
    u = sub3(scene.corners[j].p_CV, A)
    v = sub3(scene.corners[k].p_CV, A)
    n = cross3(u, v)
    s = 1.0 / dot3(n, n)
    d = sub3(p, A)
    b1 = dot3(cross3(d, v), n) * s
    b2 = dot3(cross3(u, d), n) * s
    return n, (1.0 - b1 - b2, b1, b2)


@kernel
def in_patch(surfaces, scene, patch, p):
    """Point p from the centre of a patch, in G."""
    R_CG = scene.poses[surfaces.patch_kinds[patch].item].R_CG
    return add3(rotate_back(R_CG, p), origin_in_patch(surfaces, scene, patch))


@kernel
def normal_of_patch(surfaces, scene, patch, x):
    """Normal at x in a patch, in C, of any length."""
    quadric = surfaces.patch_kinds[patch].kind == QUADRIC
    n = times3(surfaces.patches[patch].squares, x) if quadric else (0.0, 0.0, 1.0)
    return rotate(scene.poses[surfaces.patch_kinds[patch].item].R_CG, n)


@kernel
def uv_of_patch(surfaces, patch, x):
    """Texture coordinates at x in a patch; about an axis the texture goes there and back."""
    shape = surfaces.patches[patch]
    if surfaces.patch_kinds[patch].kind != QUADRIC:
        return 0.5 + 0.5 * x[0] / shape.high, 0.5 + 0.5 * x[1] / shape.high
    low, high = shape.wrap_from, shape.wrap_to
    if high > low:
        return atan2(absolute(x[0]), x[1]) / PI, (x[2] + shape.z0 - low) / (high - low)
    angle = atan2(x[1], x[0]) / (2.0 * PI)
    latitude = acos(min(1.0, max(-1.0, -x[2] * sqrt(shape.squares[2])))) / PI
    return (angle if angle >= 0.0 else angle + 1.0, latitude)


# ---- colours


@kernel
def texel(look, material, column, row):
    """A texel's colour."""
    looks = look.materials[material]
    width = whole(looks.texture_width)
    height = whole(looks.texture_height)
    if looks.repeat > 0.0:
        column = column % width
        row = row % height
    else:
        column = min(max(column, 0), width - 1)
        row = min(max(row, 0), height - 1)
    return unpacked(look.texel[whole(looks.first_texel) + row * width + column])


@kernel
def unpacked(packed):
    """Red, green and blue in [0, 1]."""
    return (packed & 255) / 255.0, ((packed >> 8) & 255) / 255.0, ((packed >> 16) & 255) / 255.0


@kernel
def mixed(a, b, s):
    return add3(scale3(a, 1.0 - s), scale3(b, s))


@kernel
def texture_colour(look, material, uv):
    """A texture between its four nearest texels."""
    x = uv[0] * look.materials[material].texture_width - 0.5
    y = (1.0 - uv[1]) * look.materials[material].texture_height - 0.5
    column = whole(x)
    row = whole(y)
    above = mixed(texel(look, material, column, row), texel(look, material, column + 1, row), x - column)
    below = mixed(texel(look, material, column, row + 1), texel(look, material, column + 1, row + 1), x - column)
    return mixed(above, below, y - row)


@kernel
def light_on(scene, k, n, p):
    """Light number k that a surface with normal n at point p reflects (Lambert), in three colours."""
    light = scene.lights[k]
    direction = light.direction
    if light.kind == DIRECTIONAL:
        return scale3(light.colour, max(0.0, -dot3(n, direction)))
    way = sub3(p, light.p_CL)
    distance = sqrt(dot3(way, way)) + 1e-300
    ray = scale3(way, 1.0 / distance)
    a = light.attenuation
    strength = max(0.0, -dot3(n, ray)) / (a[0] + a[1] * distance + a[2] * distance * distance)
    if light.kind == SPOT:
        inside = dot3(ray, direction)
        strength = strength * inside if inside >= light.cone else 0.0
    return scale3(light.colour, strength)


@kernel
def look_of_face(surfaces, look, scene, face, p):
    """Normal in C, of any length, and colour without light at point p of a face."""
    material = surfaces.faces[face].material
    looks = look.materials[material]
    n, b = on_face(surfaces, scene, face, p)
    if looks.even > 0.0:
        return n, looks.diffuse
    i, j, k = surfaces.faces[face].corners
    u, v, w = surfaces.vertices[i], surfaces.vertices[j], surfaces.vertices[k]
    if looks.smooth > 0.0:
        R_CG = scene.poses[surfaces.faces[face].item].R_CG
        n = rotate(R_CG, mixed3(u.normal, v.normal, w.normal, b))
    colour = times3(looks.diffuse, mixed3(u.colour, v.colour, w.colour, b))
    if looks.first_texel >= 0.0:
        colour = times3(colour, texture_colour(look, material, mixed2(u.texture, v.texture, w.texture, b)))
    return n, colour


@kernel
def look_of_patch(surfaces, look, scene, patch, p):
    """The same at point p of a patch."""
    material = surfaces.patch_kinds[patch].material
    looks = look.materials[material]
    x = in_patch(surfaces, scene, patch, p)
    colour = looks.diffuse
    if looks.first_texel >= 0.0:
        colour = times3(colour, texture_colour(look, material, uv_of_patch(surfaces, patch, x)))
    return normal_of_patch(surfaces, scene, patch, x), colour


@kernel(outline=True)
def colour_at(surfaces, look, scene, seen, p):
    """Red, green and blue of surface number `seen` at point p, with light on it; both sides of a surface are alike."""
    faces = len(surfaces.faces)
    if seen < faces:
        n, colour = look_of_face(surfaces, look, scene, seen, p)
    else:
        n, colour = look_of_patch(surfaces, look, scene, seen - faces, p)
    n = unit(n if dot3(n, p) < 0.0 else neg3(n))
    light = (0.0, 0.0, 0.0)
    for k in range(len(scene.lights)):
        light = add3(light, light_on(scene, k, n, p))
    colour = times3(colour, light)
    return min(1.0, colour[0]), min(1.0, colour[1]), min(1.0, colour[2])
