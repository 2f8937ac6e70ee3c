"""Contact results as messages for viewers in other processes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common.value import AbstractValue
from sheldrake.geometry import GeometryId, SceneGraph
from sheldrake.geometry._query.contact_surface import ContactSurface
from sheldrake.lcm import DrakeLcm
from sheldrake.lcm._messages import (
    lcmt_contact_results_for_viz,
    lcmt_hydroelastic_contact_surface_for_viz,
    lcmt_point,
    lcmt_point_pair_contact_info_for_viz,
)
from sheldrake.multibody.plant._contact.hydroelastic import HydroelasticContactInfo
from sheldrake.multibody.plant._contact.results import ContactResults, PointPairContactInfo
from sheldrake.multibody.plant._parts import parts_of
from sheldrake.systems.framework import Context, LeafSystem
from sheldrake.systems.framework._port_getters import input_port, output_port
from sheldrake.systems.lcm import LcmPublisherSystem

if TYPE_CHECKING:
    from sheldrake.lcm._interface import DrakeLcmInterface
    from sheldrake.multibody.plant._multibody_plant import MultibodyPlant
    from sheldrake.systems.framework._diagram_builder import DiagramBuilder

_CHANNEL = "CONTACT_RESULTS"


class ContactResultsToLcmSystem(LeafSystem):
    """Turns contact results into messages that viewers know.

    Ports: the input "u0", a plant's contact results; the output "y0", the message.

    Args:
        plant: The finalized plant whose contacts they are. Geometries are named by their numbers;
            `ConnectContactResultsToDrakeVisualizer` knows their names.
    """

    _generic = True

    def __init__(self, plant: Any):
        super().__init__()
        parts_of(plant).elements.require_finalized("ContactResultsToLcmSystem")
        self._names: dict[GeometryId, str] = {}
        bodies = [plant.get_body(i) for i in range(plant.num_bodies())]
        self._body_names = {b.index(): f"{b.name()}({int(b.model_instance())})" for b in bodies}
        self._owners = {
            geometry: (
                body.name(),
                plant.GetModelInstanceName(body.model_instance()),
                plant.NumBodiesWithName(body.name()) == 1,
                len(plant.GetCollisionGeometriesForBody(body)),
            )
            for body in bodies
            for geometry in plant.GetCollisionGeometriesForBody(body)
        }
        self.DeclareAbstractInputPort("u0", AbstractValue.Make(ContactResults()))
        self.DeclareAbstractOutputPort("y0", lambda: AbstractValue.Make(lcmt_contact_results_for_viz()), self._calc)

    get_contact_result_input_port = input_port(0, "The contact results.")
    get_lcm_message_output_port = output_port(0, "The message.")

    def _calc(self, context: Context, output: AbstractValue) -> None:
        results, time = self.get_input_port(0).Eval(context), int(context.get_time() * 1e6)
        points = [results.point_pair_contact_info(i) for i in range(results.num_point_pair_contacts())]
        surfaces = [results.hydroelastic_contact_info(i) for i in range(results.num_hydroelastic_contacts())]
        output.set_value(
            lcmt_contact_results_for_viz(
                timestamp=time,
                num_point_pair_contacts=len(points),
                point_pair_contact_info=[self._point(info, time) for info in points],
                num_hydroelastic_contacts=len(surfaces),
                hydroelastic_contacts=[self._surface(info) for info in surfaces],
            )
        )

    def _point(self, info: PointPairContactInfo, time: int) -> lcmt_point_pair_contact_info_for_viz:
        return lcmt_point_pair_contact_info_for_viz(
            timestamp=time,
            body1_name=self._body_names[info.bodyA_index()],
            body2_name=self._body_names[info.bodyB_index()],
            contact_point=list(info.contact_point()),
            contact_force=list(info.contact_force()),
            normal=list(info.point_pair().nhat_BA_W),
        )

    def _surface(self, info: HydroelasticContactInfo) -> lcmt_hydroelastic_contact_surface_for_viz:
        surface = info.contact_surface()
        vertices, pressure, poly_data = _polygons(surface)
        whose: dict[str, Any] = {}
        for i, geometry in enumerate((surface.id_M(), surface.id_N()), start=1):
            body, model, is_unique, count = self._owners[geometry]
            whose[f"geometry{i}_name"] = self._names.get(geometry, f"Id({geometry.get_value()})")
            whose |= {f"body{i}_name": body, f"model{i}_name": model, f"body{i}_unique": is_unique}
            whose[f"collision_count{i}"] = count
        return lcmt_hydroelastic_contact_surface_for_viz(
            **whose,
            centroid_W=list(surface.centroid()),
            force_C_W=list(info.F_Ac_W().translational()),
            moment_C_W=list(info.F_Ac_W().rotational()),
            num_vertices=len(vertices),
            p_WV=[lcmt_point(x=x, y=y, z=z) for x, y, z in vertices],
            pressure=pressure,
            poly_data_int_count=len(poly_data),
            poly_data=poly_data,
        )


def _polygons(surface: ContactSurface) -> tuple[np.ndarray, list[float], list[int]]:
    """Vertices, their pressures, and for each polygon how many vertices it has and which."""
    if surface.is_triangle():
        triangles, pressure = surface.tri_mesh_W(), surface.tri_e_MN()
        elements = [triangles.element(f) for f in range(triangles.num_elements())]
        faces = [n for t in elements for n in (3, *(t.vertex(k) for k in range(3)))]
        numbers = range(triangles.num_vertices())
        return np.array([triangles.vertex(v) for v in numbers]), [pressure.EvaluateAtVertex(v) for v in numbers], faces
    polygons, field = surface.poly_mesh_W(), surface.poly_e_MN()
    numbers = range(polygons.num_vertices())
    faces = [int(n) for n in polygons.face_data()]
    return np.array([polygons.vertex(v) for v in numbers]), [field.EvaluateAtVertex(v) for v in numbers], faces


@checked
def ConnectContactResultsToDrakeVisualizer(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    scene_graph: SceneGraph,
    lcm: DrakeLcmInterface | None = None,
    publish_period: float | None = None,
) -> LcmPublisherSystem:
    """Publishes a plant's contacts on the channel CONTACT_RESULTS.

    Args:
        builder: Of the diagram that has the plant.
        plant: The finalized plant.
        scene_graph: Knows the names of geometries.
        lcm: Where to; a new `DrakeLcm` when left out.
        publish_period: Simulated time between two messages [s]; 1/60 when left out.

    Returns:
        The publisher.
    """
    to_lcm = builder.AddNamedSystem("contact_to_lcm", ContactResultsToLcmSystem(plant))
    inspector = scene_graph.model_inspector()
    to_lcm._names = {geometry: inspector.GetName(geometry) for geometry in to_lcm._owners}
    publisher = LcmPublisherSystem.Make(
        _CHANNEL, lcmt_contact_results_for_viz, DrakeLcm() if lcm is None else lcm, publish_period or 1.0 / 60.0
    )
    publisher.set_name("contact_results_publisher")
    builder.AddSystem(publisher)
    builder.Connect(plant.get_contact_results_output_port(), to_lcm.get_contact_result_input_port())
    builder.Connect(to_lcm.get_lcm_message_output_port(), publisher.get_input_port())
    return publisher
