"""MJCF on our own plant: defaults, masses, joints, and what is refused."""

import logging

import numpy as np
import pytest

from sheldrake.multibody.parsing import ParseError, Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from sheldrake.systems.framework import DiagramBuilder

BALL = '<geom type="sphere" size="0.1"/>'


def document(body, rest=""):
    return f'<mujoco model="m">{rest}<worldbody>{body}</worldbody></mujoco>'


def add(plant, text):
    return Parser(plant).AddModelsFromString(text, "xml")


def inertia_of(plant, body):
    M = plant.GetBodyByName(body).default_spatial_inertia()
    return M.get_mass(), M.get_com(), M.CalcRotationalInertia().CopyToFullMatrix3()


def test_mass_comes_from_the_geoms(plant):
    add(plant, document('<body name="a"><geom type="box" size="0.1 0.2 0.3" pos="1 0 0" density="500"/></body>'))
    mass, com, inertia = inertia_of(plant, "a")
    np.testing.assert_allclose(mass, 500 * 0.2 * 0.4 * 0.6, rtol=1e-14)
    np.testing.assert_allclose(com, [1, 0, 0], atol=1e-15)
    about_com = mass / 12 * np.diag([0.4**2 + 0.6**2, 0.2**2 + 0.6**2, 0.2**2 + 0.4**2])
    np.testing.assert_allclose(inertia, about_com + mass * np.diag([0, 1, 1]), rtol=1e-13, atol=1e-15)


def test_shapes_are_numbered_geom_by_geom():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    drawn = '<geom name="drawn" size="0.1" contype="0" conaffinity="0"/>'
    add(plant, document(f'<body name="a"><geom name="first" size="0.1"/>{drawn}<geom name="last" size="0.1"/></body>'))
    inspector = scene_graph.model_inspector()
    frame = plant.GetBodyFrameIdOrThrow(plant.GetBodyByName("a").index())
    found = [
        (inspector.GetName(geometry), inspector.GetProximityProperties(geometry) is not None)
        for geometry in inspector.GetGeometries(frame)
    ]
    # As Drake has them: what is seen of a geom, then what touches.
    assert found == [
        ("m::first", False),
        ("m::first", True),
        ("m::drawn", False),
        ("m::last", False),
        ("m::last", True),
    ]


def test_two_halves_weigh_like_the_whole(plant):
    halves = '<geom type="box" size="0.1 0.1 0.1" pos="0.1 0 0"/><geom type="box" size="0.1 0.1 0.1" pos="-0.1 0 0"/>'
    add(plant, document(f'<body name="a">{halves}</body><body name="b"><geom type="box" size="0.2 0.1 0.1"/></body>'))
    for one, other in zip(inertia_of(plant, "a"), inertia_of(plant, "b")):
        np.testing.assert_allclose(one, other, rtol=1e-13, atol=1e-15)


def test_inertial_wins_unless_the_compiler_says_otherwise(plant):
    body = f'<body name="a"><inertial mass="7" pos="0 0 0" diaginertia="1 1 1"/>{BALL}</body>'
    add(plant, document(body))
    assert inertia_of(plant, "a")[0] == 7.0
    plant = MultibodyPlant(1e-3)
    add(plant, document(body, '<compiler inertiafromgeom="true"/>'))
    np.testing.assert_allclose(inertia_of(plant, "a")[0], 1000 * 4 / 3 * np.pi * 0.001, rtol=1e-14)


def test_a_connect_of_sites_is_ignored_with_a_warning(plant, caplog):
    """As in Drake; it has no anchor to ask for."""
    sites = f'<body name="a"><freejoint/>{BALL}<site name="s"/></body><site name="t"/>'
    add(plant, document(sites).replace("</mujoco>", '<equality><connect site1="s" site2="t"/></equality></mujoco>'))
    assert plant.num_constraints() == 0 and "<connect> of sites is not supported" in caplog.text


