"""Model directives: the YAML reader and its data classes. What they do to a plant is checked against Drake."""

import copy

import numpy as np
import pytest

from sheldrake.multibody.parsing import (
    AddModel,
    AddModelInstance,
    FlattenModelDirectives,
    GetScopedFrameByName,
    GetScopedFrameByNameMaybe,
    LoadModelDirectives,
    LoadModelDirectivesFromString,
    ModelDirective,
    ModelDirectives,
    PackageMap,
    ParseError,
    Parser,
    ProcessModelDirectives,
)
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from sheldrake.systems.framework import DiagramBuilder


def load(*lines):
    return LoadModelDirectivesFromString("directives:\n" + "\n".join(lines))


def test_directives_keep_their_order_and_types():
    result = load(
        "- add_model: {name: arm, file: 'package://p/arm.urdf', default_joint_positions: {j: [0.5, 1e-3]}}",
        "- add_model_instance:",
        "    name: cell",
        "- add_collision_filter_group: {name: g, members: [a, b], ignored_collision_filter_groups: [g]}",
        "- add_directives: {file: more.dmd.yaml, model_namespace: cell}",
    )
    model, instance, group, more = result.directives
    assert (model.add_model.name, model.add_model.file) == ("arm", "package://p/arm.urdf")
    np.testing.assert_array_equal(model.add_model.default_joint_positions["j"], [0.5, 0.001])
    assert instance.add_model_instance.name == "cell" and instance.add_model is None
    assert group.add_collision_filter_group.members == ["a", "b"]
    assert group.add_collision_filter_group.model_namespace is None
    assert more.add_directives.model_namespace == "cell"


def test_anchors_and_merge_keys():
    text = "directives:\n- add_model: &base {name: a, file: f.urdf}\n- add_model: {<<: *base, name: b}\n"
    second = LoadModelDirectivesFromString(text).directives[1].add_model
    assert (second.name, second.file) == ("b", "f.urdf")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "document is empty"),
        ("foo: 3", ":1:6: error: .*unknown key 'foo'; the known keys are directives"),
        ("directives: 3", ":1:13: error: directives: expected a list"),
        ("directives:\n- add_modl: {}", ":2:13: error: .*unknown key 'add_modl'; .*add_model"),
        ("directives:\n- add_model: {file: a, name: b, x: 1}", ":2:36: error: .*'x'"),
        ("directives:\n- add_model: {file: a}", "`name` must not be empty"),
        ("directives:\n- {}", "exactly one of add_model"),
        ("directives:\n- {add_model_instance: {name: a}, add_directives: {file: b}}", "exactly one of"),
        ("directives:\n- add_model: {file: a, name: b, default_joint_positions: {j: [x]}}", "finite number, found 'x'"),
        ("directives:\n- add_model: {file: a, name: b, default_joint_positions: {j: [.nan]}}", "finite number"),
        ("directives:\n- add_model: {file: a, file: b, name: c}", "'file' is given twice"),
        ("directives: [", "not valid YAML"),
        ("directives:\n- add_collision_filter_group: {name: g}", "has no members"),
        ("directives:\n- !!python/object:os.system {}", "unknown key|exactly one|YAML"),
    ],
)
def test_bad_documents_are_refused_with_their_place(text, message):
    with pytest.raises(RuntimeError, match=message):
        LoadModelDirectivesFromString(text)


def test_nested_aliases_do_not_explode():
    lines = ["a0: &a0 [x, x]"] + [f"a{i}: &a{i} [*a{i - 1}, *a{i - 1}]" for i in range(1, 60)]
    with pytest.raises(RuntimeError, match="unknown key 'a0'"):
        LoadModelDirectivesFromString("\n".join(lines) + "\ndirectives: *a59\n")


def test_what_goes_wrong_on_the_plant_is_reported_with_its_line(tmp_path):
    (tmp_path / "r.urdf").write_text('<robot name="r"><link name="a"/></robot>')
    for line, message in (
        ("- add_weld: {parent: world, child: m::nope}", "no frame 'nope' in model instance 'm'; its frames are a"),
        ("- add_weld: {parent: world, child: nope::a}", "no model instance 'nope'"),
        ("- add_model: {name: m, file: 'package://p/r.urdf'}", "already has a model instance named 'm'"),
        ("- add_model: {name: n, file: 'package://p/nope.urdf'}", "does not exist"),
        ("- add_frame: {name: x::f, X_PF: {base_frame: world}}", "no model instance 'x'"),
        ("- add_model: {name: n, file: 'package://p/r.urdf', default_joint_positions: {j: [1]}}", "'j'"),
        ("- add_directives: {file: 'package://p/r.urdf', model_namespace: q}", "."),
        ("- add_collision_filter_group: {name: g, members: [m::b]}", "no body 'm::b'"),
        ("- add_model_instance: {name: m}", "already has a model instance named 'm'"),
    ):
        builder = DiagramBuilder()
        plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
        parser = Parser(plant)
        parser.package_map().Add("p", tmp_path)
        text = "directives:\n- add_model: {name: m, file: 'package://p/r.urdf'}\n" + line
        with pytest.raises(ParseError, match=message) as caught:
            parser.AddModelsFromString(text, "dmd.yaml")
        assert caught.value.location.source.endswith((".dmd.yaml", "r.urdf"))
        assert caught.value.location.line in (1, 3)


