"""A diagram that turns desired poses into positions for the drivers of a robot."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.multibody.inverse_kinematics._differential_system import DifferentialInverseKinematicsSystem
from sheldrake.planning import DofMask
from sheldrake.systems.framework import Diagram, DiagramBuilder
from sheldrake.systems.primitives import DiscreteTimeIntegrator, Selector, SelectorParams, WrapToSystem

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context


class _PositionIntegrator(DiscreteTimeIntegrator):
    """An integrator whose value is unknown until it is set."""

    def _set_default_context(self, context: Context) -> None:
        self.set_integral_value(context, np.full(self.get_output_port(0).size(), math.nan))


def _all_positions(active: DofMask) -> SelectorParams:
    """Positions of active dofs from input 0, of the others from input 1: the estimated state."""
    pick, place = SelectorParams.OutputSelection, active.GetFullToSelectedIndex()
    picks = [
        pick(input_port_index=1, input_offset=i) if k is None else pick(input_port_index=0, input_offset=k)
        for i, k in enumerate(place)
    ]
    sizes = (active.count(), 2 * active.size())
    return SelectorParams(
        inputs=[SelectorParams.InputPortParams(size=size) for size in sizes],
        outputs=[SelectorParams.OutputPortParams(selections=picks)],
    )


class DifferentialInverseKinematicsController(Diagram):
    """Integrates the velocities of a `DifferentialInverseKinematicsSystem` to positions that a robot can be sent.

    Input ports: `estimated_state` (positions and velocities of all dofs; those of passive dofs are used),
    `desired_poses` (BusValue of RigidTransform) and `nominal_posture`. Output ports: `commanded_position` and
    `commanded_velocity` of the active dofs. The integral starts as nan: see `set_initial_position`.

    Args:
        differential_inverse_kinematics: The system; it becomes a part of this diagram.
        planar_rotation_dof_indices: Which commanded positions are wrapped to +-pi.
    """

    def __init__(
        self,
        differential_inverse_kinematics: DifferentialInverseKinematicsSystem,
        planar_rotation_dof_indices: list[int],
    ):
        Diagram.__init__(self)
        ik = self._ik = differential_inverse_kinematics
        builder = DiagramBuilder()
        builder.AddSystem(ik)
        active, n = ik.active_dof(), ik.active_dof().count()
        self._integrator = builder.AddSystem(_PositionIntegrator(n, ik.time_step()))
        merge = builder.AddSystem(Selector(_all_positions(active)))
        wrap = builder.AddSystem(WrapToSystem(n))
        for index in planar_rotation_dof_indices:
            wrap.set_interval(index, -math.pi, math.pi)
        builder.Connect(ik.get_output_port_commanded_velocity(), self._integrator.get_input_port(0))
        builder.Connect(self._integrator.get_output_port(0), merge.get_input_port(0))
        builder.Connect(merge.get_output_port(0), ik.get_input_port_position())
        builder.Connect(self._integrator.get_output_port(0), wrap.get_input_port(0))
        builder.ExportInput(merge.get_input_port(1), "estimated_state")
        builder.ExportInput(ik.get_input_port_desired_cartesian_poses(), "desired_poses")
        builder.ExportInput(ik.get_input_port_nominal_posture(), "nominal_posture")
        builder.ExportOutput(wrap.get_output_port(0), "commanded_position")
        builder.ExportOutput(ik.get_output_port_commanded_velocity(), "commanded_velocity")
        builder.BuildInto(self)

    def differential_inverse_kinematics(self) -> DifferentialInverseKinematicsSystem:
        """Returns the system that finds velocities."""
        return self._ik

    def get_mutable_differential_inverse_kinematics(self) -> DifferentialInverseKinematicsSystem:
        """Returns the system that finds velocities, to be changed."""
        return self._ik

    def set_initial_position(self, context: Context, value: Any) -> None:
        """Sets the positions to start from.

        Args:
            context: This diagram's context.
            value: Positions of all dofs, shape (nq,); those of passive dofs are not used.

        Raises:
            RuntimeError: the size is another.
        """
        q, active = np.array(value, dtype=float).ravel(), self._ik.active_dof()
        if q.size != active.size():
            raise RuntimeError(f"set_initial_position(): expected {active.size()} positions, got {q.size}.")
        mine = self._integrator.GetMyMutableContextFromRoot(context)
        self._integrator.set_integral_value(mine, q[active.GetSelectedToFullIndex()])