def test_a_mesh_is_not_weighed_where_the_inertia_is_given(plant, tmp_path, monkeypatch):
    """Large meshes take long to weigh, and open ones would warn of a mass that nobody needs."""
    from sheldrake.multibody.parsing._mjcf import geoms

    def weigh(*_arguments):
        raise AssertionError("weighed")

    monkeypatch.setattr(geoms, "solid_properties", weigh)
    (tmp_path / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n")
    inertial = '<inertial mass="7" pos="0 0 0" diaginertia="1 1 1"/>'
    asset = f'<asset><mesh name="m" file="{tmp_path}/m.obj"/></asset>'
    add(plant, document(f'<body name="a">{inertial}<geom type="mesh" mesh="m"/></body>', asset))
    assert inertia_of(plant, "a")[0] == 7.0


def test_default_classes_cascade(plant):
    defaults = (
        '<default><joint damping="3"/><geom density="1"/><default class="c"><joint axis="1 0 0"/>'
        '<default class="d"><joint damping="4"/></default></default></default>'
    )
    add(
        plant,
        document(
            f'<body name="a" childclass="c"><joint name="i"/>{BALL}<body name="b"><joint name="j" class="d"/>{BALL}'
            f'<body name="c"><joint name="k" class="main" damping="5"/>{BALL}</body></body></body>',
            defaults,
        ),
    )
    found = {name: plant.GetJointByName(name) for name in "ijk"}
    assert [found[name].default_damping() for name in "ijk"] == [3.0, 4.0, 5.0]
    assert [list(found[name].revolute_axis()) for name in "ijk"] == [[1, 0, 0], [1, 0, 0], [0, 0, 1]]


def test_joints_and_the_reference_position(plant):
    add(
        plant,
        document(
            f'<body name="a" pos="0 0 1"><joint name="h" range="-90 45" ref="30"/>{BALL}'
            f'<body name="b" pos="1 0 0"><joint name="s" type="slide" axis="1 0 0" ref="0.5"/>{BALL}</body></body>'
            f'<body name="c">{BALL}</body><body name="d" pos="0 5 0"><freejoint/>{BALL}</body>'
        ),
    )
    plant.Finalize()
    hinge = plant.GetJointByName("h")
    np.testing.assert_allclose(
        [hinge.position_lower_limit(), hinge.position_upper_limit()], [-np.pi / 2, np.pi / 4], rtol=1e-15
    )
    context = plant.CreateDefaultContext()
    np.testing.assert_allclose(hinge.get_angle(context), np.pi / 6, rtol=1e-15)
    for name, expected in (("a", [0, 0, 1]), ("b", [1, 0, 1]), ("c", [0, 0, 0]), ("d", [0, 5, 0])):
        pose = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName(name))
        np.testing.assert_allclose(pose.translation(), expected, atol=1e-15)
        np.testing.assert_allclose(pose.rotation().matrix(), np.eye(3), atol=1e-15)


def test_actuators(plant):
    actuators = (
        '<actuator><motor name="m" joint="j" gear="5" ctrlrange="-2 2"/>'
        '<position joint="j" kp="10" forcerange="-3 3"/></actuator>'
    )
    add(
        plant,
        document(f'<body><joint name="j" armature="0.5"/>{BALL}</body>').replace("</mujoco>", actuators + "</mujoco>"),
    )
    motor, position = (plant.GetJointActuatorByName(name) for name in ("m", "motor1"))
    assert (motor.effort_limit(), motor.default_gear_ratio(), motor.default_rotor_inertia()) == (2.0, 5.0, 0.02)
    assert position.effort_limit() == 3.0
    assert position.get_controller_gains().p == 10.0


def test_gravity_and_excludes():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    text = document(
        f'<body name="a"><freejoint/>{BALL}</body><body name="b"><freejoint/>{BALL}</body>'
        f'<body name="c"><freejoint/>{BALL}</body>',
        '<option gravity="0 0 -1"/>',
    )
    add(plant, text.replace("</mujoco>", '<contact><exclude body1="a" body2="b"/></contact></mujoco>'))
    plant.Finalize()
    np.testing.assert_array_equal(plant.gravity_field().gravity_vector(), [0, 0, -1])
    assert len(scene_graph.model_inspector().GetCollisionCandidates()) == 2


