"""Model directives: the YAML reader and its data classes. What they do to a plant is checked against Drake."""

import copy

import numpy as np
import pytest

from sheldrake.multibody.parsing import (
    AddModel,
    AddModelInstance,
    FlattenModelDirectives,
    LoadModelDirectives,
    LoadModelDirectivesFromString,
    ModelDirective,
    ModelDirectives,
    PackageMap,
)


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
    with pytest.raises(AttributeError, match="has no field 'nme'; its fields are file, name"):
        AddModel(nme="a")
    with pytest.raises(TypeError, match="name must be"):
        AddModelInstance(name=3)
    assert ModelDirective().add_model is None
    assert ModelDirectives().directives == []


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
