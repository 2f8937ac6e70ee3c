"""Energies and powers are plain floats, as pydrake's: their repr() in a list shows nothing of NumPy."""

import importlib

import numpy as np
import pytest

pytest.importorskip("pydrake")

pytestmark = pytest.mark.peer

CALLS = ("CalcPotentialEnergy", "CalcKineticEnergy", "CalcConservativePower", "CalcNonConservativePower")


def energies(library):
    m = importlib.import_module(f"{library}.all")
    examples = importlib.import_module(f"{library}.examples")
    plant = m.MultibodyPlant(0.0)
    body = plant.AddRigidBody("b", m.SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    plant.AddJoint(m.PrismaticJoint("j", plant.world_frame(), body.body_frame(), [0, 0, 1.0]))
    plant.AddForceElement(m.LinearSpringDamper(plant.world_body(), [0.1, 0, 0], body, [0, 0, 0], 0.3, 10.0, 2.0))
    plant.Finalize()
    found = []
    for system in (plant, examples.AcrobotPlant()):
        context = system.CreateDefaultContext()
        n = context.num_continuous_states()
        context.SetContinuousState(0.1 + 0.2 * np.arange(n))
        found += [getattr(system, call)(context) for call in CALLS]
    return found


def test_energies_are_floats():
    ours, theirs = energies("sheldrake"), energies("pydrake")
    assert [type(value) for value in ours] == [type(value) for value in theirs]
    np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-14)
