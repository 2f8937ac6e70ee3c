"""Parser on our own plant: call forms, names, errors that leave the plant alone, warnings, retired calls."""

import logging
import pathlib
import shutil

import numpy as np
import pytest

from sheldrake.common.deprecation import DrakeDeprecationWarning
from sheldrake.multibody.parsing import ParseError, Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, DiscreteContactApproximation, MultibodyPlant
from sheldrake.systems.framework import DiagramBuilder

MODELS = pathlib.Path(__file__).parents[3] / "models" / "parsing"
INERTIAL = '<inertial><mass value="2"/><inertia ixx="0.1" iyy="0.2" izz="0.15" ixy="0" ixz="0" iyz="0"/></inertial>'


def robot(body, name="r"):
    return f'<robot name="{name}" xmlns:drake="http://drake.mit.edu">{body}</robot>'


def link(name, content=""):
    return f'<link name="{name}">{INERTIAL}{content}</link>'


def joint(content="", kind="revolute", name="j", parent="a", child="b"):
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{content}</joint>'


@pytest.fixture
def scene():
    builder = DiagramBuilder()
    return AddMultibodyPlantSceneGraph(builder, 1e-3)


def add(plant, text, kind="urdf"):
    return Parser(plant).AddModelsFromString(text, kind)


def snapshot(plant):
    return plant.num_bodies(), plant.num_model_instances(), plant.num_joints(), plant.num_frames()


def test_call_forms(scene):
    plant, scene_graph = scene
    for parser in (
        Parser(plant),
        Parser(plant=plant),
        Parser(plant, scene_graph),
        Parser(plant, "prefix"),
        Parser(plant=plant, scene_graph=scene_graph, model_name_prefix="prefix"),
    ):
        assert parser.plant() is plant
        assert parser.scene_graph() is scene_graph
        assert parser.builder() is None


def test_a_builder_is_enough():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    parser = Parser(builder=builder)
    assert parser.plant() is plant and parser.scene_graph() is scene_graph and parser.builder() is builder
    with pytest.raises(RuntimeError, match="no system named 'plant'"):
        Parser(builder=DiagramBuilder())


@pytest.mark.parametrize("arguments", [{}, {"plants": 1}, {"model_name_prefix": "x"}])
def test_wrong_construction(arguments):
    with pytest.raises(TypeError, match=r"Parser\(\)"):
        Parser(**arguments)


def test_models_from_file_url_and_string(plant, tmp_path):
    (tmp_path / "one.urdf").write_text(robot(link("a"), "one"))
    parser = Parser(plant)
    parser.package_map().Add("here", tmp_path)
    first = parser.AddModels(tmp_path / "one.urdf")
    parser.SetAutoRenaming(True)
    assert parser.GetAutoRenaming()
    second = parser.AddModels(url="package://here/one.urdf")
    third = parser.AddModelsFromUrl("package://here/one.urdf")
    fourth = parser.AddModels(file_contents=robot(link("a"), "two"), file_type="urdf")
    names = [plant.GetModelInstanceName(instance) for instance in (*first, *second, *third, *fourth)]
    assert names == ["one", "one_1", "one_2", "two"]


def test_wrong_combinations_of_arguments(plant):
    for arguments in ({}, {"file_contents": "x"}, {"url": "a", "file_contents": "b", "file_type": "urdf"}):
        with pytest.raises(TypeError, match=r"AddModels\(\) takes"):
            Parser(plant).AddModels(**arguments)


def test_prefix(plant):
    [instance] = Parser(plant, "left::arm").AddModelsFromString(robot(link("a")), "urdf")
    assert plant.GetModelInstanceName(instance) == "left::arm::r"


