"""What an element asks of what it belongs to: the parts of a plant, which this package does not know."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from sheldrake.multibody.tree._kernels.forces import ForceModel


class Membership(Protocol):
    """The elements of a plant, and when they may change."""

    def require_finalized(self, call: str) -> None:
        """Raises RuntimeError before Finalize()."""

    def require_not_finalized(self, call: str) -> None:
        """Raises RuntimeError after Finalize()."""

    def is_floating_base(self, body: Any) -> bool:
        """Whether Finalize() gave the body its floating joint."""

    def has_quaternion(self, body: Any) -> bool:
        """Whether the body hangs on a joint with a quaternion."""

    def inboard_joint(self, body: Any) -> Any:
        """The joint by which a body hangs in the forest."""

    def row_of(self, body: Any) -> int:
        """The row of a body in the kernels' arrays."""

    def forces_of(self, element: Any) -> ForceModel:
        """One force element as arrays."""


class ContextNumbers(Protocol):
    """Reading and writing contexts; all arrays are what the context holds, in the context's scalar type."""

    def view(self, context: Any) -> Any:
        """The context as arrays, with the workspaces of the tree's kernels."""

    def positions(self, context: Any) -> np.ndarray:
        """All q, to be read only."""

    def velocities(self, context: Any) -> np.ndarray:
        """All v, to be read only."""

    def write_positions(self, context: Any, start: int, values: Any) -> None:
        """Sets positions from number `start` on."""

    def write_velocities(self, context: Any, start: int, values: Any) -> None:
        """Sets velocities from number `start` on."""

    def numbers(self, context: Any, group: int) -> np.ndarray:
        """A group of numeric parameters."""

    def write_numbers(self, context: Any, group: int, values: Any) -> None:
        """Sets a group of numeric parameters."""

    def is_locked(self, context: Any, joint: Any) -> bool:
        """Whether a joint is locked."""

    def set_locked(self, context: Any, joint: Any, locked: bool) -> None:
        """Locks or unlocks a joint."""

    def transform(self, context: Any, numbers: Any) -> Any:
        """A RigidTransform of twelve numbers."""

    def spatial_inertia(self, context: Any, numbers: Any) -> Any:
        """A SpatialInertia of ten numbers."""


class FrameMotions(Protocol):
    """Where frames are and how they move."""

    def pose_of_frame(self, context: Any, frame: Any) -> Any:
        """X_WF."""

    def velocity_of_frame(self, context: Any, frame: Any) -> Any:
        """V_WF."""

    def CalcRelativeTransform(self, context: Any, frame_A: Any, frame_B: Any) -> Any:
        """X_AB."""


class FrameAccelerations(Protocol):
    """How frames accelerate."""

    def of_frame(self, context: Any, frame: Any) -> Any:
        """A_WF."""

    def of_frame_in(self, context: Any, frame: Any, measured_in: Any) -> Any:
        """A_MF, expressed in W."""


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

    def actuator_changed(self, actuator: Any) -> None:
        """An actuator has another effort limit or other gains."""
