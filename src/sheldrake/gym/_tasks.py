"""Tasks that are ready: vector environments by name."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from gymnasium.spaces import Box

import sheldrake
from sheldrake.geometry import HalfSpace
from sheldrake.gym._adapters import OneEnv
from sheldrake.gym._drake_vector_env import DrakeVectorEnv
from sheldrake.gym._streams import Streams
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction, MultibodyPlant
from sheldrake.multibody.tree import FixedOffsetFrame, PdControllerGains, PrismaticJoint, RevoluteJoint
from sheldrake.systems.analysis import BatchSimulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import Adder, ConstantVectorSource, Gain, Multiplexer

_STANCE = np.tile([0.0, 0.7, -1.4], 4)
_HEIGHT = 2 * 0.22 * math.cos(0.7) + 0.025
"""Of the quadruped's trunk when it stands [m]."""
_LINKS = (0.4, 0.3, 0.2)
"""Lengths of the reaching arm's links [m]."""


def _squares(rows: Any) -> np.ndarray:
    """Sum of squares of each row."""
    return np.add.reduce(np.square(rows), axis=1)


def CartPoleSwingUp(num_envs: int = 1, **options: Any) -> DrakeVectorEnv:
    """A pole on a cart, hanging at first, is to be swung up by forces on the cart and balanced.

    Action: force [10 N], -1 to 1. Observation: x [m], angle from hanging [rad], and their rates. Reward: (1 - cos
    angle) / 2, less 0.1 x² and 0.001 action²; an episode takes 500 steps of 20 ms and ends early beyond 2.4 m.

    Args:
        num_envs: How many environments.
        options: Of DrakeVectorEnv.
    """
    plant = MultibodyPlant(5e-3)
    cart = plant.AddRigidBody("cart", SpatialInertia.SolidBoxWithMass(1.0, 0.3, 0.2, 0.1))
    pole = plant.AddRigidBody("pole", SpatialInertia.ThinRodWithMassAboutEnd(0.2, 0.6, [0.0, 0.0, -1.0]))
    slide = plant.AddJoint(PrismaticJoint("slide", plant.world_frame(), cart.body_frame(), [1.0, 0.0, 0.0]))
    plant.AddJoint(RevoluteJoint("hinge", cart.body_frame(), pole.body_frame(), [0.0, 1.0, 0.0]))
    plant.AddJointActuator("force", slide)
    plant.Finalize()
    builder = DiagramBuilder()
    builder.AddSystem(plant)
    force = builder.AddSystem(Gain(10.0, 1))
    builder.Connect(force.get_output_port(), plant.get_actuation_input_port())
    builder.ExportInput(force.get_input_port(), "action")
    builder.ExportOutput(plant.get_state_output_port(), "observation")

    def reset_state(batch: BatchSimulator, worlds: np.ndarray, streams: Streams) -> None:
        batch.states(plant)[worlds] = streams.uniform(worlds, -0.05, 0.05, 4)

    def reward(batch: BatchSimulator, actions: np.ndarray) -> np.ndarray:
        x = batch.states(plant)
        return 0.5 * (1.0 - np.cos(x[:, 1])) - 0.1 * x[:, 0] ** 2 - 0.001 * np.asarray(actions)[:, 0] ** 2

    return DrakeVectorEnv(
        builder.Build(),
        num_envs,
        reward=reward,
        reset_state=reset_state,
        terminated=lambda batch: np.abs(batch.states(plant)[:, 0]) > 2.4,
        **{
            "steps_per_action": 4,
            "max_episode_steps": 500,
            "action_space": Box(-1.0, 1.0, (1,)),
            **options,
        },
    )