def test_numbers_reach_the_plant(plant):
    text = robot(
        link("a")
        + link("b")
        + joint('<axis xyz="0 3 4"/><limit lower="-1" upper="2" effort="5" velocity="3"/><dynamics damping="0.5"/>')
        + '<transmission><type>SimpleTransmission</type><joint name="j"/><actuator name="m"/></transmission>'
        + '<frame name="tool" link="b" xyz="1 2 3"/>'
    )
    add(plant, text)
    hinge = plant.GetJointByName("j")
    np.testing.assert_allclose(hinge.revolute_axis(), [0.0, 0.6, 0.8], atol=1e-16)
    assert (hinge.position_lower_limit(), hinge.position_upper_limit()) == (-1.0, 2.0)
    assert hinge.velocity_upper_limit() == 3.0
    assert hinge.default_damping() == 0.5
    assert plant.GetJointActuatorByName("m").effort_limit() == 5.0
    X = plant.GetFrameByName("tool").GetFixedPoseInBodyFrame()
    np.testing.assert_array_equal(X.translation(), [1.0, 2.0, 3.0])


@pytest.mark.parametrize(
    ("mass", "moments", "stand_in", "warns"),
    [
        ("1", "1 1 10", 1.0, True),
        ("-1", "1 1 1", 1.0, True),
        ("0", "1 1 1", 1.0, True),
        ("5", "-1 1 1", 5.0, True),
        ("2", "0 0 0", None, False),
        ("0", "0 0 0", None, False),
    ],
)
def test_impossible_inertias_become_a_sphere_of_water(plant, mass, moments, stand_in, warns):
    ixx, iyy, izz = moments.split()
    inertia = f'<inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}"/>'
    warnings = []
    parser = Parser(plant)
    parser.diagnostic_policy().SetActionForWarnings(lambda detail: warnings.append(detail.FormatWarning()))
    parser.AddModelsFromString(
        robot(f'\n<link name="a"><inertial><mass value="{mass}"/>{inertia}</inertial></link>'), "urdf"
    )
    M = plant.GetBodyByName("a").default_spatial_inertia()
    assert bool(warnings) == warns
    if stand_in is None:
        assert M.get_mass() == float(mass)
        return
    assert "<literal-string>.urdf:2:" in warnings[0] and "Link 'a'" in warnings[0] and "solid sphere" in warnings[0]
    radius = (stand_in / (1000.0 * 4.0 / 3.0 * np.pi)) ** (1.0 / 3.0)
    expected = 0.4 * stand_in * radius**2
    np.testing.assert_allclose(M.get_mass(), stand_in, rtol=1e-14)
    np.testing.assert_allclose(
        M.CalcRotationalInertia().CopyToFullMatrix3(), expected * np.eye(3), rtol=1e-13, atol=1e-18
    )


