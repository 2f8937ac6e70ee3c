"""SDFormat on our own plant: places, nesting, includes, and what is refused."""

import logging

import numpy as np
import pytest

from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.multibody.parsing import ParseError, Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from sheldrake.systems.framework import DiagramBuilder


def document(body, version="1.9"):
    return f'<sdf version="{version}" xmlns:drake="http://drake.mit.edu"><model name="m">{body}</model></sdf>'


def world(body):
    return f'<sdf version="1.9"><world name="w">{body}</world></sdf>'


def add(plant, text):
    return Parser(plant).AddModelsFromString(text, "sdf")


def pose_of(plant, body, model="m"):
    plant.Finalize()
    context = plant.CreateDefaultContext()
    frame = plant.GetBodyByName(body, plant.GetModelInstanceByName(model))
    return plant.EvalBodyPoseInWorld(context, frame)


def X(x, y, z, *rpy):
    return RigidTransform(RollPitchYaw(np.array(rpy or (0.0, 0.0, 0.0))), np.array([x, y, z], dtype=float))


def assert_pose(found, expected):
    np.testing.assert_allclose(found.GetAsMatrix34(), expected.GetAsMatrix34(), atol=1e-15)


def test_poses_are_relative_to_links_frames_and_joints(plant):
    add(
        plant,
        document(
            "<pose>0 0 10 0 0 0</pose>"
            '<link name="a"><pose relative_to="f">1 0 0 0 0 0</pose></link>'
            '<link name="b"><pose relative_to="j">0 0 3 0 0 0</pose></link>'
            '<frame name="f"><pose>0 2 0 0 0 1.5</pose></frame>'
            '<joint name="j" type="fixed"><pose relative_to="a">0 0 1 0.2 0 0</pose>'
            "<parent>a</parent><child>b</child></joint>"
        ),
    )
    X_WA = X(0, 0, 10) @ X(0, 2, 0, 0, 0, 1.5) @ X(1, 0, 0)
    assert_pose(pose_of(plant, "b"), X_WA @ X(0, 0, 1, 0.2, 0, 0) @ X(0, 0, 3))


def test_what_follows_a_number_in_its_word_is_passed_over_with_a_warning(plant):
    parser, found = Parser(plant), []
    parser.SetStrictParsing()  # as Drake, which has no word for it
    parser.diagnostic_policy().SetActionForWarnings(lambda detail: found.append(detail.message))
    parser.AddModelsFromString(document('<link name="a"><pose>-0.5, 2m 3 0 0 0</pose></link>'), "sdf")
    assert found == [
        "<pose>: expected a number, found '-0.5,'; -0.5 is taken.",
        "<pose>: expected a number, found '2m'; 2 is taken.",
    ]
    assert_pose(pose_of(plant, "a"), X(-0.5, 2, 3))


@pytest.mark.parametrize("text", ["1,2,3,0,0,0", "0x10 0 0 0 0 0", ", 0 0 0 0 0", "1e999, 0 0 0 0 0"])
def test_what_does_not_begin_with_a_number_is_none(refused, text):
    refused(document(f'<link name="a"><pose>{text}</pose></link>'), "sdf", "<pose>: expected")


def test_renderers_are_named_by_text():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    sphere = "<geometry><sphere><radius>1</radius></sphere></geometry>"
    add(
        plant,
        document(
            f'<link name="a"><visual name="v">{sphere}<drake:accepting_renderer>one</drake:accepting_renderer>'
            "<drake:accepting_renderer>two</drake:accepting_renderer></visual></link>"
        ),
    )
    inspector = scene_graph.model_inspector()
    (geometry,) = inspector.GetAllGeometryIds()
    assert inspector.GetPerceptionProperties(geometry).GetProperty("renderer", "accepting") == {"one", "two"}


def test_degrees_and_quaternions(plant):
    add(plant, document('<link name="a"><pose degrees="true">1 2 3 0 0 90</pose></link>'))
    assert_pose(pose_of(plant, "a"), X(1, 2, 3, 0, 0, np.pi / 2))
    plant = MultibodyPlant(1e-3)
    half = np.sqrt(0.5)
    add(plant, document(f'<link name="a"><pose rotation_format="quat_xyzw">1 2 3 0 0 {half} {half}</pose></link>'))
    assert_pose(pose_of(plant, "a"), X(1, 2, 3, 0, 0, np.pi / 2))


