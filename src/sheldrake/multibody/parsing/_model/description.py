"""What a model file says, before any plant hears of it; and what was made of it for one plant and serves others.

URDF, SDFormat and MJCF are read into the same description; one builder (`_build`) turns it into a plant. Reading first
and building second means that a file with a mistake leaves the plant as it was. Poses are `RigidTransform`s, shapes
are `sheldrake.geometry` shapes, names are those of the model (no scope) unless said otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.multibody.tree._joint_types import JOINT_TYPES, JointType

from .._files.diagnostics import Location

if TYPE_CHECKING:
    from sheldrake.geometry import Shape
    from sheldrake.math import RigidTransform
    from sheldrake.multibody.plant._building.geometry import BodyShape
    from sheldrake.multibody.tree import Joint
    from sheldrake.trajectories import PiecewiseConstantCurvatureTrajectory

INFINITY = float("inf")


@dataclass
class GeometryDescription:
    """A shape on a body, for one role group: visual (illustration, perception) or collision (proximity)."""

    where: Location
    name: str
    X_BG: RigidTransform
    shape: Shape
    illustration: Any = None
    perception: Any = None
    proximity: Any = None


@dataclass
class BodyDescription:
    """A rigid body; `M_BBo_B` is its spatial inertia about its origin. The world body carries geometry only."""

    where: Location
    name: str
    M_BBo_B: Any = None
    is_world: bool = False
    visuals: list[GeometryDescription] = field(default_factory=list)
    collisions: list[GeometryDescription] = field(default_factory=list)
    order: list[GeometryDescription] = field(default_factory=list)  # of both; empty where visuals come first
    default_pose: RigidTransform | None = None  # X_WB in case the body turns out to be free
    shapes: tuple[BodyShape, ...] | None = None  # once a plant took them all without complaint
    surface_velocity_axis: Any = None  # around which its surface runs, None if it does not

    def geometries(self) -> list[GeometryDescription]:
        """Visuals and collisions in the order in which they are registered."""
        return self.order or [*self.visuals, *self.collisions]


@dataclass
class FrameReference:
    """A body or frame by name in a model; `model` None is the description's own, "" the world model."""

    name: str
    scope: tuple[str, ...] = ()  # nested model names from the describing model to the one that owns the frame
    is_world: bool = False

    def __str__(self) -> str:
        return "::".join((*self.scope, self.name))


@dataclass
class FrameDescription:
    """A frame fixed to another: X_PF is its pose in the frame (or body) `base`."""

    where: Location
    name: str
    base: FrameReference
    X_PF: Any
    is_of_model: bool = False  # belongs to the describing model even when its base is in a nested one


@dataclass
class JointLimits:
    """Bounds per degree of freedom, position [m or rad], velocity [m/s or rad/s], acceleration, effort [N or N m]."""

    lower: float = -INFINITY
    upper: float = INFINITY
    velocity: float = INFINITY
    acceleration: float = INFINITY
    effort: float = INFINITY


@dataclass
class JointDescription:
    """A joint from frame F on the parent body to frame M on the child body.

    X_PF and X_CM are poses in the parent and child frames; None means the frame itself is used and no frame is added.
    """

    where: Location
    name: str
    kind: str  # a key of JOINT_TYPES
    parent: FrameReference
    child: FrameReference
    X_PF: Any = None
    X_CM: Any = None
    X_FM: Any = None  # of a weld: identity when None
    axis: np.ndarray | None = None
    damping: float | np.ndarray = 0.0  # [N m s or N s/m], one number or one for each velocity
    limits: JointLimits = field(default_factory=JointLimits)
    default_position: Any = None
    screw_pitch: float = 0.0  # [m per turn]
    curvilinear_path: PiecewiseConstantCurvatureTrajectory | None = None
    spring: tuple[float, float] | None = None  # stiffness [N m/rad or N/m], rest position [rad or m]
    friction: float = 0.0  # dry friction [N m or N]
    model: Joint | None = None  # to be copied, once one was made

    @property
    def type(self) -> JointType:
        """What is told apart by its kind."""
        return JOINT_TYPES[self.kind]


@dataclass
class ActuatorDescription:
    """An actuator on a joint with one degree of freedom."""

    where: Location
    name: str
    joint: str
    effort_limit: float = INFINITY
    rotor_inertia: float | None = None  # [kg m^2 or kg]
    gear_ratio: float | None = None
    gains: tuple[float, float] | None = None  # p [N m/rad or N/m], d [N m s/rad or N s/m]