BAD = {
    "not XML": ("<robot", "well-formed"),
    "empty": ("", "no element|empty"),
    "other root": ("<sdf/>", "<robot>"),
    "no name": ("<robot/>", "needs a name"),
    "same link twice": (robot(link("a") + link("a")), "already contains a link named 'a'"),
    "same joint twice": (
        robot(link("a") + link("b") + link("c") + joint() + joint(child="c")),
        "already contains a joint named 'j'",
    ),
    "no parent link": (robot(link("b") + joint()), "no parent link 'a'; known are b"),
    "no child link": (robot(link("a") + joint()), "no child link 'b'"),
    "no parent tag": (robot(link("a") + '<joint name="j" type="fixed"><child link="a"/></joint>'), "no <parent>"),
    "itself": (robot(link("a") + joint(child="a")), "to itself"),
    "frame of a joint": (
        robot(link("a") + link("b") + '<link name="j_parent"/>' + joint()),
        "two frames named 'j_parent' \\(see line 1\\)",
    ),
    "loop": (
        robot(
            link("a")
            + link("b")
            + link("c")
            + joint()
            + joint(name="k", parent="b", child="c")
            + joint(name="l", parent="c", child="a")
        ),
        "Joint 'l' closes a kinematic loop",
    ),
    "two parents": (
        robot(
            link("a")
            + link("b")
            + link("c")
            + joint()
            + joint(name="k", parent="a", child="c")
            + joint(name="l", parent="c", child="b")
        ),
        "kinematic loop",
    ),
    "zero axis": (robot(link("a") + link("b") + joint('<axis xyz="0 0 0"/>')), "axis of joint 'j' is zero"),
    "letters": (robot('<link name="a"><inertial><mass value="heavy"/></inertial></link>'), "'value'.*'heavy'"),
    "NaN": (robot('<link name="a"><inertial><mass value="nan"/></inertial></link>'), "finite number, found 'nan'"),
    "overflow": (robot('<link name="a"><inertial><mass value="1e999"/></inertial></link>'), "finite number"),
    "two numbers": (robot(link("a") + link("b") + joint('<axis xyz="0 1"/>')), "expected 3 numbers, found '0 1'"),
    "unknown type": (
        robot(link("a") + link("b") + joint(kind="hinge")),
        "unknown type 'hinge'; known are fixed, revolute",
    ),
    "limits swapped": (robot(link("a") + link("b") + joint('<limit lower="1" upper="0"/>')), "above upper limit"),
    "negative damping": (robot(link("a") + link("b") + joint('<dynamics damping="-1"/>')), "must not be negative"),
    "mimics nobody": (
        robot(link("a") + link("b") + joint('<mimic joint="x"/>')),
        "'x', which does not exist; known: j",
    ),
    "reserved entity": ('<!DOCTYPE r [<!ENTITY x "y">]>' + robot(link("a")), "entities are refused"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_explained_and_leaves_the_plant_alone(plant, name):
    text, message = BAD[name]
    before = snapshot(plant)
    with pytest.raises(ParseError, match=message) as caught:
        add(plant, text)
    assert caught.value.location.source == "<literal-string>.urdf"
    assert snapshot(plant) == before


def test_shapes_and_files_that_do_not_exist(scene):
    plant, _ = scene
    before = snapshot(plant)

    def visual(shape):
        return robot(link("a", f"<visual><geometry>{shape}</geometry></visual>"))

    for shape, message in (
        ('<mesh filename="/nope/x.obj"/>', "'/nope/x.obj' resolved to '/nope/x.obj' which does not exist"),
        ('<mesh filename="x.obj"/>', "'x.obj' is a relative path"),
        ('<mesh filename="package://nope/x.obj"/>', "unknown package 'nope'. Known packages: .*drake_models"),
        ('<mesh filename="http://x/y.obj"/>', "unsupported scheme 'http://'"),
        ("<mesh/>", "missing the attribute 'filename'"),
        ('<sphere radius="-1"/>', "must be positive: -1"),
        ('<box size="1 0 1"/>', "must be positive"),
        ("<torus/>", "found <torus>, known are <box>"),
        ("", "found nothing"),
    ):
        with pytest.raises(ParseError, match=message):
            add(plant, visual(shape))
        assert snapshot(plant) == before


def test_without_a_scene_graph_no_mesh_is_looked_for(plant):
    add(plant, robot(link("a", '<visual><geometry><mesh filename="/nope/x.obj"/></geometry></visual>')))
    assert plant.HasBodyNamed("a")


def test_a_name_that_is_taken_is_refused_before_anything_is_added(plant):
    add(plant, robot(link("a")))
    before = snapshot(plant)
    with pytest.raises(
        ParseError, match=r"already has a model instance named 'r'. Call parser.SetAutoRenaming\(True\)"
    ):
        add(plant, robot(link("b")))
    assert snapshot(plant) == before


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        (robot(link("a") + "\n<bogus/>"), 2, "<bogus> inside <robot>"),
        (robot('\n\n<link name="a"><bogus/></link>'), 3, "<bogus> inside <link>"),
        (robot(link("a") + '<link\n name="b"\n colour="red"/>'), 3, "'colour' of <link>"),
        (robot(link("a") + link("b") + joint('\n<dynamics friction="1"/>')), 2, "has friction"),
        (robot(link("a") + link("b") + "\n" + joint(kind="floating")), 2, "left as a free body"),
        (
            robot(
                link("a")
                + link("b")
                + joint('\n<mimic joint="j2"/>')
                + joint(kind="fixed", name="j2", child="c")
                + link("c")
            ),
            2,
            "is fixed; the tag is ignored",
        ),
    ],
)
def test_ignored_content_is_reported_with_its_line(plant, text, line, message, caplog):
    with caplog.at_level(logging.WARNING, logger="drake"):
        add(plant, text)
    [record] = caplog.records
    assert record.getMessage().startswith(f"<literal-string>.urdf:{line}:")
    assert message in record.getMessage()


