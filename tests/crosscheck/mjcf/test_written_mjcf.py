"""What WriteModel() writes as MJCF is, loaded by MuJoCo, the plant: masses, limits, kinematics, geometry, springs."""

from __future__ import annotations

import numpy as np
import pytest
from tests.crosscheck.mjcf.mujoco_numbers import faults
from tests.unit.cad import solids
from tests.unit.cad.test_convert import Robot, S, load, random_pose

import sheldrake
from sheldrake.cad import ConvertModel, WriteModel

mujoco = pytest.importorskip("mujoco")
pytestmark = pytest.mark.peer


def opened(path):
    model = mujoco.MjModel.from_xml_path(str(path))
    return model, mujoco.MjData(model)


def all_joints(offsets=True):
    """A plant with every joint that MJCF has, and a free body."""
    robot = Robot(offsets)
    axis = np.array([1.0, 2.0, -2.0]) / 3.0
    turning = robot.joint(S.RevoluteJoint, axis, -1.0, 2.0, 0.1)
    sliding = robot.joint(S.PrismaticJoint, axis, -0.2, 0.3, 0.2)
    robot.joint(S.WeldJoint, random_pose(robot.rng))
    robot.joint(S.UniversalJoint, 0.4, parent=robot.bodies[2])
    robot.joint(S.BallRpyJoint, 0.5)
    robot.joint(S.PlanarJoint, np.array([0.1, 0.2, 0.3]), parent=robot.bodies[1])
    motor = robot.plant.AddJointActuator("motor", turning, 10.0)
    motor.set_default_rotor_inertia(0.01)
    motor.set_default_gear_ratio(50.0)
    servo = robot.plant.AddJointActuator("servo", sliding, 3.0)
    servo.set_controller_gains(S.PdControllerGains(p=100.0, d=5.0))
    return robot.with_a_free_body()


@pytest.mark.parametrize("model", ["two_hole_block/two_hole_block.urdf", "quadruped/quadruped.urdf"])
def test_models_of_the_library(tmp_path, model):
    source = sheldrake.model_path(model)
    written = ConvertModel(source, tmp_path / "robot.xml")
    assert all("limits" in loss for loss in written.losses)
    plant, scene_graph, _ = load(S, source)
    assert faults(plant, scene_graph, *opened(written.path)) == []
    again, _, _ = load(S, written.path)  # and sheldrake reads it, too
    assert again.num_positions() == plant.num_positions() and again.num_actuators() == plant.num_actuators()


@pytest.mark.parametrize("offsets", [False, True])
def test_every_joint(tmp_path, offsets):
    robot = all_joints(offsets)
    plant = robot.done()
    written = WriteModel(plant, tmp_path / "robot.xml")
    model, data = opened(written.path)
    assert faults(plant, None, model, data) == []
    assert model.joint("RevoluteJoint_link1").armature[0] == pytest.approx(0.01 * 50.0**2)
    assert model.actuator("motor").ctrlrange.tolist() == [-10.0, 10.0]
    assert model.actuator("servo").forcerange.tolist() == [-3.0, 3.0]
    assert model.actuator("servo").gainprm[0] == 100.0 and model.actuator("servo").biasprm[2] == -5.0
    words = "\n".join(written.losses)
    for word in ("gear ratio of 1 ", "1 ball joints", "desired velocities of 1 "):
        assert word in words


def test_a_joint_that_the_plant_takes_the_other_way_round(tmp_path):
    """Its child hangs on the world already: its parent is outboard."""
    robot = Robot(True)
    robot.joint(S.RevoluteJoint, [0.0, 0.0, 1.0])
    one = robot.bodies[-1]
    two, three = robot.body(), robot.body()
    for parent, child, kind in ((two, one, S.RevoluteJoint), (three, two, S.PrismaticJoint)):
        name = f"{parent.name()}_holds_{child.name()}"
        frames = robot.frames(name, parent, child, random_pose(robot.rng))
        robot.plant.AddJoint(kind(name, *frames, [0.6, 0.0, 0.8], -0.5, 1.0))
    plant = robot.done()
    assert faults(plant, None, *opened(WriteModel(plant, tmp_path / "robot.xml").path)) == []


