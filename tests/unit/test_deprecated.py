"""Calls that Drake 1.51 is about to remove warn as they do there: once a call, of who called."""

import os
import pathlib
import subprocess
import sys
import warnings

import pytest

from sheldrake.all import (
    AddMultibodyPlantSceneGraph,
    AutoDiffXd,
    DiagramBuilder,
    LeafSystem,
    MultibodyPlant,
    RigidTransform,
    Simulator,
    Simulator_,
    SpatialInertia,
    SpatialVelocity,
)
from sheldrake.common.deprecation import DrakeDeprecationWarning
from sheldrake.multibody.parsing import Parser
from sheldrake.systems.analysis import ApplySimulatorConfig, ExtractSimulatorConfig, SimulatorConfig

ROOT = pathlib.Path(__file__).parents[2]
X, V = RigidTransform([1.0, 2.0, 3.0]), SpatialVelocity([0.0, 0, 1], [2.0, 0, 0])


def floating():
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    plant.Finalize()
    return plant, body, plant.CreateDefaultContext()


plant, body, context = floating()
simulator = Simulator(plant)
model = body.model_instance()

RETIRED = {
    "is_floating_base_body": lambda: body.is_floating(),
    "HasUniqueFloatingBaseBody": lambda: plant.HasUniqueFreeBaseBody(model),
    "HasUniqueFloatingBaseBody()": lambda: plant.HasUniqueFreeBaseBody(model_instance=model),
    "GetUniqueFloatingBaseBodyOrThrow": lambda: plant.GetUniqueFreeBaseBodyOrThrow(model),
    "GetDefaultFloatingBaseBodyPose": lambda: plant.GetDefaultFreeBodyPose(body),
    "SetDefaultFloatingBaseBodyPose": lambda: plant.SetDefaultFreeBodyPose(body, RigidTransform()),
    "SetDefaultFloatingBaseBodyPose()": lambda: plant.SetDefaultFreeBodyPose(body=body, X_PB=RigidTransform()),
    "X_JpJc": lambda: plant.SetFreeBodyPose(context, body, X_PB=X),
    "V_JpJc": lambda: plant.SetFreeBodySpatialVelocity(body, V, context),
    "V_JpJc)": lambda: plant.SetFreeBodySpatialVelocity(body=body, V_PB=V, context=context),
    "DeclarePerStepPublishEvent": lambda: simulator.set_publish_every_time_step(False),
    "DeclarePerStepPublishEvent()": lambda: Simulator_[AutoDiffXd](plant.ToAutoDiffXd()).set_publish_every_time_step(
        publish=False
    ),
    "DeclareInitializationPublishEvent": lambda: simulator.set_publish_at_initialization(publish=False),
}
"""What the warning names, and what warns."""


@pytest.mark.parametrize("today", RETIRED)
def test_each_call_warns(today):
    for _ in range(2):
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always")
            RETIRED[today]()
        assert [w.category for w in found] == [DrakeDeprecationWarning]
        assert today in str(found[0].message) and "2026-06-01" in str(found[0].message)
        assert found[0].filename == __file__


def test_retired_calls_do_what_todays_do():
    plant, body, context = floating()
    with pytest.warns(DrakeDeprecationWarning):
        assert plant.HasUniqueFreeBaseBody(body.model_instance())
        assert plant.GetUniqueFreeBaseBodyOrThrow(body.model_instance()) is body
        plant.SetDefaultFreeBodyPose(body, X)
        assert plant.GetDefaultFreeBodyPose(body).IsExactlyEqualTo(X)
        plant.SetFreeBodyPose(context, body, X_PB=X)
    assert plant.GetDefaultFloatingBaseBodyPose(body).IsExactlyEqualTo(X)
    assert plant.GetFreeBodyPose(context, body).IsExactlyEqualTo(X)
    with pytest.warns(DrakeDeprecationWarning):
        simulator.set_publish_every_time_step(True)
    assert simulator.get_publish_every_time_step()


def test_a_pose_by_both_names_is_refused():
    with pytest.raises(TypeError, match="SetFreeBodyPose"):
        plant.SetFreeBodyPose(context, body, X, X_PB=X)


def test_todays_calls_and_the_library_itself_do_not_warn():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plant, body, context = floating()
        plant.SetFreeBodyPose(context, body, X)
        plant.SetFreeBodyPose(context=context, body=body, X_JpJc=X)
        plant.SetFreeBodySpatialVelocity(context, body, V)
        plant.SetDefaultFloatingBaseBodyPose(body, X)
        plant.GetDefaultFloatingBaseBodyPose(body)
        talker = LeafSystem()
        talker.DeclareForcedPublishEvent(lambda context: None)
        simulator = Simulator(talker)
        ApplySimulatorConfig(SimulatorConfig(publish_every_time_step=True), simulator)
        assert ExtractSimulatorConfig(simulator).publish_every_time_step
        simulator.Initialize()
        assert simulator.get_num_publishes() == 1
        builder = DiagramBuilder()
        scene = AddMultibodyPlantSceneGraph(builder, 0.01)[0]
        mjcf = '<mujoco model="m"><worldbody><body pos="0 0 1"><freejoint/><geom size="1"/></body></worldbody></mujoco>'
        Parser(scene).AddModelsFromString(mjcf, "xml")


def test_the_alias_warns_of_the_script():
    code = """
import warnings
from pydrake.all import MultibodyPlant, RigidTransform, SpatialInertia
plant = MultibodyPlant(0.0)
ball = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
with warnings.catch_warnings(record=True) as found:
    warnings.simplefilter("always")
    plant.SetDefaultFreeBodyPose(ball, RigidTransform())
assert [(w.filename, w.lineno) for w in found] == [("<stdin>", 8)]
"""
    env = {**os.environ, "PYTHONPATH": str(ROOT / "src"), "SHELDRAKE_QUIET": "1"}
    command = [sys.executable, "-c", "import sheldrake.as_pydrake; exec(compile(open(0).read(), '<stdin>', 'exec'))"]
    result = subprocess.run(command, input=code, env=env, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
