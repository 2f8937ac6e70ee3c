"""Contact surfaces of all pairs of a scene: where two pressures are equal, or one meets a rigid face (Elandt 2019).

One entry kernel a family of pairs, so that a scene compiles what it has. In frame of the compliant mesh, the pressure
in a tetrahedron is g . x + c. Two compliant tetrahedra meet in the plane (g_M - g_N) . x + c_M - c_N = 0, clipped by
both; a rigid triangle is clipped by a compliant tetrahedron.

All families descend two trees in the same way; a half space has one leaf, the root. What differs is where one geometry
is for the other, and with which trees (`relate`), when two boxes are `apart`, and how two elements `meet`.

Elements of compliant meshes go deep, often to one point in the middle, where all their boxes meet. Contact is shallow:
the boxes that count are of the thin part of a mesh that the other one can reach.
"""

from __future__ import annotations

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import add3, compose, dot3, neg3, rotate, rotate_back, scale3, sub3, transpose
from sheldrake.common.kernel import kernel

from .hydro_model import FIRST_POLYGON, NUM_PARTS, SECOND_POLYGON, HydroModel, HydroTable
from .hydro_polygon import ACROSS, BEYOND, clip_polygon, put_polygon, relation_to_plane, slice_tetrahedron
from .hydro_tree import boxes_apart, height_of_box, is_empty, is_off_box, larger_box, sizes_of
from .model import Z_AXIS, ContactTable
from .table import absolute, column

ALONG = -0.3826834323650897  # cos(5 pi / 8): normals farther from the gradient are of a back side


@kernel(top=True)
def begin_surfaces(surfaces: HydroTable) -> None:
    """No surfaces yet."""
    surfaces.num_surfaces = 0
    surfaces.num_faces = 0
    surfaces.num_vertices = 0
    surfaces.status = 0


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


@kernel
def element_at(model, g, node):
    """The element in a leaf of the tree of geometry g."""
    return model.leaf[model[g].first_leaf + node - (model[g].num_leaves - 1)]


@kernel(outline=True)
def add_surface(model, table, surfaces, i, j, relate, apart, meet):
    """Adds the surface of geometries i and j, if it has a face, made where elements meet whose boxes are not apart.

    Of two boxes the larger one is divided first.
    """
    where, root_i, root_j = relate(model, table, i, j)
    s = surfaces.num_surfaces
    surface = surfaces.patches[s]
    surface.geometry_M, surface.geometry_N = by_order(i, j, i, j)
    surface.first_face = surfaces.num_faces
    surfaces.waiting[0].nodes = (0, 0)
    depth = 1
    while depth > 0:
        depth -= 1
        a, b = surfaces.waiting[depth].nodes
        if apart(model, root_i + a, j, root_j + b, where):
            continue
        leaf_a = a >= model[i].num_leaves - 1
        leaf_b = b >= model[j].num_leaves - 1
        if leaf_a and leaf_b:
            meet(model, table, surfaces, i, j, a, b, where)
            continue
        if leaf_b or (not leaf_a and larger_box(model, root_i + a, root_j + b)):
            surfaces.waiting[depth].nodes = (2 * a + 2, b)
            surfaces.waiting[depth + 1].nodes = (2 * a + 1, b)
        else:
            surfaces.waiting[depth].nodes = (a, 2 * b + 2)
            surfaces.waiting[depth + 1].nodes = (a, 2 * b + 1)
        depth += 2
    if surfaces.num_faces > surface.first_face:
        surfaces.num_surfaces = s + 1


@kernel
def add_surfaces(model, table, surfaces, first, last, relate, apart, meet):
    """Adds the surfaces of pairs `first` to `last` - 1."""
    for k in range(first, last):
        i = model.pairs[k].i
        j = model.pairs[k].j
        r = sub3(table.poses[i].centre_W, table.poses[j].centre_W)
        reach = model[i].bound + model[j].bound
        if dot3(r, r) <= reach * reach:
            add_surface(model, table, surfaces, i, j, relate, apart, meet)


