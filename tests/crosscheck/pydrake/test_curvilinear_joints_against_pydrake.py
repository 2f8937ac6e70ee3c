"""Curvilinear joints: pydrake has no class for them, but reads them from files; the same files, the same numbers."""

from __future__ import annotations

import numpy as np
import pytest

import sheldrake.all
from sheldrake.multibody.plant._context import dual_calls

LINK = """<link name="{0}"><inertial><origin xyz="0.3 0.1 0.05"/><mass value="{1}"/>
  <inertia ixx="0.1" iyy="0.12" izz="0.15" ixy="0.01" ixz="0" iyz="0.02"/></inertial></link>"""
URDF = f"""<robot name="train" xmlns:drake="http://drake.mit.edu">{LINK.format("a", 1)}{LINK.format("b", 2)}
{LINK.format("c", 0.5)}
<drake:joint name="loop" type="curvilinear"><parent link="world"/><child link="a"/>
  <origin xyz="0.1 0.2 0.3" rpy="0.5 0.2 0.3"/><dynamics damping="0.3"/><drake:curves>
    <drake:line_segment length="1"/><drake:circular_arc radius="0.5" angle="3.141592653589793"/>
    <drake:line_segment length="1"/><drake:circular_arc radius="0.5" angle="3.141592653589793"/></drake:curves>
  <drake:is_periodic value="true"/></drake:joint>
<drake:joint name="bend" type="curvilinear"><parent link="a"/><child link="b"/>
  <origin xyz="0.1 0.2 0.3" rpy="0.1 0.2 0.3"/><drake:curves>
    <drake:circular_arc radius="0.5" angle="-1.2"/><drake:line_segment length="0.3"/>
    <drake:circular_arc radius="0.8" angle="0.7"/></drake:curves>
  <drake:initial_tangent xyz="0 1 1"/><drake:plane_normal xyz="2 0 0"/></drake:joint>
<joint name="hinge" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0.3 0 0.1"/><axis xyz="0 1 0"/>
  </joint>
<transmission type="SimpleTransmission"><joint name="bend"/><actuator name="push"/></transmission></robot>"""
SDF = """<sdf version="1.9" xmlns:drake="drake.mit.edu"><model name="m"><link name="w"/><link name="a"/>
<joint name="fix" type="fixed"><parent>world</parent><child>w</child></joint>
<drake:joint name="j" type="curvilinear"><drake:parent>w</drake:parent><drake:child>a</drake:child>
<drake:damping>0.2</drake:damping><drake:curves>
  <drake:circular_arc><drake:radius>0.7</drake:radius><drake:angle>-2.0</drake:angle></drake:circular_arc>
  <drake:line_segment><drake:length>1</drake:length></drake:line_segment></drake:curves>{}</drake:joint></model></sdf>"""
DIRECTED = """<drake:initial_tangent><xyz>0 3 0</xyz></drake:initial_tangent>
<drake:plane_normal><xyz>0 0 -2</xyz></drake:plane_normal><drake:is_periodic>true</drake:is_periodic>"""
# The path of the loop turns at 1 and 1 + pi / 2; that of the bend at 0.6 and 0.9 and ends at 1.46.
STATES = [[0.3, 0.2, 0.1], [-7.3, 0.9, -1.0], [1.5, 1.2, 0.4], [100.1, -0.5, 3.0], [1.0, 0.6, 0.0], [4.9, 1.9, 2.0]]

pytestmark = pytest.mark.peer


@pytest.fixture(scope="module")
def drake():
    return pytest.importorskip("pydrake.all")


def train(lib, text=URDF, kind="urdf"):
    plant = lib.MultibodyPlant(1e-3)
    lib.Parser(plant).AddModelsFromString(text, kind)
    plant.Finalize()
    return plant


