"""The types of joints: a row each with all that is told apart by type.

What a type does is in its class and in the kernels; what others ask of it is here. A new type is a row here, a kind in
`_kernels/model`, how it moves in `_kernels/kinematics`, a class, and its name in `__init__`.
"""

from __future__ import annotations

from dataclasses import dataclass

from sheldrake.multibody.tree._kernels import model as kernels


@dataclass(frozen=True, kw_only=True)
class JointType:
    """What is told apart by the type of a joint.

    Attributes:
        name: As `Joint.type_name()`.
        kind: What kernels call it.
        positions: What distinguishes the names of its positions, one each.
        velocities: The same of its velocities.
        rotates: Whether M can turn in F.
        translates: Whether M's origin can move in F.
        reversible: Whether its child may be the inboard body.
        v_is_qdot: Whether velocities are the rates of the positions, in order. Then each can have a force of its own.
        angles: Which positions are angles that come round to the same pose.
        mobilizer_axis: Whether Drake gives it frames whose z axis is the joint's.
        takes: Arguments of its class that a model file gives; fields of `JointDescription`.
        damping_each: Whether each velocity has a damping of its own, rather than one number for all.
        limited: Whether limits count where Drake makes a difference: those in model files, and all of them with kTamsi.
        spring: The force element that is a spring in such a joint.
        written: Whether model files can say all of it.
        urdf: How URDF calls it; the first is written.
        urdf_custom: Whether that is in <drake:joint> rather than <joint>; None where both are in use.
        sdf: How SDFormat calls it in <joint>; the first is written.
        sdf_custom: How it calls it in <drake:joint>.
        mjcf: The joints that MJCF puts in its place, in order; it is read where this is one.
    """

    name: str
    kind: int
    positions: tuple[str, ...] = ()
    velocities: tuple[str, ...] = ()
    rotates: bool = False
    translates: bool = False
    reversible: bool = False
    v_is_qdot: bool = True
    angles: tuple[int, ...] = ()
    mobilizer_axis: bool = False
    takes: tuple[str, ...] = ("damping",)
    damping_each: bool = False
    limited: bool = False
    spring: str = ""
    written: bool = True
    urdf: tuple[str, ...] = ()
    urdf_custom: bool | None = False
    sdf: tuple[str, ...] = ()
    sdf_custom: str = ""
    mjcf: tuple[str, ...] = ()

    @property
    def has_one_dof(self) -> bool:
        """Whether it has one degree of freedom."""
        return len(self.velocities) == 1

    @property
    def has_one_axis(self) -> bool:
        """Whether it has one degree of freedom, about or along an axis that files give."""
        return "axis" in self.takes and self.has_one_dof


_ROWS = (
    JointType(
        name="weld",
        kind=kernels.WELD,
        reversible=True,
        takes=("X_FM",),
        urdf=("fixed",),
        sdf=("fixed",),
    ),
    JointType(
        name="revolute",
        kind=kernels.REVOLUTE,
        positions=("q",),
        velocities=("w",),
        rotates=True,
        reversible=True,
        angles=(0,),
        mobilizer_axis=True,
        takes=("axis", "damping"),
        limited=True,
        spring="RevoluteSpring",
        urdf=("revolute", "continuous"),
        sdf=("revolute", "continuous"),
        mjcf=("hinge",),
    ),
    JointType(
        name="prismatic",
        kind=kernels.PRISMATIC,
        positions=("x",),
        velocities=("v",),
        translates=True,
        reversible=True,
        mobilizer_axis=True,
        takes=("axis", "damping"),
        limited=True,
        spring="PrismaticSpring",
        urdf=("prismatic",),
        sdf=("prismatic",),
        mjcf=("slide",),
    ),
    JointType(
        name="planar",
        kind=kernels.PLANAR,
        positions=("x", "y", "qz"),
        velocities=("vx", "vy", "wz"),
        rotates=True,
        translates=True,
        angles=(2,),
        damping_each=True,
        urdf=("planar",),
        urdf_custom=None,
        sdf_custom="planar",
        mjcf=("slide", "slide", "hinge"),
    ),
    JointType(
        name="ball_rpy",
        kind=kernels.BALL,
        positions=("qx", "qy", "qz"),
        velocities=("wx", "wy", "wz"),
        rotates=True,
        angles=(0, 1, 2),
        v_is_qdot=False,
        urdf=("ball",),
        urdf_custom=True,
        sdf=("ball",),
        mjcf=("ball",),
    ),
    JointType(
        name="universal",
        kind=kernels.UNIVERSAL,
        positions=("qx", "qy"),
        velocities=("wx", "wy"),
        rotates=True,
        angles=(0, 1),
        urdf=("universal",),
        urdf_custom=True,
        sdf=("universal",),
        mjcf=("hinge", "hinge"),
    ),
    JointType(
        name="screw",
        kind=kernels.SCREW,
        positions=("q",),
        velocities=("w",),
        rotates=True,
        translates=True,
        takes=("axis", "screw_pitch", "damping"),
        urdf=("screw",),
        urdf_custom=True,
        sdf=("screw",),
    ),
    JointType(
        name="curvilinear",
        kind=kernels.CURVILINEAR,
        positions=("q",),
        velocities=("v",),
        rotates=True,
        translates=True,
        takes=("curvilinear_path", "damping"),
        written=False,
        urdf=("curvilinear",),
        urdf_custom=True,
        sdf_custom="curvilinear",
    ),
    JointType(
        name="quaternion_floating",
        kind=kernels.QUATERNION,
        positions=("qw", "qx", "qy", "qz", "x", "y", "z"),
        velocities=("wx", "wy", "wz", "vx", "vy", "vz"),
        rotates=True,
        translates=True,
        v_is_qdot=False,
        written=False,
        urdf=("floating",),
        mjcf=("free",),
    ),
    JointType(
        name="rpy_floating",
        kind=kernels.RPY,
        positions=("qx", "qy", "qz", "x", "y", "z"),
        velocities=("wx", "wy", "wz", "vx", "vy", "vz"),
        rotates=True,
        translates=True,
        v_is_qdot=False,
        angles=(0, 1, 2),
        written=False,
    ),
)

JOINT_TYPES = {row.name: row for row in _ROWS}
