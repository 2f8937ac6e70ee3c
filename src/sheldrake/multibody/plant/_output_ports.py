"""The output ports of a plant: state, poses, velocities, accelerations, forces, contacts."""

from __future__ import annotations

import functools
import types
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common.value import AbstractValue, Value
from sheldrake.geometry import FrameId, FramePoseVector, GeometryConfigurationVector, QueryObject
from sheldrake.math import RigidTransform, RigidTransform_
from sheldrake.multibody.math import (
    SpatialAcceleration,
    SpatialAcceleration_,
    SpatialForce_,
    SpatialVelocity,
    SpatialVelocity_,
)
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._building.settings import Settings
from sheldrake.multibody.plant._contact.results import ContactResults
from sheldrake.multibody.plant._context.contexts import Contexts
from sheldrake.multibody.plant._context.coordinates import Coordinates
from sheldrake.multibody.plant._kernels.derivatives import net_actuation_now
from sheldrake.multibody.plant._kernels.ports import select_continuous_state, select_discrete_state
from sheldrake.multibody.plant._step.accelerations import Accelerations
from sheldrake.multibody.plant._step.kernel_models import KernelModels
from sheldrake.multibody.tree import ModelInstanceIndex
from sheldrake.systems.framework import BusValue, Context, LeafSystem

if TYPE_CHECKING:
    from sheldrake.multibody.plant._context.view import View
    from sheldrake.multibody.plant._multibody_plant import MultibodyPlant
    from sheldrake.systems.framework._index import ContinuousStateIndex, DiscreteStateIndex
    from sheldrake.systems.framework._vector import BasicVector

GEOMETRY_POSE, DEFORMABLE_BODY_CONFIGURATION = 0, 1
"""Numbers of the ports that are there before Finalize()."""

_OF_VELOCITIES = {
    "generalized_acceleration": "{}_dot [rad/s^2 or m/s^2]",
    "generalized_contact_forces": "{}_force [N m or N]",
}
"""Ports with an element for each generalized velocity, and what to call the elements."""


