"""The parts of a plant, put together: each takes what it needs, and knows nothing of those after it.

elements, settings            what is registered; Finalize() freezes it into a model
geometry, surface_axes        its shapes in a SceneGraph; which surfaces run as belts do
topology                      its graph
contexts                      a view of each context: state and parameters as arrays, queries bound to them
coordinates, free_bodies, kinematics, dynamics, constraints       questions to a context
inputs, applied_forces, surface_speeds        what acts from outside
kernel_models                 the arrays of the kernels
advance                       the step or the derivatives, and the scratch that they leave
accelerations, reports, reactions, contact_in_words               what the scratch says
output_ports                  all of it as ports
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sheldrake.common._copies import deep_copy
from sheldrake.multibody.plant._building.constraints import Constraints
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._building.finalize import freeze
from sheldrake.multibody.plant._building.geometry import PlantGeometry
from sheldrake.multibody.plant._building.loops import Loops
from sheldrake.multibody.plant._building.settings import Settings
from sheldrake.multibody.plant._building.surface_axes import SurfaceAxes
from sheldrake.multibody.plant._building.topology import Topology
from sheldrake.multibody.plant._context.contexts import Contexts
from sheldrake.multibody.plant._context.coordinates import Coordinates
from sheldrake.multibody.plant._context.dynamics import Dynamics
from sheldrake.multibody.plant._context.free_bodies import FreeBodies
from sheldrake.multibody.plant._context.kinematics import Kinematics
from sheldrake.multibody.plant._output_ports import OutputPorts
from sheldrake.multibody.plant._step.accelerations import Accelerations
from sheldrake.multibody.plant._step.advance import Advance
from sheldrake.multibody.plant._step.applied_forces import AppliedForces
from sheldrake.multibody.plant._step.contact_in_words import ContactInWords
from sheldrake.multibody.plant._step.failures import Failures
from sheldrake.multibody.plant._step.input_ports import InputPorts
from sheldrake.multibody.plant._step.kernel_models import KernelModels
from sheldrake.multibody.plant._step.reactions import Reactions
from sheldrake.multibody.plant._step.reports import Reports
from sheldrake.multibody.plant._step.surface_speeds import SurfaceSpeeds
from sheldrake.multibody.tree import JointActuator
from sheldrake.systems.framework import ContinuousStateIndex, DiscreteStateIndex, LeafSystem

if TYPE_CHECKING:
    from sheldrake.multibody.plant._multibody_plant import MultibodyPlant


class PlantParts:
    """What a plant consists of; also the `Owner` of its elements.

    Args:
        plant: The system.
        time_step: Period of the discrete update [s], 0 for continuous state.
    """

    def __init__(self, plant: LeafSystem, time_step: float) -> None:
        self.plant = plant
        self.family = object()  # the same for copies on other scalars, so that elements serve them too
        self.elements = elements = Elements(self)
        self.settings = settings = Settings(elements, time_step)
        self.geometry = geometry = PlantGeometry(elements)
        self.surface_axes = axes = SurfaceAxes(elements)
        self.topology = Topology(elements)
        self.contexts = contexts = Contexts(plant, elements, self.family, settings.is_discrete(), axes)
        self.constraints = Constraints(elements, contexts, settings)
        self.loops = Loops(elements, self.constraints, geometry)
        self.coordinates = coordinates = Coordinates(elements, contexts)
        self.kinematics = kinematics = Kinematics(elements, contexts)
        self.free_bodies = FreeBodies(elements, self.topology, kinematics)
        self.dynamics = dynamics = Dynamics(elements, contexts, kinematics)
        self.inputs = inputs = InputPorts()
        self.applied_forces = applied = AppliedForces(elements, contexts, inputs)
        self.surface_speeds = speeds = SurfaceSpeeds(axes, settings, inputs)
        self.kernel_models = models = KernelModels(
            elements, settings, geometry, axes, self.constraints, coordinates, inputs
        )
        self.failures = Failures(elements, settings, geometry, contexts, models)
        self.advance = advance = Advance(elements, settings, contexts, models, applied, speeds, self.failures)
        self.accelerations = Accelerations(elements, settings, contexts, kinematics, dynamics, advance)
        self.reports = reports = Reports(plant, contexts, models, advance)
        self.reactions = Reactions(elements, settings, geometry, contexts, applied, models, advance, reports)
        self.contact_in_words = ContactInWords(geometry, settings, kinematics)
        self.output_ports = OutputPorts(elements, settings, contexts, coordinates, models, self.accelerations)

    def finalize(self) -> None:
        """Freezes the model and declares what follows from it: state, parameters, ports, and how it advances.

        Raises:
            RuntimeError: called twice, or the joints do not make a forest; the plant is then as it was.
        """
        if self.elements.is_finalized():
            raise RuntimeError("MultibodyPlant::Finalize(): repeated calls not allowed.")
        self.settings.refuse_dry_friction()
        self.loops.cut()
        self.elements.finalize(freeze(self.elements, self.free_bodies.base_joint))
        state_index = self.contexts.declare()
        self.geometry.filter_collisions(self.topology.welded_groups, self.loops.whole_of)
        self._declare_ports(state_index)
        self.kernel_models.compile()
        self.advance.declare(self.plant)
        self.surface_speeds.declare(self.plant)

    def _declare_ports(self, state_index: DiscreteStateIndex | ContinuousStateIndex) -> None:
        """Declares the ports; plants that have the same share their declarations."""
        elements, settings, state = self.elements, self.settings, self.contexts.num_misc_states()
        joints = tuple((int(j._instance), j._q_start, j.kTypeName) for j in elements.joints)
        actuators = tuple((int(a._instance), a.num_inputs()) for a in elements.actuators)
        names = tuple(instance.name() for instance in elements.instances)
        key = settings.is_discrete(), settings.sampled, state, len(elements.bodies), names, joints, actuators

        def declare() -> tuple[InputPorts, dict]:
            self.inputs.declare(self.plant, elements)
            self.output_ports.declare(self.plant, state_index)
            return self.inputs.copy(), dict(self.output_ports.numbers)

        inputs, numbers = self.plant._declare_alike(("plant", *key), declare)
        self.inputs.take(inputs)
        self.output_ports.numbers = dict(numbers)

    def gravity_changed(self) -> None:
        """Gravity has another vector: after Finalize() it is among the model's arrays."""
        if self.elements.is_finalized():
            model = self.elements.model("set_gravity_vector")
            for row, body in enumerate(model.row_bodies[1:], start=1):
                model.tree.gravity[row] = self.elements.gravity_on(body)

    def actuator_changed(self, actuator: JointActuator) -> None:
        """An actuator has another effort limit or other gains."""
        self.kernel_models.actuator_changed(actuator)

    def copy_for(self, plant: LeafSystem) -> PlantParts:
        """Parts of a copy on another scalar: with elements of its own, and the same arrays.

        Args:
            plant: The copy.
        """
        models = self.kernel_models
        shared = self.family, self.geometry.scene_graph, *models.arrays(), *self.advance.arrays()
        memo: dict[int, Any] = {id(one): one for one in shared if one is not None}
        memo[id(self.plant)] = plant
        memo[id(models.compiled)] = dict(models.compiled)
        return deep_copy(self, memo)


def parts_of(plant: MultibodyPlant) -> PlantParts:
    """The parts of a MultibodyPlant, for packages that need more than its calls."""
    return plant._parts
