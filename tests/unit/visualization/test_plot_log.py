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
    with pytest.raises(TypeError, match="expected a VectorLog, a LogSet or a VectorLogSink, got int"):
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
    subprocess.run([sys.executable, "-c", code], check=True, timeout=240)
    assert (tmp_path / "a.png").read_bytes()[:4] == b"\x89PNG"


def test_sublevelset_lies_on_the_boundary():
    A, b, c = np.array([[2.0, 0.5], [0.5, 1.0]]), np.array([1.0, -1.0]), -0.5
    (patch,) = plot_sublevelset_quadratic(matplotlib.pyplot.figure().add_subplot(), A, b, c)
    for x in patch.get_xy():
        assert x @ A @ x + b @ x + c == pytest.approx(1.0)
    with pytest.raises(ValueError, match="positive definite"):
        plot_sublevelset_quadratic(None, -A)


def turning_block():
    """A block that turns about z at 1 rad/s for two turns, by its quaternion, whose sign changes at times."""
    log = VectorLog(5)
    for t in np.linspace(0, 4 * np.pi, 101):
        sign = -1.0 if int(t) % 2 else 1.0
        log.AddData(t, [sign * np.cos(t / 2), 0, 0, sign * np.sin(t / 2), 1.0])
    return log, [*(f"block_body_q{c}" for c in "wxyz"), "block_body_wz"]


def test_quaternions_become_angles_without_jumps():
    log, names = turning_block()
    figure = PlotLog(log, state_names=names, rpy=True)
    orientation, _ = figure.axes
    assert orientation.get_ylabel() == "orientation (roll, pitch, yaw) [rad]"
    roll, pitch, yaw = (line.get_ydata() for line in orientation.lines)
    np.testing.assert_allclose(yaw, log.sample_times(), atol=1e-9)
    np.testing.assert_allclose([roll, pitch], 0.0, atol=1e-12)
    figure = PlotLog(log, state_names=names, rpy=True, degrees=True)
    assert [ax.get_ylabel() for ax in figure.axes] == [
        "orientation (roll, pitch, yaw) [deg]",
        "angular velocity [deg/s]",
    ]
    assert figure.axes[0].lines[2].get_ydata()[-1] == pytest.approx(720.0)
    assert figure.axes[1].lines[0].get_ydata()[0] == pytest.approx(180.0 / np.pi)


def test_roll_pitch_yaw_agrees_with_the_math_module():
    from sheldrake.common.eigen_geometry import Quaternion
    from sheldrake.math import RollPitchYaw
    from sheldrake.visualization._roll_pitch_yaw import roll_pitch_yaw, with_roll_pitch_yaw

    rng = np.random.default_rng(2)
    q = rng.normal(size=(4, 30))
    q /= np.linalg.norm(q, axis=0)
    expected = np.array([RollPitchYaw(Quaternion(column)).vector() for column in q.T]).T
    np.testing.assert_allclose(roll_pitch_yaw(q), expected, atol=1e-12)
    np.testing.assert_allclose(roll_pitch_yaw(3.0 * q), expected, atol=1e-12)
    names, _ = with_roll_pitch_yaw(["a_qw", "a_qx", "b_x"], np.ones((3, 2)))
    assert names == ["a_qw", "a_qx", "b_x"]  # no whole quaternion


def test_a_set_has_panels_of_its_own_for_each_log():
    from sheldrake.systems.primitives import LogSet

    other = VectorLog(1)
    other.AddData(0.0, [2.0])
    log, _ = turning_block()
    figure = PlotLog(LogSet({"plant/state": log, "sine/y0": other}), title="both")
    assert [ax.get_ylabel() for ax in figure.axes] == ["plant/state", "sine/y0"]


def test_plot_command(tmp_path, capsys, monkeypatch):
    from sheldrake.cli import main
    from sheldrake.systems.primitives._log_set import LogSet, TableLog

    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    log, names = turning_block()
    path = tmp_path / "log.npz"
    LogSet({"plant/state": TableLog(log.sample_times(), log.data(), names), "b": log}).ToNpz(path)
    assert main(["plot", str(path), "--list"]) == 0
    assert "plant/state: 101 samples of 5, 0 to 12.56" in capsys.readouterr().out
    assert main(["plot", str(path), "--rpy", "--degrees", "--only", "plant"]) == 0
    assert (tmp_path / "log.png").read_bytes()[:4] == b"\x89PNG"
    assert main(["plot", str(path), "-o", str(tmp_path / "x.svg")]) == 0
    assert "<svg" in (tmp_path / "x.svg").read_text()
    capsys.readouterr()
    assert main(["plot", str(path), "--only", "nothing"]) == 1
    assert "there are plant/state, b" in capsys.readouterr().err
    assert main(["plot", str(tmp_path / "absent.npz")]) == 1


@pytest.mark.parametrize(("backend", "held"), [("module://matplotlib_inline.backend_inline", False), ("agg", True)])
def test_a_figure_that_a_notebook_shows_is_not_left_for_the_end_of_the_cell(monkeypatch, backend, held):
    figure = PlotLog(falling_block())
    monkeypatch.setattr(matplotlib.pyplot, "get_backend", lambda: backend)
    assert matplotlib.pyplot.fignum_exists(figure.number)
    assert figure._repr_mimebundle_() == {}
    assert matplotlib.pyplot.fignum_exists(figure.number) == held
