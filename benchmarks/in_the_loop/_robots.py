"""Robots of the programs beside this module, as text: an arm, a hand, a quadrotor, a cart with a pole, a dog."""

from __future__ import annotations

import numpy as np

LINK = """
  <link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/>
    <inertia ixx="{i}" iyy="{i}" izz="{i}" ixy="0" ixz="0" iyz="0"/></inertial>
    {shapes}</link>"""
JOINT = """
  <joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>
    <origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/><limit lower="{low}" upper="{high}" effort="300" velocity="9"/>
    <dynamics damping="{damping}"/></joint>"""
DRIVE = """
  <transmission name="{joint}_t"><type>transmission_interface/SimpleTransmission</type><joint name="{joint}">
    <hardwareInterface>effort</hardwareInterface></joint>
    <actuator name="{joint}_a"/></transmission>"""


def collision(shape: str, xyz="0 0 0") -> str:
    return f'<collision><origin xyz="{xyz}"/><geometry>{shape}</geometry></collision>'


def visual(shape: str, xyz="0 0 0") -> str:
    return (
        f'<visual><origin xyz="{xyz}"/><geometry>{shape}</geometry>'
        '<material name="paint"><color rgba="0.8 0.5 0.2 1"/></material></visual>'
    )


def link(name: str, mass: float, com: str = "0 0 0", i: float | None = None, shapes: str = "") -> str:
    return LINK.format(name=name, mass=mass, com=com, i=0.02 * mass if i is None else i, shapes=shapes)


def joint(name, parent, child, xyz="0 0 0", rpy="0 0 0", axis="0 0 1", low=-2.9, high=2.9, damping=0.1) -> str:
    return JOINT.format(**locals()) + DRIVE.format(joint=name)


def arm(shapes: bool = True) -> str:
    """Seven joints on a base that is fixed to the world."""
    half = repr(np.pi / 2)
    parts = ['<link name="world"/>', link("base", 5.0)]
    parts.append('<joint name="mount" type="fixed"><parent link="world"/><child link="base"/></joint>')
    lengths, masses = [0.16, 0.20, 0.20, 0.21, 0.19, 0.22, 0.08], [5.8, 6.4, 3.5, 3.5, 3.5, 1.8, 1.2]
    for i, (length, mass) in enumerate(zip(lengths, masses)):
        rod = f'<capsule radius="0.05" length="{0.6 * length}"/>' if i < 6 else '<sphere radius="0.04"/>'
        drawn = collision(rod, "0 0 0.05") + visual(f'<cylinder radius="0.05" length="{length}"/>') if shapes else ""
        parts.append(link(f"link{i + 1}", mass, "0.001 0.03 0.06", shapes=drawn))
        rpy = "0 0 0" if i == 0 else f"{half if i % 2 else '-' + half} 0 0"
        xyz = f"0 0 {length}" if i % 2 == 0 else f"0 {length} 0"
        parts.append(joint(f"joint{i + 1}", f"link{i}" if i else "base", f"link{i + 1}", xyz, rpy))
    return f'<robot name="arm">{"".join(parts)}</robot>'


def hand(fingers: int = 4) -> str:
    """A palm with fingers of four joints each."""
    palm = '<box size="0.1 0.1 0.03"/>'
    parts = [link("palm", 0.4, shapes=collision(palm) + visual(palm))]
    for f in range(fingers):
        parent, xyz = "palm", f"{0.03 * (f - 1.5)} 0.05 0.02"
        for k in range(4):
            name, rod = f"finger{f}_{k}", '<capsule radius="0.008" length="0.03"/>'
            shapes = collision(rod, "0 0 0.02") + visual('<cylinder radius="0.008" length="0.03"/>', "0 0 0.02")
            parts.append(link(name, 0.02, "0 0 0.02", 1e-5, shapes))
            axis = "0 0 1" if k == 0 else "1 0 0"
            parts.append(joint(f"{name}_joint", parent, name, xyz, axis=axis, low=-1.6, high=1.6, damping=0.01))
            parent, xyz = name, "0 0 0.04"
    return f'<robot name="hand">{"".join(parts)}</robot>'


