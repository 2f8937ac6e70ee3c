"""From visible surfaces to pictures of depth, labels and colours."""

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

from .raster import BACK, FRONT, POSITION, clear, draw_item, draw_opaque, origin_in_patch, ray_x, ray_y
from .raster_scene import (
    ATTENUATION,
    COLOUR,
    CONE,
    DEPTHS,
    DIFFUSE,
    DIRECTIONAL,
    EVEN,
    FACE_ITEM,
    FACE_MATERIAL,
    FIRST_TEXEL,
    HIGH,
    KIND,
    LABEL,
    LABELS,
    LEAST,
    LIGHT_COLOUR,
    LIGHT_DIRECTION,
    LIGHT_KIND,
    LIGHT_POSITION,
    MOST,
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
    Look,
    Scene,
    Screen,
    Surfaces,
)
from .table import absolute

PI = np.pi
HALF = 0.5 + 1e-9  # so that what is exactly between two bytes is rounded up, whatever the last bits say


@kernel
def unit(a):
    return scale3(a, 1.0 / sqrt(dot3(a, a) + 1e-300))


# ---- surface points: (normal in C, texture coordinates, colour)


@kernel
def mixed3(A, face, column, b):
    """Sum of three columns of a face's vertices, weighted."""
    p = scale3(load3_at(A, face[0], column), b[0])
    q = scale3(load3_at(A, face[1], column), b[1])
    r = scale3(load3_at(A, face[2], column), b[2])
    return add3(p, add3(q, r))


@kernel
def point_of_face(surfaces, look, scene, face, p):
    """What is at point p of a face."""
    i = (surfaces.face[face, 0], surfaces.face[face, 1], surfaces.face[face, 2])
    A = load3(scene.corner, i[0])
    u = sub3(load3(scene.corner, i[1]), A)
    v = sub3(load3(scene.corner, i[2]), A)
    n = cross3(u, v)
    s = 1.0 / dot3(n, n)
    d = sub3(p, A)
    b1 = dot3(cross3(d, v), n) * s
    b2 = dot3(cross3(u, d), n) * s
    b = (1.0 - b1 - b2, b1, b2)
    if look.material[surfaces.face[face, FACE_MATERIAL], SMOOTH] > 0.0:
        n = rotate(load9(scene.X_CG, surfaces.face[face, FACE_ITEM]), mixed3(surfaces.vertex, i, NORMAL, b))
    uv = mixed3(surfaces.vertex, i, TEXTURE, b)
    return unit(n), (uv[0], uv[1]), mixed3(surfaces.vertex, i, COLOUR, b)


@kernel
def wrapped(patches, patch, x, D):
    """Texture coordinates at x from the centre of a quadric; about the axis the texture goes there and back."""
    low = patches[patch, WRAP_FROM]
    high = patches[patch, WRAP_TO]
    if high > low:
        return atan2(absolute(x[0]), x[1]) / PI, (x[2] + patches[patch, Z0] - low) / (high - low)
    angle = atan2(x[1], x[0]) / (2.0 * PI)
    latitude = acos(min(1.0, max(-1.0, -x[2] * sqrt(D[2])))) / PI
    return (angle if angle >= 0.0 else angle + 1.0, latitude)


@kernel
def point_of_patch(surfaces, scene, patch, p):
    """What is at point p of a curved patch."""
    patches = surfaces.patch
    item = surfaces.patch_kind[patch, PATCH_ITEM]
    R_CG = load9(scene.X_CG, item)
    x = add3(rotate_back(R_CG, p), origin_in_patch(patches, patch, R_CG, load3_at(scene.X_CG, item, POSITION)))
    if surfaces.patch_kind[patch, KIND] == QUADRIC:
        D = load3_at(patches, patch, X2)
        n = (D[0] * x[0], D[1] * x[1], D[2] * x[2])
        uv = wrapped(patches, patch, x, D)
    else:
        n = (0.0, 0.0, 1.0)
        uv = (0.5 + 0.5 * x[0] / patches[patch, HIGH], 0.5 + 0.5 * x[1] / patches[patch, HIGH])
    return unit(rotate(R_CG, n)), uv, (1.0, 1.0, 1.0)


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
def material_of(surfaces, seen):
    faces = surfaces.face.shape[0]
    if seen < faces:
        return surfaces.face[seen, FACE_MATERIAL]
    return surfaces.patch_kind[seen - faces, PATCH_MATERIAL]


