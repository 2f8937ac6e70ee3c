"""Samples, YAML and public names of `common` are pydrake's."""

import dataclasses as dc
import os

import numpy as np
import pytest

import sheldrake.common as common
from sheldrake.common import containers, cpp_param, cpp_template, deprecation, eigen_geometry, schema, value, yaml

pydrake = pytest.importorskip("pydrake")
pc = pytest.importorskip("pydrake.common")
ps = pytest.importorskip("pydrake.common.schema")
py = pytest.importorskip("pydrake.common.yaml")
pytestmark = pytest.mark.peer


@pytest.mark.parametrize(
    "name, arguments",
    [
        ("Gaussian", (1.0, 2.0)),
        ("Uniform", (-1.0, 2.0)),
        ("UniformDiscrete", ([1.0, 2.0, 5.0],)),
        ("GaussianVectorX", ([1.0, 2.0, 3.0], [1.0, 2.0, 3.0])),
        ("UniformVectorX", ([1.0, 2.0, 3.0], [2.0, 4.0, 8.0])),
        ("DeterministicVectorX", ([1.0, 2.0],)),
    ],
)
def test_samples_are_the_same_sequence(name, arguments):
    a, b = getattr(schema, name)(*arguments), getattr(ps, name)(*arguments)
    g, h = common.RandomGenerator(7), pc.RandomGenerator(7)
    for _ in range(50):
        np.testing.assert_allclose(a.Sample(g), b.Sample(h), rtol=1e-15)
    assert g() == h(), "as many draws"
    np.testing.assert_array_equal(a.Mean(), b.Mean())
    assert str(a.ToSymbolic()) == str(b.ToSymbolic())


@pytest.mark.parametrize(
    "name, arguments",
    [
        ("Gaussian", (1.0, 0.0)),
        ("Gaussian", (1.0, -1.0)),
        ("Uniform", (3.0, 1.0)),
        ("GaussianVectorX", ([1.0, 2.0], [1.0, 0.0])),
        ("UniformVectorX", ([1.0, 2.0], [1.0, 1.0])),
    ],
)
def test_what_is_no_distribution_has_no_expression(name, arguments):
    for library in (schema, ps):
        with pytest.raises(RuntimeError):
            getattr(library, name)(*arguments).ToSymbolic()
    assert str(schema.Uniform(2.0, 2.0).ToSymbolic()) == str(ps.Uniform(2.0, 2.0).ToSymbolic())


def test_random_pose():
    def make(s):
        return s.Transform(
            translation=s.UniformVector[3]([1, 2, 3], [4, 5, 6]),
            rotation=s.Rotation(value=s.Rotation.Rpy(deg=[10, 20, 30])),
        )

    g, h = common.RandomGenerator(7), pc.RandomGenerator(7)
    np.testing.assert_allclose(
        make(schema).Sample(g).GetAsMatrix4(), make(ps).Sample(h).GetAsMatrix4(), rtol=1e-14, atol=1e-14
    )
    np.testing.assert_allclose(make(schema).Mean().GetAsMatrix4(), make(ps).Mean().GetAsMatrix4(), atol=1e-15)


@dc.dataclass
class Inner:
    value: float = 1.0


@dc.dataclass
class Outer:
    count: int = 1
    name: str = "n"
    items: list[Inner] = dc.field(default_factory=lambda: [Inner(2.0)])
    table: dict[str, float] = dc.field(default_factory=lambda: {"b": 1.0, "a": 2.0})
    maybe: float | None = None
    either: int | str | Inner = 3
    array: np.ndarray = dc.field(default_factory=lambda: np.zeros((2, 2)))
    raw: bytes = b"hi"


def test_yaml_text_is_the_same():
    for obj in (Outer(), Outer(either="s", maybe=2.0, items=[], table={}), Outer(either=Inner(5.0))):
        assert yaml.yaml_dump_typed(obj) == py.yaml_dump_typed(obj)
        start = Outer(either=obj.either, name="other")  # pydrake cannot compare a struct with a number
        assert yaml.yaml_dump_typed(obj, defaults=start) == py.yaml_dump_typed(obj, defaults=start)
        text = py.yaml_dump_typed(obj, child_name="root")
        ours, theirs = (one.yaml_load_typed(schema=Outer, data=text, child_name="root") for one in (yaml, py))
        assert repr(ours) == repr(theirs)
    data = {"a": {"_tag": "!Tag", "x": [1, 2, {"y": None}]}, "b": "text"}
    assert yaml.yaml_dump(data) == py.yaml_dump(data)
    for text in ("count: a", "count: 1.5", "foo: 1", "either: [1]", "either: !No {}", "items: [3]", "maybe: x"):
        errors = []
        for one in (yaml, py):
            with pytest.raises(Exception) as caught:
                one.yaml_load_typed(schema=Outer, data=text)
            errors.append(caught.type if caught.type is not AssertionError else RuntimeError)
        assert errors[0] is errors[1], text