def test_placement_frame_puts_a_frame_of_the_model_at_the_pose(plant):
    text = document('<pose>0 0 5 0 0 0</pose><link name="a"/><frame name="f"><pose>1 0 0 0 0.5 0</pose></frame>')
    add(plant, text.replace('name="m"', 'name="m" placement_frame="f"'))
    assert_pose(pose_of(plant, "a") @ X(1, 0, 0, 0, 0.5, 0), X(0, 0, 5))


def test_nested_models_become_instances_and_can_be_joined(plant):
    instances = add(
        plant,
        document(
            '<link name="a"/><model name="n"><pose>0 0 1 0 0 0</pose><link name="b"/>'
            '<model name="o"><pose>0 0 1 0 0 0</pose><link name="c"/></model></model>'
            '<joint name="j" type="fixed"><parent>a</parent><child>n::b</child></joint>'
            '<joint name="k" type="fixed"><parent>n</parent><child>n::o::c</child></joint>'
        ),
    )
    assert [plant.GetModelInstanceName(instance) for instance in instances] == ["m", "m::n", "m::n::o"]
    assert_pose(pose_of(plant, "c", "m::n::o"), X(0, 0, 2))


def test_static_models_are_welded_where_they_stand(plant):
    add(
        plant,
        document(
            "<static>true</static><pose>0 0 1 0 0 0</pose>"
            '<link name="a"><pose>1 0 0 0 0 0</pose></link><link name="b"/>'
        ),
    )
    assert_pose(pose_of(plant, "a"), X(1, 0, 1))
    assert plant.num_positions() == 0


def test_defaults_of_a_link(plant):
    add(plant, document('<link name="a"/>'))
    M = plant.GetBodyByName("a").default_spatial_inertia()
    assert M.get_mass() == 1.0
    np.testing.assert_array_equal(M.CalcRotationalInertia().CopyToFullMatrix3(), np.eye(3))


def test_axes_by_version(plant):
    """Until 1.4 an axis was given in the model frame; then in the joint's, unless it says otherwise."""
    body = (
        '<link name="a"/><link name="b"><pose>0 0 0 0 0 1.5707963267948966</pose></link>'
        '<joint name="j" type="revolute"><parent>a</parent><child>b</child><axis><xyz>1 0 0</xyz>{}</axis></joint>'
    )
    expected = {
        ("1.4", ""): [0, -1, 0],
        ("1.5", ""): [1, 0, 0],
        ("1.6", "<use_parent_model_frame>1</use_parent_model_frame>"): [0, -1, 0],
        ("1.9", ""): [1, 0, 0],
    }
    for (version, extra), axis in expected.items():
        plant = MultibodyPlant(0.0)
        add(plant, document(body.format(extra), version))
        np.testing.assert_allclose(plant.GetJointByName("j").revolute_axis(), axis, atol=1e-15)


def test_includes(plant, tmp_path):
    part = document('<link name="p"/><frame name="top"><pose>0 0 1 0 0 0</pose></frame>').replace('"m"', '"part"')
    (tmp_path / "part.sdf").write_text(part)
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "model.sdf").write_text(part)
    (tmp_path / "folder" / "old.sdf").write_text("not XML")
    (tmp_path / "folder" / "model.config").write_text(
        '<model><sdf version="1.4">old.sdf</sdf><sdf version="1.9">model.sdf</sdf></model>'
    )
    (tmp_path / "r.urdf").write_text('<robot name="r"><link name="u"/></robot>')
    (tmp_path / "all.sdf").write_text(
        world(
            "<include><uri>part.sdf</uri><pose>1 0 0 0 0 0</pose></include>"
            "<include><uri>model://kit/folder</uri><name>two</name>"
            "<pose relative_to='part::top'>0 0 1 0 0 0</pose></include>"
            "<include><uri>r.urdf</uri><name>three</name><pose>0 0 7 0 0 0</pose></include>"
            "<model name='four'><include merge='true'><uri>part.sdf</uri><pose>0 9 0 0 0 0</pose></include></model>"
        )
    )
    parser = Parser(plant)
    parser.package_map().Add("kit", tmp_path)
    instances = parser.AddModels(tmp_path / "all.sdf")
    names = {plant.GetModelInstanceName(instance) for instance in instances}
    assert names == {"part", "two", "four"}  # URDF files that SDFormat includes are not returned, as in Drake
    assert plant.HasModelInstanceNamed("three")
    plant.Finalize()
    context = plant.CreateDefaultContext()
    for model, body, expected in (
        ("part", "p", X(1, 0, 0)),
        ("two", "p", X(1, 0, 2)),
        ("three", "u", X(0, 0, 7)),
        ("four", "p", X(0, 9, 0)),
    ):
        frame = plant.GetBodyByName(body, plant.GetModelInstanceByName(model))
        assert_pose(plant.EvalBodyPoseInWorld(context, frame), expected)


