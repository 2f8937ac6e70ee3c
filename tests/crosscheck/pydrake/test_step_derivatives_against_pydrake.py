"""Derivatives of discrete steps with contact equal pydrake's: at rest, nearly, and moving."""

import importlib

import numpy as np
import pytest

pytest.importorskip("pydrake")

from random_plants import pydrake, sheldrake

from sheldrake.geometry._state.state import GeometryState

pytestmark = pytest.mark.peer
DT = 1e-3


@pytest.fixture(autouse=True)
def single_points(monkeypatch):
    monkeypatch.setattr(GeometryState, "point_contact_algorithm", "single_point")


def motion_of(lib, approximation, slides_alone=False):
    """A diagram with two balls on the ground, or one that only slides, pushed; and a function of x: A and B there."""
    geometry = importlib.import_module(f"{lib.library}.geometry")
    primitives = importlib.import_module(f"{lib.library}.systems.primitives")
    builder = lib.DiagramBuilder()
    plant, _ = lib.AddMultibodyPlantSceneGraph(builder, DT)
    plant.set_discrete_contact_approximation(getattr(lib.DiscreteContactApproximation, approximation))
    plant.SetUseSampledOutputPorts(False)
    friction, world = lib.CoulombFriction(0.5, 0.5), plant.world_body()
    ground = lib.RigidTransform([0.0, 0.0, -0.0999 if slides_alone else 0.0])
    plant.RegisterCollisionGeometry(world, ground, geometry.HalfSpace(), "ground", friction)
    for k in range(1 if slides_alone else 2):
        body = plant.AddRigidBody(f"ball{k}", lib.SpatialInertia.SolidSphereWithMass(1.0 + k, 0.1))
        plant.RegisterCollisionGeometry(body, lib.RigidTransform(), geometry.Sphere(0.1), f"ball{k}", friction)
        joint = lib.PrismaticJoint("x", world.body_frame(), body.body_frame(), [1.0, 0.0, 0.0])
        if slides_alone:
            plant.AddJointActuator("push", plant.AddJoint(joint))
    plant.Finalize()
    if slides_alone:
        builder.ExportInput(plant.get_actuation_input_port())
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    if slides_alone:
        diagram.get_input_port(0).FixValue(root, [0.0])

    def slopes(x):
        root.SetDiscreteState(x)
        model = primitives.FirstOrderTaylorApproximation(diagram, root)
        return model.A(), model.B(), model.f0()

    return slopes


def random_state(speed, rng):
    depth, lift, angle = rng.uniform(1e-5, 3e-4), rng.uniform(0.0, 0.1), rng.uniform(0.0, 7.0)
    apart = np.sqrt((0.2 - depth) ** 2 - lift**2)
    turn = rng.normal(size=4)
    other = [apart * np.cos(angle), apart * np.sin(angle), 0.1 - depth + lift]
    q = [1.0, 0, 0, 0, 0, 0, 0.1 - depth, *turn / np.linalg.norm(turn), *other]
    return np.concatenate([q, speed * rng.uniform(-1, 1, 12)])


def assert_same(ours, theirs, rtol):
    for a, b in zip(ours, theirs):
        np.testing.assert_allclose(a, b, rtol=0, atol=rtol * max(1e-6, np.abs(b).max(initial=0.0)))


@pytest.mark.parametrize("approximation", ["kLagged", "kSimilar", "kSap", "kTamsi"])
@pytest.mark.parametrize("speed", [0.0, 1e-5, 1e-2, 1.0])
def test_two_balls(approximation, speed):
    """Both stop where the residual is a millionth of the momentum, kTamsi where velocities change by 1e-6 m/s."""
    ours, theirs = (motion_of(lib(), approximation) for lib in (sheldrake, pydrake))
    rng = np.random.default_rng(1)
    for _ in range(10):
        x = random_state(speed, rng)
        assert_same(ours(x), theirs(x), 1e-3)


@pytest.mark.parametrize("approximation", ["kLagged", "kSimilar", "kSap", "kTamsi"])
def test_linear_model_of_what_rests(approximation):
    """The step takes no iteration there, yet has derivatives."""
    ours, theirs = (motion_of(lib(), approximation, slides_alone=True) for lib in (sheldrake, pydrake))
    found, expected = ours(np.zeros(2)), theirs(np.zeros(2))
    assert 0.0 < expected[0][1, 1] < 1e-2 and 0.0 < expected[1][1, 0] < 1e-5
    for a, b in zip(found, expected):
        np.testing.assert_allclose(a, b, rtol=1e-8, atol=1e-15)
