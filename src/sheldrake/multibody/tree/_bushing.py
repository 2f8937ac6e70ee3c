"""Door hinges and bushings.

Force elements with several terms: parameters here, forces in `_kernels/forces.py`.
"""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._options import Options
from sheldrake.multibody.math import SpatialForce_
from sheldrake.multibody.tree._element import nonnegative, vector
from sheldrake.multibody.tree._force_element import ForceElement, JointElement
from sheldrake.multibody.tree._frame import Frame
from sheldrake.multibody.tree._joints_axis import RevoluteJoint
from sheldrake.multibody.tree._kernels import forces

if TYPE_CHECKING:
    from sheldrake.common._types import Scalars
    from sheldrake.multibody.math import SpatialForce
    from sheldrake.multibody.tree._rigid_body import RigidBody
    from sheldrake.systems.framework import Context


class DoorHingeConfig(Options):
    """Numbers of a door hinge.

    Attributes:
        spring_zero_angle_rad: Angle without spring torque [rad].
        spring_constant: [N m/rad].
        dynamic_friction_torque: [N m].
        static_friction_torque: On top of the dynamic one, near rest [N m].
        viscous_friction: [N m s/rad].
        catch_width: Angle from the closed door over which the catch acts [rad].
        catch_torque: About the largest torque of the catch [N m].
        motion_threshold: Rate below which friction counts as static [rad/s].
    """

    spring_zero_angle_rad: float = -1.5
    spring_constant: float = 1.5
    dynamic_friction_torque: float = 3.0
    static_friction_torque: float = 2.0
    viscous_friction: float = 1.0
    catch_width: float = 0.02
    catch_torque: float = 15.0
    motion_threshold: float = 0.001


class DoorHinge(JointElement):
    """A revolute joint's spring, catch and friction, as of a dishwasher's door."""

    _joint_type = RevoluteJoint

    @checked
    def __init__(self, joint: RevoluteJoint, config: DoorHingeConfig):
        super().__init__(joint)
        _, *others = config._defaults  # any angle will do
        nonnegative("DoorHinge", **{name: getattr(config, name) for name in others})
        self._config = copy.copy(config)

    def config(self) -> DoorHingeConfig:
        """Its numbers."""
        return copy.copy(self._config)

    def _defaults(self) -> list[float]:
        c = self._config
        return [
            c.spring_constant, c.spring_zero_angle_rad, c.catch_torque, c.catch_width, c.dynamic_friction_torque,
            c.static_friction_torque, c.viscous_friction, c.motion_threshold,
        ]  # fmt: skip

    @checked
    def CalcHingeTorque(self, angle: float, angular_rate: float) -> float:
        """All of its torque at an angle [rad] and rate [rad/s], [N m]."""
        return forces.hinge_torque(self._defaults(), 0, angle, angular_rate)

    @checked
    def CalcHingeSpringTorque(self, angle: float) -> float:
        """Torque of spring and catch at an angle [rad], [N m]."""
        return self.CalcHingeTorque(angle, 0.0)

    @checked
    def CalcHingeFrictionalTorque(self, angular_rate: float) -> float:
        """Torque of friction at a rate [rad/s], [N m]."""
        numbers = self._defaults()
        numbers[0] = numbers[2] = 0.0
        return forces.hinge_torque(numbers, 0, 0.0, angular_rate)


