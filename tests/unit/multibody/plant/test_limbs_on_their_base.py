"""A limb that presses on the floating base that carries it does not change their momentum."""

import numpy as np
import pytest

from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, DiscreteContactApproximation
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder

DT = 1e-3
HARD = (
    "<drake:proximity_properties><drake:rigid_hydroelastic/>"
    "<drake:mesh_resolution_hint value='0.1'/></drake:proximity_properties>"
)
SOFT = (
    "<drake:proximity_properties><drake:compliant_hydroelastic/><drake:hydroelastic_modulus value='1e6'/>"
    "<drake:mesh_resolution_hint value='0.1'/></drake:proximity_properties>"
)


def link(name, mass, radius, collision):
    """A ball; it collides when `collision` is not None, which is what its <collision> has in addition."""
    inertia = 0.4 * mass * radius**2
    shape = f"<geometry><sphere radius='{radius}'/></geometry>"
    return (
        f"<link name='{name}'><inertial><mass value='{mass}'/>"
        f"<inertia ixx='{inertia}' iyy='{inertia}' izz='{inertia}' ixy='0' ixz='0' iyz='0'/></inertial>"
        + ("" if collision is None else f"<collision>{shape}{collision}</collision>")
        + "</link>"
    )


def joint(name, parent, child, place, axis):
    return (
        f"<joint name='{name}' type='continuous'><parent link='{parent}'/><child link='{child}'/>"
        f"<origin xyz='{place[0]} {place[1]} 0'/><axis xyz='{axis}'/></joint>"
    )


def spider(limbs, hydroelastic):
    """URDF of a ball with limbs of two links each; the outer ones overlap the ball."""
    hard, soft = (HARD, SOFT) if hydroelastic else ("", "")
    parts = [link("base", 2.0, 0.2, hard)]
    for k in range(limbs):
        place = 0.12 * np.cos(2.0 * k), 0.12 * np.sin(2.0 * k)
        parts += [link(f"inner{k}", 0.3, 0.03, None), link(f"outer{k}", 1.0, 0.1, soft)]
        parts += [joint(f"hip{k}", "base", f"inner{k}", place, "0 0 1")]
        parts += [joint(f"knee{k}", f"inner{k}", f"outer{k}", place, "0 1 0")]
    return f"<robot name='spider'>{''.join(parts)}</robot>"


@pytest.mark.parametrize("hydroelastic", [False, True], ids=["points", "patches"])
@pytest.mark.parametrize("limbs", [1, 3])
@pytest.mark.parametrize("approximation", ["kLagged", "kSimilar", "kSap", "kTamsi"])
def test_contact_of_base_and_limbs_keeps_the_momentum(approximation, limbs, hydroelastic):
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, DT)
    plant.set_discrete_contact_approximation(getattr(DiscreteContactApproximation, approximation))
    Parser(plant).AddModelsFromString(spider(limbs, hydroelastic), "urdf")
    plant.Finalize()
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    context = plant.GetMyContextFromRoot(root)
    q = plant.GetPositions(context).copy()
    q[:7] = 0.8, 0.36, -0.48, 0.0, 0.0, 0.0, 3.0
    plant.SetPositions(context, q)
    plant.SetVelocities(context, np.linspace(-1.0, 1.0, plant.num_velocities()))
    before = plant.GetVelocities(context).copy()
    M, rest = plant.CalcMassMatrix(context), plant.CalcGravityGeneralizedForces(context) - plant.CalcBiasTerm(context)
    simulator = Simulator(diagram, root)
    simulator.Initialize()
    simulator.AdvanceTo(DT)
    results = plant.get_contact_results_output_port().Eval(context)
    assert results.num_point_pair_contacts() + results.num_hydroelastic_contacts() >= limbs
    impulse = M @ (plant.GetVelocities(context) - before) - DT * rest
    assert np.abs(impulse[6:]).max() > 1e-3
    np.testing.assert_allclose(impulse[:6], 0.0, atol=1e-8)  # rounding of contact impulses of some 10 N s
