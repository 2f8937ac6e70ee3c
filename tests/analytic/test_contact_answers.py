"""Scenes with contact against their known answers, with every approximation and both ways of finding points."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from benchmarks import contact_answers as answers
from benchmarks.engines import DrakeLike, MuJoCo, Scene, Solid

APPROXIMATIONS = ("lagged", "similar", "sap", "tamsi")
STIFFNESS = 5e5  # of a pair of points by default [N/m]

LAGGED = {
    "rest_depth": 5e-6,
    "creep": 4.1e-6,  # 3 % of what a stiction tolerance of 0.1 mm/s gives
    "slide_1ms": 1e-5,
    "sink_1ms": 1e-12,
    "lift_1ms": 1e-12,
    "slide_5ms": 1e-5,
    "sink_5ms": 1e-12,
    "lift_5ms": 1e-12,
    "roll": 1.2e-4,
    "tumble": 1e-13,
    "bounce": 3e-6,  # no energy is lost; the top of its way is looked for every millisecond
    "bounce_1ms": 3e-6,
    "bounce_damped": 0.081,
    "spin": 0.2001,  # five points: four on the rim, one in the middle
    "spin_patch": 2e-3,
    "peg": 1e-8,
    "grip": 1e-5,
    "stack_10": 1e-12,
    "stack_10_speed": 1e-12,
    "stack_30": 1e-12,
    "stack_30_speed": 1e-12,
    "drops": 0.0,
    "balls": 2e-3,
    "balls_momentum": 1e-11,
}
BACKWARD_EULER = {"bounce": 0.0321, "bounce_1ms": 0.28}  # it loses 1 - exp(-pi omega h) of the energy
LIMITS = {
    "lagged": LAGGED,
    # Both couple the normal force to sliding: what slides is lifted, unless a step's own slip is taken off (kSap).
    "similar": LAGGED | {"lift_1ms": 1e-3, "lift_5ms": 5e-3, "roll": 4e-4, "spin": 0.3, "spin_patch": 0.1},
    "sap": LAGGED
    | {"rest_depth": 4e-5, "creep": 3e-6, "roll": 3e-4, "spin": 0.18, "spin_patch": 0.1, "grip": 4e-5}
    | {"slide_1ms": 2e-5, "slide_5ms": 1e-4, "lift_1ms": 1.2e-5, "lift_5ms": 6e-5}  # it sinks in slowly
    | BACKWARD_EULER,
    "tamsi": LAGGED | {"creep": 6e-5, "grip": 1.5e-4} | BACKWARD_EULER,
}
"""The largest deviations allowed, of several points a pair."""


def check(deviations: dict[str, float], limits: dict[str, float]) -> None:
    for row, deviation in deviations.items():
        assert deviation <= limits[row], answers.ROWS[row]


@pytest.mark.parametrize("scene", answers.QUICK)
@pytest.mark.parametrize("approximation", APPROXIMATIONS)
def test_deviations_stay_within_limits(approximation, scene):
    check(answers.QUICK[scene](DrakeLike("sheldrake", approximation)), LIMITS[approximation])


@pytest.mark.parametrize("scene", answers.LONG)
@pytest.mark.parametrize("approximation", APPROXIMATIONS)
def test_what_stands_and_falls_for_long(approximation, scene):
    check(answers.LONG[scene](DrakeLike("sheldrake", approximation)), LIMITS[approximation])


@pytest.mark.parametrize(("algorithm", "points"), [("multi_point", 4), ("single_point", 1)])
@pytest.mark.parametrize("approximation", ["lagged", "similar", "tamsi"])
def test_depth_at_rest_is_weight_over_stiffness(approximation, algorithm, points):
    depth = answers.rest(DrakeLike("sheldrake", approximation, algorithm))["rest_depth"]
    assert depth == pytest.approx(answers.G / (points * STIFFNESS), rel=2e-6)


@pytest.mark.parametrize("algorithm", ["multi_point", "single_point"])
@pytest.mark.parametrize("approximation", APPROXIMATIONS)
def test_a_ball_is_the_same_with_both_algorithms(approximation, algorithm):
    """It touches in one point anyhow."""
    engine = DrakeLike("sheldrake", approximation, algorithm)
    limits = LIMITS[approximation]
    if algorithm == "single_point":
        limits = limits | BACKWARD_EULER | ({"roll": 6e-4} if approximation == "sap" else {})
    check(answers.roll(engine) | answers.bounces(engine), limits)


@pytest.mark.parametrize("approximation", APPROXIMATIONS)
def test_the_height_of_a_bounce_by_backward_euler_is_of_first_order(approximation):
    engine, steps, errors = DrakeLike("sheldrake", approximation, "single_point"), (2e-4, 1e-4, 5e-5), []
    for h in steps:
        ball = Solid(("sphere", 0.05), 1.0, p=(0.0, 0.0, 0.55))
        scene = Scene([answers.GROUND, ball], h, stiffness=1e4, dissipation=0.0, relaxation_time=0.0)
        errors.append(1.0 - answers.bounce_height(engine, scene))
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(1.0, abs=0.1)
    assert errors[1] == pytest.approx(np.pi * 100.0 * 1e-4, rel=0.1)  # omega = sqrt(k/m) = 100 rad/s


def test_rebound_of_hunt_and_crossley():
    """To first order 1 - 2/3 d v; against numbers of a fine integration of the motion."""
    assert answers.rebound_of_hunt_and_crossley(1e-4, 1.0) == pytest.approx(1.0 - 2e-4 / 3.0, rel=1e-7)
    x, v, h, d = 0.0, 1.0, 1e-5, 0.5  # k = m = 1
    while x >= 0.0:
        v_middle = v - 0.5 * h * x * (1.0 + d * v)
        x += h * v_middle
        v = v_middle - 0.5 * h * x * (1.0 + d * v_middle)
    assert answers.rebound_of_hunt_and_crossley(d, 1.0) == pytest.approx(-v, rel=1e-4)


class Wrong(DrakeLike):
    """An engine that takes a hundredth too little friction, or turns gravity by a hundredth."""

    def __init__(self, fault):
        super().__init__("sheldrake")
        self.fault = fault

    def start(self, scene):
        super().start(dataclasses.replace(scene, **self.fault(scene)))


@pytest.mark.parametrize(
    ("row", "fault"),
    [
        ("slide_1ms", lambda scene: {"friction": 0.99 * scene.friction}),
        ("rest_depth", lambda scene: {"gravity": (0.0, 0.0, -1.05 * answers.G)}),
        ("roll", lambda scene: {"gravity": (0.01, 0.0, -answers.G)}),
        ("spin_patch", lambda scene: {"friction": 0.99 * scene.friction}),
        ("grip", lambda scene: {"gravity": (0.0, 0.0, -1.5 * answers.G)}),
    ],
)
def test_deviations_see_a_planted_fault(row, fault):
    scenes = {"slide_1ms": "slide", "rest_depth": "rest", "spin_patch": "spin on a patch"}
    assert answers.QUICK[scenes.get(row, row)](Wrong(fault))[row] > LAGGED[row]


SCENES = ["rest", "creep", "slide", "slide 5 ms", "roll", "tumble", "bounces", "spin", "spin on a patch", "grip"]
COMPARED = list(itertools.product(APPROXIMATIONS, SCENES))


@pytest.mark.peer
@pytest.mark.parametrize(("approximation", "scene"), COMPARED)
def test_no_worse_than_drake_with_the_same_approximation(approximation, scene):
    pytest.importorskip("pydrake")
    ours = answers.QUICK[scene](DrakeLike("sheldrake", approximation))
    drakes = answers.QUICK[scene](DrakeLike("pydrake", approximation))
    for row, deviation in ours.items():
        assert deviation <= 1.01 * drakes[row] + 1e-12, (answers.ROWS[row], drakes[row])


@pytest.mark.peer
@pytest.mark.parametrize("scene", ["rest", "creep", "slide", "slide 5 ms", "roll", "tumble", "spin", "peg", "grip"])
def test_the_default_is_no_worse_than_mujoco(scene):
    pytest.importorskip("mujoco")
    ours = answers.QUICK[scene](DrakeLike("sheldrake"))
    others = [answers.QUICK[scene](MuJoCo(cone)) for cone in ("pyramidal", "elliptic")]
    for row, deviation in ours.items():
        assert deviation <= min(other[row] for other in others) + 1e-8, answers.ROWS[row]