@dataclass
class CouplerDescription:
    """q(joint) = ratio * q(source) + offset."""

    where: Location
    joint: str
    source: str
    ratio: float = 1.0
    offset: float = 0.0


@dataclass
class GearboxDescription:
    """Angle of the child against the reference link = -ratio times that of the parent, about the given axes.

    Both angles are those of the joints that connect the links to the reference.
    """

    where: Location
    name: str
    reference: FrameReference
    parent: FrameReference
    child: FrameReference
    ratio: float
    axes: np.ndarray  # of the parent and the child in the model frame, shape (2, 3)


@dataclass
class BushingDescription:
    """A roll-pitch-yaw bushing between two frames; four vectors, shape (3,)."""

    where: Location
    frame_a: FrameReference
    frame_c: FrameReference
    torque_stiffness: np.ndarray
    torque_damping: np.ndarray
    force_stiffness: np.ndarray
    force_damping: np.ndarray


@dataclass
class SpringDamperDescription:
    """A linear spring-damper between point P of body A and point Q of body B."""

    where: Location
    body_a: FrameReference
    p_AP: np.ndarray
    body_b: FrameReference
    p_BQ: np.ndarray
    free_length: float  # [m]
    stiffness: float  # [N/m]
    damping: float  # [N s/m]


@dataclass
class BallConstraintDescription:
    """Point P of body A coincides with point Q of body B; p_BQ None means where P is in the default pose."""

    where: Location
    body_a: FrameReference
    p_AP: np.ndarray
    body_b: FrameReference
    p_BQ: np.ndarray | None


@dataclass
class WeldConstraintDescription:
    """Frame P of body A coincides with frame Q of body B."""

    where: Location
    body_a: FrameReference
    X_AP: RigidTransform
    body_b: FrameReference
    X_BQ: RigidTransform


@dataclass
class DistanceConstraintDescription:
    """Points P and Q stay `distance` apart."""

    where: Location
    body_a: FrameReference
    p_AP: np.ndarray
    body_b: FrameReference
    p_BQ: np.ndarray
    distance: float  # [m]
    stiffness: float = INFINITY
    damping: float = 0.0


@dataclass
class TendonDescription:
    """lower <= sum(a_i q_i) + offset <= upper."""

    where: Location
    joints: list[str]
    a: np.ndarray
    offset: float | None = None
    lower: float | None = None
    upper: float | None = None
    stiffness: float | None = None
    damping: float | None = None


@dataclass
class FilterGroupDescription:
    """A collision filter group; all names relative to the describing model, possibly scoped."""

    where: Location
    name: str
    members: list[str] = field(default_factory=list)
    member_groups: list[str] = field(default_factory=list)
    ignored: list[str] = field(default_factory=list)


@dataclass
class ModelDescription:
    """One model instance: what a `<robot>`, `<model>` or `<mujoco>` element says.

    Attributes:
        bodies: All bodies. They are added first, but for those that also stand among the elements.
        elements: Joints, frames, actuators, forces and constraints in the order in which they are to be added.
        nested: Models inside this one; they become instances of their own, named `outer::inner`, before the elements.
        couplers: Couplers found while joints are read, until they can be checked and joined to the elements.
        gearboxes: Gearboxes, until they become couplers.
        exclusions: Pairs of bodies that never collide.
        comes_first: A URDF model included by SDFormat: added before all others, as Drake does.
        is_world: The description of a world: its nested models are top-level ones, its elements belong to the world.
    """

    where: Location
    name: str
    bodies: list[BodyDescription] = field(default_factory=list)
    elements: list[Any] = field(default_factory=list)
    nested: list[ModelDescription] = field(default_factory=list)
    filter_groups: list[FilterGroupDescription] = field(default_factory=list)
    exclusions: list[tuple[FrameReference, FrameReference]] = field(default_factory=list)
    couplers: list[CouplerDescription] = field(default_factory=list)
    gearboxes: list[GearboxDescription] = field(default_factory=list)
    comes_first: bool = False
    gravity: np.ndarray | None = None  # [m/s^2] of the whole plant, when the file sets it
    is_world: bool = False

    def joints(self) -> list[JointDescription]:
        """The joints among the elements, in order."""
        return [element for element in self.elements if isinstance(element, JointDescription)]
