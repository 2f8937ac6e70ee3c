"""Small files that stand for absurd ones: refused with a message that says why, in little time and memory."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from tools.torture.documents import LIMIT, make_parser

from sheldrake.multibody.parsing import FlattenModelDirectives, LoadModelDirectives, PackageMap, ParseError
from sheldrake.multibody.parsing._reading.reading import INCLUDE_COUNT, INCLUDE_DEPTH

DEPTH = 100_000
MANY = 28  # levels of files that name the next one twice: 268 million files
XML = {
    "urdf": ('<robot name="r">{}<link name="a"/></robot>', "<a>", "</a>"),
    "sdf": ("<sdf version='1.9'>{}<model name='m'><link name='a'/></model></sdf>", "<model name='m'>", "</model>"),
    "xml": ('<mujoco model="m"><worldbody>{}</worldbody></mujoco>', "<body>", "</body>"),
}
YAML = {
    "lists": "directives: " + "[" * DEPTH,
    "mappings": "directives: " + "{a: " * DEPTH,
    "blocks": "\n".join(" " * i + "a:" for i in range(3000)),
}


def refused(match: str, add, *arguments) -> None:
    start = time.process_time()
    with pytest.raises(ParseError, match=match):
        add(*arguments)
    assert time.process_time() - start < LIMIT


def add_text(text: str, kind: str) -> None:
    make_parser().AddModelsFromString(text, kind)


@pytest.mark.parametrize("kind", XML)
def test_nesting_a_hundred_thousand_deep(kind):
    text, start, end = XML[kind]
    refused("nested deeper than 500 levels", add_text, text.format(start * DEPTH + end * DEPTH), kind)
    refused("nested deeper than 500 levels", add_text, text.format(start * DEPTH), kind)


@pytest.mark.parametrize("text", YAML.values(), ids=YAML)
def test_nested_yaml(text):
    refused("not valid YAML|recursion", add_text, text, "dmd.yaml")


@pytest.mark.parametrize("kind", XML)
@pytest.mark.parametrize(
    ("document_type", "match"),
    [
        ('<!DOCTYPE a [<!ENTITY e "x">]>', "declares the entity 'e'"),
        ('<!DOCTYPE a [<!ENTITY e SYSTEM "file:///etc/passwd">]>', "declares the entity 'e'"),
        ('<!DOCTYPE a [<!ENTITY % e SYSTEM "file:///etc/passwd"> %e;]>', "declares the entity 'e'"),
        ('<!DOCTYPE a SYSTEM "http://localhost/a.dtd">', "external definition"),
        (
            "<!DOCTYPE a [" + "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 9}">' for i in range(1, 60)) + "]>",
            "declares the entity 'e1'",
        ),
    ],
    ids=["entity", "file", "parameter", "definition", "laughter"],
)
def test_entities(kind, document_type, match):
    refused(match, add_text, document_type + XML[kind][0].format("&e;"), kind)


def test_merged_mappings_of_yaml_are_put_together_once():
    bombs = ", ".join(f"&a{i} {{<<: [*a{i - 1}, *a{i - 1}]}}" for i in range(1, 100))
    text = f"directives:\n- add_model:\n    <<: [&a0 {{file: nowhere.urdf}}, {bombs}]\n    name: b\n"
    refused("nowhere.urdf", add_text, text, "dmd.yaml")
    refused("merged into itself", add_text, "directives:\n- add_model: &a {<<: *a}\n", "dmd.yaml")


def test_aliases_of_yaml_count_as_often_as_they_are_used():
    values, uses = "[" + "1," * 20_000 + "1]", "".join(f", b{i}: *v" for i in range(2000))
    text = f"directives: [{{add_model: {{file: x, name: y, default_joint_positions: {{a: &v {values}{uses}}}}}}}]"
    start = time.process_time()
    with pytest.raises(ParseError, match="more than 1000000 values"):
        make_parser().AddModelsFromString(text, "dmd.yaml")
    assert time.process_time() - start < 10 * LIMIT  # a file of 60 kB; 40 million numbers would take minutes


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        (
            "urdf",
            '<robot name="r"><link name="a"><visual><geometry><mesh filename="{}"/></geometry></visual></link></robot>',
        ),
        (
            "sdf",
            "<sdf version='1.9'><model name='m'><link name='a'><visual name='v'><geometry><mesh><uri>{}</uri></mesh>"
            "</geometry></visual></link></model></sdf>",
        ),
        ("sdf", "<sdf version='1.9'><model name='m'><include><uri>{}</uri></include></model></sdf>"),
        ("xml", '<mujoco model="m"><asset><mesh file="{}"/></asset></mujoco>'),
        ("dmd.yaml", "directives: [{{add_model: {{file: '{}', name: a}}}}]"),
        ("dmd.yaml", "directives: [{{add_directives: {{file: '{}'}}}}]"),
    ],
    ids=["URDF mesh", "SDFormat mesh", "SDFormat include", "MJCF mesh", "YAML model", "YAML directives"],
)
def test_addresses_do_not_lead_out_of_their_package(kind, text, tmp_path):
    package = tmp_path / "package"
    package.mkdir()
    for name in ("secret.obj", "secret.sdf", "secret.dmd.yaml"):
        (tmp_path / name).write_text("")
    for address in (
        "package://p/../secret.obj",
        "package://p/./x/../../secret.sdf",
        "model://p/%2e%2e/secret.dmd.yaml",
    ):
        parser = make_parser()
        parser.package_map().Add("p", str(package))
        message = "leaves its package|does not exist"
        refused(message, parser.AddModelsFromString, text.format(address), kind)


def write_includes(folder, kind: str, count: int, times: int, first: str) -> str:
    """Files that include the next one, the last one the first; the path of the first."""
    body = {
        "sdf": "<sdf version='1.9'><model name='m{i}'>{all}<link name='a'/></model></sdf>",
        "xml": "<mujoco model='m{i}'><worldbody>{all}</worldbody></mujoco>",
        "dmd.yaml": "directives: [{all}]",
    }[kind]
    include = {
        "sdf": "<include><uri>f{j}.sdf</uri><name>n{k}</name></include>",
        "xml": "<include file='f{j}.xml'/>",
        "dmd.yaml": "{{add_directives: {{file: 'package://p/f{j}.dmd.yaml'}}}},",
    }[kind]
    for i in range(count):
        target = first if i == count - 1 else i + 1
        included = "".join(include.format(j=target, k=k) for k in range(times)) if target != "" else ""
        (folder / f"f{i}.{kind}").write_text(body.format(i=i, all=included))
    return str(folder / f"f0.{kind}")


@pytest.mark.parametrize("kind", ["sdf", "xml", "dmd.yaml"])
def test_files_that_include_each_other(kind, tmp_path):
    def parser():
        result = make_parser()
        result.package_map().Add("p", str(tmp_path))
        return result

    circle = write_includes(tmp_path, kind, 3, 1, 0)
    refused(f"includes itself|deeper than {INCLUDE_DEPTH}", parser().AddModels, circle)
    deep = write_includes(tmp_path, kind, INCLUDE_DEPTH + 5, 1, "")
    refused(f"deeper than {INCLUDE_DEPTH}", parser().AddModels, deep)
    wide = write_includes(tmp_path, kind, MANY, 2, "")
    refused(f"More than {INCLUDE_COUNT} .*files are included", parser().AddModels, wide)


def test_flattened_directives_that_include_each_other(tmp_path):
    packages = PackageMap()
    packages.Add("p", str(tmp_path))
    for count, times, first, match in ((2, 1, 0, "deeper"), (MANY, 2, "", "More than")):
        directives = LoadModelDirectives(write_includes(tmp_path, "dmd.yaml", count, times, first))
        refused(match, FlattenModelDirectives, directives, packages)


def test_what_is_no_regular_file_is_called_so(tmp_path):
    endless = tmp_path / "endless.urdf"
    try:
        endless.symlink_to("/dev/zero" if Path("/dev/zero").exists() else tmp_path)
    except OSError:
        pytest.skip("this user may make no links here")
    refused("is no regular file|is a folder", make_parser().AddModels, str(endless))
