"""Settings behave as pydrake's: values that are taken, values and names that are refused, copies, equality, YAML."""

import copy
import functools
import importlib
import re

import numpy as np
import pytest

pytest.importorskip("pydrake")

from newer_settings import newer_than

pytestmark = pytest.mark.peer

CLASSES = (
    "geometry.DefaultProximityProperties",
    "geometry.SceneGraphConfig",
    "geometry.optimization.GcsGraphvizOptions",
    "geometry.LightParameter",
    "geometry.RenderEngineGlParams",
    "lcm.DrakeLcmParams",
    "manipulation.IiwaDriver",
    "manipulation.SchunkWsgDriver",
    "manipulation.ZeroForceDriver",
    "multibody.optimization.CalcGridPointsOptions",
    "multibody.plant.MultibodyPlantConfig",
    "systems.analysis.SimulatorConfig",
    "systems.primitives.SelectorParams",
    "systems.sensors.CameraConfig",
    "visualization.VisualizationConfig",
)
VALUES = (object(), "abc", 3, 2.5, True, None, [1.0, 2.0, 3.0], np.array([1.0, 2.0, 3.0]), {})


def found(library, name):
    module, _, cls = name.rpartition(".")
    return getattr(importlib.import_module(f"{library}.{module}"), cls)


def outcome(call):
    try:
        return repr(call())
    except Exception as error:
        return type(error).__name__


def behaviour(library, name):
    cls = found(library, name)
    yaml = importlib.import_module(f"{library}.common.yaml")
    one, other = cls(), cls()
    said = {
        "repr": repr(one),
        "equal": (one == other, one == one, hash(one) == hash(one)),
        "copies": [repr(copied(one)) for copied in (copy.copy, copy.deepcopy)],
        "wrong name": (outcome(lambda: cls(nonsense=1)), outcome(lambda: setattr(one, "nonsense", 1))),
        "by position": outcome(lambda: cls(1)),
        "yaml": yaml.yaml_dump_typed(one),
        "back": repr(yaml.yaml_load_typed(schema=cls, data=yaml.yaml_dump_typed(one))),
    }
    for field in cls.__fields__:
        for value in VALUES:
            options = cls()
            said[field.name, str(value)[:8]] = (
                outcome(functools.partial(setattr, options, field.name, value)),
                repr(options),
            )
    return said


def without(fields, said):
    """What was said, in tuples, lists and texts of Python and YAML, without some fields."""
    if isinstance(said, str):
        for field in fields:
            said = re.sub(rf", {field}=[^,)]*|^{field}: .*\n", "", said, flags=re.MULTILINE)
        return said
    return type(said)(without(fields, one) for one in said) if isinstance(said, (list, tuple)) else said


@pytest.mark.parametrize("name", CLASSES)
def test_behaviour(name):
    newer = newer_than(found("pydrake", name), name)
    ours, theirs = behaviour("sheldrake", name), behaviour("pydrake", name)
    ours = {key: without(newer, value) for key, value in ours.items() if key[0] not in newer}
    assert list(ours) == list(theirs)
    assert {k: v for k, v in ours.items() if v != theirs[k]} == {}


def test_a_lax_setting_is_noticed(monkeypatch):
    from sheldrake.common import _options

    monkeypatch.setattr(_options, "converted", lambda where, kind, value: value)
    with pytest.raises(AssertionError):
        test_behaviour("manipulation.IiwaDriver")


@pytest.mark.parametrize(
    "name",
    [
        "systems.controllers.DynamicProgrammingOptions",
        "systems.controllers.FiniteHorizonLinearQuadraticRegulatorOptions",
        "systems.analysis.RegionOfAttractionOptions",
        "systems.analysis.InitializeParams",
        "solvers.SemidefiniteRelaxationOptions",
        "multibody.tree.PdControllerGains",
        "multibody.tree.DoorHingeConfig",
        "multibody.plant.ExternallyAppliedSpatialForce",
        "multibody.inverse_kinematics.DifferentialInverseKinematicsResult",
    ],
)
def test_a_misspelt_setting_is_refused(name):
    for library in ("sheldrake", "pydrake"):
        with pytest.raises(AttributeError):
            found(library, name)().no_such_setting = 1