def QuadrupedStand(num_envs: int = 1, **options: Any) -> DrakeVectorEnv:
    """A quadruped, dropped a little and pushed, is to stand still.

    Action: offsets of the twelve joints' targets from those of standing [0.3 rad], -1 to 1, which PD gains of the
    motors follow. Observation: the plant's positions and velocities. Reward: the trunk's vertical axis along the
    world's, less 10 times its height error squared [m²], 0.05 times its squared velocity and 0.01 mean squared actions;
    an episode takes 250 steps of 4 ms and ends early when the trunk is below half its height or on its side.

    Args:
        num_envs: How many environments.
        options: Of DrakeVectorEnv.
    """
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    (robot,) = Parser(plant).AddModels(sheldrake.model_path("quadruped/quadruped.urdf"))
    ground = plant.world_body(), RigidTransform(), HalfSpace(), "ground", CoulombFriction(0.8, 0.8)
    plant.RegisterCollisionGeometry(*ground)
    for i in plant.GetJointActuatorIndices():
        plant.get_joint_actuator(i).set_controller_gains(PdControllerGains(p=300.0, d=8.0))
    plant.Finalize()
    offset = builder.AddSystem(Gain(0.3, 12))
    target = builder.AddSystem(Adder(2, 12))
    stance, still = (builder.AddSystem(ConstantVectorSource(v)) for v in (_STANCE, np.zeros(12)))
    wanted = builder.AddSystem(Multiplexer([12, 12]))
    builder.Connect(offset.get_output_port(), target.get_input_port(0))
    builder.Connect(stance.get_output_port(), target.get_input_port(1))
    builder.Connect(target.get_output_port(), wanted.get_input_port(0))
    builder.Connect(still.get_output_port(), wanted.get_input_port(1))
    builder.Connect(wanted.get_output_port(), plant.get_desired_state_input_port(robot))
    builder.ExportInput(offset.get_input_port(), "action")
    builder.ExportOutput(plant.get_state_output_port(), "observation")

    def upright(x: np.ndarray) -> np.ndarray:
        """Cosine of the trunk's tilt, from its quaternion."""
        return 1.0 - 2.0 * _squares(x[:, 1:3])

    def reset_state(batch: BatchSimulator, worlds: np.ndarray, streams: Streams) -> None:
        noise = streams.uniform(worlds, -1.0, 1.0, 18)
        x = np.zeros((len(worlds), 37))
        x[:, 0], x[:, 6] = 1.0, _HEIGHT + 0.02
        x[:, 7:19] = _STANCE + 0.05 * noise[:, :12]
        x[:, 19:25] = 0.2 * noise[:, 12:]
        batch.states(plant)[worlds] = x

    def reward(batch: BatchSimulator, actions: np.ndarray) -> np.ndarray:
        x = batch.states(plant).copy()  # columns of slabs are far apart
        height = 10.0 * np.square(x[:, 6] - _HEIGHT)
        effort = 0.05 * _squares(x[:, 22:25]) + 0.01 / 12 * _squares(actions)
        return upright(x) - height - effort

    def fallen(batch: BatchSimulator) -> np.ndarray:
        x = batch.states(plant)[:, :7].copy()
        return (x[:, 6] < 0.5 * _HEIGHT) | (upright(x) < 0.3)

    return DrakeVectorEnv(
        builder.Build(),
        num_envs,
        reward=reward,
        reset_state=reset_state,
        terminated=fallen,
        **{
            "steps_per_action": 4,
            "max_episode_steps": 250,
            "action_space": Box(-1.0, 1.0, (12,)),
            **options,
        },
    )


def ArmReach(num_envs: int = 1, **options: Any) -> DrakeVectorEnv:
    """The tip of an arm of three links, which turn in a horizontal plane, is to reach a point and stay there.

    Action: torques of the joints [2, 1 and 0.5 N m], -1 to 1. Observation: angles [rad], their rates, and the point (x,
    y) [m], which is another in each episode. Reward: less the distance of the tip from the point [m] and 0.01 mean
    squared actions; an episode takes 200 steps of 20 ms.

    Args:
        num_envs: How many environments.
        options: Of DrakeVectorEnv.
    """
    plant = MultibodyPlant(5e-3)
    end = plant.world_frame()
    for k, length in enumerate(_LINKS):
        inertia = SpatialInertia.SolidCylinderWithMassAboutEnd(2.0 * length, 0.03, length, [1.0, 0.0, 0.0])
        link = plant.AddRigidBody(f"link{k}", inertia)
        joint = plant.AddJoint(RevoluteJoint(f"joint{k}", end, link.body_frame(), [0.0, 0.0, 1.0], damping=0.05))
        plant.AddJointActuator(f"motor{k}", joint)
        end = plant.AddFrame(FixedOffsetFrame(f"end{k}", link.body_frame(), RigidTransform([length, 0.0, 0.0])))
    plant.Finalize()
    builder = DiagramBuilder()
    builder.AddSystem(plant)
    torques = builder.AddSystem(Gain([2.0, 1.0, 0.5]))
    point = builder.AddSystem(ConstantVectorSource(np.zeros(2)))
    seen = builder.AddSystem(Multiplexer([6, 2]))
    builder.Connect(torques.get_output_port(), plant.get_actuation_input_port())
    builder.Connect(plant.get_state_output_port(), seen.get_input_port(0))
    builder.Connect(point.get_output_port(), seen.get_input_port(1))
    builder.ExportInput(torques.get_input_port(), "action")
    builder.ExportOutput(seen.get_output_port(), "observation")

    def reset_state(batch: BatchSimulator, worlds: np.ndarray, streams: Streams) -> None:
        batch.states(plant)[worlds, :3] = streams.uniform(worlds, -1.0, 1.0, 3)
        distance, angle = streams.uniform(worlds, 0.0, 1.0, 2).T
        distance, angle = 0.3 + 0.5 * distance, math.pi * (2.0 * angle - 1.0)
        batch.parameters(point)[worlds] = np.column_stack([distance * np.cos(angle), distance * np.sin(angle)])

    def reward(batch: BatchSimulator, actions: np.ndarray) -> np.ndarray:
        angles = np.cumsum(batch.states(plant)[:, :3], axis=1)
        tip = np.stack([np.cos(angles) @ _LINKS, np.sin(angles) @ _LINKS], axis=1)
        distance = np.linalg.norm(tip - batch.parameters(point), axis=1)
        return -distance - 0.01 * np.mean(np.square(actions), axis=1)

    return DrakeVectorEnv(
        builder.Build(),
        num_envs,
        reward=reward,
        reset_state=reset_state,
        **{"steps_per_action": 4, "max_episode_steps": 200, "action_space": Box(-1.0, 1.0, (3,)), **options},
    )


OneCartPoleSwingUp = functools.partial(OneEnv, CartPoleSwingUp)
OneQuadrupedStand = functools.partial(OneEnv, QuadrupedStand)
OneArmReach = functools.partial(OneEnv, ArmReach)
