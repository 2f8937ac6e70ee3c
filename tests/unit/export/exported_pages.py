"""Simulators that pages are made of."""

import importlib
from typing import NamedTuple

import numpy as np

import sheldrake
from sheldrake.geometry import Box, HalfSpace
from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.multibody.tree import SpatialInertia, UnitInertia
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.controllers import PidController
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import ConstantVectorSource, LogVectorOutput


def falling_block(name=None):
    """A block over a floor; with a name, a box of that name in a plant of that name."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    if name is None:
        Parser(plant).AddModels(sheldrake.model_path("two_hole_block/two_hole_block.urdf"))
        body = plant.GetBodyByName("body")
    else:
        plant.set_name(name)
        inertia = SpatialInertia(0.5, np.zeros(3), UnitInertia.SolidBox(0.1, 0.1, 0.1))
        body = plant.AddRigidBody(name, inertia)
        plant.RegisterVisualGeometry(body, RigidTransform(), Box(0.1, 0.1, 0.1), name, [0.4, 0.6, 0.8, 1.0])
        plant.RegisterCollisionGeometry(body, RigidTransform(), Box(0.1, 0.1, 0.1), name, CoulombFriction(0.7, 0.5))
    ground = HalfSpace()
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), ground, "ground", CoulombFriction(0.7, 0.5))
    plant.RegisterVisualGeometry(plant.world_body(), RigidTransform(), ground, "ground", [0.5, 0.5, 0.5, 1.0])
    plant.Finalize()
    LogVectorOutput(plant.get_state_output_port(), builder)
    diagram = builder.Build()
    diagram.set_name("block")
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetFreeBodyPose(context, body, RigidTransform(RollPitchYaw(0.3, 0.2, 0.1), [0.0, 0.0, 0.15]))
    return simulator


def arm():
    """An arm of six joints under a PidController."""
    from examples.arm_pid import GOAL
    from examples.arm_pid import arm as description

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    Parser(plant).AddModelsFromString(description(), "xml")
    for i in plant.GetJointActuatorIndices():  # geared motors: 0.1 kg m^2 at each joint
        motor = plant.get_joint_actuator(i)
        motor.set_default_rotor_inertia(1e-5)
        motor.set_default_gear_ratio(100.0)
    plant.Finalize()
    n = plant.num_positions()
    goal = builder.AddSystem(ConstantVectorSource(np.concatenate([GOAL, np.zeros(n)])))
    pid = builder.AddSystem(PidController(np.full(n, 60.0), np.full(n, 10.0), np.full(n, 6.0)))
    builder.Connect(plant.get_state_output_port(), pid.get_input_port_estimated_state())
    builder.Connect(goal.get_output_port(), pid.get_input_port_desired_state())
    builder.Connect(pid.get_output_port(), plant.get_actuation_input_port())
    LogVectorOutput(plant.get_state_output_port(), builder, 0.01)
    return Simulator(builder.Build())


def native_state(simulator, time):
    """Positions and velocities of the simulator's plant at a time [s]."""
    simulator.AdvanceTo(time)
    plant = next(s for s in simulator.get_system().GetSystems() if hasattr(s, "GetPositionsAndVelocities"))
    return plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(simulator.get_context()))


class Scene(NamedTuple):
    """An example and when it is looked at.

    Attributes:
        example: Module in `examples`, or "" for the arm of this file.
        before: A time before the first contact, or early [s].
        after: A time through contacts [s]: 1 s, but less where native runs that begin a last bit apart part by more
            than 1e-6 until then, as a heap's do.
        more: Arguments of its `main`.
    """

    example: str
    before: float
    after: float = 1.0
    more: dict = {}


SCENES = {
    "block": Scene("drop_the_block", 0.1),
    "arm": Scene("", 0.5),
    "inverse": Scene("arm_pid", 0.5),
    "gripper": Scene("gripper", 0.3),
    "cart-pole": Scene("cart_pole_lqr", 0.5),
    "quadruped": Scene("quadruped", 0.005),
    "clutter": Scene("clutter", 0.1, 0.18, {"number": 20}),
    "soft ball": Scene("soft_ball", 0.05),
}
_ADVANCE = Simulator.AdvanceTo


class _Found(BaseException):
    """The simulator that an example would advance."""


def simulator_of(name):
    """What a scene simulates, before its first step."""
    scene = SCENES[name]
    if not scene.example:
        return arm()

    def advance_to(self, *_):
        raise _Found(self)

    Simulator.AdvanceTo = advance_to
    try:
        importlib.import_module(f"examples.{scene.example}").main(**scene.more)
    except _Found as found:
        return found.args[0]
    finally:
        Simulator.AdvanceTo = _ADVANCE
    raise RuntimeError(f"{scene.example} simulates nothing")
