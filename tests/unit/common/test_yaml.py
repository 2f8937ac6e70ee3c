import dataclasses as dc
import math
import typing
from pathlib import Path

import numpy as np
import pytest
import yaml

from sheldrake.common import MemoryFile
from sheldrake.common.yaml import yaml_dump, yaml_dump_typed, yaml_load, yaml_load_data, yaml_load_file, yaml_load_typed


@dc.dataclass
class Inner:
    value: float = math.nan


@dc.dataclass
class First:
    x: float = 1.0


@dc.dataclass
class Second:
    y: str = "a"


@dc.dataclass
class Outer:
    count: int = 1
    flag: bool = False
    name: str = "n"
    raw: bytes = b""
    path: Path = Path("p")
    inner: Inner = dc.field(default_factory=lambda: Inner(2.0))
    maybe: float | None = 3.0
    array: np.ndarray = dc.field(default_factory=lambda: np.zeros(2))
    items: list[Inner] = dc.field(default_factory=list)
    table: dict[str, Inner] = dc.field(default_factory=lambda: {"kept": Inner(9.0)})
    choice: First | Second = dc.field(default_factory=First)
    number: typing.Union[float, str, First] = 1.0  # noqa: UP007


def load(data, schema=Outer, **options):
    return yaml_load_typed(schema=schema, data=data, **options)


def test_plain_documents(tmp_path):
    text = "a: !Tag {x: 1, y: [1, 2]}\n_private: 3\n"
    assert yaml_load_data(text) == {"a": {"_tag": "!Tag", "x": 1, "y": [1, 2]}}
    assert yaml_load(data=text, private=True)["_private"] == 3
    assert yaml_load_data("[1, 2]") == [1, 2]
    (tmp_path / "a.yaml").write_text(text)
    assert yaml_load_file(tmp_path / "a.yaml") == yaml_load(filename=tmp_path / "a.yaml") == yaml_load_data(text)
    assert yaml_load_data(yaml_dump(yaml_load_data(text))) == yaml_load_data(text)
    yaml_dump({"a": 1}, filename=tmp_path / "b.yaml")
    assert yaml_load_file(tmp_path / "b.yaml") == {"a": 1}
    for wrong in ({}, {"data": "a", "filename": "b"}):
        with pytest.raises(RuntimeError, match="Exactly one of"):
            yaml_load(**wrong)


def test_every_kind_of_field():
    got = load(
        """
        count: 2.0
        flag: true
        name: x
        raw: !!binary aGk=
        path: a/b
        inner: {value: 5}
        maybe: null
        array: [1, 2, 3]
        items: [{value: 1}, {value: '2'}]
        table: {new: {value: 7}}
        choice: !Second {y: z}
        number: text
        """
    )
    assert (got.count, got.flag, got.name, got.raw, got.path) == (2, True, "x", b"hi", Path("a/b"))
    assert got.inner == Inner(5.0) and got.maybe is None and got.array.tolist() == [1.0, 2.0, 3.0]
    assert got.items == [Inner(1.0), Inner(2.0)]
    assert got.table == {"kept": Inner(9.0), "new": Inner(7.0)}
    assert got.choice == Second("z") and got.number == "text"
    assert load("table: {new: {value: 7}}", retain_map_defaults=False).table == {"new": Inner(7.0)}


def test_unions():
    assert load("choice: {x: 4}").choice == First(4.0)
    assert load("number: !First {x: 4}").number == First(4.0)
    assert load("number: 3").number == 3.0
    assert load("choice: !First {}", defaults=Outer(choice=First(8.0))).choice == First(8.0)
    assert load("choice: !First {}", defaults=Outer(choice=Second())).choice == First(1.0)


def test_defaults():
    start = Outer(count=5, inner=Inner(6.0))
    got = yaml_load_typed(defaults=start, data="inner: {}")
    assert (got.count, got.inner) == (5, Inner(6.0)) and got.inner is not start.inner
    assert load("root: {count: 3}", child_name="root").count == 3
    assert load("maybe: 4", defaults=Outer(maybe=None)).maybe == 4.0


