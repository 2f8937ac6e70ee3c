"""Contact surfaces of all pairs of a scene: where two pressures are equal, or one meets a rigid face (Elandt 2019).

One entry kernel a family of pairs, so that a scene compiles what it has. In frame of the compliant mesh, the pressure
in a tetrahedron is g . x + c. Two compliant tetrahedra meet in the plane (g_M - g_N) . x + c_M - c_N = 0, clipped by
both; a rigid triangle is clipped by a compliant tetrahedron.
"""

from __future__ import annotations

import numpy as np

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import (
    add3,
    compose,
    dot3,
    load3,
    load3_at,
    neg3,
    rotate,
    rotate_back,
    scale3,
    store3,
    sub3,
    transpose,
)
from sheldrake.common.kernel import kernel

from .hydro_model import (
    AT_ORIGIN,
    BOUND,
    COMPLIANT_AND_COMPLIANT,
    COMPLIANT_AND_RIGID,
    FIRST_FACE,
    FIRST_LEAF,
    FIRST_NODE,
    FIRST_POLYGON,
    GEOMETRY_M,
    GEOMETRY_N,
    GRADIENT,
    MARGIN,
    MESH_ON_RIGID_HALF_SPACE,
    NUM_FACES,
    NUM_LEAVES,
    NUM_SURFACES,
    NUM_VERTICES,
    PLANES,
    RIGID_MESH_ON_HALF_SPACE,
    SECOND_POLYGON,
    SLOPE,
    STATUS,
    HydroModel,
    HydroTable,
)
from .hydro_polygon import clip_polygon, put_polygon, slice_tetrahedron
from .hydro_tree import boxes_apart, height_of_box, is_empty, larger_box
from .model import Z_AXIS, ContactTable
from .table import absolute, bounding_centre, column, position_of, rotation_of

ALONG = np.float64(-0.3826834323650897)  # cos(5 pi / 8): normals farther from the gradient are of a back side


@kernel(top=True)
def begin_surfaces(surfaces: HydroTable) -> None:
    """No surfaces yet."""
    surfaces.count[NUM_SURFACES] = 0
    surfaces.count[NUM_FACES] = 0
    surfaces.count[NUM_VERTICES] = 0
    surfaces.count[STATUS] = 0


@kernel
def begin_surface(surfaces, i, j):
    """The surface of geometries i and j, to which faces are added next."""
    s = surfaces.count[NUM_SURFACES]
    m = i
    n = j
    if j < i:
        m = j
        n = i
    surfaces.surface[s, GEOMETRY_M] = m
    surfaces.surface[s, GEOMETRY_N] = n
    surfaces.surface[s, FIRST_FACE] = surfaces.count[NUM_FACES]


@kernel
def end_surface(surfaces):
    """Keeps the surface if it has a face."""
    s = surfaces.count[NUM_SURFACES]
    if surfaces.count[NUM_FACES] > surfaces.surface[s, FIRST_FACE]:
        surfaces.count[NUM_SURFACES] = s + 1


@kernel
def linear_field(model, element):
    """Gradient and value at the origin of a tetrahedron's pressure."""
    g = load3_at(model.field, element, GRADIENT)
    return (g[0], g[1], g[2], model.field[element, AT_ORIGIN])


@kernel
def by_order(i, j, of_i, of_j):
    """What belongs to M and to N, of geometries i and j."""
    if i < j:
        return of_i, of_j
    return of_j, of_i


@kernel
def out_of_N(i, j, out_of_j):
    """The normal out of N into M, of the one out of j into i."""
    if i < j:
        return out_of_j
    return neg3(out_of_j)


# --- a compliant mesh and a rigid half space


