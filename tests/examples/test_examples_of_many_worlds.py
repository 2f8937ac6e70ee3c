"""Examples that need many worlds: learning, and control by rollouts."""

import pathlib
import runpy

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


def main_of(name):
    return runpy.run_path(str(ROOT / "examples" / "worlds" / f"{name}.py"))["main"]


def test_quadruped_walks_by_rollouts():
    ahead, upright = main_of("quadruped_mppi")(seconds=0.2)
    assert ahead > 0.02, "standing still is 0"
    assert upright > 0.9


def test_cart_pole_begins_to_learn():
    pytest.importorskip("gymnasium")
    assert main_of("learn_cart_pole")(generations=2) > 5.0, "hanging still is 0"


def test_cart_pole_begins_to_learn_with_stable_baselines(tmp_path, monkeypatch):
    pytest.importorskip("stable_baselines3", reason="stable-baselines3 is not installed")
    monkeypatch.chdir(tmp_path)
    worst = main_of("learn_with_stable_baselines")(steps=65_536)
    assert worst > 30.0, "hanging still is 0"
    assert 1e5 < (tmp_path / "learnt_swing_up.html").stat().st_size < 5e6


@pytest.mark.slow
def test_cart_pole_learns_to_swing_up():
    """Of 500 steps some 100 go by until the pole is up; held there, each is worth nearly 1."""
    pytest.importorskip("gymnasium")
    assert main_of("learn_cart_pole")() > 300.0
