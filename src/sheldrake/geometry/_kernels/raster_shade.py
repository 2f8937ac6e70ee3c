"""The colour of a point of a surface: material, texture, light."""

from __future__ import annotations

import numpy as np

from sheldrake.common._kernels.generic import acos, atan2, sqrt, whole
from sheldrake.common._kernels.vec import (
    add3,
    cross3,
    dot3,
    load3,
    load3_at,
    load9,
    neg3,
    rotate,
    rotate_back,
    scale3,
    sub3,
)
from sheldrake.common.kernel import kernel

from .raster import POSITION, origin_in_patch
from .raster_scene import (
    ATTENUATION,
    COLOUR,
    CONE,
    DIFFUSE,
    DIRECTIONAL,
    EVEN,
    FACE_ITEM,
    FACE_MATERIAL,
    FIRST_TEXEL,
    HIGH,
    KIND,
    LIGHT_COLOUR,
    LIGHT_DIRECTION,
    LIGHT_KIND,
    LIGHT_POSITION,
    NORMAL,
    PATCH_ITEM,
    PATCH_MATERIAL,
    QUADRIC,
    REPEAT,
    SMOOTH,
    SPOT,
    TEXTURE,
    TEXTURE_HEIGHT,
    TEXTURE_WIDTH,
    WRAP_FROM,
    WRAP_TO,
    X2,
    Z0,
)
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
def corners_of(surfaces, face):
    return (surfaces.face[face, 0], surfaces.face[face, 1], surfaces.face[face, 2])


@kernel
def mixed3(A, corners, column, b):
    """Sum of three columns of a face's vertices, weighted."""
    p = scale3(load3_at(A, corners[0], column), b[0])
    q = scale3(load3_at(A, corners[1], column), b[1])
    r = scale3(load3_at(A, corners[2], column), b[2])
    return add3(p, add3(q, r))


@kernel
def on_face(surfaces, scene, face, p):
    """Normal of a face, of any length, and the weights of its corners at point p."""
    i = corners_of(surfaces, face)
    A = load3(scene.corner, i[0])
    u = sub3(load3(scene.corner, i[1]), A)
    v = sub3(load3(scene.corner, i[2]), A)
    n = cross3(u, v)
    s = 1.0 / dot3(n, n)
    d = sub3(p, A)
    b1 = dot3(cross3(d, v), n) * s
    b2 = dot3(cross3(u, d), n) * s
    return n, (1.0 - b1 - b2, b1, b2)


@kernel
def in_patch(surfaces, scene, patch, p):
    """Point p from the centre of a patch, in G."""
    item = surfaces.patch_kind[patch, PATCH_ITEM]
    R_CG = load9(scene.X_CG, item)
    p_CG = load3_at(scene.X_CG, item, POSITION)
    return add3(rotate_back(R_CG, p), origin_in_patch(surfaces.patch, patch, R_CG, p_CG))


@kernel
def normal_of_patch(surfaces, scene, patch, x):
    """Normal at x in a patch, in C, of any length."""
    D = load3_at(surfaces.patch, patch, X2)
    n = (D[0] * x[0], D[1] * x[1], D[2] * x[2])
    if surfaces.patch_kind[patch, KIND] != QUADRIC:
        n = (0.0, 0.0, 1.0)
    return rotate(load9(scene.X_CG, surfaces.patch_kind[patch, PATCH_ITEM]), n)


@kernel
def uv_of_patch(surfaces, patch, x):
    """Texture coordinates at x in a patch; about an axis the texture goes there and back."""
    patches = surfaces.patch
    if surfaces.patch_kind[patch, KIND] != QUADRIC:
        return 0.5 + 0.5 * x[0] / patches[patch, HIGH], 0.5 + 0.5 * x[1] / patches[patch, HIGH]
    low = patches[patch, WRAP_FROM]
    high = patches[patch, WRAP_TO]
    if high > low:
        return atan2(absolute(x[0]), x[1]) / PI, (x[2] + patches[patch, Z0] - low) / (high - low)
    angle = atan2(x[1], x[0]) / (2.0 * PI)
    latitude = acos(min(1.0, max(-1.0, -x[2] * sqrt(patches[patch, X2 + 2])))) / PI
    return (angle if angle >= 0.0 else angle + 1.0, latitude)


