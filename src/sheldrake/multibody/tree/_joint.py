"""What all joints have in common.

A joint says which coordinates it has, their limits and defaults, and how users read and write them. What it does to
bodies is a row of the `TreeModel`, computed by the kernels.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch
from sheldrake.common._scalars import frozen
from sheldrake.common.eigen_geometry import Quaternion
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialVelocity
from sheldrake.multibody.tree._element import NamedElement, finite, of_scalar, require_numbers, vector
from sheldrake.multibody.tree._frame import Frame
from sheldrake.multibody.tree._index import JointIndex
from sheldrake.multibody.tree._joint_types import JOINT_TYPES, JointType

if TYPE_CHECKING:
    from numpy.typing import ArrayLike
    from typing_extensions import Self

    from sheldrake.common._types import Scalars, Vector
    from sheldrake.multibody.tree._multibody_forces import MultibodyForces
    from sheldrake.multibody.tree._rigid_body import RigidBody
    from sheldrake.systems.framework import Context

_LIMITS = ("position", "velocity", "acceleration")


@functools.cache
def _no_limits(size: int) -> tuple[np.ndarray, np.ndarray]:
    """Limits that nothing reaches, read-only: all joints share them."""
    lower, upper = np.full(size, -np.inf), np.full(size, np.inf)
    lower.flags.writeable = upper.flags.writeable = False
    return lower, upper


def _number_of(call: str, array: np.ndarray) -> Any:
    require_numbers(call, [array])
    return array.item()


class Joint(NamedElement):
    """Connects a frame F on a parent body with a frame M on a child body."""

    _index_type = JointIndex
    kTypeName: ClassVar[str]
    _type: ClassVar[JointType]
    _axis: np.ndarray | None = None
    """What it turns about or slides along, a unit vector in F and in M, shape (3,); None without such an axis."""
    _classes: ClassVar[dict[str, type[Joint]]] = {}
    limits_changed: ClassVar[int] = 0
    """How often limits of any joint were changed: who keeps some has them as long as this stays."""

    def __init_subclass__(cls, **kwargs: object) -> None:
        super().__init_subclass__(**kwargs)
        name = vars(cls).get("kTypeName")
        if name is not None:
            cls._type = JOINT_TYPES[name]
            Joint._classes[name] = cls

    def __init__(self, name: str, frame_on_parent: Frame, frame_on_child: Frame, damping: Scalars = ()):
        """
        Args:
            name: Its name, unique in the model instance of the child.
            frame_on_parent: F.
            frame_on_child: M.
            damping: Viscous damping of each velocity, shape (nv,).
        """
        for argument, value in (("frame_on_parent", frame_on_parent), ("frame_on_child", frame_on_child)):
            if not isinstance(value, Frame):
                raise Mismatch(
                    f"{type(self).__name__}(): incompatible constructor arguments. {argument} must be a Frame, "
                    f"not {value!r}."
                )
        super().__init__(name, frame_on_child.model_instance())
        self._F, self._M = frame_on_parent, frame_on_child
        self._damping = self._checked_damping(damping)
        of_q, of_v = _no_limits(self.num_positions()), _no_limits(self.num_velocities())
        self._limits = {kind: of_q if kind == "position" else of_v for kind in _LIMITS}
        self._dry_friction = np.zeros(self.num_velocities())
        self._default_q = self._zero_positions()
        self._random_q: Any = None
        self._q_start = self._v_start = -1

    def _model(self) -> Self:
        """A joint of no plant that joins nothing, to be copied; this one is given up."""
        for values in (self._axis, self._damping, self._dry_friction, *sum(self._limits.values(), ())):
            if values is not None:
                values.setflags(write=False)  # copies share them
        self._F = self._M = self._instance = None  # type: ignore[assignment]
        return self

    def _between(self, F: Frame, M: Frame) -> Self:
        """A copy of a model, joining two frames."""
        new = object.__new__(type(self))
        new.__dict__.update(self.__dict__)
        new._F, new._M, new._instance = F, M, M._instance
        new._limits, new._default_q = dict(self._limits), self._default_q.copy()
        return new

    # --- what it is

    def type_name(self) -> str:
        """Its kind, such as "revolute"."""
        return self.kTypeName

    def parent_body(self) -> RigidBody:
        """The body of F."""
        return self._F.body()

    def child_body(self) -> RigidBody:
        """The body of M."""
        return self._M.body()

    def frame_on_parent(self) -> Frame:
        """F."""
        return self._F

    def frame_on_child(self) -> Frame:
        """M."""
        return self._M

    def num_positions(self) -> int:
        """Number of its positions."""
        return len(self._type.positions)

    def num_velocities(self) -> int:
        """Number of its velocities."""
        return len(self._type.velocities)

    def can_rotate(self) -> bool:
        """Whether M can turn in F."""
        return self._type.rotates

    def can_translate(self) -> bool:
        """Whether M's origin can move in F."""
        return self._type.translates

    def position_start(self) -> int:
        """Where its positions start in q.

        Raises:
            RuntimeError: before Finalize().
        """
        self._finalized("position_start")
        return self._q_start

    def velocity_start(self) -> int:
        """Where its velocities start in v.

        Raises:
            RuntimeError: before Finalize().
        """
        self._finalized("velocity_start")
        return self._v_start

    def position_suffix(self, position_index_in_joint: int) -> str:
        """What distinguishes the names of its positions."""
        return self._type.positions[position_index_in_joint]

    def velocity_suffix(self, velocity_index_in_joint: int) -> str:
        """What distinguishes the names of its velocities."""
        return self._type.velocities[velocity_index_in_joint]

    def _zero_positions(self) -> np.ndarray:
        return np.zeros(self.num_positions())

    def _constants(self) -> tuple[float, ...]:
        """What the kernels need: an axis and a lead, or a pose."""
        return ()

    def _reversed_constants(self) -> tuple[float, ...]:
        """The same when the child is the inboard body, of a type that is reversible."""
        raise NotImplementedError(f"A {self.kTypeName} joint has no reverse.")

    def _path_pieces(self) -> list[tuple[float, ...]]:
        """Pieces of the path of a joint that follows one, as rows for the kernels."""
        return []

    # --- limits

    def position_lower_limits(self) -> np.ndarray:
        """Lower limits of the positions, shape (nq,)."""
        return self._limits["position"][0].copy()

    def position_upper_limits(self) -> np.ndarray:
        """Upper limits of the positions, shape (nq,)."""
        return self._limits["position"][1].copy()

    def velocity_lower_limits(self) -> np.ndarray:
        """Lower limits of the velocities, shape (nv,). They are not enforced."""
        return self._limits["velocity"][0].copy()

    def velocity_upper_limits(self) -> np.ndarray:
        """Upper limits of the velocities, shape (nv,). They are not enforced."""
        return self._limits["velocity"][1].copy()

    def acceleration_lower_limits(self) -> np.ndarray:
        """Lower limits of the accelerations, shape (nv,). They are not enforced."""
        return self._limits["acceleration"][0].copy()

    def acceleration_upper_limits(self) -> np.ndarray:
        """Upper limits of the accelerations, shape (nv,). They are not enforced."""
        return self._limits["acceleration"][1].copy()

    @checked
    def set_position_limits(self, lower_limits: ArrayLike, upper_limits: ArrayLike) -> None:
        """Sets the limits of the positions; before Finalize(), if the discrete update is to enforce them."""
        self._set_limits("position", lower_limits, upper_limits)

    @checked
    def set_velocity_limits(self, lower_limits: ArrayLike, upper_limits: ArrayLike) -> None:
        """Sets the limits of the velocities."""
        self._set_limits("velocity", lower_limits, upper_limits)

    @checked
    def set_acceleration_limits(self, lower_limits: ArrayLike, upper_limits: ArrayLike) -> None:
        """Sets the limits of the accelerations."""
        self._set_limits("acceleration", lower_limits, upper_limits)

    def set_dry_friction(self, efforts: Scalars) -> None:
        """Gives the joint dry friction: it moves only against an effort of this size. Drake's joints have none.

        Discrete plants have it, with kLagged, kSimilar or kSap contact: a stuck joint creeps, some 1e-4 of the speed
        that it would gain in a step.

        Args:
            efforts: Largest friction of each velocity [N m or N], not negative, shape (num_velocities,) or one number.

        Raises:
            RuntimeError: after Finalize(), or an effort is negative or not finite.
        """
        if self._owner is not None:
            self._owner.elements.require_not_finalized("set_dry_friction")
        values = np.asarray(efforts, float) * np.ones(self.num_velocities())
        if not np.all((values >= 0.0) & np.isfinite(values)):
            raise RuntimeError(f"{type(self).__name__}.set_dry_friction(): joint {self._name!r}: found {efforts!r}.")
        self._dry_friction = values

    def dry_friction(self) -> np.ndarray:
        """Largest dry friction of each velocity [N m or N], shape (num_velocities,)."""
        return self._dry_friction.copy()

    def _set_limits(self, kind: str, lower: Scalars, upper: Scalars) -> None:
        call, size = f"set_{kind}_limits", len(self._limits[kind][0])
        lower, upper = np.array(lower, float).ravel(), np.array(upper, float).ravel()
        if lower.shape != (size,) or upper.shape != (size,):
            raise RuntimeError(
                f"{type(self).__name__}.{call}(): joint {self._name!r} takes limits of size {size}, "
                f"not {lower.size} and {upper.size}."
            )
        if not (lower <= upper).all():
            raise RuntimeError(
                f"{type(self).__name__}.{call}(): joint {self._name!r}: a lower limit exceeds its upper limit "
                f"(lower {lower}, upper {upper})."
            )
        lower.flags.writeable = upper.flags.writeable = False  # copies of the plant share them
        self._limits[kind] = (lower, upper)
        Joint.limits_changed += 1

    # --- damping

    def _checked_damping(self, damping: Scalars) -> np.ndarray:
        size = self.num_velocities()
        if (
            size == 1
            and type(damping) is list
            and len(damping) == 1
            and type(damping[0]) is float
            and damping[0] >= 0.0
        ):
            return np.array(damping)
        damping = np.ravel(np.asarray(damping, float))
        if damping.shape != (size,):
            raise RuntimeError(
                f"{type(self).__name__}: joint {self._name!r} takes {size} damping coefficients, not {damping.size}."
            )
        if not (damping >= 0.0).all():
            words = self.kTypeName.replace("_", " ").capitalize()
            raise RuntimeError(f"{words} joint damping must be nonnegative.")
        return damping

    def default_damping_vector(self) -> np.ndarray:
        """Damping of each velocity, shape (nv,), read-only."""
        return frozen(self._damping.copy())

    @checked
    def set_default_damping_vector(self, damping: ArrayLike) -> None:
        """Sets the damping of each velocity, before Finalize()."""
        if self._owner is not None:
            self._owner.elements.require_not_finalized("set_default_damping_vector")
        self._damping = self._checked_damping(damping)

    def GetDampingVector(self, context: Context) -> np.ndarray:
        """Damping of each velocity as the context has it, shape (nv,), read-only."""
        return frozen(np.array(self._finalized("GetDampingVector").contexts.numbers(context, self._group)))

    def SetDampingVector(self, context: Context, damping: Scalars) -> None:
        """Changes the damping in a context."""
        owner = self._finalized("SetDampingVector")
        damping = vector("SetDampingVector", "damping", damping, self.num_velocities())
        if damping.dtype != object:
            self._checked_damping(damping)
        owner.contexts.write_numbers(context, self._group, damping)

    @checked
    def AddInDamping(self, context: Context, forces: MultibodyForces) -> None:
        """Adds its damping forces to `forces`.

        Raises:
            RuntimeError: they are for another number of bodies or velocities.
        """
        tau = self._fitting("AddInDamping", forces)._tau
        contexts = self._finalized("AddInDamping").contexts
        damping, v = contexts.numbers(context, self._group), contexts.velocities(context)
        if len(damping) == 1:  # arrays of one number take five times as long
            tau[self._v_start] -= damping[0] * v[self._v_start]
        else:
            mine = slice(self._v_start, self._v_start + len(damping))
            tau[mine] -= damping * v[mine]

    @checked
    def AddInOneForce(self, context: Context, joint_dof: int, joint_tau: float, forces: MultibodyForces) -> None:
        """Adds a force or torque on one of its velocities to `forces`.

        Raises:
            RuntimeError: it has no such velocity, a velocity of its kind has no force of its own, or `forces` are for
                another number of bodies or velocities.
        """
        tau = self._fitting("AddInOneForce", forces).mutable_generalized_forces()
        if not self._type.v_is_qdot:
            raise RuntimeError(
                f"Joint.AddInOneForce(): {self.type_name()} joints do not allow applying forces to individual degrees "
                "of freedom."
            )
        if not 0 <= joint_dof < self.num_velocities():
            raise RuntimeError(
                f"Joint.AddInOneForce(): joint {self._name!r} has {self.num_velocities()} velocities, not {joint_dof}."
            )
        tau[self._v_start + joint_dof] += joint_tau

    # --- default positions

    def default_positions(self) -> np.ndarray:
        """Positions of a default context, shape (nq,)."""
        return self._default_q.copy()

    @checked
    def set_default_positions(self, default_positions: ArrayLike) -> None:
        """Sets the positions of a default context.

        Raises:
            RuntimeError: they are not as many as the joint has, or not finite.
        """
        size = self.num_positions()
        values = np.ravel(np.asarray(default_positions, float))
        if values.shape != (size,):
            raise RuntimeError(
                f"Joint.set_default_positions(): joint {self._name!r} has {size} positions, not {values.size}."
            )
        self._default_q = finite(f"Joint.set_default_positions of {self._name!r}", "default_positions", values.copy())

    def GetDefaultPose(self) -> RigidTransform:
        """X_FM at the default positions."""
        return self._pose_at(self._default_q)

    @checked
    def SetDefaultPose(self, X_FM: RigidTransform) -> None:
        """Sets the default positions that put M at X_FM.

        Raises:
            RuntimeError: this kind of joint has no way to choose positions for a pose.
        """
        self._default_q = np.asarray(self._positions_of_pose("SetDefaultPose", X_FM), float)

    def GetDefaultPosePair(self) -> tuple[Any, np.ndarray]:
        """X_FM at the default positions as (Quaternion, p_FM)."""
        X_FM = self.GetDefaultPose()
        return X_FM.rotation().ToQuaternion(), X_FM.translation()

    @checked
    def SetDefaultPosePair(self, q_FM: Quaternion, p_FM: Scalars) -> None:
        """Sets the default positions from a Quaternion and p_FM."""
        self.SetDefaultPose(RigidTransform(q_FM, p_FM))

    def _pose_at(self, q: np.ndarray) -> RigidTransform:
        raise NotImplementedError

    def _positions_of_pose(self, call: str, X_FM: RigidTransform) -> Vector:
        raise RuntimeError(f"The function {call}() has not been implemented for {self.kTypeName} joints.")

    @checked
    def SetPose(self, context: Context, X_FM: RigidTransform) -> Self:
        """Sets the positions that put M at X_FM."""
        return self._write_q(context, "SetPose", self._positions_of_pose("SetPose", X_FM))

    def GetPose(self, context: Context) -> RigidTransform:
        """X_FM."""
        return of_scalar(self._pose_at(self._q(context, "GetPose")), context._system._scalar)

    @checked
    def SetSpatialVelocity(self, context: Context, V_FM: SpatialVelocity) -> Self:
        """Sets the velocities that give M the spatial velocity V_FM, expressed in F."""
        return self._write_v(context, "SetSpatialVelocity", self._velocities_of(V_FM))

    def _velocities_of(self, V_FM: SpatialVelocity) -> Vector:
        raise RuntimeError(f"The function SetSpatialVelocity() has not been implemented for {self.kTypeName} joints.")

    # --- state in a context

    def GetPositions(self, context: Context) -> np.ndarray:
        """Its positions, shape (nq,)."""
        return self._q(context, "GetPositions")

    def SetPositions(self, context: Context, positions: Scalars) -> None:
        """Sets its positions."""
        self._write_q(context, "SetPositions", vector("SetPositions", "positions", positions, self.num_positions()))

    def GetVelocities(self, context: Context) -> np.ndarray:
        """Its velocities, shape (nv,)."""
        return self._velocities(context, "GetVelocities")

    def SetVelocities(self, context: Context, velocities: Scalars) -> None:
        """Sets its velocities."""
        self._write_v(
            context, "SetVelocities", vector("SetVelocities", "velocities", velocities, self.num_velocities())
        )

    def GetOnePosition(self, context: Context) -> float:
        """The position of a joint that has one."""
        self._require_one("GetOnePosition", self.num_positions())
        return self._one_q(context, "GetOnePosition")

    def GetOneVelocity(self, context: Context) -> float:
        """The velocity of a joint that has one."""
        self._require_one("GetOneVelocity", self.num_velocities())
        return self._one_v(context, "GetOneVelocity")

    def _require_one(self, call: str, number: int) -> None:
        if number != 1:
            raise RuntimeError(f"Joint.{call}(): joint {self._name!r} of type {self.kTypeName} has {number}, not one.")

    def _q(self, context: Context, call: str) -> np.ndarray:
        owner = self._finalized(call)
        return np.array(owner.contexts.positions(context)[self._q_start : self._q_start + self.num_positions()])

    def _one_q(self, context: Context, call: str) -> Any:
        """The first position."""
        return self._finalized(call).contexts.view(context).q.item(self._q_start)

    def _one_v(self, context: Context, call: str) -> Any:
        """The first velocity."""
        return self._finalized(call).contexts.view(context).v.item(self._v_start)

    def _velocities(self, context: Context, call: str) -> np.ndarray:
        owner = self._finalized(call)
        return np.array(owner.contexts.velocities(context)[self._v_start : self._v_start + self.num_velocities()])

    def _write_q(self, context: Context, call: str, values: Vector, at: int = 0) -> Self:
        contexts, start = self._finalized(call).contexts, self._q_start + at
        if not contexts.write(context, "q", start, values):
            require_numbers(f"{type(self).__name__}.{call}", values)
            finite(f"{type(self).__name__}.{call}", "the positions", values)
            contexts.write_positions(context, start, values)
        return self

    def _write_one_q(self, context: Context, call: str, value: Any, at: int = 0) -> Self:
        if type(value) is np.ndarray:
            value = _number_of(call, value)
        if self._finalized(call).contexts.write(context, "q", self._q_start + at, value):
            return self
        return self._write_q(context, call, [value], at)

    def _write_v(self, context: Context, call: str, values: Vector, at: int = 0) -> Self:
        contexts, start = self._finalized(call).contexts, self._v_start + at
        if not contexts.write(context, "v", start, values):
            require_numbers(f"{type(self).__name__}.{call}", values)
            finite(f"{type(self).__name__}.{call}", "the velocities", values)
            contexts.write_velocities(context, start, values)
        return self

    def _write_one_v(self, context: Context, call: str, value: Any, at: int = 0) -> Self:
        if type(value) is np.ndarray:
            value = _number_of(call, value)
        if self._finalized(call).contexts.write(context, "v", self._v_start + at, value):
            return self
        return self._write_v(context, call, [value], at)

    # --- locking

    def Lock(self, context: Context) -> None:
        """Locks it in a context: it keeps its positions and its velocities become zero."""
        owner = self._finalized("Lock")
        owner.contexts.set_locked(context, self, True)
        if self.num_velocities():
            owner.contexts.write_velocities(context, self._v_start, np.zeros(self.num_velocities()))

    def Unlock(self, context: Context) -> None:
        """Undoes Lock()."""
        self._finalized("Unlock").contexts.set_locked(context, self, False)

    def is_locked(self, context: Context) -> bool:
        """Whether it is locked in a context."""
        return self._finalized("is_locked").contexts.is_locked(context, self)
