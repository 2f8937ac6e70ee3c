"""A run that can stop half-way: block on the ground, noisy controlled integrator, logs; a program and functions.

python saved_run.py save FILE     runs to 0.5 s and saves
python saved_run.py go-on FILE    loads, runs to 1 s and writes the results to FILE.npz
"""

import sys

import numpy as np

from sheldrake.common import RandomDistribution
from sheldrake.geometry import Box, HalfSpace
from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.multibody.tree import SpatialInertia
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.controllers import PidController
from sheldrake.systems.framework import DiagramBuilder, LoadContext, SaveContext
from sheldrake.systems.primitives import Adder, ConstantVectorSource, Integrator, LogVectorOutput, RandomSource


def build(mass=1.0):
    """The diagram."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    body = plant.AddRigidBody("body", SpatialInertia.SolidBoxWithMass(mass, 0.1, 0.2, 0.3))
    friction = CoulombFriction(0.7, 0.5)
    plant.RegisterCollisionGeometry(body, RigidTransform(), Box(0.1, 0.2, 0.3), "box", friction)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", friction)
    plant.SetDefaultFloatingBaseBodyPose(body, RigidTransform(RollPitchYaw(0.3, 0.2, 0.1), [0.0, 0.0, 0.25]))
    plant.Finalize()
    noise = builder.AddNamedSystem("noise", RandomSource(RandomDistribution.kGaussian, 1, 0.01))
    signal = builder.AddNamedSystem("signal", Integrator(1))
    pid = builder.AddNamedSystem("pid", PidController([5.0], [2.0], [0.0]))
    goal = builder.AddNamedSystem("goal", ConstantVectorSource([1.0, 0.0]))
    rate = builder.AddNamedSystem("rate", Adder(2, 1))
    state = builder.AddNamedSystem("state", _WithZeroRate())
    builder.Connect(noise.get_output_port(), rate.get_input_port(0))
    builder.Connect(pid.get_output_port(), rate.get_input_port(1))
    builder.Connect(rate.get_output_port(), signal.get_input_port())
    builder.Connect(signal.get_output_port(), state.get_input_port())
    builder.Connect(state.get_output_port(), pid.get_input_port_estimated_state())
    builder.Connect(goal.get_output_port(), pid.get_input_port_desired_state())
    LogVectorOutput(plant.get_state_output_port(), builder).set_name("plant log")
    LogVectorOutput(signal.get_output_port(), builder, 0.01).set_name("signal log")
    return builder.Build()


def _WithZeroRate():
    from sheldrake.systems.primitives import MatrixGain

    return MatrixGain(np.array([[1.0], [0.0]]))


def results(diagram, context):
    """State and logs."""
    found = {"x": np.concatenate([context.get_continuous_state_vector().CopyToVector(), _discrete(context)])}
    for name in ("plant log", "signal log"):
        log = diagram.GetSubsystemByName(name).FindLog(context)
        found[name + " times"], found[name] = log.sample_times(), log.data()
    return found


def _discrete(context):
    state = context.get_discrete_state()
    return np.concatenate([state.get_vector(k).CopyToVector() for k in range(state.num_groups())])


if __name__ == "__main__":
    diagram = build()
    if sys.argv[1] == "save":
        context = diagram.CreateDefaultContext()
        Simulator(diagram, context).AdvanceTo(0.5)
        SaveContext(context, sys.argv[2])
    else:
        context = LoadContext(diagram, sys.argv[2])
        Simulator(diagram, context).AdvanceTo(1.0)
        np.savez(sys.argv[2] + ".npz", **results(diagram, context))
