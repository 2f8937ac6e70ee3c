"""Motions of multibody plants whose answer is known, and how far a library is from it.

Each function makes its plant with a library, `Library("sheldrake")` or `Library("pydrake")`, runs it with a scheme and
a step, and returns one deviation: zero is right, nothing is negative. Tests and the table in docs/motions.md use the
same functions.
"""

from __future__ import annotations

import functools
import importlib
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

G = 9.81  # [m/s²], of pydrake's UniformGravityFieldElement
EULER, RK2, RK3, DISCRETE = "explicit Euler", "Runge-Kutta 2", "Runge-Kutta 3", "discrete plant"
FLAGS = {EULER: "explicit_euler", RK2: "runge_kutta2", RK3: "runge_kutta3"}


class Library:
    """sheldrake or pydrake: the names of its `all` module as attributes."""

    def __init__(self, name: str):
        self.name = name
        self._all = importlib.import_module(f"{name}.all")

    def __getattr__(self, name: str) -> Any:
        return getattr(self._all, name)

    def plant(self, scheme: str, step: float, gravity: bool = True) -> Any:
        """An empty plant: a discrete one steps by itself."""
        plant = self.MultibodyPlant(step if scheme == DISCRETE else 0.0)
        if not gravity:
            plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
        return plant

    def advance(self, plant: Any, context: Any, T: float, scheme: str, step: float) -> None:
        """Runs a plant to time T [s] with fixed steps."""
        simulator = self.Simulator(plant, context)
        if scheme != DISCRETE:
            integrator = self.ResetIntegratorFromFlags(simulator, FLAGS[scheme], step)
            integrator.set_fixed_step_mode(True)
        simulator.AdvanceTo(T)


def momentum(plant: Any, context: Any) -> np.ndarray:
    """Spatial momentum about the world's origin, angular first."""
    return plant.CalcSpatialMomentumInWorldAboutPoint(context, np.zeros(3)).get_coeffs().ravel()


def energy(plant: Any, context: Any) -> float:
    return plant.CalcKineticEnergy(context) + plant.CalcPotentialEnergy(context)


def rods(lib: Library, plant: Any, n: int, length: float = 0.7, free: bool = False) -> Any:
    """n rods hinged one to the next, the first to the world, or free and about crossed axes; the plant's context."""
    make = lib.SpatialInertia.SolidCylinderWithMassAboutEnd if free else lib.SpatialInertia.ThinRodWithMassAboutEnd
    inertia = make(0.4, *((0.1,) if free else ()), length, [0, 0, -1])
    parent, X_PF = plant.world_body(), lib.RigidTransform()
    for k in range(n):
        body = plant.AddRigidBody(f"rod{k}", inertia)
        if k or not free:
            axis = [[0, 1, 0], [1, 0, 0]][k % 2] if free else [0, 1, 0]
            frame = plant.AddFrame(lib.FixedOffsetFrame(f"end{k}", parent.body_frame(), X_PF))
            plant.AddJoint(lib.RevoluteJoint(f"hinge{k}", frame, body.body_frame(), axis))
        parent, X_PF = body, lib.RigidTransform([0, 0, -length])
    plant.Finalize()
    return plant.CreateDefaultContext()


# --- the motions


def pendulum(lib: Library, scheme: str, step: float, amplitude: float) -> float:
    """A rod swings from rest for the time of the elliptic integral: how late it comes to rest, relative to that."""
    from scipy.special import ellipk

    length = 0.7
    plant = lib.plant(scheme, step)
    context = rods(lib, plant, 1, length)
    period = 4.0 * np.sqrt(2 * length / (3 * G)) * ellipk(np.sin(amplitude / 2) ** 2)
    plant.SetPositions(context, [amplitude])
    lib.advance(plant, context, period, scheme, step)
    angle, rate = plant.GetPositionsAndVelocities(context)
    acceleration = -1.5 * G / length * np.sin(angle)
    return abs(rate / acceleration) / period