def test_a_plant_that_is_not_finalized(tmp_path):
    robot = all_joints(False)
    model, _ = opened(WriteModel(robot.plant, tmp_path / "robot.xml").path)
    assert model.nbody == robot.plant.num_bodies() and "free" in {model.joint(i).name for i in range(model.njnt)}


def test_geometry(tmp_path):
    plant, scene_graph = S.AddMultibodyPlantSceneGraph(S.DiagramBuilder(), 1e-3)
    body = plant.AddRigidBody("body", S.SpatialInertia.SolidCubeWithDensity(1000.0, 0.1))
    (tmp_path / "part.stl").write_bytes(solids.binary_stl(*solids.box(0.06, 0.04, 0.025)))
    (tmp_path / "round.obj").write_bytes(solids.obj(*solids.box(0.1, 0.2, 0.3)))
    meshes = [S.Mesh(str(tmp_path / "part.stl"), [1.0, 2.0, 1.0]), S.Convex(str(tmp_path / "round.obj"), 0.5)]
    shapes = [S.Box(0.1, 0.2, 0.3), S.Sphere(0.1), S.Cylinder(0.1, 0.2), S.Capsule(0.1, 0.2)]
    shapes.append(S.Ellipsoid(0.1, 0.2, 0.3))
    rng = np.random.default_rng(2)
    for number, shape in enumerate(shapes + meshes):
        X = random_pose(rng)
        plant.RegisterVisualGeometry(body, X, shape, f"seen{number}", [0.1, 0.2, 0.3, 1.0])
        plant.RegisterCollisionGeometry(body, X, shape, f"felt{number}", S.CoulombFriction(0.4, 0.4))
    plant.RegisterCollisionGeometry(plant.world_body(), X, S.HalfSpace(), "ground", S.CoulombFriction(0.9, 0.7))
    plant.Finalize()
    (tmp_path / "out").mkdir()
    written = WriteModel(plant, tmp_path / "out" / "scene.xml", scene_graph)
    assert written.losses == ["static friction of 1 geometries: MuJoCo has one coefficient"] and not written.files
    model, data = opened(written.path)
    assert faults(plant, scene_graph, model, data) == []
    np.testing.assert_allclose(model.geom("body_seen0").rgba, [0.1, 0.2, 0.3, 1.0], atol=1e-7)
    assert model.geom("body_felt0").friction[0] == 0.4


def test_a_text_stl_becomes_obj(tmp_path):
    vertices, triangles = solids.box(0.1, 0.2, 0.3)
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n" + "".join("vertex {} {} {}\n".format(*vertices[i]) for i in triangle)
        + "endloop\nendfacet\n"
        for triangle in triangles
    )  # fmt: skip
    (tmp_path / "part.stl").write_text(f"solid part\n{facets}endsolid part\n")
    plant, scene_graph = S.AddMultibodyPlantSceneGraph(S.DiagramBuilder(), 1e-3)
    body = plant.AddRigidBody("body", S.SpatialInertia.SolidCubeWithDensity(1000.0, 0.1))
    shape = S.Mesh(str(tmp_path / "part.stl"))
    plant.RegisterVisualGeometry(body, S.RigidTransform(), shape, "part", [0.1, 0.2, 0.3, 1.0])
    plant.Finalize()
    written = WriteModel(plant, tmp_path / "scene.xml", scene_graph)
    assert [path.name for path in written.files] == ["part.obj"]
    assert faults(plant, scene_graph, *opened(written.path)) == []