@kernel(outline=True)
def cut_by_half_space(model, table, surfaces, i, j):
    """Surface of compliant mesh i with rigid half space j: its tetrahedra are sliced by the plane."""
    R_WI = rotation_of(table, i)
    nhat_W = column(rotation_of(table, j), Z_AXIS)
    normal = rotate_back(R_WI, nhat_W)
    offset = dot3(nhat_W, sub3(position_of(table, j), position_of(table, i)))
    nodes = model.geometry[i, FIRST_NODE]
    first_leaf = model.geometry[i, NUM_LEAVES] - 1
    leaves = model.geometry[i, FIRST_LEAF]
    into_M = out_of_N(i, j, nhat_W)
    begin_surface(surfaces, i, j)
    surfaces.stack[0] = 0
    depth = 1
    while depth > 0:
        depth -= 1
        node = surfaces.stack[depth]
        height, reach = height_of_box(model, nodes + node, normal, offset)
        if is_empty(model, nodes + node) or absolute(height) > reach:
            continue
        if node < first_leaf:
            surfaces.stack[depth] = 2 * node + 2
            surfaces.stack[depth + 1] = 2 * node + 1
            depth += 2
            continue
        element = model.leaf[leaves + node - first_leaf]
        n = slice_tetrahedron(model, surfaces.work, FIRST_POLYGON, element, normal, offset)
        if n > 0:
            field = linear_field(model, element)
            g_W = rotate(R_WI, (field[0], field[1], field[2]))
            gradients = by_order(i, j, g_W, scale3(g_W, 0.0))
            put_polygon(model, surfaces, table.X_WG, i, FIRST_POLYGON, n, into_M, field, gradients)
    end_surface(surfaces)


@kernel(top=True)
def mesh_on_rigid_half_space(hydro_model: HydroModel, table: ContactTable, surfaces: HydroTable) -> None:
    """Adds the surfaces of compliant meshes with rigid half spaces."""
    first = hydro_model.family[MESH_ON_RIGID_HALF_SPACE]
    for k in range(first, hydro_model.family[MESH_ON_RIGID_HALF_SPACE + 1]):
        cut_by_half_space(hydro_model, table, surfaces, hydro_model.pair[k, 0], hydro_model.pair[k, 1])


# --- a rigid mesh and a compliant half space


@kernel
def load_triangle(model, work, element):
    for k in range(3):
        store3(work, FIRST_POLYGON + k, load3(model.vertex, model.element[element, k]))


@kernel(outline=True)
def clip_by_half_space(model, table, surfaces, i, j):
    """Surface of rigid mesh i with compliant half space j: its triangles are clipped where there is pressure."""
    R_WI = rotation_of(table, i)
    nhat_W = column(rotation_of(table, j), Z_AXIS)
    normal = rotate_back(R_WI, nhat_W)
    offset = dot3(nhat_W, sub3(position_of(table, j), position_of(table, i)))
    top = offset + model.number[j, MARGIN]
    slope = model.number[j, SLOPE]
    field = (-slope * normal[0], -slope * normal[1], -slope * normal[2], slope * offset)
    g_W = scale3(nhat_W, -slope)
    gradients = by_order(i, j, scale3(g_W, 0.0), g_W)
    nodes = model.geometry[i, FIRST_NODE]
    first_leaf = model.geometry[i, NUM_LEAVES] - 1
    leaves = model.geometry[i, FIRST_LEAF]
    begin_surface(surfaces, i, j)
    surfaces.stack[0] = 0
    depth = 1
    while depth > 0:
        depth -= 1
        node = surfaces.stack[depth]
        height, reach = height_of_box(model, nodes + node, normal, top)
        if is_empty(model, nodes + node) or height > reach:
            continue
        if node < first_leaf:
            surfaces.stack[depth] = 2 * node + 2
            surfaces.stack[depth + 1] = 2 * node + 1
            depth += 2
            continue
        element = model.leaf[leaves + node - first_leaf]
        out = load3_at(model.field, element, GRADIENT)
        if -dot3(out, normal) > ALONG:
            load_triangle(model, surfaces.work, element)
            n = clip_polygon(surfaces.work, FIRST_POLYGON, 3, SECOND_POLYGON, normal, top, 1.0)
            if n > 2:
                into_M = out_of_N(j, i, rotate(R_WI, out))
                put_polygon(model, surfaces, table.X_WG, i, SECOND_POLYGON, n, into_M, field, gradients)
    end_surface(surfaces)


@kernel(top=True)
def rigid_mesh_on_half_space(hydro_model: HydroModel, table: ContactTable, surfaces: HydroTable) -> None:
    """Adds the surfaces of rigid meshes with compliant half spaces."""
    first = hydro_model.family[RIGID_MESH_ON_HALF_SPACE]
    for k in range(first, hydro_model.family[RIGID_MESH_ON_HALF_SPACE + 1]):
        clip_by_half_space(hydro_model, table, surfaces, hydro_model.pair[k, 0], hydro_model.pair[k, 1])


