"""Energy and powers of springs, door hinges and struts, on numbers, duals and symbols, after a write and in a copy."""

import importlib

import numpy as np
import pytest

pytest.importorskip("pydrake")
pytestmark = pytest.mark.peer

OURS, DRAKE = LIBRARIES = [importlib.import_module(f"{name}.all") for name in ("sheldrake", "pydrake")]
ASKED = "CalcPotentialEnergy", "CalcConservativePower", "CalcNonConservativePower", "EvalPotentialEnergy"


def mechanism(m):
    """Two links on a slider, with one of each force element."""
    plant = m.MultibodyPlant(0.0)
    M = m.SpatialInertia(1.5, [0.0, 0.02, 0.1], m.UnitInertia(0.03, 0.03, 0.02))
    cart, upper, lower = (plant.AddRigidBody(name, M) for name in ("cart", "upper", "lower"))
    rail = plant.AddJoint(m.PrismaticJoint("rail", plant.world_frame(), cart.body_frame(), [1, 0, 0]))
    hip = plant.AddJoint(m.RevoluteJoint("hip", cart.body_frame(), upper.body_frame(), [0, 1, 0]))
    ankle = plant.AddFrame(m.FixedOffsetFrame("ankle", upper.body_frame(), m.RigidTransform([0.0, 0.0, 0.4])))
    knee = plant.AddJoint(m.RevoluteJoint("knee", ankle, lower.body_frame(), [0, 1, 0]))
    plant.AddForceElement(m.PrismaticSpring(rail, 0.1, 30.0))
    plant.AddForceElement(m.RevoluteSpring(hip, 0.2, 4.0))
    plant.AddForceElement(m.LinearSpringDamper(plant.world_body(), [0.1, 0, 1], lower, [0, 0.1, 0.2], 0.3, 50.0, 2.0))
    config = m.DoorHingeConfig()
    config.spring_constant, config.catch_torque, config.catch_width = 3.0, 5.0, 0.4
    config.dynamic_friction_torque, config.static_friction_torque, config.viscous_friction = 0.3, 0.5, 0.2
    plant.AddForceElement(m.DoorHinge(knee, config))
    plant.Finalize()
    return plant


def numbers(value):
    return np.array([value.value(), *value.derivatives()]) if hasattr(value, "derivatives") else value


@pytest.mark.parametrize("name", ASKED)
def test_on_numbers_and_duals(name):
    random = np.random.default_rng(5)
    plants = [mechanism(m) for m in LIBRARIES]
    duals = [plant.ToAutoDiffXd() for plant in plants]
    contexts = [plant.CreateDefaultContext() for plant in (*plants, *duals)]
    for _ in range(5):
        x = random.uniform(-0.7, 0.7, 6)
        found = []
        for m, plant, context in zip((OURS, DRAKE) * 2, (*plants, *duals), contexts):
            state = m.InitializeAutoDiff(x).ravel() if plant in duals else x
            plant.SetPositionsAndVelocities(context, state)
            found.append(numbers(getattr(plant, name)(context)))
        assert found[0] == pytest.approx(found[1], rel=1e-12, abs=1e-12)
        np.testing.assert_allclose(found[2], found[3], rtol=1e-10, atol=1e-11)


def test_conservative_power_is_what_potential_energy_loses():
    plant = mechanism(OURS).ToAutoDiffXd()
    context = plant.CreateDefaultContext()
    q, v = np.array([0.2, 0.5, 0.1]), np.array([0.3, -0.4, 0.6])
    plant.SetPositions(context, OURS.InitializeAutoDiff(q, gradient=v.reshape(-1, 1)).ravel())
    plant.SetVelocities(context, v)
    rate = plant.CalcPotentialEnergy(context).derivatives()[0]
    assert plant.CalcConservativePower(context).value() == pytest.approx(-rate, rel=1e-13)


def test_of_symbols():
    plant, symbolic = mechanism(OURS), mechanism(OURS).ToSymbolic()
    x = [OURS.Variable(f"x{i}") for i in range(6)]
    at = dict(zip(x, [0.2, 0.5, 0.7, 0.3, -0.4, 0.6]))  # the knee is beyond the catch
    context, formulas = plant.CreateDefaultContext(), symbolic.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, list(at.values()))
    symbolic.SetPositionsAndVelocities(formulas, x)
    for name in ASKED:
        value = getattr(symbolic, name)(formulas).Evaluate(at)
        assert value == pytest.approx(getattr(plant, name)(context), rel=1e-12)


def test_a_bushing_has_no_energy():
    plant = OURS.MultibodyPlant(0.0)
    body = plant.AddRigidBody("body", OURS.SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    frames, constants = (plant.world_frame(), body.body_frame()), [[1.0] * 3] * 4
    plant.AddForceElement(OURS.LinearBushingRollPitchYaw(*frames, *constants))
    plant.Finalize()
    for name in ASKED:
        with pytest.raises(NotImplementedError, match="not the gradient of a potential energy"):
            getattr(plant, name)(plant.CreateDefaultContext())