def test_models_frames_welds_and_infos(tmp_path):
    (tmp_path / "r.urdf").write_text('<robot name="r"><link name="a"/></robot>')
    directives = load(
        "- add_model: {name: one, file: 'package://p/r.urdf'}",
        "- add_frame: {name: one::f, X_PF: {base_frame: world, translation: [0, 0, 1]}}",
        "- add_weld: {parent: one::f, child: one::a, X_PC: {rotation: !Rpy {deg: [0, 0, 90]}}}",
        "- add_model:",
        "    name: two",
        "    file: package://p/r.urdf",
        "    default_free_body_pose: {a: {translation: [5, 0, 0]}}",
    )
    plant = MultibodyPlant(1e-3)
    parser = Parser(plant)
    parser.package_map().Add("p", tmp_path)
    one, two = ProcessModelDirectives(directives, parser)
    assert (one.model_name, one.parent_frame_name, one.child_frame_name) == ("one", "f", "a")
    assert (two.model_name, two.parent_frame_name) == ("two", "")
    assert two.model_path == str(tmp_path / "r.urdf")
    assert GetScopedFrameByName(plant, "one::f").name() == "f"
    assert GetScopedFrameByNameMaybe(plant, "one::g") is None
    plant.Finalize()
    context = plant.CreateDefaultContext()
    poses = [plant.EvalBodyPoseInWorld(context, plant.GetBodyByName("a", info.model_instance)) for info in (one, two)]
    np.testing.assert_allclose(poses[0].translation(), [0, 0, 1])
    np.testing.assert_allclose(poses[0].rotation().matrix(), [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)
    np.testing.assert_allclose(poses[1].translation(), [5, 0, 0])


def test_process_takes_a_plant_or_a_parser():
    plant, other = MultibodyPlant(0.0), MultibodyPlant(0.0)
    directives = load("- add_model_instance: {name: i}")
    assert ProcessModelDirectives(directives=directives, plant=plant) == []
    assert plant.HasModelInstanceNamed("i")
    with pytest.raises(RuntimeError, match="another plant"):
        ProcessModelDirectives(directives, plant, Parser(other))
    with pytest.raises(TypeError, match="ProcessModelDirectives"):
        ProcessModelDirectives(directives)


def test_missing_file():
    with pytest.raises(RuntimeError, match="/nope: error: The file cannot be read"):
        LoadModelDirectives("/nope")


def test_structs_are_filled_by_keyword_printed_and_copied():
    model = AddModel(name="a", file="b")
    assert repr(model) == "AddModel(file='b', name='a', default_joint_positions={}, default_free_body_pose={})"
    assert [field.name for field in AddModel.__fields__][:2] == ["file", "name"]
    deep = copy.deepcopy(model)
    deep.default_joint_positions["j"] = np.ones(1)
    assert model.default_joint_positions == {}
    with pytest.raises(AttributeError, match="has no attribute 'nme'; it has file, name"):
        AddModel(nme="a")
    with pytest.raises(TypeError, match=r"AddModelInstance\.name: .*expected str"):
        AddModelInstance(name=3)
    assert ModelDirective().add_model is None
    assert ModelDirectives().directives == []


def test_what_is_set_is_copied_and_numbers_become_arrays():
    instance = AddModelInstance(name="a")
    directive = ModelDirective(add_model_instance=instance)
    instance.name = "b"
    assert directive.add_model_instance.name == "a"
    model = AddModel(default_joint_positions={"j": [1, 2]})
    assert model.default_joint_positions["j"].dtype == float
    for bad in ({"j": "x"}, {3: [1.0]}, [1.0]):
        with pytest.raises(TypeError, match="default_joint_positions"):
            model.default_joint_positions = bad


def test_flattening_prefixes_names(tmp_path):
    (tmp_path / "part.dmd.yaml").write_text(
        "directives:\n- add_model: {name: m, file: f.urdf}\n"
        "- add_collision_filter_group: {name: g, members: [a]}\n- add_model_instance: {name: i}\n"
    )
    packages = PackageMap.MakeEmpty()
    packages.Add("p", tmp_path)
    flat = FlattenModelDirectives(
        load("- add_directives: {file: 'package://p/part.dmd.yaml', model_namespace: left}"), packages
    )
    model, group, instance = flat.directives
    assert model.add_model.name == "left::m"
    assert group.add_collision_filter_group.model_namespace == "left"
    assert instance.add_model_instance.name == "left::i"


def test_the_one_model_of_a_world(tmp_path):
    """It is added under the name given, where the world has it, as in Drake; what is beside it is not."""
    model = '<model name="m"><pose relative_to="f">1 2 3 0 0 0</pose><link name="a"/></model>'
    beside = '<frame name="f"><pose>0 0 1 0 0 0</pose></frame>'
    for text, count in ((beside + model, 1), (beside + model + model.replace('"m"', '"n"'), 2)):
        (tmp_path / "w.sdf").write_text(f'<sdf version="1.7"><world name="w">{text}</world></sdf>')
        directives = load(f'- add_model: {{name: q, file: "file://{tmp_path}/w.sdf"}}')
        plant = MultibodyPlant(0.0)
        if count > 1:
            with pytest.raises(ParseError, match="exactly one model"):
                ProcessModelDirectives(directives, Parser(plant))
            continue
        ProcessModelDirectives(directives, Parser(plant))
        plant.Finalize()
        body = plant.GetBodyByName("a", plant.GetModelInstanceByName("q"))
        pose = plant.EvalBodyPoseInWorld(plant.CreateDefaultContext(), body)
        np.testing.assert_allclose(pose.translation(), [1.0, 2.0, 4.0])
        assert not plant.HasFrameNamed("f")


def test_a_prefix_of_the_parser_needs_no_model_instance_of_its_name(plant):
    text = "directives:\n- add_model_instance: {name: more}\n- add_frame: {name: f, X_PF: {base_frame: world}}\n"
    Parser(plant, "cell").AddModelsFromString(text, "dmd.yaml")
    assert plant.HasModelInstanceNamed("cell::more") and plant.HasFrameNamed("f")
    assert not plant.HasModelInstanceNamed("cell")