# ---- colours


@kernel
def texel(look, material, column, row):
    """A texel's colour."""
    width = whole(look.material[material, TEXTURE_WIDTH])
    height = whole(look.material[material, TEXTURE_HEIGHT])
    if look.material[material, REPEAT] > 0.0:
        column = column % width
        row = row % height
    else:
        column = min(max(column, 0), width - 1)
        row = min(max(row, 0), height - 1)
    return unpacked(look.texel[whole(look.material[material, FIRST_TEXEL]) + row * width + column])


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
    x = uv[0] * look.material[material, TEXTURE_WIDTH] - 0.5
    y = (1.0 - uv[1]) * look.material[material, TEXTURE_HEIGHT] - 0.5
    column = whole(x)
    row = whole(y)
    above = mixed(texel(look, material, column, row), texel(look, material, column + 1, row), x - column)
    below = mixed(texel(look, material, column, row + 1), texel(look, material, column + 1, row + 1), x - column)
    return mixed(above, below, y - row)


@kernel
def light_on(lights, k, n, p):
    """Light number k that a surface with normal n at point p reflects (Lambert), in three colours."""
    colour = load3_at(lights, k, LIGHT_COLOUR)
    direction = load3_at(lights, k, LIGHT_DIRECTION)
    if lights[k, LIGHT_KIND] == DIRECTIONAL:
        return scale3(colour, max(0.0, -dot3(n, direction)))
    way = sub3(p, load3_at(lights, k, LIGHT_POSITION))
    distance = sqrt(dot3(way, way)) + 1e-300
    ray = scale3(way, 1.0 / distance)
    a = load3_at(lights, k, ATTENUATION)
    strength = max(0.0, -dot3(n, ray)) / (a[0] + a[1] * distance + a[2] * distance * distance)
    if lights[k, LIGHT_KIND] == SPOT:
        inside = dot3(ray, direction)
        strength = strength * inside if inside >= lights[k, CONE] else 0.0
    return scale3(colour, strength)


@kernel
def look_of_face(surfaces, look, scene, face, p):
    """Normal in C, of any length, and colour without light at point p of a face."""
    material = surfaces.face[face, FACE_MATERIAL]
    diffuse = load3_at(look.material, material, DIFFUSE)
    n, b = on_face(surfaces, scene, face, p)
    if look.material[material, EVEN] > 0.0:
        return n, diffuse
    i = corners_of(surfaces, face)
    if look.material[material, SMOOTH] > 0.0:
        R_CG = load9(scene.X_CG, surfaces.face[face, FACE_ITEM])
        n = rotate(R_CG, mixed3(surfaces.vertex, i, NORMAL, b))
    colour = times3(diffuse, mixed3(surfaces.vertex, i, COLOUR, b))
    if look.material[material, FIRST_TEXEL] >= 0.0:
        colour = times3(colour, texture_colour(look, material, mixed3(surfaces.vertex, i, TEXTURE, b)))
    return n, colour


@kernel
def look_of_patch(surfaces, look, scene, patch, p):
    """The same at point p of a patch."""
    material = surfaces.patch_kind[patch, PATCH_MATERIAL]
    x = in_patch(surfaces, scene, patch, p)
    colour = load3_at(look.material, material, DIFFUSE)
    if look.material[material, FIRST_TEXEL] >= 0.0:
        u, v = uv_of_patch(surfaces, patch, x)
        colour = times3(colour, texture_colour(look, material, (u, v, 0.0)))
    return normal_of_patch(surfaces, scene, patch, x), colour


@kernel(outline=True)
def colour_at(surfaces, look, scene, seen, p):
    """Red, green and blue of surface number `seen` at point p, with light on it; both sides of a surface are alike."""
    faces = surfaces.face.shape[0]
    if seen < faces:
        n, colour = look_of_face(surfaces, look, scene, seen, p)
    else:
        n, colour = look_of_patch(surfaces, look, scene, seen - faces, p)
    n = unit(n if dot3(n, p) < 0.0 else neg3(n))
    light = (0.0, 0.0, 0.0)
    for k in range(scene.light.shape[0]):
        light = add3(light, light_on(scene.light, k, n, p))
    colour = times3(colour, light)
    return min(1.0, colour[0]), min(1.0, colour[1]), min(1.0, colour[2])
