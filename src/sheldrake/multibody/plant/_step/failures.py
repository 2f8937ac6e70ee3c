"""Why a plant's kernels could not go on, in words."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.geometry._compiled.hydroelastic import explain_unsupported, face_capacity
from sheldrake.geometry._state.collision_filter import Pair, ordered_pair
from sheldrake.multibody.contact_solvers._kernels.problem import MASS_NOT_POSITIVE, MOTION_NOT_FINITE
from sheldrake.multibody.contact_solvers._status import SOLVE_FAILURES, explain_solver_status
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._building.geometry import PlantGeometry
from sheldrake.multibody.plant._building.settings import Settings
from sheldrake.multibody.plant._context.contexts import Contexts
from sheldrake.multibody.plant._context.queries import no_rotation
from sheldrake.multibody.plant._kernels.contacts import HYDRO_CAPACITY, HYDRO_UNSUPPORTED_PAIR
from sheldrake.multibody.plant._kernels.ports import CONSTRAINTS_IN_CONTINUOUS_TIME, GEOMETRY_NOT_CONNECTED
from sheldrake.multibody.plant._step.input_ports import GEOMETRY_QUERY
from sheldrake.multibody.plant._step.kernel_models import KernelModels
from sheldrake.multibody.plant._step.results import bodies_at_hand
from sheldrake.systems.framework import Context


class Failures:
    """What a status that a kernel of a plant gave stands for.

    Args:
        elements: Bodies, joints and constraints.
        settings: Whether the last step is still there to be looked at.
        geometry: What touches.
        contexts: The state.
        models: The geometry of contexts.
    """

    def __init__(
        self, elements: Elements, settings: Settings, geometry: PlantGeometry, contexts: Contexts, models: KernelModels
    ) -> None:
        self._elements, self._settings, self._geometry = elements, settings, geometry
        self._contexts, self._models = contexts, models

    def explain(self, status: int, context: Context) -> Exception:
        """The error for a status."""
        plant = context._system._describe()
        if status == GEOMETRY_NOT_CONNECTED:
            return RuntimeError(
                f"{plant}: it has {self._geometry.num_collision_geometries()} collision geometries, but its "
                "geometry_query input port is not connected to a SceneGraph here. Use the context of the diagram that "
                "holds both (plant.GetMyContextFromRoot(diagram_context)), or AddMultibodyPlantSceneGraph()."
            )
        if status == CONSTRAINTS_IN_CONTINUOUS_TIME:
            return RuntimeError(
                f"{plant}: it has {len(self._elements.constraints)} constraints, and continuous time does not "
                "support constraints. Give the plant a time step."
            )
        if status == HYDRO_UNSUPPORTED_PAIR:
            return self._without_surface(context)
        now = f"{plant} at time {context.get_time()}"
        if status == HYDRO_CAPACITY:
            room = face_capacity(self._models.geometry_of(context).hydro)
            return RuntimeError(
                f"{now}: contact surfaces have more faces than there is room for ({room}), and none is dropped "
                "silently. Try larger resolution hints, coarser meshes, or collision filters."
            )
        if status == MOTION_NOT_FINITE and (lost := self._without_place(context)):
            return RuntimeError(
                f"{now}: positions are infinite or NaN. It happened at the joints {', '.join(lost[:10])}."
            )
        if status == MOTION_NOT_FINITE and not self._settings.sampled:  # of a stage, whose state is gone again
            return RuntimeError(f"{now}: positions become infinite or NaN within a step of the integrator.")
        if status == MASS_NOT_POSITIVE and (fault := self._without_rotation(context)):
            return RuntimeError(f"{now}: {fault}.")
        text = f"{now}: {explain_solver_status(status)}"
        if status in SOLVE_FAILURES and self._settings.sampled:
            text += f" It happened among: {self._bodies_at_hand(context)}."
        if status == MOTION_NOT_FINITE:
            text += self._where_not_finite(context)
        return RuntimeError(text)

    def refuse_contact_of(self, pairs: frozenset[Pair], context: Context) -> None:
        """Checks that none of these pairs of geometries overlaps.

        Args:
            pairs: Of the plant's geometry with that of others.
            context: Where; its geometry_query input port is connected.

        Raises:
            RuntimeError: one does.
        """
        query = context._system.get_input_port(GEOMETRY_QUERY).Eval(context)
        for found in query.ComputePointPairPenetration():
            if ordered_pair(found.id_A, found.id_B) in pairs:
                name, owner = query.inspector().GetName, query.inspector().GetOwningSourceName
                one, other = (f"'{name(i)}' of '{owner(i)}'" for i in (found.id_A, found.id_B))
                raise RuntimeError(
                    f"{context._system._describe()} at time {context.get_time()}: geometry {one} is in contact with "
                    f"{other}, and only one of them is known to this plant, so no force could act. Exclude such pairs "
                    "with a collision filter, or put all bodies that touch into one plant."
                )

    def _without_place(self, context: Context) -> list[str]:
        """Joints whose positions are not finite."""
        view = self._contexts.view(context)
        q = view.q.astype(float)
        return [
            repr(joint.name())
            for joint in view.frozen.joints
            if not np.all(np.isfinite(q[joint.position_start() : joint.position_start() + joint.num_positions()]))
        ]

    def _without_rotation(self, context: Context) -> str:
        view = self._contexts.view(context)
        return no_rotation(view.frozen.joints, view.q)

    def _bodies_at_hand(self, context: Context) -> str:
        model = self._elements.model("MultibodyPlant")
        rows = bodies_at_hand(context._store.scratch(context._node), model.tree)
        names = [repr(model.row_bodies[row].name()) for row in rows]
        return ", ".join(names[:10]) + (f" and {len(names) - 10} more" if len(names) > 10 else "")

    def _where_not_finite(self, context: Context) -> str:
        """The input ports that bring such numbers, in Drake's words; without one, the joints that move so."""
        for i in range(context.num_input_ports()):
            port = context._system.get_input_port(i)
            value = port.Eval(context) if port.HasValue(context) else None
            if isinstance(value, np.ndarray) and not np.all(np.isfinite(value.astype(float))):
                whose = port.get_name().removesuffix("_actuation")
                if whose == "actuation":
                    return " Detected NaN in the actuation input port for all instances."
                if whose != port.get_name():
                    return f" Detected NaN in the actuation input port for model instance {whose}."
                return f" Detected NaN in the input port {port.get_name()}."
        v = context._store.scratch(context._node).problem.v_star.astype(float)
        names = [
            repr(joint.name())
            for joint in self._elements.joints
            if not np.all(np.isfinite(v[joint.velocity_start() : joint.velocity_start() + joint.num_velocities()]))
        ]
        return f" It happened at the joints {', '.join(names[:10])}."

    def _without_surface(self, context: Context) -> Exception:
        """Which geometries overlap that can have no contact surface."""
        geometry: Any = self._models.geometry_of(context)
        table = context._store.scratch(context._node).table
        for c in range(int(table.num_contacts)):
            contact = table[c]
            if contact.depth > 0.0:
                A, B = geometry.ids[contact.geometry_A], geometry.ids[contact.geometry_B]
                return explain_unsupported(geometry.state, A, B)
        return RuntimeError(f"{context._system._describe()}: geometries overlap that can have no contact surface.")
