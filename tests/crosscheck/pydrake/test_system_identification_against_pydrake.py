"""Implicit residuals of plants, and parameters lumped from them, as programs that identify robots need them."""

import importlib

import numpy as np
import pytest

pytest.importorskip("pydrake")

pytestmark = pytest.mark.peer


def link(name):
    inertia = '<inertia ixx="0.1" iyy="0.2" izz="0.25" ixy="0" ixz="0" iyz="0"/>'
    return f'<link name="{name}"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/>{inertia}</inertial></link>'


def joint(name, parent, child, kind="revolute", axis="0 1 0", at="0 0 0"):
    ends = f'<parent link="{parent}"/><child link="{child}"/><axis xyz="{axis}"/><origin xyz="{at}"/>'
    motor = (
        f'<transmission><type>SimpleTransmission</type><joint name="{name}"/><actuator name="{name}"/></transmission>'
    )
    return f'<joint name="{name}" type="{kind}">{ends}<dynamics damping="0.1"/></joint>' + motor


MODELS = {
    "pendulum": link("a") + joint("j", "world", "a"),
    "two links": link("a") + link("b") + joint("j", "world", "a") + joint("k", "a", "b", at="0 0 -1"),
    "cart and pole": link("a") + link("b") + joint("j", "world", "a", "prismatic", "1 0 0") + joint("k", "a", "b"),
    "four links": "".join(link(n) for n in "abcd")
    + joint("j", "world", "a", axis="0 0 1")
    + "".join(joint(n, p, c, at="0.1 0 0.3") for n, p, c in ("kab", "lbc", "mcd")),
}
LIBRARIES = [importlib.import_module(f"{name}.all") for name in ("sheldrake", "pydrake")]


def plant_of(m, model):
    plant = m.MultibodyPlant(0.0)
    m.Parser(plant).AddModelsFromString(f'<robot name="r">{MODELS[model]}</robot>', "urdf")
    plant.Finalize()
    return plant


def numbers(count, seed=3):
    return np.random.default_rng(seed).uniform(0.2, 1.0, count)


def residual(m, plant, q_v, rates, u):
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, q_v)
    plant.get_actuation_input_port().FixValue(context, u)
    proposed = context.Clone().get_mutable_continuous_state()
    proposed.SetFromVector(rates)
    return plant.CalcImplicitTimeDerivativesResidual(context, proposed)


@pytest.mark.parametrize("model", MODELS)
def test_residuals_are_forces(model):
    found = []
    for m in LIBRARIES:
        plant = plant_of(m, model)
        n, nu = plant.num_multibody_states(), plant.num_actuators()
        values = numbers(2 * n + nu)
        parts = values[:n], values[n : 2 * n], values[2 * n :]
        duals = m.InitializeAutoDiff(values).ravel()
        with_slopes = residual(m, plant.ToAutoDiffXd(), duals[:n], duals[n : 2 * n], duals[2 * n :])
        found.append((residual(m, plant, *parts), m.ExtractValue(with_slopes).ravel(), m.ExtractGradient(with_slopes)))
    for ours, theirs in zip(*found):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(found[0][0], found[0][1], atol=1e-12)


def test_residuals_of_diagrams_are_those_of_their_systems():
    found = []
    for m in LIBRARIES:
        builder = m.DiagramBuilder()
        source, plant, gain = (
            builder.AddSystem(m.Integrator(1)),
            builder.AddSystem(plant_of(m, "pendulum")),
            m.Gain(2.0, 1),
        )
        builder.AddSystem(gain)
        builder.Connect(source.get_output_port(), gain.get_input_port())
        builder.Connect(gain.get_output_port(), plant.get_actuation_input_port())
        builder.ExportInput(source.get_input_port())
        diagram = builder.Build()
        context = diagram.CreateDefaultContext()
        context.SetContinuousState([0.7, 0.1, 0.2])
        diagram.get_input_port(0).FixValue(context, [0.3])
        proposed = diagram.AllocateTimeDerivatives()
        proposed.SetFromVector([0.5, 1.0, 2.0])
        found.append(diagram.CalcImplicitTimeDerivativesResidual(context, proposed))
    np.testing.assert_allclose(*found, atol=1e-12)


def identified(m, model):
    """Lumped parameters' number and values, what they say of the residual, and the residual."""
    plant = plant_of(m, model).ToSymbolic()
    context = plant.CreateDefaultContext()
    nq, nv = plant.num_positions(), plant.num_velocities()
    q, v, vdot, u = (m.MakeVectorVariable(n, name) for n, name in ((nq, "q"), (nv, "v"), (nv, "a"), (nv, "u")))
    masses = [m.Variable(f"m{i}") for i in range(nv)]
    length = m.Variable("l")
    bodies = [plant.GetBodyByName(name) for name in "abcd"[:nv]]
    for mass, body in zip(masses, bodies):
        body.SetMass(context, mass)
    tip = np.array([0, 0, -length])
    point = m.SpatialInertia_[m.Expression](masses[-1], tip, m.UnitInertia_[m.Expression].PointMass(tip))
    bodies[-1].SetSpatialInertiaInBodyFrame(context, point)
    plant.SetPositionsAndVelocities(context, np.concatenate([q, v]))
    plant.get_actuation_input_port().FixValue(context, u)
    proposed = context.Clone().get_mutable_continuous_state()
    proposed.SetFromVector(np.concatenate([v, vdot]))
    left = plant.CalcImplicitTimeDerivativesResidual(context, proposed)
    W, alpha, w0 = m.DecomposeLumpedParameters(left[nq:], [*masses, length])
    names = [*q, *v, *vdot, *u, *masses, length]
    values = dict(zip(names, numbers(len(names))))
    of = [[e.Evaluate(values) for e in es] for es in (alpha, W @ alpha + w0, left[nq:])]
    return len(alpha), sorted(of[0]), of[1], of[2]


@pytest.mark.parametrize("model", ["pendulum", "two links", "cart and pole"])
def test_parameters_are_lumped_without_loss(model):
    ours, theirs = (identified(m, model) for m in LIBRARIES)
    assert ours[0] == theirs[0]
    for a, b in zip(ours[1:], theirs[1:]):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(ours[2], ours[3], rtol=1e-9, atol=1e-10)