# --- a mesh and a half space


@kernel
def plane_for(model, table, i, j):
    """Normal and offset of half space j in the frame of i, and its normal in W; the root of i, and 0 for that of j."""
    R_WI = table.poses[i].R_WG
    nhat_W = column(table.poses[j].R_WG, Z_AXIS)
    offset = dot3(nhat_W, sub3(table.poses[j].p_WG, table.poses[i].p_WG))
    return (rotate_back(R_WI, nhat_W), offset, nhat_W, R_WI), model[i].first_node, 0


@kernel
def off_plane(model, node, j, other, where):
    """True if the plane does not cut a box."""
    height, reach = height_of_box(model, node, where[0], where[1])
    return is_empty(model, node) or absolute(height) > reach


@kernel
def slice_by_half_space(model, table, surfaces, i, j, a, b, where):
    """Where a tetrahedron of i is cut by the plane of rigid half space j."""
    normal, offset, nhat_W, R_WI = where
    element = element_at(model, i, a)
    n = slice_tetrahedron(model, surfaces, FIRST_POLYGON, element, normal, offset)
    if n > 0:
        field = model.fields[element].pressure
        g_W = rotate(R_WI, model.fields[element].gradient)
        gradients = by_order(i, j, g_W, scale3(g_W, 0.0))
        put_polygon(model, table, surfaces, i, FIRST_POLYGON, n, out_of_N(i, j, nhat_W), field, gradients)


@kernel(top=True)
def mesh_on_rigid_half_space(hydro_model: HydroModel, table: ContactTable, surfaces: HydroTable) -> None:
    """Adds the surfaces of compliant meshes with rigid half spaces."""
    first, last = hydro_model.on_rigid_half_space, hydro_model.on_half_space
    add_surfaces(hydro_model, table, surfaces, first, last, plane_for, off_plane, slice_by_half_space)


@kernel
def above_margin(model, node, j, other, where):
    """True if a box is farther from the plane than the pressure of half space j reaches."""
    height, reach = height_of_box(model, node, where[0], where[1] + model[j].margin)
    return is_empty(model, node) or height > reach


@kernel
def clip_by_half_space(model, table, surfaces, i, j, a, b, where):
    """The part of a triangle of i where compliant half space j has pressure."""
    normal, offset, nhat_W, R_WI = where
    triangle = element_at(model, i, a)
    out = model.fields[triangle].normal
    if -dot3(out, normal) <= ALONG:
        return
    for k in range(3):
        surfaces.corners[FIRST_POLYGON + k].p = model.vertices[model.elements[triangle].corner[k]].p_GV
    n = clip_polygon(surfaces, FIRST_POLYGON, 3, SECOND_POLYGON, normal, offset + model[j].margin, 1.0)
    if n > 2:
        slope = model[j].slope
        field = (-slope * normal[0], -slope * normal[1], -slope * normal[2], slope * offset)
        g_W = scale3(nhat_W, -slope)
        gradients = by_order(i, j, scale3(g_W, 0.0), g_W)
        into_M = out_of_N(j, i, rotate(R_WI, out))
        put_polygon(model, table, surfaces, i, SECOND_POLYGON, n, into_M, field, gradients)


@kernel(top=True)
def rigid_mesh_on_half_space(hydro_model: HydroModel, table: ContactTable, surfaces: HydroTable) -> None:
    """Adds the surfaces of rigid meshes with compliant half spaces."""
    first, last = hydro_model.on_half_space, hydro_model.with_rigid
    add_surfaces(hydro_model, table, surfaces, first, last, plane_for, above_margin, clip_by_half_space)


# --- two meshes


