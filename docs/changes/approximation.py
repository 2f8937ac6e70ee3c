"""Linear contact: a spring and a damper with a relaxation time, chosen by name, in steps, at rest and sliding."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from sheldrake.geometry import AddContactMaterial, Box, HalfSpace, ProximityProperties, Shape, Sphere
from sheldrake.math import RigidTransform
from sheldrake.multibody.contact_solvers._kernels.laws import linear_cost, linear_impulse
from sheldrake.multibody.math import SpatialVelocity
from sheldrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlantConfig
from sheldrake.multibody.tree import SpatialInertia
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder

DT, G, MASS, MU, STIFFNESS, RELAXATION = 1e-3, 9.81, 2.0, 0.4, 1e4, 0.02

# The impulse is the slope of the cost, whatever the velocity: what the solver's line search lives on.
contact = SimpleNamespace(
    stiffness=STIFFNESS, relaxation=RELAXATION, depth=1e-3, friction=MU, n0=0.02, eps=1e-3, fe0=0.0, dissipation=0.0,
    back=0.0,
)  # fmt: skip
for vc in np.random.default_rng(0).normal(0.0, 0.1, (50, 3)):
    gamma, _ = linear_impulse(contact, DT, vc)
    steps = 1e-6 * np.eye(3)
    slope = [(linear_cost(contact, DT, vc + h) - linear_cost(contact, DT, vc - h)) / 2e-6 for h in steps]
    np.testing.assert_allclose(slope, -np.array(gamma), rtol=1e-5, atol=1e-7)


def body_on_ground(shape: Shape, z: float, v: tuple[float, float, float]) -> tuple[Simulator, list[np.ndarray]]:
    """A simulator, and a list whose last item is the state, as [q, v]."""
    builder = DiagramBuilder()
    config = MultibodyPlantConfig(time_step=DT, discrete_contact_approximation="linear")
    plant, _ = AddMultibodyPlant(config, builder)
    material = ProximityProperties()
    AddContactMaterial(point_stiffness=2.0 * STIFFNESS, friction=CoulombFriction(MU, MU), properties=material)
    material.AddProperty("material", "relaxation_time", RELAXATION / 2.0)
    body = plant.AddRigidBody("body", SpatialInertia.SolidBoxWithMass(MASS, 0.2, 0.2, 0.1))
    plant.RegisterCollisionGeometry(body, RigidTransform(), shape, "shape", material)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", material)
    plant.Finalize()
    simulator = Simulator(builder.Build())
    context = plant.GetMyContextFromRoot(simulator.get_mutable_context())
    plant.SetFreeBodyPose(context, body, RigidTransform([0.0, 0.0, z]))
    plant.SetFreeBodySpatialVelocity(context, body, SpatialVelocity([0.0, 0.0, 0.0], v))
    states: list[np.ndarray] = []
    simulator.set_monitor(lambda _: states.append(plant.GetPositionsAndVelocities(context)))
    return simulator, states


# One step in contact: m (v+ - v + g dt) = dt k (depth - (dt + tau) v+).
depth, v = 1e-3, -0.3
simulator, states = body_on_ground(Sphere(0.1), 0.1 - depth, (0.0, 0.0, v))
simulator.AdvanceTo(DT)
softness = DT * STIFFNESS * (DT + RELAXATION)
expected = (MASS * (v - G * DT) + DT * STIFFNESS * depth) / (MASS + softness)
np.testing.assert_allclose(states[-1][-1], expected, rtol=1e-9)

# At rest its weight is the spring's force.
simulator.AdvanceTo(2.0)
np.testing.assert_allclose(0.1 - states[-1][6], MASS * G / STIFFNESS, rtol=1e-6)

# What slides stops where Coulomb says, and then lies still.
speed = 1.0
lying = 0.05 - MASS * G / STIFFNESS / 4.0  # four corners bear it
simulator, states = body_on_ground(Box(0.2, 0.2, 0.1), lying, (speed, 0.0, 0.0))
simulator.AdvanceTo(1.0)
np.testing.assert_allclose(states[-1][4], speed**2 / (2.0 * MU * G), rtol=0.01)
assert np.abs(states[-1][7:]).max() < 1e-6
print("ok")
