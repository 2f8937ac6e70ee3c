"""The examples: short, one line of result, and the number in it is right."""

from __future__ import annotations

import importlib.util
import pathlib

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = sorted(path.stem for path in (ROOT / "examples").glob("*.py"))


def run(name, capsys, **options):
    """Runs main() of an example without a page; returns its result. It may print one line."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "examples" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    result = module.main(**options)
    lines = [line for line in capsys.readouterr().out.splitlines() if not line.startswith("sheldrake: compiling")]
    assert len(lines) == 1
    return result


@pytest.mark.parametrize("name", EXAMPLES)
def test_example_is_short(name):
    assert len((ROOT / "examples" / f"{name}.py").read_text(encoding="utf-8").splitlines()) < 80


@pytest.mark.parametrize("name", EXAMPLES)
def test_example_is_tested_here(name):
    assert f'run("{name}"' in pathlib.Path(__file__).read_text(encoding="utf-8")


def test_pendulum_has_the_period_of_the_elliptic_integral(capsys):
    assert run("pendulum", capsys, seconds=5.0) == pytest.approx(1.0, rel=1e-5)  # crossings between samples: 1e-6


def test_double_pendulum_keeps_its_energy(capsys):
    assert abs(run("double_pendulum", capsys, seconds=1.0)) < 1e-8
    assert abs(run("double_pendulum", capsys, seconds=1.0, accuracy=1e-3)) > 1e-6, "the number shows the integrator"


def test_ball_bounces_by_hunt_and_crossley(capsys):
    """The law leaves out gravity while in contact: sqrt(m g^2 / k) / v, 0.1 %."""
    assert run("bouncing_ball", capsys, seconds=0.85) == pytest.approx(1.0, rel=2e-3)


def test_gyroscope_tumbles_with_the_period_of_eulers_equations(capsys):
    period, drift = run("gyroscope", capsys, seconds=8.0)
    assert period == pytest.approx(1.0, rel=1e-5)
    assert drift < 1e-8


def test_cart_pole_costs_what_riccati_says(capsys):
    """Of a linear system it would be exact; at 0.1 rad the cart-pole is 0.4 % off."""
    assert run("cart_pole_lqr", capsys, seconds=5.0) == pytest.approx(1.0, rel=1e-2)


def test_arm_follows_the_critically_damped_path(capsys):
    assert run("arm_pid", capsys, seconds=1.0) < 1e-6  # [rad]: ten times the integrator's accuracy


def test_gripper_carries_the_weight(capsys):
    share, lifted = run("gripper", capsys, seconds=2.0)
    assert share == pytest.approx(1.0, rel=1e-6)
    assert lifted == pytest.approx(0.12, abs=1e-3), "the springs yield by 0.3 mm; the box does not slip"


def test_camera_finds_the_ball(capsys):
    off, radius = run("camera", capsys, seconds=0.5)
    assert off < 1e-7  # [m]: depth has single precision, and there are thousands of pixels
    assert radius == pytest.approx(1.0, abs=1e-6)


def test_quadruped_stands(capsys):
    share, sag = run("quadruped", capsys, seconds=1.5)
    assert share == pytest.approx(1.0, rel=1e-6)
    assert 0.0 < sag < 0.01


def test_stack_stands_still(capsys):
    off, speed = run("stack", capsys, seconds=1.0)
    assert off < 1e-4  # [N] of 49
    assert speed < 1e-6


def test_clutter_comes_to_rest_in_its_bin(capsys):
    share, energy = run("clutter", capsys, seconds=3.0)
    assert share == pytest.approx(1.0, rel=1e-3)
    assert energy < 1e-2


def test_block_comes_to_rest(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    assert run("drop_the_block", capsys, seconds=3.0) < 1e-6


def test_soft_balls_rest_on_the_area_that_bears_their_weight(capsys):
    """p = E (1 - r / R) gives the force pi E x^2 at depth x, on the area pi x (2 R - x); the mesh is within 6 %."""
    areas, forces = run("soft_ball", capsys)
    for area, force, E in zip(areas, forces, (3e4, 1e5, 1e6)):
        x = (2.0 * 9.81 / (3.14159265 * E)) ** 0.5
        assert force == pytest.approx(2.0 * 9.81, rel=1e-4)
        assert area == pytest.approx(3.14159265 * x * (0.2 - x), rel=0.06)
