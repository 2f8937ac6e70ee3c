"""Bodies.

A name, a frame and a default spatial inertia. Poses and velocities belong to contexts, and are asked of the plant's
view.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch
from sheldrake.common._scalars import frozen
from sheldrake.common.deprecation import _warn_of_retired
from sheldrake.multibody.math import RotationalInertia, SpatialForce, SpatialForce_, SpatialInertia, UnitInertia
from sheldrake.multibody.tree._element import NamedElement, vector
from sheldrake.multibody.tree._frame import Frame, RigidBodyFrame
from sheldrake.multibody.tree._index import BodyIndex, ModelInstanceIndex, default_model_instance
from sheldrake.multibody.tree._multibody_forces import MultibodyForces
from sheldrake.systems.framework._vector import lifted

if TYPE_CHECKING:
    from sheldrake.common._types import Scalars, Vector
    from sheldrake.math import RigidTransform
    from sheldrake.multibody.math import SpatialAcceleration, SpatialVelocity
    from sheldrake.multibody.tree._joint import Joint
    from sheldrake.systems.framework import Context


class RigidBody(NamedElement):
    """A rigid body B with its frame and its default spatial inertia; a context may hold another inertia."""

    _index_type = BodyIndex

    def __init__(self, body_name: str, *args: Any, **kwargs: Any):
        """
        Args:
            body_name: Its name.
            model_instance: Where it belongs; the default instance when left out.
            M_BBo_B: Its spatial inertia about its origin, in its own frame; zero when left out.
        """
        if body_name == "":
            raise RuntimeError("RigidBody(): a body must have a name, not ''.")
        model_instance, M_BBo_B = body_arguments("RigidBody", args, kwargs)
        super().__init__(body_name, default_model_instance() if model_instance is None else model_instance)
        self._M_BBo_B = M_BBo_B
        self._frame = RigidBodyFrame(self)

    def body_frame(self) -> RigidBodyFrame:
        """Its frame B."""
        return self._frame

    # --- default inertia

    def default_mass(self) -> float:
        """Mass [kg]."""
        return self._M_BBo_B.get_mass()

    def default_com(self) -> np.ndarray:
        """Centre of mass p_BoBcm_B [m], shape (3,), read-only."""
        return frozen(self._M_BBo_B.get_com())

    def default_unit_inertia(self) -> UnitInertia:
        """G_BBo_B [m²]."""
        return self._M_BBo_B.get_unit_inertia()

    def default_rotational_inertia(self) -> RotationalInertia:
        """I_BBo_B [kg m²]."""
        return self._M_BBo_B.CalcRotationalInertia()

    def default_spatial_inertia(self) -> SpatialInertia:
        """M_BBo_B."""
        return self._M_BBo_B

    # --- inertia in a context

    def get_mass(self, context: Context) -> float:
        """Mass [kg] as the context has it."""
        return self._finalized("get_mass").contexts.numbers(context, self._group).item(0)

    def CalcCenterOfMassInBodyFrame(self, context: Context) -> np.ndarray:
        """p_BoBcm_B [m] as the context has it, shape (3,)."""
        return np.array(self._com(context))

    def CalcSpatialInertiaInBodyFrame(self, context: Context) -> SpatialInertia:
        """M_BBo_B as the context has it."""
        owner = self._finalized("CalcSpatialInertiaInBodyFrame")
        return owner.contexts.spatial_inertia(context, self._group)

    @checked
    def SetMass(self, context: Context, mass: float) -> None:
        """Changes the mass [kg] in a context; the unit inertia stays, so the rotational inertia scales.

        Raises:
            RuntimeError: the mass is negative or not finite.
        """
        self._change(context, "SetMass", 0, [mass])

    def SetCenterOfMassInBodyFrame(self, context: Context, com: Scalars) -> None:
        """Changes p_BoBcm_B [m] in a context; the unit inertia about Bo stays."""
        self._change(context, "SetCenterOfMassInBodyFrame", 1, vector("SetCenterOfMassInBodyFrame", "com", com, 3))

    def SetCenterOfMassInBodyFrameAndPreserveCentralInertia(self, context: Context, com: Scalars) -> None:
        """Changes p_BoBcm_B [m] in a context and keeps the inertia about the centre of mass."""
        call = "SetCenterOfMassInBodyFrameAndPreserveCentralInertia"
        M = self.CalcSpatialInertiaInBodyFrame(context)
        new = vector(call, "com", com, 3)
        central = M.get_unit_inertia().ShiftToCenterOfMass(M.get_com())
        self._change(context, call, 1, [*new, *unit_inertia_numbers(central.ShiftFromCenterOfMass(new))])

    @checked
    def SetSpatialInertiaInBodyFrame(self, context: Context, M_Bo_B: SpatialInertia) -> None:
        """Changes the spatial inertia in a context."""
        self._change(context, "SetSpatialInertiaInBodyFrame", 0, inertia_numbers(M_Bo_B))

    def _change(self, context: Context, call: str, start: int, values: Vector) -> None:
        owner = self._finalized(call)
        numbers = owner.contexts.numbers(context, self._group).copy()
        plain = numbers.dtype != object
        numbers[start : start + len(values)] = values if plain else lifted(np.array(values), context._system._scalar)
        if plain and not (math.isfinite(numbers.sum()) and numbers.item(0) >= 0.0):
            raise RuntimeError(
                f"RigidBody.{call}(): body {self._name!r} needs a finite inertia and a mass of at least zero, "
                f"not {values}."
            )
        owner.contexts.write_numbers(context, self._group, numbers)

    # --- where it is

    def EvalPoseInWorld(self, context: Context) -> RigidTransform:
        """X_WB."""
        return self._finalized("EvalPoseInWorld").plant.EvalBodyPoseInWorld(context, self)

    def EvalSpatialVelocityInWorld(self, context: Context) -> SpatialVelocity:
        """V_WB, of Bo, expressed in W."""
        return self._finalized("EvalSpatialVelocityInWorld").plant.EvalBodySpatialVelocityInWorld(context, self)

    def EvalSpatialAccelerationInWorld(self, context: Context) -> SpatialAcceleration:
        """A_WB, of Bo, expressed in W."""
        return self._finalized("EvalSpatialAccelerationInWorld").plant.EvalBodySpatialAccelerationInWorld(context, self)

    def CalcCenterOfMassTranslationalVelocityInWorld(self, context: Context) -> np.ndarray:
        """v_WBcm, expressed in W [m/s], shape (3,)."""
        owner, com = self._finalized("CalcCenterOfMassTranslationalVelocityInWorld"), self._com(context)
        return owner.kinematics.velocity_of_point(context, self._frame, com)

    def CalcCenterOfMassTranslationalAccelerationInWorld(self, context: Context) -> np.ndarray:
        """a_WBcm, expressed in W [m/s²], shape (3,)."""
        owner, com = self._finalized("CalcCenterOfMassTranslationalAccelerationInWorld"), self._com(context)
        return owner.accelerations.of_point(context, com, self._frame).translational().copy()

    def _com(self, context: Context) -> np.ndarray:
        """p_BoBcm_B as the context has it, to be read only."""
        return self._finalized("CalcCenterOfMassInBodyFrame").contexts.numbers(context, self._group)[1:4]

    # --- forces

    @checked
    def GetForceInWorld(self, context: Context, forces: MultibodyForces) -> SpatialForce:
        """The spatial force on it at Bo, in W, among `forces`."""
        F_Bo_W = self._fitting("GetForceInWorld", forces)._F_Bo_W
        return SpatialForce_[context._system._scalar](F_Bo_W[int(self._index)].copy())

    @checked
    def AddInForceInWorld(self, context: Context, F_Bo_W: SpatialForce, forces: MultibodyForces) -> None:
        """Adds a spatial force at Bo, given in W, to `forces`."""
        self._fitting("AddInForceInWorld", forces)._F_Bo_W[int(self._index)] += F_Bo_W._c

    @checked
    def AddInForce(
        self, context: Context, p_BP_E: Scalars, F_Bp_E: SpatialForce, frame_E: Frame, forces: MultibodyForces
    ) -> None:
        """Adds a spatial force at a point P of the body, given in E, to `forces`.

        Args:
            context: Where the body is.
            p_BP_E: From Bo to P, expressed in E [m], shape (3,).
            F_Bp_E: The force.
            frame_E: The frame in which both are expressed.
            forces: What it is added to.
        """
        owner = self._finalized("AddInForce")
        F_Bo_E = F_Bp_E.Shift(-vector("AddInForce", "p_BP_E", p_BP_E, 3))
        in_world = frame_E is owner.kinematics.world_frame  # another plant's is refused below
        F_Bo_W = F_Bo_E if in_world else F_Bo_E.Rotate(frame_E.CalcRotationMatrixInWorld(context))
        self._fitting("AddInForce", forces)._F_Bo_W[int(self._index)] += F_Bo_W._c

    # --- free motion

    def is_floating_base_body(self) -> bool:
        """Whether it floats from the world by a joint that Finalize() added."""
        return self._finalized("is_floating_base_body").elements.is_floating_base(self)

    def is_floating(self) -> bool:
        """The retired name of `is_floating_base_body`."""
        _warn_of_retired("is_floating()", "is_floating_base_body()")
        return self.is_floating_base_body()

    def has_quaternion_dofs(self) -> bool:
        """Whether it floats with a quaternion."""
        return self._finalized("has_quaternion_dofs").elements.has_quaternion(self)

    def floating_positions_start(self) -> int:
        """Where its seven (or six) positions start in q."""
        return self._floating_joint("floating_positions_start").position_start()

    def floating_velocities_start_in_v(self) -> int:
        """Where its six velocities start in v."""
        return self._floating_joint("floating_velocities_start_in_v").velocity_start()

    @checked
    def floating_position_suffix(self, position_index_in_body: int) -> str:
        """Suffix of one of its positions."""
        return self._floating_joint("floating_position_suffix").position_suffix(position_index_in_body)

    @checked
    def floating_velocity_suffix(self, velocity_index_in_body: int) -> str:
        """Suffix of one of its velocities."""
        return self._floating_joint("floating_velocity_suffix").velocity_suffix(velocity_index_in_body)

    def _floating_joint(self, call: str) -> Joint:
        owner = self._finalized(call)
        if not owner.elements.is_floating_base(self):
            raise RuntimeError(f"RigidBody.{call}(): body {self._name!r} is not a floating base body.")
        return owner.elements.inboard_joint(self)

    @checked
    def Lock(self, context: Context) -> None:
        """Locks the joint by which it floats.

        Raises:
            RuntimeError: it does not float from the world.
        """
        self._floating_joint("Lock").Lock(context)

    @checked
    def Unlock(self, context: Context) -> None:
        """Unlocks the joint by which it floats.

        Raises:
            RuntimeError: it does not float from the world.
        """
        self._floating_joint("Unlock").Unlock(context)

    def is_locked(self, context: Context) -> bool:
        """Whether its inboard joint is locked; false of the world, which has none."""
        elements = self._finalized("is_locked").elements
        return self._index != 0 and elements.inboard_joint(self).is_locked(context)


def body_arguments(call: str, args: tuple, kwargs: dict[str, Any]) -> tuple[Any, SpatialInertia]:
    """(model instance or None, inertia) of `([model_instance], [M_BBo_B])`.

    Raises:
        TypeError: other arguments.
        RuntimeError: the inertia is not physically valid.
    """
    rest, model_instance, inertia = list(args), kwargs.pop("model_instance", None), kwargs.pop("M_BBo_B", None)
    if rest and not isinstance(rest[0], SpatialInertia) and model_instance is None:
        model_instance = rest.pop(0)
    if rest and inertia is None:
        inertia = rest.pop(0)
    inertia = SpatialInertia.Zero() if inertia is None else inertia
    wrong = rest or kwargs or not isinstance(inertia, SpatialInertia)
    if wrong or not (model_instance is None or isinstance(model_instance, ModelInstanceIndex)):
        raise Mismatch(
            f"{call}(): incompatible function arguments. Takes (name: str, M_BBo_B: SpatialInertia = zero) or (name: "
            "str, model_instance: ModelInstanceIndex, M_BBo_B: SpatialInertia = zero)."
        )
    return model_instance, inertia


def unit_inertia_numbers(G: UnitInertia) -> list[Any]:
    """xx, yy, zz, xy, xz, yz."""
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = G._I.tolist()
    return [xx, yy, zz, xy, xz, yz]


def inertia_numbers(M: SpatialInertia) -> list[Any]:
    """The ten parameters of a body: mass, centre of mass, unit inertia about Bo."""
    return [M._mass, *M._p.tolist(), *unit_inertia_numbers(M._G)]