@kernel(outline=True)
def colour_at(surfaces, look, scene, seen, p):
    """Red, green and blue of surface number `seen` at point p, with light on it."""
    faces = surfaces.face.shape[0]
    if seen < faces:
        n, uv, base = point_of_face(surfaces, look, scene, seen, p)
    else:
        n, uv, base = point_of_patch(surfaces, scene, seen - faces, p)
    if dot3(n, p) > 0.0:
        n = neg3(n)
    material = material_of(surfaces, seen)
    diffuse = load3_at(look.material, material, DIFFUSE)
    base = (base[0] * diffuse[0], base[1] * diffuse[1], base[2] * diffuse[2])
    if look.material[material, FIRST_TEXEL] >= 0.0:
        t = texture_colour(look, material, uv)
        base = (base[0] * t[0], base[1] * t[1], base[2] * t[2])
    sum_ = (0.0, 0.0, 0.0)
    for k in range(scene.light.shape[0]):
        sum_ = add3(sum_, light_on(scene.light, k, n, p))
    return min(1.0, base[0] * sum_[0]), min(1.0, base[1] * sum_[1]), min(1.0, base[2] * sum_[2])


@kernel
def packed(colour):
    """A colour in [0, 1] as one number, opaque."""
    r = whole(255.0 * colour[0] + HALF)
    g = whole(255.0 * colour[1] + HALF)
    b = whole(255.0 * colour[2] + HALF)
    return r + (g << 8) + (b << 16) + (255 << 24)


@kernel
def point_of_pixel(camera, u, v, nearness):
    z = 1.0 / nearness
    return ray_x(camera, u) * z, ray_y(camera, v) * z, z


# ---- pictures


@kernel
def fill_depths(scene, screen):
    """Nearness becomes depth: 0 where too close, infinite where too far or empty."""
    least = scene.camera[LEAST]
    most = scene.camera[MOST]
    for v in range(screen.seen.shape[0]):
        for u in range(screen.seen.shape[1]):
            z = 1.0 / screen.nearness[v, u]
            if screen.seen[v, u] < 0 or z > most:
                z = np.inf
            elif z < least:
                z = 0.0
            screen.nearness[v, u] = z


@kernel
def fill_labels(surfaces, scene, screen):
    faces = surfaces.face.shape[0]
    for v in range(screen.seen.shape[0]):
        for u in range(screen.seen.shape[1]):
            seen = screen.seen[v, u]
            if seen < 0:
                screen.seen[v, u] = scene.empty[0]
            elif seen < faces:
                screen.seen[v, u] = surfaces.item[surfaces.face[seen, FACE_ITEM], LABEL]
            else:
                screen.seen[v, u] = surfaces.item[surfaces.patch_kind[seen - faces, PATCH_ITEM], LABEL]


@kernel
def is_parallel(lights):
    """True if the same light falls everywhere."""
    for k in range(lights.shape[0]):
        if lights[k, LIGHT_KIND] != DIRECTIONAL:
            return False
    return True


@kernel
def fill_colours(surfaces, look, scene, screen):
    parallel = is_parallel(scene.light)
    last = -1  # an evenly lit surface, and its colour
    last_colour = 0
    for v in range(screen.seen.shape[0]):
        for u in range(screen.seen.shape[1]):
            seen = screen.seen[v, u]
            if seen < 0:
                screen.seen[v, u] = scene.empty[0]
            elif seen == last:
                screen.seen[v, u] = last_colour
            else:
                p = point_of_pixel(scene.camera, u, v, screen.nearness[v, u])
                colour = packed(colour_at(surfaces, look, scene, seen, p))
                screen.seen[v, u] = colour
                even = seen < surfaces.face.shape[0] and look.material[material_of(surfaces, seen), EVEN] > 0.0
                if parallel and even:
                    last = seen
                    last_colour = colour


@kernel
def blend(surfaces, look, scene, screen, layer):
    """Lays what a layer shows before the opaque surfaces over the colours."""
    for v in range(screen.seen.shape[0]):
        for u in range(screen.seen.shape[1]):
            seen = layer.seen[v, u]
            if seen >= 0 and layer.nearness[v, u] > screen.nearness[v, u]:
                p = point_of_pixel(scene.camera, u, v, layer.nearness[v, u])
                over = colour_at(surfaces, look, scene, seen, p)
                opacity = look.material[material_of(surfaces, seen), DIFFUSE + 3]
                screen.seen[v, u] = packed(mixed(unpacked(screen.seen[v, u]), over, opacity))


@kernel(top=True)
def draw(kind: int, surfaces_model: Surfaces, look_model: Look, scene: Scene, screen: Screen, layer: Screen) -> None:
    """One picture of a scene: of DEPTHS, LABELS or COLOURS, into `screen`.

    Translucent items are drawn in the order given, their far sides before their near ones, into `layer`, which has the
    size of the picture when there are any.
    """
    draw_opaque(surfaces_model, scene, screen)
    if kind == DEPTHS:
        fill_depths(scene, screen)
    elif kind == LABELS:
        fill_labels(surfaces_model, scene, screen)
    else:
        fill_colours(surfaces_model, look_model, scene, screen)
        for k in range(scene.translucent.shape[0]):
            for side in range(BACK, FRONT + 1):
                clear(scene, layer)
                draw_item(surfaces_model, scene, scene.translucent[k], side, layer)
                blend(surfaces_model, look_model, scene, screen, layer)
