"""MultibodyPlant: bodies and joints as a system with ports.

Put together from one file a subject: registration before `Finalize()`, which makes the model (`_building`); then state
and queries, all through one `View` for each context (`_context`); the step, discrete or continuous (`_step`); ports.
"""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

from sheldrake.common._names import name_parts_after
from sheldrake.multibody.plant._building.constraints import Constraints
from sheldrake.multibody.plant._building.contact_settings import ContactSettings
from sheldrake.multibody.plant._building.finalize import Finalization
from sheldrake.multibody.plant._building.force_registration import ForceRegistration
from sheldrake.multibody.plant._building.geometry import PlantGeometry
from sheldrake.multibody.plant._building.topology import Topology
from sheldrake.multibody.plant._contact.in_words import ContactInWords
from sheldrake.multibody.plant._context.access import ContextAccess
from sheldrake.multibody.plant._context.dynamics import Dynamics
from sheldrake.multibody.plant._context.free_bodies import FreeBodies
from sheldrake.multibody.plant._context.kinematics import Kinematics
from sheldrake.multibody.plant._context.state import State
from sheldrake.multibody.plant._enums import DiscreteContactApproximation
from sheldrake.multibody.plant._ports import Ports
from sheldrake.multibody.plant._step.applied_forces import AppliedForces
from sheldrake.multibody.plant._step.continuous import ContinuousDynamics
from sheldrake.multibody.plant._step.discrete import DiscreteUpdate
from sheldrake.multibody.plant._step.kernel_models import KernelModels
from sheldrake.multibody.plant._step.reactions import Reactions
from sheldrake.multibody.plant._step.reports import Reports
from sheldrake.systems.framework import BasicVector, LeafSystem
from sheldrake.systems.framework._vector import lifted

# What holds elements; a plant on another scalar has its own.
_OF_ELEMENTS = (
    "_bodies _frames _joints _actuators _force_elements _instances _body_of_frame _joint_between _gravity "
    "_constraints _steps _row_bodies _inboard"
).split()