def test_a_file_that_includes_itself_is_refused(plant, tmp_path):
    (tmp_path / "a.sdf").write_text(document("<include><uri>a.sdf</uri></include>"))
    with pytest.raises(ParseError, match="includes itself"):
        Parser(plant).AddModels(tmp_path / "a.sdf")


A, B = '<link name="a"/>', '<link name="b"/>'


def joint(kind, content="", parent="a", child="b"):
    return f'<joint name="j" type="{kind}"><parent>{parent}</parent><child>{child}</child>{content}</joint>'


BAD = {
    "other root": ("<robot/>", "<sdf> element"),
    "no version": ("<sdf/>", "attribute 'version'"),
    "newer version": (document(A, "1.99"), "newer than"),
    "nothing inside": ('<sdf version="1.9"/>', "one <world> or <model>"),
    "no link": (document(""), "has no link"),
    "reserved name": (document('<link name="world"/>'), "reserved"),
    "same name": (document(A + '<frame name="a"/>'), "already has a link named 'a'"),
    "unknown relative_to": (
        document('<link name="a"><pose relative_to="x">0 0 0 0 0 0</pose></link>'),
        "'x'; known are __model__, a",
    ),
    "circular poses": (
        document(
            '<link name="a"><pose relative_to="b">1 0 0 0 0 0</pose></link>'
            '<link name="b"><pose relative_to="a">1 0 0 0 0 0</pose></link>'
        ),
        "relative to itself",
    ),
    "circular frames": (document(A + '<frame name="f" attached_to="g"/><frame name="g" attached_to="f"/>'), "itself"),
    "short pose": (document('<link name="a"><pose>1 2 3</pose></link>'), "expected 6 numbers, found '1 2 3'"),
    "NaN pose": (document('<link name="a"><pose>nan 0 0 0 0 0</pose></link>'), "finite number, found 'nan'"),
    "no such link": (document(A + joint("fixed")), "'b'; known are __model__, a, j"),
    "child world": (document(A + joint("fixed", child="world")), "world cannot be a child"),
    "itself": (document(A + joint("fixed", child="a")), "to itself"),
    "unknown type": (document(A + B + joint("hinge")), "'hinge' of joint 'j' is unknown; supported are fixed"),
    "unsupported type": (document(A + B + joint("revolute2")), "not supported"),
    "no axis": (document(A + B + joint("revolute")), "needs an <axis>"),
    "zero axis": (document(A + B + joint("revolute", "<axis><xyz>0 0 0</xyz></axis>")), "axis of joint 'j' is zero"),
    "limits swapped": (
        document(A + B + joint("revolute", "<axis><limit><lower>1</lower><upper>0</upper></limit></axis>")),
        "above upper limit",
    ),
    "moving joint in static model": (
        document("<static>1</static>" + A + B + joint("revolute", "<axis/>")),
        "static model has fixed joints only",
    ),
    "missing include": (document("<include><uri>package://nope/x.sdf</uri></include>"), "unknown package 'nope'"),
    "mimics nobody": (
        document(A + B + joint("revolute", '<axis/><drake:mimic joint="x" multiplier="1" offset="0"/>')),
        "'x', which does not exist",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_explained_and_leaves_the_plant_alone(refused, name):
    text, message = BAD[name]
    refused(text, "sdf", message)


def test_ignored_content_is_reported(plant, caplog):
    with caplog.at_level(logging.WARNING, logger="drake"):
        add(
            plant,
            document(
                '\n<self_collide>true</self_collide>\n<link name="a">\n<sensor name="s"/></link>'
                + B
                + joint("revolute", "\n<axis><dynamics><friction>1</friction></dynamics></axis>")
            ),
        )
    messages = [record.getMessage() for record in caplog.records]
    assert [message.split(":")[1] for message in messages] == ["2", "4", "5"]
    assert "<self_collide>" in messages[0] and "<sensor>" in messages[1] and "friction 1" in messages[2]


def test_long_chains_of_poses_and_deep_nesting():
    links = "".join(f'<link name="l{i}"><pose relative_to="l{i - 1}">0 0 1 0 0 0</pose></link>' for i in range(1, 400))
    plant = MultibodyPlant(0.0)
    add(plant, document('<link name="l0"/>' + links))
    assert_pose(pose_of(plant, "l399"), X(0, 0, 399))
    nested = "".join(f'<model name="n{i}"><link name="a"/>' for i in range(400)) + "</model>" * 400
    with pytest.raises(ParseError, match="too deeply"):
        add(MultibodyPlant(0.0), f'<sdf version="1.9">{nested}</sdf>')


def test_frames_in_a_long_chain_are_resolved_once_each(monkeypatch):
    """Each was followed to its link anew: 3,000 took eleven seconds, and were refused."""
    from sheldrake.multibody.parsing._sdf.frames import SdfScope

    calls, follow = [], SdfScope.body
    monkeypatch.setattr(SdfScope, "body", lambda self, *args: calls.append(args) or follow(self, *args))
    frames = "".join(
        f'<frame name="f{k + 1}" attached_to="f{k}"><pose relative_to="f{k}">1 0 0 0 0 0</pose></frame>'
        for k in range(1500)
    )
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(
        f'<sdf version="1.9"><model name="m"><link name="f0"/>{frames}</model></sdf>', "sdf"
    )
    assert plant.GetFrameByName("f1500").GetFixedPoseInBodyFrame().translation().tolist() == [1500.0, 0.0, 0.0]
    assert len(calls) < 5000


BALL = "<collision name='c'>{}<geometry><sphere><radius>0.1</radius></sphere></geometry></collision>"
CONE = "<collision name='c'><geometry><cone>{}</cone></geometry></collision>"


@pytest.mark.parametrize(
    ("link", "error"),
    [
        ("<inertial auto='true'/>", "no <collision>"),
        ("<inertial auto='true'/><collision name='c'><geometry><plane/></geometry></collision>", "<plane> has no mass"),
        ("<inertial auto='true'/>" + BALL.format("<density>-1</density>"), "the density is not positive"),
        ("<inertial auto='true'><mass>0</mass></inertial>" + BALL.format(""), "a mass of 0 kg"),
        ("<inertial auto='true'/><collision name='c'><geometry><empty/></geometry></collision>", "without mass"),
        ("<inertial auto='true'/>" + CONE.format("<length>0</length>"), "cone of radius 0.5 m and length 0 m"),
    ],
)
def test_inertia_that_collisions_do_not_give(link, error):
    plant = MultibodyPlant(0.0)
    with pytest.raises(ParseError, match=error):
        add(plant, document(f"<link name='a'>{link}</link>"))
    assert plant.num_bodies() == 1


def test_inertia_of_collisions_is_the_same_without_geometry():
    """With and without a SceneGraph."""
    text = document(f"<link name='a'><inertial auto='true'/>{BALL.format('<pose>1 2 3 0.1 0.2 0.3</pose>')}</link>")
    alone = MultibodyPlant(0.0)
    add(alone, text)
    plant, _ = AddMultibodyPlantSceneGraph(DiagramBuilder(), 0.0)
    add(plant, text)
    M, other = (p.GetBodyByName("a").default_spatial_inertia().CopyToFullMatrix6() for p in (alone, plant))
    assert M[3, 3] == pytest.approx(1000.0 * 4.0 / 3.0 * np.pi * 1e-3, rel=1e-15) and np.array_equal(M, other)


def test_inertia_of_a_cone_that_touches_nothing():
    """The cone is no collision geometry of Drake's, but its mass counts. By parts: the integral over discs."""
    plant = MultibodyPlant(0.0)
    link = f"<inertial auto='true'><density>300</density></inertial>{CONE.format('<radius>0.3</radius>')}"
    add(plant, document(f"<link name='a'>{link}</link>"))
    z, weight = np.polynomial.legendre.leggauss(4)  # exact up to z^7
    z, weight = 0.5 * z, 0.5 * weight  # length 1, about the middle
    r = 0.3 * (0.5 - z)  # apex at z = 0.5
    disc = 300.0 * np.pi * r**2 * weight
    moments = [disc @ (r**2 / 4 + z**2), disc @ (r**2 / 4 + z**2), disc @ (r**2 / 2)]
    M = plant.GetBodyByName("a").default_spatial_inertia()
    assert M.get_mass() == pytest.approx(disc.sum(), rel=1e-14)
    np.testing.assert_allclose(M.get_com(), [0.0, 0.0, disc @ z / disc.sum()], rtol=1e-14)
    np.testing.assert_allclose(M.CalcRotationalInertia().get_moments(), moments, rtol=1e-14)


@pytest.mark.parametrize("body", ["<link name='a::b'/>", "<link name='a'/><frame name='f::g' attached_to='a'/>"])
def test_names_without_separators(body):
    with pytest.raises(ParseError, match="must not contain '::'"):
        add(MultibodyPlant(0.0), document(body))
