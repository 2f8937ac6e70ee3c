"""Draws the figures of docs/poses.md and of the tutorial: `python tools/make_figures.py`.

Frames are three arrows, x red, y green, z blue, seen from far away; matplotlib draws them in two dimensions.
"""

from __future__ import annotations

import os
import pathlib
import sys
import tempfile

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
OUT = ROOT / "docs" / "figures"
COLORS = ("#d62728", "#2ca02c", "#1f77b4")
GRAY = "0.4"


class Picture:
    """A view of the world from far away, on matplotlib axes.

    Args:
        axes: Where to draw.
        azimuth: Direction of the eye about z, from x [degrees].
        elevation: Of the eye above the ground [degrees].
    """

    def __init__(self, axes, azimuth: float, elevation: float):
        a, e = np.radians([azimuth, elevation])
        right = [-np.sin(a), np.cos(a), 0.0]
        up = [-np.cos(a) * np.sin(e), -np.sin(a) * np.sin(e), np.cos(e)]
        self._axes, self._view = axes, np.array([right, up])
        axes.set_aspect("equal")
        axes.set_axis_off()

    def see(self, p_WQ) -> np.ndarray:
        """Returns where a point is on the picture."""
        return self._view @ np.asarray(p_WQ, dtype=float)

    def line(self, p_WA, p_WB, **style) -> None:
        """Draws a line."""
        self._axes.plot(*np.transpose([self.see(p_WA), self.see(p_WB)]), **{"color": GRAY, "linewidth": 1.2, **style})

    def arrow(self, p_WA, p_WB, color: str) -> None:
        """Draws an arrow; the line below it makes the picture large enough."""
        self.line(p_WA, p_WB, color=color, linewidth=0.5)
        style = {"arrowstyle": "-|>,head_width=0.25,head_length=0.5", "color": color, "linewidth": 2.2}
        self._axes.annotate("", self.see(p_WB), self.see(p_WA), arrowprops={**style, "shrinkA": 0, "shrinkB": 0})

    def text(self, p_WQ, text: str, dx: float = 0.0, dy: float = 0.0, **style) -> None:
        """Writes at a point, and dx, dy [pt] beside it."""
        options = {"textcoords": "offset points", "ha": "center", "va": "center", "fontsize": 11, **style}
        self._axes.annotate(text, self.see(p_WQ), (dx, dy), **options)

    def frame(self, X_WF, name: str, size: float, dx: float = -10.0, dy: float = -10.0) -> None:
        """Draws the axes of a frame, their names, and its name beside its origin."""
        p_WF = X_WF.translation()
        for k, color in enumerate(COLORS):
            end = p_WF + size * X_WF.rotation().col(k)
            self.arrow(p_WF, end, color)
            away = self.see(end) - self.see(p_WF)
            away *= 11.0 / max(np.linalg.norm(away), 1e-9)
            self.text(end, f"{name}{'xyz'[k]}", *away, color=color, fontsize=10)
        self.text(p_WF, name, dx, dy, fontsize=15, weight="bold")

    def box(self, X_WB, sides) -> None:
        """Draws the twelve edges of a box that has its corner at Bo."""
        corners = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]) * np.asarray(sides)
        for a in range(8):
            for b in (a | 1, a | 2, a | 4):
                self.line(X_WB @ corners[a], X_WB @ corners[b], color="0.25")


def frames(figure) -> None:
    """World, hand and cup."""
    from sheldrake.math import RigidTransform, RotationMatrix

    figure.set_size_inches(6.5, 4.0)
    picture = Picture(figure.add_subplot(), azimuth=-25.0, elevation=22.0)
    X_WH = RigidTransform(RotationMatrix.MakeZRotation(np.pi / 2), [1.0, 0.5, 0.8])
    X_WC = X_WH @ RigidTransform([0.3, 0.0, 0.0])
    p_WH, p_WC, ground = X_WH.translation(), X_WC.translation(), np.array([1.0, 0.5, 0.0])
    for corner in ([1.0, 0.0, 0.0], [0.0, 0.5, 0.0], p_WH):
        picture.line(ground, corner, color="0.85")
    picture.line([0, 0, 0], [1, 0, 0], color="0.85")
    picture.line([0, 0, 0], [0, 0.5, 0], color="0.85")
    for start, end in (([0, 0, 0], p_WH), ([0, 0, 0], p_WC), (p_WH, p_WC)):
        picture.line(start, end, linestyle="--")
    picture.text(p_WH / 2, "$X_{WH}$", -12, 12)
    picture.text(0.62 * p_WC, "$X_{WC} = X_{WH}\\,X_{HC}$", 48, -18)
    picture.text((p_WH + p_WC) / 2, "$X_{HC}$", 8, -15)
    picture.frame(RigidTransform(), "W", 0.3)
    picture.frame(X_WH, "H", 0.13, dx=10, dy=-13)
    picture.frame(X_WC, "C", 0.13, dx=4, dy=-15)
    turn = np.linspace(0.0, 2.0 * np.pi, 40)
    rim = p_WC + 0.05 * np.transpose([np.cos(turn), np.sin(turn), 0.0 * turn])
    for k in range(len(turn) - 1):
        picture.line(rim[k], rim[k + 1], color="0.2")


