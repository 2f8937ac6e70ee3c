"""The class of curvilinear joints; its numbers are compared with pydrake's in the cross-checks."""

import numpy as np
import pytest

from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import CurvilinearJoint, MultibodyForces, SpatialInertia
from sheldrake.symbolic import Expression
from sheldrake.trajectories import PiecewiseConstantCurvatureTrajectory as Path


def path(**options):
    return Path([0.0, 1.0, 1.5, 3.0], [2.0, 0.0, -0.7], [0.0, 3.0, 3.0], [2.0, 0.0, 0.0], [0.1, 0.2, 0.3], **options)


def wagon(*args, periodic=False, **options):
    plant = MultibodyPlant(1e-3)
    body = plant.AddRigidBody("wagon", SpatialInertia.SolidBoxWithMass(2.0, 0.3, 0.3, 0.3))
    ends = "rail", plant.world_frame(), body.body_frame()
    return plant, plant.AddJoint(CurvilinearJoint(*ends, path(is_periodic=periodic), *args, **options))


def test_limits_and_damping_of_all_constructors():
    def numbers(*args, **options):
        _, joint = wagon(*args, **options)
        return joint.position_lower_limit(), joint.position_upper_limit(), joint.default_damping()

    assert numbers() == (0.0, 3.0, 0.0)
    assert numbers(periodic=True) == (-np.inf, np.inf, 0.0)
    assert numbers(0.4) == numbers(damping=0.4) == (0.0, 3.0, 0.4)
    assert numbers(-1.0, 2.0) == numbers(pos_lower_limit=-1.0, pos_upper_limit=2.0) == (-1.0, 2.0, 0.0)
    assert numbers(-1.0, 2.0, 0.4, periodic=True) == numbers(-1.0, 2.0, damping=0.4) == (-1.0, 2.0, 0.4)


def test_wrong_arguments_are_refused():
    with pytest.raises(RuntimeError, match="Curvilinear joint damping must be nonnegative"):
        wagon(-0.1)
    with pytest.raises(RuntimeError, match="exceeds its upper limit"):
        wagon(2.0, 1.0)
    plant = MultibodyPlant(1e-3)
    with pytest.raises(TypeError, match="curvilinear_path: PiecewiseConstantCurvatureTrajectory"):
        CurvilinearJoint("rail", plant.world_frame(), plant.world_frame(), [1.0, 2.0])


def test_getters_and_setters_in_a_context():
    plant, joint = wagon(0.4)
    joint.set_default_distance(0.7)
    joint.set_random_distance_distribution(Expression(1.2))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    assert (joint.type_name(), joint.get_default_distance(), joint.get_distance(context)) == ("curvilinear", 0.7, 0.7)
    assert joint.set_distance(context, 1.9) is joint.set_tangential_velocity(context, -0.3) is joint
    assert (joint.get_distance(context), joint.get_tangential_velocity(context)) == (1.9, -0.3)
    assert joint.get_trajectory().length() == 3.0
    there = plant.GetFrameByName("wagon").CalcPoseInWorld(context).GetAsMatrix34()
    np.testing.assert_allclose(joint.GetPose(context).GetAsMatrix34(), there, atol=1e-14)
    joint.SetDamping(context, 0.9)
    forces = MultibodyForces(plant)
    joint.AddInForce(context, 2.0, forces)
    joint.AddInDamping(context, forces)
    np.testing.assert_allclose(forces.generalized_forces(), [2.0 + 0.9 * 0.3])
    joint.Lock(context)
    assert joint.is_locked(context) and joint.get_tangential_velocity(context) == 0.0


def test_the_path_is_the_joints_own():
    plant = MultibodyPlant(1e-3)
    body = plant.AddRigidBody("wagon", SpatialInertia.SolidBoxWithMass(2.0, 0.3, 0.3, 0.3))
    given = path()
    joint = CurvilinearJoint("rail", plant.world_frame(), body.body_frame(), given)
    given._rates[0] = 99.0
    assert joint.get_trajectory().curvature(0.5) == 2.0


def robot(inside, attributes='name="j" type="curvilinear"'):
    return (
        '<robot name="r" xmlns:drake="http://drake.mit.edu"><link name="a"/><link name="b"/>'
        f'<drake:joint {attributes}><parent link="a"/><child link="b"/>{inside}</drake:joint></robot>'
    )


LINE = '<drake:curves><drake:line_segment length="1"/></drake:curves>'
WRONG = {
    "needs <drake:curves>": "",
    "is empty": "<drake:curves/>",
    "needs a positive 'length'": LINE.replace('"1"', '"0"'),
    "needs a positive 'radius'": '<drake:curves><drake:circular_arc angle="1"/></drake:curves>',
    "an 'angle' other than 0": '<drake:curves><drake:circular_arc radius="1" angle="0"/></drake:curves>',
    "lines? segments and circular arcs": "<drake:curves><drake:spiral/></drake:curves>",
    "joint 'j': .*must be perpendicular": LINE + '<drake:plane_normal xyz="1 0 1"/>',
    "joint 'j': .*tangent is zero": LINE + '<drake:initial_tangent xyz="0 0 0"/>',
}


@pytest.mark.parametrize("message", WRONG)
def test_wrong_files_are_refused(message):
    plant = MultibodyPlant(1e-3)
    with pytest.raises(RuntimeError, match=message):
        Parser(plant).AddModelsFromString(robot(WRONG[message]), "urdf")
    assert plant.num_joints() == 0


def test_limits_of_files_are_ignored_aloud(caplog):
    plant = MultibodyPlant(1e-3)
    with caplog.at_level("WARNING", logger="drake"):
        Parser(plant).AddModelsFromString(robot(LINE + '<limit lower="-9" upper="9"/>'), "urdf")
    assert "its limits are the ends of its path" in caplog.text
    assert plant.GetJointByName("j").position_upper_limit() == 1.0
