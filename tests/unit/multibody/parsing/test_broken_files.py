"""Files and directives that fail late leave the plant, its geometry and filter groups as they were."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.geometry import Role, Sphere
from sheldrake.math import RigidTransform
from sheldrake.multibody.parsing import LoadModelDirectivesFromString, Parser, ProcessModelDirectives
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.multibody.tree import world_model_instance
from sheldrake.systems.framework import DiagramBuilder

LINK = """<link name="{0}">
  <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  <visual><geometry><sphere radius="0.1"/></geometry></visual>
  <collision><geometry><sphere radius="0.1"/></geometry></collision>
</link>"""
JOINT = """<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><axis xyz="0 0 1"/>
  <limit lower="-1" upper="1" effort="5" velocity="1"/></joint>"""
GROUPS = """<drake:collision_filter_group name="g"><drake:member link="a"/>
<drake:ignored_collision_filter_group name="{0}"/>
</drake:collision_filter_group>"""


def urdf(end: str = "", name: str = "late") -> str:
    body = LINK.format("a") + LINK.format("b") + JOINT.format("j", "a", "b")
    return f'<robot name="{name}" xmlns:drake="http://drake.mit.edu">{body}{end}</robot>'


BROKEN_URDF = {
    "bushing of an unknown frame": '<drake:linear_bushing_rpy><drake:bushing_frameA name="none"/>'
    '<drake:bushing_frameC name="none"/><drake:bushing_torque_stiffness value="1 1 1"/>'
    '<drake:bushing_torque_damping value="1 1 1"/><drake:bushing_force_stiffness value="1 1 1"/>'
    '<drake:bushing_force_damping value="1 1 1"/></drake:linear_bushing_rpy>',
    "filter group that ignores an unknown one": GROUPS.format("nobody"),
    "coupler of an unknown joint": "<joint name='k' type='revolute'><parent link='b'/><child link='c'/>"
    "<mimic joint='nowhere'/></joint>" + LINK.format("c"),
    "name taken": LINK.format("a"),
    "joint of the same bodies": JOINT.format("k", "a", "b"),
}
WORLD = """<sdf version="1.9"><world name="w">
  <model name="one"><link name="a"/></model>
  <model name="two"><link name="a"/><link name="b"/>
    <joint name="j" type="revolute"><parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz></axis></joint></model>
  <joint name="k" type="fixed"><parent>one::a</parent><child>two::nothing</child></joint>
</world></sdf>"""
MJCF = """<mujoco><worldbody><body name="a"><freejoint/><geom size="0.1"/>
  <body name="b"><joint name="j"/><geom size="0.1"/></body></body></worldbody>
  <actuator><motor name="m" joint="nowhere"/></actuator></mujoco>"""


class Scene:
    """A plant with a body of its own, and a parser."""

    def __init__(self):
        self.builder = DiagramBuilder()
        self.plant, self.scene_graph = AddMultibodyPlantSceneGraph(self.builder, 1e-3)
        self.parser = Parser(self.plant)
        self.parser.AddModelsFromString(urdf(GROUPS.format("g"), "first"), "urdf")
        ground = RigidTransform([0.0, 0.0, -5.0])
        self.plant.RegisterCollisionGeometry(
            self.plant.world_body(), ground, Sphere(1.0), "ground", CoulombFriction(1.0, 1.0)
        )

    def summary(self) -> dict:
        plant, inspector = self.plant, self.scene_graph.model_inspector()
        instances = range(plant.num_model_instances())
        return {
            "instances": [plant.GetModelInstanceName(plant.GetModelInstanceByName("first"))],
            "counts": (len(instances), plant.num_bodies(), plant.num_frames(), plant.num_joints(),
                       plant.num_actuators(), plant.num_force_elements(), plant.num_constraints()),
            "geometry": [inspector.NumGeometriesWithRole(role) for role in (Role.kProximity, Role.kIllustration)],
            "frames": [inspector.GetName(f) for f in inspector.GetAllFrameIds()],
            "candidates": len(inspector.GetCollisionCandidates()),
            "collision": plant.num_collision_geometries(),
            "bodies": [plant.get_body(i).name() for i in plant.GetBodyIndices(world_model_instance())],
            "groups": str(self.parser.GetCollisionFilterGroups()),
            "pose": plant.GetDefaultFloatingBaseBodyPose(plant.GetBodyByName("a")).translation().tolist(),
        }  # fmt: skip

    def trajectory(self) -> np.ndarray:
        """State after two steps with a good model added."""
        self.parser.AddModelsFromString(urdf(), "urdf")
        self.plant.Finalize()
        diagram = self.builder.Build()
        context = diagram.CreateDefaultContext()
        plant_context = self.plant.GetMyContextFromRoot(context)
        self.plant.SetVelocities(plant_context, np.linspace(-1.0, 1.0, self.plant.num_velocities()))
        for _ in range(2):
            diagram.ExecuteForcedEvents(context)
        return self.plant.GetPositionsAndVelocities(plant_context)


def check(fails) -> None:
    scene, untouched = Scene(), Scene()
    before = scene.summary()
    with pytest.raises(RuntimeError):
        fails(scene)
    assert scene.summary() == before
    assert np.array_equal(scene.trajectory(), untouched.trajectory())


@pytest.mark.parametrize("end", BROKEN_URDF.values(), ids=BROKEN_URDF)
def test_urdf_that_fails_late(end):
    check(lambda scene: scene.parser.AddModelsFromString(urdf(end), "urdf"))


def test_world_whose_last_joint_fails():
    check(lambda scene: scene.parser.AddModelsFromString(WORLD, "sdf"))


def test_mjcf_whose_last_actuator_fails():
    scene = Scene()
    scene.parser.SetStrictParsing()
    before = scene.summary()
    with pytest.raises(RuntimeError):
        scene.parser.AddModelsFromString(MJCF, "xml")
    assert scene.summary() == before


DIRECTIVES = """
directives:
- add_model: {{name: good, file: file://{path}}}
- add_frame: {{name: good::f, X_PF: {{base_frame: good::a, translation: [0, 0, 1]}}}}
- add_weld: {{parent: world, child: good::a}}
- add_model: {{name: second, file: file://{path}, default_free_body_pose: {{a: {{translation: [1, 2, 3]}}}}}}
- add_collision_filter_group: {{name: mine, members: [second::a], ignored_collision_filter_groups: [mine]}}
- {last}
"""
BROKEN_DIRECTIVES = {
    "weld of an unknown frame": "add_weld: {parent: world, child: nobody::a}",
    "name taken": "add_model_instance: {name: good}",
    "unknown file": "add_model: {name: third, file: package://nowhere/a.urdf}",
}


@pytest.mark.parametrize("through", ["file", "text", "function"])
@pytest.mark.parametrize("last", BROKEN_DIRECTIVES.values(), ids=BROKEN_DIRECTIVES)
def test_directives_that_fail_late(last, through, tmp_path):
    (tmp_path / "good.urdf").write_text(urdf())
    text = DIRECTIVES.format(path=tmp_path / "good.urdf", last=last)
    (tmp_path / "all.dmd.yaml").write_text(text)

    def fails(scene):
        if through == "file":
            scene.parser.AddModels(str(tmp_path / "all.dmd.yaml"))
        elif through == "text":
            scene.parser.AddModelsFromString(text, "dmd.yaml")
        else:
            ProcessModelDirectives(LoadModelDirectivesFromString(text), scene.plant, scene.parser)

    check(fails)


def test_the_check_sees_what_is_left_behind():
    scene = Scene()
    before = scene.summary()
    scene.plant.AddModelInstance("left behind")
    assert scene.summary() != before
