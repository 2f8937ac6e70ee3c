"""Settings: given by name, typed, copied by value, equal to nothing but themselves, read and written as YAML."""

import copy
import pickle
from typing import Any, Optional, Union

import numpy as np
import pytest

from sheldrake.common._options import Options, Vector, Vector3, Vector4, Vector6
from sheldrake.common.yaml import yaml_dump_typed, yaml_load_typed
from sheldrake.geometry import DefaultProximityProperties, SceneGraphConfig
from sheldrake.manipulation import IiwaDriver, ZeroForceDriver


class Inner(Options):
    gain: float = 2.0
    names: list[str] = ["a"]


class Outer(Options):
    count: int = 3
    gain: float = 0.5
    on: bool = True
    name: str = "x"
    limits: np.ndarray = np.zeros(2)
    maybe: Optional[float] = None  # noqa: UP045
    either: Union[str, float] = "auto"  # noqa: UP007
    inner: Inner = Inner()
    free: Any = None


def test_defaults_belong_to_each():
    a, b = Outer(), Outer()
    a.inner.gain = 7.0
    a.inner.names.append("b")
    a.limits = [1.0, 0.0]
    assert b.inner.gain == 2.0 and b.inner.names == ["a"] and b.limits[0] == 0.0
    assert repr(Inner()) == "Inner(gain=2.0, names=['a'])"


@pytest.mark.parametrize(
    ("name", "given", "kept"),
    [
        ("count", np.int32(4), 4),
        ("gain", 4, 4.0),
        ("gain", np.float32(0.5), 0.5),
        ("on", 0, False),
        ("maybe", None, None),
        ("maybe", 3, 3.0),
        ("either", "b", "b"),
        ("either", 3, 3.0),
        ("free", {"anything": 1}, {"anything": 1}),
    ],
)
def test_values_become_the_setting_s_type(name, given, kept):
    options = Outer(**{name: given})
    assert getattr(options, name) == kept
    assert type(getattr(options, name)) is type(kept)


@pytest.mark.parametrize(
    ("name", "given"),
    [("count", 2.5), ("count", "3"), ("gain", "1"), ("gain", None), ("on", "yes"), ("on", [1]), ("name", None),
     ("name", 3), ("limits", "ab"), ("limits", 1.0), ("maybe", "1"), ("either", None), ("inner", {})],
)  # fmt: skip
def test_other_values_are_refused_and_change_nothing(name, given):
    options = Outer()
    before = repr(options)
    with pytest.raises(TypeError, match=rf"Outer\.{name}: incompatible function arguments"):
        setattr(options, name, given)
    assert repr(options) == before


def test_names_that_there_are_not():
    with pytest.raises(AttributeError, match="'Inner' object has no attribute 'gian'; it has gain, names"):
        Inner(gian=1.0)
    with pytest.raises(AttributeError, match="no settings"):
        ZeroForceDriver().gain = 1.0
    with pytest.raises(TypeError, match="given by name"):
        Inner(1.0)


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))])
def test_copies_share_nothing(copied):
    a = Outer(count=5, limits=[1, 2], inner=Inner(gain=9.0))
    b = copied(a)
    assert repr(b) == repr(a) and type(b) is Outer and b != a
    b.inner.gain, b.limits = 1.0, [5.0, 2.0]
    assert a.inner.gain == 9.0 and a.limits[0] == 1.0


def test_what_is_set_is_copied():
    inner, limits = Inner(), np.array([1.0, 2.0])
    options = Outer(inner=inner, limits=limits)
    inner.gain, limits[0] = 5.0, 5.0
    assert options.inner.gain == 2.0 and options.limits[0] == 1.0
    options.inner.gain = 3.0
    assert options.inner.gain == 3.0


def test_arrays_are_changed_as_a_whole():
    """As in pydrake: elements of an array that a struct hands out cannot be set."""
    for options in (Outer(), Outer(limits=[1.0, 2.0]), copy.deepcopy(Outer())):
        with pytest.raises(ValueError, match="read-only"):
            options.limits[0] = 3.0


class Sized(Options):
    p: Vector3 = np.zeros(3)
    gains: dict[str, Vector6] = {}
    any_size: Vector = np.zeros(0)
    maybe: Vector4 | None = None


@pytest.mark.parametrize(
    ("name", "given", "wrong", "expected"),
    [
        ("p", [[1], [2], [3]], [1, 2], "vector of 3 numbers"),
        ("gains", {"a": range(6)}, {"a": [1]}, r"dict\[str, vector of 6 numbers\]"),
        ("any_size", (1, 2), [[1, 2]], "expected vector,"),
        ("maybe", np.arange(4), [1, 2, 3], r"vector of 4 numbers \| NoneType"),
    ],
)
def test_vectors_have_their_size(name, given, wrong, expected):
    options = Sized(**{name: given})
    kept = getattr(options, name)
    kept = kept["a"] if name == "gains" else kept
    assert kept.dtype == float and kept.ndim == 1
    with pytest.raises(TypeError, match=expected):
        setattr(options, name, wrong)
    assert {field.name: field.type for field in Sized.__fields__}["p"] is np.ndarray


def test_objects_that_others_share_are_shared():
    thing = object()
    options = Outer(free=[thing])
    assert options.free[0] is thing and copy.deepcopy(options).free[0] is thing


def test_each_is_equal_to_itself_alone():
    a = Outer()
    assert a == a and a != Outer() and len({a, Outer()}) == 2


@pytest.mark.parametrize(
    "options",
    [
        Inner(gain=4.0, names=["x", "y"]),
        IiwaDriver(desired_kp_gains=[1.0] * 7, control_mode="position_only", arm_child_frame_name="base"),
        SceneGraphConfig(default_proximity_properties=DefaultProximityProperties(margin=0.25, point_stiffness=1e5)),
    ],
)
def test_yaml_there_and_back(options):
    text = yaml_dump_typed(options)
    assert repr(yaml_load_typed(schema=type(options), data=text)) == repr(options)


def test_settings_are_what_is_annotated_public_and_has_a_value():
    class More(Inner):
        gain: float = 3.0
        sizes: "dict[str, np.ndarray]" = {}
        _hidden: int = 1
        declared: int
        Inner = Inner

    assert [(f.name, f.type) for f in More.__fields__] == [
        ("gain", float), ("names", list[str]), ("sizes", dict[str, np.ndarray])
    ]  # fmt: skip
    assert repr(More(sizes={"a": [1]})) == "More(gain=3.0, names=['a'], sizes={'a': array([1.])})"
    assert Inner().gain == 2.0


def test_types_of_all_settings_are_there_when_programs_run():
    """A name that only a type checker imports would be missed when somebody sets a setting."""
    import sheldrake.all  # noqa: F401

    def below(cls):
        return [one for sub in cls.__subclasses__() for one in (sub, *below(sub))]

    found = [cls for cls in below(Options) if cls.__module__.startswith("sheldrake")]
    assert len(found) > 60
    for cls in found:
        settings = cls()
        cls(**{field.name: getattr(settings, field.name) for field in cls.__fields__})
