"""What is drawn of contact results: forces, surfaces, and names for both sides of a contact."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.multibody.plant import ContactResults
from sheldrake.multibody.plant._contact.results import PointContactArrays

from ._hydroelastic_arrows import _HydroelasticContactVisualizerItem
from ._point_contact_arrows import _PointContactVisualizerItem

if TYPE_CHECKING:
    from sheldrake.geometry import SceneGraphInspector
    from sheldrake.geometry._ids import GeometryId
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.plant._contact.hydroelastic import HydroelasticContactInfo
    from sheldrake.multibody.tree._index import BodyIndex


def name_of_side(body: str, model: str | None, geometry: str | None) -> str:
    """The name of one side of a contact: that of a body, with its model's and its geometry's where they are needed.

    Args:
        body: Name of the body.
        model: Name of its model instance; None where no other body is called so.
        geometry: Name of its geometry, scoped or not; None where it is the body's only one.
    """
    own = None if geometry is None else geometry.rpartition("::")[2]
    return ".".join(part for part in (model, body, own) if part is not None)


def fan(ring: Sequence[int]) -> list[tuple[int, int, int]]:
    """The triangles of a polygon, all with its first vertex."""
    return [(ring[0], ring[i], ring[i + 1]) for i in range(1, len(ring) - 1)]


class Names:
    """Short names of the two sides of a contact, unique within a plant; kept once they are found."""

    def __init__(self) -> None:
        self._plant: Any = None
        self._inspector: Any = None
        self._known: dict[tuple[Any, Any], str] = {}

    def look_at(self, plant: MultibodyPlant, inspector: SceneGraphInspector | None) -> bool:
        """Takes names from a plant, and from the SceneGraph's inspector where it is known; whether they are new."""
        changed = plant is not self._plant or (inspector is None) != (self._inspector is None)
        if changed:
            self._known.clear()
        self._plant, self._inspector = plant, inspector
        return changed

    def of_body(self, index: BodyIndex, geometry: GeometryId) -> str:
        """Returns the body's name, with its model's where it is not the only one, and the geometry's likewise."""
        name = self._known.get((index, geometry))
        if name is None:
            name = self._known[index, geometry] = self._find(index, geometry)
        return name

    def _find(self, index: Any, geometry: GeometryId) -> str:
        plant = self._plant
        body = plant.get_body(index)
        is_unique = plant.NumBodiesWithName(body.name()) == 1
        is_only = len(plant.GetCollisionGeometriesForBody(body)) <= 1
        return name_of_side(
            body.name(),
            None if is_unique else plant.GetModelInstanceName(body.model_instance()),
            None if is_only else self.of_geometry(geometry),
        )

    def of_geometry(self, geometry: GeometryId) -> str:
        """Returns a geometry's name without its model's, or its number."""
        if self._inspector is None:
            return f"Id({geometry.get_value()})"
        return self._inspector.GetName(geometry).rpartition("::")[2]

    def of_geometries_body(self, geometry: Any) -> str:
        """Returns the name of the body that a geometry belongs to."""
        if self._inspector is None:
            return self.of_geometry(geometry)
        body = self._plant.GetBodyFromFrameId(self._inspector.GetFrameId(geometry))
        return self.of_body(body.index(), geometry)


def names_of_pairs(arrays: PointContactArrays, names: Names) -> list[tuple[str, str]]:
    """The names of who touches, of point contacts in columns."""
    bodies, ids = arrays.bodies, arrays.geometries
    return [(names.of_body(bodies[a], ids[A]), names.of_body(bodies[b], ids[B])) for A, B, a, b in arrays.pair.tolist()]


def point_items(results: ContactResults, names: Names) -> list[_PointContactVisualizerItem]:
    """Forces at points, with the names of who touches."""
    items = []
    for info in map(results.point_pair_contact_info, range(results.num_point_pair_contacts())):
        A, B = (names.of_body(info.bodyA_index(), info.point_pair().id_A),
                names.of_body(info.bodyB_index(), info.point_pair().id_B))  # fmt: skip
        items.append(_PointContactVisualizerItem(A, B, info.contact_force(), info.contact_point()))
    return items


def names_of_surface(info: HydroelasticContactInfo, names: Names) -> tuple[str, str]:
    """The names of who touches in one contact surface."""
    surface = info.contact_surface()
    return names.of_geometries_body(surface.id_M()), names.of_geometries_body(surface.id_N())


def surface_item(info: HydroelasticContactInfo, names: tuple[str, str]) -> _HydroelasticContactVisualizerItem:
    """Force and triangles of one contact surface, with the names of who touches."""
    surface = info.contact_surface()
    mesh = surface.tri_mesh_W() if surface.is_triangle() else surface.poly_mesh_W()
    field = surface.tri_e_MN() if surface.is_triangle() else surface.poly_e_MN()
    count = mesh.num_vertices()
    faces = []
    for f in range(surface.num_faces()):
        element = mesh.element(f)
        faces += fan([element.vertex(i) for i in range(3 if surface.is_triangle() else element.num_vertices())])
    force = info.F_Ac_W()
    return _HydroelasticContactVisualizerItem(
        *names,
        surface.centroid(),
        force.translational(),
        force.rotational(),
        np.array([mesh.vertex(v) for v in range(count)]).reshape(-1, 3).T,
        np.array(faces, dtype=np.int64).reshape(-1, 3).T,
        np.array([field.EvaluateAtVertex(v) for v in range(count)]),
    )
