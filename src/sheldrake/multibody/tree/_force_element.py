"""Force elements: gravity, springs, dampers.

What users add to a plant; `Finalize()` turns them into rows of a `ForceModel`, and `_kernels/forces.py` computes them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch
from sheldrake.multibody.tree._element import Element, finite, nonnegative, vector
from sheldrake.multibody.tree._index import ForceElementIndex, ModelInstanceIndex, world_model_instance
from sheldrake.multibody.tree._joints_axis import PrismaticJoint, RevoluteJoint
from sheldrake.multibody.tree._rigid_body import RigidBody

if TYPE_CHECKING:
    from sheldrake.common._types import Scalars
    from sheldrake.multibody.tree._joint import Joint
    from sheldrake.systems.framework import Context


class ForceElement(Element):
    """Puts forces on bodies or joints as a function of the plant's state."""

    _index_type = ForceElementIndex

    def _defaults(self) -> list[float]:
        """Its numeric parameters in a default context."""
        return []

    def _parts(self) -> tuple[Any, ...]:
        """Joints and bodies it acts on."""
        return ()


class UniformGravityFieldElement(ForceElement):
    """The same gravity everywhere; every plant has one, its first force element."""

    kDefaultStrength: ClassVar[float] = 9.81  # [m/s²]

    @checked
    def __init__(self, g_W: Scalars = (0.0, 0.0, -kDefaultStrength)):
        """
        Args:
            g_W: Acceleration of gravity, in W [m/s²], shape (3,).
        """
        super().__init__(world_model_instance())
        self._g_W = vector("UniformGravityFieldElement", "g_W", g_W, 3)
        self._disabled: set[int] = set()

    def gravity_vector(self) -> np.ndarray:
        """Acceleration of gravity, in W [m/s²], shape (3,)."""
        return self._g_W.copy()

    def set_gravity_vector(self, g_W: Scalars) -> None:
        """Sets the acceleration of gravity, in W [m/s²]."""
        call = "UniformGravityFieldElement.set_gravity_vector"
        self._g_W = finite(call, "g_W", vector(call, "g_W", g_W, 3))
        if self._owner is not None:
            self._owner.gravity_changed()

    def is_enabled(self, model_instance: ModelInstanceIndex) -> bool:
        """Whether it acts on the bodies of a model instance."""
        return int(model_instance) not in self._disabled

    @checked
    def set_enabled(self, model_instance: ModelInstanceIndex, is_enabled: bool) -> None:
        """Switches it on or off for the bodies of a model instance, before Finalize()."""
        if self._owner is not None:
            self._owner.elements.require_not_finalized("set_enabled")
        (self._disabled.discard if is_enabled else self._disabled.add)(int(model_instance))

    def CalcGravityGeneralizedForces(self, context: Context) -> np.ndarray:
        """Generalized forces of gravity [N or N m], shape (nv,)."""
        return self._finalized("CalcGravityGeneralizedForces").plant.CalcGravityGeneralizedForces(context)


class JointElement(ForceElement):
    """Acts on one joint of one type."""

    _joint_type: ClassVar[Any]

    def __init__(self, joint: Joint):
        if not isinstance(joint, self._joint_type):
            raise Mismatch(
                f"{type(self).__name__}(): incompatible constructor arguments. joint must be a "
                f"{self._joint_type.__name__}, not {joint!r}."
            )
        super().__init__(joint.model_instance())
        self._joint = joint

    def joint(self) -> Joint:
        """The joint it acts on."""
        return self._joint

    def _parts(self) -> tuple[Any, ...]:
        return (self._joint,)


@checked
class _JointSpring(JointElement):
    """A torsion or compression spring on a joint of one degree of freedom."""

    def __init__(self, joint: Joint, nominal: float, stiffness: float):
        super().__init__(joint)
        nonnegative(type(self).__name__, stiffness=stiffness)
        self._nominal = float(finite(type(self).__name__, "the nominal position", nominal))
        self._stiffness = float(stiffness)

    def _defaults(self) -> list[float]:
        return [self._stiffness, self._nominal]


