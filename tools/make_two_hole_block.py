"""Makes the demo's part as a CAD program would export it: an OBJ in millimetres, and an URDF that scales it to metres.

A block of 80 x 40 x 30 mm with two through holes of 12 mm radius along z; its corner, not its centre, is the origin.
Mass and inertia are those of the mesh at a density of 1200 kg/m^3 (Eberly 2002, "Polyhedral Mass Properties").

    python tools/make_two_hole_block.py
"""

from __future__ import annotations

import pathlib

import numpy as np

SIDE, HEIGHT, RADIUS, AROUND = 40.0, 30.0, 12.0, 48
"""Side of the square around each hole, height, radius of the holes [mm]; vertices around a hole."""
DENSITY = 1200.0
"""[kg/m^3]"""
FOLDER = pathlib.Path(__file__).resolve().parents[1] / "src" / "sheldrake" / "models" / "two_hole_block"

URDF = """<?xml version="1.0"?>
<!-- Made by tools/make_two_hole_block.py. The mesh is in millimetres, as CAD programs export it: hence the scale. -->
<robot name="two_hole_block">
  <link name="body">
    <inertial>
      <origin xyz="{com}"/>
      <mass value="{mass:.12g}"/>
      <inertia ixx="{ixx:.12g}" ixy="{ixy:.12g}" ixz="{ixz:.12g}" iyy="{iyy:.12g}" iyz="{iyz:.12g}" izz="{izz:.12g}"/>
    </inertial>
    <visual>
      <geometry><mesh filename="two_hole_block.obj" scale="0.001 0.001 0.001"/></geometry>
      <material name="orange"><color rgba="0.93 0.49 0.19 1.0"/></material>
    </visual>
    <collision>
      <geometry><mesh filename="two_hole_block.obj" scale="0.001 0.001 0.001"/></geometry>
    </collision>
  </link>
</robot>
"""


def block() -> tuple[np.ndarray, np.ndarray]:
    """Vertices [mm], shape (n, 3), and outward triangles, shape (m, 3)."""
    index: dict[tuple[float, float, float], int] = {}
    triangles: list[tuple[int, int, int]] = []

    def vertex(x: float, y: float, z: float) -> int:
        return index.setdefault((round(x, 6) + 0.0, round(y, 6) + 0.0, z), len(index))

    def quad(a: int, b: int, c: int, d: int) -> None:
        triangles.extend([(a, b, c), (a, c, d)])

    for centre in (0.5 * SIDE, 1.5 * SIDE):
        angles = 2.0 * np.pi * np.arange(AROUND) / AROUND
        direction = np.stack([np.cos(angles), np.sin(angles)], 1)
        middle = np.array([centre, 0.5 * SIDE])
        hole = middle + RADIUS * direction
        rim = middle + 0.5 * SIDE * direction / np.abs(direction).max(1, keepdims=True)
        for i in range(AROUND):
            j = (i + 1) % AROUND
            (h0, h1), (r0, r1) = ((ring[i], ring[j]) for ring in (hole, rim))
            top = [vertex(*p, HEIGHT) for p in (h0, r0, r1, h1)]
            bottom = [vertex(*p, 0.0) for p in (h0, r0, r1, h1)]
            quad(*top)
            quad(*bottom[::-1])
            quad(bottom[3], bottom[0], top[0], top[3])
            if abs(r0[0] - SIDE) > 1e-6 or abs(r1[0] - SIDE) > 1e-6:  # not the seam between the two halves
                quad(bottom[1], bottom[2], top[2], top[1])
    return np.array(list(index)), np.array(triangles)


def mass_properties(vertices: np.ndarray, triangles: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Volume, centroid, and second moments about the centroid, of signed tetrahedra from the origin.

    Returns:
        Volume [m^3], centroid [m], and the integral of x xᵀ over the volume [m^5].
    """
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
    volume = volumes.sum()
    total = a + b + c
    centroid = (volumes[:, None] * total / 4.0).sum(0) / volume
    moments = sum(np.einsum("n,ni,nj->ij", volumes, p, p) for p in (a, b, c, total)) / 20.0
    return volume, centroid, moments - volume * np.outer(centroid, centroid)


def main() -> None:
    """Writes two_hole_block.obj and two_hole_block.urdf beside each other."""
    vertices, triangles = block()
    volume, centroid, moments = mass_properties(vertices * 1e-3, triangles)
    inertia = DENSITY * (np.trace(moments) * np.eye(3) - moments)
    inertia[np.abs(inertia) < 1e-15] = 0.0
    FOLDER.mkdir(parents=True, exist_ok=True)
    lines = ["# made by tools/make_two_hole_block.py; units: millimetres"]
    lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    lines += ["f {} {} {}".format(*(t + 1)) for t in triangles]
    (FOLDER / "two_hole_block.obj").write_text("\n".join(lines) + "\n", encoding="utf-8")
    xx, yy, zz = np.diag(inertia)
    text = URDF.format(
        com=" ".join(f"{x:.12g}" for x in centroid), mass=DENSITY * volume, ixx=xx, iyy=yy, izz=zz,
        ixy=inertia[0, 1], ixz=inertia[0, 2], iyz=inertia[1, 2],
    )  # fmt: skip
    (FOLDER / "two_hole_block.urdf").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
