"""Derivatives of discrete steps with contact, at rest or not, against finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff, _complex_step
from sheldrake.common._native import store as kernel_store
from sheldrake.common.kernel import jit_enabled, kernel
from sheldrake.geometry import AddContactMaterial, Box, HalfSpace, ProximityProperties, Sphere
from sheldrake.math import RigidTransform
from sheldrake.multibody.contact_solvers import _arrays
from sheldrake.multibody.contact_solvers._kernels import newton
from sheldrake.multibody.contact_solvers._kernels.problem import SOLVED
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction, DiscreteContactApproximation
from sheldrake.multibody.tree import PrismaticJoint, SpatialInertia
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.framework._engine import complex_rows
from sheldrake.systems.primitives import Linearize

DT = 1e-3
FRICTION = CoulombFriction(0.5, 0.5)
APPROXIMATIONS = ["kLagged", "kSimilar", "kSap", "kTamsi"]
BODIES = ["box", "two balls", "two balls as in Drake"]
MOTIONS = ["at rest", "still", "creeping", "sliding", "falling"]
STATES = 20  # of each motion; 1,200 in all
TOLERANCE = {"kTamsi": 1e-4}  # its iterations stop where velocities change by 1e-6 m/s


@kernel
def no_slopes(model, problem, contacts, rows, factor, excess):
    return SOLVED


@pytest.fixture(autouse=True)
def exact(monkeypatch):
    """Solutions to round-off: their differences are derivatives."""
    for name in ("DRAKE_TOLERANCE", "REST_TOLERANCE"):
        monkeypatch.setattr(_arrays, name, 1e-13)


class Scene:
    """Bodies on the ground, in numbers and in duals."""

    def __init__(self, bodies: str, approximation: str):
        builder = DiagramBuilder()
        self.plant, scene_graph = AddMultibodyPlantSceneGraph(builder, DT)
        scene_graph.set_default_point_contact_algorithm("single_point" if "Drake" in bodies else "multi_point")
        self.plant.set_discrete_contact_approximation(getattr(DiscreteContactApproximation, approximation))
        self.plant.SetUseSampledOutputPorts(False)
        self.plant.RegisterCollisionGeometry(self.plant.world_body(), RigidTransform(), HalfSpace(), "ground", FRICTION)
        if bodies == "box":
            self._add("box", SpatialInertia.SolidBoxWithMass(1.0, 0.2, 0.16, 0.1), Box(0.2, 0.16, 0.1))
        else:
            for k in range(2):
                self._add(f"ball{k}", SpatialInertia.SolidSphereWithMass(1.0 + k, 0.1), Sphere(0.1))
        self.plant.Finalize()
        self.diagram = builder.Build()
        self.bodies, self.root = bodies, self.diagram.CreateDefaultContext()
        self.dual = self.diagram.ToAutoDiffXd()
        self.dual_root = self.dual.CreateDefaultContext()

    def _add(self, name, inertia, shape):
        body = self.plant.AddRigidBody(name, inertia)
        self.plant.RegisterCollisionGeometry(body, RigidTransform(), shape, name, FRICTION)

    def step(self, x):
        """x after a step, of numbers or duals."""
        diagram, root = (self.dual, self.dual_root) if x.dtype == object else (self.diagram, self.root)
        root.SetDiscreteState(x)
        return diagram.EvalUniquePeriodicDiscreteUpdate(root).get_vector(0).CopyToVector()

    def state(self, motion, generator):
        """A random state of a kind."""
        depth = generator.uniform(1e-5, 3e-4)
        if self.bodies == "box":
            q = np.array([1.0, *generator.uniform(-5e-4, 5e-4, 2), 0.0, *generator.uniform(-1, 1, 2), 0.05 - depth])
        else:
            angle, lift = generator.uniform(0, 7), generator.uniform(0.0, 0.15)
            apart = np.sqrt((0.2 - depth) ** 2 - lift**2)
            other = [apart * np.cos(angle), apart * np.sin(angle), 0.1 - depth + lift]
            q = np.array([1.0, 0, 0, 0, 0, 0, 0.1 - depth, *self._turn(generator), *other])
        v = np.zeros(self.plant.num_velocities())
        if motion == "falling":
            q[6::7] += 0.1
        if motion == "at rest":
            x = np.concatenate([q, v])
            for _ in range(500 if self.bodies == "box" else 5):
                x = self.step(x)
            return np.concatenate([x[: len(q)], v])
        size = {"still": 0.0, "creeping": 10 ** generator.uniform(-7, -4), "sliding": 0.5, "falling": 1.0}[motion]
        return np.concatenate([q, size * generator.uniform(-1, 1, len(v))])

    def _turn(self, generator):
        w = generator.normal(size=4)
        return w / np.linalg.norm(w)

    def differences(self, x, h):
        """Slopes to both sides, (before, after), one column for each number of x."""
        here, n = self.step(x), len(x)
        before, after = np.zeros((n, n)), np.zeros((n, n))
        for i in range(n):
            for sign, slopes in ((-1.0, before), (1.0, after)):
                moved = x.copy()
                moved[i] += sign * h
                slopes[:, i] = sign * (self.step(moved) - here) / h
        return before, after


def error(scene, x, gradient):
    """How far derivatives are from the finite differences to one side, the other, or both, relative to the largest."""
    least = np.inf
    for h in (1e-6, 1e-7, 1e-8):
        before, after = scene.differences(x, h)
        low, high = np.minimum(before, after), np.maximum(before, after)
        off = np.maximum(np.maximum(low - gradient, gradient - high), 0.0)
        off = np.minimum(off, np.abs(gradient - 0.5 * (before + after)))
        least = min(least, np.max(off) / max(1.0, np.max(np.abs(gradient))))
    return least


def assert_derivatives(scene, x, tolerance):
    out = scene.step(InitializeAutoDiff(x)[:, 0])
    np.testing.assert_allclose(ExtractValue(out)[:, 0], scene.step(x), rtol=0, atol=1e-10)
    assert error(scene, x, ExtractGradient(out)) < tolerance


@pytest.fixture
def in_python(monkeypatch):
    monkeypatch.setattr(complex_rows, "_calls", {})
    monkeypatch.setattr(_complex_step, "PATIENCE", 10**9)
    monkeypatch.setattr(kernel_store, "is_ready", lambda kernel: False)


@pytest.mark.skipif(not jit_enabled(), reason="a thousand states take machine code")
@pytest.mark.parametrize("approximation", APPROXIMATIONS)
@pytest.mark.parametrize("bodies", BODIES)
def test_random_states(monkeypatch, bodies, approximation):
    monkeypatch.setattr(complex_rows, "_calls", {})
    monkeypatch.setattr(_complex_step, "PATIENCE", 0)
    scene, generator = Scene(bodies, approximation), np.random.default_rng(1)
    for motion in MOTIONS:
        for _ in range(STATES):
            assert_derivatives(scene, scene.state(motion, generator), TOLERANCE.get(approximation, 1e-7))
    assert scene.dual_root._store.left, "it ran as machine code"


@pytest.mark.parametrize("approximation", APPROXIMATIONS)
@pytest.mark.parametrize("bodies", BODIES)
def test_random_states_in_python(in_python, bodies, approximation):
    scene, generator = Scene(bodies, approximation), np.random.default_rng(2)
    for motion in ("at rest", "still", "sliding"):
        assert_derivatives(scene, scene.state(motion, generator), TOLERANCE.get(approximation, 1e-7))
    assert not scene.dual_root._store.left


def test_a_planted_fault_is_seen(in_python, monkeypatch):
    """What takes no iteration has no derivatives, as it was."""
    monkeypatch.setattr(newton, "with_slopes", no_slopes)
    scene = Scene("box", "kLagged")
    x = scene.state("at rest", np.random.default_rng(3))
    assert error(scene, x, ExtractGradient(scene.step(InitializeAutoDiff(x)[:, 0]))) > 0.1


@pytest.mark.parametrize("approximation", ["kLagged", "kSimilar"])
def test_linear_model_at_rest(approximation):
    """A ball that rests on the ground and can slide along x: friction is a damper of mu N / v_s there."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, DT)
    scene_graph.set_default_point_contact_algorithm("single_point")
    plant.set_discrete_contact_approximation(getattr(DiscreteContactApproximation, approximation))
    plant.SetUseSampledOutputPorts(False)
    ball, depth, stiffness = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(1.0, 0.1)), 1e-3, 1e4
    plant.AddJoint(PrismaticJoint("x", plant.world_frame(), ball.body_frame(), [1.0, 0.0, 0.0]))
    plant.AddJointActuator("push", plant.GetJointByName("x"))
    properties = ProximityProperties()
    AddContactMaterial(dissipation=0.0, point_stiffness=2.0 * stiffness, friction=FRICTION, properties=properties)
    plant.RegisterCollisionGeometry(ball, RigidTransform(), Sphere(0.1), "ball", properties)
    ground = RigidTransform([0.0, 0.0, depth - 0.1])
    plant.RegisterCollisionGeometry(plant.world_body(), ground, HalfSpace(), "ground", properties)
    plant.Finalize()
    builder.ExportInput(plant.get_actuation_input_port())
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    diagram.get_input_port().FixValue(root, [0.0])
    model = Linearize(diagram, root)
    kept = 1.0 / (1.0 + DT * 0.5 * stiffness * depth / 1e-4)
    np.testing.assert_allclose(model.A(), [[1.0, DT * kept], [0.0, kept]], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(model.B(), [[DT**2 * kept], [DT * kept]], rtol=1e-12, atol=1e-15)