def answers(lib, plant, context) -> dict:
    """Everything a plant is asked about its tree."""
    c, world, v = plant.GetFrameByName("c"), plant.world_frame(), lib.JacobianWrtVariable.kV
    point = np.array([[0.1], [0.2], [0.3]])
    at = (c, point, world, world)
    vdot = np.array([0.3, -0.7, 0.9])
    forces = lib.MultibodyForces_[_scalar(lib, plant)](plant)
    plant.CalcForceElementsContribution(context, forces)
    plant.GetJointByName("bend").AddInOneForce(context, 0, 0.7, forces)
    plant.GetJointByName("loop").AddInDamping(context, forces)
    return {
        "pose": c.CalcPoseInWorld(context).GetAsMatrix34(),
        "velocity": c.CalcSpatialVelocityInWorld(context).get_coeffs(),
        "M": plant.CalcMassMatrix(context),
        "M through inverse dynamics": plant.CalcMassMatrixViaInverseDynamics(context),
        "bias": plant.CalcBiasTerm(context),
        "gravity": plant.CalcGravityGeneralizedForces(context),
        "inverse dynamics": plant.CalcInverseDynamics(context, vdot, forces),
        "J": plant.CalcJacobianSpatialVelocity(context, v, c, point.ravel(), world, world),
        "J of qdot": plant.CalcJacobianTranslationalVelocity(context, lib.JacobianWrtVariable.kQDot, *at),
        "J of the center of mass": plant.CalcJacobianCenterOfMassTranslationalVelocity(context, v, world, world),
        "bias acceleration": plant.CalcBiasSpatialAcceleration(context, v, c, point.ravel(), world, world).get_coeffs(),
        "bias of the center of mass": plant.CalcBiasCenterOfMassTranslationalAcceleration(context, v, world, world),
        "momentum": plant.CalcSpatialMomentumInWorldAboutPoint(context, np.zeros(3)).get_coeffs(),
        "energies": [plant.EvalKineticEnergy(context), plant.EvalPotentialEnergy(context)],
        "qdot": plant.MapVelocityToQDot(context, vdot),
    }


def _scalar(lib, plant):
    return lib.AutoDiffXd if isinstance(plant, lib.MultibodyPlant_[lib.AutoDiffXd]) else float


def same(ours, theirs):
    ours, theirs = np.asarray(ours, float), np.asarray(theirs, float)
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9 * np.abs(theirs).max(initial=1.0))


def both(drake, query):
    return query(sheldrake.all), query(drake)


def described(lib, plant):
    joints = [plant.get_joint(i) for i in plant.GetJointIndices()]
    return (
        plant.GetPositionNames(), plant.GetVelocityNames(), plant.GetActuatorNames(), plant.IsVelocityEqualToQDot(),
        [plant.get_joint_actuator(i).effort_limit() for i in plant.GetJointActuatorIndices()],
        [(j.name(), j.type_name(), j.can_rotate(), j.can_translate(), j.num_positions()) for j in joints],
        [tuple(j.default_positions()) for j in joints], [tuple(j.default_damping_vector()) for j in joints],
        [(*j.position_lower_limits(), *j.position_upper_limits()) for j in joints],
        [(*j.velocity_lower_limits(), *j.acceleration_upper_limits()) for j in joints],
    )  # fmt: skip


def test_files_say_the_same(drake):
    for text, kind in ((URDF, "urdf"), (SDF.format(""), "sdf"), (SDF.format(DIRECTED), "sdf")):
        ours, theirs = both(drake, lambda lib, text=text, kind=kind: described(lib, train(lib, text, kind)))
        assert ours == theirs


@pytest.mark.parametrize("more", ["", DIRECTED])
def test_paths_of_sdformat_lead_to_the_same_poses(drake, more):
    def poses(lib):
        plant = train(lib, SDF.format(more), "sdf")
        context = plant.CreateDefaultContext()
        found = []
        for q in np.linspace(-5.0, 6.0, 23):
            plant.SetPositions(context, [q])
            found.append(plant.GetFrameByName("a").CalcPoseInWorld(context).GetAsMatrix34())
        return np.array(found)

    same(*both(drake, poses))