# --- two meshes


@kernel
def plane_of(model, element, k):
    """Outward normal and offset of face k of a tetrahedron."""
    at = PLANES + 4 * k
    return load3_at(model.field, element, at), model.field[element, at + 3]


@kernel
def clip_by_tetrahedron(model, work, n, out, element):
    """Clips the first polygon, whose normal is out, by a tetrahedron of the same frame; its corners left.

    They are the first polygon again.
    """
    source = FIRST_POLYGON
    target = SECOND_POLYGON
    for k in range(4):
        if n > 2:
            normal, offset = plane_of(model, element, k)
            n = clip_polygon(work, source, n, target, normal, offset, dot3(normal, out))
        source, target = target, source
    return n


@kernel
def clip_by_moved_tetrahedron(model, work, n, out, element, R_IJ, p_IJ):
    """The same for a tetrahedron of frame J and a polygon in frame I."""
    source = FIRST_POLYGON
    target = SECOND_POLYGON
    for k in range(4):
        if n > 2:
            normal, offset = plane_of(model, element, k)
            moved = rotate(R_IJ, normal)
            n = clip_polygon(work, source, n, target, moved, offset + dot3(moved, p_IJ), dot3(moved, out))
        source, target = target, source
    return n


@kernel(outline=True)
def triangle_in_tetrahedron(model, table, surfaces, i, j, tetrahedron, triangle, R_IJ, p_IJ):
    """The part of a rigid triangle of j that is in a tetrahedron of i."""
    field = linear_field(model, tetrahedron)
    g = (field[0], field[1], field[2])
    out = rotate(R_IJ, load3_at(model.field, triangle, GRADIENT))
    if dot3(out, g) < ALONG * sqrt(dot3(g, g)):
        return
    for k in range(3):
        p = load3(model.vertex, model.element[triangle, k])
        store3(surfaces.work, FIRST_POLYGON + k, add3(rotate(R_IJ, p), p_IJ))
    n = clip_by_tetrahedron(model, surfaces.work, 3, out, tetrahedron)
    if n > 2:
        R_WI = rotation_of(table, i)
        g_W = rotate(R_WI, g)
        into_M = out_of_N(i, j, rotate(R_WI, out))
        gradients = by_order(i, j, g_W, scale3(g_W, 0.0))
        put_polygon(model, surfaces, table.X_WG, i, FIRST_POLYGON, n, into_M, field, gradients)


@kernel(outline=True)
def tetrahedra_in_balance(model, table, surfaces, i, j, one, other, R_IJ, p_IJ):
    """Where a tetrahedron of i and one of j, both compliant, have the same pressure."""
    field = linear_field(model, one)
    g = (field[0], field[1], field[2])
    field_J = linear_field(model, other)
    g_j = rotate(R_IJ, (field_J[0], field_J[1], field_J[2]))
    c_j = field_J[3] - dot3(g_j, p_IJ)
    difference = sub3(g, g_j)
    size = sqrt(dot3(difference, difference))
    if not size > 0.0:
        return
    normal = scale3(difference, 1.0 / size)
    if dot3(normal, g) < ALONG * sqrt(dot3(g, g)) or -dot3(normal, g_j) < ALONG * sqrt(dot3(g_j, g_j)):
        return
    n = slice_tetrahedron(model, surfaces.work, FIRST_POLYGON, one, normal, (c_j - field[3]) / size)
    n = clip_by_moved_tetrahedron(model, surfaces.work, n, normal, other, R_IJ, p_IJ)
    if n > 2:
        R_WI = rotation_of(table, i)
        into_M = out_of_N(i, j, rotate(R_WI, normal))
        gradients = by_order(i, j, rotate(R_WI, g), rotate(R_WI, g_j))
        put_polygon(model, surfaces, table.X_WG, i, FIRST_POLYGON, n, into_M, field, gradients)


@kernel
def relative_pose(table, i, j):
    """R_IJ and p_IJ."""
    R_WI = rotation_of(table, i)
    p = rotate_back(R_WI, sub3(position_of(table, j), position_of(table, i)))
    return compose(transpose(R_WI), rotation_of(table, j)), p


