"""Scenes with contact whose answer is known, and how far an engine is from it.

Each function runs its scene in an engine of `engines.py` and returns deviations by the name of their row in `ROWS`:
zero is right, nothing is negative. Tests and the table in docs/accuracy.md use the same functions.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from benchmarks.engines import Scene, Solid

G = 9.81
GROUND = Solid(("half_space",))


def slope(angle: float) -> Solid:
    """A half space whose surface falls along x [rad]."""
    return Solid(("half_space",), rpy=(0.0, angle, 0.0))


def on_slope(angle: float, height: float, shape: tuple, mass: float) -> Solid:
    """A solid on `slope(angle)`, with its middle so high above the surface [m]."""
    return Solid(shape, mass, p=(height * np.sin(angle), 0.0, height * np.cos(angle)), rpy=(0.0, angle, 0.0))


def downhill(angle: float) -> np.ndarray:
    return np.array([np.cos(angle), 0.0, -np.sin(angle)])


def rest(engine) -> dict[str, float]:
    """A cube of 1 kg on the ground."""
    engine.start(Scene([GROUND, Solid(("box", 0.1, 0.1, 0.1), 1.0, p=(0.0, 0.0, 0.05))]))
    engine.advance(2.0)
    return {"rest_depth": abs(0.05 - engine.positions()[0, 2])}


def creep(engine) -> dict[str, float]:
    """A box on a slope where friction holds it with a fifth to spare."""
    angle = np.arctan(0.8 * 0.5)
    engine.start(Scene([slope(angle), on_slope(angle, 0.025, ("box", 0.2, 0.1, 0.05), 1.0)]))
    engine.advance(1.0)
    start = engine.positions()[0]
    engine.advance(1.0)
    return {"creep": abs((engine.positions()[0] - start) @ downhill(angle))}


def slide(engine, time_step: float = 1e-3) -> dict[str, float]:
    """A box on a slope that is too steep: g (sin - mu cos), flat, as deep in the ground as at rest under that load."""
    shape, angle = ("box", 0.2, 0.1, 0.05), np.arctan(1.5 * 0.5)
    load = (0.0, 0.0, -G * np.cos(angle))
    engine.start(Scene([GROUND, Solid(shape, 1.0, p=(0.0, 0.0, 0.025))], time_step, gravity=load))
    engine.advance(1.0)
    at_rest = engine.positions()[0, 2]
    engine.start(Scene([slope(angle), on_slope(angle, 0.025, shape, 1.0)], time_step))
    engine.advance(0.2)
    speeds, heights = [engine.velocities()[0, 3:] @ downhill(angle)], []
    for _ in range(round(0.8 / time_step)):
        engine.advance(time_step)
        heights.append(engine.positions()[0] @ [np.sin(angle), 0.0, np.cos(angle)])
    speeds.append(engine.velocities()[0, 3:] @ downhill(angle))
    a = (speeds[1] - speeds[0]) / 0.8
    ms = round(1e3 * time_step)
    exact = G * (np.sin(angle) - 0.5 * np.cos(angle))
    return {
        f"slide_{ms}ms": abs(a / exact - 1.0),
        f"sink_{ms}ms": max(0.0, at_rest - min(heights)),
        f"lift_{ms}ms": max(0.0, max(heights) - at_rest),
    }


def roll(engine) -> dict[str, float]:
    """A ball that slides at first rolls with 5/7 of its speed."""
    engine.start(Scene([GROUND, Solid(("sphere", 0.05), 1.0, p=(0.0, 0.0, 0.05), v=(1.0, 0.0, 0.0))]))
    engine.advance(1.0)
    return {"roll": abs(engine.velocities()[0, 3] / (5.0 / 7.0) - 1.0)}


def tumble(engine) -> dict[str, float]:
    """Two boxes that spin collide without weight: their angular momentum, about the origin, stays what it was."""
    size, masses = (0.12, 0.08, 0.05), (1.0, 2.0)
    I_B = np.diag([size[1] ** 2 + size[2] ** 2, size[0] ** 2 + size[2] ** 2, size[0] ** 2 + size[1] ** 2]) / 12.0
    spin, shape = (1.0, 2.0, -1.0), ("box", *size)
    one = Solid(shape, masses[0], p=(-0.1, 0.0, 0.0), rpy=(0.3, 0.2, 0.1), v=(0.5, 0.0, 0.0), w=spin)
    two = Solid(shape, masses[1], p=(0.1, 0.01, 0.02), rpy=(-0.4, 0.1, 0.6), v=(-0.5, 0.1, 0.0), w=spin[::-1])
    engine.start(Scene([one, two], gravity=(0.0, 0.0, 0.0)))

    def momentum() -> np.ndarray:
        p, v, R = engine.positions(), engine.velocities(), engine.rotations()
        return sum(m * (np.cross(p[k], v[k, 3:]) + R[k] @ I_B @ R[k].T @ v[k, :3]) for k, m in enumerate(masses))

    start, changes = momentum(), []
    for _ in range(50):
        engine.advance(0.01)
        changes.append(np.abs(momentum() - start).max())
    return {"tumble": max(changes) / np.linalg.norm(start)}


def stack(engine, n: int) -> dict[str, float]:
    """n boxes, each on the other, for 10 s: how far one has moved aside, and how fast one is."""
    boxes = [Solid(("box", 0.1, 0.1, 0.1), 0.3, p=(0.0, 0.0, 0.05 + 0.1 * k)) for k in range(n)]
    engine.start(Scene([GROUND, *boxes]))
    try:
        engine.advance(10.0)
    except RuntimeError:  # its solver has given up
        return {f"stack_{n}": np.inf, f"stack_{n}_speed": np.inf}
    aside = np.abs(engine.positions()[:, :2]).max()
    return {f"stack_{n}": aside, f"stack_{n}_speed": np.abs(engine.velocities()).max()}


def drops(engine, n: int = 100) -> dict[str, float]:
    """A cube dropped at random: how many of n still turn after 6 s."""
    rng, moving = np.random.default_rng(0), 0
    for k in range(n):
        rpy = (rng.uniform(-np.pi, np.pi), np.arcsin(rng.uniform(-1.0, 1.0)), rng.uniform(-np.pi, np.pi))
        scene = Scene([GROUND, Solid(("box", 0.1, 0.1, 0.1), 1.0, p=(0.0, 0.0, 0.2), rpy=rpy)])
        engine.reset(scene) if k else engine.start(scene)
        engine.advance(6.0)
        moving += bool(np.abs(engine.velocities()[0, :3]).max() >= 1e-9)
    return {"drops": moving / n}


def bounce_height(engine, scene: Scene) -> float:
    """Height to which a ball rises after its first bounce, of the height from which it fell."""
    engine.start(scene)
    start = scene.moving()[0].p[2] - 0.05
    fall = np.sqrt(2.0 * start / G)
    engine.advance(1.1 * fall)
    top = -np.inf
    for _ in range(round(1.2 * fall / 1e-3)):
        engine.advance(1e-3)
        top = max(top, engine.positions()[0, 2] - 0.05)
    return top / start


def rebound_of_hunt_and_crossley(d: float, v: float) -> float:
    """Speed after the impact of a mass on a spring with force k x (1 + d x'), which does not depend on k and m."""
    from scipy.optimize import brentq

    def level(u: float) -> float:
        return u / d - np.log1p(d * u) / d**2

    return -brentq(lambda u: level(u) - level(v), -min(v, (1.0 - 1e-12) / d), 0.0)


def bounces(engine) -> dict[str, float]:
    """A ball on a spring without damping, and (where the engine has it) with Hunt and Crossley's."""
    ball = Solid(("sphere", 0.05), 1.0, p=(0.0, 0.0, 0.55))
    soft = Scene([GROUND, ball], time_step=1e-4, stiffness=1e4, dissipation=0.0, relaxation_time=0.0)
    coarse = dataclasses.replace(soft, time_step=1e-3)
    out = {"bounce": abs(bounce_height(engine, soft) - 1.0), "bounce_1ms": abs(bounce_height(engine, coarse) - 1.0)}
    if getattr(engine, "approximation", "sap") != "sap":
        v = np.sqrt(2.0 * G * 0.5)
        exact = (rebound_of_hunt_and_crossley(0.2, v) / v) ** 2
        damped = dataclasses.replace(soft, dissipation=0.2)
        out["bounce_damped"] = abs(bounce_height(engine, damped) / exact - 1.0)
    return out


def spin(engine, patch: bool = False) -> dict[str, float]:
    """A disk spins on its face: even pressure brakes it with the torque 2/3 mu m g R."""
    R, mu = 0.1, 0.5
    disk = Solid(("cylinder", R, 0.02), 1.0, p=(0.0, 0.0, 0.01), w=(0.0, 0.0, 20.0))
    engine.start(Scene([GROUND, disk], friction=mu, hydroelastic=1e7 if patch else None))
    engine.advance(0.05)
    start = engine.velocities()[0, 2]
    engine.advance(0.1)
    a = (start - engine.velocities()[0, 2]) / 0.1
    return {"spin_patch" if patch else "spin": abs(a / (4.0 / 3.0 * mu * G / R) - 1.0)}


def peg(engine) -> dict[str, float]:
    """A square peg falls into a hole with half a millimetre of play on each side, and stands on its floor."""
    a, wall, play, deep = 0.04, 0.04, 0.0005, 0.08
    at = 0.5 * a + play + 0.5 * wall
    size = a + 2.0 * (play + wall)
    sides = [Solid(("box", wall, size, deep), p=(x * at, 0.0, 0.5 * deep)) for x in (-1.0, 1.0)]
    sides += [Solid(("box", size, wall, deep), p=(0.0, y * at, 0.5 * deep)) for y in (-1.0, 1.0)]
    solid = Solid(("box", a, a, 0.1), 0.5, p=(0.0002, -0.0001, 0.05 + deep + 0.002), rpy=(0.003, -0.002, 0.001))
    engine.start(Scene([GROUND, *sides, solid], friction=0.2))
    engine.advance(3.0)
    down = abs(engine.positions()[0, 2] - 0.05) < 1e-4
    return {"peg": np.linalg.norm(engine.rotations()[0][:2, 2]) if down else np.inf}


def balls(engine) -> dict[str, float]:
    """6 x 6 x 6 balls of 10 kg without friction fall apart (SimBenchmark's "666").

    They sink in; and as nothing pushes along the ground, their momentum along it stays zero.
    """
    rng, r = np.random.default_rng(6), 0.05
    solids = [GROUND]
    for k in range(216):
        at = np.array([k % 6 - 2.5, k // 6 % 6 - 2.5, k // 36 + 0.5]) * 2.0 * r
        aside = np.array([*rng.uniform(-1e-3, 1e-3, 2), 1e-3 * (k // 36)])
        solids.append(Solid(("sphere", r), 10.0, p=tuple(at + aside)))
    engine.start(Scene(solids, friction=0.0))
    depth = momentum = 0.0
    for _ in range(20):
        engine.advance(0.05)
        depth = max(depth, engine.depth_and_contacts()[0])
        momentum = max(momentum, np.abs(10.0 * engine.velocities()[:, 3:5].sum(axis=0)).max())
    return {"balls": depth, "balls_momentum": momentum}


def grip(engine) -> dict[str, float]:
    """Two fingers hold a box of 0.5 kg by friction, with four times the force it takes: how far it slips in 10 s."""
    finger, box = ("box", 0.02, 0.04, 0.04), ("box", 0.05, 0.05, 0.05)
    hand = [Solid(finger, 0.2, p=(x * 0.035, 0.0, 0.5), axis=(1.0, 0.0, 0.0), force=-20.0 * x) for x in (-1.0, 1.0)]
    engine.start(Scene([*hand, Solid(box, 0.5, p=(0.0, 0.0, 0.5))]))
    engine.advance(0.5)
    start = engine.positions()[2, 2]
    engine.advance(10.0)
    return {"grip": abs(engine.positions()[2, 2] - start)}


ROWS = {
    "rest_depth": ("cube of 1 kg at rest: depth", "m"),
    "creep": ("box that friction holds on a slope: creep", "m/s"),
    "slide_1ms": ("box slides down a slope, 1 ms: acceleration", ""),
    "sink_1ms": ("the same: deeper than at rest under that load", "m"),
    "lift_1ms": ("the same: higher than at rest", "m"),
    "slide_5ms": ("box slides down a slope, 5 ms: acceleration", ""),
    "sink_5ms": ("the same: deeper than at rest under that load", "m"),
    "lift_5ms": ("the same: higher than at rest", "m"),
    "roll": ("sliding ball comes to roll: speed, 5/7 rule", ""),
    "tumble": ("two boxes tumble and collide: angular momentum", ""),
    "stack_10": ("ten boxes, 10 s: moved aside", "m"),
    "stack_10_speed": ("the same: fastest", "m/s, rad/s"),
    "stack_30": ("thirty boxes, 10 s: moved aside", "m"),
    "stack_30_speed": ("the same: fastest", "m/s, rad/s"),
    "drops": ("100 dropped cubes: part that still turns (1e-9 rad/s) after 6 s", ""),
    "bounce": ("ball on a spring, 0.1 ms, ω h = 0.01: height of the bounce", ""),
    "bounce_1ms": ("the same, 1 ms, ω h = 0.1", ""),
    "bounce_damped": ("the same, 0.1 ms, with Hunt and Crossley's damping", ""),
    "spin": ("disk spins on its face, points: braking torque", ""),
    "spin_patch": ("the same, hydroelastic", ""),
    "peg": ("peg in a hole: tilt", "rad"),
    "balls": ("6 x 6 x 6 balls without friction fall apart: depth", "m"),
    "balls_momentum": ("the same: momentum along the ground", "kg m/s"),
    "grip": ("two fingers hold a box for 10 s: slip", "m"),
}
"""What each deviation is, and its unit (none: relative); in the order of the table."""

QUICK = {
    "rest": rest,
    "creep": creep,
    "slide": slide,
    "slide 5 ms": lambda engine: slide(engine, 5e-3),
    "roll": roll,
    "tumble": tumble,
    "bounces": bounces,
    "spin": spin,
    "spin on a patch": lambda engine: spin(engine, patch=True),
    "peg": peg,
    "grip": grip,
}
"""Scenes that Drake runs within seconds."""

LONG = {
    "stack of 10": lambda engine: stack(engine, 10),
    "stack of 30": lambda engine: stack(engine, 30),
    "drops": drops,
    "balls": balls,
}
"""Scenes that take Drake ten seconds to minutes."""
