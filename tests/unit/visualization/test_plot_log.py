"""Plots of logs: panels, names, units, without a display."""

import subprocess
import sys

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

from sheldrake.systems.primitives import VectorLog
from sheldrake.visualization import PlotLog, plot_sublevelset_quadratic

NAMES = [
    *(f"block_body_q{c}" for c in "wxyz"),
    *(f"block_body_{c}" for c in "xyz"),
    *(f"block_body_w{c}" for c in "xyz"),
    *(f"block_body_v{c}" for c in "xyz"),
]


def falling_block():
    log = VectorLog(13)
    for t in np.linspace(0, 1, 11):
        log.AddData(t, [1, 0, 0, 0, 0, 0, 1 - t**2, 0, 0, 0, 0, 0, -2 * t])
    return log


@pytest.fixture(autouse=True)
def close():
    yield
    matplotlib.pyplot.close("all")


def test_free_body_has_four_panels_with_units():
    figure = PlotLog(falling_block(), state_names=NAMES, title="block")
    assert [ax.get_ylabel() for ax in figure.axes] == [
        "orientation (quaternion) [1]",
        "position [m]",
        "angular velocity [rad/s]",
        "velocity [m/s]",
    ]
    labels = [[line.get_label() for line in ax.lines] for ax in figure.axes]
    assert labels == [["qw", "qx", "qy", "qz"], ["x", "y", "z"], ["wx", "wy", "wz"], ["vx", "vy", "vz"]]
    height = figure.axes[1].lines[2]
    assert height.get_ydata() == pytest.approx(1 - np.linspace(0, 1, 11) ** 2)
    assert height.get_xdata() == pytest.approx(np.linspace(0, 1, 11))
    assert figure.axes[-1].get_xlabel() == "time [s]"


def test_bodies_are_told_apart():
    log = VectorLog(2)
    log.AddData(0.0, [1, 2])
    figure = PlotLog(log, state_names=["a_body_x", "b_body_x"])
    assert [line.get_label() for line in figure.axes[0].lines] == ["a_body x", "b_body x"]


def test_stated_units_win():
    log = VectorLog(2)
    log.AddData(0.0, [1, 2])
    figure = PlotLog(log, state_names=["shoulder_q [rad]", "torque [N m]"])
    assert [ax.get_ylabel() for ax in figure.axes] == ["joint position [rad]", "[N m]"]


def test_names_of_the_log_are_used():
    log = VectorLog(2)
    log.AddData(0.0, [1, 2])
    figure = PlotLog(log)
    assert [line.get_label() for line in figure.axes[0].lines] == ["y0", "y1"]


def test_empty_log():
    assert PlotLog(VectorLog(3)).axes


def test_wrong_arguments():
    with pytest.raises(TypeError, match="expected a VectorLog or a VectorLogSink, got int"):
        PlotLog(3)
    with pytest.raises(ValueError, match="has 13 elements, but 2 names"):
        PlotLog(falling_block(), state_names=["a", "b"])


def test_works_without_a_display(tmp_path):
    code = f"""
import os
for name in ("DISPLAY", "WAYLAND_DISPLAY", "MPLBACKEND"): os.environ.pop(name, None)
from sheldrake.systems.primitives import VectorLog
from sheldrake.visualization import PlotLog
log = VectorLog(1); log.AddData(0.0, [1.0]); log.AddData(1.0, [2.0])
PlotLog(log).savefig({str(tmp_path / "a.png")!r})
"""
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)
    assert (tmp_path / "a.png").read_bytes()[:4] == b"\x89PNG"


def test_sublevelset_lies_on_the_boundary():
    A, b, c = np.array([[2.0, 0.5], [0.5, 1.0]]), np.array([1.0, -1.0]), -0.5
    (patch,) = plot_sublevelset_quadratic(matplotlib.pyplot.figure().add_subplot(), A, b, c)
    for x in patch.get_xy():
        assert x @ A @ x + b @ x + c == pytest.approx(1.0)
    with pytest.raises(ValueError, match="positive definite"):
        plot_sublevelset_quadratic(None, -A)