@kernel
def pose_for(table, i, j):
    """R_IJ, p_IJ, and the entries of R_IJ without their signs."""
    R_WI = table.poses[i].R_WG
    p = rotate_back(R_WI, sub3(table.poses[j].p_WG, table.poses[i].p_WG))
    R = compose(transpose(R_WI), table.poses[j].R_WG)
    return R, p, sizes_of(R)


@kernel
def centre_in(table, g, frame):
    """The bounding centre of geometry g in the frame of another one."""
    return rotate_back(table.poses[frame].R_WG, sub3(table.poses[g].centre_W, table.poses[frame].p_WG))


@kernel(outline=True)
def thin_part(model, table, i, j, where):
    """The thinnest part of compliant mesh i that holds all that it has in common with mesh j.

    Its core is then clear of j: box or sphere of the one of box or sphere of the other.
    """
    all_of_j = model.nodes[model[j].first_node]
    i_in_J = centre_in(table, i, j)
    j_in_I = centre_in(table, j, i)
    r = sub3(table.poses[i].centre_W, table.poses[j].centre_W)
    distance2 = dot3(r, r)
    for above in range(1, NUM_PARTS):
        k = NUM_PARTS - above
        core = model.parts[NUM_PARTS * i + k]
        reach = core.reach + model[j].bound
        if (
            distance2 > reach * reach
            or boxes_apart(core, all_of_j, where[0], where[1], where[2])
            or is_off_box(all_of_j, i_in_J, core.reach)
            or is_off_box(core, j_in_I, model[j].bound)
        ):
            return k
    return 0


@kernel
def part_up_to(model, g, pressure):
    """The thinnest part of a compliant mesh with all that has at most this pressure."""
    for above in range(1, NUM_PARTS):
        k = NUM_PARTS - above
        if model.parts[NUM_PARTS * g + k].pressure >= pressure:
            return k
    return 0


@kernel
def root_of(model, g, part):
    """The root of the tree of boxes of a part."""
    return model[g].first_node + part * (2 * model[g].num_leaves - 1)


@kernel
def compliant_for_rigid(model, table, i, j):
    """`pose_for`, and the roots of the trees: of the part of i that j can reach, and of j."""
    where = pose_for(table, i, j)
    return where, root_of(model, i, thin_part(model, table, i, j, where)), model[j].first_node


@kernel
def compliant_for_compliant(model, table, i, j):
    """`pose_for`, and the roots of the trees: of the parts that the other one can reach.

    Where the surface is both have the same pressure.
    """
    where = pose_for(table, i, j)
    of_i = model.parts[NUM_PARTS * i + thin_part(model, table, i, j, where)].pressure
    of_j = model.parts[NUM_PARTS * j + thin_part(model, table, j, i, pose_for(table, j, i))].pressure
    most = min(of_i, of_j)
    return where, root_of(model, i, part_up_to(model, i, most)), root_of(model, j, part_up_to(model, j, most))


@kernel
def nodes_apart(model, node, j, other, where):
    """True if the boxes of a node of i and of one of j do not meet."""
    return boxes_apart(model.nodes[node], model.nodes[other], where[0], where[1], where[2])


@kernel
def points_back(out, g):
    """Whether a surface with this normal is one of a back side, where the pressure falls inwards."""
    along = dot3(out, g)
    return along < 0.0 and along * along > ALONG * ALONG * dot3(out, out) * dot3(g, g)


@kernel
def clip_by_tetrahedron(model, surfaces, n, out, element, moved, where):
    """Clips the first polygon, on which `out` is normal, by a tetrahedron; its corners left, and where it then is.

    The tetrahedron is in the frame of the polygon, or, if `moved`, in that of J. Most polygons are outside of a plane:
    all are looked at before any cuts.
    """
    source, target = FIRST_POLYGON, SECOND_POLYGON
    planes = model.fields[element].planes
    num_cuts = 0
    for k in range(4):
        normal = (planes[k, 0], planes[k, 1], planes[k, 2])
        offset = planes[k, 3]
        if moved:
            normal = rotate(where[0], normal)
            offset += dot3(normal, where[1])
        cut = surfaces.cuts[num_cuts]
        cut.normal, cut.offset, cut.side = normal, offset, dot3(normal, out)
        relation = relation_to_plane(surfaces, source, n, cut)
        if relation == BEYOND:
            return 0, source
        if relation == ACROSS:
            num_cuts += 1
    for k in range(num_cuts):
        if n > 2:
            cut = surfaces.cuts[k]
            n = clip_polygon(surfaces, source, n, target, cut.normal, cut.offset, cut.side)
            source, target = target, source
    return n, source


