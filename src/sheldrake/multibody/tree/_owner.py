"""What an element asks of what it belongs to: the parts of a plant, which this package does not know."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from sheldrake.multibody.tree._kernels.forces import ForceModel

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.common._types import Vector
    from sheldrake.math import RigidTransform
    from sheldrake.multibody.math import SpatialAcceleration, SpatialInertia, SpatialVelocity
    from sheldrake.multibody.tree._force_element import ForceElement
    from sheldrake.multibody.tree._frame import Frame
    from sheldrake.multibody.tree._joint import Joint
    from sheldrake.multibody.tree._joint_actuator import JointActuator
    from sheldrake.multibody.tree._rigid_body import RigidBody
    from sheldrake.systems.framework import Context


class Membership(Protocol):
    """The elements of a plant, and when they may change."""

    def model(self, call: str) -> Any:
        """What Finalize() made, with sizes and order; RuntimeError before."""

    def require_finalized(self, call: str) -> None:
        """Raises RuntimeError before Finalize()."""

    def require_not_finalized(self, call: str) -> None:
        """Raises RuntimeError after Finalize()."""

    def is_floating_base(self, body: RigidBody) -> bool:
        """Whether Finalize() gave the body its floating joint."""

    def has_quaternion(self, body: RigidBody) -> bool:
        """Whether the body hangs on a joint with a quaternion."""

    def inboard_joint(self, body: RigidBody) -> Joint:
        """The joint by which a body hangs in the forest."""

    def row_of(self, body: RigidBody) -> int:
        """The row of a body in the kernels' arrays."""

    def forces_of(self, element: ForceElement) -> ForceModel:
        """One force element as arrays."""


class ContextNumbers(Protocol):
    """Reading and writing contexts; all arrays are what the context holds, in the context's scalar type."""

    def view(self, context: Context) -> Any:
        """The context as arrays, with the workspaces of the tree's kernels."""

    def positions(self, context: Context) -> np.ndarray:
        """All q, to be read only."""

    def velocities(self, context: Context) -> np.ndarray:
        """All v, to be read only."""

    def write(self, context: Context, part: str, start: int, values: Any, *more: Any) -> bool:
        """Sets positions, velocities or a pose if they are finite floats; whether it did."""

    def write_positions(self, context: Context, start: int, values: Vector) -> None:
        """Sets positions from number `start` on."""

    def write_velocities(self, context: Context, start: int, values: Vector) -> None:
        """Sets velocities from number `start` on."""

    def numbers(self, context: Context, group: int) -> np.ndarray:
        """A group of numeric parameters."""

    def write_numbers(self, context: Context, group: int, values: ArrayLike) -> None:
        """Sets a group of numeric parameters."""

    def is_locked(self, context: Context, joint: Joint) -> bool:
        """Whether a joint is locked."""

    def set_locked(self, context: Context, joint: Joint, locked: bool) -> None:
        """Locks or unlocks a joint."""

    def transform(self, context: Context, numbers: np.ndarray) -> RigidTransform:
        """A RigidTransform of twelve numbers."""

    def spatial_inertia(self, context: Context, group: int) -> SpatialInertia:
        """The SpatialInertia that a group of ten parameters says."""


class FrameMotions(Protocol):
    """Where frames are and how they move."""

    @property
    def world_frame(self) -> Frame:
        """The frame W."""

    def pose_of_frame(self, context: Context, frame: Frame) -> RigidTransform:
        """X_WF."""

    def velocity_of_frame(self, context: Context, frame: Frame) -> SpatialVelocity:
        """V_WF."""

    def relative_velocity(self, context: Context, frame_B: Frame, frame_A: Frame, frame_E: Frame) -> SpatialVelocity:
        """V_AB, expressed in E."""

    def velocity_of_point(self, context: Context, frame: Frame, p_FQ: np.ndarray) -> np.ndarray:
        """v_WQ of a point of a frame."""

    def CalcRelativeTransform(self, context: Context, frame_A: Frame, frame_B: Frame) -> Any:
        """X_AB."""


class FrameAccelerations(Protocol):
    """How frames accelerate."""

    def of_point(
        self,
        context: Context,
        point: np.ndarray,
        frame_B: Frame,
        frame_A: Frame | None = None,
        frame_E: Frame | None = None,
    ) -> SpatialAcceleration:
        """Of a point of frame B, measured in A, expressed in E; both are the world's when left out."""


class Owner(Protocol):
    """The parts of a plant that its elements know."""

    plant: Any
    """The MultibodyPlant."""
    family: object
    """The same for copies of a plant on other scalars, whose elements serve each other."""

    @property
    def elements(self) -> Membership:
        """Which elements there are."""

    @property
    def contexts(self) -> ContextNumbers:
        """Reading and writing contexts."""

    @property
    def kinematics(self) -> FrameMotions:
        """Poses and velocities."""

    @property
    def accelerations(self) -> FrameAccelerations:
        """Accelerations."""

    def gravity_changed(self) -> None:
        """Gravity has another vector."""

    def actuator_changed(self, actuator: JointActuator) -> None:
        """An actuator has another effort limit or other gains."""