@kernel
def push_children(model, surfaces, depth, i, j, a, b):
    """Divides the larger of two boxes, or the one that can be divided; the new depth of the stack."""
    leaf_a = a >= model.geometry[i, NUM_LEAVES] - 1
    leaf_b = b >= model.geometry[j, NUM_LEAVES] - 1
    nodes_i = model.geometry[i, FIRST_NODE]
    nodes_j = model.geometry[j, FIRST_NODE]
    if leaf_b or (not leaf_a and larger_box(model, nodes_i + a, nodes_j + b)):
        surfaces.stack[depth] = 2 * a + 2
        surfaces.stack[depth + 1] = b
        surfaces.stack[depth + 2] = 2 * a + 1
        surfaces.stack[depth + 3] = b
    else:
        surfaces.stack[depth] = a
        surfaces.stack[depth + 1] = 2 * b + 2
        surfaces.stack[depth + 2] = a
        surfaces.stack[depth + 3] = 2 * b + 1
    return depth + 4


@kernel(outline=True)
def next_leaves(model, surfaces, depth, i, j, R_IJ, p_IJ):
    """Looks on in the two trees; the depth of the stack and the next two elements whose boxes meet, or depth -1."""
    first_i = model.geometry[i, NUM_LEAVES] - 1
    first_j = model.geometry[j, NUM_LEAVES] - 1
    while depth > 0:
        depth -= 2
        a = surfaces.stack[depth]
        b = surfaces.stack[depth + 1]
        if boxes_apart(model, model.geometry[i, FIRST_NODE] + a, model.geometry[j, FIRST_NODE] + b, R_IJ, p_IJ):
            continue
        if a < first_i or b < first_j:
            depth = push_children(model, surfaces, depth, i, j, a, b)
            continue
        one = model.leaf[model.geometry[i, FIRST_LEAF] + a - first_i]
        return depth, one, model.leaf[model.geometry[j, FIRST_LEAF] + b - first_j]
    return np.int64(-1), np.int64(0), np.int64(0)


@kernel
def begin_search(surfaces, i, j):
    """Both roots on the stack; its depth."""
    begin_surface(surfaces, i, j)
    surfaces.stack[0] = 0
    surfaces.stack[1] = 0
    return np.int64(2)


@kernel
def meshes_apart(model, table, i, j):
    """True if the spheres about two meshes do not meet."""
    r = sub3(bounding_centre(table, i), bounding_centre(table, j))
    reach = model.number[i, BOUND] + model.number[j, BOUND]
    return dot3(r, r) > reach * reach


@kernel(top=True)
def compliant_and_rigid(hydro_model: HydroModel, table: ContactTable, surfaces: HydroTable) -> None:
    """Adds the surfaces of compliant with rigid meshes."""
    model = hydro_model
    for k in range(model.family[COMPLIANT_AND_RIGID], model.family[COMPLIANT_AND_RIGID + 1]):
        i = model.pair[k, 0]
        j = model.pair[k, 1]
        if meshes_apart(model, table, i, j):
            continue
        R_IJ, p_IJ = relative_pose(table, i, j)
        depth, one, other = next_leaves(model, surfaces, begin_search(surfaces, i, j), i, j, R_IJ, p_IJ)
        while depth >= 0:
            triangle_in_tetrahedron(model, table, surfaces, i, j, one, other, R_IJ, p_IJ)
            depth, one, other = next_leaves(model, surfaces, depth, i, j, R_IJ, p_IJ)
        end_surface(surfaces)


@kernel(top=True)
def compliant_and_compliant(hydro_model: HydroModel, table: ContactTable, surfaces: HydroTable) -> None:
    """Adds the surfaces of pairs of compliant meshes."""
    model = hydro_model
    for k in range(model.family[COMPLIANT_AND_COMPLIANT], model.family[COMPLIANT_AND_COMPLIANT + 1]):
        i = model.pair[k, 0]
        j = model.pair[k, 1]
        if meshes_apart(model, table, i, j):
            continue
        R_IJ, p_IJ = relative_pose(table, i, j)
        depth, one, other = next_leaves(model, surfaces, begin_search(surfaces, i, j), i, j, R_IJ, p_IJ)
        while depth >= 0:
            tetrahedra_in_balance(model, table, surfaces, i, j, one, other, R_IJ, p_IJ)
            depth, one, other = next_leaves(model, surfaces, depth, i, j, R_IJ, p_IJ)
        end_surface(surfaces)