@pytest.mark.parametrize("q", STATES, ids=str)
def test_queries(drake, q):
    def query(lib):
        plant = train(lib)
        context = plant.CreateDefaultContext()
        plant.SetPositions(context, q)
        plant.SetVelocities(context, [1.2, -0.8, 0.5])
        return answers(lib, plant, context)

    ours, theirs = both(drake, query)
    for name in theirs:
        same(ours[name], theirs[name])


def slopes_of(lib, plant, context, answer):
    """Values and derivatives with respect to q and v at all states."""
    found = []
    for q in STATES:
        x = lib.InitializeAutoDiff(np.r_[q, 1.2, -0.8, 0.5]).ravel()
        plant.SetPositionsAndVelocities(context, x)
        values = [lib.AutoDiffXd(a) if isinstance(a, float) else a for a in answer()]
        values = np.array(values).reshape(-1, 1)
        found.append(np.column_stack([lib.ExtractValue(values), lib.ExtractGradient(values)]))
    return np.array(found)


def test_derivatives(drake):
    def query(lib):
        plant = train(lib).ToAutoDiffXd()
        context = plant.CreateDefaultContext()

        def answer():
            return np.concatenate([np.ravel(a) for a in answers(lib, plant, context).values()])

        return slopes_of(lib, plant, context, answer)

    same(*both(drake, query))


def test_derivatives_by_compiled_kernels(drake, monkeypatch):
    """Kernels of complex numbers, which stand for duals once a query was asked often."""
    monkeypatch.setattr(dual_calls, "_NUMBERS", 0)

    def query(lib):
        plant = train(lib).ToAutoDiffXd()
        context = plant.CreateDefaultContext()
        return slopes_of(lib, plant, context, lambda: plant.CalcMassMatrix(context).ravel())

    same(*both(drake, query))


def motion(lib, approximation, text=URDF, steps=300):
    """Runs into the end of the bend, and along more than one piece of the loop."""
    builder = lib.DiagramBuilder()
    plant, _ = lib.AddMultibodyPlantSceneGraph(builder, 1e-3)
    plant.set_discrete_contact_approximation(getattr(lib.DiscreteContactApproximation, approximation))
    lib.Parser(plant).AddModelsFromString(text, "urdf")
    plant.Finalize()
    simulator = lib.Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetPositions(context, [0.9, 1.3, 0.2])
    plant.SetVelocities(context, [1.0, 2.0, 0.0])
    plant.get_actuation_input_port().FixValue(context, [0.8])
    states = []
    for step in range(1, steps + 1):
        simulator.AdvanceTo(step * 1e-3)
        states.append(plant.GetPositionsAndVelocities(context))
    return np.array(states)


@pytest.mark.parametrize("approximation", ["kTamsi", "kSap", "kLagged"])
def test_steps(drake, approximation):
    ours, theirs = both(drake, lambda lib: motion(lib, approximation))
    same(ours, theirs)
    assert theirs[:, 0].max() > 1.05 and (theirs[:, 1].max() < 1.4605 or approximation == "kTamsi")


def test_continuous_dynamics(drake):
    def query(lib):
        plant = lib.MultibodyPlant(0.0)
        lib.Parser(plant).AddModelsFromString(URDF, "urdf")
        plant.Finalize()
        context = plant.CreateDefaultContext()
        plant.SetPositionsAndVelocities(context, [1.9, 0.7, 0.2, 1.2, -0.8, 0.5])
        plant.get_actuation_input_port().FixValue(context, [0.8])
        forces = plant.get_reaction_forces_output_port().Eval(context)
        state = plant.EvalTimeDerivatives(context).CopyToVector()
        return np.concatenate([state, *(f.get_coeffs() for f in forces)])

    same(*both(drake, query))


def test_another_radius_is_noticed(drake):
    theirs = motion(drake, "kLagged", steps=100)
    ours = motion(sheldrake.all, "kLagged", URDF.replace('radius="0.5"', 'radius="0.5000001"'), steps=100)
    with pytest.raises(AssertionError):
        same(ours, theirs)