def test_includes(plant, tmp_path):
    (tmp_path / "part.xml").write_text(f'<mujocoinclude><body name="b">{BALL}</body></mujocoinclude>')
    (tmp_path / "all.xml").write_text(document('<include file="part.xml"/>'))
    Parser(plant).AddModels(tmp_path / "all.xml")
    assert plant.HasBodyNamed("b")
    (tmp_path / "part.xml").write_text('<mujocoinclude><include file="part.xml"/></mujocoinclude>')
    with pytest.raises(ParseError, match="includes itself"):
        Parser(MultibodyPlant(0.0)).AddModels(tmp_path / "all.xml")


BAD = {
    "other root": ("<robot/>", "<mujoco> element"),
    "no name": ("<mujoco/>", "needs a name"),
    "same body": (document(f'<body name="a">{BALL}</body><body name="a">{BALL}</body>'), "contains a link named 'a'"),
    "unknown joint": (document(f'<body><joint type="hook"/>{BALL}</body>'), "unknown type 'hook'; known are hinge"),
    "zero axis": (document(f'<body><joint axis="0 0 0"/>{BALL}</body>'), "axis of joint 'world-body1' is zero"),
    "free below": (document(f'<body>{BALL}<body name="b"><freejoint/>{BALL}</body></body>'), "child of the world"),
    "free and more": (document(f'<body name="a"><freejoint/><joint/>{BALL}</body>'), "cannot have other joints"),
    "unknown geom": (
        document('<body><geom type="torus" size="1"/></body>'),
        "'torus'; known are plane, mesh, box, sphere",
    ),
    "short size": (document('<body><geom type="box" size="1 2"/></body>'), "needs 3 numbers, found 2"),
    "negative size": (document('<body><geom size="-1"/></body>'), "must be positive"),
    "two orientations": (document(f'<body euler="0 0 1" quat="1 0 0 0">{BALL}</body>'), "several orientations"),
    "zero quaternion": (document(f'<body quat="0 0 0 0">{BALL}</body>'), "orientation of this <body> is zero"),
    "impossible inertia": (
        document('<body name="a"><inertial mass="1" pos="0 0 0" diaginertia="1 1 5"/></body>'),
        "inertia of body 'a'",
    ),
    "no mass": (document('<body name="a"><inertial pos="0 0 0"/></body>'), "needs the attribute 'mass'"),
    "no such joint": (
        document("").replace("</mujoco>", '<actuator><motor name="x" joint="j"/></actuator></mujoco>'),
        "names joint 'j', which does not exist",
    ),
    "no such body": (
        document("").replace("</mujoco>", '<contact><exclude body1="a" body2="b"/></contact></mujoco>'),
        "no body 'a'",
    ),
    "global coordinates": (document("", '<compiler coordinate="global"/>'), "coordinate='global'> is not supported"),
    "range without flag": (
        document(f'<body><joint range="0 1"/>{BALL}</body>', '<compiler autolimits="false"/>'),
        "autolimits",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_explained_and_leaves_the_plant_alone(refused, name):
    text, message = BAD[name]
    refused(text, "xml", message)


def test_a_body_outside_the_world_body_is_reported(plant, caplog):
    with caplog.at_level(logging.WARNING, logger="drake"):
        add(plant, document("", rest='<body name="lost"><geom size="0.1"/></body>'))
    assert any("<body> inside <mujoco>" in record.getMessage() for record in caplog.records)
    assert not plant.HasBodyNamed("lost")


def test_ignored_content_is_reported(plant, caplog):
    with caplog.at_level(logging.WARNING, logger="drake"):
        add(plant, document('\n<body><site name="s"/>\n<joint stiffness="3"/>\n<geom size="0.1" condim="4"/></body>'))
    messages = [record.getMessage() for record in caplog.records]
    lines = sorted(message.split(":")[1] for message in messages)
    assert lines == ["2", "3", "4"]
