"""Contact in words: who touches whom, how deep, with which force, sticking or sliding."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sheldrake.geometry import GeometryId
from sheldrake.geometry._query.contact_surface import ContactSurface
from sheldrake.multibody.plant._building.geometry import PlantGeometry
from sheldrake.multibody.plant._building.settings import Settings
from sheldrake.multibody.plant._contact.friction import CalcContactFrictionFromSurfaceProperties
from sheldrake.multibody.plant._contact.results import ContactResults
from sheldrake.multibody.plant._context.kinematics import Kinematics
from sheldrake.systems.framework import Context

if TYPE_CHECKING:
    from sheldrake.geometry._state.state import GeometryState
    from sheldrake.multibody.math._coulomb_friction import CoulombFriction


class ContactSummary(NamedTuple):
    """What two geometries do to each other.

    Attributes:
        A, B: "body/geometry" of the two, with the model instance where there is one.
        points: How many contact points; for a contact surface how many faces.
        depth: Of the deepest point [m]; NaN for a contact surface.
        normal_force: How hard they press on each other [N].
        friction_force: Tangential force [N].
        friction_limit: Most that friction can bear, mu times the normal force [N].
        slip_speed: Of the fastest point, or at the centroid of a contact surface [m/s].
        state: "sticking", "sliding" or "no force".
    """

    A: str
    B: str
    points: int
    depth: float
    normal_force: float
    friction_force: float
    friction_limit: float
    slip_speed: float
    state: str

    def __str__(self) -> str:
        share = f"{100.0 * self.friction_force / self.friction_limit:.0f} %" if self.friction_limit > 0.0 else "none"
        depth = "a surface" if np.isnan(self.depth) else f"{self.depth * 1e3:.4g} mm deep"
        return (
            f"{self.A} on {self.B}: {self.points} point{'s' * (self.points != 1)}, {depth}, presses with "
            f"{self.normal_force:.4g} N; friction {self.friction_force:.3g} N ({share} of what it can bear); "
            f"{self.state}, slip {self.slip_speed:.2g} m/s"
        )


class ContactExplanation(list):
    """A ContactSummary for each pair of geometries that touch; a readable text when printed.

    Attributes:
        time: When [s].
    """

    def __init__(self, time: float, summaries: list[ContactSummary]) -> None:
        super().__init__(summaries)
        self.time = time

    def __str__(self) -> str:
        if not self:
            return f"t = {self.time:.6g} s: nothing touches."
        return "\n".join([f"t = {self.time:.6g} s: {len(self)} touching", *(f"  {summary}" for summary in self)])

    __repr__ = __str__


class _Sum:
    """Forces and the like of all points of a pair."""

    def __init__(self) -> None:
        self.normal_force = self.slip = 0.0
        self.tangential = np.zeros(3)
        self.depth, self.points = -np.inf, 0

    def add(self, force: np.ndarray, nhat: np.ndarray, slip: float, depth: float, points: int) -> None:
        """Adds a point, or a surface.

        Args:
            force: on B [N].
            nhat: from B into A.
            slip: [m/s].
            depth: [m].
            points: how many it stands for.
        """
        pressing = float(-np.dot(force, nhat))
        self.normal_force += pressing
        self.tangential = self.tangential + np.asarray(force) + pressing * np.asarray(nhat)
        self.slip = max(self.slip, float(slip))
        self.depth = depth if np.isnan(depth) else max(self.depth, depth)
        self.points += points


class ContactInWords:
    """Explains contact.

    Args:
        geometry: Whose shapes touch.
        settings: Below which slip friction counts as sticking.
        kinematics: How bodies move.
    """

    def __init__(self, geometry: PlantGeometry, settings: Settings, kinematics: Kinematics) -> None:
        self._geometry, self._settings, self._kinematics = geometry, settings, kinematics

    def explain(self, context: Context, results: ContactResults) -> ContactExplanation:
        """Who touches whom.

        Args:
            context: The plant's.
            results: Its contacts there.
        """
        pairs: dict[tuple[GeometryId, GeometryId], _Sum] = {}
        for i in range(results.num_point_pair_contacts()):
            info = results.point_pair_contact_info(i)
            pair = info.point_pair()
            found = pairs.setdefault((pair.id_A, pair.id_B), _Sum())
            found.add(info.contact_force(), pair.nhat_BA_W, info.slip_speed(), float(pair.depth), 1)
        for i in range(results.num_hydroelastic_contacts()):
            surface_info = results.hydroelastic_contact_info(i)
            surface = surface_info.contact_surface()
            found = pairs.setdefault((surface.id_M(), surface.id_N()), _Sum())
            normal = sum(surface.area(f) * np.asarray(surface.face_normal(f)) for f in range(surface.num_faces()))
            nhat = normal / np.linalg.norm(normal)
            slip = self._slip_speed(context, surface, nhat)
            found.add(-surface_info.F_Ac_W().translational(), nhat, slip, np.nan, surface.num_faces())
        summaries = [self._summary(A, B, found) for (A, B), found in pairs.items()]
        return ContactExplanation(float(context.get_time()), summaries)

    def _summary(self, A: GeometryId, B: GeometryId, found: _Sum) -> ContactSummary:
        state = self._geometry.required_scene_graph()._default_state()
        frictions = [_friction(state, geometry_id) for geometry_id in (A, B)]
        limit = CalcContactFrictionFromSurfaceProperties(*frictions).dynamic_friction() * found.normal_force
        friction = float(np.linalg.norm(found.tangential))
        if found.normal_force == 0.0:
            doing = "no force"
        else:
            slides = found.slip > self._settings.stiction_tolerance or friction >= (1.0 - 1e-3) * limit
            doing = "sliding" if slides else "sticking"
        name_A, name_B = self._name(state, A), self._name(state, B)
        return ContactSummary(
            name_A, name_B, found.points, found.depth, found.normal_force, friction, limit, found.slip, doing
        )

    def _slip_speed(self, context: Context, surface: ContactSurface, nhat: np.ndarray) -> float:
        """Tangential speed of the two bodies against each other at the centroid of a contact surface [m/s]."""
        inspector = self._geometry.required_scene_graph().model_inspector()
        velocities = []
        for geometry_id in (surface.id_M(), surface.id_N()):
            body = self._geometry.body_of_frame[inspector.GetFrameId(geometry_id)]
            p_BoC_W = surface.centroid() - self._kinematics.EvalBodyPoseInWorld(context, body).translation()
            V_WB = self._kinematics.EvalBodySpatialVelocityInWorld(context, body)
            velocities.append(V_WB.Shift(p_BoC_W).translational())
        v = velocities[0] - velocities[1]
        return float(np.linalg.norm(v - np.dot(v, nhat) * nhat))

    def _name(self, state: GeometryState, geometry_id: GeometryId) -> str:
        record = state.geometries[geometry_id]
        body = self._geometry.body_of_frame[record.frame]
        owner = body.name() if body.index() == 0 else body.scoped_name().get_full()
        return f"{owner}/{record.name.rpartition('::')[2]}"


def _friction(state: GeometryState, geometry_id: GeometryId) -> CoulombFriction:
    from sheldrake.geometry import Role

    return state.geometries[geometry_id].roles[Role.kProximity].GetProperty("material", "coulomb_friction")
