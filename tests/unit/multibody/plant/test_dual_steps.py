"""Derivatives of a plant's motion by machine code on complex numbers: what Python on duals gives, and differences."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff, _complex_step
from sheldrake.common._native import store as kernel_store
from sheldrake.common.kernel import jit_enabled
from sheldrake.geometry import HalfSpace, Sphere
from sheldrake.math import RigidTransform
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction, DiscreteContactApproximation
from sheldrake.multibody.tree import PdControllerGains, RevoluteSpring, SpatialInertia
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.framework._engine import complex_rows
from sheldrake.systems.primitives import Linearize

pytestmark = pytest.mark.skipif(not jit_enabled(), reason="asks about machine code; SHELDRAKE_JIT=0 switches it off")

LINK = """<link name="l{k}"><inertial><origin xyz="0.05 0.02 0.1"/><mass value="1.{k}"/>
  <inertia ixx="0.1" iyy="0.12" izz="0.05" ixy="0.001" ixz="0.002" iyz="-0.003"/></inertial></link>"""
JOINT = """<joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{next}"/><origin xyz="0 0.1 0.2"/>
  <axis xyz="{axis}"/><limit lower="-0.2" upper="9" effort="4"/><dynamics damping="0.{next}"/></joint>
  <transmission name="t{k}"><type>SimpleTransmission</type><joint name="j{k}"/><actuator name="m{k}"/></transmission>"""
ARM = "".join(LINK.format(k=k) for k in range(4)) + "".join(
    JOINT.format(k=k, next=k + 1, axis=axis) for k, axis in enumerate(("0 0 1", "0 1 0", "0.6 0 0.8"))
)
X = np.array([0.3, -0.25, 0.7, 0.5, -1.0, 2.0])
U = np.array([1.0, 5.0, -2.0])


def arm(time_step):
    """Three joints with springs, dampers and gains; one is beyond its limit, one actuator at its effort limit."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step)
    Parser(plant).AddModelsFromString(f'<robot name="arm">{ARM}</robot>', "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("l0"))
    plant.AddForceElement(RevoluteSpring(plant.GetJointByName("j1"), 0.1, 3.0))
    if time_step:
        plant.SetUseSampledOutputPorts(False)
    plant.Finalize()
    return builder.Build(), plant


def ball(approximation):
    """A ball that touches the ground, spinning and sliding."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    plant.set_discrete_contact_approximation(approximation)
    plant.SetUseSampledOutputPorts(False)
    body = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    friction = CoulombFriction(0.5, 0.5)
    plant.RegisterCollisionGeometry(body, RigidTransform(), Sphere(0.1), "ball", friction)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", friction)
    plant.Finalize()
    return builder.Build(), plant


BALL = np.array([1, 0, 0, 0, 0, 0, 0.0995, 0.1, 0.2, 0.3, 0.5, 0.1, -0.2])


def motion(scene, x, u=None):
    """Derivatives, or the state after a step, and the plant's scratch, of numbers or duals."""
    diagram, plant = scene
    if np.asarray(x).dtype == object:
        diagram = diagram.ToAutoDiffXd()
        plant = diagram.GetSubsystemByName(plant.get_name())
    root = diagram.CreateDefaultContext()
    context = plant.GetMyMutableContextFromRoot(root)
    if u is not None:
        plant.get_actuation_input_port().FixValue(context, u)
    if plant.is_discrete():
        context.SetDiscreteState(x)
        out = plant.EvalUniquePeriodicDiscreteUpdate(context).get_vector(0).CopyToVector()
    else:
        context.SetContinuousState(x)
        out = plant.EvalTimeDerivatives(context).CopyToVector()
    return out, context


def both_ways(monkeypatch, scene, x, u=None):
    """The motion as machine code, and as Python."""
    parts = np.concatenate([x, np.empty(0) if u is None else u])
    duals = InitializeAutoDiff(parts)[:, 0]
    arguments = duals[: len(x)], None if u is None else duals[len(x) :]
    monkeypatch.setattr(complex_rows, "_calls", {})
    monkeypatch.setattr(_complex_step, "PATIENCE", 0)
    quick = motion(scene, *arguments)
    assert quick[1]._store.left, "it ran as machine code"
    monkeypatch.setattr(complex_rows, "_calls", {})
    monkeypatch.setattr(_complex_step, "PATIENCE", 10**9)
    monkeypatch.setattr(kernel_store, "is_ready", lambda kernel: False)
    slow = motion(scene, *arguments)
    assert not slow[1]._store.left
    return quick, slow


def assert_same(quick, slow):
    np.testing.assert_allclose(ExtractValue(quick), ExtractValue(slow), rtol=1e-12, atol=1e-12)
    scale = np.abs(ExtractGradient(slow)).max(initial=1.0)
    np.testing.assert_allclose(ExtractGradient(quick), ExtractGradient(slow), atol=1e-11 * scale)


def assert_differences(scene, x, u, gradient):
    """The gradient is that of finite differences."""
    h, n = 1e-6, len(x)
    z = np.concatenate([x, np.empty(0) if u is None else u])
    for i in range(len(z)):
        ends = []
        for sign in (1.0, -1.0):
            moved = z.copy()
            moved[i] += sign * h
            ends.append(motion(scene, moved[:n], None if u is None else moved[n:])[0])
        np.testing.assert_allclose((ends[0] - ends[1]) / (2 * h), gradient[:, i], rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("time_step", [0.0, 1e-2])
def test_arm(monkeypatch, time_step):
    scene = arm(time_step)
    quick, slow = both_ways(monkeypatch, scene, X, U)
    assert_same(quick[0], slow[0])
    assert_differences(scene, X, U, ExtractGradient(quick[0]))


def test_controlled_arm(monkeypatch):
    """With gains at the actuators, which the solver treats implicitly."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-2)
    Parser(plant).AddModelsFromString(f'<robot name="arm">{ARM}</robot>', "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("l0"))
    plant.GetJointActuatorByName("m1").set_controller_gains(PdControllerGains(p=30.0, d=2.0))
    plant.SetUseSampledOutputPorts(False)
    plant.Finalize()
    quick, slow = both_ways(monkeypatch, (builder.Build(), plant), X, U)
    assert_same(quick[0], slow[0])


@pytest.mark.slow
@pytest.mark.parametrize("approximation", ["kSap", "kLagged", "kTamsi"])
def test_ball_on_the_ground(monkeypatch, approximation):
    scene = ball(getattr(DiscreteContactApproximation, approximation))
    quick, slow = both_ways(monkeypatch, scene, BALL)
    assert_same(quick[0], slow[0])


def test_scratch_is_what_python_leaves(monkeypatch):
    quick, slow = both_ways(monkeypatch, arm(1e-2), X, U)
    found, expected = (list(c._store.scratch(c._node).step) for _, c in (quick, slow))
    assert not quick[1]._store.left
    assert sum(a.size for a in expected) > 10
    for a, b in zip(found, expected):
        assert_same(a.ravel(), b.ravel())


def test_a_copy_made_after_a_quick_step_is_complete(monkeypatch):
    quick, slow = both_ways(monkeypatch, arm(1e-2), X, U)
    copies = [c._store.clone().scratch(c._node).step.v_next for _, c in (quick, slow)]
    assert_same(*copies)


def test_a_planted_fault_is_seen(monkeypatch):
    """Derivatives of the efforts that are lost, as where a kernel takes real parts."""
    real = _complex_step.Sweep.run

    def forgetful(self, t, places, by_inputs, n):
        return real(self, t, places, [slopes * (np.arange(n) < len(X)) for slopes in by_inputs], n)

    monkeypatch.setattr(_complex_step.Sweep, "run", forgetful)
    quick, slow = both_ways(monkeypatch, arm(0.0), X, U)
    with pytest.raises(AssertionError):
        assert_same(quick[0], slow[0])


def test_linear_models_use_it(monkeypatch):
    diagram, plant = arm(1e-2)
    context = plant.GetMyMutableContextFromRoot(diagram.CreateDefaultContext())
    plant.get_actuation_input_port().FixValue(context, U)
    runs = []
    run = complex_rows.ComplexChain.run
    monkeypatch.setattr(_complex_step, "PATIENCE", 0)
    monkeypatch.setattr(complex_rows, "_calls", {})
    monkeypatch.setattr(complex_rows.ComplexChain, "run", lambda self: (runs.append(1), run(self))[1])
    ports = plant.get_actuation_input_port().get_index(), plant.get_state_output_port().get_index()
    model = Linearize(plant, context, *ports, equilibrium_check_tolerance=np.inf)
    assert runs and np.isfinite(model.A()).all()