@checked
class RevoluteSpring(_JointSpring):
    """Torque k (theta_0 - theta) on a revolute joint."""

    _joint_type = RevoluteJoint

    def __init__(self, joint: RevoluteJoint, nominal_angle: float, stiffness: float):
        """
        Args:
            joint: The joint.
            nominal_angle: Angle without torque [rad].
            stiffness: [N m/rad].
        """
        super().__init__(joint, nominal_angle, stiffness)

    def default_nominal_angle(self) -> float:
        """Angle without torque [rad]."""
        return self._nominal

    def default_stiffness(self) -> float:
        """Stiffness [N m/rad]."""
        return self._stiffness

    def GetNominalAngle(self, context: Context) -> float:
        """Angle without torque as the context has it [rad]."""
        return self._finalized("GetNominalAngle").contexts.numbers(context, self._group).item(1)

    def SetNominalAngle(self, context: Context, nominal_angle: float) -> None:
        """Changes the angle without torque in a context [rad]."""
        owner = self._finalized("SetNominalAngle")
        owner.contexts.write_numbers(context, self._group, [self.GetStiffness(context), nominal_angle])

    def GetStiffness(self, context: Context) -> float:
        """Stiffness as the context has it [N m/rad]."""
        return self._finalized("GetStiffness").contexts.numbers(context, self._group).item(0)

    def SetStiffness(self, context: Context, stiffness: float) -> None:
        """Changes the stiffness in a context [N m/rad]."""
        owner = self._finalized("SetStiffness")
        nonnegative("RevoluteSpring.SetStiffness", stiffness=stiffness)
        owner.contexts.write_numbers(context, self._group, [stiffness, self.GetNominalAngle(context)])


class PrismaticSpring(_JointSpring):
    """Force k (x_0 - x) on a prismatic joint."""

    _joint_type = PrismaticJoint

    def __init__(self, joint: PrismaticJoint, nominal_position: float, stiffness: float):
        """
        Args:
            joint: The joint.
            nominal_position: Position without force [m].
            stiffness: [N/m].
        """
        super().__init__(joint, nominal_position, stiffness)

    def nominal_position(self) -> float:
        """Position without force [m]."""
        return self._nominal

    def stiffness(self) -> float:
        """Stiffness [N/m]."""
        return self._stiffness


class LinearSpringDamper(ForceElement):
    """A massless spring and damper between a point P of body A and a point Q of body B."""

    @checked
    def __init__(
        self,
        bodyA: RigidBody,
        p_AP: Scalars,
        bodyB: RigidBody,
        p_BQ: Scalars,
        free_length: float,
        stiffness: float,
        damping: float,
    ):
        """
        Args:
            bodyA: Body A.
            p_AP: P in A [m], shape (3,).
            bodyB: Body B.
            p_BQ: Q in B [m], shape (3,).
            free_length: Length without force [m].
            stiffness: [N/m].
            damping: [N s/m].
        """
        super().__init__(bodyA.model_instance())
        nonnegative("LinearSpringDamper", stiffness=stiffness, damping=damping)
        if not free_length > 0.0:
            raise RuntimeError(f"LinearSpringDamper(): free_length must be positive, not {free_length}.")
        self._A, self._B = bodyA, bodyB
        self._p_AP = vector("LinearSpringDamper", "p_AP", p_AP, 3)
        self._p_BQ = vector("LinearSpringDamper", "p_BQ", p_BQ, 3)
        self._free_length, self._stiffness, self._damping = float(free_length), float(stiffness), float(damping)

    def bodyA(self) -> RigidBody:
        """Body A."""
        return self._A

    def bodyB(self) -> RigidBody:
        """Body B."""
        return self._B

    def p_AP(self) -> np.ndarray:
        """P in A [m], shape (3,)."""
        return self._p_AP.copy()

    def p_BQ(self) -> np.ndarray:
        """Q in B [m], shape (3,)."""
        return self._p_BQ.copy()

    def free_length(self) -> float:
        """Length without force [m]."""
        return self._free_length

    def stiffness(self) -> float:
        """Stiffness [N/m]."""
        return self._stiffness

    def damping(self) -> float:
        """Damping [N s/m]."""
        return self._damping

    def _defaults(self) -> list[float]:
        return [*self._p_AP, *self._p_BQ, self._free_length, self._stiffness, self._damping]

    def _parts(self) -> tuple[Any, ...]:
        return (self._A, self._B)
