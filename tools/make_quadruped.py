"""Makes the four-legged robot of examples/quadruped.py: an URDF of capsules, twelve hinges, and a ball for each foot.

A leg, with its joints at zero, hangs straight down from its hip; the mass of each part is that of its shape.

    python tools/make_quadruped.py
"""

from __future__ import annotations

import pathlib

import numpy as np

FILE = pathlib.Path(__file__).resolve().parents[1] / "src" / "sheldrake" / "models" / "quadruped" / "quadruped.urdf"
TRUNK = np.array([0.48, 0.14, 0.10])
"""Sides [m]."""
THIGH, SHANK, FOOT = 0.22, 0.22, 0.025
"""Lengths, and the radius of a foot [m]."""
ORANGE, DARK, BLACK = "0.85 0.45 0.15 1", "0.30 0.30 0.35 1", "0.10 0.10 0.10 1"


def inertial(mass: float, p_BoBcm_B: tuple[float, ...], moments: tuple[float, ...]) -> str:
    """Central moments [kg m^2] along the link's axes."""
    xyz = " ".join(f"{x:g}" for x in p_BoBcm_B)
    ixx, iyy, izz = (f"{moment:.6g}" for moment in moments)
    return (
        f'    <inertial><origin xyz="{xyz}"/><mass value="{mass:.6g}"/>\n'
        f'      <inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial>\n'
    )


def visual(shape: str, origin: str, color: str) -> str:
    """A shape to look at; the color is its material's name too."""
    return (
        f'    <visual><origin {origin}/><geometry>{shape}</geometry><material name="{color}"><color rgba="{color}"/>'
        "</material></visual>\n"
    )


def rod(length: float, radius: float, mass: float) -> tuple[float, float]:
    """Moments of a solid cylinder across and along its axis [kg m^2]."""
    return mass * (3.0 * radius**2 + length**2) / 12.0, mass * radius**2 / 2.0


def hanging(name: str, length: float, radius: float, mass: float, color: str, foot: bool = False) -> str:
    """A link that hangs from its joint along -z; with a ball of 50 g at its end if it is a foot's."""
    across, along = rod(length, radius, mass)
    height = -length / 2
    ball = ""
    if foot:
        total = mass + 0.05
        centre = (mass * height - 0.05 * length) / total
        across += mass * (height - centre) ** 2 + 0.05 * (length + centre) ** 2 + 0.4 * 0.05 * FOOT**2
        along += 0.4 * 0.05 * FOOT**2
        mass, height = total, centre
        shape, origin = f'<sphere radius="{FOOT}"/>', f'xyz="0 0 {-length}"'
        ball = visual(shape, origin, BLACK)
        ball += f"    <collision><origin {origin}/><geometry>{shape}</geometry></collision>\n"
    text = inertial(mass, (0.0, 0.0, height), (across, across, along))
    text += visual(f'<capsule radius="{radius}" length="{length}"/>', f'xyz="0 0 {-length / 2}"', color)
    return f'  <link name="{name}">\n{text}{ball}  </link>\n'


def joint(name: str, parent: str, child: str, xyz: str, axis: str, limits: tuple[float, float]) -> str:
    """A hinge with its motor; limits [rad]."""
    return (
        f'  <joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>\n'
        f'    <origin xyz="{xyz}"/><axis xyz="{axis}"/>\n'
        f'    <limit lower="{limits[0]}" upper="{limits[1]}" effort="40" velocity="20"/></joint>\n'
        f'  <transmission name="{name}_motor"><type>transmission_interface/SimpleTransmission</type>\n'
        f'    <joint name="{name}"/><actuator name="{name}"/></transmission>\n'
    )


def leg(name: str, x: float, y: float) -> str:
    """Hip (roll), thigh, shank at a corner of the trunk: x, y are signs."""
    across, along = rod(0.06, 0.03, 0.4)
    hip = inertial(0.4, (0.0, 0.03 * y, 0.0), (across, along, across))
    hip += visual('<capsule radius="0.03" length="0.06"/>', f'xyz="0 {0.03 * y} 0" rpy="1.5707963267949 0 0"', DARK)
    return (
        f'  <link name="{name}_hip">\n{hip}  </link>\n'
        + hanging(f"{name}_thigh", THIGH, 0.022, 0.6, ORANGE)
        + hanging(f"{name}_shank", SHANK, 0.015, 0.2, DARK, foot=True)
        + joint(f"{name}_roll", "trunk", f"{name}_hip", f"{0.2 * x} {0.06 * y} 0", "1 0 0", (-0.8, 0.8))
        + joint(f"{name}_pitch", f"{name}_hip", f"{name}_thigh", f"0 {0.06 * y} 0", "0 1 0", (-1.5, 2.5))
        + joint(f"{name}_knee", f"{name}_thigh", f"{name}_shank", f"0 0 {-THIGH}", "0 1 0", (-2.7, -0.2))
    )


def main() -> None:
    """Writes quadruped.urdf."""
    mass = 8.0
    squares = TRUNK**2
    moments = tuple(mass * (squares.sum() - squares) / 12.0)
    box = '<box size="{:g} {:g} {:g}"/>'.format(*TRUNK)
    text = '<?xml version="1.0"?>\n<!-- Made by tools/make_quadruped.py -->\n<robot name="quadruped">\n'
    text += f'  <link name="trunk">\n{inertial(mass, (0.0, 0.0, 0.0), moments)}{visual(box, "", ORANGE)}'
    text += f"    <collision><geometry>{box}</geometry></collision>\n  </link>\n"
    text += "".join(leg(*corner) for corner in (("fl", 1, 1), ("fr", 1, -1), ("rl", -1, 1), ("rr", -1, -1)))
    FILE.parent.mkdir(parents=True, exist_ok=True)
    FILE.write_text(text + "</robot>\n", encoding="utf-8")


if __name__ == "__main__":
    main()