@pytest.mark.parametrize(
    "data, message",
    [
        ("foo: 1", r"The fields \['foo'\] were unknown to the schema"),
        ("count: [1]", "Expected a <class 'int'> value for 'count' but instead got non-scalar"),
        ("count: 1.5", "Expected a <class 'int'> value for 'count'"),
        ("name: 3", "Expected a <class 'str'> value for 'name'"),
        ("flag: 'yes'", "Expected a <class 'bool'> value for 'flag'"),
        ("path: 3", "Expected a !!str value for 'path: Path'"),
        ("choice: !Third {}", "'Third' did not match any of the allowed type options for 'choice'"),
        ("number: true", "The schema sum type for 'number' cannot accept"),
        ("inner: 3", "Expected a mapping"),
        ("[1]", "YAML root was a <class 'list'>"),
    ],
)
def test_documents_that_do_not_fit(data, message):
    with pytest.raises(RuntimeError, match=message):
        load(data)


def test_strictness():
    with pytest.raises(RuntimeError, match=r"The fields \['value'\] were missing"):
        load("{}", Inner, allow_schema_with_no_yaml=False)
    assert load("{value: 1, more: 2}", Inner, allow_yaml_with_no_schema=True) == Inner(1.0)

    @dc.dataclass
    class Maybe:
        x: float | None = 1.0

    assert load("{}", Maybe, allow_schema_with_no_yaml=False).x is None
    assert load("{}", Maybe).x == 1.0
    with pytest.raises(ValueError):
        yaml_load_typed(data="{}")
    with pytest.raises(NotImplementedError):
        load("{}", int)


def test_dump():
    text = yaml_dump_typed(Outer(choice=Second("z"), number="s", maybe=None, items=[Inner(1.0)]))
    assert text.startswith("count: 1\nflag: false\nname: n\nraw: !!binary")
    assert "choice: !Second\n  y: z\n" in text and "number: !!str 's'\n" in text and "maybe" not in text
    assert "items:\n- value: 1.0\n" in text and "array: [0.0, 0.0]\n" in text
    assert yaml_dump_typed(Inner(1.0), child_name="root") == "root:\n  value: 1.0\n"
    assert yaml_dump_typed(Outer(count=2, inner=Inner(7.0)), defaults=Outer()) == "count: 2\ninner:\n  value: 7.0\n"
    for wrong in (lambda: yaml_dump_typed(Outer(choice=3)), lambda: yaml_dump_typed([1.0], schema=list[float])):
        with pytest.raises(RuntimeError):
            wrong()
    with pytest.raises(Exception, match="yaml_dump_typed"):
        yaml_dump({"a": MemoryFile()})


def test_round_trip(tmp_path):
    start = Outer(
        count=7,
        raw=b"\x00\xff",
        path=Path("/x"),
        array=np.array([[1.0, 2.0]]),
        table={"b": Inner(1.0)},
        number=First(3.0),
    )
    yaml_dump_typed(start, filename=tmp_path / "a.yaml")
    back = yaml_load_typed(schema=Outer, filename=tmp_path / "a.yaml", retain_map_defaults=False)
    assert back.array.tolist() == start.array.tolist()
    back.array = start.array
    assert back == start


def test_classes_with_fields():
    file = yaml_load_typed(schema=MemoryFile, data="{contents: !!binary aGk=, extension: .txt, filename_hint: a}")
    assert repr(file) == "MemoryFile(contents=b'hi', extension='.txt', filename_hint='a')"
    assert yaml_load_data(yaml_dump_typed(file)) == {"contents": b"hi", "extension": ".txt", "filename_hint": "a"}


def test_small_documents_do_not_stand_for_large_ones():
    mappings = ", ".join(f"&a{i} {{<<: [*a{i - 1}, *a{i - 1}]}}" for i in range(1, 40))  # the last has 2**39 items
    with pytest.raises(yaml.YAMLError, match="more than 1000000 items are merged"):
        yaml_load(data=f"[&a0 {{b: 1}}, {mappings}]")
    with pytest.raises(yaml.YAMLError, match="nested too deeply"):
        yaml_load(data="[" * 5000)
    assert yaml_load(data="[&a {b: 1}, {<<: *a, c: 2}]") == [{"b": 1}, {"b": 1, "c": 2}]


def test_numbers_of_base_60_have_a_length():
    assert yaml_load(data="[1:30, 190:20:30.15, -1:00:00]") == [90, 685230.15, -3600]
    for end in ("", ".5"):
        with pytest.raises(yaml.YAMLError, match="more than 1000 parts between colons"):
            yaml_load(data=":".join(["5"] * 1002) + end)
    assert isinstance(yaml_load(data=f'"{":".join(["5"] * 5000)}"'), str)
