"""From visible surfaces to pictures of depth, labels and colours."""

from __future__ import annotations

import numpy as np

from sheldrake.common._kernels.generic import whole
from sheldrake.common.kernel import kernel

from .raster import BACK, FRONT, clear, draw_item, draw_opaque, ray_x, ray_y
from .raster_scene import DEPTHS, DIRECTIONAL, LABELS, Look, Scene, Screen, Surfaces
from .raster_shade import colour_at, mixed, unpacked

HALF = 0.5 + 1e-9  # so that what is exactly between two bytes is rounded up, whatever the last bits say


@kernel
def material_of(surfaces, seen):
    faces = len(surfaces.faces)
    if seen < faces:
        return surfaces.faces[seen].material
    return surfaces.patch_kinds[seen - faces].material


@kernel
def packed(colour):
    """A colour in [0, 1] as one number, opaque."""
    r = whole(255.0 * colour[0] + HALF)
    g = whole(255.0 * colour[1] + HALF)
    b = whole(255.0 * colour[2] + HALF)
    return r + (g << 8) + (b << 16) + (255 << 24)


@kernel
def point_of_pixel(scene, u, v, nearness):
    z = 1.0 / nearness
    return ray_x(scene, u) * z, ray_y(scene, v) * z, z


# ---- pictures


@kernel
def fill_depths(scene, screen):
    """Nearness becomes depth: 0 where too close, infinite where too far or empty."""
    least = scene.least
    most = scene.most
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
    faces = len(surfaces.faces)
    for v in range(screen.seen.shape[0]):
        for u in range(screen.seen.shape[1]):
            seen = screen.seen[v, u]
            if seen < 0:
                screen.seen[v, u] = scene.empty_pixel
            elif seen < faces:
                screen.seen[v, u] = surfaces.items[surfaces.faces[seen].item].label
            else:
                screen.seen[v, u] = surfaces.items[surfaces.patch_kinds[seen - faces].item].label


@kernel
def is_parallel(scene):
    """True if the same light falls everywhere."""
    for k in range(len(scene.lights)):
        if scene.lights[k].kind != DIRECTIONAL:
            return False
    return True


@kernel
def fill_colours(surfaces, look, scene, screen):
    parallel = is_parallel(scene)
    last = -1  # an evenly lit surface, and its colour
    last_colour = 0
    for v in range(screen.seen.shape[0]):
        for u in range(screen.seen.shape[1]):
            seen = screen.seen[v, u]
            if seen < 0:
                screen.seen[v, u] = scene.empty_pixel
            elif seen == last:
                screen.seen[v, u] = last_colour
            else:
                p = point_of_pixel(scene, u, v, screen.nearness[v, u])
                colour = packed(colour_at(surfaces, look, scene, seen, p))
                screen.seen[v, u] = colour
                even = seen < len(surfaces.faces) and look.materials[material_of(surfaces, seen)].even > 0.0
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
                p = point_of_pixel(scene, u, v, layer.nearness[v, u])
                over = colour_at(surfaces, look, scene, seen, p)
                opacity = look.materials[material_of(surfaces, seen)].opacity
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