@kernel(outline=True)
def triangle_in_tetrahedron(model, table, surfaces, i, j, a, b, where):
    """The part of a rigid triangle of j that is in a tetrahedron of i."""
    R_IJ, p_IJ, _ = where
    tetrahedron = element_at(model, i, a)
    triangle = element_at(model, j, b)
    g = model.fields[tetrahedron].gradient
    out = rotate(R_IJ, model.fields[triangle].normal)
    if points_back(out, g):
        return
    for k in range(3):
        p = model.vertices[model.elements[triangle].corner[k]].p_GV
        surfaces.corners[FIRST_POLYGON + k].p = add3(rotate(R_IJ, p), p_IJ)
    n, polygon = clip_by_tetrahedron(model, surfaces, 3, out, tetrahedron, False, where)
    if n > 2:
        R_WI = table.poses[i].R_WG
        g_W = rotate(R_WI, g)
        into_M = out_of_N(i, j, rotate(R_WI, out))
        gradients = by_order(i, j, g_W, scale3(g_W, 0.0))
        field = model.fields[tetrahedron].pressure
        put_polygon(model, table, surfaces, i, polygon, n, into_M, field, gradients)


@kernel(top=True)
def compliant_and_rigid(hydro_model: HydroModel, table: ContactTable, surfaces: HydroTable) -> None:
    """Adds the surfaces of compliant with rigid meshes."""
    first, last = hydro_model.with_rigid, hydro_model.with_compliant
    add_surfaces(hydro_model, table, surfaces, first, last, compliant_for_rigid, nodes_apart, triangle_in_tetrahedron)


@kernel(outline=True)
def tetrahedra_in_balance(model, table, surfaces, i, j, a, b, where):
    """Where a tetrahedron of i and one of j, both compliant, have the same pressure."""
    R_IJ, p_IJ, _ = where
    one = element_at(model, i, a)
    other = element_at(model, j, b)
    field = model.fields[one].pressure
    g = model.fields[one].gradient
    g_j = rotate(R_IJ, model.fields[other].gradient)
    c_j = model.fields[other].at_origin - dot3(g_j, p_IJ)
    out = sub3(g, g_j)
    if not dot3(out, out) > 0.0 or points_back(out, g) or points_back(out, neg3(g_j)):
        return
    n = slice_tetrahedron(model, surfaces, FIRST_POLYGON, one, out, c_j - field[3])
    if n == 0:
        return
    n, polygon = clip_by_tetrahedron(model, surfaces, n, out, other, True, where)
    if n > 2:
        R_WI = table.poses[i].R_WG
        into_M = out_of_N(i, j, rotate(R_WI, scale3(out, 1.0 / sqrt(dot3(out, out)))))
        gradients = by_order(i, j, rotate(R_WI, g), rotate(R_WI, g_j))
        put_polygon(model, table, surfaces, i, polygon, n, into_M, field, gradients)


@kernel(top=True)
def compliant_and_compliant(hydro_model: HydroModel, table: ContactTable, surfaces: HydroTable) -> None:
    """Adds the surfaces of pairs of compliant meshes."""
    first, last = hydro_model.with_compliant, hydro_model.end_of_pairs
    add_surfaces(hydro_model, table, surfaces, first, last, compliant_for_compliant, nodes_apart, tetrahedra_in_balance)