def test_strict_parsing_makes_warnings_errors(plant):
    parser = Parser(plant)
    parser.SetStrictParsing()
    with pytest.raises(ParseError, match="<calibration>"):
        parser.AddModelsFromString(robot(link("a") + link("b") + joint("<calibration/>")), "urdf")
    assert plant.num_model_instances() == 2


def test_strict_parsing_does_not_mind_what_drake_passes_over(plant, caplog):
    parser = Parser(plant)
    parser.SetStrictParsing()
    with caplog.at_level(logging.WARNING, logger="drake"):
        parser.AddModelsFromString(robot(link("a") + "<bogus/>"), "urdf")
    assert "<bogus> inside <robot> is not supported and is ignored" in caplog.text


def test_mimic_is_ignored_with_a_warning_when_the_solver_takes_no_constraints(plant, caplog):
    plant.set_discrete_contact_approximation(DiscreteContactApproximation.kTamsi)
    chain = link("a") + link("b") + link("c") + joint() + joint('<mimic joint="j"/>', name="k", parent="b", child="c")
    with caplog.at_level(logging.WARNING, logger="drake"):
        add(plant, robot(chain))
    assert "mimics 'j', but TAMSI takes no constraints" in caplog.text


def test_mimic_couples_joints():
    chain = (
        link("a") + link("b") + link("c") + joint() + joint('<mimic joint="j" multiplier="2"/>', name="k", child="c")
    )
    discrete, continuous = MultibodyPlant(1e-3), MultibodyPlant(0.0)
    add(discrete, robot(chain))
    assert discrete.num_constraints() == 1
    add(continuous, robot(chain))
    assert continuous.HasJointNamed("k")


