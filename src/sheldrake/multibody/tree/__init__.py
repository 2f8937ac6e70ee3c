"""Bodies, frames, joints, actuators and force elements, and the algorithms on trees of them."""

from sheldrake.common._names import show_as_own
from sheldrake.multibody.math import (
    RotationalInertia,
    RotationalInertia_,
    SpatialInertia,
    SpatialInertia_,
    UnitInertia,
    UnitInertia_,
)
from sheldrake.systems.framework._templates import SystemTemplate

from ._bushing import DoorHinge, DoorHingeConfig, LinearBushingRollPitchYaw
from ._force_element import (
    ForceElement,
    LinearSpringDamper,
    PrismaticSpring,
    RevoluteSpring,
    UniformGravityFieldElement,
)
from ._frame import FixedOffsetFrame, Frame, RigidBodyFrame
from ._index import (
    BodyIndex,
    ForceElementIndex,
    FrameIndex,
    JacobianWrtVariable,
    JointActuatorIndex,
    JointIndex,
    ModelInstanceIndex,
    MultibodyConstraintId,
    default_model_instance,
    world_frame_index,
    world_index,
    world_model_instance,
)
from ._joint import Joint
from ._joint_actuator import JointActuator, PdControllerGains
from ._joint_curvilinear import CurvilinearJoint
from ._joints_axis import PrismaticJoint, RevoluteJoint, ScrewJoint, WeldJoint
from ._joints_floating import QuaternionFloatingJoint, RpyFloatingJoint
from ._joints_of_several_axes import BallRpyJoint, PlanarJoint, UniversalJoint
from ._multibody_forces import MultibodyForces
from ._rigid_body import RigidBody
from ._scoped_name import ScopedName
from ._shape_inertia import CalcSpatialInertia

Body = RigidBody
BodyFrame = RigidBodyFrame


def _family(cls: type) -> SystemTemplate:
    """`Foo_`: elements are the same for all scalars, as the scalar belongs to the context."""
    return SystemTemplate(f"{cls.__name__}_", cls, scope=__name__)


BallRpyJoint_ = _family(BallRpyJoint)
CurvilinearJoint_ = _family(CurvilinearJoint)
DoorHinge_ = _family(DoorHinge)
FixedOffsetFrame_ = _family(FixedOffsetFrame)
ForceElement_ = _family(ForceElement)
Frame_ = _family(Frame)
JointActuator_ = _family(JointActuator)
Joint_ = _family(Joint)
LinearBushingRollPitchYaw_ = _family(LinearBushingRollPitchYaw)
LinearSpringDamper_ = _family(LinearSpringDamper)
PlanarJoint_ = _family(PlanarJoint)
PrismaticJoint_ = _family(PrismaticJoint)
PrismaticSpring_ = _family(PrismaticSpring)
QuaternionFloatingJoint_ = _family(QuaternionFloatingJoint)
RevoluteJoint_ = _family(RevoluteJoint)
RevoluteSpring_ = _family(RevoluteSpring)
RigidBodyFrame_ = _family(RigidBodyFrame)
RigidBody_ = _family(RigidBody)
RpyFloatingJoint_ = _family(RpyFloatingJoint)
ScrewJoint_ = _family(ScrewJoint)
UniformGravityFieldElement_ = _family(UniformGravityFieldElement)
UniversalJoint_ = _family(UniversalJoint)
WeldJoint_ = _family(WeldJoint)
MultibodyForces_ = SystemTemplate("MultibodyForces_", MultibodyForces, scope=__name__, own=True)
Body_ = RigidBody_

__all__ = [
    "BallRpyJoint",
    "BallRpyJoint_",
    "Body",
    "BodyFrame",
    "BodyIndex",
    "Body_",
    "CalcSpatialInertia",
    "CurvilinearJoint",
    "CurvilinearJoint_",
    "DoorHinge",
    "DoorHingeConfig",
    "DoorHinge_",
    "FixedOffsetFrame",
    "FixedOffsetFrame_",
    "ForceElement",
    "ForceElementIndex",
    "ForceElement_",
    "Frame",
    "FrameIndex",
    "Frame_",
    "JacobianWrtVariable",
    "Joint",
    "JointActuator",
    "JointActuatorIndex",
    "JointActuator_",
    "JointIndex",
    "Joint_",
    "LinearBushingRollPitchYaw",
    "LinearBushingRollPitchYaw_",
    "LinearSpringDamper",
    "LinearSpringDamper_",
    "ModelInstanceIndex",
    "MultibodyConstraintId",
    "MultibodyForces",
    "MultibodyForces_",
    "PdControllerGains",
    "PlanarJoint",
    "PlanarJoint_",
    "PrismaticJoint",
    "PrismaticJoint_",
    "PrismaticSpring",
    "PrismaticSpring_",
    "QuaternionFloatingJoint",
    "QuaternionFloatingJoint_",
    "RevoluteJoint",
    "RevoluteJoint_",
    "RevoluteSpring",
    "RevoluteSpring_",
    "RigidBody",
    "RigidBodyFrame",
    "RigidBodyFrame_",
    "RigidBody_",
    "RotationalInertia",
    "RotationalInertia_",
    "RpyFloatingJoint",
    "RpyFloatingJoint_",
    "ScopedName",
    "ScrewJoint",
    "ScrewJoint_",
    "SpatialInertia",
    "SpatialInertia_",
    "UniformGravityFieldElement",
    "UniformGravityFieldElement_",
    "UnitInertia",
    "UnitInertia_",
    "UniversalJoint",
    "UniversalJoint_",
    "WeldJoint",
    "WeldJoint_",
    "default_model_instance",
    "world_frame_index",
    "world_index",
    "world_model_instance",
]

show_as_own(globals())