def gripper() -> str:
    """A body with two fingers that slide."""
    box = '<box size="0.08 0.05 0.05"/>'
    finger = '<box size="0.01 0.02 0.08"/>'
    parts = [link("body", 0.7, shapes=collision(box) + visual(box))]
    for side, sign in (("left", -1), ("right", 1)):
        parts.append(link(f"{side}_finger", 0.05, i=1e-4, shapes=collision(finger) + visual(finger)))
        parts.append(
            f'<joint name="{side}" type="prismatic"><parent link="body"/><child link="{side}_finger"/>'
            f'<origin xyz="{0.03 * sign} 0 0.06"/><axis xyz="{sign} 0 0"/>'
            '<limit lower="-0.03" upper="0.03" effort="80"/><dynamics damping="1"/></joint>' + DRIVE.format(joint=side)
        )
    return f'<robot name="gripper">{"".join(parts)}</robot>'


def box(name: str = "box", size: float = 0.06, mass: float = 0.2) -> str:
    """A cube that is free."""
    shape = f'<box size="{size} {size} {size}"/>'
    body = link(name, mass, i=mass * size**2 / 6, shapes=collision(shape) + visual(shape))
    return f'<robot name="{name}">{body}</robot>'


def table() -> str:
    """A slab fixed to the world, its top at z = 0."""
    shape = '<box size="2 2 0.1"/>'
    return (
        f'<robot name="table"><link name="world"/>{link("slab", 10, shapes=collision(shape) + visual(shape))}'
        '<joint name="floor" type="fixed"><parent link="world"/><child link="slab"/><origin xyz="0 0 -0.05"/></joint>'
        "</robot>"
    )


def quadrotor() -> str:
    """A body with four arms, no joint."""
    shape = '<box size="0.3 0.3 0.05"/>'
    return f'<robot name="quadrotor">{link("body", 0.775, i=0.0015, shapes=visual(shape))}</robot>'


def cart_pole() -> str:
    """A cart on rails with a pole."""
    parts = ['<link name="world"/>', link("cart", 10.0, shapes=visual('<box size="0.4 0.2 0.1"/>'))]
    parts.append(
        '<joint name="x" type="prismatic"><parent link="world"/><child link="cart"/><axis xyz="1 0 0"/>'
        '<limit lower="-20" upper="20" effort="100"/></joint>' + DRIVE.format(joint="x")
    )
    parts.append(link("pole", 1.0, "0 0 -0.5", 1e-3, visual('<cylinder radius="0.02" length="0.5"/>')))
    parts.append(
        '<joint name="theta" type="continuous"><parent link="cart"/><child link="pole"/><axis xyz="0 1 0"/></joint>'
    )
    return f'<robot name="cart_pole">{"".join(parts)}</robot>'


def dog() -> str:
    """A trunk on four legs of three joints, with round feet."""
    trunk = '<box size="0.3 0.14 0.08"/>'
    parts = [link("trunk", 2.0, i=0.02, shapes=collision(trunk) + visual(trunk))]
    for name, x, y in (("lf", 0.12, 0.07), ("rf", 0.12, -0.07), ("lh", -0.12, 0.07), ("rh", -0.12, -0.07)):
        foot = collision('<sphere radius="0.015"/>', "0 0 -0.1")
        parts.append(link(f"{name}_hip", 0.1, i=1e-4))
        parts.append(link(f"{name}_thigh", 0.2, "0 0 -0.04", 3e-4, visual('<cylinder radius="0.01" length="0.08"/>')))
        parts.append(link(f"{name}_shin", 0.1, "0 0 -0.05", 2e-4, foot))
        parts.append(joint(f"{name}_roll", "trunk", f"{name}_hip", f"{x} {y} 0", axis="1 0 0"))
        parts.append(joint(f"{name}_pitch", f"{name}_hip", f"{name}_thigh", axis="0 1 0"))
        parts.append(joint(f"{name}_knee", f"{name}_thigh", f"{name}_shin", "0 0 -0.08", axis="0 1 0"))
    return f'<robot name="dog">{"".join(parts)}</robot>'
