"""The input ports of a plant: which number each has, and what they bring."""

from __future__ import annotations

import dataclasses

import numpy as np

from sheldrake.common.value import AbstractValue
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._step.external_force import ExternallyAppliedSpatialForce
from sheldrake.multibody.tree import ModelInstanceIndex
from sheldrake.systems.framework import BusValue, Context, LeafSystem

GEOMETRY_QUERY = 0
"""Number of the port that brings the QueryObject; it is there before Finalize()."""


@dataclasses.dataclass
class InputPorts:
    """Numbers of the ports that `Finalize()` declares; -1 before.

    Attributes:
        actuation: Efforts of all actuators.
        generalized_force: Generalized forces of all velocities.
        spatial_force: A list of ExternallyAppliedSpatialForce.
        surface_speeds: A bus with the speeds of surfaces that run.
        actuation_of: Efforts of the actuators of each model instance.
        desired_state_of: Desired positions and velocities of the actuators of each model instance.
    """

    actuation: int = -1
    generalized_force: int = -1
    spatial_force: int = -1
    surface_speeds: int = -1
    actuation_of: list[int] = dataclasses.field(default_factory=list)
    desired_state_of: list[int] = dataclasses.field(default_factory=list)

    def copy(self) -> InputPorts:
        """The same numbers."""
        lists = list(self.actuation_of), list(self.desired_state_of)
        return InputPorts(self.actuation, self.generalized_force, self.spatial_force, self.surface_speeds, *lists)

    def take(self, other: InputPorts) -> None:
        """Takes the numbers of another plant, whose ports are the same."""
        vars(self).update(vars(other.copy()))

    def of_forces(self) -> list[int]:
        """Ports that bring forces as vectors."""
        return [self.actuation, *self.actuation_of, self.generalized_force]

    def actuation_port(self, elements: Elements, model_instance: ModelInstanceIndex | None) -> int:
        """Number of the port with the efforts of all actuators, or of those of one model instance.

        Raises:
            RuntimeError: before Finalize(), or there is no such model instance.
        """
        call = "get_actuation_input_port"
        elements.require_finalized(call)
        if model_instance is None:
            return self.actuation
        elements.require_instance(call, model_instance)
        return self.actuation_of[int(model_instance)]

    def desired_state_port(self, elements: Elements, model_instance: ModelInstanceIndex) -> int:
        """Number of the port with the desired state of the actuators of a model instance.

        Raises:
            RuntimeError: before Finalize(), or there is no such model instance.
        """
        call = "get_desired_state_input_port"
        elements.require_finalized(call)
        elements.require_instance(call, model_instance)
        return self.desired_state_of[int(model_instance)]

    def forget_desired_states(self, context: Context) -> None:
        """Marks, for the step, desired states that nobody gives."""
        store, place = context._store, context._place
        for number in self.desired_state_of:
            slot = place.inputs[number]
            if slot.free >= 0 and not store.i[store.layout.fixed0 + slot.free]:
                store.S[slice(*slot.span)] = np.nan

    def declare(self, plant: LeafSystem, elements: Elements) -> None:
        """Declares the ports of a finalized plant."""
        model = elements.model("Finalize")

        def vector_port(name: str, size: int) -> int:
            number = int(plant.DeclareVectorInputPort(name, size).get_index())
            plant._inputs[number].optional = True
            return number

        self.actuation = vector_port("actuation", model.nu)
        self.generalized_force = vector_port("applied_generalized_force", model.nv)
        forces = AbstractValue.Make([ExternallyAppliedSpatialForce()])
        self.spatial_force = int(plant.DeclareAbstractInputPort("applied_spatial_force", forces).get_index())
        for i, instance in enumerate(elements.instances):
            n = sum(a.num_inputs() for a in elements.actuators.of_instance(ModelInstanceIndex(i)))
            self.actuation_of.append(vector_port(f"{instance.name()}_actuation", n))
            self.desired_state_of.append(vector_port(f"{instance.name()}_desired_state", 2 * n))
        bus = AbstractValue.Make(BusValue())
        self.surface_speeds = int(plant.DeclareAbstractInputPort("surface_speeds", bus).get_index())


def vector_inputs(context: Context) -> tuple[tuple[np.ndarray, ...], list[int]]:
    """Values of the input ports, in the memory of the context: empty where abstract, zero or NaN without a value.

    Returns:
        The values, and the rows of the store to be brought up to date before they are read. Where an input has a value
        that waits for memory to move (see `Store.settle`), this value.
    """
    store, rows, values = context._store, [], []
    for i in range(context.num_input_ports()):
        slot = store.layout.input_slot(context._node, i)
        late = store.late_input(context._node, i) if slot.vector else None
        values.append(store.S[slice(*(slot.span if slot.vector else (0, 0)))] if late is None else np.array(late))
        if slot.vector and slot.row >= 0:
            rows.append(slot.row)
    return tuple(values), rows


def has_value(context: Context, i: int) -> bool:
    """Whether input port i is connected or fixed; without an object for the port, which costs more than the look."""
    store = context._store
    if store.unsettled:
        return context._system.get_input_port(i).HasValue(context)
    slot = store.layout.input_slot(context._node, i)
    return slot.free < 0 or bool(store.i[store.layout.fixed0 + slot.free])


def sees_geometry(context: Context) -> bool:
    """Whether the geometry_query port is connected."""
    return has_value(context, GEOMETRY_QUERY)