@checked
class LinearBushingRollPitchYaw(ForceElement):
    """Springs and dampers between frames A and C for all six relative motions."""

    def __init__(
        self,
        frameA: Frame,
        frameC: Frame,
        torque_stiffness_constants: Scalars,
        torque_damping_constants: Scalars,
        force_stiffness_constants: Scalars,
        force_damping_constants: Scalars,
    ):
        """
        Args:
            frameA: A.
            frameC: C.
            torque_stiffness_constants: Of roll, pitch, yaw of R_AC [N m/rad], shape (3,).
            torque_damping_constants: Of their rates [N m s/rad], shape (3,).
            force_stiffness_constants: Of Co's position from Ao, in the frame halfway from A to C [N/m], shape (3,).
            force_damping_constants: Of its rates [N s/m], shape (3,).
        """
        super().__init__(frameC.model_instance())
        self._A, self._C = frameA, frameC
        self._constants = np.concatenate(
            [
                vector("LinearBushingRollPitchYaw", name, value, 3)
                for name, value in (
                    ("torque_stiffness_constants", torque_stiffness_constants),
                    ("torque_damping_constants", torque_damping_constants),
                    ("force_stiffness_constants", force_stiffness_constants),
                    ("force_damping_constants", force_damping_constants),
                )
            ]
        )
        if not np.all(self._constants >= 0.0):
            raise RuntimeError("LinearBushingRollPitchYaw(): all constants must be nonnegative.")

    def _defaults(self) -> list[float]:
        return list(self._constants)

    def _parts(self) -> tuple[Any, ...]:
        return (self._A, self._C)

    def frameA(self) -> Frame:
        """A."""
        return self._A

    def frameC(self) -> Frame:
        """C."""
        return self._C

    def link0(self) -> RigidBody:
        """Body of A."""
        return self._A.body()

    def link1(self) -> RigidBody:
        """Body of C."""
        return self._C.body()

    def torque_stiffness_constants(self) -> np.ndarray:
        """Default stiffness of roll, pitch, yaw [N m/rad], shape (3,)."""
        return self._constants[0:3].copy()

    def torque_damping_constants(self) -> np.ndarray:
        """Default damping of roll, pitch, yaw [N m s/rad], shape (3,)."""
        return self._constants[3:6].copy()

    def force_stiffness_constants(self) -> np.ndarray:
        """Default stiffness of x, y, z [N/m], shape (3,)."""
        return self._constants[6:9].copy()

    def force_damping_constants(self) -> np.ndarray:
        """Default damping of x, y, z [N s/m], shape (3,)."""
        return self._constants[9:12].copy()

    def _get(self, context: Context, call: str, at: int) -> np.ndarray:
        return np.array(self._finalized(call).contexts.numbers(context, self._group)[at : at + 3])

    def _set(self, context: Context, call: str, at: int, values: Scalars) -> None:
        owner = self._finalized(call)
        numbers = np.array(owner.contexts.numbers(context, self._group))
        numbers[at : at + 3] = vector(call, "the constants", values, 3)
        owner.contexts.write_numbers(context, self._group, numbers)

    def GetTorqueStiffnessConstants(self, context: Context) -> np.ndarray:
        """Stiffness of roll, pitch, yaw as the context has it [N m/rad], shape (3,)."""
        return self._get(context, "GetTorqueStiffnessConstants", 0)

    def GetTorqueDampingConstants(self, context: Context) -> np.ndarray:
        """Damping of roll, pitch, yaw as the context has it [N m s/rad], shape (3,)."""
        return self._get(context, "GetTorqueDampingConstants", 3)

    def GetForceStiffnessConstants(self, context: Context) -> np.ndarray:
        """Stiffness of x, y, z as the context has it [N/m], shape (3,)."""
        return self._get(context, "GetForceStiffnessConstants", 6)

    def GetForceDampingConstants(self, context: Context) -> np.ndarray:
        """Damping of x, y, z as the context has it [N s/m], shape (3,)."""
        return self._get(context, "GetForceDampingConstants", 9)

    def SetTorqueStiffnessConstants(self, context: Context, torque_stiffness: Scalars) -> None:
        """Changes the stiffness of roll, pitch, yaw in a context [N m/rad]."""
        self._set(context, "SetTorqueStiffnessConstants", 0, torque_stiffness)

    def SetTorqueDampingConstants(self, context: Context, torque_damping: Scalars) -> None:
        """Changes the damping of roll, pitch, yaw in a context [N m s/rad]."""
        self._set(context, "SetTorqueDampingConstants", 3, torque_damping)

    def SetForceStiffnessConstants(self, context: Context, force_stiffness: Scalars) -> None:
        """Changes the stiffness of x, y, z in a context [N/m]."""
        self._set(context, "SetForceStiffnessConstants", 6, force_stiffness)

    def SetForceDampingConstants(self, context: Context, force_damping: Scalars) -> None:
        """Changes the damping of x, y, z in a context [N s/m]."""
        self._set(context, "SetForceDampingConstants", 9, force_damping)

    def _force_on(self, context: Context, call: str, frame: Frame) -> SpatialForce:
        """Spatial force on a body of the bushing at the origin of its frame, expressed in that frame."""
        owner = self._finalized(call)
        view = owner.contexts.view(context)
        work = view.velocities()
        one = owner.elements.forces_of(self)
        F = view.zeros(len(work.F), 6)
        forces.add_bushings(view.model, one, view.p, work, F)
        row = owner.elements.row_of(frame.body())
        X_WF = frame.CalcPoseInWorld(context)
        root = np.array(work[view.model.bodies[row].root].p_WB)
        torque = F[row, :3] + np.cross(root - X_WF.translation(), F[row, 3:])
        R_FW = X_WF.rotation().matrix().T
        return view.of(SpatialForce_)(R_FW @ torque, R_FW @ F[row, 3:])

    def CalcBushingSpatialForceOnFrameA(self, context: Context) -> SpatialForce:
        """The bushing's spatial force on A at Ao, expressed in A."""
        return self._force_on(context, "CalcBushingSpatialForceOnFrameA", self._A)

    def CalcBushingSpatialForceOnFrameC(self, context: Context) -> SpatialForce:
        """The bushing's spatial force on C at Co, expressed in C."""
        return self._force_on(context, "CalcBushingSpatialForceOnFrameC", self._C)
