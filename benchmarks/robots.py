"""Robots that the benchmarks build for every contender from the same numbers, as URDF text."""

from __future__ import annotations

import numpy as np

INERTIA = '<inertia ixx="{0}" iyy="{1}" izz="{2}" ixy="{3}" ixz="{4}" iyz="{5}"/>'
LINK = """
  <link name="{name}"><inertial>
    <origin xyz="{com}" rpy="0 0 0"/><mass value="{mass}"/>{inertia}
  </inertial></link>"""
JOINT = """
  <joint name="{name}" type="revolute">
    <parent link="{parent}"/><child link="{child}"/>
    <origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>
    <limit lower="-2.9" upper="2.9" effort="300" velocity="3"/><dynamics damping="{damping}"/>
  </joint>"""
TRANSMISSION = """
  <transmission name="{joint}_drive"><type>transmission_interface/SimpleTransmission</type>
    <joint name="{joint}"/><actuator name="{joint}_motor"/></transmission>"""


def _text(numbers) -> str:
    return " ".join(repr(float(x)) for x in numbers)


def _link(name: str, mass: float, com, size: float) -> str:
    """A link that weighs like a rod of `size` with something on it."""
    moments = [mass * size * size * k for k in (0.09, 0.08, 0.03, 0.002, -0.003, 0.004)]
    inertia = INERTIA.format(*(repr(m) for m in moments))
    return LINK.format(name=name, com=_text(com), mass=repr(mass), inertia=inertia)


def arm_urdf(damping: float = 0.5) -> str:
    """A seven-joint arm of the usual proportions, fixed to the world, with a motor on each joint."""
    turn = np.pi / 2
    masses = [5.76, 6.35, 3.5, 3.5, 3.5, 1.8, 1.2]
    lengths = [0.16, 0.20, 0.20, 0.21, 0.19, 0.22, 0.08]
    parts = [_link("base", 5.0, [0, 0, 0.08], 0.2)]
    for i, (mass, length) in enumerate(zip(masses, lengths)):
        rpy = [0, 0, 0] if i == 0 else [turn if i % 2 else -turn, 0.1 * i, 0]
        xyz = [0, 0.01 * i, length] if i % 2 == 0 else [0, length, 0.01]
        parts.append(_link(f"link{i + 1}", mass, [0.001 * i, 0.03, 0.06], length))
        joint = dict(name=f"joint{i + 1}", parent=f"link{i}" if i else "base", child=f"link{i + 1}")
        parts.append(JOINT.format(**joint, xyz=_text(xyz), rpy=_text(rpy), axis="0 0 1", damping=damping))
        parts.append(TRANSMISSION.format(joint=f"joint{i + 1}"))
    return f'<robot name="arm"><link name="world"/>{FIXED}{"".join(parts)}</robot>'


FIXED = """
  <joint name="mount" type="fixed"><parent link="world"/><child link="base"/></joint>"""


def humanoid_urdf() -> str:
    """A free-floating humanoid of 29 joints, nv = 35: two legs of 6, a waist of 3, two arms of 7."""
    parts = [_link("pelvis", 7.0, [0, 0, 0.05], 0.3)]

    def limb(name: str, parent: str, at, axes: str, lengths, masses) -> str:
        for i, (axis, length, mass) in enumerate(zip(axes, lengths, masses)):
            child = f"{name}{i + 1}"
            parts.append(_link(child, mass, [0.002, -0.001, -0.4 * length], max(length, 0.08)))
            direction = _text(np.eye(3)["xyz".index(axis)])
            ends = dict(name=f"{child}_joint", parent=parent, child=child)
            parts.append(JOINT.format(**ends, xyz=_text(at), rpy="0 0 0", axis=direction, damping=0.1))
            parent, at = child, [0, 0, -length]
        return parent

    chest = limb("waist", "pelvis", [0, 0, 0.1], "zxy", [-0.05, -0.05, -0.3], [0.8, 0.8, 12.0])
    for side, y in (("left", 0.1), ("right", -0.1)):
        limb(f"{side}_leg", "pelvis", [0, y, 0], "yxzyyx", [0.02, 0.02, 0.35, 0.35, 0.02, 0.05], [1.5, 1, 2, 3, 0.3, 1])
        arm = [0.02, 0.02, 0.15, 0.15, 0.1, 0.02, 0.05], [0.8, 0.7, 1.0, 0.9, 0.6, 0.3, 0.4]
        limb(f"{side}_arm", chest, [0, 1.5 * y, 0.25], "yxzyzyx", *arm)
    return f'<robot name="humanoid">{"".join(parts)}</robot>'