MODULES = {
    "common": {"np", "functools", "sys", "typing", "all", "pybind11_version"},
    "common.containers": {"np", "re"},
    "common.cpp_param": {"ctypes", "np", "types", "typing", "pretty_class_name"},
    "common.cpp_template": {"get_param_canonical", "get_param_names", "inspect", "types", "pretty_class_name"},
    "common.deprecation": {"ModuleType", "os", "re", "sys", "warnings"},
    "common.eigen_geometry": set(),
    "common.schema": set(),
    "common.value": {"List"},
    "common.yaml": {"Path", "collections", "copy", "dataclasses", "functools", "math", "np", "types", "typing", "yaml"}
    | {"pretty_class_name"},
}


@pytest.mark.parametrize("module", MODULES)
def test_every_public_name_is_there(module):
    import importlib

    theirs = importlib.import_module(f"pydrake.{module}")
    ours = importlib.import_module(f"sheldrake.{module}")
    names = {name for name in dir(theirs) if not name.startswith("_") and "𝓣" not in name}
    missing = {name for name in names if not hasattr(ours, name)}
    assert missing <= MODULES[module], "beyond modules that pydrake happens to import"
    assert (cpp_param, cpp_template, containers, deprecation, eigen_geometry, value) is not None


CLASSES = [
    ("math", "RotationMatrix"),
    ("math", "RigidTransform"),
    ("math", "RollPitchYaw"),
    ("math", "BsplineBasis"),
    ("math", "BarycentricMesh"),
    ("math", "NumericalGradientOption"),
    ("common", "MemoryFile"),
    ("common", "Parallelism"),
    ("common", "RandomGenerator"),
    ("common", "Sha256"),
    ("common.eigen_geometry", "Quaternion"),
    ("common.eigen_geometry", "AngleAxis"),
    ("common.eigen_geometry", "Isometry3"),
    ("common.value", "AbstractValue"),
    ("common.schema", "Rotation"),
    ("common.schema", "Transform"),
    ("common.schema", "Gaussian"),
    ("multibody.math", "SpatialVelocity"),
    ("multibody.math", "SpatialAcceleration"),
    ("multibody.math", "SpatialForce"),
    ("multibody.math", "SpatialMomentum"),
    ("multibody.tree", "UnitInertia"),
    ("multibody.tree", "RotationalInertia"),
    ("multibody.tree", "SpatialInertia"),
]


@pytest.mark.parametrize("module, name", CLASSES)
def test_every_method_is_there(module, name):
    import importlib

    theirs = getattr(importlib.import_module(f"pydrake.{module}"), name)
    home = "multibody.math" if module == "multibody.tree" else module
    ours = getattr(importlib.import_module(f"sheldrake.{home}"), name)
    names = {one for one in dir(theirs) if (one[:1] != "_" or one[:2] == "__") and "𝓣" not in one}
    missing = {one for one in names if not hasattr(ours, one)} - {"__getstate__"}
    if name in ("Rotation", "Transform"):
        missing -= {"__getattr__", "value", "base_frame", "rotation", "translation"}  # set on each object
    if name == "Gaussian":
        missing -= {"mean", "stddev"}
    if name in ("MemoryFile", "Parallelism", "Sha256", "RandomGenerator", "BarycentricMesh"):
        missing -= {"__copy__", "__deepcopy__"}  # the copy module's own are right for plain objects
    assert not {one for one in missing if one not in ("__setstate__",)}, name


def test_the_comparison_notices_a_planted_fault():
    """One draw more, or a block where Drake writes a flow, must not pass."""
    g, h = common.RandomGenerator(7), pc.RandomGenerator(7)
    g()
    assert schema.Uniform(0.0, 1.0).Sample(g) != ps.Uniform(0.0, 1.0).Sample(h)
    assert yaml.yaml_dump({"a": {"x": 1}}) != yaml.yaml_dump_typed({"a": Inner()}, schema=dict[str, Inner])


def test_resources_of_the_wheel_are_found(monkeypatch):
    monkeypatch.delenv("DRAKE_RESOURCE_ROOT", raising=False)
    name = "drake/examples/multibody/cart_pole/cart_pole.sdf"
    assert os.path.samefile(common.FindResourceOrThrow(name), pc.FindResourceOrThrow(name))
    assert os.path.samefile(common.GetDrakePath(), pc.GetDrakePath())