class OutputPorts:
    """Declaring output ports and computing their values.

    Args:
        elements: What there is.
        settings: Discrete or continuous; sampled ports or not.
        contexts: The state.
        coordinates: Which part of it belongs to a model instance.
        models: The frames of the SceneGraph.
        accelerations: Of the last step.
    """

    def __init__(
        self,
        elements: Elements,
        settings: Settings,
        contexts: Contexts,
        coordinates: Coordinates,
        models: KernelModels,
        accelerations: Accelerations,
    ) -> None:
        self._elements, self._settings, self._contexts = elements, settings, contexts
        self._coordinates, self._models = coordinates, models
        self._accelerations = accelerations
        self.numbers: dict[tuple[str, int | None], int] = {}
        """Of the ports that `declare` declares, by what they show and of which model instance."""
        self._frames: tuple[tuple[FrameId, ...], np.ndarray] | None = None  # and their bodies' rows in X_WB

    def number(self, what: str, model_instance: ModelInstanceIndex | None = None) -> int:
        """Number of the port that shows something, of all or of one model instance.

        Raises:
            RuntimeError: before Finalize(), or there is no such model instance.
        """
        if model_instance is None and (what, None) in self.numbers:
            return self.numbers[what, None]
        call = f"get_{what}_output_port"
        self._elements.require_finalized(call)
        if model_instance is not None:
            self._elements.require_instance(call, model_instance)
        return self.numbers[what, None if model_instance is None else int(model_instance)]

    # --- declaring

    def declare_of_geometry(self, plant: LeafSystem) -> None:
        """Declares the ports that exist before Finalize(), so that a SceneGraph can be connected."""
        key = "plant's geometry", self._settings.is_discrete()
        plant._declare_alike(key, lambda: self._declare_new_of_geometry(plant))

    def _declare_new_of_geometry(self, plant: LeafSystem) -> None:
        plant.DeclareAbstractInputPort("geometry_query", Value[QueryObject]())
        plant.DeclareAbstractOutputPort(
            "geometry_pose",
            lambda: AbstractValue.Make(FramePoseVector()),
            types.MethodType(_calc_geometry_pose, plant),
            self._kinematic_tickets(plant),
        )
        plant.DeclareAbstractOutputPort(
            "deformable_body_configuration",
            lambda: AbstractValue.Make(GeometryConfigurationVector()),
            lambda context, value: None,
            {plant.nothing_ticket()},
        )

    def _kinematic_tickets(self, plant: LeafSystem) -> set[Any]:
        state = plant.xd_ticket() if self._settings.is_discrete() else plant.xc_ticket()
        return {state, plant.all_parameters_ticket()}

    def declare(self, plant: LeafSystem, state_index: DiscreteStateIndex | ContinuousStateIndex) -> None:
        """Declares the ports of a finalized plant.

        Args:
            plant: The system.
            state_index: Of its state.
        """
        model = self._elements.model("Finalize")
        kinematic = self._kinematic_tickets(plant)
        sampled = {plant._scratch_ticket() if self._settings.sampled else plant.all_sources_ticket()}
        one_a_body = model.num_bodies

        def objects(what: str, make: Callable, calc: Callable, tickets: set[Any]) -> None:
            """A port of objects; methods make and compute them, so that copies on other scalars have their own."""
            allocate, compute = types.MethodType(make, plant), types.MethodType(calc, plant)
            port = plant.DeclareAbstractOutputPort(what, allocate, compute, tickets)
            self.numbers[what, None] = int(port.get_index())

        self._declare_state(plant, None, "state", np.arange(model.nq + model.nv), state_index, kinematic)
        objects("body_poses", _list_of(RigidTransform_, one_a_body), _calc_body_poses, kinematic)
        objects("body_spatial_velocities", _list_of(SpatialVelocity_, one_a_body), _calc_body_velocities, kinematic)
        accelerations = _list_of(SpatialAcceleration_, one_a_body)
        objects("body_spatial_accelerations", accelerations, _calc_body_accelerations, sampled)
        self._declare_vector(plant, None, "generalized_acceleration", model.nv, sampled)
        self._declare_vector(plant, None, "net_actuation", model.nu, sampled)
        objects("reaction_forces", _list_of(SpatialForce_, max(1, len(model.joints))), _calc_reactions, sampled)
        objects("contact_results", _new_contact_results, _calc_contact_results, sampled)
        for i in range(self._elements.num_model_instances()):
            instance = ModelInstanceIndex(i)
            self._declare_state_of(plant, instance, state_index, kinematic)
            nv, nu = self._coordinates.num_velocities(instance), self._coordinates.num_actuated_dofs(instance)
            self._declare_vector(plant, instance, "generalized_acceleration", nv, sampled)
            self._declare_vector(plant, instance, "generalized_contact_forces", nv, sampled)
            self._declare_vector(plant, instance, "net_actuation", nu, sampled)
        objects("surface_displacements", _new_bus, _calc_surface_displacements, {plant.all_state_ticket()})

    def _declare_vector(
        self, plant: LeafSystem, instance: ModelInstanceIndex | None, what: str, size: int, tickets: set[Any]
    ) -> None:
        """An output port with the part of a vector of the whole plant that belongs to a model instance."""
        at: Any = slice(None)
        if instance is None:
            name = what
        elif what == "net_actuation":
            name, at = self._name(instance, what), self._coordinates.input_indices(what, instance)
        else:
            name, at = self._name(instance, what), self._coordinates.indices(what, "v", instance)

        def fill(plant: MultibodyPlant, context: Context, vector: BasicVector) -> None:
            vector.SetFromVector(getattr(plant._parts.reports, what)(context)[at])

        if what == "net_actuation" and not self._settings.is_discrete():  # known without accelerations
            port = plant.DeclareVectorOutputPort(name, size, net_actuation_now, tickets)
            select = np.arange(size) if instance is None else np.asarray(at)
            plant._output_models[int(port.get_index())] = {"select_model": select.astype(np.int64)}
        else:
            port = plant.DeclareVectorOutputPort(name, size, types.MethodType(fill, plant), tickets)
        self.numbers[what, None if instance is None else int(instance)] = int(port.get_index())

    def _name(self, instance: ModelInstanceIndex, what: str) -> str:
        return f"{self._elements.GetModelInstanceName(instance)}_{what}"

    def _declare_state_of(
        self,
        plant: LeafSystem,
        instance: ModelInstanceIndex,
        state_index: DiscreteStateIndex | ContinuousStateIndex,
        tickets: set[Any],
    ) -> None:
        name, model = self._name(instance, "state"), self._elements.model("Finalize")
        q, v = self._coordinates.indices(name, "q", instance), self._coordinates.indices(name, "v", instance)
        at = np.concatenate([q, model.nq + v]).astype(np.int64)
        self._declare_state(plant, instance, name, at, state_index, tickets)

    def _declare_state(
        self,
        plant: LeafSystem,
        instance: ModelInstanceIndex | None,
        name: str,
        at: np.ndarray,
        state_index: Any,
        tickets: set[Any],
    ) -> None:
        """A port with the elements `at` of the state."""
        model = self._elements.model("Finalize")
        if len(at) == model.nq + model.nv + self._contexts.num_misc_states():
            port = plant.DeclareStateOutputPort(name, state_index)
        else:
            kernel = select_discrete_state if self._settings.is_discrete() else select_continuous_state
            port = plant.DeclareVectorOutputPort(name, len(at), kernel, tickets)
            plant._output_models[int(port.get_index())] = {"select_model": at}
        self.numbers["state", None if instance is None else int(instance)] = int(port.get_index())

    # --- names

    def names(self, j: int) -> list[str] | None:
        """Names of the elements of a vector port, with units where the names do not tell, for logs; None for others."""
        what, instance = self.shown_by(j)
        given = () if instance is None else (instance,)
        if what == "state":
            return self._coordinates.GetStateNames(*given)
        if what == "net_actuation":
            return self._actuation_names(*given)
        if what in _OF_VELOCITIES:
            return [_OF_VELOCITIES[what].format(name) for name in self._coordinates.GetVelocityNames(*given)]
        return None

    def shown_by(self, j: int) -> tuple[str, ModelInstanceIndex | None]:
        """What port number j shows, and of which model instance; "" for the ports of geometry."""
        for (what, i), number in self.numbers.items():
            if number == j:
                return what, None if i is None else ModelInstanceIndex(i)
        return "", None

    def _actuation_names(self, instance: ModelInstanceIndex | None = None) -> list[str]:
        names = []
        for actuator in self._coordinates.actuators_of("net_actuation", instance):
            unit = "N" if actuator.joint().type_name() == "prismatic" else "N m"
            names.append(f"{actuator.name()} [{unit}]")
        return names

    # --- values

    def fill_geometry_poses(self, context: Context, poses: FramePoseVector) -> None:
        """Sets the poses of the frames of the SceneGraph."""
        poses.clear()
        if not self._elements.is_finalized():
            return
        X_WB = self._contexts.view(context).X_WB()
        if X_WB.dtype == float:
            ids, rows = self._numbered_frames()
            poses._set_rows(ids, X_WB.take(rows, 0))
            return
        for frame, row in self._models.rows_of_frames().items():
            if row:
                poses.set_value(frame, self._contexts.transform(context, X_WB[row]))

    def _numbered_frames(self) -> tuple[tuple[FrameId, ...], np.ndarray]:
        """The moving frames of the SceneGraph, and the rows of their bodies."""
        if self._frames is None:
            frames = {frame: row for frame, row in self._models.rows_of_frames().items() if row}
            self._frames = tuple(frames), np.array(list(frames.values()), dtype=np.int64)
        return self._frames

    def numbers_of_frames(self, context: Context) -> tuple[View, tuple[FrameId, ...], np.ndarray] | None:
        """Whose `X_WB()` the poses of the SceneGraph's frames are, these frames, and their rows; None of duals."""
        view = self._contexts.view(context)
        return (view, *self._numbered_frames()) if view.T is float else None

    def body_poses(self, context: Context) -> list[RigidTransform]:
        """X_WB by body."""
        view = self._contexts.view(context)
        return self._contexts.transforms(context, view.X_WB()[view.frozen.rows])

    def body_velocities(self, context: Context) -> list[SpatialVelocity]:
        """V_WB by body."""
        view = self._contexts.view(context)
        return view.of(SpatialVelocity_)._make_each(view.ask_body_velocities()[view.frozen.rows])

    def body_accelerations(self, context: Context) -> list[SpatialAcceleration]:
        """A_WB by body."""
        view = self._contexts.view(context)
        return view.of(SpatialAcceleration_)._make_each(self._accelerations.in_last_step(context)[view.frozen.rows])