def test_files(plant, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    parser = Parser(plant)
    with pytest.raises(ParseError, match=r"nope\.urdf: error: The file does not exist"):
        parser.AddModels("nope.urdf")
    (tmp_path / "robot.stl").write_text("solid robot")
    with pytest.raises(ParseError, match=r"not recognized; the known endings are \.urdf, \.sdf, \.xml, \.dmd\.yaml"):
        parser.AddModels("robot.stl")
    with pytest.raises(ParseError, match="not recognized"):
        parser.AddModelsFromString("<robot/>", "robot")
    (tmp_path / "folder.urdf").mkdir()
    with pytest.raises(ParseError, match="is a folder"):
        parser.AddModels("folder.urdf")
    (tmp_path / "nameless.urdf").write_text(f"<robot>{link('a')}</robot>")
    [instance] = parser.AddModels("nameless.urdf")
    assert plant.GetModelInstanceName(instance) == "nameless"


def test_parsing_after_finalize_is_refused(plant):
    parser = Parser(plant)
    plant.Finalize()
    with pytest.raises(RuntimeError, match="Finalize"):
        parser.AddModelsFromString(robot(link("a")), "urdf")
    assert Parser(plant).package_map().size() > 0


@pytest.mark.parametrize(
    ("ending", "text"),
    [
        (
            "urdf",
            '<robot name="r"><link name="a"><inertial><origin xyz="1e308 0 0"/><mass value="1"/>'
            '<inertia ixx="1" iyy="1" izz="1"/></inertial></link></robot>',
        ),
        (
            "xml",
            '<mujoco model="m"><worldbody><body name="b"><geom type="box" size="1 1 1e200" mass="1e200"/>'
            "</body></worldbody></mujoco>",
        ),
    ],
)
def test_numbers_of_which_nothing_can_be_made_are_faults_of_the_file(plant, ending, text):
    before = plant.num_bodies(), plant.num_joints(), plant.num_frames(), plant.num_model_instances()
    with pytest.raises(RuntimeError, match=f"<literal-string>.{ending}.*: error: "):
        Parser(plant).AddModelsFromString(text, ending)
    assert (plant.num_bodies(), plant.num_joints(), plant.num_frames(), plant.num_model_instances()) == before


def test_retired_calls_still_work_and_say_what_to_write_instead(plant, tmp_path):
    (tmp_path / "a.urdf").write_text(robot(link("a")))
    parser = Parser(plant)
    with pytest.warns(DrakeDeprecationWarning, match="AddModels"):
        first = parser.AddModelFromFile(str(tmp_path / "a.urdf"))
    with pytest.warns(DrakeDeprecationWarning, match="AddModels"):
        second = parser.AddModelFromFile(file_name=tmp_path / "a.urdf", model_name="second")
    with pytest.warns(DrakeDeprecationWarning, match="AddModelsFromString"):
        third = parser.AddModelFromString(robot(link("a")), "urdf", "third")
    (tmp_path / "b.urdf").write_text(robot(link("a"), "b"))
    with pytest.warns(DrakeDeprecationWarning, match="AddModels"):
        [fourth] = parser.AddAllModelsFromFile(tmp_path / "b.urdf")
    names = [plant.GetModelInstanceName(instance) for instance in (first, second, third, fourth)]
    assert names == ["r", "second", "third", "b"]


def test_collision_filter_groups_follow_a_renamed_instance(scene):
    plant, scene_graph = scene
    ball = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
    group = (
        '<drake:collision_filter_group name="g"><drake:member link="a"/><drake:member link="b"/>'
        '<drake:ignored_collision_filter_group name="g"/></drake:collision_filter_group>'
    )
    parser = Parser(plant)
    [instance] = parser.AddModelsFromString(robot(link("a", ball) + link("b", ball) + link("c", ball) + group), "urdf")
    plant.RenameModelInstance(instance, "q")
    groups = parser.GetCollisionFilterGroups()
    assert groups.groups() == {"q::g": {"q::a", "q::b"}}
    assert groups.exclusion_pairs() == {("q::g", "q::g")}
    assert not groups.empty()
    plant.Finalize()
    candidates = scene_graph.model_inspector().GetCollisionCandidates()
    assert len(candidates) == 2  # a-c and b-c, not a-b


def test_a_missing_package_is_found_beside_the_model(scene, tmp_path):
    plant, _ = scene
    (tmp_path / "my_robot" / "meshes").mkdir(parents=True)
    (tmp_path / "my_robot" / "urdf").mkdir()
    shutil.copy(MODELS / "tetra.obj", tmp_path / "my_robot" / "meshes" / "tetra.obj")
    mesh = '<visual><geometry><mesh filename="package://my_robot/meshes/tetra.obj"/></geometry></visual>'
    (tmp_path / "my_robot" / "urdf" / "r.urdf").write_text(robot(link("a", mesh)))
    [instance] = Parser(plant).AddModels(tmp_path / "my_robot" / "urdf" / "r.urdf")
    assert plant.GetModelInstanceName(instance) == "r"


@pytest.mark.parametrize("path", sorted(MODELS.glob("*.urdf")), ids=lambda path: path.name)
def test_own_models_give_no_warnings(path, caplog):
    plant = MultibodyPlant(1e-3)
    with caplog.at_level(logging.WARNING, logger="drake"):
        Parser(plant).AddModels(path)
    assert caplog.records == []


def test_a_collision_mesh_of_an_unknown_type_is_refused_where_it_stands(tmp_path):
    (tmp_path / "a.msh").write_text("")
    mesh = '<geometry><mesh filename="a.msh"/></geometry>'
    path = tmp_path / "robot.urdf"
    path.write_text(f'<robot name="r">\n<link name="a">\n<collision>{mesh}</collision></link></robot>')
    plant, scene_graph = AddMultibodyPlantSceneGraph(DiagramBuilder(), 1e-3)
    with pytest.raises(
        ParseError, match=r"robot\.urdf:3:1: error: The collision mesh .*a\.msh.* unknown file type; .*\.obj"
    ):
        Parser(plant).AddModels(str(path))
    assert plant.num_bodies() == 1 and scene_graph.model_inspector().num_geometries() == 0
