"""Signatures, properties, enums, operators and instantiations, compared by tools/compare_with_pydrake.py."""

import fnmatch
import importlib.util
import pathlib

import pytest

pytest.importorskip("pydrake")
pytestmark = pytest.mark.peer

TOOL = pathlib.Path(__file__).parents[3] / "tools" / "compare_with_pydrake.py"


@pytest.fixture(scope="module")
def tool():
    spec = importlib.util.spec_from_file_location("compare_with_pydrake", TOOL)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def differences(tool):
    return list(tool.differences())


def test_every_difference_has_a_reason(tool, differences):
    assert tool.unexplained(differences) == []


def test_every_reason_is_needed(tool, differences):
    heads = [d.partition("  [")[0] for d in differences]
    assert [p for p in tool.known(stubs=False) if not fnmatch.filter(heads, p)] == []


def test_faults_are_found(tool, monkeypatch):
    from sheldrake.math import RigidTransform, RollPitchYaw
    from sheldrake.multibody.plant import ContactModel, MultibodyPlant, MultibodyPlantConfig

    def other_name(self, context, positions):
        pass

    def other_default(self, name, joint, effort_limit=1.0):
        pass

    monkeypatch.setattr(MultibodyPlant, "CalcMassMatrix", other_name)
    monkeypatch.setattr(MultibodyPlant, "AddJointActuator", other_default)
    monkeypatch.setattr(MultibodyPlant, "num_bodies", property(lambda self: 0))
    monkeypatch.setattr(RigidTransform, "Identity", lambda self: None)
    monkeypatch.delattr(RigidTransform, "__matmul__")
    monkeypatch.setattr(RollPitchYaw, "roll_angle", property(lambda self: 0.0))
    monkeypatch.setattr(MultibodyPlantConfig, "time_step", property(lambda self: 0.0))
    monkeypatch.delitem(ContactModel._member_map_, "kHydroelastic")
    found = "\n".join(tool.differences("sheldrake.m"))
    for line in (
        "multibody.plant.MultibodyPlant.CalcMassMatrix: by position",
        "multibody.plant.MultibodyPlant.AddJointActuator: default of 'effort_limit' is 1.0",
        "multibody.plant.MultibodyPlant.num_bodies: is no method",
        "math.RigidTransform.Identity: is not static",
        "math.RigidTransform.__matmul__: missing operator",
        "math.RollPitchYaw.roll_angle: is no method",
        "multibody.plant.MultibodyPlantConfig.time_step: cannot be set",
        "multibody.plant.ContactModel.kHydroelastic: missing member",
    ):
        assert line in found