def roll_pitch_yaw(figure) -> None:
    """A box after roll 40, pitch 30 and yaw 60 degrees about the world's axes, one after another."""
    from sheldrake.math import RigidTransform, RollPitchYaw

    figure.set_size_inches(9.0, 2.9)
    steps = (("", 0, 0, 0), ("roll 40° about Wx", 40, 0, 0), ("pitch 30° about Wy", 40, 30, 0))
    for k, (title, *degrees) in enumerate((*steps, ("yaw 60° about Wz", 40, 30, 60))):
        axes = figure.add_subplot(1, 4, k + 1)
        axes.set(xlim=(-0.95, 1.15), ylim=(-0.85, 1.15), autoscale_on=False)
        picture = Picture(axes, azimuth=30.0, elevation=25.0)
        X_WB = RigidTransform(RollPitchYaw(np.radians(degrees)), np.zeros(3))
        for axis, color in enumerate(COLORS):
            end = 1.05 * np.eye(3)[axis]
            turned = {"linestyle": "-", "linewidth": 1.6} if axis == k - 1 else {"linestyle": ":"}
            picture.line(-0.15 * end if axis == k - 1 else 0 * end, end, color=color, **turned)
        picture.box(X_WB, (0.8, 0.5, 0.2))
        for axis, color in enumerate(COLORS):
            picture.arrow(np.zeros(3), 0.9 * X_WB.rotation().col(axis), color)
        axes.text(0.1, -0.95, title, ha="center", fontsize=11)


def center_of_mass(figure) -> None:
    """A box whose frame is in its corner, and the centre of mass in its middle."""
    from sheldrake.math import RigidTransform, RotationMatrix

    figure.set_size_inches(6.5, 3.0)
    picture = Picture(figure.add_subplot(), azimuth=-42.0, elevation=30.0)
    sides = np.array([0.4, 0.2, 0.1])
    X_WB = RigidTransform(RotationMatrix.MakeZRotation(np.pi / 6), [0.3, 0.2, 0.1])
    p_WBo, p_WBcm = X_WB.translation(), X_WB @ (sides / 2)
    for start, end in (([0, 0, 0], p_WBo), ([0, 0, 0], p_WBcm), (p_WBo, p_WBcm)):
        picture.line(start, end, linestyle="--")
    picture.box(X_WB, sides)
    picture.frame(RigidTransform(), "W", 0.12)
    picture.frame(X_WB, "B", 0.12, dx=-13, dy=2)
    picture.text(p_WBo / 2, "$X_{WB}$", 10, -13)
    picture.text(0.42 * p_WBcm, "$p_{WBcm}$", -12, 14)
    picture.text((p_WBo + p_WBcm) / 2, "$p_{BoBcm}$", 14, -11)
    picture.line(p_WBcm, p_WBcm, marker="o", color="black")
    picture.text(p_WBcm, "Bcm", 4, 12, weight="bold")


def tutorial(path: pathlib.Path) -> None:
    """The plot of the tutorial, made by the tutorial's own code."""
    from pages import blocks

    names: dict = {"__name__": "__main__"}
    page = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for _, code in blocks(page):
            exec(code, names)
        os.chdir(ROOT)
    figure = names["PlotLog"](names["log"], rpy=True, degrees=True)
    figure.set_size_inches(8.0, 8.5)
    figure.savefig(path, dpi=80, bbox_inches="tight")


def main() -> None:
    """Writes docs/figures/*.png."""
    sys.path[:0] = [str(ROOT / "src"), str(ROOT / "tests" / "examples")]
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    OUT.mkdir(parents=True, exist_ok=True)
    for draw in (frames, roll_pitch_yaw, center_of_mass):
        figure = plt.figure(dpi=110)
        draw(figure)
        figure.subplots_adjust(0.0, 0.0, 1.0, 1.0, 0.02, 0.0)
        figure.savefig(OUT / f"{draw.__name__}.png", bbox_inches="tight", pad_inches=0.05)
    tutorial(OUT / "tutorial.png")


if __name__ == "__main__":
    main()