class MultibodyPlant(
    ForceRegistration, PlantGeometry, Constraints, ContactSettings, Finalization, Topology,
    ContextAccess, State, FreeBodies, Kinematics, Dynamics,
    AppliedForces, KernelModels, DiscreteUpdate, ContinuousDynamics, Reports, Reactions,
    ContactInWords, Ports, LeafSystem,
):  # fmt: skip
    """Rigid bodies connected by joints, with contact, as a system.

    Bodies, joints and geometry are added first; `Finalize()` ends that, and makes state, parameters and ports.

    Args:
        time_step: Period of the discrete update [s], 0 for a plant with continuous state.
    """

    _complex_rows = True

    _generic = True

    def __init__(self, time_step: float):
        try:
            time_step = float(time_step)
        except (TypeError, ValueError):
            raise TypeError(
                f"MultibodyPlant(): incompatible constructor arguments. time_step must be a float, not {time_step!r}."
            ) from None
        if not (time_step >= 0.0 and np.isfinite(time_step)):
            raise RuntimeError(f"MultibodyPlant(): time_step must be zero or positive and finite, not {time_step}.")
        self._time_step = time_step
        self._family: Any = object()  # the same for copies on other scalars, so that elements serve them too
        self._sampled = time_step > 0.0
        self._geometry_cache: dict[int, Any] = {}
        self._prototype: Any = None
        self._plant_model: Any = None
        self._constraints: dict[Any, Any] = {}
        self._default_free_poses: dict[int, Any] = {}
        self._index_cache: dict[Any, np.ndarray] = {}
        self._start_geometry()
        LeafSystem.__init__(self)
        self._start_registration()
        self._start_contact_settings()
        self._declare_geometry_ports()

    def _converted(self, scalar: Any) -> Any:
        new = super()._converted(scalar)
        if new is not None:
            own = {name: vars(self)[name] for name in _OF_ELEMENTS if name in vars(self)}
            new.__dict__.update(copy.deepcopy(own, {id(self): new}))
        return new

    def time_step(self) -> float:
        """Period of the discrete update [s], 0 for a plant with continuous state."""
        return self._time_step

    def is_discrete(self) -> bool:
        """Whether the state is discrete."""
        return self._time_step > 0.0

    def SetUseSampledOutputPorts(self, use_sampled_output_ports: bool) -> None:
        """Whether ports that depend on forces report the last step (the default) or are computed when asked.

        Raises:
            RuntimeError: the plant is finalized, or continuous and sampling is asked for.
        """
        self._require_not_finalized("SetUseSampledOutputPorts")
        if use_sampled_output_ports and not self.is_discrete():
            raise RuntimeError("SetUseSampledOutputPorts(): a continuous plant (time_step = 0) has no step to sample.")
        self._sampled = bool(use_sampled_output_ports)

    def has_sampled_output_ports(self) -> bool:
        """Whether ports that depend on forces report the last step."""
        return self._sampled

    def Finalize(self) -> None:
        """Ends the building of the model: connects free bodies to the world, declares state, parameters and ports.

        Raises:
            RuntimeError: called twice, or the joints do not make a forest; the plant is then as it was.
        """
        if self._finalized:
            raise RuntimeError("MultibodyPlant::Finalize(): repeated calls not allowed.")
        self._refuse_dry_friction()
        self._finalize_tree()
        self._finalized = True
        self._declare_state_and_parameters()
        self._filter_collisions()
        self._declare_input_ports()
        self._plant_model = self._compile_plant_model()
        self._declare_output_ports(self._state_index)
        if self.is_discrete():
            self._declare_discrete_update()
        else:
            self._declare_derivatives()

    def _refuse_dry_friction(self) -> None:
        """Only solvers that know scalar rows know dry friction."""
        rubbing = [joint.name() for joint in self._joints if joint._dry_friction.any()]
        if rubbing and (not self.is_discrete() or self._approximation is DiscreteContactApproximation.kTamsi):
            raise RuntimeError(
                f"Finalize(): joint {rubbing[0]!r} has dry friction, which only discrete plants with kLagged, "
                "kSimilar or kSap contact have."
            )

    def _declare_state_and_parameters(self) -> None:
        for model in self._parameter_models:
            self.DeclareNumericParameter(BasicVector(model))
        x0 = np.concatenate([self._all_default_positions(), np.zeros(self._nv)])
        if self.is_discrete():
            self._state_index: Any = self.DeclareDiscreteState(x0)
        else:
            self._state_index = self.DeclareContinuousState(BasicVector(x0), self._nq, self._nv, 0)

    def _model_changed(self) -> None:
        """The arrays of the model changed their values: what was computed from them is out of date."""
        self._model_serial += 1

    _model_serial = 0

    # --- contexts

    def AllocateContext(self) -> Any:
        """A context whose state is not set yet.

        Raises:
            RuntimeError: before Finalize().
        """
        self._require_ready()
        return super().AllocateContext()

    def _require_ready(self) -> None:
        if not self._finalized:
            raise RuntimeError(
                f"{self._describe()} has no context yet: call Finalize() first, then Build() or CreateDefaultContext()."
            )

    def _set_default_context(self, context: Any) -> None:
        """Defaults that may have changed since Finalize()."""
        self._require_ready()
        store, place = context._store, context._place
        start = (place.xd if self.is_discrete() else place.xc)[0]
        store.S[start : start + self._nq] = lifted(self._all_default_positions(), store.scalar)
        for actuator in self._actuators:
            first = place.p[0] + self._start(actuator)
            numbers = np.array([actuator.default_rotor_inertia(), actuator.default_gear_ratio()])
            store.S[first : first + 2] = lifted(numbers, store.scalar)
        for i in range(len(self._instances.slots)):
            slot = place.inputs[self._port_numbers["desired_state", i]]
            if slot.free >= 0 and not store.i[store.layout.fixed0 + slot.free]:
                store.S[slice(*slot.span)] = np.nan  # the step's mark of a desired state that nobody gave

    def _set_random_context(self, context: Any, generator: Any) -> None:
        """Positions drawn from the distributions that joints were given."""
        from sheldrake.math import UniformlyRandomQuaternion
        from sheldrake.symbolic import Expression

        for joint in self._joints:
            if joint._random_q is None:
                continue
            drawn = list(joint._random_q)
            if isinstance(drawn[0], str):
                drawn[:4] = UniformlyRandomQuaternion(generator).wxyz()
            values = [Expression(x).Evaluate(generator=generator) for x in drawn]
            self._write_positions(context, joint._q_start, np.array(values))

    def SetDefaultState(self, context: Any, state: Any) -> None:
        """Sets a state of a context's structure to the default positions, at rest."""
        self._view(context)
        x0 = np.concatenate([self._all_default_positions(), np.zeros(self._nv)])
        if self.is_discrete():
            state.get_mutable_discrete_state().get_mutable_vector(0).SetFromVector(x0)
        else:
            state.get_mutable_continuous_state().SetFromVector(x0)

    @property
    def _dtype(self) -> Any:
        return float if self._scalar is float else object


name_parts_after(MultibodyPlant, LeafSystem)
