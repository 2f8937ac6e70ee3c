"""Global inverse kinematics: programs of the same optimum, cones that hold for the same values."""

import numpy as np
import pytest
from tests.crosscheck.pydrake.mixed_integer import least
from tests.libraries import names_of

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")

INERTIA = '<inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'
ARM = f"""<robot name="arm"><link name="base"/><link name="l0">{INERTIA}</link><link name="l1">{INERTIA}</link>
  <link name="tip">{INERTIA}</link>
  <joint name="j0" type="revolute"><parent link="base"/><child link="l0"/>
    <origin xyz="0 0.1 0.2" rpy="0.3 0 0.2"/><axis xyz="0 0 1"/><limit lower="-0.3" upper="0.9" effort="1"/></joint>
  <joint name="j1" type="revolute"><parent link="l0"/><child link="l1"/>
    <origin xyz="0.3 0 0.1"/><axis xyz="0 0.6 0.8"/><limit lower="-2.0" upper="-0.4" effort="1"/></joint>
  <joint name="weld" type="fixed"><parent link="l1"/><child link="tip"/><origin xyz="0 0 0.3" rpy="0 0.5 0"/></joint>
</robot>"""
Q = [0.7, -1.3]


def library(name):
    multibody = ("inverse_kinematics", "parsing", "plant", "tree")
    return names_of(name, "math", "solvers", "common.eigen_geometry", *(f"multibody.{m}" for m in multibody))


OURS, THEIRS = library("sheldrake"), library("pydrake")


def plant(L):
    out = L.MultibodyPlant(0.0)
    L.Parser(out).AddModelsFromString(ARM, "urdf")
    X = L.RigidTransform(L.RollPitchYaw(0.2, 0.1, 0.4), [0.1, 0.2, 0.3])
    out.WeldFrames(out.world_frame(), out.GetFrameByName("base"), X)
    out.Finalize()
    return out


def make(L, linear, approach="kBoxSphereIntersection"):
    options = L.GlobalInverseKinematics.Options()
    options.num_intervals_per_half_axis = 1
    options.linear_constraint_only = linear
    options.approach = getattr(L.MixedIntegerRotationConstraintGenerator.Approach, approach)
    the_plant = plant(L)
    return L.GlobalInverseKinematics(the_plant, options), the_plant


def poses(the_plant, ik, L, bodies=(1, 2, 3, 4)):
    return np.concatenate(
        [
            np.concatenate((ik.body_position(L.BodyIndex(i)), ik.body_rotation_matrix(L.BodyIndex(i)).ravel()))
            for i in bodies
        ]
    )


def add_everything(L, ik):
    tip, X_WF = L.BodyIndex(4), L.RigidTransform(L.RollPitchYaw(0.1, 0.2, 0.3), [0.1, 0.2, 0.4])
    ik.AddWorldPositionConstraint(tip, [0.1, 0, 0], [-1, -1, -1], [0.3, 0.4, 0.9], X_WF)
    ik.AddWorldRelativePositionConstraint(tip, [0, 0.1, 0], L.BodyIndex(1), [0, 0, 0], [-1] * 3, [0.4, 0.5, 0.6], X_WF)
    ik.AddWorldOrientationConstraint(tip, L.Quaternion(0.5, 0.5, 0.5, 0.5), 2.2)
    ik.AddJointLimitConstraint(L.BodyIndex(3), -1.5, -0.5, True)
    ik.BodyPointInOneOfRegions(tip, [0, 0, 0], [np.hstack((np.zeros((3, 1)), 0.7 * np.eye(3))), np.eye(3) + 0.1])
    cube = np.vstack((np.eye(3), -np.eye(3)))
    polytopes = [L.GlobalInverseKinematics.Polytope3D(cube, b * np.ones(6)) for b in (0.8, 0.9)]
    ik.BodySphereInOneOfPolytopes(L.BodyIndex(3), [0, 0, 0.05], 0.1, polytopes)


def optimum(L, cost):
    ik, the_plant = make(L, linear=True)
    add_everything(L, ik)
    variables = poses(the_plant, ik, L)
    return least(ik.prog(), [ik.prog().FindDecisionVariableIndex(v) for v in variables], cost)


@pytest.mark.parametrize("seed", [1, 2])
def test_linear_programs_have_pydrakes_optimum(seed):
    cost = np.random.default_rng(seed).normal(size=48)
    assert optimum(OURS, cost) == pytest.approx(optimum(THEIRS, cost), abs=1e-5)


def test_a_planted_fault_is_caught():
    cost = np.random.default_rng(1).normal(size=48)
    ik, the_plant = make(OURS, linear=True)
    add_everything(OURS, ik)
    ik.AddWorldOrientationConstraint(OURS.BodyIndex(4), OURS.Quaternion(0.5, 0.5, 0.5, 0.5), 1.2)
    variables = poses(the_plant, ik, OURS)
    found = least(ik.prog(), [ik.prog().FindDecisionVariableIndex(v) for v in variables], cost)
    assert found > optimum(THEIRS, cost) + 1e-3


def hold(L, values):
    """For each set of poses, whether all cones hold."""
    ik, the_plant = make(L, linear=False)
    ik.AddPostureCost(Q, [1, 2, 3, 4, 5], [1, 2, 3, 4, 5])
    variables, prog, out = poses(the_plant, ik, L), ik.prog(), []
    places = [prog.FindDecisionVariableIndex(v) for v in variables]
    for value in values:
        x = np.full(prog.num_vars(), 3.0)
        x[places] = value
        cones = [*prog.lorentz_cone_constraints(), *prog.rotated_lorentz_cone_constraints()]
        out.append(all(b.evaluator().CheckSatisfied(prog.GetBindingVariableValues(b, x), 1e-9) for b in cones))
    return out


def random_poses(L, rng, noise):
    the_plant = plant(L)
    context = the_plant.CreateDefaultContext()
    the_plant.SetPositions(context, rng.uniform([-0.3, -2.0], [0.9, -0.4]))
    out = []
    for i in range(1, 5):
        X = the_plant.EvalBodyPoseInWorld(context, the_plant.get_body(L.BodyIndex(i)))
        out.append(np.concatenate((X.translation(), X.rotation().matrix().ravel())))
    return np.concatenate(out) + noise * rng.normal(size=48)


def test_cones_hold_for_the_same_poses():
    rng = np.random.default_rng(3)
    values = [random_poses(OURS, rng, noise) for noise in [0.0] * 5 + [0.02] * 40]
    ours, theirs = hold(OURS, values), hold(THEIRS, values)
    assert ours == theirs
    assert all(ours[:5]) and not all(ours)


def test_the_cost_of_a_posture_is_pydrakes():
    def value(L, x):
        ik, the_plant = make(L, linear=True)
        ik.AddPostureCost(Q, [1, 2, 3, 4, 5], [5, 4, 3, 2, 1])
        prog, full = ik.prog(), np.ones(ik.prog().num_vars())
        full[[prog.FindDecisionVariableIndex(v) for v in poses(the_plant, ik, L)]] = x
        return sum(b.evaluator().Eval(prog.GetBindingVariableValues(b, full))[0] for b in prog.linear_costs())

    x = random_poses(OURS, np.random.default_rng(5), 0.1)
    assert value(OURS, x) == pytest.approx(value(THEIRS, x), abs=1e-12)