def top(lib: Library, scheme: str, step: float) -> float:
    """A torque-free body tumbles from its middle axis for 8 s: change of energy or angular momentum, relative."""
    plant = lib.plant(scheme, step, gravity=False)
    body = plant.AddRigidBody("top", lib.SpatialInertia(2.0, [0, 0, 0], lib.UnitInertia(1.0, 2.0, 2.5)))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetFreeBodySpatialVelocity(context, body, lib.SpatialVelocity([0.05, 1.5, 0.1], [0.1, 0.2, 0.3]))
    H, E = momentum(plant, context)[:3], energy(plant, context)
    lib.advance(plant, context, 8.0, scheme, step)
    return max(
        np.linalg.norm(momentum(plant, context)[:3] - H) / np.linalg.norm(H), abs(energy(plant, context) - E) / E
    )


def double_pendulum(lib: Library, scheme: str, step: float) -> float:
    """Two rods swing over for 2 s: change of energy [J]; the rods' potential energy spans 16 J."""
    plant = lib.plant(scheme, step)
    context = rods(lib, plant, 2)
    plant.SetPositionsAndVelocities(context, [2.0, -1.0, 0.5, 1.0])
    E = energy(plant, context)
    lib.advance(plant, context, 2.0, scheme, step)
    return abs(energy(plant, context) - E)


def chain(lib: Library, scheme: str, step: float, part: slice) -> float:
    """Five free rods move about each other for 1 s: change of (a part of) the spatial momentum."""
    plant = lib.plant(scheme, step, gravity=False)
    context = rods(lib, plant, 5, free=True)
    plant.SetVelocities(context, np.random.default_rng(5).normal(size=plant.num_velocities()))
    before = momentum(plant, context)
    lib.advance(plant, context, 1.0, scheme, step)
    return np.abs(momentum(plant, context) - before)[part].max()


def screw(lib: Library, scheme: str, step: float) -> float:
    """A nut falls on its thread for 0.5 s: error of its angle, relative; a discrete plant's is that of its steps."""
    mass, about_axis, pitch, T = 0.5, 0.5 * 0.004, 0.3, 0.5
    plant = lib.plant(scheme, step)
    nut = plant.AddRigidBody("nut", lib.SpatialInertia(mass, [0, 0, 0], lib.UnitInertia(0.003, 0.003, 0.004)))
    thread = lib.ScrewJoint("thread", plant.world_frame(), nut.body_frame(), [0, 0, 1], pitch, 0.0)
    thread = plant.AddJoint(thread)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    lead = pitch / (2 * np.pi)
    lib.advance(plant, context, T, scheme, step)
    angle = thread.get_rotation(context)
    z = plant.EvalBodyPoseInWorld(context, nut).translation()[2]
    assert abs(z - lead * angle) < 1e-12
    T = np.sqrt(T * (T + step)) if scheme == DISCRETE else T  # symplectic Euler at constant acceleration
    expected = -0.5 * mass * G * lead / (about_axis + mass * lead**2) * T**2
    return abs(angle / expected - 1.0)


def coupler(lib: Library, scheme: str, step: float) -> float:
    """A motor turns two coupled wheels for 0.4 s: error of the ratio between them [rad]."""
    ratio, offset, I = -2.5, 0.3, 0.01
    plant = lib.plant(scheme, step)
    M = lib.SpatialInertia(1.0, [0, 0, 0], lib.UnitInertia(I, I, I))
    wheels = [plant.AddRigidBody(name, M) for name in ("driven", "driving")]
    driven, driving = (
        plant.AddJoint(lib.RevoluteJoint(b.name(), plant.world_frame(), b.body_frame(), [0, 0, 1])) for b in wheels
    )
    plant.AddCouplerConstraint(driven, driving, ratio, offset)
    plant.AddJointActuator("motor", driving)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.get_actuation_input_port().FixValue(context, [0.02])
    driven.set_angle(context, offset)
    lib.advance(plant, context, 0.4, scheme, step)
    return abs(driven.get_angle(context) - ratio * driving.get_angle(context) - offset)