# A plant's declarations serve its copies on other scalars: so these ask the plant that they are called for.


def _list_of(family: Any, count: int) -> Callable[[Any], AbstractValue]:
    """Makes a list of poses or spatial vectors of the plant's scalar."""

    @functools.cache
    def model(scalar: type) -> AbstractValue:
        cls = family[scalar]
        one = cls() if family is RigidTransform_ else cls(np.zeros(6))
        return AbstractValue.Make([one] * count)

    return lambda plant: model(plant._scalar).Clone()


def _new_bus(plant: Any) -> AbstractValue:
    return AbstractValue.Make(BusValue())


def _new_contact_results(plant: MultibodyPlant) -> AbstractValue:
    return AbstractValue.Make(ContactResults())


def _calc_geometry_pose(plant: MultibodyPlant, context: Context, value: AbstractValue) -> None:
    plant._parts.output_ports.fill_geometry_poses(context, value.get_mutable_value())


def _numbers_of_frames(plant: MultibodyPlant, context: Context) -> Any:
    return plant._parts.output_ports.numbers_of_frames(context)


_calc_geometry_pose.numbers = _numbers_of_frames  # type: ignore[attr-defined]  # for who wants no FramePoseVector


def _calc_body_poses(plant: MultibodyPlant, context: Context, value: AbstractValue) -> None:
    value._held = plant._parts.output_ports.body_poses(context)


def _calc_body_velocities(plant: MultibodyPlant, context: Context, value: AbstractValue) -> None:
    value._held = plant._parts.output_ports.body_velocities(context)


def _calc_body_accelerations(plant: MultibodyPlant, context: Context, value: AbstractValue) -> None:
    value._held = plant._parts.output_ports.body_accelerations(context)


def _calc_contact_results(plant: MultibodyPlant, context: Context, value: AbstractValue) -> None:
    value._held = plant._parts.reports.contact_results(context)


def _calc_reactions(plant: MultibodyPlant, context: Context, value: AbstractValue) -> None:
    value._held = plant._parts.reactions.forces(context)


def _calc_surface_displacements(plant: Any, context: Context, value: AbstractValue) -> None:
    value._held = plant._parts.surface_speeds.displacements(context)
