"""Bodies, frames, joints, actuators and force elements, and the algorithms on trees of them."""

from sheldrake.multibody.math import RotationalInertia, SpatialInertia, UnitInertia

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
from ._joints_axis import PrismaticJoint, RevoluteJoint, ScrewJoint, WeldJoint
from ._joints_floating import QuaternionFloatingJoint, RpyFloatingJoint
from ._joints_wide import BallRpyJoint, PlanarJoint, UniversalJoint
from ._multibody_forces import MultibodyForces
from ._rigid_body import RigidBody
from ._scoped_name import ScopedName

Body = RigidBody
BodyFrame = RigidBodyFrame

__all__ = [
    "BallRpyJoint",
    "Body",
    "BodyFrame",
    "BodyIndex",
    "FixedOffsetFrame",
    "ForceElement",
    "ForceElementIndex",
    "Frame",
    "FrameIndex",
    "JacobianWrtVariable",
    "Joint",
    "JointActuator",
    "JointActuatorIndex",
    "JointIndex",
    "LinearSpringDamper",
    "ModelInstanceIndex",
    "MultibodyConstraintId",
    "MultibodyForces",
    "PdControllerGains",
    "PlanarJoint",
    "PrismaticJoint",
    "PrismaticSpring",
    "QuaternionFloatingJoint",
    "RevoluteJoint",
    "RevoluteSpring",
    "RigidBody",
    "RigidBodyFrame",
    "RotationalInertia",
    "RpyFloatingJoint",
    "ScopedName",
    "ScrewJoint",
    "SpatialInertia",
    "UniformGravityFieldElement",
    "UnitInertia",
    "UniversalJoint",
    "WeldJoint",
    "default_model_instance",
    "world_frame_index",
    "world_index",
    "world_model_instance",
]