def spring(lib: Library, scheme: str, step: float) -> float:
    """2 kg on a spring of 50 N/m, 1 s: error of the phase it has come to [rad], where one vibration is 2 π."""
    plant = lib.plant(scheme, step)
    body = plant.AddRigidBody("body", lib.SpatialInertia(2.0, [0, 0, 0], lib.UnitInertia(1.0, 1.0, 1.0)))
    slide = plant.AddJoint(lib.PrismaticJoint("slide", plant.world_frame(), body.body_frame(), [1, 0, 0]))
    plant.AddForceElement(lib.PrismaticSpring(slide, 0.1, 50.0))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, [0.4])
    omega, T = np.sqrt(50.0 / 2.0), 1.0

    def phase() -> float:
        x, v = plant.GetPositionsAndVelocities(context)
        if scheme == DISCRETE:  # velocities of symplectic Euler are those of half a step before
            v -= 0.5 * step * omega**2 * (x - 0.1)
        return np.arctan2(-v / omega, x - 0.1)

    start = phase()
    lib.advance(plant, context, T, scheme, step)
    return abs((phase() - start - omega * T + np.pi) % (2 * np.pi) - np.pi)


class Row(NamedTuple):
    """A line of the table.

    Attributes:
        what: The motion and its deviation, with unit.
        scheme: How it is integrated.
        steps: Steps [s], each half of the one before; the deviation shown is that of the last.
        deviation: Of a library with a scheme and a step.
        order: What the deviation's power of the step must be; None where it is round-off.
    """

    what: str
    scheme: str
    steps: tuple[float, ...]
    deviation: Callable[[Library, str, float], float]
    order: int | None


def _rows(key: str, what: str, function: Callable, coarse: dict[str, tuple[float, int | None]]) -> dict[str, Row]:
    return {
        f"{key}, {scheme}": Row(what, scheme, (step, step / 2, step / 4), function, order)
        for scheme, (step, order) in coarse.items()
    }


ROWS = {
    **_rows("pendulum 0.2", "pendulum, 0.2 rad: period", functools.partial(pendulum, amplitude=0.2), {RK3: (8e-3, 3)}),
    **_rows("pendulum 1.5", "pendulum, 1.5 rad: period", functools.partial(pendulum, amplitude=1.5), {RK3: (8e-3, 3)}),
    **_rows("pendulum 2.9", "pendulum, 2.9 rad: period", functools.partial(pendulum, amplitude=2.9), {RK3: (8e-3, 3)}),
    **_rows(
        "top",
        "tumbling top, 8 s: energy, angular momentum",
        top,
        {EULER: (0.02, 1), RK2: (0.02, 2), RK3: (0.02, 3), DISCRETE: (4e-3, 1)},
    ),
    **_rows("double", "double pendulum, 2 s: energy [J]", double_pendulum, {RK3: (4e-3, 3), DISCRETE: (4e-3, 1)}),
    **_rows(
        "chain, angular",
        "five free rods, 1 s: angular momentum [kg m²/s]",
        functools.partial(chain, part=slice(0, 3)),
        {RK3: (8e-3, 3), DISCRETE: (4e-3, 1)},
    ),
    **_rows(
        "chain, linear",
        "five free rods, 1 s: momentum [kg m/s]",
        functools.partial(chain, part=slice(3, 6)),
        {RK3: (8e-3, 3), DISCRETE: (4e-3, 1)},
    ),
    **_rows("screw", "nut on a screw, 0.5 s: angle", screw, {RK3: (4e-3, None), DISCRETE: (4e-3, None)}),
    **_rows("coupler", "coupled wheels, 0.4 s: ratio [rad]", coupler, {DISCRETE: (4e-3, 2)}),
    **_rows("spring", "mass on a spring, 1 s: phase [rad]", spring, {RK3: (4e-3, 4), DISCRETE: (4e-3, 2)}),
}


def measure(row: Row, library: str) -> tuple[float, float | None]:
    """The deviation with the finest step, and the measured order; None where the deviations are round-off."""
    lib = Library(library)
    deviations = [float(row.deviation(lib, row.scheme, step)) for step in row.steps]
    if max(deviations) < 1e-11:
        return deviations[-1], None
    return deviations[-1], float(np.polyfit(np.log(row.steps), np.log(np.maximum(deviations, 1e-300)), 1)[0])
