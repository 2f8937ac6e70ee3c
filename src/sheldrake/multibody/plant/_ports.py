"""The ports of a plant: state, poses, velocities, accelerations, forces; actuation and applied forces."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.common.value import AbstractValue, Value
from sheldrake.geometry import FramePoseVector, GeometryConfigurationVector, QueryObject
from sheldrake.math import RigidTransform_
from sheldrake.multibody.math import SpatialAcceleration_, SpatialForce_, SpatialVelocity_
from sheldrake.multibody.plant._contact.results import ContactResults
from sheldrake.multibody.plant._kernels.ports import select_continuous_state, select_discrete_state
from sheldrake.multibody.plant._step.applied_forces import ExternallyAppliedSpatialForce
from sheldrake.multibody.tree import ModelInstanceIndex

_OF_VELOCITIES = {
    "generalized_acceleration": "{}_dot [rad/s^2 or m/s^2]",
    "generalized_contact_forces": "{}_force [N m or N]",
}
"""Ports with an element for each generalized velocity, and what to call the elements."""


class Ports:
    """Declaring ports and computing their values."""

    def _declare_geometry_ports(self) -> None:
        """Those that exist before Finalize(), so that a SceneGraph can be connected."""
        self.DeclareAbstractInputPort("geometry_query", Value[QueryObject]())
        self.DeclareAbstractOutputPort(
            "geometry_pose",
            lambda: AbstractValue.Make(FramePoseVector()),
            self._calc_geometry_pose,
            self._geometry_tickets(),
        )
        self.DeclareAbstractOutputPort(
            "deformable_body_configuration",
            lambda: AbstractValue.Make(GeometryConfigurationVector()),
            lambda context, value: None,
            {self.nothing_ticket()},
        )

    def _geometry_tickets(self) -> set[Any]:
        state = self.xd_ticket() if self._time_step > 0 else self.xc_ticket()
        return {state, self.all_parameters_ticket()}

    def _declare_input_ports(self) -> None:
        self._port_numbers: dict[Any, int] = {}

        def vector_port(key: Any, name: str, size: int) -> None:
            self._port_numbers[key] = int(self.DeclareVectorInputPort(name, size).get_index())
            self._inputs[self._port_numbers[key]].optional = True

        vector_port("actuation", "actuation", self._nu)
        vector_port("generalized_force", "applied_generalized_force", self._nv)
        port = self.DeclareAbstractInputPort(
            "applied_spatial_force", AbstractValue.Make([ExternallyAppliedSpatialForce()])
        )
        self._port_numbers["spatial_force"] = int(port.get_index())
        for i, instance in enumerate(self._instances):
            n = sum(a.num_inputs() for a in self._actuators.of_instance(ModelInstanceIndex(i)))
            vector_port(("actuation", i), f"{instance.name()}_actuation", n)
            vector_port(("desired_state", i), f"{instance.name()}_desired_state", 2 * n)

    def _declare_output_ports(self, state_index: Any) -> None:
        kinematics, sampled = self._geometry_tickets(), self._step_tickets()
        number = self._port_numbers
        all_instances: list[Any] = [None, *range(len(self._instances.slots))]

        def keep(key: Any, port: Any) -> None:
            number["out", key] = int(port.get_index())

        keep("state", self.DeclareStateOutputPort("state", state_index))
        keep(
            "body_poses",
            self.DeclareAbstractOutputPort("body_poses", self._new_poses, self._calc_body_poses, kinematics),
        )
        keep(
            "body_spatial_velocities",
            self.DeclareAbstractOutputPort(
                "body_spatial_velocities", self._new_velocities, self._calc_body_velocities, kinematics
            ),
        )
        keep(
            "body_spatial_accelerations",
            self.DeclareAbstractOutputPort(
                "body_spatial_accelerations", self._new_accelerations, self._calc_body_accelerations, sampled
            ),
        )
        self._declare_vectors(None, "generalized_acceleration", self._nv, sampled)
        self._declare_vectors(None, "net_actuation", self._nu, sampled)
        keep(
            "reaction_forces",
            self.DeclareAbstractOutputPort("reaction_forces", self._new_forces, self._calc_reactions, sampled),
        )
        keep(
            "contact_results",
            self.DeclareAbstractOutputPort(
                "contact_results", lambda: AbstractValue.Make(ContactResults()), self._calc_contact_results, sampled
            ),
        )
        for i in all_instances[1:]:
            instance = ModelInstanceIndex(i)
            self._declare_instance_state(instance, kinematics, number)
            nv, nu = self.num_velocities(instance), self.num_actuated_dofs(instance)
            self._declare_vectors(instance, "generalized_acceleration", nv, sampled)
            self._declare_vectors(instance, "generalized_contact_forces", nv, sampled)
            self._declare_vectors(instance, "net_actuation", nu, sampled)

    # Values to compute into: methods, so that a plant on another scalar makes values of its own scalar.

    def _new_poses(self) -> AbstractValue:
        return AbstractValue.Make([RigidTransform_[self._scalar]()] * len(self._rows))

    def _new_velocities(self) -> AbstractValue:
        return AbstractValue.Make([SpatialVelocity_[self._scalar](np.zeros(6))] * len(self._rows))

    def _new_accelerations(self) -> AbstractValue:
        return AbstractValue.Make([SpatialAcceleration_[self._scalar](np.zeros(6))] * len(self._rows))

    def _new_forces(self) -> AbstractValue:
        return AbstractValue.Make([SpatialForce_[self._scalar](np.zeros(6))] * max(1, len(self._joints)))

    def _declare_vectors(self, instance: Any, what: str, size: int, tickets: set[Any]) -> None:
        """An output port with the part of a vector of the whole plant that belongs to a model instance."""
        if instance is None:
            name, at = what, np.arange(size)
        else:
            name = f"{self.GetModelInstanceName(instance)}_{what}"
            pick = self._input_indices if what == "net_actuation" else lambda call, i: self._indices(call, i, "v")
            at = pick(what, instance)
        calc = {
            "generalized_acceleration": self._step_vdot,
            "generalized_contact_forces": self._generalized_contact_forces,
            "net_actuation": self._net_actuation,
        }[what]

        def fill(context: Any, vector: Any) -> None:
            vector.SetFromVector(calc(context)[at])

        port = self.DeclareVectorOutputPort(name, size, fill, tickets)
        self._port_numbers["out", (what, None if instance is None else int(instance))] = int(port.get_index())

    def _declare_instance_state(self, instance: ModelInstanceIndex, tickets: set[Any], number: dict) -> None:
        name = f"{self.GetModelInstanceName(instance)}_state"
        q, v = self._indices(name, instance, "q"), self._indices(name, instance, "v")
        at = np.concatenate([q, self._nq + v]).astype(np.int64)
        if len(at) == self._nq + self._nv:
            port = self.DeclareStateOutputPort(name, self._state_index)
        else:
            kernel = select_discrete_state if self.is_discrete() else select_continuous_state
            port = self.DeclareVectorOutputPort(name, len(at), kernel, tickets)
            self._output_models[int(port.get_index())] = {"select_model": at}
        number["out", ("state", int(instance))] = int(port.get_index())

    def _output_names(self, j: int) -> list[str] | None:
        """Names of the elements of a vector port, with units where the names do not tell, for logs; None for others."""
        for key, number in self._port_numbers.items():
            if number == j and isinstance(key, tuple) and key[0] == "out":
                what, instance = key[1] if isinstance(key[1], tuple) else (key[1], None)
                if what == "state":
                    return (
                        self.GetStateNames() if instance is None else self.GetStateNames(ModelInstanceIndex(instance))
                    )
                if what == "net_actuation":
                    return self._actuation_names(instance)
                if what in _OF_VELOCITIES:
                    given = () if instance is None else (ModelInstanceIndex(instance),)
                    return [_OF_VELOCITIES[what].format(name) for name in self.GetVelocityNames(*given)]
        return None

    def _actuation_names(self, instance: Any) -> list[str]:
        names = []
        for index in self.GetJointActuatorIndices(*(() if instance is None else (ModelInstanceIndex(instance),))):
            actuator = self.get_joint_actuator(index)
            unit = "N" if actuator.joint().type_name() == "prismatic" else "N m"
            names.append(f"{actuator.name()} [{unit}]")
        return names

    # --- values

    def _calc_geometry_pose(self, context: Any, value: AbstractValue) -> None:
        poses = value.get_mutable_value()
        poses.clear()
        if self._finalized:
            X_WB = self._view(context).positions().X_WB
            if X_WB.dtype == float:
                if self._pose_rows is None:
                    frames = {frame: self._rows[i] for i, frame in self._frame_of_body.items() if i}
                    self._pose_rows = tuple(frames), np.array(list(frames.values()), dtype=np.int64)
                ids, rows = self._pose_rows
                poses._set_rows(ids, X_WB[rows])
                return
            for index, frame_id in self._frame_of_body.items():
                if index:
                    poses.set_value(frame_id, self._transform(context, X_WB[self._rows[index]]))

    def _calc_body_poses(self, context: Any, value: AbstractValue) -> None:
        X_WB = self._view(context).positions().X_WB
        value.set_value([self._transform(context, X_WB[row]) for row in self._rows])

    def _calc_body_velocities(self, context: Any, value: AbstractValue) -> None:
        V, T = self._body_velocities(context), self._view(context).of(SpatialVelocity_)._make
        value.set_value([T(V[row].copy()) for row in self._rows])

    def _calc_body_accelerations(self, context: Any, value: AbstractValue) -> None:
        A, T = self._step_accelerations(context), self._view(context).of(SpatialAcceleration_)._make
        value.set_value([T(A[row].copy()) for row in self._rows])

    def _calc_contact_results(self, context: Any, value: AbstractValue) -> None:
        value.set_value(self._contact_results(context))

    def _calc_reactions(self, context: Any, value: AbstractValue) -> None:
        value.set_value(self._reaction_forces(context))

    # --- getters

    def _port(self, call: str, key: Any, output: bool) -> Any:
        self._require_finalized(call)
        if output:
            return self.get_output_port(self._port_numbers["out", key])
        return self.get_input_port(self._port_numbers[key])

    def _instance_key(self, call: str, what: str, model_instance: Any) -> Any:
        self._require_finalized(call)
        if model_instance is not None:
            self._instances.get(model_instance, call)
        return what, None if model_instance is None else int(model_instance)

    def get_geometry_query_input_port(self) -> Any:
        """Input: the QueryObject of a SceneGraph."""
        return self.get_input_port(0)

    def get_geometry_pose_output_port(self) -> Any:
        """Output: poses of the bodies, for a SceneGraph."""
        return self.get_output_port(0)

    def get_deformable_body_configuration_output_port(self) -> Any:
        """Output: nothing, there are no deformable bodies."""
        return self.get_output_port(1)

    def get_actuation_input_port(self, model_instance: ModelInstanceIndex | None = None) -> Any:
        """Input: efforts of all actuators, or of those of one model instance [N m or N]."""
        call = "get_actuation_input_port"
        what, i = self._instance_key(call, "actuation", model_instance)
        return self._port(call, what if i is None else (what, i), False)

    def get_desired_state_input_port(self, model_instance: ModelInstanceIndex) -> Any:
        """Input: desired positions, then velocities, of a model instance's actuators, for their controllers."""
        call = "get_desired_state_input_port"
        return self._port(call, self._instance_key(call, "desired_state", model_instance), False)

    def get_applied_generalized_force_input_port(self) -> Any:
        """Input: generalized forces [N or N m], shape (nv,)."""
        return self._port("get_applied_generalized_force_input_port", "generalized_force", False)

    def get_applied_spatial_force_input_port(self) -> Any:
        """Input: a list of ExternallyAppliedSpatialForce."""
        return self._port("get_applied_spatial_force_input_port", "spatial_force", False)

    def get_state_output_port(self, model_instance: ModelInstanceIndex | None = None) -> Any:
        """Output: positions, then velocities, of all or of one model instance."""
        call = "get_state_output_port"
        what, i = self._instance_key(call, "state", model_instance)
        return self._port(call, what if i is None else (what, i), True)

    def get_body_poses_output_port(self) -> Any:
        """Output: a list of X_WB, by body."""
        return self._port("get_body_poses_output_port", "body_poses", True)

    def get_body_spatial_velocities_output_port(self) -> Any:
        """Output: a list of V_WB, by body."""
        return self._port("get_body_spatial_velocities_output_port", "body_spatial_velocities", True)

    def get_body_spatial_accelerations_output_port(self) -> Any:
        """Output: a list of A_WB, by body."""
        return self._port("get_body_spatial_accelerations_output_port", "body_spatial_accelerations", True)

    def get_generalized_acceleration_output_port(self, model_instance: ModelInstanceIndex | None = None) -> Any:
        """Output: vdot of all or of one model instance."""
        call = "get_generalized_acceleration_output_port"
        return self._port(call, self._instance_key(call, "generalized_acceleration", model_instance), True)

    def get_generalized_contact_forces_output_port(self, model_instance: ModelInstanceIndex) -> Any:
        """Output: generalized contact forces of one model instance [N or N m]."""
        call = "get_generalized_contact_forces_output_port"
        return self._port(call, self._instance_key(call, "generalized_contact_forces", model_instance), True)

    def get_net_actuation_output_port(self, model_instance: ModelInstanceIndex | None = None) -> Any:
        """Output: efforts that actuators exert, limits and controllers considered, of all or of one model instance."""
        call = "get_net_actuation_output_port"
        return self._port(call, self._instance_key(call, "net_actuation", model_instance), True)

    def get_reaction_forces_output_port(self) -> Any:
        """Output: a list of F_CJc_Jc, the spatial force on each joint's child at its frame M, expressed in M."""
        return self._port("get_reaction_forces_output_port", "reaction_forces", True)

    def get_contact_results_output_port(self) -> Any:
        """Output: ContactResults."""
        return self._port("get_contact_results_output_port", "contact_results", True)