def test_springs_gears_loops_and_filters(tmp_path):
    robot = Robot(False)
    plant = robot.plant
    first = robot.joint(S.RevoluteJoint, [0.0, 0.0, 1.0])
    second = robot.joint(S.RevoluteJoint, [0.0, 1.0, 0.0], parent=robot.bodies[1])
    third = robot.joint(S.RevoluteJoint, [1.0, 0.0, 0.0], parent=robot.bodies[1])
    one, two, three = robot.bodies[1:]
    plant.AddForceElement(S.RevoluteSpring(first, 0.3, 7.0))
    plant.AddForceElement(S.LinearSpringDamper(one, [0.1, 0.0, 0.0], three, [0.0, 0.2, 0.0], 0.3, 50.0, 2.0))
    plant.AddCouplerConstraint(second, third, -0.5, 0.1)
    plant.AddBallConstraint(two, [0.1, 0.2, 0.3], three, [0.3, 0.2, 0.1])
    for body in (one, two, three):
        plant.RegisterCollisionGeometry(body, S.RigidTransform(), S.Sphere(0.1), "ball", S.CoulombFriction(1.0, 1.0))
    ids = [S.GeometrySet(plant.GetCollisionGeometriesForBody(body)) for body in (two, three)]
    filters = robot.scene_graph.collision_filter_manager()
    filters.Apply(S.CollisionFilterDeclaration().ExcludeBetween(*ids))
    robot.done()
    written = WriteModel(plant, tmp_path / "robot.xml", robot.scene_graph)
    model, data = opened(written.path)
    assert faults(plant, robot.scene_graph, model, data) == []
    turning = model.joint(first.name())
    assert turning.stiffness[0] == 7.0 and model.qpos_spring[turning.qposadr[0]] == 0.3
    assert model.nexclude == 1
    assert model.tendon_stiffness[0] == 50.0 and model.tendon_damping[0] == 2.0
    assert model.tendon_lengthspring[0].tolist() == [0.3, 0.3]
    assert {int(kind) for kind in model.eq_type} == {int(mujoco.mjtEq.mjEQ_JOINT), int(mujoco.mjtEq.mjEQ_CONNECT)}
    row = list(model.eq_type).index(int(mujoco.mjtEq.mjEQ_JOINT))
    assert model.eq_data[row][:2].tolist() == [0.1, -0.5]  # offset, ratio


def test_neighbours_of_a_base_on_the_ground_pass_through_each_other(tmp_path):
    """MuJoCo filters a body and its parent, unless that stands still; Drake always."""
    robot = Robot(False)
    plant = robot.plant
    robot.joint(S.WeldJoint, S.RigidTransform())
    robot.joint(S.RevoluteJoint, [0.0, 0.0, 1.0])
    for body in robot.bodies[1:]:
        plant.RegisterCollisionGeometry(body, S.RigidTransform(), S.Sphere(5.0), "ball", S.CoulombFriction(1.0, 1.0))
    robot.done()
    model, data = opened(WriteModel(plant, tmp_path / "robot.xml", robot.scene_graph).path)
    mujoco.mj_forward(model, data)
    assert data.ncon == 0 and model.nexclude == 1


def test_moving_bodies_without_mass_get_some_and_it_is_said(tmp_path):
    text = '<robot name="r"><link name="a"/><link name="world"/><joint name="j" type="continuous">'
    (tmp_path / "r.urdf").write_text(text + '<parent link="world"/><child link="a"/></joint></robot>')
    written = ConvertModel(tmp_path / "r.urdf", tmp_path / "r.xml")
    assert any("1 moving bodies have no mass" in loss for loss in written.losses)
    assert opened(written.path)[0].body("a").mass[0] == 1e-12


def test_a_screw_is_refused(tmp_path):
    robot = Robot(False)
    robot.joint(S.ScrewJoint, [1.0, 0.0, 0.0], 0.05, 0.3)
    with pytest.raises(NotImplementedError, match="screw, which MJCF does not have"):
        WriteModel(robot.done(), tmp_path / "robot.xml")


def test_planted_faults_are_seen(tmp_path):
    plant, scene_graph, _ = load(S, sheldrake.model_path("quadruped/quadruped.urdf"))
    path = WriteModel(plant, tmp_path / "robot.xml", scene_graph).path
    text = path.read_text()
    for name, value, word in (
        ("mass", "0.7", "mass of"),
        ("axis", "0.6 0.8 0", "pose of"),
        ("range", "-0.1 0.1", "limits of"),
        ("size", "0.3 0.3 0.3", "size "),
    ):
        at = text.index(f'{name}="', text.index("<worldbody>")) + len(name) + 2
        path.write_text(text[:at] + value + text[text.index('"', at) :])
        assert any(word in fault for fault in faults(plant, scene_graph, *opened(path))), word
