"""Draws the figures of docs/figures/ with matplotlib.

    python tools/make_figures.py

The frames of docs/multibody.md: world, hand, cup, and the poses between them.
"""

from __future__ import annotations

import pathlib
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
OUT = ROOT / "docs" / "figures"
COLORS = ("#d62728", "#2ca02c", "#1f77b4")


def draw_frame(axes, X_WF, name: str, size: float = 0.25) -> None:
    """Draws three arrows of a frame, x red, y green, z blue, and its name."""
    p_WF = X_WF.translation()
    for k, color in enumerate(COLORS):
        axes.quiver(*p_WF, *(size * X_WF.rotation().col(k)), color=color, linewidth=2.2, arrow_length_ratio=0.18)
        axes.text(
            *(p_WF + (size + 0.05) * X_WF.rotation().col(k)), f"{name}{'xyz'[k]}", color=color, ha="center", va="center"
        )
    axes.text(*(p_WF - [0.0, 0.02, 0.1]), name, fontsize=14, weight="bold", ha="center")


def draw_position(axes, p_WA, p_WB, name: str, offset) -> None:
    """Draws a dashed line from A to B with a name."""
    axes.plot(*np.transpose([p_WA, p_WB]), color="0.45", linestyle="--", linewidth=1.2)
    axes.text(*(p_WA + 0.5 * (p_WB - p_WA) + offset), name, fontsize=11, color="0.25")


def frames(path: pathlib.Path) -> None:
    """World, hand and cup of docs/multibody.md."""
    import matplotlib.pyplot as plt

    from sheldrake.math import RigidTransform, RotationMatrix

    X_WW = RigidTransform()
    X_WH = RigidTransform(RotationMatrix.MakeZRotation(np.pi / 2), [1.0, 0.5, 0.8])
    X_WC = X_WH @ RigidTransform([0.3, 0.0, 0.0])
    figure = plt.figure(figsize=(6.0, 5.0), dpi=110)
    axes = figure.add_subplot(projection="3d", computed_zorder=False)
    for X_WF, name in ((X_WW, "W"), (X_WH, "H"), (X_WC, "C")):
        draw_frame(axes, X_WF, name, 0.3 if name == "W" else 0.15)
    p_WH, p_WC = X_WH.translation(), X_WC.translation()
    draw_position(axes, np.zeros(3), p_WH, "$X_{WH}$", [0.0, -0.1, 0.08])
    draw_position(axes, np.zeros(3), p_WC, "$X_{WC} = X_{WH}\\,X_{HC}$", [0.0, 0.05, -0.12])
    draw_position(axes, p_WH, p_WC, "$X_{HC}$", [0.0, 0.0, -0.09])
    turn = np.linspace(0.0, 2.0 * np.pi, 40)
    rim = p_WC[:, None] + 0.05 * np.array([np.cos(turn), np.sin(turn), 0.0 * turn])
    axes.plot(*rim, color="0.2", linewidth=1.5)
    shadow = np.array([[1.0, 1.0, 0.0], [0.0, 0.5, 0.5], [0.0, 0.0, 0.0]])
    axes.plot(*shadow, color="0.8", linewidth=1.0)
    axes.plot([1.0, 1.0], [0.5, 0.5], [0.0, 0.8], color="0.8", linewidth=1.0)
    axes.set(xlim=(0.0, 1.1), ylim=(-0.1, 1.05), zlim=(-0.1, 1.05))
    axes.set_box_aspect((1, 1, 1), zoom=1.3)
    axes.set_proj_type("ortho")
    axes.view_init(elev=17, azim=-25)
    axes.set_axis_off()
    figure.subplots_adjust(0.0, 0.0, 1.0, 1.0)
    figure.savefig(path, bbox_inches="tight", pad_inches=0.05)


def main() -> None:
    """Writes docs/figures/*.png."""
    sys.path.insert(0, str(ROOT / "src"))
    import matplotlib

    matplotlib.use("Agg")
    OUT.mkdir(parents=True, exist_ok=True)
    frames(OUT / "frames.png")


if __name__ == "__main__":
    main()
