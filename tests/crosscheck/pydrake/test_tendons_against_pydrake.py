"""Tendons: pydrake has no call for them, but reads them from files; the same files, the same motion."""

from __future__ import annotations

import numpy as np
import pytest

import sheldrake.all

LINK = """<link name="{0}"><inertial><origin xyz="0.3 0.1 0"/><mass value="{1}"/>
  <inertia ixx="0.1" iyy="0.12" izz="0.15" ixy="0.01" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/><origin xyz="0.5 {4} 0"/>
  <axis xyz="0 1 0"/></joint>"""
TENDON = """<drake:tendon_constraint>{0}{1}</drake:tendon_constraint>"""
HAND = [("j1", "revolute", "palm", "a", 0.0), ("j2", "revolute", "a", "b", 0.0), ("j3", "prismatic", "palm", "c", 0.2),
        ("j4", "revolute", "c", "d", 0.0), ("j5", "revolute", "palm", "e", -0.2)]  # fmt: skip
CASES = {
    "both limits": (dict(j1=1.0, j2=-0.5, j4=0.7), dict(offset=0.1, lower_limit=-0.2, upper_limit=0.1)),
    "a soft upper limit": (dict(j5=2.0, j1=1.0), dict(upper_limit=0.1, stiffness=50.0, damping=3.0)),
    "a soft lower limit": (dict(j4=1.0), dict(lower_limit=0.0, stiffness=200.0)),
    "kept in place": (dict(j3=3.0, j1=0.3, j2=0.4, j4=1.0), dict(offset=0.03, lower_limit=-0.02, upper_limit=0.02)),
    "within its limits at first": (dict(j5=1.0, j2=-2.0), dict(upper_limit=0.02, stiffness=500.0, damping=20.0)),
    "far from its limits": (dict(j1=1.0, j2=1.0), dict(lower_limit=-100.0, upper_limit=100.0)),
}


WITHOUT_LIMITS = dict(offset=0.0, lower_limit=-1e9, upper_limit=1e9, stiffness=1e12, damping=0.0)


def hand(joints: dict, numbers: dict) -> str:
    links = [LINK.format(name, 1.0 + 0.1 * i) for i, name in enumerate(("palm", "a", "b", "c", "d", "e"))]
    weld = '<link name="world"/><joint name="w" type="fixed"><parent link="world"/><child link="palm"/></joint>'
    names = "".join(f'<drake:tendon_constraint_joint name="{name}" a="{a}"/>' for name, a in joints.items())
    numbers = {**WITHOUT_LIMITS, **numbers}
    values = "".join(f'<drake:tendon_constraint_{name} value="{value}"/>' for name, value in numbers.items())
    body = "".join([*links, weld, *(JOINT.format(*j) for j in HAND), TENDON.format(names, values)])
    return f'<robot name="hand" xmlns:drake="http://drake.mit.edu">{body}</robot>'


def motion(lib, text: str, approximation: str, steps: int = 200) -> np.ndarray:
    builder = lib.DiagramBuilder()
    plant, _ = lib.AddMultibodyPlantSceneGraph(builder, 1e-3)
    plant.set_discrete_contact_approximation(getattr(lib.DiscreteContactApproximation, approximation))
    lib.Parser(plant).AddModelsFromString(text, "urdf")
    plant.Finalize()
    assert plant.num_constraints() == 1
    simulator = lib.Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    states = []
    for step in range(1, steps + 1):
        simulator.AdvanceTo(step * 1e-3)
        states.append(plant.GetPositionsAndVelocities(context))
    return np.array(states)


@pytest.mark.peer
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_tendons_move_as_in_drake(case):
    pydrake = pytest.importorskip("pydrake.all")
    for approximation in ("kLagged", "kSap"):
        text = hand(*case)
        theirs, ours = (motion(lib, text, approximation) for lib in (pydrake, sheldrake.all))
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9)


@pytest.mark.peer
def test_another_coefficient_is_noticed():
    pydrake = pytest.importorskip("pydrake.all")
    joints, numbers = CASES["both limits"]
    theirs = motion(pydrake, hand(joints, numbers), "kLagged")
    ours = motion(sheldrake.all, hand({**joints, "j1": 1.0 + 1e-6}, numbers), "kLagged")
    assert abs(ours - theirs).max() > 1e-8


def test_a_tendon_over_three_trees_is_refused_by_name():
    with pytest.raises(NotImplementedError, match="j1, j4, j5 pulls at 3 trees"):
        motion(sheldrake.all, hand(dict(j1=1.0, j4=1.0, j5=1.0), {}), "kLagged")


def make_plant():
    plant = sheldrake.all.MultibodyPlant(1e-3)
    sheldrake.all.Parser(plant).AddModelsFromString(hand(*CASES["both limits"]), "urdf")
    return plant, [plant.GetJointByName(name) for name in ("j1", "j2")]


WRONG = {
    "no joints": dict(joints=[], a=[], upper_limit=1.0),
    "too few coefficients": dict(a=[1.0], upper_limit=1.0),
    "no limit": dict(a=[1.0, 2.0]),
    "limits turned": dict(a=[1.0, 2.0], lower_limit=1.0, upper_limit=0.0),
    "stiffness": dict(a=[1.0, 2.0], upper_limit=1.0, stiffness=0.0),
    "damping": dict(a=[1.0, 2.0], upper_limit=1.0, damping=-1.0),
}


@pytest.mark.parametrize("arguments", WRONG.values(), ids=WRONG)
def test_bad_tendons_change_nothing(arguments):
    plant, joints = make_plant()
    with pytest.raises(RuntimeError, match="AddTendonConstraint"):
        plant.AddTendonConstraint(**{"joints": joints, **arguments})
    assert plant.num_constraints() == 1


def test_joints_of_more_degrees_of_freedom_are_refused():
    plant, joints = make_plant()
    inertia = sheldrake.all.SpatialInertia.SolidSphereWithMass(1.0, 0.1)
    ball = plant.AddRigidBody("ball", sheldrake.all.default_model_instance(), inertia)
    wide = plant.AddJoint(sheldrake.all.BallRpyJoint("wide", plant.world_frame(), ball.body_frame()))
    with pytest.raises(RuntimeError, match="single-DOF"):
        plant.AddTendonConstraint([joints[0], wide], [1.0, 1.0], upper_limit=1.0)
